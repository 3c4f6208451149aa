// What the tests and the table of range maps measure: a photographed ball, and materials of known height.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "encoder/range/range_map.h"
#include "encoder/synth/btf_synth.h"

namespace btfc::test {

// $BTFC_DATA, else ../shared/data beside the sources.
std::filesystem::path range_data_folder();

// Degrees between normals found and true ones.
struct AngularError {
  double mean = 0, median = 0;
};

// A directory of photographs of a ball under known lights, and its mask's path (white inside). The ball is
// the disk of the mask's area about its centroid; the texels of the mask inside that disk count, unknown ones
// with the level normal that they have.
Result<AngularError> ball_error(const std::filesystem::path& folder, const std::filesystem::path& mask,
                                const RangeOptions& options);

// Against the material's own height, both of mean 0: Pearson's correlation, and the root of the mean squared
// difference in texels.
struct HeightError {
  double correlation = 0, rmse = 0;
  double scale = 0;   // of the true height that is nearest to the map
  double relief = 0;  // root mean square of the true height, texels
};
HeightError height_error(const std::vector<float>& heights, const std::vector<double>& truth);

// The true heights of a material, in texels, less their mean.
std::vector<double> true_heights(std::string_view kind, const BtfSynthOptions& options);

}  // namespace btfc::test
