// The reflectance of cloth, leather and metal at one place of the relief: four terms.
//   diffuse   Oren and Nayar's as improved by Fujii ("A tiny improvement of Oren-Nayar reflectance model")
//   mirror    anisotropic GGX with height-correlated Smith shadowing (Heitz 2014), Fresnel after Schlick
//   fuzz      Estevez and Kulla's sheen of roughness 1/2 ("Production friendly microfacet sheen BRDF", 2017)
//             with Neubelt and Pettineo's visibility
//   bounce    light from the relief around, on the diffuse albedo
#include "encoder/synth/btf_shade.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace btfc::procedural {
namespace {

// What does not depend on the place: one row a quantity, lights innermost.
struct PairTerms {
  std::vector<float> x, y, z, view_dot, half_length2, fresnel;
};
PairTerms pair_terms(std::span<const ReliefDirection> lights, const ReliefDirection& view) {
  PairTerms p;
  for (const ReliefDirection& l : lights) {
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
float dot(const Vector& a, const ReliefDirection& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

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
void add_spot(const Spot& spot, const LightMaps& maps, const PairTerms& pairs, const ReliefDirection& view,
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
  const Vector normal = spot.normal, along = spot.along, across = spot.across;
  // Towards grazing light a rough dielectric does not reach 1: what its facets hide of each other is lost.
  const float specular = f.specular, edge = std::min(1.0f, 9 * specular) - specular, fuzz = f.fuzz;
  const float inverse_ax2 = 1 / ax2, inverse_ay2 = 1 / ay2;
  const float red = share * f.albedo[0], green = share * f.albedo[1], blue = share * f.albedo[2];
  const float w0 = spot.corners.weight[0], w1 = spot.corners.weight[1];
  const float w2 = spot.corners.weight[2], w3 = spot.corners.weight[3];
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
    const float seen = w0 * m0[l] + w1 * m1[l] + w2 * m2[l] + w3 * m3[l];
    const std::size_t l1 = l + n, l2 = l1 + n, l3 = l2 + n;
    const float bounced_red = w0 * m0[l1] + w1 * m1[l1] + w2 * m2[l1] + w3 * m3[l1];
    const float bounced_green = w0 * m0[l2] + w1 * m1[l2] + w2 * m2[l2] + w3 * m3[l2];
    const float bounced_blue = w0 * m0[l3] + w1 * m1[l3] + w2 * m2[l3] + w3 * m3[l3];
    const float lit = seen * nl;

    const float s = view_dot[l] - nl * nv;
    // s / max(nl, nv) where s is above 0, s itself below.
    const float larger = nl > nv ? nl : nv, ahead = s > 0 ? s : 0;
    const float diffuse = flat + retro * (ahead / larger + (s - ahead));

    const float hn = nl + nv, ha = al + av, hb = bl + bv, h2 = half2[l];
    const float q = ha * ha * inverse_ax2 + hb * hb * inverse_ay2 + hn * hn;
    // facing, not nl: above 0 also where the light is straight below.
    const float smith_light = std::sqrt(ax2 * al * al + ay2 * bl * bl + facing * facing);
    const float mirror = spread * (h2 * h2) / (q * q) * (specular + edge * fresnel[l]) * 0.5f /
                         (nl * smith_view + nv * smith_light);

    const float sine2 = 1 - hn * hn / h2;
    const float sheen = fuzz * 0.5f * (sine2 > 0 ? sine2 : 0) / (nl + nv - nl * nv);

    const float white = share * lit * mirror;
    const float dyed = lit * ((diffuse > 0 ? diffuse : 0) + sheen);
    r[l] += red * (dyed + bounced_red) + white;
    g[l] += green * (dyed + bounced_green) + white;
    b[l] += blue * (dyed + bounced_blue) + white;
  }
}

// What a pixel of the camera gathers around a texel's middle: a tent, as of a lens and of the resampling of
// the rectified picture. A slanted camera's pixel covers 1 / cos(theta) more along the view.
struct Footprint {
  struct Ray {
    float x, y, weight;  // grid steps
  };
  std::array<Ray, 9> rays;
};
Footprint footprint(const ReliefDirection& view) {
  constexpr float kSpacing = 0.6f * kReliefSteps;  // of the rays, straight from above
  constexpr float kPixel = 0.45f;                  // side of a camera's pixel, texels
  constexpr std::array<float, 3> kTent{0.25f, 0.5f, 0.25f};
  const float stretch = std::max(kPixel / view.z, 1.0f) - 1;
  const float flat2 = std::max(view.x * view.x + view.y * view.y, 1e-12f);
  Footprint out{};
  for (std::size_t k = 0; k < 9; ++k) {
    const std::size_t i = k % 3, j = k / 3;
    const float x = kSpacing * (static_cast<float>(i) - 1), y = kSpacing * (static_cast<float>(j) - 1);
    const float more = stretch * (x * view.x + y * view.y) / flat2;
    out.rays[k] = {x + more * view.x, y + more * view.y, kTent[i] * kTent[j]};
  }
  return out;
}

}  // namespace

void shade_texels(const Relief& relief, const LightMaps& maps, std::span<const ReliefDirection> lights,
                  const ReliefDirection& view, std::uint32_t x, std::uint32_t y, std::uint32_t count,
                  std::span<float> values) {
  const PairTerms pairs = pair_terms(lights, view);
  std::fill(values.begin(), values.end(), 0.0f);
  const Footprint pixel = footprint(view);
  for (std::uint32_t t = 0; t < count; ++t) {
    // The texel's middle: grid points stand at its quarters.
    const float column = static_cast<float>((x + t) * kReliefSteps) + 0.5f * (kReliefSteps - 1);
    const float row = static_cast<float>(y * kReliefSteps) + 0.5f * (kReliefSteps - 1);
    float* texel = &values[std::size_t{t} * 3 * lights.size()];
    for (const Footprint::Ray& ray : pixel.rays) {
      const Spot spot = spot_at(relief, first_hit(relief, view, column + ray.x, row + ray.y));
      add_spot(spot, maps, pairs, view, ray.weight, texel);
    }
  }
}

}  // namespace btfc::procedural
