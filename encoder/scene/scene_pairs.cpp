// Directions of a scene -> shares of measured ones -> pairs.
#include "encoder/scene/scene_pairs.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "encoder/dataset/dataset_head.h"
#include "encoder/scene/direction_mesh.h"

namespace btfc {
namespace {

// Names of files round directions: as far beyond the edge of a range as same_direction takes for none.
constexpr double kOnTheEdge = 1e-5;
// A range is looked at in steps of a degree.
constexpr double kStep = std::numbers::pi / 180;
// A grazing view or light still counts for something.
constexpr double kLeastCosine = 0.05;

std::vector<DirectionPoint> points_of(const std::vector<Direction>& directions,
                                      const std::vector<double>& shares) {
  std::vector<DirectionPoint> points;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    if (shares[i] > 0) points.push_back(point_of(directions[i].theta, directions[i].phi));
  }
  return points;
}

// What lies in the range counts 1; where that spans too little, so do the corners of what is missing.
std::vector<double> shares_of_range(const DirectionRange& range, double tolerance,
                                    const std::vector<Direction>& measured, const DirectionMesh& mesh) {
  std::vector<double> shares(measured.size());
  for (std::size_t i = 0; i < measured.size(); ++i)
    shares[i] = angle_to_range(range, unit_vector(measured[i])) <= kOnTheEdge ? 1 : 0;
  const std::vector<DirectionPoint> hull = convex_hull(points_of(measured, shares));
  const auto steps = [](double length) { return std::max(1.0, std::ceil(length / kStep)); };
  const double rows = steps(double{range.theta_most} - range.theta_least);
  for (double row = 0; row <= rows; ++row) {
    const double theta = range.theta_least + (double{range.theta_most} - range.theta_least) * (row / rows);
    const double columns = steps(range.phi_width * std::sin(theta));
    for (double column = 0; column <= columns; ++column) {
      const Vector3 d = unit_vector(Direction{theta, range.phi_from + range.phi_width * (column / columns)});
      if (angle_to_span(hull, d) <= tolerance) continue;
      for (const DirectionShare& corner : mesh.corners(d)) shares[corner.index] = 1;
    }
  }
  return shares;
}

// Where a direction that stands for a cap is looked at: itself, six at the rim, and what was measured within.
std::vector<Vector3> samples_of_cap(const Direction& centre, double radius,
                                    const std::vector<Direction>& measured) {
  const Vector3 z = unit_vector(centre);
  std::vector<Vector3> samples = {z};
  if (radius == 0) return samples;
  const double c = std::cos(centre.theta), s = std::sin(centre.theta), p = std::cos(centre.phi),
               q = std::sin(centre.phi);
  const Vector3 x = {c * p, c * q, -s}, y = {-q, p, 0};
  for (int i = 0; i < 6; ++i) {
    const double a = std::sin(radius) * std::cos(i * std::numbers::pi / 3),
                 b = std::sin(radius) * std::sin(i * std::numbers::pi / 3), along = std::cos(radius);
    samples.push_back(
        surface_direction({along * z[0] + a * x[0] + b * y[0], along * z[1] + a * x[1] + b * y[1],
                           along * z[2] + a * x[2] + b * y[2]}));
  }
  for (const Direction& d : measured) {
    if (angle_between(d, centre) <= radius) samples.push_back(unit_vector(d));
  }
  return samples;
}

// A listed direction's weight, handed to the measured ones that answer for it.
std::vector<DirectionShare> shares_of(const Direction& listed, const Scene& scene,
                                      const std::vector<Direction>& measured, const DirectionMesh& mesh) {
  std::map<std::size_t, double> sums;
  const std::vector<Vector3> samples = samples_of_cap(listed, scene.radius, measured);
  for (const Vector3& sample : samples) {
    for (const DirectionShare& share : mesh.answer(sample, scene.tolerance))
      sums[share.index] += share.weight / static_cast<double>(samples.size());
  }
  std::vector<DirectionShare> shares;
  for (const auto& [index, weight] : sums) shares.push_back({index, weight});
  return shares;
}

std::vector<double> shares_of_side(const SceneSide& side, const Scene& scene,
                                   const std::vector<Direction>& measured) {
  if (side.kind == DomainKind::all) return std::vector<double>(measured.size(), 1.0);
  const DirectionMesh mesh(measured);
  if (side.kind == DomainKind::range) return shares_of_range(side.range, scene.tolerance, measured, mesh);
  std::vector<double> shares(measured.size());
  for (const WeightedDirection& listed : side.list) {
    for (const DirectionShare& share : shares_of(listed.direction, scene, measured, mesh))
      shares[share.index] += listed.weight * share.weight;
  }
  return shares;
}

// How much each view with each light counts, rows of lights.
std::vector<double> table_of_scene(const Scene& scene, const DatasetInfo& info) {
  const std::size_t lights = info.lights.size();
  std::vector<double> table(info.views.size() * lights);
  if (scene.pairs.empty()) {
    const std::vector<double> v = shares_of_side(scene.views, scene, info.views),
                              l = shares_of_side(scene.lights, scene, info.lights);
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = v[i / lights] * l[i % lights];
    return table;
  }
  const DirectionMesh views(info.views), light_mesh(info.lights);
  for (const ScenePair& pair : scene.pairs) {
    const auto l = shares_of(pair.light, scene, info.lights, light_mesh);
    for (const DirectionShare& v : shares_of(pair.view, scene, info.views, views)) {
      for (const DirectionShare& each : l)
        table[v.index * lights + each.index] += pair.weight * v.weight * each.weight;
    }
  }
  return table;
}

// Of each pair; what falls on a pair that was not measured goes to the one that stands for it: added up where
// directions are listed, whose weights say how often each is seen; otherwise all that is needed is alike.
std::vector<double> weights_of_pairs(const std::vector<double>& table, const DatasetInfo& info, bool listed) {
  const std::vector<std::uint32_t> answers = answering_pairs(directions_of(info));
  std::vector<double> weights(info.pairs.size());
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (table[i] == 0 || answers[i] == kNoPair) continue;
    double& to = weights[answers[i]];
    to = listed ? to + table[i] : std::max(to, table[i]);
  }
  return weights;
}

double cosine_weight(const DatasetInfo& info, const DirectionPair& pair) {
  return std::max(std::cos(info.views[pair.view].theta), kLeastCosine) *
         std::max(std::cos(info.lights[pair.light].theta), kLeastCosine);
}

DomainSide domain_side(const SceneSide& side) {
  DomainSide out;
  out.kind = side.kind;
  out.range = side.range;
  for (const WeightedDirection& d : side.list)
    out.points.push_back(point_of(d.direction.theta, d.direction.phi));
  return out;
}

}  // namespace

Result<PairChoice> scene_pairs(const Scene& scene, const DatasetInfo& info) {
  if (!scene.directions()) return all_pairs_of(info);
  PairChoice choice;
  const bool listed =
      !scene.pairs.empty() || scene.views.kind == DomainKind::list || scene.lights.kind == DomainKind::list;
  std::vector<double> weights = weights_of_pairs(table_of_scene(scene, info), info, listed);
  double sum = 0;
  for (std::size_t p = 0; p < weights.size(); ++p) {
    if (weights[p] == 0) continue;
    if (scene.cosine) weights[p] *= cosine_weight(info, info.pairs[p]);
    choice.pairs.push_back(p);
    choice.weights.push_back(weights[p]);
    sum += weights[p];
  }
  if (choice.pairs.empty())
    return bad_data("none of the data set's images is of a view and a light that the scene asks for");
  for (double& weight : choice.weights) weight *= static_cast<double>(choice.pairs.size()) / sum;
  const auto [least, most] = std::minmax_element(choice.weights.begin(), choice.weights.end());
  if (*most - *least < 1e-9) choice.weights.clear();
  return choice;
}

Domain scene_domain(const Scene& scene, std::uint32_t x, std::uint32_t y) {
  Domain d;
  d.views = domain_side(scene.views);
  d.lights = domain_side(scene.lights);
  if (!scene.pairs.empty()) {
    d.views.kind = d.lights.kind = DomainKind::pairs;
    for (const ScenePair& pair : scene.pairs) {
      d.views.points.push_back(point_of(pair.view.theta, pair.view.phi));
      d.lights.points.push_back(point_of(pair.light.theta, pair.light.phi));
    }
  }
  d.tolerance = static_cast<float>(scene.tolerance);
  d.radius = static_cast<float>(scene.radius);
  d.origin_x = x;
  d.origin_y = y;
  d.scale_log2 = scene.scale_log2();
  if (scene.footprints) {
    d.footprint_least =
        static_cast<float>(std::ldexp((*scene.footprints)[0], -static_cast<int>(d.scale_log2)));
    d.footprint_most =
        static_cast<float>(std::ldexp((*scene.footprints)[1], -static_cast<int>(d.scale_log2)));
  }
  return d;
}

}  // namespace btfc
