// One image a pair, decoded in parallel straight onto scratch space.
#include "encoder/input/image_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "encoder/for_each_index.h"
#include "encoder/input/read_selection.h"
#include "encoder/input/wavelengths.h"

namespace btfc {
namespace {

std::string shape_of(const ImageFile& file) {
  constexpr std::size_t kShown = 8;
  const std::span names(file.channels);
  return fmt::format("{}x{} texels of {} {} channels ({}{})", file.image.width, file.image.height,
                     file.image.channels, name_of(file.image.type),
                     fmt::join(names.first(std::min(names.size(), kShown)), ", "),
                     names.size() > kShown ? ", …" : "");
}

bool alike(const ImageFile& a, const ImageFile& b) {
  return a.image.width == b.image.width && a.image.height == b.image.height && a.image.type == b.image.type &&
         a.channels == b.channels;
}

// Numbers of the channels by wavelength, upwards; empty where the names are none.
Result<std::vector<std::uint32_t>> spectral_order(const ImageFile& file, const std::string& path) {
  const std::vector<double> wavelengths = wavelengths_of(file.channels);
  std::vector<std::uint32_t> order(wavelengths.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return wavelengths[a] < wavelengths[b]; });
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (wavelengths[order[i]] == wavelengths[order[i - 1]]) {
      return bad_data(fmt::format("'{}' has two channels of {} nm, '{}' and '{}'", path,
                                  wavelengths[order[i]], file.channels[order[i - 1]],
                                  file.channels[order[i]]));
    }
  }
  return order;
}

void reorder(ImageFile& file, const std::vector<std::uint32_t>& order) {
  const std::vector<double> wavelengths = wavelengths_of(file.channels);
  const std::vector<std::uint16_t> stored = file.image.codes;
  const std::size_t n = order.size();
  for (std::size_t i = 0; i < n; ++i) file.channels[i] = fmt::format("{}", wavelengths[order[i]]);
  for (std::size_t t = 0; t < stored.size(); t += n) {
    for (std::size_t i = 0; i < n; ++i) file.image.codes[t + i] = stored[t + order[i]];
  }
}

}  // namespace

Result<Dataset> dataset_of_images(DatasetInfo info, std::span<const std::string> paths,
                                  const DatasetReadOptions& options, const ImageEdit& edit) {
  if (paths.empty()) return bad_data("a data set without images");
  const Result<PairChoice> choice = pairs_to_read(options, info);
  if (!choice) return choice.error();
  info = chosen_info(info, *choice);
  const std::vector<std::size_t>& numbers = choice->pairs;  // of the images to read
  const std::string& first_path = paths[numbers[0]];
  const Result<ImageFile> first = read_image_file(first_path, kMaxDatasetChannels);
  if (!first) return first.error();
  const Result<std::vector<std::uint32_t>> order = spectral_order(*first, first_path);
  if (!order) return order.error();
  const auto finished = [&](ImageFile file, std::size_t i) -> Result<ImageFile> {
    if (!order->empty()) reorder(file, *order);
    if (edit) {
      if (const auto edited = edit(i, file); !edited) return edited.error();
    }
    const Result<Rectangle> r = kept_texels(options, file.image.width, file.image.height, paths[i]);
    if (!r) return r.error();
    if (options.crop) file.image = crop(file.image, r->x, r->y, r->width, r->height);
    return file;
  };

  const Result<ImageFile> kept = finished(*first, numbers[0]);
  if (!kept) return kept.error();
  info.width = kept->image.width;
  info.height = kept->image.height;
  info.type = kept->image.type;
  info.channels = kept->channels;
  if (info.colour_space == ColourSpace::unknown) info.colour_space = kept->image.colour_space;
  if (info.colour_space == ColourSpace::unknown && info.type == SampleType::float16 &&
      info.channels == std::vector<std::string>{"R", "G", "B"}) {
    info.colour_space = ColourSpace::lin_rec709_scene;
  }
  const Result<ImageReduction> reduction = reduction_to_read(options, info, first_path);
  if (!reduction) return reduction.error();
  Result<Dataset> dataset = Dataset::create(reduced_info(info, *reduction), options.scratch_directory);
  if (!dataset) return dataset.error();

  const Result<Done> done = for_each_index(
      numbers.size(),
      [&](std::size_t number) -> Result<Done> {
        const std::size_t i = numbers[number];
        Result<ImageFile> image = read_image_file(paths[i], kMaxDatasetChannels);
        if (image && !alike(*image, *first)) {
          image = bad_data(fmt::format("'{}' has {}, and '{}' has {}; expected all images alike", paths[i],
                                       shape_of(*image), first_path, shape_of(*first)));
        }
        if (image) image = finished(std::move(*image), i);
        if (!image) return image.error();
        dataset->write_image(number, reduced_codes(info, std::move(image->image.codes), *reduction));
        return Done{};
      },
      options.progress);
  if (!done) return done.error();
  return dataset;
}

}  // namespace btfc
