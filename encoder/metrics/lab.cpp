// CIE 15:2004, section 8.2.1; colours of Rec. 709 and white of D65 (ITU-R BT.709-6).
#include "encoder/metrics/lab.h"

#include <bit>
#include <cmath>
#include <vector>

namespace btfc {
namespace {

// X, Y, Z of the primaries (0.64, 0.33), (0.30, 0.60), (0.15, 0.06) that make the white (0.3127, 0.3290).
constexpr Matrix3 kXyzOfRec709 = {{{0.4123907993, 0.3575843394, 0.1804807884},
                                   {0.2126390059, 0.7151686788, 0.0721923154},
                                   {0.0193308187, 0.1191947798, 0.9505321522}}};

constexpr Matrix3 over_white(Matrix3 m) {
  for (auto& row : m) {
    const double white = row[0] + row[1] + row[2];
    for (double& v : row) v /= white;
  }
  return m;
}
constexpr Matrix3 kWhiteXyzOfRec709 = over_white(kXyzOfRec709);

// f(t) = cbrt(t) above (6/29)^3, and below its tangent there.
constexpr double kKnee = 216.0 / 24389, kSlope = 841.0 / 108, kOffset = 4.0 / 29;

double f(double t) { return t > kKnee ? std::cbrt(t) : kSlope * t + kOffset; }

// A third of the exponent by integer division (Kahan 1991), 5% off at most; two steps of Halley's method,
// each of which cubes the error. Vectorises, unlike std::cbrt. For 0.001 < t < 2.
inline float cube_root(float t) {
  float y = std::bit_cast<float>(std::bit_cast<std::uint32_t>(t) / 3 + 709921077u);
  for (int step = 0; step < 2; ++step) {
    const float y3 = y * y * y;
    y *= (y3 + 2 * t) / (2 * y3 + t);
  }
  return y;
}

inline float f(float t) {
  const float root = cube_root(t), line = static_cast<float>(kSlope) * t + static_cast<float>(kOffset);
  return t > static_cast<float>(kKnee) ? root : line;
}

}  // namespace

double linear_of_srgb(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }
double srgb_of_linear(double v) { return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055; }

const Matrix3& white_xyz_of_rec709() { return kWhiteXyzOfRec709; }

Lab lab_of_linear(double red, double green, double blue) {
  std::array<double, 3> t{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& m = kWhiteXyzOfRec709[i];
    t[i] = f(m[0] * red + m[1] * green + m[2] * blue);
  }
  return {116 * t[1] - 16, 500 * (t[0] - t[1]), 200 * (t[1] - t[2])};
}

void lab_row(std::span<float> red_l, std::span<float> green_a, std::span<float> blue_b) {
  constexpr auto m = [](std::size_t i, std::size_t j) { return static_cast<float>(kWhiteXyzOfRec709[i][j]); };
  constexpr float x0 = m(0, 0), x1 = m(0, 1), x2 = m(0, 2), y0 = m(1, 0), y1 = m(1, 1), y2 = m(1, 2),
                  z0 = m(2, 0), z1 = m(2, 1), z2 = m(2, 2);
  float *const p = red_l.data(), *const q = green_a.data(), *const r = blue_b.data();
  const std::size_t count = red_l.size();
  for (std::size_t i = 0; i < count; ++i) {
    const float fx = f(x0 * p[i] + x1 * q[i] + x2 * r[i]), fy = f(y0 * p[i] + y1 * q[i] + y2 * r[i]),
                fz = f(z0 * p[i] + z1 * q[i] + z2 * r[i]);
    p[i] = 116 * fy - 16;
    q[i] = 500 * (fx - fy);
    r[i] = 200 * (fy - fz);
  }
}

LabDifference lab_difference(const CodeView& a, const CodeView& b) {
  const std::size_t width = a.width;
  std::vector<float> buffer(6 * width);
  const auto row = [&](std::size_t i) { return std::span(buffer).subspan(i * width, width); };
  double absolute = 0, euclidean = 0;
  for (std::uint32_t y = 0; y < a.height; ++y) {
    a.linear_row(y, row(0), row(1), row(2));
    b.linear_row(y, row(3), row(4), row(5));
    lab_row(row(0), row(1), row(2));
    lab_row(row(3), row(4), row(5));
    float* const v = buffer.data();
    for (std::size_t x = 0; x < width; ++x) {
      const float l = v[x] - v[3 * width + x], da = v[width + x] - v[4 * width + x],
                  db = v[2 * width + x] - v[5 * width + x];
      v[x] = std::fabs(l) + std::fabs(da) + std::fabs(db);
      v[width + x] = std::sqrt(l * l + da * da + db * db);
    }
    for (std::size_t x = 0; x < width; ++x) {
      absolute += static_cast<double>(v[x]);
      euclidean += static_cast<double>(v[width + x]);
    }
  }
  const double texels = static_cast<double>(width) * a.height;
  return {absolute / (3 * texels), euclidean / texels};
}

}  // namespace btfc
