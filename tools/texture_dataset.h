// A .btfc file's BTF as a data set: every measured pair of directions decoded.
#pragma once
#include <optional>
#include <string>

#include "encoder/dataset/dataset.h"
#include "encoder/input/dataset_read.h"
#include "tools/texture_file.h"

namespace btfc {

// Decodes all pairs of all maps of `path`, loaded as `texture`, on the threads of the calling oneTBB arena,
// in samples of `type` (default: the first map's). Quantity, colour space and wrapping are those of the file.
Result<Dataset> decode_dataset(const std::string& path, const btfc_texture* texture,
                               std::optional<SampleType> type, const std::string& scratch_directory);

// For measuring: 16 bits where the file stands for 8 or 16, so that rounding to 8 bits does not count; halves
// where it stands for halves.
Result<Dataset> decode_dataset_finely(const std::string& path, const std::string& scratch_directory);

// The same under the directions and pairs of another data set, whatever the file's own are.
Result<Dataset> decode_dataset_like(const std::string& path, const DatasetInfo& like,
                                    const std::string& scratch_directory);

// The same of a file that is loaded.
Result<Dataset> decode_dataset_like(const Head& head, const btfc_texture* texture, const DatasetInfo& like,
                                    const std::string& scratch_directory);

// The same of the texels and channels that `like` has, which was read with `asked`, whatever part of the
// original the file itself was made of. Refused: a part that does not hold them, or is coarser.
Result<Dataset> decode_dataset_part(const std::string& path, const DatasetInfo& like,
                                    const DatasetReadOptions& asked, const std::string& scratch_directory);

}  // namespace btfc
