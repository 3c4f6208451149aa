// Sorting images onto the grid of their directions.
#include "encoder/input/image_placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace btfc {
namespace {

constexpr std::int64_t kDegree = 1000000;

std::vector<GridDirection> distinct(std::vector<GridDirection> all) {
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

std::uint32_t index_in(const std::vector<GridDirection>& sorted, const GridDirection& direction) {
  return static_cast<std::uint32_t>(std::lower_bound(sorted.begin(), sorted.end(), direction) -
                                    sorted.begin());
}

std::string pair_text(const GridDirection& view, const GridDirection& light) {
  return fmt::format("view {} light {}", to_text(direction_of(view)), to_text(direction_of(light)));
}

// Walks the product beside the sorted images until three gaps are found.
std::string first_gaps(const Placement& placement, const std::vector<PlacedImage>& images) {
  std::string text;
  std::size_t at = 0, found = 0;
  for (const GridDirection& view : placement.views) {
    for (const GridDirection& light : placement.lights) {
      if (at < images.size() && images[at].view == view && images[at].light == light) {
        ++at;
        continue;
      }
      text += (found == 0 ? "" : ", ") + pair_text(view, light);
      if (++found == 3) return text;
    }
  }
  return text;
}

}  // namespace

std::optional<GridDirection> grid_direction(double theta, double phi) {
  if (!(std::fabs(theta) <= 90 + 1e-6) || !std::isfinite(phi)) return std::nullopt;
  if (theta < 0) {
    theta = -theta;
    phi = std::fmod(phi, 360) + 180;
  }
  GridDirection out{std::llround(theta * kDegree), std::llround(std::fmod(phi, 360) * kDegree)};
  out.phi = out.theta == 0 ? 0 : (out.phi % (360 * kDegree) + 360 * kDegree) % (360 * kDegree);
  return out;
}

std::optional<GridDirection> grid_direction(const Vector3& vector) {
  const double length = std::hypot(vector[0], vector[1], vector[2]);
  if (!(length > 1e-4 && std::isfinite(length) && vector[2] >= 0)) return std::nullopt;
  const Direction d = direction_from_vector(vector);
  return grid_direction(degrees(d.theta), degrees(d.phi));
}

Direction direction_of(const GridDirection& direction) {
  return direction_from_degrees(static_cast<double>(direction.theta) / static_cast<double>(kDegree),
                                static_cast<double>(direction.phi) / static_cast<double>(kDegree));
}

Result<Placement> place(std::vector<PlacedImage>& images) {
  std::sort(images.begin(), images.end(), [](const PlacedImage& a, const PlacedImage& b) {
    return std::tie(a.view, a.light, a.path) < std::tie(b.view, b.light, b.path);
  });
  for (std::size_t i = 1; i < images.size(); ++i) {
    if (images[i - 1].view == images[i].view && images[i - 1].light == images[i].light) {
      return bad_data(fmt::format("'{}' and '{}' are both the image of {}, expected one a pair",
                                  images[i - 1].path, images[i].path,
                                  pair_text(images[i].view, images[i].light)));
    }
  }
  std::vector<GridDirection> views, lights;
  for (const PlacedImage& image : images) {
    views.push_back(image.view);
    lights.push_back(image.light);
  }
  Placement out{distinct(std::move(views)), distinct(std::move(lights)), 0, ""};
  out.missing = std::uint64_t{out.views.size()} * out.lights.size() - images.size();
  if (out.missing > 0) out.first_missing = first_gaps(out, images);
  return out;
}

void store_placement(const Placement& placement, const std::vector<PlacedImage>& images, DatasetInfo& info) {
  for (const GridDirection& view : placement.views) info.views.push_back(direction_of(view));
  for (const GridDirection& light : placement.lights) info.lights.push_back(direction_of(light));
  for (const PlacedImage& image : images) {
    info.pairs.push_back({index_in(placement.views, image.view), index_in(placement.lights, image.light)});
  }
}

}  // namespace btfc
