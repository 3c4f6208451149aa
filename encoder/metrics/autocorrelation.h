// How a texture's values hang together over distance.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace btfc {

inline constexpr std::size_t kMostLag = 32;  // texels

// R(d) = mean over q of (v(q) - m) (v(q + d) - m) / (s^2 + 1 / (12 * 255^2)), with the mean m, the variance
// s^2, q and q + d inside: 1 where the texture repeats, 0 where nothing hangs together. For lags d = (dx, dy)
// of a half plane, dy 0 … L, dx -L … L (from 1 where dy is 0), L = min(kMostLag, side / 2); by rows. side x
// side values, side a power of two and at least 2.
std::vector<double> autocorrelation(std::span<const double> values, std::size_t side);

// The root mean square of R_a(d) - R_b(d) over the lags; both of one side.
double autocorrelation_distance(std::span<const double> a, std::span<const double> b);

}  // namespace btfc
