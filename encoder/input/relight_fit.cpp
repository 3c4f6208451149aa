// info.json -> fit; light -> weights.
#include "encoder/input/relight_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "format/checked.h"
#include "format/limits.h"

namespace btfc {
namespace {

using Json = nlohmann::json;
using std::numbers::pi;

constexpr std::size_t kMaxPlanes = 255, kMaxLights = 10000, kMaxResolution = 256;
constexpr double kLargest = 1e15,
                 kSmallestRange = 1e-6;  // far beyond any fit; sums and quotients stay finite

// Fields of info.json; the first that is missing or of another type is the error.
class Fields {
 public:
  Fields(const Json& object, const std::string& path) : object_(object), path_(path) {}

  double number(const char* key) {
    const Json* found = find(key);
    if (found != nullptr && found->is_number() && std::isfinite(found->get<double>()))
      return found->get<double>();
    return fail(key, "a number"), 0;
  }
  std::uint32_t count(const char* key, std::size_t most) {
    const double value = number(key);
    if (value >= 1 && value <= static_cast<double>(most) && value == std::floor(value))
      return static_cast<std::uint32_t>(value);
    return fail(key, fmt::format("a whole number from 1 to {}", most)), 0;
  }
  std::string text(const char* key) {
    const Json* found = find(key);
    if (found != nullptr && found->is_string()) return found->get<std::string>();
    return fail(key, "a text"), "";
  }
  // size 0: any number of them.
  std::vector<double> numbers(const char* key, std::size_t size) {
    const Json* found = find(key);
    std::vector<double> out;
    bool good = found != nullptr && found->is_array() && (size == 0 || found->size() == size);
    for (std::size_t i = 0; good && i < found->size(); ++i) {
      good = (*found)[i].is_number() && std::fabs((*found)[i].get<double>()) < kLargest;
      if (good) out.push_back((*found)[i].get<double>());
    }
    if (good) return out;
    return fail(key, size == 0 ? "numbers" : fmt::format("{} numbers", size)), std::vector<double>();
  }
  const Json* find(const char* key) const {
    const auto at = object_.is_object() ? object_.find(key) : object_.end();
    return at == object_.end() ? nullptr : &*at;
  }
  void fail(const char* key, const std::string& expected) {
    if (wrong_.empty()) wrong_ = fmt::format("'{}' has a wrong '{}', expected {}", path_, key, expected);
  }
  const std::string& wrong() const { return wrong_; }

 private:
  const Json& object_;
  const std::string& path_;
  std::string wrong_;
};

std::optional<RelightForm> form_of(const std::string& type, const std::string& colours) {
  if (type == "ptm" && colours == "rgb") return RelightForm::ptm_rgb;
  if (type == "ptm" && colours == "lrgb") return RelightForm::ptm_lrgb;
  if (type == "hsh" && colours == "rgb") return RelightForm::hsh;
  if (type == "rbf" && colours == "mrgb") return RelightForm::rbf;
  if (type == "bilinear" && colours == "mrgb") return RelightForm::bilinear;
  return std::nullopt;
}

bool has_basis(RelightForm form) { return form == RelightForm::rbf || form == RelightForm::bilinear; }

// Planes that a form can have: whole terms, no more than there are weights for.
bool planes_fit(RelightForm form, std::uint32_t planes) {
  switch (form) {
    case RelightForm::ptm_rgb:
      return planes % 3 == 0 && planes <= 18;
    case RelightForm::ptm_lrgb:
      return planes > 3 && planes <= 9;
    case RelightForm::hsh:
      return planes == 12 || planes == 27;
    case RelightForm::rbf:
    case RelightForm::bilinear:
      return true;
  }
  return false;
}

// Bytes from the file, or from "basis" in info.json, which newer versions write.
void read_basis(Fields& info, const std::vector<std::uint8_t>& file, RelightFit& fit) {
  const std::size_t size = (std::size_t{fit.planes} + 1) * fit.nodes() * 3;
  if (const Json* listed = info.find("basis")) {
    bool good = listed->is_array() && listed->size() == size;
    for (std::size_t i = 0; good && i < size; ++i) {
      const Json& byte = (*listed)[i];
      good = byte.is_number_integer() && byte.get<std::int64_t>() >= 0 && byte.get<std::int64_t>() <= 255;
      if (good) fit.basis.push_back(static_cast<std::uint8_t>(byte.get<std::int64_t>()));
    }
    if (!good) info.fail("basis", fmt::format("{} bytes", size));
  } else if (file.size() == size) {
    fit.basis = file;
  } else {
    info.fail("basis", fmt::format("{} bytes here or in materials.bin, which has {}", size, file.size()));
  }
}

void read_lights(Fields& info, RelightFit& fit) {
  const std::vector<double> flat = info.numbers("lights", 0);
  if (flat.empty() || flat.size() % 3 != 0 || flat.size() / 3 > kMaxLights) {
    info.fail("lights", fmt::format("x, y, z of 1 to {} lights", kMaxLights));
    return;
  }
  for (std::size_t i = 0; i < flat.size(); i += 3) {
    const double length = std::hypot(flat[i], flat[i + 1], flat[i + 2]);
    if (!(length >= 1e-4 && std::isfinite(length) && flat[i + 2] >= 0)) {
      info.fail("lights", fmt::format("vectors above the surface, light {} is ({}, {}, {})", i / 3, flat[i],
                                      flat[i + 1], flat[i + 2]));
      return;
    }
    fit.lights.push_back({flat[i] / length, flat[i + 1] / length, flat[i + 2] / length});
  }
}

using Weights = std::vector<double>;

Weights polynomial(const Vector3& l) { return {1, l[0], l[1], l[0] * l[0], l[0] * l[1], l[1] * l[1]}; }

// Hemispherical harmonics of Gautron et al., "A Novel Hemispherical Basis for Accurate and Efficient
// Rendering", EGSR 2004, up to order 2, in Relight's order and signs.
Weights harmonics(const Vector3& l) {
  const double phi = std::atan2(l[1], l[0]), c = std::clamp(l[2], 0.0, 1.0);
  const double s = std::sqrt(c - c * c), a = std::sqrt(6 / pi), b = std::sqrt(30 / pi);
  return {1 / std::sqrt(2 * pi),
          a * std::cos(phi) * s,
          std::sqrt(3 / (2 * pi)) * (2 * c - 1),
          a * std::sin(phi) * s,
          b * std::cos(2 * phi) * (c * c - c),
          b * std::cos(phi) * (2 * c - 1) * s,
          std::sqrt(5 / (2 * pi)) * (1 - 6 * c + 6 * c * c),
          b * std::sin(phi) * (2 * c - 1) * s,
          b * std::sin(2 * phi) * (c * c - c)};
}

// Nodes of the basis with their weights, which sum to 1; the others have none.
struct NodeWeight {
  std::size_t node;
  double weight;
};

std::vector<NodeWeight> gaussians(const RelightFit& fit, const Vector3& l) {
  Weights all;
  double sum = 0;
  for (const Vector3& node : fit.lights) {
    const double x = node[0] - l[0], y = node[1] - l[1], z = node[2] - l[2];
    all.push_back(std::exp(-(x * x + y * y + z * z) / (fit.sigma * fit.sigma)));
    sum += all.back();
  }
  // The published cut leaves nothing where a thousand lights share the weight; then all of them stay.
  const double cut = *std::max_element(all.begin(), all.end()) / sum > 0.001 ? 0.001 : 0;
  std::vector<NodeWeight> kept;
  double kept_sum = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!(all[i] / sum > cut)) continue;
    kept.push_back({i, all[i] / sum});
    kept_sum += all[i] / sum;
  }
  for (NodeWeight& each : kept) each.weight /= kept_sum;
  return kept;
}

// The upper half of an octahedron, turned by 45 degrees onto the unit square.
std::vector<NodeWeight> octahedral(const RelightFit& fit, const Vector3& l) {
  const double s = std::fabs(l[0]) + std::fabs(l[1]) + std::fabs(l[2]);
  const std::uint32_t n = fit.resolution;
  const double x = ((l[0] + l[1]) / s + 1) / 2 * (n - 1), y = ((l[1] - l[0]) / s + 1) / 2 * (n - 1);
  const auto i = std::min(n - 2, static_cast<std::uint32_t>(std::max(0.0, x)));
  const auto j = std::min(n - 2, static_cast<std::uint32_t>(std::max(0.0, y)));
  const double u = x - i, v = y - j;
  const std::size_t at = std::size_t{j} * n + i;
  return {{at, (1 - u) * (1 - v)}, {at + 1, u * (1 - v)}, {at + n, (1 - u) * v}, {at + n + 1, u * v}};
}

RelightWeights basis_weights(const RelightFit& fit, const std::vector<NodeWeight>& nodes) {
  RelightWeights out;
  out.weight.resize(fit.planes);
  for (std::size_t p = 0; p <= fit.planes; ++p) {
    for (std::size_t k = 0; k < 3; ++k) {
      double sum = 0;
      for (const NodeWeight& each : nodes) {
        const double byte = fit.basis[(p * fit.nodes() + each.node) * 3 + k];
        sum += each.weight * (p == 0 ? byte / 255 : (byte - 127) / fit.range[p - 1]);
      }
      (p == 0 ? out.offset : out.weight[p - 1])[k] = sum;
    }
  }
  return out;
}

// Term i of an rgb form is red, green and blue in planes 3 i … 3 i + 2; of lrgb it is plane 3 + i.
RelightWeights term_weights(const RelightFit& fit, const Weights& terms) {
  RelightWeights out;
  out.weight.resize(fit.planes);
  for (std::size_t p = 0; p < fit.planes; ++p) {
    if (fit.form != RelightForm::ptm_lrgb) {
      out.weight[p][p % 3] = terms[p / 3];
    } else if (p >= 3) {
      out.weight[p].fill(terms[p - 3]);
    }
  }
  return out;
}

}  // namespace

Result<RelightFit> parse_relight(const std::string& path, const std::string& json,
                                 const std::vector<std::uint8_t>& basis_file) {
  const Json root = Json::parse(json, nullptr, false);
  if (!root.is_object()) return bad_data(fmt::format("'{}' is no JSON object", path));
  Fields info(root, path);
  RelightFit fit;
  const std::string type = info.text("type"), colours = info.text("colorspace");
  fit.width = info.count("width", kMaxSide);
  fit.height = info.count("height", kMaxSide);
  if (info.find("format") != nullptr) fit.image_format = info.text("format");
  if (!info.wrong().empty()) return bad_data(info.wrong());
  const std::optional<RelightForm> form = form_of(type, colours);
  if (!form) {
    return unsupported(
        "", 0,
        fmt::format("'{}' is a fit of type '{}' in '{}', expected ptm in rgb or lrgb, hsh in rgb, "
                    "rbf or bilinear in mrgb",
                    path, type, colours));
  }
  fit.form = *form;
  if (fit.image_format != "jpg" && fit.image_format != "png") info.fail("format", "jpg or png");
  fit.planes = info.count("nplanes", kMaxPlanes);
  if (!planes_fit(fit.form, fit.planes)) info.fail("nplanes", "whole terms, and weights for all of them");
  read_lights(info, fit);
  if (fit.form == RelightForm::rbf && !((fit.sigma = info.number("sigma")) > 1e-3)) {
    info.fail("sigma", "a number above 0.001");
  }
  if (fit.form == RelightForm::bilinear) {
    fit.resolution = info.count("resolution", kMaxResolution);
    if (fit.resolution < 2) info.fail("resolution", "2 or more");
  }
  const Json* materials = info.find("materials");
  if (materials == nullptr || !materials->is_array() || materials->size() != 1) {
    info.fail("materials", "one material");
  }
  if (!info.wrong().empty()) return bad_data(info.wrong());

  Fields material((*materials)[0], path);
  fit.scale = material.numbers("scale", fit.planes);
  fit.bias = material.numbers("bias", fit.planes);
  if (has_basis(fit.form)) {
    fit.range = material.numbers("range", fit.planes);
    for (const double r : fit.range) {
      if (!(std::fabs(r) > kSmallestRange)) material.fail("range", "numbers other than 0");
    }
    read_basis(info, basis_file, fit);
  }
  for (const Fields* fields : {&material, &info}) {
    if (!fields->wrong().empty()) return bad_data(fields->wrong());
  }
  return fit;
}

RelightWeights relight_weights(const RelightFit& fit, const Vector3& light) {
  switch (fit.form) {
    case RelightForm::rbf:
      return basis_weights(fit, gaussians(fit, light));
    case RelightForm::bilinear:
      return basis_weights(fit, octahedral(fit, light));
    case RelightForm::hsh:
      return term_weights(fit, harmonics(light));
    case RelightForm::ptm_rgb:
    case RelightForm::ptm_lrgb:
      break;
  }
  return term_weights(fit, polynomial(light));
}

}  // namespace btfc
