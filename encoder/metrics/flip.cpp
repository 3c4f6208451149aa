// The two pipelines of FLIP, colour and feature, over a window of rows. Every two-dimensional filter of the
// paper is a sum of products of one-dimensional ones, so that separating them changes nothing but rounding.
#include "encoder/metrics/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "encoder/metrics/lab.h"
#include "encoder/metrics/row_filter.h"

namespace btfc {
namespace {

// Contrast sensitivity in space: sum of a sqrt(pi / b) exp(-pi^2 z^2 / b), z in degrees.
struct Sensitivity {
  double a, b;
};
constexpr std::array<Sensitivity, 1> kAchromatic = {{{1, 0.0047}}};
constexpr std::array<Sensitivity, 1> kRedGreen = {{{1, 0.0053}}};
constexpr std::array<Sensitivity, 2> kBlueYellow = {{{34.1, 0.04}, {13.5, 0.025}}};
constexpr double kWidestB = 0.04;  // of all: the filters have one radius, three of its standard deviations

constexpr double kFeatureWidth = 0.082;              // degrees from peak to trough of the edge detector
constexpr float kColourExponent = 0.7f;              // q_c
constexpr float kFeatureExponent = 0.5f;             // q_f
constexpr double kKneeError = 0.4, kKneeOut = 0.95;  // p_c and p_t

// Taps that together weigh less are left off: far below what single precision resolves.
constexpr double kNegligible = 1e-9;

std::vector<float> normalised(std::vector<double> taps) {
  double sum = 0;
  for (const double v : taps) sum += v;
  for (double& v : taps) v /= sum;
  double tails = 0;
  while (taps.size() > 1 && (tails += 2 * taps.front()) < kNegligible) {
    taps.erase(taps.begin());
    taps.pop_back();
  }
  return {taps.begin(), taps.end()};
}

std::vector<FlipFilters::Gaussian> sensitivity_filter(std::span<const Sensitivity> terms,
                                                      double pixels_per_degree) {
  const double pi = std::numbers::pi;
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(kWidestB / (2 * pi * pi)) * pixels_per_degree));
  std::vector<FlipFilters::Gaussian> out;
  double total = 0;
  for (const auto& [a, b] : terms) {
    std::vector<double> taps;
    double sum = 0;
    for (int i = -radius; i <= radius; ++i) {
      const double z = i / pixels_per_degree;
      taps.push_back(std::exp(-pi * pi * z * z / b));
      sum += taps.back();
    }
    const double weight = a * std::sqrt(pi / b) * sum * sum;
    total += weight;
    out.push_back({normalised(std::move(taps)), static_cast<float>(weight)});
  }
  for (auto& gaussian : out) gaussian.weight /= static_cast<float>(total);
  return out;
}

// Positive taps sum to 1, negative ones to -1: signs are those along the axis, so the factor
// across it has the sum 1.
std::vector<float> balanced(const std::vector<double>& taps) {
  double positive = 0, negative = 0;
  for (const double v : taps) (v > 0 ? positive : negative) += std::fabs(v);
  std::vector<float> out;
  for (const double v : taps) out.push_back(static_cast<float>(v / (v > 0 ? positive : negative)));
  return out;
}

// Y, Cx, Cz: the linearised CIELAB, from tristimulus values over those of white.
constexpr std::size_t kOpponents = 3;

using Matrix3f = std::array<std::array<float, 3>, 3>;

Matrix3f to_float(const Matrix3& m) {
  Matrix3f out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) out[i][j] = static_cast<float>(m[i][j]);
  }
  return out;
}

Matrix3 inverse(const Matrix3& m) {
  Matrix3 out{};
  const auto minor = [&](std::size_t i, std::size_t j) {
    const std::size_t r = (i + 1) % 3, s = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
    return m[r][c] * m[s][d] - m[r][d] * m[s][c];
  };
  const double determinant = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) out[j][i] = minor(i, j) / determinant;
  }
  return out;
}

void opponent_row(const Matrix3f& m, std::span<float> p, std::span<float> q, std::span<float> r) {
  for (std::size_t i = 0; i < p.size(); ++i) {
    const float x = m[0][0] * p[i] + m[0][1] * q[i] + m[0][2] * r[i];
    const float y = m[1][0] * p[i] + m[1][1] * q[i] + m[1][2] * r[i];
    const float z = m[2][0] * p[i] + m[2][1] * q[i] + m[2][2] * r[i];
    p[i] = 116 * y - 16;
    q[i] = 500 * (x - y);
    r[i] = 200 * (y - z);
  }
}

// Back, and clamped to the colours of the display.
void display_row(const Matrix3f& m, std::span<float> p, std::span<float> q, std::span<float> r) {
  const auto clamped = [](float v) { return std::min(std::max(v, 0.0f), 1.0f); };
  for (std::size_t i = 0; i < p.size(); ++i) {
    const float y = (p[i] + 16) / 116, x = y + q[i] / 500, z = y - r[i] / 200;
    p[i] = clamped(m[0][0] * x + m[0][1] * y + m[0][2] * z);
    q[i] = clamped(m[1][0] * x + m[1][1] * y + m[1][2] * z);
    r[i] = clamped(m[2][0] * x + m[2][1] * y + m[2][2] * z);
  }
}

// Hunt: colourfulness falls with luminance.
void hunt_row(std::span<const float> l, std::span<float> a, std::span<float> b) {
  for (std::size_t i = 0; i < l.size(); ++i) {
    a[i] *= 0.01f * l[i];
    b[i] *= 0.01f * l[i];
  }
}

// The largest distance between colours of a display, green to blue, to the power of q_c.
float largest_error() {
  Lab green = lab_of_linear(0, 1, 0), blue = lab_of_linear(0, 0, 1);
  for (Lab* c : {&green, &blue}) {
    for (std::size_t i = 1; i < 3; ++i) (*c)[i] *= 0.01 * (*c)[0];
  }
  const double hyab = std::fabs(green[0] - blue[0]) + std::hypot(green[1] - blue[1], green[2] - blue[2]);
  return static_cast<float>(std::pow(hyab, static_cast<double>(kColourExponent)));
}

// One image as its rows come: filtered along the row on arrival, down the column when the rows below are
// there.
class FlipSide {
 public:
  FlipSide(const CodeView& view, const FlipFilters& filters)
      : view_(view),
        filters_(filters),
        to_xyz_(to_float(white_xyz_of_rec709())),
        from_xyz_(to_float(inverse(white_xyz_of_rec709()))),
        values_(kOpponents * view.width),
        filtered_(kOutputs * view.width),
        partial_(view.width),
        rows_(2 * reach(filters) + 1) {
    for (const auto* channel : {&filters.achromatic, &filters.red_green, &filters.blue_yellow}) {
      for (std::size_t i = 0; i < channel->size(); ++i) colour_.emplace_back(rows_.size(), view.width);
    }
    for (std::size_t i = 0; i < 3; ++i) feature_.emplace_back(rows_.size(), view.width);
  }

  // Rows that a filter reaches beyond its texel.
  static std::size_t reach(const FlipFilters& filters) {
    std::size_t longest = filters.across.size();
    for (const auto* channel : {&filters.achromatic, &filters.red_green, &filters.blue_yellow}) {
      for (const auto& gaussian : *channel) longest = std::max(longest, gaussian.taps.size());
    }
    return longest / 2;
  }

  void take(std::uint32_t y) {
    view_.linear_row(y, value(0), value(1), value(2));
    opponent_row(to_xyz_, value(0), value(1), value(2));
    std::size_t ring = 0;
    for_each_channel([&](std::size_t channel, const FlipFilters::Gaussian& gaussian) {
      along(gaussian.taps, value(channel), colour_[ring++].row(y));
    });
    for (float& v : value(0)) v = (v + 16) / 116;  // features are those of luminance, 0 … 1
    along(filters_.across, value(0), feature_[0].row(y));
    along(filters_.edge, value(0), feature_[1].row(y));
    along(filters_.point, value(0), feature_[2].row(y));
  }

  // Rows up to y + reach have been taken, as far as there are any.
  void finish(std::uint32_t y) {
    std::size_t ring = 0;
    for_each_channel([&](std::size_t channel, const FlipFilters::Gaussian& gaussian) {
      const bool first = &gaussian == &this->channel(channel).front();
      down(gaussian.taps, colour_[ring++], y, partial_);
      const std::span<float> out = filtered(channel);
      for (std::size_t x = 0; x < out.size(); ++x) {
        out[x] = (first ? 0 : out[x]) + gaussian.weight * partial_[x];
      }
    });
    display_row(from_xyz_, filtered(0), filtered(1), filtered(2));
    lab_row(filtered(0), filtered(1), filtered(2));
    hunt_row(filtered(0), filtered(1), filtered(2));

    magnitude(filters_.edge, feature_[1], y, filtered(3));
    magnitude(filters_.point, feature_[2], y, filtered(4));
  }

  // Of the finished row: Hunt-adjusted L, a, b, and the magnitudes of edges and of points.
  std::span<float> filtered(std::size_t i) {
    return std::span(filtered_).subspan(i * view_.width, view_.width);
  }

 private:
  static constexpr std::size_t kOutputs = 5;

  const std::vector<FlipFilters::Gaussian>& channel(std::size_t c) const {
    return c == 0 ? filters_.achromatic : c == 1 ? filters_.red_green : filters_.blue_yellow;
  }
  template <class Visit>
  void for_each_channel(const Visit& visit) const {
    for (std::size_t c = 0; c < kOpponents; ++c) {
      for (const FlipFilters::Gaussian& gaussian : channel(c)) visit(c, gaussian);
    }
  }
  std::span<float> value(std::size_t i) { return std::span(values_).subspan(i * view_.width, view_.width); }

  void along(const std::vector<float>& taps, std::span<const float> in, std::span<float> out) {
    const std::size_t radius = taps.size() / 2;
    padded_.assign(radius, in.front());
    padded_.insert(padded_.end(), in.begin(), in.end());
    padded_.insert(padded_.end(), radius, in.back());
    filter_along(taps, padded_.data(), out);
  }

  void down(const std::vector<float>& taps, RowRing& ring, std::uint32_t y, std::span<float> out) {
    const std::int64_t radius = static_cast<std::int64_t>(taps.size() / 2), last = view_.height - 1;
    for (std::size_t t = 0; t < taps.size(); ++t) {
      const std::int64_t at = std::clamp<std::int64_t>(y + static_cast<std::int64_t>(t) - radius, 0, last);
      rows_[t] = ring.row(static_cast<std::size_t>(at)).data();
    }
    weigh_rows(taps, std::span(rows_).first(taps.size()), out);
  }

  // The length of (derivative along x, derivative along y).
  void magnitude(const std::vector<float>& derivative, RowRing& along_x, std::uint32_t y,
                 std::span<float> out) {
    down(filters_.across, along_x, y, partial_);
    down(derivative, feature_[0], y, out);
    for (std::size_t x = 0; x < out.size(); ++x)
      out[x] = std::sqrt(partial_[x] * partial_[x] + out[x] * out[x]);
  }

  const CodeView& view_;
  const FlipFilters& filters_;
  const Matrix3f to_xyz_, from_xyz_;
  std::vector<float> values_, filtered_, partial_, padded_;
  std::vector<const float*> rows_;
  std::vector<RowRing> colour_, feature_;
};

}  // namespace

FlipFilters flip_filters(double pixels_per_degree) {
  FlipFilters out;
  out.achromatic = sensitivity_filter(kAchromatic, pixels_per_degree);
  out.red_green = sensitivity_filter(kRedGreen, pixels_per_degree);
  out.blue_yellow = sensitivity_filter(kBlueYellow, pixels_per_degree);
  const double deviation = 0.5 * kFeatureWidth * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * deviation));
  std::vector<double> across, edge, point;
  for (int i = -radius; i <= radius; ++i) {
    const double s = i / deviation, g = std::exp(-s * s / 2);
    across.push_back(g);
    edge.push_back(-s * g);
    point.push_back((s * s - 1) * g);
  }
  double sum = 0;
  for (const double v : across) sum += v;
  for (const double v : across) out.across.push_back(static_cast<float>(v / sum));
  out.edge = balanced(edge);
  out.point = balanced(point);
  return out;
}

double flip_by_rows(const CodeView& a, const CodeView& b, const FlipFilters& filters,
                    std::vector<float>* map) {
  const float most = largest_error(), knee = static_cast<float>(kKneeError) * most;
  constexpr float knee_out = static_cast<float>(kKneeOut);
  const float inverse_root2 = static_cast<float>(1 / std::numbers::sqrt2);
  FlipSide sides[2] = {{a, filters}, {b, filters}};
  const std::uint32_t reach = static_cast<std::uint32_t>(FlipSide::reach(filters));
  std::vector<float> error(a.width);
  if (map != nullptr) map->clear();
  double sum = 0;
  std::uint32_t taken = 0;
  for (std::uint32_t y = 0; y < a.height; ++y) {
    for (; taken < a.height && taken <= y + reach; ++taken) {
      for (FlipSide& side : sides) side.take(taken);
    }
    for (FlipSide& side : sides) side.finish(y);
    const auto at = [&](std::size_t side, std::size_t i) { return sides[side].filtered(i).data(); };
    const float *const l0 = at(0, 0), *const a0 = at(0, 1), *const b0 = at(0, 2), *const edge0 = at(0, 3),
                       *const point0 = at(0, 4), *const l1 = at(1, 0), *const a1 = at(1, 1),
                       *const b1 = at(1, 2), *const edge1 = at(1, 3), *const point1 = at(1, 4);
    for (std::size_t x = 0; x < error.size(); ++x) {
      const float da = a0[x] - a1[x], db = b0[x] - b1[x];
      const float hyab = std::fabs(l0[x] - l1[x]) + std::sqrt(da * da + db * db);
      const float colour = std::pow(hyab, kColourExponent);
      const float redistributed = colour < knee ? knee_out / knee * colour
                                                : knee_out + (colour - knee) / (most - knee) * (1 - knee_out);
      const float difference =
          std::max(std::fabs(edge0[x] - edge1[x]), std::fabs(point0[x] - point1[x])) * inverse_root2;
      static_assert(kFeatureExponent == 0.5f);
      const float feature = std::sqrt(std::min(difference, 1.0f));
      error[x] = std::min(std::pow(redistributed, 1 - feature), 1.0f);
    }
    for (const float v : error) sum += static_cast<double>(v);
    if (map != nullptr) map->insert(map->end(), error.begin(), error.end());
  }
  return sum / (static_cast<double>(a.width) * a.height);
}

}  // namespace btfc
