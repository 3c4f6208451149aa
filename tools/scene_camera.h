// From cameras, lights and a surface to the directions and footprints that show (spec/scene.md).
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/json.h"
#include "tools/scene_surface.h"

namespace btfc {

struct SceneCamera {
  Vector3 position, look_at, up;
  double fov = 0;  // vertical, radians
};

struct SceneLight {
  Vector3 vector;  // towards the light, or its position
  bool is_point = false;
};

struct CameraSetup {
  Surface surface;
  std::vector<SceneCamera> frames;
  std::vector<SceneLight> lights;
  std::uint32_t width = 0, height = 0;  // pixels
  double cell = 0;                      // radians
  std::uint32_t most_pairs = 0;
};

// Reads CAMERAS.json; a mesh is looked for beside it.
Result<CameraSetup> read_cameras(const std::string& path);

// A pair of directions that shows, and how often.
struct SeenPair {
  Direction view, light;
  double share = 0;  // of all pixels with a light on them; they sum to 1
};

struct SeenScene {
  std::vector<SeenPair> pairs;
  double radius = 0;  // radians, about a pair's directions, that holds what it stands for
  double footprint_least = 0, footprint_most = 0;  // texels
  std::uint64_t pixels = 0, samples = 0;  // that show the surface; and of these with each light on them
};

// Refused: where nothing shows.
Result<SeenScene> see(const CameraSetup& setup);

// As a scene file: pairs, or views and lights apart where there are more than most_pairs.
Json scene_json(const SeenScene& seen, std::uint32_t most_pairs);

}  // namespace btfc
