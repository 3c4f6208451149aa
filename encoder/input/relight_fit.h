// The fits of Relight: colours of a texel as weighted sums of its coefficients.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "encoder/dataset/direction.h"
#include "format/result.h"

namespace btfc {

enum class RelightForm { ptm_rgb, ptm_lrgb, hsh, rbf, bilinear };

struct RelightFit {
  RelightForm form = RelightForm::ptm_rgb;
  std::uint32_t width = 0, height = 0, planes = 0;
  std::string image_format = "jpg";        // extension of the planes' files
  std::vector<double> scale, bias, range;  // a plane; range for rbf and bilinear
  std::vector<Vector3> lights;             // unit vectors
  double sigma = 0;                        // rbf
  std::uint32_t resolution = 0;            // bilinear: nodes a side
  std::vector<std::uint8_t> basis;         // rbf, bilinear: [plane + 1][node][3]

  // Nodes of the basis: lights or grid points.
  std::size_t nodes() const {
    return form == RelightForm::rbf ? lights.size() : std::size_t{resolution} * resolution;
  }
};

// What info.json says; basis_file is what materials.bin holds, or empty. Checks all sizes and numbers.
Result<RelightFit> parse_relight(const std::string& path, const std::string& json,
                                 const std::vector<std::uint8_t>& basis_file);

// colour[k] = offset[k] + sum over planes p of weight[p][k] c_p, and for ptm_lrgb times planes 0 … 2.
struct RelightWeights {
  std::array<double, 3> offset{};
  std::vector<std::array<double, 3>> weight;
};
RelightWeights relight_weights(const RelightFit& fit, const Vector3& light);

}  // namespace btfc
