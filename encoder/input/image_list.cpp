// One image a pair, decoded in parallel straight onto scratch space.
#include "encoder/input/image_list.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <numeric>

#include "encoder/input/wavelengths.h"

namespace btfc {
namespace {

std::string shape_of(const ImageFile& file) {
  constexpr std::size_t kShown = 8;
  const auto& names = file.channels;
  return fmt::format("{}x{} texels of {} {} channels ({}{})", file.image.width, file.image.height,
                     file.image.channels, name_of(file.image.type),
                     fmt::join(names.begin(), names.begin() + std::min(names.size(), kShown), ", "),
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

Result<Done> crop_to(ImageFile& file, const DatasetReadOptions& options, const std::string& path) {
  if (!options.crop) return Done{};
  const Rectangle& r = *options.crop;
  const Image& image = file.image;
  if (r.width < 1 || r.height < 1 || std::uint64_t{r.x} + r.width > image.width ||
      std::uint64_t{r.y} + r.height > image.height) {
    return bad_argument(fmt::format("the crop {},{},{},{} does not lie inside '{}' of {}x{} texels", r.x, r.y,
                                    r.width, r.height, path, image.width, image.height));
  }
  file.image = crop(image, r.x, r.y, r.width, r.height);
  return Done{};
}

}  // namespace

Result<Dataset> dataset_of_images(DatasetInfo info, std::span<const std::string> paths,
                                  const DatasetReadOptions& options, const ImageEdit& edit) {
  if (paths.empty()) return bad_data("a data set without images");
  const Result<ImageFile> first = read_image_file(paths[0], kMaxDatasetChannels);
  if (!first) return first.error();
  const Result<std::vector<std::uint32_t>> order = spectral_order(*first, paths[0]);
  if (!order) return order.error();
  const auto finished = [&](ImageFile file, std::size_t i) -> Result<ImageFile> {
    if (!order->empty()) reorder(file, *order);
    if (edit) {
      if (const auto edited = edit(i, file); !edited) return edited.error();
    }
    if (const auto cropped = crop_to(file, options, paths[i]); !cropped) return cropped.error();
    return file;
  };

  const Result<ImageFile> kept = finished(*first, 0);
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
  Result<Dataset> dataset = Dataset::create(std::move(info), options.scratch_directory);
  if (!dataset) return dataset.error();

  // The error of the lowest number is reported, whatever thread meets it first.
  std::mutex lock;
  std::size_t done = 0, failed_at = paths.size();
  Error failure;
  std::atomic<std::size_t> lowest_failed{paths.size()};
  tbb::parallel_for(std::size_t{0}, paths.size(), [&](std::size_t i) {
    if (i > lowest_failed.load(std::memory_order_relaxed)) return;
    Result<ImageFile> image = read_image_file(paths[i], kMaxDatasetChannels);
    if (image && !alike(*image, *first)) {
      image = bad_data(fmt::format("'{}' has {}, and '{}' has {}; expected all images alike", paths[i],
                                   shape_of(*image), paths[0], shape_of(*first)));
    }
    if (image) image = finished(std::move(*image), i);
    if (image) dataset->write_image(i, image->image.codes);
    const std::lock_guard<std::mutex> hold(lock);
    if (!image && i < failed_at) {
      failed_at = i;
      failure = image.error();
      lowest_failed.store(i, std::memory_order_relaxed);
    }
    if (options.progress) options.progress(++done, paths.size());
  });
  if (failed_at < paths.size()) return failure;
  return dataset;
}

}  // namespace btfc
