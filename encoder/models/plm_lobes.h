// Lafortune lobes (survey, eq. 3) by Levenberg-Marquardt, sixteen texels at a time.
#pragma once
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "encoder/dataset/direction.h"

namespace btfc {

inline constexpr std::size_t kLobeLanes = 16;
inline constexpr std::size_t kLobeParameters = 5;  // rho, a1, a2, a3, n

// The range that a fit keeps to. |a| is 1: eq. 3 has one parameter more than it has degrees of freedom.
inline constexpr float kLeastLobeExponent = 0.01f, kMostLobeExponent = 64;

// The lights of one view.
struct LobeLights {
  std::vector<std::array<float, 3>> lights;
  std::vector<std::array<float, 3>>
      linear;               // sum of linear[i] value[i]: the vector b of the best value = b . u
  std::vector<float> root;  // of each light's weight: how much its squared error counts
};
// weights: none: all alike.
LobeLights lobe_lights(const std::vector<Vector3>& lights, std::span<const double> weights = {});

struct LobeBatch {
  float parameter[kLobeParameters][kLobeLanes];
  float error[kLobeLanes];  // sum of squares by weights that the lobe leaves over
};

// Good parameters to begin with: of three directions (that of the best linear fit, half way from it to the
// normal, and the mean of the lights weighted by the squares of the values) and n = 1/4, 1, 4, 16 the pair
// that fits best with its best rho. values[light * kLobeLanes + lane].
void start_lobes(const LobeLights& view, const float* values, LobeBatch& lobes);

// So many steps of Levenberg and Marquardt's method from the given parameters; 0: until a step gains less
// than a ten thousandth of the error. Never leaves a lobe worse than it was.
void refine_lobes(const LobeLights& view, const float* values, unsigned steps, LobeBatch& lobes);

// out[i] = the lobe whose parameter m is parameters[m][i], towards a light: as decoders compute it.
void lobe_values(const std::array<const float*, kLobeParameters>& parameters, std::size_t count,
                 const std::array<float, 3>& light, float* out);

}  // namespace btfc
