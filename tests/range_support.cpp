// Balls from masks, heights from ground truth.
#include "tests/range_support.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "encoder/image_file.h"
#include "encoder/input/dataset_read.h"

namespace btfc::test {

std::filesystem::path range_data_folder() {
  const char* named = std::getenv("BTFC_DATA");
  return named != nullptr ? std::filesystem::path(named)
                          : std::filesystem::path(BTFC_SPEC) / "../../shared/data";
}

Result<AngularError> ball_error(const std::filesystem::path& folder, const std::filesystem::path& mask_path,
                                const RangeOptions& options) {
  const Result<DatasetRead> set = read_dataset(folder.string(), {});
  if (!set) return set.error();
  const Result<Image> mask = read_image(mask_path.string());
  if (!mask) return mask.error();
  const DatasetInfo& info = set->dataset.info();
  if (mask->width != info.width || mask->height != info.height)
    return bad_data(mask_path.string() + " is not of the photographs' size");
  const auto inside = [&](std::uint32_t x, std::uint32_t y) {
    return code_value(mask->type, mask->at(x, y, 0)) > 0.5f;
  };
  double area = 0, cx = 0, cy = 0;
  for (std::uint32_t y = 0; y < mask->height; ++y) {
    for (std::uint32_t x = 0; x < mask->width; ++x) {
      if (!inside(x, y)) continue;
      area += 1;
      cx += x;
      cy += y;
    }
  }
  if (area == 0) return bad_data(mask_path.string() + " is empty");
  cx /= area;
  cy /= area;
  const double radius = std::sqrt(area / std::numbers::pi);

  const std::vector<TexelSurface> surface = surface_of_view(set->dataset, 0, options);
  std::vector<double> errors;
  for (std::uint32_t y = 0; y < mask->height; ++y) {
    for (std::uint32_t x = 0; x < mask->width; ++x) {
      const double nx = (x - cx) / radius, ny = (cy - y) / radius, square = nx * nx + ny * ny;
      if (!inside(x, y) || square >= 1) continue;
      const auto& n = surface[std::size_t{y} * mask->width + x].normal;
      const double cosine = nx * static_cast<double>(n[0]) + ny * static_cast<double>(n[1]) +
                            std::sqrt(1 - square) * static_cast<double>(n[2]);
      errors.push_back(degrees(std::acos(std::clamp(cosine, -1.0, 1.0))));
    }
  }
  AngularError error;
  for (const double e : errors) error.mean += e / static_cast<double>(errors.size());
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  error.median = *middle;
  return error;
}

HeightError height_error(const std::vector<float>& heights, const std::vector<double>& truth) {
  double product = 0, mine = 0, theirs = 0, difference = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const auto h = static_cast<double>(heights[i]);
    product += h * truth[i];
    mine += h * h;
    theirs += truth[i] * truth[i];
    difference += (h - truth[i]) * (h - truth[i]);
  }
  const auto n = static_cast<double>(truth.size());
  return {mine > 0 && theirs > 0 ? product / std::sqrt(mine * theirs) : 0, std::sqrt(difference / n),
          theirs > 0 ? product / theirs : 0, std::sqrt(theirs / n)};
}

std::vector<double> true_heights(std::string_view kind, const BtfSynthOptions& options) {
  const Result<BtfGroundTruth> truth = btf_ground_truth(kind, options);
  if (!truth) return {};
  std::vector<double> heights;
  double mean = 0;
  for (const std::uint16_t code : truth->height.codes) {
    heights.push_back(static_cast<double>(code_value(truth->height.type, code)));
    mean += heights.back();
  }
  mean /= static_cast<double>(heights.size());
  for (double& h : heights) h -= mean;
  return heights;
}

}  // namespace btfc::test
