// Pixels cast at a surface, sorted into cells of directions.
#include "tools/scene_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>

#include "encoder/output/atomic_file.h"
#include "tools/vector_math.h"

namespace btfc {
namespace {

constexpr double kRadians = std::numbers::pi / 180;
constexpr std::uint64_t kMostRays = std::uint64_t{1} << 26;

// Members of a JSON object, each asked for once and checked; what was not asked for is an error at the end.
class Members {
 public:
  Members(const Json& object, std::string where) : object_(object), where_(std::move(where)) {
    if (!object_.is_object()) fault_ = bad_data(where_ + " is no JSON object");
  }
  bool has(const char* key) const { return object_.is_object() && object_.contains(key); }
  const Json& at(const char* key) {
    static const Json kNone;
    asked_.push_back(key);
    return has(key) ? object_[key] : kNone;
  }
  double number(const char* key, double least, double most, std::optional<double> otherwise = {}) {
    const Json& value = at(key);
    if (value.is_null() && otherwise) return *otherwise;
    if (value.is_number() && value.get<double>() >= least && value.get<double>() <= most)
      return value.get<double>();
    refuse(key, fmt::format("expected a number from {} to {}", least, most));
    return least;
  }
  template <std::size_t count>
  std::array<double, count> numbers(const char* key, double least, double most,
                                    std::optional<std::array<double, count>> otherwise = {}) {
    const Json& value = at(key);
    if (value.is_null() && otherwise) return *otherwise;
    std::array<double, count> out{};
    bool good = value.is_array() && value.size() == count;
    for (std::size_t i = 0; good && i < count; ++i) {
      good = value[i].is_number() && value[i].get<double>() >= least && value[i].get<double>() <= most;
      if (good) out[i] = value[i].get<double>();
    }
    if (!good) refuse(key, fmt::format("expected {} numbers from {} to {}", count, least, most));
    return out;
  }
  std::string text(const char* key) {
    const Json& value = at(key);
    if (value.is_string()) return value.get<std::string>();
    refuse(key, "expected a text");
    return "";
  }
  void refuse(const char* key, const std::string& expected) {
    if (!fault_) fault_ = bad_data(fmt::format("{} has no right '{}', {}", where_, key, expected));
  }
  // The first fault, an unknown member among them.
  std::optional<Error> fault() {
    if (fault_) return fault_;
    for (const auto& [key, value] : object_.items()) {
      if (std::find(asked_.begin(), asked_.end(), key) == asked_.end())
        return bad_data(fmt::format("{} has an unknown member '{}', expected some of {}", where_, key,
                                    fmt::join(asked_, ", ")));
    }
    return std::nullopt;
  }

 private:
  const Json& object_;
  std::string where_;
  std::vector<std::string> asked_;
  std::optional<Error> fault_;
};

constexpr double kFar = 1e9;

Result<Surface> surface_in(const Json& json, const std::string& name) {
  Members m(json, fmt::format("'{}' surface", name));
  const std::string kind = m.text("kind");
  Result<Surface> surface = bad_data("");
  if (kind == "plane") {
    const auto size = m.numbers<2>("size", 1e-9, kFar);
    surface = plane_surface(size[0], size[1], m.number("texels_per_unit", 1e-9, kFar));
  } else if (kind == "sphere") {
    const double radius = m.number("radius", 1e-9, kFar);
    surface = sphere_surface(radius, m.number("texels_per_unit", 1e-9, kFar));
  } else if (kind == "mesh") {
    const auto file = std::filesystem::path(name).parent_path() / m.text("file");
    const auto texels = m.numbers<2>("texels", 1e-9, kFar);
    if (auto fault = m.fault()) return *fault;
    surface = mesh_surface(file.string(), texels[0], texels[1]);
  } else {
    m.refuse("kind", "expected plane, sphere or mesh");
  }
  if (auto fault = m.fault()) return *fault;
  return surface;
}

Result<SceneCamera> camera_in(const Json& json, const std::string& where) {
  Members m(json, where);
  SceneCamera camera;
  camera.position = m.numbers<3>("position", -kFar, kFar);
  camera.look_at = m.numbers<3>("look_at", -kFar, kFar);
  camera.up = m.numbers<3>("up", -kFar, kFar, Vector3{0, 0, 1});
  camera.fov = m.number("fov", 0.001, 170) * kRadians;
  if (auto fault = m.fault()) return *fault;
  if (length(minus(camera.look_at, camera.position)) == 0) return bad_data(where + " looks at where it is");
  return camera;
}

Result<SceneLight> light_in(const Json& json, const std::string& where) {
  Members m(json, where);
  const bool is_point = m.has("position");
  const Vector3 vector = m.numbers<3>(is_point ? "position" : "direction", -kFar, kFar);
  if (!is_point && length(vector) == 0) m.refuse("direction", "expected one longer than 0");
  if (auto fault = m.fault()) return *fault;
  return SceneLight{is_point ? vector : unit(vector), is_point};
}

SceneCamera between(const SceneCamera& a, const SceneCamera& b, double t) {
  const auto mix = [&](const Vector3& x, const Vector3& y) { return along(x, t, minus(y, x)); };
  return {mix(a.position, b.position), mix(a.look_at, b.look_at), mix(a.up, b.up),
          a.fov + t * (b.fov - a.fov)};
}

// A cell of the hemisphere: rings `cell` apart about the normal, divided about as finely.
std::uint32_t cell_of(const Vector3& v, double cell) {
  const Direction d = direction_from_vector(v);
  const auto ring = static_cast<std::uint32_t>(std::lround(d.theta / cell));
  if (ring == 0) return 0;
  const double turn = 2 * std::numbers::pi;
  const auto count =
      static_cast<std::uint32_t>(std::max(1L, std::lround(turn * std::sin(ring * cell) / cell)));
  const auto place = static_cast<std::uint32_t>(std::lround(d.phi / turn * count)) % count;
  return ring << 16 | place;
}

struct Sample {
  std::array<float, 3> view, light;
  std::uint32_t view_cell, light_cell;
};

std::array<float, 3> narrow(const Vector3& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}
Vector3 widen(const std::array<float, 3>& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

Vector3 local(const SurfaceHit& hit, const Vector3& v) {
  return {dot(v, hit.right), dot(v, hit.top), dot(v, hit.normal)};
}

// The eye and what a pixel's ray is made of.
struct Eye {
  Vector3 position, right, down, forward;  // per pixel, per pixel, to the image's plane at depth 1
  double pixel = 0;                        // a pixel's side at depth 1
};

Eye eye_of(const SceneCamera& camera, std::uint32_t height) {
  Eye eye;
  eye.position = camera.position;
  eye.forward = unit(minus(camera.look_at, camera.position));
  Vector3 right = cross(eye.forward, camera.up);
  // Straight along `up` any right will do; the image turns, what it shows stays.
  if (length(right) < 1e-9 * length(camera.up) + 1e-300)
    right = cross(eye.forward, std::abs(eye.forward[0]) < 0.5 ? Vector3{1, 0, 0} : Vector3{0, 1, 0});
  eye.pixel = 2 * std::tan(camera.fov / 2) / height;
  const Vector3 across = unit(right);
  eye.right = along({0, 0, 0}, eye.pixel, across);
  eye.down = along({0, 0, 0}, eye.pixel, cross(eye.forward, across));
  return eye;
}

// Whether the surface itself stands between a point of it and a light.
bool shadowed(const CameraSetup& setup, const SurfaceHit& hit, const Vector3& towards, double distance) {
  const double step = 1e-6 * std::max(1.0, length(hit.position));
  const auto other = setup.surface(along(hit.position, step, hit.normal), towards, step);
  return other && other->distance < distance - step;
}

void look(const CameraSetup& setup, const SceneCamera& camera, SeenScene& seen,
          std::vector<Sample>& samples) {
  const Eye eye = eye_of(camera, setup.height);
  for (std::uint32_t y = 0; y < setup.height; ++y) {
    for (std::uint32_t x = 0; x < setup.width; ++x) {
      const Vector3 ray = along(along(eye.forward, x + 0.5 - 0.5 * setup.width, eye.right),
                                y + 0.5 - 0.5 * setup.height, eye.down);
      const auto hit = setup.surface(eye.position, ray, 1e-9);
      if (!hit) continue;
      const Vector3 view = local(*hit, along({0, 0, 0}, -1, unit(ray)));
      if (view[2] <= 0) continue;  // from behind
      // Depth is what the ray's component along `forward`, which is 1, says: the distance itself.
      const double footprint = hit->distance * eye.pixel / view[2] * hit->texels_per_unit;
      seen.footprint_least = seen.pixels == 0 ? footprint : std::min(seen.footprint_least, footprint);
      seen.footprint_most = std::max(seen.footprint_most, footprint);
      ++seen.pixels;
      for (const SceneLight& light : setup.lights) {
        const Vector3 way = light.is_point ? minus(light.vector, hit->position) : light.vector;
        const Vector3 towards = unit(way), lit = local(*hit, towards);
        if (lit[2] <= 0 || shadowed(setup, *hit, towards, light.is_point ? length(way) : HUGE_VAL)) continue;
        samples.push_back({narrow(view), narrow(lit), cell_of(view, setup.cell), cell_of(lit, setup.cell)});
      }
    }
  }
}

struct CellPair {
  Vector3 view{}, light{};
  std::uint64_t count = 0;
};

double rounded_degrees(double radians) { return std::round(degrees(radians) * 1000) / 1000; }
Json angles(const Direction& d) { return {rounded_degrees(d.theta), rounded_degrees(d.phi)}; }

// Sums of shares over equal directions of one side: cells of views or of lights.
Json side_json(const std::vector<SeenPair>& pairs, Direction SeenPair::*side) {
  std::map<std::pair<double, double>, double> sums;
  for (const SeenPair& p : pairs)
    sums[{rounded_degrees((p.*side).theta), rounded_degrees((p.*side).phi)}] += p.share;
  Json list = Json::array();
  for (const auto& [direction, share] : sums)
    list.push_back({{"direction", {direction.first, direction.second}}, {"weight", share}});
  return {{"list", list}};
}

}  // namespace

Result<CameraSetup> read_cameras(const std::string& path) {
  const Result<Bytes> text = read_file(path);
  if (!text) return text.error();
  const Json root = Json::parse(text->begin(), text->end(), nullptr, false);
  Members m(root, fmt::format("'{}'", path));
  CameraSetup setup;
  const Json &surface = m.at("surface"), &cameras = m.at("cameras"), &lights = m.at("lights");
  const auto image = m.numbers<2>("image", 1, 65536);
  const double steps = m.number("steps", 1, 65536, 1.0);
  setup.cell = m.number("cell", 0.5, 45, 10.0) * kRadians;
  setup.most_pairs = static_cast<std::uint32_t>(m.number("most_pairs", 1, 65536, 1024.0));
  setup.width = static_cast<std::uint32_t>(image[0]);
  setup.height = static_cast<std::uint32_t>(image[1]);
  if (!cameras.is_array() || cameras.empty()) m.refuse("cameras", "expected a list of at least one");
  if (!lights.is_array() || lights.empty()) m.refuse("lights", "expected a list of at least one");
  if (auto fault = m.fault()) return *fault;
  Result<Surface> found = surface_in(surface, path);
  if (!found) return found.error();
  setup.surface = *std::move(found);
  std::vector<SceneCamera> corners;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const auto camera = camera_in(cameras[i], fmt::format("'{}' cameras[{}]", path, i));
    if (!camera) return camera.error();
    corners.push_back(*camera);
  }
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    for (double step = 0; step < std::floor(steps); ++step)
      setup.frames.push_back(between(corners[i], corners[i + 1], step / std::floor(steps)));
  }
  setup.frames.push_back(corners.back());
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const auto light = light_in(lights[i], fmt::format("'{}' lights[{}]", path, i));
    if (!light) return light.error();
    setup.lights.push_back(*light);
  }
  const double rays = double{1} * setup.width * setup.height * static_cast<double>(setup.frames.size()) *
                      static_cast<double>(setup.lights.size());
  if (rays > static_cast<double>(kMostRays))
    return bad_data(
        fmt::format("'{}' asks for {:.0f} pixels with a light, expected at most {}: a smaller "
                    "image shows the same directions",
                    path, rays, kMostRays));
  return setup;
}

Result<SeenScene> see(const CameraSetup& setup) {
  SeenScene seen;
  std::vector<Sample> samples;
  for (const SceneCamera& camera : setup.frames) look(setup, camera, seen, samples);
  if (samples.empty())
    return bad_data(seen.pixels == 0 ? "no pixel shows the surface"
                                     : "no light reaches what the pixels show");
  seen.samples = samples.size();
  // Each cell stands for the mean of what fell into it.
  std::map<std::pair<std::uint32_t, std::uint32_t>, CellPair> cells;
  for (const Sample& s : samples) {
    CellPair& cell = cells[{s.view_cell, s.light_cell}];
    cell.view = along(cell.view, 1, widen(s.view));
    cell.light = along(cell.light, 1, widen(s.light));
    ++cell.count;
  }
  for (const Sample& s : samples) {
    const CellPair& cell = cells[{s.view_cell, s.light_cell}];
    for (const auto& [mean, one] :
         {std::pair(cell.view, widen(s.view)), std::pair(cell.light, widen(s.light))})
      seen.radius =
          std::max(seen.radius, angle_between(direction_from_vector(mean), direction_from_vector(one)));
  }
  for (const auto& [key, cell] : cells) {
    seen.pairs.push_back({direction_from_vector(cell.view), direction_from_vector(cell.light),
                          static_cast<double>(cell.count) / static_cast<double>(samples.size())});
  }
  return seen;
}

Json scene_json(const SeenScene& seen, std::uint32_t most_pairs) {
  Json json;
  if (seen.pairs.size() <= most_pairs) {
    json["pairs"] = Json::array();
    for (const SeenPair& p : seen.pairs)
      json["pairs"].push_back({{"view", angles(p.view)}, {"light", angles(p.light)}, {"weight", p.share}});
  } else {
    json["views"] = side_json(seen.pairs, &SeenPair::view);
    json["lights"] = side_json(seen.pairs, &SeenPair::light);
  }
  // Rounded outwards.
  json["radius"] = std::ceil(degrees(seen.radius) * 100) / 100;
  json["footprints"] = {std::floor(seen.footprint_least * 1000) / 1000,
                        std::min(std::ceil(seen.footprint_most * 1000) / 1000, 1048576.0)};
  return json;
}

}  // namespace btfc
