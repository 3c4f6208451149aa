// JSON -> scene, each value checked.
#include "encoder/scene/scene_file.h"

#include <fmt/format.h>

#include <cmath>

#include "encoder/input/json_members.h"
#include "encoder/output/atomic_file.h"

namespace btfc {
namespace {

using Json = nlohmann::json;

constexpr double kRadians = std::numbers::pi / 180;
constexpr double kMostFootprint = 1048576;

std::optional<Error> member_fault(const Json& object, std::initializer_list<std::string_view> known,
                                  const std::string& where) {
  const std::optional<std::string> key = unknown_member(object, known);
  if (!key) return std::nullopt;
  return bad_data(fmt::format("{} has an unknown member '{}', expected some of {}", where, *key,
                              fmt::join(known.begin(), known.end(), ", ")));
}

std::optional<double> number_in(const Json& value, double least, double most) {
  if (!value.is_number()) return std::nullopt;
  const double v = value.get<double>();
  return v >= least && v <= most ? std::optional(v) : std::nullopt;
}

// [first, second] in order.
std::optional<std::array<double, 2>> interval_in(const Json& value, double least, double most) {
  if (!value.is_array() || value.size() != 2) return std::nullopt;
  const auto a = number_in(value[0], least, most), b = number_in(value[1], least, most);
  if (!a || !b) return std::nullopt;
  return std::array<double, 2>{*a, *b};
}

Result<Direction> direction_in(const Json& value, const std::string& where) {
  const auto angles = value.is_array() && value.size() == 2 ? std::optional(value) : std::nullopt;
  const auto theta = angles ? number_in((*angles)[0], 0, 90) : std::nullopt;
  const auto phi = angles ? number_in((*angles)[1], -36000, 36000) : std::nullopt;
  if (theta && phi) return direction_from_degrees(*theta, *phi);
  return bad_data(fmt::format("{} is no [theta, phi] in degrees, theta 0 to 90", where));
}

Result<double> weight_in(const Json& object, const std::string& where) {
  const auto at = object.find("weight");
  if (at == object.end()) return 1.0;
  const auto weight = number_in(*at, 1e-12, 1e12);
  if (weight) return *weight;
  return bad_data(fmt::format("{} has a wrong 'weight', expected a number of 1e-12 to 1e12", where));
}

Result<std::vector<WeightedDirection>> list_in(const Json& value, const std::string& where) {
  if (!value.is_array() || value.empty() || value.size() > kMaxDomainDirections) {
    return bad_data(fmt::format("{} is no list of 1 to {} directions", where, kMaxDomainDirections));
  }
  std::vector<WeightedDirection> list;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::string entry = fmt::format("{}[{}]", where, i);
    const bool weighted = value[i].is_object();
    if (weighted) {
      if (auto fault = member_fault(value[i], {"direction", "weight"}, entry)) return *fault;
    }
    const Result<Direction> direction =
        direction_in(weighted ? value[i].value("direction", Json()) : value[i], entry);
    if (!direction) return direction.error();
    const Result<double> weight = weighted ? weight_in(value[i], entry) : Result<double>(1.0);
    if (!weight) return weight.error();
    list.push_back({*direction, *weight});
  }
  return list;
}

Result<SceneSide> side_in(const Json& value, const std::string& where) {
  if (!value.is_object()) return bad_data(where + " is no JSON object");
  if (auto fault = member_fault(value, {"theta", "phi", "list"}, where)) return *fault;
  SceneSide side;
  if (const auto list = value.find("list"); list != value.end()) {
    if (value.size() > 1) return bad_data(where + " has a 'list' and a range, expected one of them");
    auto directions = list_in(*list, where + ".list");
    if (!directions) return directions.error();
    side.kind = DomainKind::list;
    side.list = *std::move(directions);
    return side;
  }
  if (value.empty()) return bad_data(where + " is empty, expected 'theta', 'phi' or 'list'");
  std::array<double, 2> theta = {0, 90}, phi = {0, 360};
  if (const auto at = value.find("theta"); at != value.end()) {
    const auto found = interval_in(*at, 0, 90);
    if (!found || (*found)[0] > (*found)[1])
      return bad_data(where + ".theta is no [least, most] in degrees, 0 <= least <= most <= 90");
    theta = *found;
  }
  if (const auto at = value.find("phi"); at != value.end()) {
    const auto found = interval_in(*at, -360, 720);
    if (!found || (*found)[1] - (*found)[0] > 360)
      return bad_data(where + ".phi is no [from, to] in degrees of -360 to 720, at most a turn apart");
    phi = *found;
  }
  side.kind = DomainKind::range;
  double width = phi[1] - phi[0];
  if (width < 0) width = std::fmod(std::fmod(width, 360) + 360, 360);  // over 360: [350, 10]
  side.range = {static_cast<float>(theta[0] * kRadians), static_cast<float>(theta[1] * kRadians),
                static_cast<float>(std::fmod(phi[0] + 360, 360) * kRadians),
                static_cast<float>(width * kRadians)};
  return side;
}

Result<std::vector<ScenePair>> pairs_in(const Json& value, const std::string& where) {
  if (!value.is_array() || value.empty() || value.size() > kMaxDomainDirections)
    return bad_data(fmt::format("{} is no list of 1 to {} pairs", where, kMaxDomainDirections));
  std::vector<ScenePair> pairs;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::string entry = fmt::format("{}[{}]", where, i);
    if (!value[i].is_object()) return bad_data(entry + " is no JSON object");
    if (auto fault = member_fault(value[i], {"view", "light", "weight"}, entry)) return *fault;
    const Result<Direction> view = direction_in(value[i].value("view", Json()), entry + ".view");
    if (!view) return view.error();
    const Result<Direction> light = direction_in(value[i].value("light", Json()), entry + ".light");
    if (!light) return light.error();
    const Result<double> weight = weight_in(value[i], entry);
    if (!weight) return weight.error();
    pairs.push_back({*view, *light, *weight});
  }
  return pairs;
}

Result<Rectangle> region_in(const Json& value, const std::string& where) {
  std::array<std::uint32_t, 4> n{};
  bool good = value.is_array() && value.size() == 4;
  for (std::size_t i = 0; good && i < 4; ++i) {
    const auto v = number_in(value[i], i < 2 ? 0 : 1, UINT32_MAX);
    good = v && *v == std::floor(*v);
    if (good) n[i] = static_cast<std::uint32_t>(*v);
  }
  if (good) return Rectangle{n[0], n[1], n[2], n[3]};
  return bad_data(where + " is no [x, y, width, height] of whole numbers with at least one texel");
}

Result<std::vector<std::string>> channels_in(const Json& value, const std::string& where) {
  std::vector<std::string> channels;
  bool good = value.is_array() && !value.empty();
  for (std::size_t i = 0; good && i < value.size(); ++i) {
    good = value[i].is_string() || value[i].is_number_unsigned();
    if (good) channels.push_back(value[i].is_string() ? value[i].get<std::string>() : value[i].dump());
  }
  if (good) return channels;
  return bad_data(where + " is no list of names or numbers of channels, such as [\"R\", 2]");
}

Result<SceneTarget> target_in(const Json& value, const std::string& where) {
  const bool one = value.is_object() && value.size() == 1;
  const auto psnr = one && value.contains("psnr") ? number_in(value["psnr"], 1, 200) : std::nullopt;
  const auto bytes = one && value.contains("bytes") ? number_in(value["bytes"], 1, UINT32_MAX) : std::nullopt;
  SceneTarget target;
  target.psnr = psnr;
  if (bytes && *bytes == std::floor(*bytes)) target.bytes = static_cast<std::uint32_t>(*bytes);
  if (target.psnr || target.bytes) return target;
  return bad_data(where + " is neither {\"psnr\": 1 to 200} nor {\"bytes\": a whole number}");
}

// A member, where there is one, through its parser.
template <class T, class Parse>
std::optional<Error> take(const Json& root, const char* key, const std::string& name, const Parse& parse,
                          T& to) {
  const auto at = root.find(key);
  if (at == root.end()) return std::nullopt;
  auto found = parse(*at, fmt::format("'{}' {}", name, key));
  if (!found) return found.error();
  to = *std::move(found);
  return std::nullopt;
}

Result<double> angle_in(const Json& value, const std::string& where) {
  const auto degrees = number_in(value, 0, 90);
  if (degrees) return *degrees * kRadians;
  return bad_data(where + " is no number of degrees, 0 to 90");
}

Result<bool> cosine_in(const Json& value, const std::string& where) {
  const std::string kind = value.is_string() ? value.get<std::string>() : "";
  if (kind == "uniform" || kind == "cosine") return kind == "cosine";
  return bad_data(where + " is neither \"uniform\" nor \"cosine\"");
}

Result<std::array<double, 2>> footprints_in(const Json& value, const std::string& where) {
  const auto found = interval_in(value, 0, kMostFootprint);
  if (found && (*found)[0] <= (*found)[1]) return *found;
  return bad_data(where + " is no [least, most] in texels, 0 <= least <= most <= 1048576");
}

}  // namespace

std::uint32_t Scene::scale_log2() const {
  if (!footprints || (*footprints)[0] < 2) return 0;
  return std::min(kMaxScaleLog2, static_cast<std::uint32_t>(std::floor(std::log2((*footprints)[0]))));
}

Result<Scene> parse_scene(const std::string& text, const std::string& name) {
  const Json root = Json::parse(text, nullptr, false);
  if (!root.is_object()) return bad_data(fmt::format("'{}' is no JSON object", name));
  if (auto fault = member_fault(root,
                                {"views", "lights", "pairs", "weights", "radius", "tolerance", "footprints",
                                 "region", "channels", "target"},
                                fmt::format("'{}'", name)))
    return *fault;
  Scene scene;
  std::optional<Error> fault;
  const auto member = [&](const char* key, const auto& parse, auto& to) {
    if (!fault) fault = take(root, key, name, parse, to);
  };
  member("views", side_in, scene.views);
  member("lights", side_in, scene.lights);
  member("pairs", pairs_in, scene.pairs);
  member("weights", cosine_in, scene.cosine);
  member("radius", angle_in, scene.radius);
  member("tolerance", angle_in, scene.tolerance);
  member("footprints", footprints_in, scene.footprints);
  member("region", region_in, scene.region);
  member("channels", channels_in, scene.channels);
  member("target", target_in, scene.target);
  if (fault) return *fault;
  if (!scene.pairs.empty() && (root.contains("views") || root.contains("lights")))
    return bad_data(fmt::format("'{}' has 'pairs' beside 'views' or 'lights', expected one way", name));
  const bool lists =
      !scene.pairs.empty() || scene.views.kind == DomainKind::list || scene.lights.kind == DomainKind::list;
  if (root.contains("radius") && !lists)
    return bad_data(fmt::format("'{}' has a 'radius', which is of listed directions, and lists none", name));
  return scene;
}

Result<Scene> read_scene(const std::string& path) {
  const Result<Bytes> text = read_file(path);
  if (!text) return text.error();
  return parse_scene(std::string(text->begin(), text->end()), path);
}

}  // namespace btfc
