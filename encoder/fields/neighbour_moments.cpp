// Products of blocks of texels.
#include "encoder/fields/neighbour_moments.h"

#include <algorithm>

namespace btfc {
namespace {

constexpr std::uint32_t kReach = 4;
constexpr std::size_t kLeastTexels = 512, kBlock = 512;

}  // namespace

NeighbourMoments neighbour_moments(std::span<const FieldPlane> planes, Neighbourhood kind, bool wraps) {
  const std::uint32_t width = planes[0].width, height = planes[0].height;
  const std::uint32_t below = kind == Neighbourhood::symmetric ? kReach : 0;
  const bool fits = width > 2 * kReach && height > kReach + below &&
                    std::size_t{width - 2 * kReach} * (height - kReach - below) >= kLeastTexels;
  const bool torus = wraps || !fits;
  const std::uint32_t left = torus ? 0 : kReach, top = torus ? 0 : kReach, bottom = torus ? 0 : below;

  NeighbourMoments result;
  result.planes = planes.size();
  const std::size_t columns = (kFieldCandidates + 1) * planes.size();
  result.moments = MatrixD::Zero(as_index(columns), as_index(columns));
  std::vector<double> means;
  for (const FieldPlane& plane : planes) means.push_back(mean_of(plane));
  MatrixD block(as_index(kBlock), as_index(columns));
  Eigen::Index rows = 0;
  const auto flush = [&] {
    const auto part = block.topRows(rows);
    result.moments.noalias() += part.transpose() * part;
    result.samples += static_cast<double>(rows);
    rows = 0;
  };
  const auto fold = [](std::int64_t at, std::uint32_t size) {
    const auto n = static_cast<std::int64_t>(size);
    return static_cast<std::uint32_t>((at % n + n) % n);
  };
  for (std::uint32_t y = top; y + bottom < height; ++y) {
    for (std::uint32_t x = left; x + left < width; ++x) {
      for (std::size_t g = 0; g < planes.size(); ++g) {
        const auto value = [&](std::int64_t at_x, std::int64_t at_y) {
          if (torus) return planes[g].at(fold(at_x, width), fold(at_y, height)) - means[g];
          return planes[g].at(static_cast<std::uint32_t>(at_x), static_cast<std::uint32_t>(at_y)) - means[g];
        };
        for (std::uint32_t s = 0; s < kFieldCandidates; ++s) {
          const FieldOffset o = field_offset(s);
          double v = value(std::int64_t{x} + o.dx, std::int64_t{y} + o.dy);
          if (kind == Neighbourhood::symmetric) v += value(std::int64_t{x} - o.dx, std::int64_t{y} - o.dy);
          block(rows, result.at(s, g)) = v;
        }
        block(rows, result.own(g)) = value(x, y);
      }
      if (++rows == as_index(kBlock)) flush();
    }
  }
  flush();
  result.moments /= result.samples;
  return result;
}

}  // namespace btfc
