// Planes of coefficients -> one image a light.
#include "encoder/input/relight_read.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "encoder/for_each_index.h"
#include "encoder/image_file.h"
#include "encoder/input/directory_files.h"
#include "encoder/input/read_selection.h"
#include "encoder/input/relight_fit.h"
#include "encoder/output/atomic_file.h"

namespace btfc {
namespace {

std::string inside(const std::string& directory, const std::string& name) {
  return (std::filesystem::path(directory) / name).string();
}

bool exists(const std::string& path) {
  std::error_code unknown;
  return std::filesystem::is_regular_file(path, unknown);
}

Result<RelightFit> read_fit(const std::string& directory) {
  const std::string path = inside(directory, "info.json"), basis = inside(directory, "materials.bin");
  const Result<Bytes> json = read_file(path);
  if (!json) return json.error();
  Bytes basis_bytes;
  if (exists(basis)) {
    Result<Bytes> bytes = read_file(basis);
    if (!bytes) return bytes.error();
    basis_bytes = *std::move(bytes);
  }
  return parse_relight(path, std::string(json->begin(), json->end()), basis_bytes);
}

// The planes, three to an image; cropped where asked for.
Result<std::vector<Image>> read_planes(const std::string& directory, const RelightFit& fit,
                                       const DatasetReadOptions& options) {
  const Result<Rectangle> r = kept_texels(options, fit.width, fit.height, directory);
  if (!r) return r.error();
  std::vector<Image> planes;
  for (std::uint32_t i = 0; 3 * i < fit.planes; ++i) {
    const std::string path = inside(directory, fmt::format("plane_{}.{}", i, fit.image_format));
    Result<Image> image = read_image(path, 3);
    if (!image) return image.error();
    if (image->width != fit.width || image->height != fit.height || image->channels != 3 ||
        image->type != SampleType::unorm8) {
      return bad_data(fmt::format("'{}' has {}x{} texels of {} {} channels, expected {}x{} of 3 unorm8", path,
                                  image->width, image->height, image->channels, name_of(image->type),
                                  fit.width, fit.height));
    }
    if (options.crop) {
      image = crop(*image, r->x, r->y, r->width, r->height);
    }
    planes.push_back(std::move(*image));
  }
  return planes;
}

std::vector<std::uint16_t> relit(const RelightFit& fit, const std::vector<Image>& planes,
                                 const Vector3& light) {
  const RelightWeights weights = relight_weights(fit, light);
  // weight c_p = (weight scale / 255) byte - weight scale bias: the bytes are read once, as they are.
  std::array<double, 3> offset = weights.offset;
  std::vector<std::array<double, 3>> factor(fit.planes);
  for (std::size_t p = 0; p < fit.planes; ++p) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double product = weights.weight[p][k] * fit.scale[p];
      factor[p][k] = product / 255;
      offset[k] -= product * fit.bias[p];
    }
  }
  std::vector<std::uint16_t> codes(planes[0].codes.size());
  for (std::size_t t = 0; t < codes.size(); t += 3) {
    std::array<double, 3> colour = offset;
    for (std::size_t p = 0; p < fit.planes; ++p) {
      const double byte = planes[p / 3].codes[t + p % 3];
      for (std::size_t k = 0; k < 3; ++k) colour[k] += factor[p][k] * byte;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      if (fit.form == RelightForm::ptm_lrgb) colour[k] *= planes[0].codes[t + k] / 255.0;
      codes[t + k] = static_cast<std::uint16_t>(std::lrint(255 * std::clamp(colour[k], 0.0, 1.0)));
    }
  }
  return codes;
}

}  // namespace

bool is_relight(const std::string& path) {
  return is_directory(path) && exists(inside(path, "info.json")) &&
         (exists(inside(path, "plane_0.jpg")) || exists(inside(path, "plane_0.png")));
}

Result<DatasetRead> read_relight(const std::string& path, const DatasetReadOptions& options) {
  const Result<RelightFit> fit = read_fit(path);
  if (!fit) return fit.error();
  const Result<std::vector<Image>> planes = read_planes(path, *fit, options);
  if (!planes) return planes.error();

  DatasetInfo info;
  info.width = (*planes)[0].width;
  info.height = (*planes)[0].height;
  info.channels = {"R", "G", "B"};
  info.colour_space = ColourSpace::srgb_rec709_scene;
  info.quantity = Quantity::reflectance_cos;
  info.views = {Direction{}};
  for (const Vector3& light : fit->lights) info.lights.push_back(direction_from_vector(light));
  make_full_product(info);
  const Result<PairChoice> choice = pairs_to_read(options, info);
  if (!choice) return choice.error();
  const std::vector<std::size_t>& lights = choice->pairs;  // their numbers: there is one view
  info = chosen_info(info, *choice);
  const Result<ImageReduction> reduction = reduction_to_read(options, info, path);
  if (!reduction) return reduction.error();
  Result<Dataset> dataset = Dataset::create(reduced_info(info, *reduction), options.scratch_directory);
  if (!dataset) return dataset.error();
  const Result<Done> done = for_each_index(
      lights.size(),
      [&](std::size_t i) {
        dataset->write_image(i,
                             reduced_codes(info, relit(*fit, *planes, fit->lights[lights[i]]), *reduction));
        return Done{};
      },
      options.progress);
  if (!done) return done.error();
  return DatasetRead{
      std::move(*dataset),
      lights.size(),
      "relight",
      {fmt::format("a fit of {} planes, relit at its {} lights", fit->planes, fit->lights.size())}};
}

}  // namespace btfc
