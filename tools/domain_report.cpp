// Domain -> JSON in degrees.
#include "tools/domain_report.h"

#include <cmath>

#include "encoder/dataset/direction.h"
#include "format/directions.h"

namespace btfc {
namespace {

// Single precision holds degrees to some 1e-5.
double rounded(double radians) { return std::round(degrees(radians) * 1e4) / 1e4; }

Json side_json(const DomainSide& side) {
  constexpr const char* kNames[] = {"all", "range", "list", "pairs"};
  Json json = {{"kind", kNames[static_cast<int>(side.kind)]}};
  if (side.kind == DomainKind::range) {
    const DirectionRange& r = side.range;
    json["theta"] = {rounded(r.theta_least), rounded(r.theta_most)};
    json["phi"] = {rounded(r.phi_from), rounded(double{r.phi_from} + r.phi_width)};
  }
  if (side.points.empty()) return json;
  json["list"] = Json::array();
  for (const DirectionPoint& point : side.points) {
    const Direction d = direction_from_vector(btfc::unit_vector(point));
    json["list"].push_back({rounded(d.theta), rounded(d.phi)});
  }
  return json;
}

}  // namespace

Json domain_json(const std::optional<Domain>& domain) {
  if (!domain) return Json();
  const Domain& d = *domain;
  const bool all = d.footprint_least == 0 && d.footprint_most == std::numeric_limits<float>::max();
  return {{"views", side_json(d.views)},
          {"lights", side_json(d.lights)},
          {"tolerance", rounded(d.tolerance)},
          {"radius", rounded(d.radius)},
          {"origin", {d.origin_x, d.origin_y}},
          {"scale", std::uint64_t{1} << d.scale_log2},
          {"footprints", all ? Json() : Json({d.footprint_least, d.footprint_most})}};
}

std::string uncovered_text(std::uint32_t covers) {
  std::string text;
  const auto add = [&](std::uint32_t flag, const char* what) {
    if ((covers & flag) == 0) text += std::string(text.empty() ? "" : ", ") + what;
  };
  add(kCoversView, "the view");
  add(kCoversLight, "the light");
  add(kCoversFootprint, "the footprint");
  return text;
}

}  // namespace btfc
