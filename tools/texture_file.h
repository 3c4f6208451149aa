// A .btfc file loaded through the public decoder interface, as an engine would.
#pragma once
#include <memory>
#include <string>

#include "btfc/btfc.hpp"
#include "encoder/image.h"
#include "format/head.h"
#include "format/result.h"

namespace btfc {

using TexturePtr = std::unique_ptr<btfc_texture, TextureFree>;

// selection: as of btfc_texture_load.
Result<TexturePtr> load_texture(const std::string& path, const btfc_selection* selection = nullptr);

// What a file holds, by its HEAD; nothing else is read.
Result<Head> read_file_head(const std::string& path);

// One map of the texture, whole, in its own sample type.
Result<Image> decode_map(const btfc_texture* texture, std::uint32_t map);

// The number of the map with that name; an error lists the names.
Result<std::uint32_t> map_number(const btfc_texture* texture, const std::string& name);

// The error of a failed call of the decoder.
Error from_api(const btfc_error& error);

}  // namespace btfc
