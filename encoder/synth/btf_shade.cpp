// The reflectance of cloth, leather and metal at one place of the relief: four terms.
//   diffuse   Oren and Nayar's as improved by Fujii ("A tiny improvement of Oren-Nayar reflectance model")
//   mirror    anisotropic GGX with height-correlated Smith shadowing (Heitz 2014), Fresnel after Schlick
//   fuzz      Estevez and Kulla's sheen of roughness 1/2 ("Production friendly microfacet sheen BRDF", 2017)
//             with Neubelt and Pettineo's visibility
//   bounce    light from the relief around, on the diffuse albedo
#include "encoder/synth/btf_shade.h"

#include <algorithm>
#include <cmath>

namespace btfc::procedural {
namespace {

// What does not depend on the place: one row a quantity, lights innermost.
struct PairTerms {
  std::vector<float> x, y, z, view_dot, half_length2, fresnel;
};
PairTerms pair_terms(std::span<const GridDirection> lights, const GridDirection& view) {
  PairTerms p;
  for (const GridDirection& l : lights) {
    const float dot = l.x * view.x + l.y * view.y + l.z * view.z;
    const float away = 1 - std::sqrt(std::max(0.5f + 0.5f * dot, 0.0f));  // 1 - cosine of the half angle
    p.x.push_back(l.x);
    p.y.push_back(l.y);
    p.z.push_back(l.z);
    p.view_dot.push_back(dot);
    p.half_length2.push_back(2 + 2 * dot);
    p.fresnel.push_back(away * away * away * away * away);
  }
  return p;
}

struct Vector {
  float x, y, z;
};
Vector scaled(const Vector& v, float s) { return {v.x * s, v.y * s, v.z * s}; }
float dot(const Vector& a, const GridDirection& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// A place that a view sees.
struct Spot {
  Vector normal, along, across;  // along the grain in the surface, and across it
  Finish finish;
  Corners corners;
};
Spot spot_at(const Relief& relief, const Place& place) {
  Spot s{};
  s.corners = corners_at(relief, place.x, place.y);
  float sx = 0, sy = 0;
  Finish& f = s.finish;
  for (std::size_t k = 0; k < 4; ++k) {
    const float w = s.corners.weight[k];
    const std::uint32_t q = s.corners.at[k];
    const Finish& g = relief.finish[q];
    sx += w * relief.slope_x[q];
    sy += w * relief.slope_y[q];
    for (std::size_t c = 0; c < 3; ++c) f.albedo[c] += w * g.albedo[c];
    f.diffuse_roughness += w * g.diffuse_roughness;
    f.specular += w * g.specular;
    f.grain_x += w * g.grain_x;
    f.grain_y += w * g.grain_y;
    f.along += w * g.along;
    f.across += w * g.across;
    f.fuzz += w * g.fuzz;
  }
  s.normal = scaled({-sx, -sy, 1}, 1 / std::sqrt(sx * sx + sy * sy + 1));
  // Between two yarns the mean of their directions; where they cancel, the grain has none: any will do.
  if (f.grain_x * f.grain_x + f.grain_y * f.grain_y < 1e-6f) f.grain_x = 1;
  const Vector t{f.grain_x, f.grain_y, f.grain_x * sx + f.grain_y * sy};
  s.along = scaled(t, 1 / std::sqrt(t.x * t.x + t.y * t.y + t.z * t.z));
  const Vector &n = s.normal, &a = s.along;
  s.across = {n.y * a.z - n.z * a.y, n.z * a.x - n.x * a.z, n.x * a.y - n.y * a.x};
  return s;
}

// Adds a spot's light times `share` to values[channel * lights + light].
void add_spot(const Spot& spot, const LightMaps& maps, const PairTerms& pairs, const GridDirection& view,
              float share, float* values) {
  const std::size_t n = maps.lights;
  const Finish& f = spot.finish;
  // The relief is seen, so that its normal faces the view but for interpolation.
  const float nv = std::max(dot(spot.normal, view), 0.03f);
  const float av = dot(spot.along, view), bv = dot(spot.across, view);
  const float ax2 = f.along * f.along, ay2 = f.across * f.across;
  const float spread = 1 / (f.along * f.across);
  const float smith_view = std::sqrt(ax2 * av * av + ay2 * bv * bv + nv * nv);
  // Fujii's A and B, times pi: 1 and 0 for Lambert.
  const float flat = 1 / (1 + (0.5f - 0.2122066f) * f.diffuse_roughness);
  const float retro = f.diffuse_roughness * flat;
  const Vector &normal = spot.normal, &along = spot.along, &across = spot.across;
  const float specular = f.specular, fuzz = f.fuzz;
  const float inverse_ax2 = 1 / ax2, inverse_ay2 = 1 / ay2;
  const float red = share * f.albedo[0], green = share * f.albedo[1], blue = share * f.albedo[2];
  const auto& w = spot.corners.weight;
  const float *m0 = maps.at(spot.corners.at[0]), *m1 = maps.at(spot.corners.at[1]);
  const float *m2 = maps.at(spot.corners.at[2]), *m3 = maps.at(spot.corners.at[3]);
  const float *lx = pairs.x.data(), *ly = pairs.y.data(), *lz = pairs.z.data();
  const float *view_dot = pairs.view_dot.data(), *half2 = pairs.half_length2.data();
  const float* fresnel = pairs.fresnel.data();
  float* __restrict r = values;
  float* __restrict g = values + n;
  float* __restrict b = values + 2 * n;
  for (std::size_t l = 0; l < n; ++l) {
    const float facing = normal.x * lx[l] + normal.y * ly[l] + normal.z * lz[l];
    const float al = along.x * lx[l] + along.y * ly[l] + along.z * lz[l];
    const float bl = across.x * lx[l] + across.y * ly[l] + across.z * lz[l];
    const float nl = facing > 0 ? facing : 0;
    const float seen = w[0] * m0[l] + w[1] * m1[l] + w[2] * m2[l] + w[3] * m3[l];
    const auto bounced = [&](std::size_t c) {
      const std::size_t i = (c + 1) * n + l;
      return w[0] * m0[i] + w[1] * m1[i] + w[2] * m2[i] + w[3] * m3[i];
    };
    const float lit = seen * nl;

    const float s = view_dot[l] - nl * nv;
    const float larger = nl > nv ? nl : nv;
    const float diffuse = flat + retro * s / (s > 0 ? larger : 1.0f);

    const float hn = nl + nv, ha = al + av, hb = bl + bv, h2 = half2[l];
    const float q = ha * ha * inverse_ax2 + hb * hb * inverse_ay2 + hn * hn;
    // facing, not nl: above 0 also where the light is straight below.
    const float smith_light = std::sqrt(ax2 * al * al + ay2 * bl * bl + facing * facing);
    const float mirror = spread * (h2 * h2) / (q * q) * (specular + (1 - specular) * fresnel[l]) * 0.5f /
                         (nl * smith_view + nv * smith_light);

    const float sine2 = 1 - hn * hn / h2;
    const float sheen = fuzz * 0.5f * (sine2 > 0 ? sine2 : 0) / (nl + nv - nl * nv);

    const float white = share * lit * mirror;
    const float dyed = lit * ((diffuse > 0 ? diffuse : 0) + sheen);
    r[l] += red * (dyed + bounced(0)) + white;
    g[l] += green * (dyed + bounced(1)) + white;
    b[l] += blue * (dyed + bounced(2)) + white;
  }
}

}  // namespace

void shade_texels(const Relief& relief, const LightMaps& maps, std::span<const GridDirection> lights,
                  const GridDirection& view, std::uint32_t x, std::uint32_t y, std::uint32_t count,
                  std::span<float> values) {
  const PairTerms pairs = pair_terms(lights, view);
  std::fill(values.begin(), values.end(), 0.0f);
  constexpr float kShare = 1.0f / (kReliefSteps * kReliefSteps);
  for (std::uint32_t t = 0; t < count; ++t) {
    for (std::uint32_t j = 0; j < kReliefSteps; ++j) {
      for (std::uint32_t i = 0; i < kReliefSteps; ++i) {
        const auto column = static_cast<float>((x + t) * kReliefSteps + i);
        const auto row = static_cast<float>(y * kReliefSteps + j);
        const Spot spot = spot_at(relief, first_hit(relief, view, column, row));
        add_spot(spot, maps, pairs, view, kShare, &values[std::size_t{t} * 3 * lights.size()]);
      }
    }
  }
}

}  // namespace btfc::procedural
