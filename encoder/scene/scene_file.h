// What a scene asks of a material: directions, how often they occur, distances, texels, channels
// (spec/scene.md).
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "encoder/dataset/direction.h"
#include "encoder/input/dataset_read.h"
#include "format/domain.h"
#include "format/result.h"

namespace btfc {

struct WeightedDirection {
  Direction direction;
  double weight = 1;  // above 0
};

struct SceneSide {
  DomainKind kind = DomainKind::all;  // all, range or list
  DirectionRange range;
  std::vector<WeightedDirection> list;
};

struct ScenePair {
  Direction view, light;
  double weight = 1;  // above 0
};

// What the file should come to; one of both.
struct SceneTarget {
  std::optional<double> psnr;
  std::optional<std::uint32_t> bytes;
};

struct Scene {
  SceneSide views, lights;
  std::vector<ScenePair> pairs;  // if there are some, the sides are of kind all and stand for nothing
  bool cosine = false;           // pairs count by the cosines of view and light
  std::optional<std::array<double, 2>> footprints;  // least and most, texels of the original
  std::optional<Rectangle> region;
  std::vector<std::string> channels;  // names or numbers; empty: all
  std::optional<SceneTarget> target;
  double tolerance = kDefaultTolerance, radius = 0;  // radians

  bool directions() const {
    return !pairs.empty() || cosine || views.kind != DomainKind::all || lights.kind != DomainKind::all;
  }
  // Texels that no footprint resolves become one: floor(log2(least footprint)), at least 0.
  std::uint32_t scale_log2() const;
};

// Of a JSON text; `name` is what errors call it. Unknown members are errors.
Result<Scene> parse_scene(const std::string& text, const std::string& name);
Result<Scene> read_scene(const std::string& path);

}  // namespace btfc
