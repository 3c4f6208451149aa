// From images with a view and a light each to the views, lights and pairs of a data set.
#pragma once
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "encoder/dataset/dataset.h"

namespace btfc {

// A direction in whole millionths of a degree, so that one direction written in two ways compares equal:
// phi in [0, 360), 0 where theta is 0. Ordered as the published lists are: by theta, then phi.
struct GridDirection {
  std::int64_t theta = 0, phi = 0;
  auto operator<=>(const GridDirection&) const = default;
};

// Degrees, phi of any number of turns, theta -90 … 90 (below 0: on the other side, phi + 180). Empty where
// an angle is not finite or theta beyond that.
std::optional<GridDirection> grid_direction(double theta, double phi);
// Of a vector of any length above 1e-4 with z >= 0; empty otherwise.
std::optional<GridDirection> grid_direction(const Vector3& vector);
Direction direction_of(const GridDirection& direction);

struct PlacedImage {
  std::string path;
  GridDirection view, light;
};

// The distinct views and lights in order, and how many of their product there is no image of.
struct Placement {
  std::vector<GridDirection> views, lights;
  std::uint64_t missing = 0;
  std::string first_missing;  // up to three pairs in words
};

// Sorts the images by view, then light. Two of one pair are an error that names both files.
Result<Placement> place(std::vector<PlacedImage>& images);

// What place() found, as directions and pairs: info's pair i is images[i].
void store_placement(const Placement& placement, const std::vector<PlacedImage>& images, DatasetInfo& info);

}  // namespace btfc
