// Options of reading -> pairs, channels and texels.
#include "encoder/input/read_selection.h"

#include "encoder/for_each_index.h"

namespace btfc {

Result<PairChoice> pairs_to_read(const DatasetReadOptions& options, const DatasetInfo& all) {
  if (options.choose) return options.choose(all);
  return all_pairs_of(all);
}

Result<ImageReduction> reduction_to_read(const DatasetReadOptions& options, const DatasetInfo& info,
                                         const std::string& path) {
  const auto channels = channel_numbers(options.channels, info.channels);
  if (!channels) return channels.error();
  if (const auto fits = check_scale(info.width, info.height, options.scale_log2, path); !fits)
    return fits.error();
  return ImageReduction{*channels, options.scale_log2};
}

DatasetInfo reduced_info(DatasetInfo info, const ImageReduction& reduction) {
  info.width >>= reduction.scale_log2;
  info.height >>= reduction.scale_log2;
  if (reduction.channels.empty()) return info;
  std::vector<std::string> kept;
  for (const std::uint32_t c : reduction.channels) kept.push_back(info.channels[c]);
  info.channels = std::move(kept);
  return info;
}

std::vector<std::uint16_t> reduced_codes(const DatasetInfo& info, std::vector<std::uint16_t> codes,
                                         const ImageReduction& reduction) {
  if (reduction.none()) return codes;
  return reduced(image_of(info, std::move(codes)), reduction).codes;
}

Result<Dataset> reduced_dataset(Dataset whole, const DatasetReadOptions& options, const std::string& path) {
  const DatasetInfo& info = whole.info();
  const Result<PairChoice> choice = pairs_to_read(options, info);
  if (!choice) return choice.error();
  const Result<ImageReduction> reduction = reduction_to_read(options, info, path);
  if (!reduction) return reduction.error();
  if (choice->pairs.size() == info.pairs.size() && choice->weights.empty() && reduction->none()) return whole;
  Result<Dataset> part =
      Dataset::create(reduced_info(chosen_info(info, *choice), *reduction), options.scratch_directory);
  if (!part) return part.error();
  const Result<Done> done = for_each_index(choice->pairs.size(), [&](std::size_t i) {
    std::vector<std::uint16_t> codes(info.image_samples());
    whole.read_image(choice->pairs[i], codes);
    part->write_image(i, reduced_codes(info, std::move(codes), *reduction));
    return Done{};
  });
  if (!done) return done.error();
  return part;
}

}  // namespace btfc
