// FLIP against the paper's formulas written out: two-dimensional filters, doubles, whole planes.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "encoder/metrics/flip.h"
#include "encoder/metrics/image_metrics.h"
#include "encoder/metrics/lab.h"
#include "tests/test_support.h"

namespace btfc::test {
namespace {

using Colours = std::vector<std::array<double, 3>>;
constexpr double kPi = std::numbers::pi;

struct Kernel {
  int radius = 0;
  std::vector<double> weights;
};

template <class Weight>
Kernel kernel(int radius, const Weight& weight) {
  Kernel k{radius, {}};
  double positive = 0, negative = 0;
  for (int y = -radius; y <= radius; ++y) {
    for (int x = -radius; x <= radius; ++x) {
      k.weights.push_back(weight(x, y));
      (k.weights.back() > 0 ? positive : negative) += std::fabs(k.weights.back());
    }
  }
  for (double& w : k.weights) w /= w > 0 ? positive : negative;
  return k;
}

std::vector<double> filtered(const std::vector<double>& in, int width, int height, const Kernel& k) {
  std::vector<double> out;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      std::size_t i = 0;
      for (int v = -k.radius; v <= k.radius; ++v) {
        for (int u = -k.radius; u <= k.radius; ++u) {
          const int at_x = std::clamp(x + u, 0, width - 1), at_y = std::clamp(y + v, 0, height - 1);
          sum += k.weights[i++] * in[static_cast<std::size_t>(at_y * width + at_x)];
        }
      }
      out.push_back(sum);
    }
  }
  return out;
}

std::array<double, 3> product(const Matrix3& m, const std::array<double, 3>& v) {
  std::array<double, 3> out{};
  for (std::size_t i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return out;
}

// Solved by Cramer's rule.
std::array<double, 3> solved(const Matrix3& m, const std::array<double, 3>& v) {
  const auto determinant = [](const Matrix3& a) {
    return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
           a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
           a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
  };
  std::array<double, 3> out{};
  for (std::size_t i = 0; i < 3; ++i) {
    Matrix3 replaced = m;
    for (std::size_t r = 0; r < 3; ++r) replaced[r][i] = v[r];
    out[i] = determinant(replaced) / determinant(m);
  }
  return out;
}

Lab hunt(const Lab& c) { return {c[0], 0.01 * c[0] * c[1], 0.01 * c[0] * c[2]}; }
double hyab(const Lab& a, const Lab& b) {
  return std::fabs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

struct PlainSide {
  std::vector<Lab> colours;
  std::vector<double> edges, points;
};

PlainSide plain_side(const Image& image, double ppd) {
  const int width = static_cast<int>(image.width), height = static_cast<int>(image.height);
  const CodeTables tables = code_tables(image.type, image.colour_space);
  std::array<std::vector<double>, 3> opponent;
  std::vector<double> luminance;
  for (std::size_t q = 0; q < image.codes.size(); q += image.channels) {
    std::array<double, 3> rgb{};
    for (std::size_t c = 0; c < 3; ++c) {
      rgb[c] = linear_of_srgb(double(tables.display[image.codes[q + (image.channels < 3 ? 0 : c)]]));
    }
    const auto xyz = product(white_xyz_of_rec709(), rgb);
    opponent[0].push_back(116 * xyz[1] - 16);
    opponent[1].push_back(500 * (xyz[0] - xyz[1]));
    opponent[2].push_back(200 * (xyz[1] - xyz[2]));
    luminance.push_back(xyz[1]);
  }
  const auto term = [&](double a, double b, int x, int y) {
    return a * std::sqrt(kPi / b) * std::exp(-kPi * kPi * (x * x + y * y) / (ppd * ppd * b));
  };
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(0.04 / (2 * kPi * kPi)) * ppd));
  opponent[0] = filtered(opponent[0], width, height,
                         kernel(radius, [&](int x, int y) { return term(1, 0.0047, x, y); }));
  opponent[1] = filtered(opponent[1], width, height,
                         kernel(radius, [&](int x, int y) { return term(1, 0.0053, x, y); }));
  opponent[2] = filtered(opponent[2], width, height, kernel(radius, [&](int x, int y) {
                           return term(34.1, 0.04, x, y) + term(13.5, 0.025, x, y);
                         }));
  PlainSide out;
  for (std::size_t q = 0; q < luminance.size(); ++q) {
    const double y = (opponent[0][q] + 16) / 116;
    auto rgb = solved(white_xyz_of_rec709(), {y + opponent[1][q] / 500, y, y - opponent[2][q] / 200});
    for (double& v : rgb) v = std::clamp(v, 0.0, 1.0);
    out.colours.push_back(hunt(lab_of_linear(rgb[0], rgb[1], rgb[2])));
  }
  const double s = 0.5 * 0.082 * ppd;
  const int reach = static_cast<int>(std::ceil(3 * s));
  const auto features = [&](const auto& derivative) {
    const auto g = [&](int x, int y) { return std::exp(-(x * x + y * y) / (2 * s * s)); };
    const auto h = filtered(luminance, width, height,
                            kernel(reach, [&](int x, int y) { return derivative(x) * g(x, y); }));
    const auto v = filtered(luminance, width, height,
                            kernel(reach, [&](int x, int y) { return derivative(y) * g(x, y); }));
    std::vector<double> length;
    for (std::size_t q = 0; q < h.size(); ++q) length.push_back(std::hypot(h[q], v[q]));
    return length;
  };
  out.edges = features([](int x) { return double(-x); });
  out.points = features([&](int x) { return x * x / (s * s) - 1; });
  return out;
}

std::vector<double> plain_flip(const Image& a, const Image& b, double ppd) {
  const PlainSide p = plain_side(a, ppd), q = plain_side(b, ppd);
  const double most = std::pow(hyab(hunt(lab_of_linear(0, 1, 0)), hunt(lab_of_linear(0, 0, 1))), 0.7);
  std::vector<double> out;
  for (std::size_t i = 0; i < p.colours.size(); ++i) {
    const double e = std::pow(hyab(p.colours[i], q.colours[i]), 0.7);
    const double colour =
        e < 0.4 * most ? 0.95 * e / (0.4 * most) : 0.95 + 0.05 * (e - 0.4 * most) / (0.6 * most);
    const double feature = std::sqrt(
        std::fmax(std::fabs(p.edges[i] - q.edges[i]), std::fabs(p.points[i] - q.points[i])) / std::sqrt(2.0));
    out.push_back(std::pow(colour, 1 - feature));
  }
  return out;
}

double flip(const Image& a, const Image& b, std::vector<float>* map = nullptr,
            double ppd = kFlipPixelsPerDegree) {
  const CodeTables ta = code_tables(a.type, a.colour_space), tb = code_tables(b.type, b.colour_space);
  return flip_by_rows(code_view(a, ta), code_view(b, tb), flip_filters(ppd), map);
}

void expect_plain(const Image& a, const Image& b, double ppd = kFlipPixelsPerDegree) {
  std::vector<float> map;
  const double mean = flip(a, b, &map, ppd);
  const std::vector<double> plain = plain_flip(a, b, ppd);
  ASSERT_EQ(map.size(), plain.size());
  double sum = 0, plain_sum = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    EXPECT_NEAR(map[i], plain[i], 1e-4) << a.width << "x" << a.height << " " << i;
    EXPECT_TRUE(map[i] >= 0 && map[i] <= 1);
    sum += double(map[i]);
    plain_sum += plain[i];
  }
  EXPECT_NEAR(mean, sum / double(map.size()), 1e-12);
  // The root of the feature difference turns 10^-7 of rounding where there are no features into 10^-4.
  EXPECT_NEAR(mean, plain_sum / double(map.size()), 5e-5);
}

TEST(Flip, IsThePapersFormulas) {
  expect_plain(noise(30, 23, 3, SampleType::unorm8), noise(30, 23, 3, SampleType::unorm8, 2));
  expect_plain(material("bricks", 33, 40), material("bricks", 33, 40, SampleType::float16));
  expect_plain(material("pebbles", 40, 25), material("grain", 40, 25));
  expect_plain(noise(17, 20, 1, SampleType::unorm16), noise(17, 20, 1, SampleType::unorm16, 2));
  expect_plain(noise(20, 19, 4, SampleType::unorm8), noise(20, 19, 4, SampleType::unorm8, 2), 20);
}

TEST(Flip, ImagesSmallerThanTheFilters) {
  for (const auto& [width, height] : {std::pair{1u, 1u}, {5u, 3u}, {1u, 40u}, {40u, 1u}}) {
    expect_plain(noise(width, height, 3, SampleType::unorm8), noise(width, height, 3, SampleType::unorm8, 2));
  }
}

TEST(Flip, EqualImagesDoNotDiffer) {
  for (const Image& image :
       {noise(40, 30, 3, SampleType::float16), constant(7, 5, 1, SampleType::unorm8, 77)}) {
    EXPECT_EQ(flip(image, image), 0);
  }
}

TEST(Flip, BlackAgainstWhite) {
  // HyAB is 100, and 0.95 + 0.05 (100^0.7 - 0.4 m) / (0.6 m) with m = 203.3^0.7, green to blue.
  for (const std::uint32_t channels : {1u, 3u}) {
    const Image black = constant(30, 30, channels, SampleType::unorm8, 0),
                white = constant(30, 30, channels, SampleType::unorm8, 255);
    EXPECT_NEAR(flip(black, white), 0.96739, 2e-5);
    EXPECT_NEAR(flip(white, black), 0.96739, 2e-5);
  }
}

TEST(Flip, GreenAgainstBlueIsTheMost) {
  Image green = constant(8, 8, 3, SampleType::unorm8, 0), blue = green;
  for (std::size_t q = 0; q < green.codes.size(); q += 3) green.codes[q + 1] = blue.codes[q + 2] = 255;
  EXPECT_NEAR(flip(green, blue), 1, 1e-5);
}

TEST(Flip, GrowsWithTheDifference) {
  const Image a = material("pebbles", 48, 48);
  double before = 0;
  for (const int step : {1, 4, 16, 64}) {
    Image b = a;
    for (std::uint16_t& code : b.codes) code = static_cast<std::uint16_t>(std::max(0, code - step));
    const double error = flip(a, b);
    EXPECT_GT(error, before);
    before = error;
  }
}

TEST(Flip, OneHotTexel) {
  Image a = constant(40, 40, 3, SampleType::float16, 0x2e66), b = a;  // 0.1
  for (std::uint32_t c = 0; c < 3; ++c) b.at(20, 20, c) = 0x63d0;     // 1000
  expect_plain(a, b);
  std::vector<float> map;
  const double mean = flip(a, b, &map);
  EXPECT_GT(map[20 * 40 + 20], 0.5f);
  EXPECT_EQ(map[0], 0);
  EXPECT_LT(mean, 0.05);
}

}  // namespace
}  // namespace btfc::test
