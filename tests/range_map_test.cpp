// Range maps: normals from photographs, heights from normals, and both on surfaces that are known.
#include "encoder/range/range_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "encoder/range/integrate_normals.h"
#include "encoder/run_on_threads.h"
#include "tests/btf_support.h"
#include "tests/range_support.h"

namespace btfc::test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr StereoOptions kRobust{StereoMethod::robust, true}, kPlain{StereoMethod::least_squares, true};

double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

std::vector<Vector3> vectors_of(const std::vector<Direction>& directions) {
  std::vector<Vector3> out;
  for (const Direction& d : directions) out.push_back(unit_vector(d));
  return out;
}

// count lights around a circle of theta degrees, the first at phi = first degrees.
std::vector<Direction> circle(double theta, int count, double first = 0) {
  std::vector<Direction> out;
  for (int i = 0; i < count; ++i) out.push_back(direction_from_degrees(theta, first + 360.0 * i / count));
  return out;
}

// Normals within most_tilt degrees of the z axis, the same ones every time.
std::vector<Vector3> some_normals(std::size_t count, double most_tilt) {
  std::mt19937 random(5);
  std::vector<Vector3> out;
  for (std::size_t i = 0; i < count; ++i) {
    const double a = static_cast<double>(random()) / 4294967296.0,
                 b = static_cast<double>(random()) / 4294967296.0;
    out.push_back(unit_vector(direction_from_degrees(most_tilt * std::sqrt(a), 360 * b)));
  }
  return out;
}

using Shading = std::function<double(const Vector3& normal, const Vector3& light)>;

std::vector<float> shaded(const std::vector<Vector3>& normals, const std::vector<Vector3>& lights,
                          const Shading& shading) {
  std::vector<float> out;
  for (const Vector3& l : lights) {
    for (const Vector3& n : normals) out.push_back(static_cast<float>(shading(n, l)));
  }
  return out;
}

Shading lambert(double albedo) {
  return [albedo](const Vector3& n, const Vector3& l) { return albedo * std::max(dot(n, l), 0.0); };
}

double angle_to(const TexelSurface& found, const Vector3& n) {
  const auto& f = found.normal;
  const Vector3 v{static_cast<double>(f[0]), static_cast<double>(f[1]), static_cast<double>(f[2])};
  return degrees(2 * std::asin(std::min(1.0, std::hypot(v[0] - n[0], v[1] - n[1], v[2] - n[2]) / 2)));
}

double mean_angle(const std::vector<TexelSurface>& found, const std::vector<Vector3>& normals) {
  double sum = 0;
  for (std::size_t i = 0; i < normals.size(); ++i) sum += angle_to(found[i], normals[i]);
  return sum / static_cast<double>(normals.size());
}

void expect_sane(const std::vector<TexelSurface>& surface) {
  for (const TexelSurface& s : surface) {
    const auto [x, y, z] = s.normal;
    ASSERT_TRUE(std::isfinite(x) && std::isfinite(y) && std::isfinite(z) && std::isfinite(s.albedo));
    EXPECT_NEAR(x * x + y * y + z * z, 1, 1e-5);
    EXPECT_GT(z, 0);
    EXPECT_GE(s.albedo, 0);
  }
}

// --- normals ---

TEST(PhotometricStereo, LambertIsExact) {
  const auto normals = some_normals(200, 55);
  for (const auto& lights : {vectors_of(rings(2)), vectors_of(circle(30, 3)), vectors_of(circle(25, 7))}) {
    const auto values = shaded(normals, lights, lambert(0.7));
    for (const StereoOptions& options : {kRobust, kPlain}) {
      const auto found = photometric_stereo(lights, values, normals.size(), options);
      expect_sane(found);
      for (std::size_t i = 0; i < normals.size(); ++i) {
        EXPECT_TRUE(found[i].known);
        EXPECT_LT(angle_to(found[i], normals[i]), 0.01);
        EXPECT_NEAR(found[i].albedo, 0.7, 1e-4);
      }
    }
  }
}

// The dark side of a steep texel is no measurement of b.l.
TEST(PhotometricStereo, AttachedShadowsAreLeftOut) {
  const auto normals = some_normals(300, 70);
  const auto lights = vectors_of(ubo2003_directions());
  const auto values = shaded(normals, lights, lambert(0.5));
  EXPECT_LT(mean_angle(photometric_stereo(lights, values, normals.size(), kRobust), normals), 0.05);
  EXPECT_GT(mean_angle(photometric_stereo(lights, values, normals.size(), kPlain), normals), 3);
}

// More than half of the lights lie behind a steep texel, and a little light is bounced to it from all sides.
TEST(PhotometricStereo, MostLightsBehindTheTexel) {
  const Vector3 normal = unit_vector(direction_from_degrees(65, 0));
  auto lights = vectors_of(circle(70, 24));
  for (int phi = 125; phi <= 235; phi += 10) lights.push_back(unit_vector(direction_from_degrees(60, phi)));
  for (const double theta : {20.0, 45.0}) {
    for (const Vector3& l : vectors_of({direction_from_degrees(theta, 0), direction_from_degrees(theta, 35),
                                        direction_from_degrees(theta, -35)})) {
      lights.push_back(l);
    }
  }
  std::vector<float> values;
  int dark = 0;
  for (const Vector3& l : lights) {
    const double facing = dot(normal, l);
    dark += facing <= 0;
    // A highlight on one, so that the spread matters.
    values.push_back(static_cast<float>(0.5 * std::max(facing, 0.0) + 0.01 + (facing > 0.9 ? 0.3 : 0)));
  }
  EXPECT_GT(2 * dark, static_cast<int>(lights.size()));
  EXPECT_LT(angle_to(photometric_stereo(lights, values, 1, kRobust)[0], normal), 1.5);
}

TEST(PhotometricStereo, FewLightsOfWhichOneIsShadowed) {
  const auto lights = vectors_of(circle(50, 5));
  const Vector3 normal = unit_vector(direction_from_degrees(55, 10));
  const auto values = shaded({normal}, lights, lambert(0.5));
  EXPECT_LT(angle_to(photometric_stereo(lights, values, 1, kRobust)[0], normal), 0.01);
}

// A mirror lobe, a little noise, and a wedge of a fifth of the lights cut off by something beside the texel.
std::vector<float> shining_beside_walls(const std::vector<Vector3>& normals,
                                        const std::vector<Vector3>& lights, double noise) {
  std::mt19937 random(3);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  std::vector<float> values(lights.size() * normals.size());
  for (std::size_t t = 0; t < normals.size(); ++t) {
    const double wall = 2 * kPi * uniform();
    for (std::size_t i = 0; i < lights.size(); ++i) {
      const Vector3& l = lights[i];
      const double length = std::hypot(l[0], l[1], l[2] + 1);
      const Vector3 half{l[0] / length, l[1] / length, (l[2] + 1) / length};
      const double facing = std::max(dot(normals[t], l), 0.0);
      double v = facing > 0 ? 0.5 * facing + 0.8 * std::pow(std::max(dot(normals[t], half), 0.0), 60) : 0;
      const double towards = l[0] * std::cos(wall) + l[1] * std::sin(wall);
      if (l[2] < 0.9 && towards > std::cos(0.2 * kPi) * std::sqrt(1 - l[2] * l[2])) v = 0;
      values[i * normals.size() + t] = static_cast<float>(v + noise * uniform());
    }
  }
  return values;
}

TEST(PhotometricStereo, GlossAndCastShadows) {
  const auto normals = some_normals(300, 50);
  for (const auto& lights : {vectors_of(ubo2003_directions()), vectors_of(rings(3))}) {
    const auto values = shining_beside_walls(normals, lights, 0.004);
    const double robust = mean_angle(photometric_stereo(lights, values, normals.size(), kRobust), normals);
    const double plain = mean_angle(photometric_stereo(lights, values, normals.size(), kPlain), normals);
    EXPECT_LT(robust, 1.6);
    EXPECT_GT(plain, 8 * robust);
  }
}

// Low lights and steep texels: most values are shadows, by the texel itself or by the walls.
TEST(PhotometricStereo, MostLightsInShadow) {
  std::vector<Vector3> normals;
  for (int i = 0; i < 100; ++i) normals.push_back(unit_vector(direction_from_degrees(70, 3.6 * i)));
  auto lights = vectors_of(circle(75, 30));
  for (const Vector3& l : vectors_of(circle(60, 20))) lights.push_back(l);
  const auto values = shining_beside_walls(normals, lights, 0);
  EXPECT_LT(mean_angle(photometric_stereo(lights, values, normals.size(), kRobust), normals), 0.5);
}

TEST(PhotometricStereo, TakesTheLightsCosineIn) {
  const auto normals = some_normals(50, 40);
  auto lights = vectors_of(rings(2));
  lights.push_back({1, 0, 0});  // whose quotient is no number of use
  const auto values = shaded(normals, lights, [](const Vector3& n, const Vector3& l) {
    return l[2] > 0 ? 0.6 * std::max(dot(n, l), 0.0) / l[2] : 3e4;
  });
  for (const StereoMethod method : {StereoMethod::robust, StereoMethod::least_squares}) {
    const auto found = photometric_stereo(lights, values, normals.size(), {method, false});
    EXPECT_LT(mean_angle(found, normals), 0.01);
    EXPECT_NEAR(found[0].albedo, 0.6, 1e-4);
  }
}

TEST(PhotometricStereo, LightsThatDetermineNothing) {
  const Vector3 normal = unit_vector(direction_from_degrees(20, 70));
  const std::vector<std::vector<Vector3>> cases = {
      {},
      {{0, 0, 1}},
      vectors_of(circle(40, 2)),
      std::vector<Vector3>(12, unit_vector(direction_from_degrees(35, 20))),
      vectors_of({direction_from_degrees(60, 0),
                  direction_from_degrees(30, 0),
                  {},
                  direction_from_degrees(30, 180),
                  direction_from_degrees(45, 180),
                  direction_from_degrees(60, 180),
                  direction_from_degrees(75, 180)}),
      vectors_of(circle(90, 12)),
      vectors_of(circle(1, 12)),
  };
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const auto values = shaded({normal, normal}, cases[k], lambert(0.5));
    for (const StereoMethod method : {StereoMethod::robust, StereoMethod::least_squares}) {
      for (const bool cosine : {true, false}) {
        const auto found = photometric_stereo(cases[k], values, 2, {method, cosine});
        ASSERT_EQ(found.size(), 2u);
        expect_sane(found);
        EXPECT_FALSE(found[1].known) << k;
        EXPECT_EQ(found[1].normal, (std::array<float, 3>{0, 0, 1})) << k;
      }
    }
  }
  // One light above: the albedo is that of a level texel.
  EXPECT_NEAR(photometric_stereo(cases[1], std::vector<float>{0.25f}, 1)[0].albedo, 0.25, 1e-6);
  EXPECT_TRUE(photometric_stereo(vectors_of(rings(2)), {}, 0).empty());
}

TEST(PhotometricStereo, OddTexels) {
  const auto lights = vectors_of(rings(3));
  const std::size_t n = lights.size();
  const auto of = [&](const std::function<double(std::size_t)>& value, const StereoOptions& options) {
    std::vector<float> values;
    for (std::size_t i = 0; i < n; ++i) values.push_back(static_cast<float>(value(i)));
    const auto found = photometric_stereo(lights, values, 1, options);
    expect_sane(found);
    return found[0];
  };
  for (const StereoOptions& options : {kRobust, kPlain}) {
    const TexelSurface black = of([](std::size_t) { return 0; }, options);
    EXPECT_FALSE(black.known);
    EXPECT_EQ(black.albedo, 0);
    EXPECT_EQ(black.normal, (std::array<float, 3>{0, 0, 1}));
    for (const double level : {65504.0, 1e-7, 1e-30, 1e30}) {
      const TexelSurface level_texel = of([&](std::size_t i) { return level * lights[i][2]; }, options);
      EXPECT_TRUE(level_texel.known) << level;
      EXPECT_GT(level_texel.normal[2], 0.999f);
      EXPECT_NEAR(static_cast<double>(level_texel.albedo) / level, 1, 1e-4);
    }
    of([](std::size_t) { return 1; }, options);                           // no cosine at all
    of([](std::size_t i) { return i == 5 ? 1 : 0; }, options);            // lit by one light alone
    of([&](std::size_t i) { return i % 2 == 0 ? 1e4 : 1e-4; }, options);  // anything
    // Brighter the lower the light: turned away from the viewer by the law of Lambert.
    const TexelSurface away = of([&](std::size_t i) { return lights[i][2] < 0.75 ? 1 : 0; }, options);
    EXPECT_GT(away.normal[2], 0);
  }
  // Seen by lights from one side only, and pointing below the horizon: known to be wrong.
  const std::vector<Vector3> side =
      vectors_of({direction_from_degrees(80, 0), direction_from_degrees(80, 40),
                  direction_from_degrees(80, -40), direction_from_degrees(60, 0)});
  const Vector3 below{std::sin(2.2), 0, std::cos(2.2)};
  const auto hidden = photometric_stereo(
      side, shaded({below}, side, [](const Vector3& a, const Vector3& b) { return dot(a, b); }), 1, kPlain);
  EXPECT_FALSE(hidden[0].known);
  expect_sane(hidden);
}

// --- heights ---

TexelSurface with_slopes(double p, double q) {  // dh/du, dh/dv (rows down)
  const double length = std::sqrt(1 + p * p + q * q);
  return {{static_cast<float>(-p / length), static_cast<float>(q / length), static_cast<float>(1 / length)},
          1,
          true};
}

struct Size {
  std::uint32_t width, height;
};

TEST(IntegrateNormals, WavesOfAnySize) {
  for (const auto& [width, height] :
       {Size{1, 1}, {2, 1}, {1, 9}, {8, 8}, {7, 5}, {31, 32}, {60, 22}, {97, 3}}) {
    std::vector<TexelSurface> surface;
    std::vector<double> truth;
    const double a = 2 * kPi / width, b = 2 * kPi / height;
    const double kx = width > 4 ? 2 : 0, ky = height > 2 ? 1 : 0;  // below the shortest wave
    for (std::uint32_t y = 0; y < height; ++y) {
      for (std::uint32_t x = 0; x < width; ++x) {
        const double s = kx * a * x + ky * b * y + 0.3, t = (width > 2 ? a : 0) * x;
        const double size = 0.5;
        truth.push_back(kx + ky > 0 ? size * std::sin(s) + (width > 2 ? size * std::cos(t) : 0) : 0);
        const double p = size * kx * a * std::cos(s) - (width > 2 ? size * a * std::sin(t) : 0);
        surface.push_back(kx + ky > 0 ? with_slopes(p, size * ky * b * std::cos(s)) : with_slopes(0.2, 0.1));
      }
    }
    const auto heights = integrate_normals(surface, width, height);
    ASSERT_EQ(heights.size(), truth.size());
    EXPECT_LT(height_error(heights, truth).rmse, 2e-5) << width << 'x' << height;
  }
}

// Normals that lean to the image's top belong to a slope that falls towards it.
TEST(IntegrateNormals, RowsGoDown) {
  std::vector<TexelSurface> surface;
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 8; ++x) {
      const double lean = 0.3 * std::sin(2 * kPi * y / 16);  // y component, upwards: top half leans up
      surface.push_back(
          {{0, static_cast<float>(lean), static_cast<float>(std::sqrt(1 - lean * lean))}, 1, true});
    }
  }
  const auto heights = integrate_normals(surface, 8, 16);
  // In the upper half the texels look to the top: going down the rows means going up the slope.
  EXPECT_GT(heights[8 * 8], heights[0] + 0.5f);
  EXPECT_NEAR(heights[4 * 8], 0, 0.05);
}

TEST(IntegrateNormals, PlaneHasNoTrend) {
  const std::vector<TexelSurface> surface(15 * 10, with_slopes(0.4, -0.7));
  for (const float h : integrate_normals(surface, 15, 10)) EXPECT_NEAR(h, 0, 1e-5);
}

TEST(IntegrateNormals, CapOfASphere) {
  constexpr std::uint32_t kSide = 64;
  constexpr double kRadius = 28, kBase = 22;  // the sphere and the circle where it leaves the ground
  std::vector<TexelSurface> surface;
  std::vector<double> truth;
  double mean = 0;
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const double dx = x - 31.5, dy = y - 31.5, square = dx * dx + dy * dy;
      const bool on = square < kBase * kBase;
      const double z = on ? std::sqrt(kRadius * kRadius - square) : 0;
      truth.push_back(on ? z - std::sqrt(kRadius * kRadius - kBase * kBase) : 0);
      mean += truth.back() / (kSide * kSide);
      surface.push_back(on ? with_slopes(-dx / z, -dy / z) : with_slopes(0, 0));
    }
  }
  for (double& h : truth) h -= mean;
  const HeightError error = height_error(integrate_normals(surface, kSide, kSide), truth);
  EXPECT_GT(error.correlation, 0.999);
  EXPECT_LT(error.rmse, 0.03 * error.relief);
}

TEST(IntegrateNormals, WildNormalsStayFinite) {
  std::mt19937 random(9);
  std::vector<TexelSurface> surface;
  for (int i = 0; i < 24 * 18; ++i) {
    const double phi = static_cast<double>(random()) / 4294967296.0 * 2 * kPi;
    surface.push_back(
        {{static_cast<float>(std::cos(phi)), static_cast<float>(std::sin(phi)), 1e-30f}, 1, i % 5 != 0});
  }
  double sum = 0;
  for (const float h : integrate_normals(surface, 24, 18)) {
    ASSERT_TRUE(std::isfinite(h));
    EXPECT_LT(std::abs(h), kMostSlope * 24);
    sum += static_cast<double>(h);
  }
  EXPECT_NEAR(sum, 0, 1e-2);
}

// Slopes that change from texel to texel hold no long waves, and must make none: noise of 1 gives heights
// of less than 1.
TEST(IntegrateNormals, ShortestWavesAreNotRaised) {
  std::vector<TexelSurface> surface;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x)
      surface.push_back(with_slopes(x % 2 == 0 ? 1 : -1, 0.2 * std::cos(kPi * x + 2 * kPi * y / 32)));
  }
  for (const float h : integrate_normals(surface, 32, 32)) EXPECT_LT(std::abs(h), 0.1f);
}

TEST(IntegrateNormals, UnknownTexelsTakeTheMeanSlope) {
  std::vector<TexelSurface> surface(12 * 12, with_slopes(0.4, 0.3));
  for (std::size_t i = 0; i < surface.size(); i += 7) surface[i] = TexelSurface{};
  for (const float h : integrate_normals(surface, 12, 12)) EXPECT_NEAR(h, 0, 1e-5);
  for (const float h : integrate_normals(std::vector<TexelSurface>(6), 3, 2)) EXPECT_EQ(h, 0);
}

// What the materials' own normals say of their heights: the error of integration alone.
TEST(IntegrateNormals, NormalsOfMaterials) {
  BtfSynthOptions options;
  options.width = 48;
  options.height = 40;
  for (const char* kind : {"plaster", "corduroy", "leather"}) {
    const Result<BtfGroundTruth> truth = btf_ground_truth(kind, options);
    ASSERT_TRUE(truth);
    const Image& normals = truth->normals;
    std::vector<TexelSurface> surface;
    for (std::size_t i = 0; i < normals.codes.size(); i += 3) {
      TexelSurface s{{}, 1, true};
      for (std::size_t c = 0; c < 3; ++c)
        s.normal[c] = 2 * code_value(normals.type, normals.codes[i + c]) - 1;
      surface.push_back(s);
    }
    const HeightError error = height_error(integrate_normals(surface, 48, 40), true_heights(kind, options));
    EXPECT_GT(error.correlation, 0.99) << kind;
    EXPECT_LT(error.rmse, 0.15 * error.relief) << kind;
  }
}

// --- range maps ---

// Two waves, in texels, and their slopes.
constexpr std::uint32_t kWidth = 24, kHeight = 20;
double wave_height(std::uint32_t x, std::uint32_t y) {
  return 0.8 * std::sin(2 * kPi * x / kWidth) + 0.5 * std::cos(4 * kPi * y / kHeight);
}
Vector3 wave_normal(std::uint32_t x, std::uint32_t y) {
  const double p = 0.8 * 2 * kPi / kWidth * std::cos(2 * kPi * x / kWidth);
  const double q = -0.5 * 4 * kPi / kHeight * std::sin(4 * kPi * y / kHeight),
               length = std::sqrt(1 + p * p + q * q);
  return {-p / length, q / length, 1 / length};
}
std::vector<double> wave_truth() {
  std::vector<double> truth;
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    for (std::uint32_t x = 0; x < kWidth; ++x) truth.push_back(wave_height(x, y));
  }
  return truth;
}

DatasetInfo wave_info(SampleType type = SampleType::float16, std::uint32_t channels = 3) {
  DatasetInfo info = btf_info(kWidth, kHeight, channels, type,
                              {direction_from_degrees(3, 40), direction_from_degrees(40, 0)}, rings(3));
  info.colour_space = type == SampleType::float16 ? ColourSpace::lin_rec709_scene : ColourSpace::unknown;
  info.quantity = Quantity::reflectance_cos;
  return info;
}
// Only the first view shows the relief.
double wave_value(const Direction& view, const Direction& light, std::uint32_t x, std::uint32_t y,
                  std::uint32_t channel) {
  if (degrees(view.theta) > 20) return 0.3;
  const double albedo = (x + y) % 3 == 0 ? 0.4 : 0.8;
  return albedo * (1 - 0.2 * channel) * std::max(dot(wave_normal(x, y), unit_vector(light)), 0.0);
}

TEST(RangeMap, WavesWithWhateverQuantityAndCodes) {
  const auto error_of = [](const Dataset& dataset) {
    const Result<RangeMap> map = estimate_range_map(dataset, kWidth, kHeight);
    EXPECT_TRUE(map);
    EXPECT_EQ(map->note, "");
    EXPECT_EQ(map->known_share, 1);
    return height_error(map->heights, wave_truth());
  };
  EXPECT_LT(error_of(make_btf(wave_info(), wave_value)).rmse, 0.005);
  EXPECT_LT(error_of(make_btf(wave_info(SampleType::unorm16), wave_value)).rmse, 0.005);
  EXPECT_LT(error_of(make_btf(wave_info(SampleType::unorm8), wave_value)).rmse, 0.05);

  DatasetInfo divided = wave_info();
  divided.quantity = Quantity::reflectance;
  EXPECT_LT(error_of(make_btf(divided, [](const Direction& v, const Direction& l, auto x, auto y,
                                          auto c) { return wave_value(v, l, x, y, c) / std::cos(l.theta); }))
                .rmse,
            0.005);

  DatasetInfo coded = wave_info(SampleType::unorm16);
  coded.colour_space = ColourSpace::srgb_rec709_scene;
  const Dataset srgb = make_btf(coded, [](const Direction& v, const Direction& l, auto x, auto y, auto c) {
    return 1.055 * std::pow(std::max(wave_value(v, l, x, y, c), 0.0031308), 1 / 2.4) - 0.055;
  });
  EXPECT_LT(error_of(srgb).rmse, 0.005);
  // Taken as linear the same codes show another relief.
  const Result<RangeMap> wrong = estimate_range_map(srgb, kWidth, kHeight, {StereoMethod::robust, true});
  ASSERT_TRUE(wrong);
  EXPECT_GT(height_error(wrong->heights, wave_truth()).rmse, 0.05);

  // An alpha channel says nothing.
  DatasetInfo alpha = wave_info(SampleType::float16, 4);
  alpha.channels = {"R", "G", "B", "A"};
  EXPECT_LT(error_of(make_btf(alpha, [](const Direction& v, const Direction& l, auto x, auto y,
                                        auto c) { return c == 3 ? 40.0 : wave_value(v, l, x, y, c); }))
                .rmse,
            0.005);
}

TEST(RangeMap, SmallerMapsAreMeansOverBoxes) {
  const Dataset dataset = make_btf(wave_info(), wave_value);
  const Result<RangeMap> whole = estimate_range_map(dataset, kWidth, kHeight);
  ASSERT_TRUE(whole);
  for (const auto& [width, height] : {Size{12, 10}, {24, 7}, {5, 20}, {17, 13}, {1, 1}}) {
    const Result<RangeMap> map = estimate_range_map(dataset, width, height);
    ASSERT_TRUE(map);
    EXPECT_EQ(map->width, width);
    EXPECT_EQ(map->height, height);
    ASSERT_EQ(map->heights.size(), std::size_t{width} * height);
    double sum = 0;
    for (const float h : map->heights) sum += static_cast<double>(h);
    EXPECT_NEAR(sum, 0, 1e-3);
  }
  const Result<RangeMap> half = estimate_range_map(dataset, 12, 10);
  ASSERT_TRUE(half);
  const auto& h = whole->heights;
  EXPECT_NEAR(half->heights[3 * 12 + 4], (h[6 * 24 + 8] + h[6 * 24 + 9] + h[7 * 24 + 8] + h[7 * 24 + 9]) / 4,
              1e-5);
  for (const auto& [width, height] : {Size{0, 4}, {4, 0}, {kWidth + 1, 4}, {4, kHeight + 1}}) {
    const Result<RangeMap> refused = estimate_range_map(dataset, width, height);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().status, Status::bad_argument);
  }
}

TEST(RangeMap, FlatWithTheReasonWhereNothingCanBeKnown) {
  const auto expect_flat = [](const Dataset& dataset, const char* why) {
    const Result<RangeMap> map = estimate_range_map(dataset, 12, 9);
    ASSERT_TRUE(map);
    EXPECT_NE(map->note.find(why), std::string::npos) << map->note;
    EXPECT_EQ(map->heights, std::vector<float>(12 * 9));
    EXPECT_EQ(map->known_share, 0);
  };
  DatasetInfo info = wave_info();
  info.views = {direction_from_degrees(11, 0), direction_from_degrees(40, 0)};
  expect_flat(make_btf(info, wave_value), "(11, 0)");
  info = wave_info();
  info.quantity = Quantity::data;
  expect_flat(make_btf(info, wave_value), "no quantity of light");
  info = btf_info(kWidth, kHeight, 3, SampleType::float16, {Direction{}}, circle(30, 2));
  expect_flat(make_btf(info, wave_value), "2 lights");
  expect_flat(make_btf(wave_info(), [](auto...) { return 0.0; }), "no texel");
}

TEST(RangeMap, ThreadsDoNotShow) {
  const Dataset dataset = make_btf(wave_info(SampleType::unorm8), bumpy);
  std::vector<float> one, many;
  const auto into = [&](std::vector<float>& heights) {
    return [&] {
      const Result<RangeMap> map = estimate_range_map(dataset, 17, 20);
      ASSERT_TRUE(map);
      heights = map->heights;
    };
  };
  run_on_threads(1, into(one));
  run_on_threads(4, into(many));
  EXPECT_EQ(one, many);
  for (const float h : one) EXPECT_TRUE(std::isfinite(h));
}

// Shadows, gloss, bounced light and rough diffuse reflection, none of which Lambert's law knows.
TEST(RangeMap, SyntheticMaterials) {
  BtfSynthOptions options;
  options.width = options.height = 40;
  for (const auto& [kind, least] : {std::pair("plaster", 0.95), {"corduroy", 0.97}}) {
    const Result<Dataset> dataset = synthesize_btf(kind, options);
    ASSERT_TRUE(dataset) << dataset.error().message;
    const std::vector<double> truth = true_heights(kind, options);
    const Result<RangeMap> robust = estimate_range_map(*dataset, 40, 40);
    const Result<RangeMap> plain = estimate_range_map(*dataset, 40, 40, {StereoMethod::least_squares, false});
    ASSERT_TRUE(robust && plain);
    const HeightError error = height_error(robust->heights, truth);
    EXPECT_GT(error.correlation, least) << kind;
    EXPECT_GT(error.correlation, height_error(plain->heights, truth).correlation) << kind;
    EXPECT_LT(error.rmse, 0.6 * error.relief) << kind;
    EXPECT_GT(robust->known_share, 0.99) << kind;
  }
}

TEST(RangeMap, PhotographedBall) {
  const auto folder = range_data_folder() / "photometric_diligent_ball96";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no photographs: " << folder << " does not exist";
  const Result<AngularError> robust = ball_error(folder, folder / "mask.png", {});
  const Result<AngularError> plain =
      ball_error(folder, folder / "mask.png", {StereoMethod::least_squares, false});
  ASSERT_TRUE(robust) << robust.error().message;
  ASSERT_TRUE(plain);
  EXPECT_LT(robust->mean, 3);
  EXPECT_LT(robust->median, 3);
  EXPECT_LT(robust->mean, plain->mean);
}

}  // namespace
}  // namespace btfc::test
