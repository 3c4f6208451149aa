// A .btfc file loaded through the public decoder interface, as an engine would.
#pragma once
#include <memory>
#include <string>

#include "btfc/btfc.hpp"
#include "encoder/image.h"
#include "format/head.h"
#include "format/knobs.h"
#include "format/result.h"

namespace btfc {

using TexturePtr = std::unique_ptr<btfc_texture, TextureFree>;

// selection: as of btfc_texture_load.
Result<TexturePtr> load_texture(const std::string& path, const btfc_selection* selection = nullptr);

// The same of a whole file in memory, which may go away afterwards.
Result<TexturePtr> load_texture(ByteView file, const btfc_selection* selection = nullptr);

// btfc_reader_info of a whole file in memory.
Result<btfc_file_info> file_info(ByteView file);

// btfc_choose over a file.
Result<Done> choose_selection(const std::string& path, const btfc_wanted& wanted, btfc_selection& selection);

// Knobs as a selection has them.
btfc_selection selection_of(const Knobs& knobs);

// What a file holds, by its HEAD; nothing else is read.
Result<Head> read_file_head(const std::string& path);

// One map of the texture, whole, in its own sample type.
Result<Image> decode_map(const btfc_texture* texture, std::uint32_t map);

// The number of the map with that name; an error lists the names.
Result<std::uint32_t> map_number(const btfc_texture* texture, const std::string& name);

// The error of a failed call of the decoder.
Error from_api(const btfc_error& error);

}  // namespace btfc
