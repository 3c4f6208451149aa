// One image a pair, decoded in parallel straight onto scratch space.
#include "encoder/input/image_list.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <mutex>

#include "encoder/image_file.h"

namespace btfc {
namespace {

std::string shape_of(const Image& image) {
  return fmt::format("{}x{} texels of {} {} channels", image.width, image.height, image.channels,
                     name_of(image.type));
}

Result<Image> cropped(Image image, const DatasetReadOptions& options, const std::string& path) {
  if (!options.crop) return image;
  const Rectangle& r = *options.crop;
  if (r.width < 1 || r.height < 1 || std::uint64_t{r.x} + r.width > image.width ||
      std::uint64_t{r.y} + r.height > image.height) {
    return bad_argument(fmt::format("the crop {},{},{},{} does not lie inside '{}' of {}x{} texels", r.x, r.y,
                                    r.width, r.height, path, image.width, image.height));
  }
  return crop(image, r.x, r.y, r.width, r.height);
}

}  // namespace

Result<Dataset> dataset_of_images(DatasetInfo info, std::span<const std::string> paths,
                                  const DatasetReadOptions& options) {
  if (paths.empty()) return bad_argument("a data set without images");
  const Result<Image> first = read_image(paths[0], kMaxDatasetChannels);
  if (!first) return first.error();
  const Result<Image> kept = cropped(*first, options, paths[0]);
  if (!kept) return kept.error();
  info.width = kept->width;
  info.height = kept->height;
  info.type = kept->type;
  if (info.colour_space == ColourSpace::unknown) info.colour_space = kept->colour_space;
  const Result<std::vector<std::string>> names = image_channel_names(paths[0]);
  if (!names) return names.error();
  info.channels = *names;
  Result<Dataset> dataset = Dataset::create(std::move(info), options.scratch_directory);
  if (!dataset) return dataset.error();

  // The error of the lowest number is reported, whatever thread meets it first.
  std::mutex lock;
  std::size_t done = 0, failed_at = paths.size();
  Error failure;
  std::atomic<bool> stop{false};
  tbb::parallel_for(std::size_t{0}, paths.size(), [&](std::size_t i) {
    if (stop.load(std::memory_order_relaxed) && i > failed_at) return;
    Result<Image> image = read_image(paths[i], kMaxDatasetChannels);
    if (image && (image->width != first->width || image->height != first->height ||
                  image->channels != first->channels || image->type != first->type)) {
      image = bad_argument(fmt::format("'{}' has {}, and '{}' has {}; expected all images alike", paths[i],
                                       shape_of(*image), paths[0], shape_of(*first)));
    }
    if (image) image = cropped(std::move(*image), options, paths[i]);
    if (image) dataset->write_image(i, image->codes);
    const std::lock_guard<std::mutex> hold(lock);
    if (!image && i < failed_at) {
      failed_at = i;
      failure = image.error();
      stop.store(true, std::memory_order_relaxed);
    }
    if (options.progress) options.progress(++done, paths.size());
  });
  if (failed_at < paths.size()) return failure;
  return dataset;
}

}  // namespace btfc
