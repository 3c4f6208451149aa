// Model gm at the ends of what a valid file may hold, and over very many queries and samples: every way to
// decode against spec/models/gm.md section 4 in doubles, written down here once more.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "encoder/models/gm_em.h"
#include "encoder/models/gm_samples.h"
#include "encoder/split_mix.h"
#include "format/models/gm_payload.h"
#include "tests/btf_support.h"

namespace btfc::test {
namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr std::size_t kShare = 20;  // of the counts: everything is slower
#else
constexpr std::size_t kShare = 1;
#endif

constexpr double kLog2e = std::numbers::log2e;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// ---- The page in doubles ----

struct Component {
  double mu[6], sigma[6], p, c[4], h_v, h_l;
  bool counts;  // its weight is not 0
};

struct Answer {
  double value[4] = {}, other[4] = {};  // other: with the K-th and the next gate exchanged
  double gap = 1e300;                   // between those two
  double best = 0;                      // the highest gate
  // How far binary32 may be off in a gate that may count, powers of two: what its inputs, its products and
  // its sums are rounded by.
  double blur = 0;
};

struct Plain {
  double width = 1, height = 1;
  bool wraps = false, log = false;
  std::uint32_t gates = 0, channels = 3;
  std::vector<double> mean;
  std::vector<Component> components;

  double range() const;
  Answer at(const btfc_query& q) const;
};

double Plain::range() const {
  double most = 0;
  for (std::uint32_t c = 0; c < channels; ++c) {
    double low = 1e300, high = -1e300;
    for (const Component& m : components) {
      low = std::min(low, m.c[c]);
      high = std::max(high, m.c[c]);
    }
    most = std::max(most, high - low);
  }
  return most;
}

std::array<double, 3> upper_unit(const float (&d)[3]) {
  const double x = double{d[0]}, y = double{d[1]}, z = std::max(double{d[2]}, 0.0);
  const double length = std::sqrt(x * x + y * y + z * z);
  if (!(length > 1e-18 && length < 1e18)) return {0, 0, 1};
  return {x / length, y / length, z / length};
}

double wrapped(std::int32_t i, double size, bool wraps) {
  if (!wraps) return std::clamp<double>(i, 0, size - 1);
  return i - size * std::floor(i / size);
}

struct Gate {
  double l, far, blur, far_blur, kept;  // far: step 8's; kept: (g_x g_y)^(-1/2)
};

Answer Plain::at(const btfc_query& q) const {
  const std::array<double, 3> d[2] = {upper_unit(q.view), upper_unit(q.light)};
  double s[6] = {wrapped(q.x, width, wraps) + 0.5, wrapped(q.y, height, wraps) + 0.5}, slope[2][2];
  for (std::size_t i = 0; i < 2; ++i) {
    s[2 + 2 * i] = std::atan2(d[i][0], std::hypot(d[i][1], d[i][2]));
    s[3 + 2 * i] = std::atan2(d[i][1], d[i][2]);
    const double z = std::max(d[i][2], 0.2);
    slope[i][0] = d[i][0] / z;
    slope[i][1] = -d[i][1] / z;
  }
  const double f = std::min(double{q.footprint}, 0x1p20), v = q.footprint > 1 ? (f * f - 1) / 12 : 0;
  constexpr double kUnit = 0x1p-24;
  std::vector<Gate> gate(components.size());
  double far_best = -1e300;
  Answer out;
  out.best = -1e300;
  for (std::size_t m = 0; m < components.size(); ++m) {
    const Component& k = components[m];
    double distance = 0, blur = 0, peaks = 1;
    for (std::size_t n = 0; n < 6; ++n) {
      double t = s[n] - k.mu[n], off = 2 * kUnit * (std::fabs(s[n]) + std::fabs(k.mu[n]));
      double g = 1;
      if (n < 2) {
        const double drift = k.h_v * slope[0][n] + k.h_l * slope[1][n];
        t -= drift;
        off += 8 * kUnit * (std::fabs(k.h_v * slope[0][n]) + std::fabs(k.h_l * slope[1][n]));
        const double period = n == 0 ? width : height;
        if (wraps) t -= period * std::floor(t / period + 0.5);
        g = 1 + v / (k.sigma[n] * k.sigma[n]);
        peaks *= g;
      } else {
        off += 8e-7;  // two angles of btfc_atan2
      }
      const double scale = kLog2e / 2 / (k.sigma[n] * k.sigma[n] * g);
      distance += scale * t * t;
      blur += scale * (2 * std::fabs(t) * off + off * off);
      if (n == 1) {
        gate[m].l = -distance;
        gate[m].blur = blur;
        distance = blur = 0;
      }
    }
    const double area = std::log2(k.sigma[0] * k.sigma[1]);
    gate[m].far = k.p + area - distance;
    gate[m].far_blur = blur + 16 * kUnit * (std::fabs(k.p) + std::fabs(area) + distance);
    // A scale is good to 6e-7 of itself (btfc_exp2, btfc_log2), sums to a few units.
    gate[m].blur += blur + 16 * kUnit * (std::fabs(k.p) - gate[m].l + distance + 1);
    gate[m].l += k.p - std::log2(peaks) / 2 - distance;
    gate[m].kept = 1 / std::sqrt(peaks);
    if (!k.counts) continue;
    out.best = std::max(out.best, gate[m].l);
    far_best = std::max(far_best, gate[m].far);
  }
  // What may count, as binary32 sees it.
  for (std::size_t m = 0; m < components.size(); ++m) {
    if (!components[m].counts) continue;
    if (gate[m].l + gate[m].blur > out.best - 24) out.blur = std::max(out.blur, gate[m].blur);
    if (v > 0 && gate[m].far + gate[m].far_blur > far_best - 24)
      out.blur = std::max(out.blur, gate[m].far_blur);
  }
  double far_limit[4] = {}, far_total = 0;
  for (std::size_t m = 0; m < components.size() && v > 0; ++m) {
    if (!components[m].counts) continue;
    const double w = std::exp2(gate[m].far - far_best);
    far_total += w;
    for (std::uint32_t c = 0; c < channels; ++c) far_limit[c] += w * components[m].c[c];
  }
  for (std::uint32_t c = 0; c < channels && v > 0; ++c) far_limit[c] /= far_total;

  std::vector<std::size_t> order;
  for (std::size_t m = 0; m < components.size(); ++m) {
    if (components[m].counts) order.push_back(m);
  }
  std::size_t counted = order.size();
  if (gates > 0 && gates < order.size()) {
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return gate[a].l > gate[b].l; });
    counted = gates;
    out.gap = gate[order[gates - 1]].l - gate[order[gates]].l;
  }
  const auto expectation = [&](double* value) {
    double total = 0, sums[4] = {};
    for (std::size_t i = 0; i < counted; ++i) {
      const std::size_t m = order[i];
      if (gate[m].l < out.best - 200) continue;
      const double w = std::exp2(gate[m].l - out.best);
      total += w;
      for (std::uint32_t c = 0; c < channels; ++c)
        sums[c] += w * (components[m].c[c] - (1 - gate[m].kept) * far_limit[c]);
    }
    for (std::uint32_t c = 0; c < channels; ++c) {
      const double t = mean[c] + sums[c] / total;
      value[c] = log ? std::expm1(std::min(t, 126 * std::numbers::ln2)) : t;
    }
  };
  expectation(out.value);
  if (counted < order.size()) std::swap(order[counted - 1], order[counted]);
  expectation(out.other);
  return out;
}

// ---- Files made by hand ----

// A component's numbers as its rows have them. Layout `paper`: sigma itself, and the weight.
struct Part {
  float mu[6] = {}, spread[6] = {}, peak = 0, c[4] = {}, h[2] = {};
};

struct Shape {
  std::uint32_t width = 16, height = 13, gates = 0, channels = 3, levels = 1;
  bool wraps = true, shear = true, log = false;
  GmLayout layout = GmLayout::compact;
  Precision precision = Precision::f32;
};

struct Made {
  Head head;
  GmParm parm;
  Plain plain;
  std::vector<RawChunk> chunks;
  TexturePtr texture;
};

CodedRows coded(const Shape& shape, const std::vector<Part>& parts) {
  const bool paper = shape.layout == GmLayout::paper;
  std::vector<float> values;
  const auto row = [&](const auto& number) {
    for (const Part& part : parts) values.push_back(number(part));
  };
  const auto outputs = [&] {
    for (std::uint32_t c = 0; c < shape.channels; ++c) row([c](const Part& p) { return p.c[c]; });
  };
  for (std::size_t n = 0; n < 6; ++n) row([n](const Part& p) { return p.mu[n]; });
  if (paper) outputs();
  for (std::size_t n = 0; n < 6; ++n) row([n](const Part& p) { return p.spread[n]; });
  for (std::uint32_t c = 0; c < shape.channels && paper; ++c) row([](const Part&) { return 0.1f; });
  row([](const Part& p) { return p.peak; });
  if (!paper) outputs();
  for (std::size_t h = 0; h < 2 && shape.shear && !paper; ++h) row([h](const Part& p) { return p.h[h]; });
  return code_rows(values, values.size() / parts.size(), parts.size(), shape.precision);
}

// One view and one light, so that the mean BRDF is the same for all queries.
Made make(const Shape& shape, const CodedRows& rows) {
  Made made;
  Head& head = made.head;
  head.model = ModelId::gm;
  head.width = shape.width;
  head.height = shape.height;
  head.wrap_u = head.wrap_v = shape.wraps ? Wrap::repeat : Wrap::clamp;
  head.value_transform = shape.log ? ValueTransform::log : ValueTransform::identity;
  head.maps = {Map{}};
  head.maps[0].channels = shape.channels;
  GmParm& parm = made.parm;
  const bool paper = shape.layout == GmLayout::paper;
  parm.components = static_cast<std::uint32_t>(rows.columns);
  parm.gates = shape.gates;
  parm.levels = shape.levels;
  parm.layout = shape.layout;
  parm.precision = shape.precision;
  parm.mean = GmMeanForm::f32;
  parm.shear = shape.shear && !paper;
  GmPayload payload{{{point_of(0.3, 1)}, {point_of(0.7, 2)}, {{0, 0}}}, rows, {}};
  payload.mean.form = parm.mean;
  payload.mean.views = payload.mean.lights = payload.mean.pairs = 1;
  payload.mean.channels = shape.channels;
  payload.mean.table = {0.25f, 0.5f, 0.75f, 1};
  payload.mean.table.resize(shape.channels);
  made.chunks = gm_write(head, parm, payload);

  Plain& plain = made.plain;
  plain.width = shape.width;
  plain.height = shape.height;
  plain.wraps = shape.wraps;
  plain.log = shape.log;
  plain.gates = shape.gates;
  plain.channels = shape.channels;
  plain.mean.assign(payload.mean.table.begin(), payload.mean.table.end());
  const std::uint64_t spreads = paper ? 6 + shape.channels : 6, colours = paper ? 6 : 13,
                      peak = paper ? 2 * (6 + shape.channels) : 12, heights = 13 + shape.channels;
  for (std::uint64_t m = 0; m < rows.columns; ++m) {
    const auto number = [&](std::uint64_t r) { return static_cast<double>(rows.value(r, m)); };
    Component k{};
    k.p = paper ? std::log2(number(peak)) : number(peak);
    for (std::size_t n = 0; n < 6; ++n) {
      k.mu[n] = number(n);
      k.sigma[n] = paper ? number(spreads + n) : std::exp2(number(spreads + n));
      if (paper) k.p -= std::log2(k.sigma[n]);
    }
    for (std::uint32_t c = 0; c < shape.channels; ++c) k.c[c] = number(colours + c);
    k.h_v = parm.shear ? number(heights) : 0;
    k.h_l = parm.shear ? number(heights + 1) : 0;
    k.counts = !paper || number(peak) > 0;
    plain.components.push_back(k);
  }
  const Result<Bytes> file = pack_file(made.chunks);
  EXPECT_TRUE(file);
  btfc_error error{};
  made.texture = load(*file, &error);
  EXPECT_TRUE(made.texture) << error.message;
  return made;
}

Made make(const Shape& shape, const std::vector<Part>& parts) { return make(shape, coded(shape, parts)); }

float uniform(SplitMix64& random, double low, double high) {
  return static_cast<float>(low + (high - low) * random.uniform());
}

// A mixture as a fit might give it.
std::vector<Part> ordinary(const Shape& shape, std::size_t count, SplitMix64& random) {
  std::vector<Part> parts(count);
  for (Part& part : parts) {
    for (std::size_t n = 0; n < 6; ++n) {
      part.mu[n] = n == 0   ? uniform(random, -2, shape.width + 2.0)
                   : n == 1 ? uniform(random, -2, shape.height + 2.0)
                            : uniform(random, -1.5, 1.5);
      part.spread[n] = n < 2 ? uniform(random, -1, 3) : uniform(random, -2.5, 1);
      if (shape.layout == GmLayout::paper) part.spread[n] = std::exp2(part.spread[n]);
    }
    part.peak = shape.layout == GmLayout::paper ? uniform(random, 0, 1) : uniform(random, -4, 4);
    for (float& c : part.c) c = uniform(random, -0.5, 0.5);
    for (float& h : part.h) h = uniform(random, -1, 1);
  }
  return parts;
}

// ---- Queries ----

void point(float (&to)[3], SplitMix64& random) {
  const std::uint32_t kind = random.below(16);
  const double z = kind == 0 ? 0 : random.uniform(), r = std::sqrt(1 - z * z);
  // Azimuths round the seam at 0 and 360 degrees, and the axes themselves.
  const double phi = kind == 1   ? 1e-4 * (random.uniform() - 0.5)
                     : kind == 2 ? std::numbers::pi / 2 * random.below(4)
                                 : 2 * std::numbers::pi * random.uniform();
  const double length = kind < 6 ? std::exp2(60 * random.uniform() - 30) : 1;
  to[0] = static_cast<float>(length * r * std::cos(phi));
  to[1] = static_cast<float>(length * r * std::sin(phi));
  to[2] = static_cast<float>(length * (kind == 3 ? -z : z));
  if (kind == 4) to[0] = to[1] = 0;
  if (kind == 5) to[1] = to[0] *= 1e-4f;  // all but the pole
}

btfc_query anywhere(const Shape& shape, SplitMix64& random) {
  btfc_query q{};
  q.x = static_cast<std::int32_t>(random.below(4 * shape.width)) - static_cast<std::int32_t>(shape.width);
  q.y = static_cast<std::int32_t>(random.below(4 * shape.height)) - static_cast<std::int32_t>(shape.height);
  if (random.below(64) == 0) q.x = random.below(2) == 0 ? INT32_MIN : INT32_MAX;
  if (random.below(64) == 0) q.y = random.below(2) == 0 ? INT32_MIN : INT32_MAX;
  point(q.view, random);
  point(q.light, random);
  return q;
}

std::vector<btfc_query> many(const Shape& shape, std::size_t count, SplitMix64& random) {
  std::vector<btfc_query> queries(count);
  for (btfc_query& q : queries) q = anywhere(shape, random);
  return queries;
}

// All texels under the directions of one query.
std::vector<btfc_query> whole(const Shape& shape, const btfc_query& like) {
  std::vector<btfc_query> queries;
  for (std::uint32_t i = 0; i < shape.width * shape.height; ++i) {
    queries.push_back(like);
    queries.back().x = static_cast<std::int32_t>(i % shape.width);
    queries.back().y = static_cast<std::int32_t>(i / shape.width);
  }
  return queries;
}

// ---- The ways to decode: four floats a query ----

// So many in one call are answered together.
constexpr std::size_t kTogether = 256;

std::vector<float> one_by_one(const Made& made, const std::vector<btfc_query>& queries) {
  std::vector<float> values(4 * queries.size());
  for (std::size_t i = 0; i < queries.size(); ++i) {
    EXPECT_EQ(btfc_eval(made.texture.get(), nullptr, &queries[i], sizeof(btfc_query), 1, &values[4 * i], 4),
              BTFC_OK);
  }
  return values;
}

std::vector<float> together(const Made& made, std::vector<btfc_query> queries) {
  const std::size_t count = queries.size();
  while (queries.size() < kTogether) queries.push_back(queries[0]);
  std::vector<float> values(4 * queries.size());
  EXPECT_EQ(btfc_eval(made.texture.get(), nullptr, queries.data(), sizeof(btfc_query), queries.size(),
                      values.data(), 4),
            BTFC_OK);
  values.resize(4 * count);
  return values;
}

std::vector<float> as_image(const Made& made, const btfc_query& like) {
  btfc_directions d{};
  std::copy_n(like.view, 3, d.view);
  std::copy_n(like.light, 3, d.light);
  d.footprint = like.footprint;
  const std::uint32_t w = made.head.width, h = made.head.height, s = made.head.channels();
  std::vector<float> packed(std::size_t{w} * h * s), values(std::size_t{w} * h * 4);
  EXPECT_EQ(btfc_decode_rect(made.texture.get(), nullptr, 0, &d, 0, 0, w, h, BTFC_FLOAT32, packed.data(),
                             std::size_t{w} * s * 4, packed.size() * 4),
            BTFC_OK);
  for (std::size_t i = 0; i < packed.size(); ++i) values[i / s * 4 + i % s] = packed[i];
  return values;
}

struct Judged {
  double worst = 0;  // error over the bound
  double largest_error = 0;
  std::string where;
  std::size_t resolved = 0, blurred = 0, ties = 0;
};

// The page's bound; blurred, or beyond the gates of 10^3 that the page speaks of: gates that binary32 cannot
// resolve widen it, and where they are blurred by more than a power of two nothing but finiteness is asked
// for.
void judge(const Made& made, const std::vector<btfc_query>& queries, const std::vector<Answer>& answers,
           const std::vector<float>& values, bool blurred, Judged& out) {
  const Plain& plain = made.plain;
  const double range = plain.range();
  double largest = 0;
  for (const Answer& a : answers) {
    for (std::uint32_t c = 0; c < plain.channels; ++c)
      largest = std::max(largest, std::fabs(plain.log ? std::log1p(a.value[c]) : a.value[c]));
  }
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const Answer& a = answers[i];
    double off[2] = {};
    for (std::uint32_t c = 0; c < plain.channels; ++c) {
      const auto got = static_cast<double>(values[4 * i + c]);
      if (!std::isfinite(got)) {
        ADD_FAILURE() << "not finite: query " << i;
        return;
      }
      const auto away = [&](double wanted) {
        return plain.log ? std::fabs(std::log1p(got) - std::log1p(wanted)) : std::fabs(got - wanted);
      };
      off[0] = std::max(off[0], away(a.value[c]));
      off[1] = std::max(off[1], away(a.other[c]));
    }
    const double blur = blurred || a.best < -1000 ? 2 * a.blur : 0;
    if (blur > 1) {
      ++out.blurred;
      continue;
    }
    ++out.resolved;
    // Gates that are equal are so in binary32 too: there the first counts.
    const bool either = a.gap > 0 && a.gap < std::max(0x1p-14, blur);
    out.ties += either;
    const double error = either ? std::min(off[0], off[1]) : off[0];
    const double bound = 1e-4 * range + 1e-5 * largest + range * (std::exp2(blur) - 1) + 1e-30;
    out.largest_error = std::max(out.largest_error, error);
    if (error / bound <= out.worst) continue;
    out.worst = error / bound;
    const btfc_query& q = queries[i];
    out.where = fmt::format(
        "texel ({}, {}) view ({}, {}, {}) light ({}, {}, {}) footprint {}: off by {:.3g} of {:.3g}, range "
        "{:.3g}, "
        "highest gate {:.6g}, gap {:.3g}",
        q.x, q.y, q.view[0], q.view[1], q.view[2], q.light[0], q.light[1], q.light[2], q.footprint, error,
        a.value[0], range, a.best, a.gap);
  }
}

std::vector<Answer> answers_of(const Made& made, const std::vector<btfc_query>& queries) {
  std::vector<Answer> answers(queries.size());
  for (std::size_t i = 0; i < queries.size(); ++i) answers[i] = made.plain.at(queries[i]);
  return answers;
}

// One by one, together and as images of a few of the directions.
Judged judge_all(const Made& made, const Shape& shape, const std::vector<btfc_query>& queries,
                 std::size_t images, bool blurred = false) {
  Judged out;
  const std::vector<Answer> answers = answers_of(made, queries);
  judge(made, queries, answers, one_by_one(made, queries), blurred, out);
  judge(made, queries, answers, together(made, queries), blurred, out);
  for (std::size_t i = 0; i < images; ++i) {
    const std::vector<btfc_query> texels = whole(shape, queries[i]);
    judge(made, texels, answers_of(made, texels), as_image(made, queries[i]), blurred, out);
  }
  EXPECT_LE(out.worst, 1) << out.where;
  return out;
}

void report(const char* what, const Judged& judged) {
  fmt::print("{}: {:.3g} of the bound, off by {:.3g} ({} values, {} blurred, {} ties); {}\n", what,
             judged.worst, judged.largest_error, judged.resolved, judged.blurred, judged.ties, judged.where);
  testing::Test::RecordProperty("worst_over_bound", fmt::format("{:.6g}", judged.worst));
}

// ---- Numbers of components, gates ----

TEST(GmExtremes, OneComponentAndManyAsFiles) {
  SplitMix64 random(1);
  for (const std::uint32_t count : {1u, 4096u}) {
    for (const bool wraps : {false, true}) {
      for (const std::uint32_t gates : {0u, 1u, 9u}) {
        Shape shape;
        shape.wraps = wraps;
        shape.gates = gates;
        shape.levels = count == 1 ? 1 : 13;
        const Made made = make(shape, ordinary(shape, count, random));
        check_sizes(made.head, made.chunks, gm_formula_bits(made.head, made.parm),
                    gm_memory_bits(made.head, made.parm));
        // By the page: 16 bytes, the mean, 18 rows of binary32.
        EXPECT_EQ(gm_formula_bits(made.head, made.parm), 8u * (16 + 12) + 32u * 18 * count);
        const Judged judged = judge_all(
            made, shape, many(shape, 300 / (count == 1 ? 1 : std::min<std::size_t>(kShare, 4)), random), 2);
        if (count == 1) {
          // Whatever is asked, the value is mean + c (section 5).
          EXPECT_LT(judged.largest_error, 1e-6);
        } else {
          report(fmt::format("M 4096, K {}, {}", gates, wraps ? "wraps" : "clamps").c_str(), judged);
        }
      }
    }
  }
}

// Components that stand twice have the same gates with other outputs: of equal ones the first counts.
TEST(GmExtremes, EveryNumberOfGatesWithTies) {
  SplitMix64 random(2);
  Judged all;
  for (const GmLayout layout : {GmLayout::compact, GmLayout::paper}) {
    for (const bool wraps : {false, true}) {
      Shape shape;
      shape.width = 18;
      shape.wraps = wraps;
      shape.layout = layout;
      std::vector<Part> parts = ordinary(shape, 24, random);
      // Twins, triplets, and one that stands five times, neighbours or not.
      for (const auto& [to, from] :
           {std::pair{1, 0}, {23, 0}, {9, 8}, {12, 4}, {13, 4}, {14, 4}, {22, 4}, {17, 16}}) {
        Part& twin = parts[static_cast<std::size_t>(to)];
        twin = parts[static_cast<std::size_t>(from)];
        for (float& c : twin.c) c = uniform(random, -0.5, 0.5);
      }
      for (std::uint32_t k = 0; k <= 32; ++k) {
        shape.gates = k;
        const Made made = make(shape, parts);
        const Judged judged =
            judge_all(made, shape, many(shape, 400 / std::min<std::size_t>(kShare, 4), random), 2);
        if (judged.worst > all.worst) all = judged;
        if (HasFailure()) FAIL() << "K " << k;
      }
    }
  }
  report("K 0 to 32 of 24", all);
}

// Few components, all of them the same but for their outputs: every texel ties.
TEST(GmExtremes, NothingButTies) {
  SplitMix64 random(3);
  Shape shape;
  for (const std::size_t count : {2u, 17u, 40u, 300u}) {
    std::vector<Part> parts = ordinary(shape, 1, random);
    parts.resize(count, parts[0]);
    for (Part& part : parts) {
      for (float& c : part.c) c = uniform(random, -0.5, 0.5);
    }
    for (const std::uint32_t k : {0u, 1u, 2u, 16u, 32u}) {
      shape.gates = k;
      judge_all(make(shape, parts), shape, many(shape, 300, random), 2);
      if (HasFailure()) FAIL() << "K " << k << " of " << count;
    }
  }
}

TEST(GmExtremes, WeightsOfNothing) {
  SplitMix64 random(4);
  Judged all;
  for (const std::size_t used : {1u, 2u, 30u}) {
    for (const std::uint32_t k : {0u, 1u, 2u, 3u, 32u}) {
      Shape shape;
      shape.layout = GmLayout::paper;
      shape.gates = k;
      std::vector<Part> parts = ordinary(shape, 60, random);
      for (std::size_t m = 0; m < parts.size(); ++m) {
        // What never counts has the largest outputs that there are; the others also the least weight.
        if (m % (60 / used) != 1) {
          parts[m].peak = 0;
          if (m % 2 == 0) parts[m].c[0] = 4294967296.0f;
        } else if (m % 4 == 1) {
          parts[m].peak = std::numeric_limits<float>::denorm_min();
        }
      }
      Made made = make(shape, parts);
      // The range is that of what counts.
      std::erase_if(made.plain.components, [](const Component& c) { return !c.counts; });
      std::vector<btfc_query> queries = many(shape, 300, random);
      for (std::size_t i = 0; i < queries.size(); i += 3) queries[i].footprint = 5;
      const Judged judged = judge_all(made, shape, queries, 4);
      if (judged.worst > all.worst) all = judged;
      if (HasFailure()) FAIL() << used << " used, K " << k;
    }
  }
  report("weights of 0", all);
}

// ---- Ends of numbers ----

// Every number at one end of its rule or the other, or at 0.
TEST(GmExtremes, EndsOfRuleGm4) {
  SplitMix64 random(5);
  Judged all;
  std::size_t resolved = 0, blurred = 0;
  for (int file = 0; file < 120 / (kShare > 1 ? 6 : 1); ++file) {
    Shape shape;
    shape.wraps = file % 2 == 1;
    shape.shear = file % 3 > 0;
    shape.layout = file % 5 == 4 ? GmLayout::paper : GmLayout::compact;
    shape.gates = file % 7 == 6 ? 1 + random.below(32) : 0;
    shape.width = file % 4 == 0 ? 1 : 1 + random.below(20);
    const bool paper = shape.layout == GmLayout::paper;
    // One kind of number at its ends alone, or all of them.
    const std::uint32_t which = random.below(6);
    const auto ends = [&](std::uint32_t kind) { return which == kind || which == 5; };
    std::vector<Part> parts = ordinary(shape, 1 + random.below(40), random);
    for (Part& part : parts) {
      const auto end = [&](float low, float high) {
        const std::uint32_t side = random.below(3);
        return side == 0 ? low : side == 1 ? high : 0.0f;
      };
      for (std::size_t n = 0; n < 6; ++n) {
        if (ends(0)) part.mu[n] = end(-0x1p20f, 0x1p20f);
        if (ends(1)) part.spread[n] = paper ? random.below(2) == 0 ? 0x1p-12f : 0x1p30f : end(-12, 30);
        if (ends(4) && !paper) part.spread[n] = 30;
      }
      if (ends(2)) part.peak = paper ? random.below(2) == 0 ? 1e-45f : 1 : end(-1024, 1024);
      for (float& h : part.h) {
        if (ends(3)) h = end(-0x1p20f, 0x1p20f);
      }
      if (ends(4)) part.c[0] = end(-0x1p32f, 0x1p32f);
    }
    const Made made = make(shape, parts);
    std::vector<btfc_query> queries = many(shape, 300, random);
    for (std::size_t i = 0; i < queries.size(); i += 4)
      queries[i].footprint = random.below(2) == 0 ? 3.0f : kInfinity;
    const Judged judged = judge_all(made, shape, queries, 5, true);
    resolved += judged.resolved;
    blurred += judged.blurred;
    if (judged.worst > all.worst) all = judged;
    if (HasFailure()) FAIL() << "file " << file << " kind " << which;
  }
  all.resolved = resolved;
  all.blurred = blurred;
  report("ends of GM4", all);
  EXPECT_GT(resolved, blurred) << "most is judged by its value";
}

// Spreads of 2^-12 texels and radians at the very places that are asked for: there gates are exact.
TEST(GmExtremes, NeedlesAndPlains) {
  SplitMix64 random(6);
  Shape shape;
  shape.channels = 4;
  for (const float plain_peak : {-1024.0f, 0.0f}) {
    std::vector<Part> parts(shape.width * shape.height / 2 + 1);
    for (std::size_t m = 0; m < parts.size(); ++m) {
      Part& part = parts[m];
      const bool plain = m + 1 == parts.size();
      for (std::size_t n = 0; n < 6; ++n) part.spread[n] = plain ? 30.0f : -12.0f;
      part.mu[0] = static_cast<float>(2 * m % shape.width) + 0.5f;
      part.mu[1] = static_cast<float>(2 * m / shape.width) + 0.5f;
      part.peak = plain ? plain_peak : m % 2 == 0 ? 1024.0f : plain_peak + 1;
      for (float& c : part.c) c = plain ? -1.0f : uniform(random, -0.5, 0.5);
    }
    const Made made = make(shape, parts);
    btfc_query pole{};
    pole.view[2] = pole.light[2] = 1;
    const std::vector<btfc_query> queries = whole(shape, pole);
    for (const std::vector<float>& values :
         {one_by_one(made, queries), together(made, queries), as_image(made, pole)}) {
      for (std::size_t i = 0; i < queries.size(); ++i) {
        // Even texels have a needle, of which every second one is but twice as high as the plain.
        const std::size_t m = i / 2;
        const bool needle = i % 2 == 0;
        for (std::size_t c = 0; c < 4; ++c) {
          const double own = double{parts[m].c[c]};
          const double e = !needle ? -1 : m % 2 == 0 ? own : (2 * own - 1) / 3;
          ASSERT_NEAR(double{values[4 * i + c]}, 0.25 * static_cast<double>(c + 1) + e, 2e-6) << i;
        }
      }
    }
  }
}

// All gates lie below anything that binary32 can hold as a power of two.
TEST(GmExtremes, NothingUnderflowsButWhatHasNoWeight) {
  SplitMix64 random(7);
  Judged all;
  for (const bool wraps : {false, true}) {
    for (const std::uint32_t gates : {0u, 3u}) {
      Shape shape;
      shape.wraps = wraps;
      shape.gates = gates;
      std::vector<Part> parts = ordinary(shape, 50, random);
      for (Part& part : parts) {
        for (std::size_t n = 2; n < 6; ++n) {
          part.mu[n] = uniform(random, 1.40, 1.44);
          part.spread[n] = uniform(random, -3.05, -3);
        }
        part.peak = uniform(random, -150, -140);
      }
      const Made made = make(shape, parts);
      std::vector<btfc_query> queries = many(shape, 600, random);
      for (btfc_query& q : queries) {
        q.view[0] = q.light[0] = uniform(random, -0.2, 0);
        q.view[1] = q.light[1] = uniform(random, -0.2, 0);
        q.view[2] = q.light[2] = 1;
      }
      for (const btfc_query& q : queries) {
        const double best = made.plain.at(q).best;
        ASSERT_LT(best, -250);
        ASSERT_GT(best, -1500);
      }
      const Judged judged = judge_all(made, shape, queries, 4);
      if (judged.worst > all.worst) all = judged;
    }
  }
  report("underflow", all);
}

// From spreads that fits give to needles of 2^-12 radians, asked for anywhere: where the highest gate is a
// few thousand below 0, values may be off by 1.5 10^-4 of the range, half as much again as the page's bound.
TEST(GmExtremes, NarrowAngles) {
  SplitMix64 random(15);
  Judged all;
  for (const float spread : {-3.0f, -4.0f, -5.0f, -6.0f, -8.0f, -10.0f, -12.0f}) {
    Shape shape;
    std::vector<Part> parts = ordinary(shape, 50, random);
    for (Part& part : parts) std::fill_n(part.spread + 2, 4, spread);
    const Judged judged = judge_all(make(shape, parts), shape, many(shape, 4000 / kShare, random), 4);
    if (judged.worst > all.worst) all = judged;
  }
  report("narrow angles", all);
}

// u8: codes 0 and 255 alone, between rows' ends at those of the rules, and steps of 0. f16: the largest, the
// least subnormal and the rules' ends.
TEST(GmExtremes, EndsOfCodes) {
  SplitMix64 random(8);
  Judged all;
  std::size_t resolved = 0;
  for (int file = 0; file < 80 / (kShare > 1 ? 4 : 1); ++file) {
    Shape shape;
    shape.wraps = file % 2 == 0;
    shape.precision = file % 4 < 2 ? Precision::u8 : Precision::f16;
    shape.levels = 1 + random.below(4);
    shape.gates = file % 5 == 0 ? 2 : 0;
    const std::size_t count = 8 + random.below(30);
    CodedRows rows = coded(shape, ordinary(shape, count, random));
    for (std::uint64_t r = 0; r < rows.rows; ++r) {
      const bool place = r < 6 || r >= 16, spread = r >= 6 && r < 12, peak = r == 12;
      if (shape.precision == Precision::u8) {
        // Rows that keep their scale, have a step of 0, or reach from end to end.
        const std::uint32_t kind = random.below(file < 20 ? 2 : 4);
        RowScale& scale = rows.scales[r];
        if (kind == 1) scale.step = 0;
        if (kind > 1) {
          const float low = spread ? -12.0f : place ? -0x1p20f : peak ? -1024.0f : -0x1p32f;
          const float high = spread ? 30.0f : -low;
          scale = {low, (high - low) / 255};
          while (scale.offset + scale.step * 255 > high) scale.step = std::nextafter(scale.step, 0.0f);
        }
        for (std::uint64_t m = 0; m < count; ++m) rows.elements[r * count + m] = random.below(2) * 255;
        EXPECT_EQ(rows.value(r, 0),
                  rows.elements[r * count] == 0 ? scale.offset : scale.offset + scale.step * 255);
      } else {
        for (std::uint64_t m = 0; m < count; ++m) {
          std::uint32_t& bits = rows.elements[r * count + m];
          const std::uint32_t sign = random.below(2) * 0x8000u, kind = random.below(6);
          if (kind == 0) bits = sign | 1;  // 2^-24
          if (kind == 1) bits = sign | 0x3ff;
          if (kind == 2) bits = spread ? 0xca00 : peak ? sign | 0x6400 : sign | 0x7bff;  // -12; 1024; 65504
          if (kind == 3 && spread) bits = 0x4f80;                                        // 30
        }
      }
    }
    const Made made = make(shape, rows);
    std::vector<btfc_query> queries = many(shape, 300, random);
    for (std::size_t i = 0; i < queries.size(); i += 5) queries[i].footprint = 2.5f;
    const Judged judged = judge_all(made, shape, queries, 5, true);
    resolved += judged.resolved;
    if (judged.worst > all.worst) all = judged;
    if (HasFailure()) FAIL() << "file " << file;
  }
  all.resolved = resolved;
  report("codes", all);
  EXPECT_GT(resolved, 10000u / kShare);
}

// ---- Very many queries ----

TEST(GmExtremes, AMillionQueriesAgainstDoubles) {
  SplitMix64 random(9);
  constexpr std::size_t kFiles = 8, kQueries = 1'000'000 / kFiles / kShare,
                        kAlone = 100'000 / kFiles / kShare;
  Judged batch, alone;
  for (std::size_t file = 0; file < kFiles; ++file) {
    Shape shape;
    shape.width = 64;
    shape.height = 37;
    shape.wraps = file % 2 == 0;
    shape.gates = file % 4 == 3 ? 5 : 0;
    shape.shear = file != 4;
    shape.layout = file == 5 ? GmLayout::paper : GmLayout::compact;
    shape.precision = file == 5 ? Precision::f32 : static_cast<Precision>(file % 3);
    shape.log = file == 6;
    const Made made = make(shape, ordinary(shape, 32, random));
    std::vector<btfc_query> queries = many(shape, kQueries, random);
    std::vector<Answer> answers = answers_of(made, queries);
    judge(made, queries, answers, together(made, queries), false, batch);
    queries.resize(kAlone);
    answers.resize(kAlone);
    judge(made, queries, answers, one_by_one(made, queries), false, alone);
  }
  EXPECT_LE(batch.worst, 1) << batch.where;
  EXPECT_LE(alone.worst, 1) << alone.where;
  report("together", batch);
  report("one by one", alone);
}

// ---- Footprints ----

TEST(GmExtremes, FootprintsFromNothingToInfinity) {
  SplitMix64 random(10);
  Judged all;
  for (const bool wraps : {false, true}) {
    for (const std::uint32_t gates : {0u, 4u}) {
      Shape shape;
      shape.wraps = wraps;
      shape.gates = gates;
      const Made made = make(shape, ordinary(shape, 30, random));
      const std::vector<btfc_query> queries = many(shape, 300, random);
      const auto at = [&](float footprint) {
        std::vector<btfc_query> asked = queries;
        for (btfc_query& q : asked) q.footprint = footprint;
        return asked;
      };
      const auto image_at = [&](float footprint) {
        btfc_query q = queries[0];
        q.footprint = footprint;
        return as_image(made, q);
      };
      // None, nonsense and 1 are one texel, to the bit.
      const std::vector<float> one = one_by_one(made, at(1)), one_together = together(made, at(1)),
                               one_image = image_at(1);
      for (const float f : {0.0f, -0.0f, -3.0f, -kInfinity, kNan, 0.999999f, 1e-45f}) {
        EXPECT_EQ(one_by_one(made, at(f)), one) << f;
        EXPECT_EQ(together(made, at(f)), one_together) << f;
        EXPECT_EQ(image_at(f), one_image) << f;
      }
      // From 2^20 on they are all the same.
      for (const float f : {0x1p20f, 1e9f, std::numeric_limits<float>::max()}) {
        EXPECT_EQ(one_by_one(made, at(f)), one_by_one(made, at(kInfinity))) << f;
        EXPECT_EQ(together(made, at(f)), together(made, at(kInfinity))) << f;
        EXPECT_EQ(image_at(f), image_at(kInfinity)) << f;
      }
      for (const float f : {1.0f, 1.5f, 3.0f, 40.0f, 1e4f, 1e9f, kInfinity}) {
        const Judged judged = judge_all(made, shape, at(f), 3);
        if (judged.worst > all.worst) all = judged;
      }
      // Continuous at 1: sigmas are at least 1/2, so that g grows by 4 (f - 1) / 6 at most.
      if (gates > 0) continue;
      double before = 0;
      for (const float f : {std::nextafter(1.0f, 2.0f), 1 + 0x1p-16f, 1 + 0x1p-10f, 1 + 0x1p-6f}) {
        double off = 0;
        const std::vector<float> wide[] = {one_by_one(made, at(f)), together(made, at(f)), image_at(f)};
        const std::vector<float>* narrow[] = {&one, &one_together, &one_image};
        for (std::size_t way = 0; way < 3; ++way) {
          for (std::size_t i = 0; i < wide[way].size(); ++i)
            off = std::max(off, std::fabs(double{wide[way][i]} - double{(*narrow[way])[i]}));
        }
        EXPECT_LT(off, 3e-5 + 20 * (double{f} - 1)) << f;
        EXPECT_GE(off + 3e-5, before) << f;
        before = off;
      }
    }
  }
  report("footprints", all);
}

// One call with every kind of footprint and of direction that there is.
TEST(GmExtremes, CallsOfAllKindsAreFinite) {
  SplitMix64 random(11);
  Shape shape;
  const Made made = make(shape, ordinary(shape, 30, random));
  std::vector<btfc_query> queries = many(shape, 2000, random);
  const float odd[] = {0,      -0.0f,  1,      -1,     kNan,  kInfinity, -kInfinity, 1e38f,
                       -1e38f, 1e-45f, 1e-19f, 1e-18f, 1e18f, 1e19f,     5};
  for (btfc_query& q : queries) {
    q.footprint = odd[random.below(std::size(odd))];
    for (float& v : q.view) v = odd[random.below(std::size(odd))];
    for (float& v : q.light) v = random.below(2) == 0 ? v : odd[random.below(std::size(odd))];
  }
  const std::vector<float> values = together(made, queries), alone = one_by_one(made, queries);
  for (std::size_t i = 0; i < values.size(); ++i) {
    ASSERT_TRUE(std::isfinite(values[i]));
    ASSERT_NEAR(values[i], alone[i], 1e-4) << i / 4;
  }
  for (std::size_t i = 0; i < 60; ++i) {
    for (const float v : as_image(made, queries[i])) ASSERT_TRUE(std::isfinite(v));
  }
}

// The logarithm's ends: e^T - 1 is finite whatever T is.
TEST(GmExtremes, LogarithmsEnds) {
  Shape shape;
  shape.log = true;
  shape.channels = 1;
  for (const float c : {-4294967296.0f, -1000.0f, 0.0f, 11.0f, 87.0f, 88.0f, 4294967296.0f}) {
    std::vector<Part> parts(3);
    for (Part& part : parts) part.c[0] = c;
    SplitMix64 random(12);
    const Made made = make(shape, parts);
    const std::vector<btfc_query> queries = many(shape, 300, random);
    const double wanted = std::expm1(std::min(0.25 + double{c}, 126 * std::numbers::ln2));
    for (const std::vector<float>& values :
         {one_by_one(made, queries), together(made, queries), as_image(made, queries[0])}) {
      for (std::size_t i = 0; i < values.size(); i += 4) {
        ASSERT_TRUE(std::isfinite(values[i]));
        // An exponent of up to 126 is rounded by 2^-18.
        ASSERT_NEAR(double{values[i]} / wanted, 1, 2e-5) << c;
      }
    }
  }
}

// ---- Expectation maximisation ----

GmSamples noisy_samples(const Dataset& dataset) {
  GmSamples samples = gm_samples(dataset);
  samples.mean = gm_decoded_mean(samples, gm_code_mean(samples, gm_mean_table(samples), GmMeanForm::f32, 0));
  return samples;
}

Dataset noisy_set(std::uint32_t width, std::uint32_t height, int view_rings, std::uint32_t lights) {
  std::vector<Direction> some;
  for (std::uint32_t i = 0; i < lights; ++i) some.push_back(direction_from_degrees(20.0 * i, 77.0 * i));
  SplitMix64 random(13);
  return make_btf(
      btf_info(width, height, 3, SampleType::unorm8, rings(view_rings), some),
      [&](const Direction&, const Direction& light, std::uint32_t x, std::uint32_t, std::uint32_t c) {
        return 0.5 + 0.2 * std::sin(0.05 * x + c + light.theta) + 0.1 * (random.uniform() - 0.5);
      });
}

constexpr std::uint32_t kStrip = kShare > 1 ? 800 : 4000, kStripComponents = kStrip * 9 / 200;

// Components all over a long strip: most means are thousands of spreads from the origin.
GmEmMixture strip_mixture(const GmSamples& samples, std::uint32_t components, bool whole_floats) {
  SplitMix64 random(14);
  GmEmMixture out;
  out.components = components;
  out.channels = 3;
  out.mean.resize(std::size_t{components} * 9);
  out.spread.resize(out.mean.size());
  const double each = static_cast<double>(samples.width) / components;
  for (std::uint32_t m = 0; m < components; ++m) {
    out.weight.push_back(0.2 + random.uniform());
    const GmPairInputs& pair = samples.pairs[random.below(samples.pairs.size())];
    for (std::uint32_t n = 0; n < 9; ++n) {
      const double mean = n == 0   ? each * (m + random.uniform())
                          : n == 1 ? samples.height * random.uniform()
                          : n < 6  ? double{pair.angle[n - 2]} + 0.1 * random.gauss()
                                   : 0.1 * random.gauss();
      out.mean[std::size_t{n} * components + m] = whole_floats ? double{static_cast<float>(mean)} : mean;
      out.spread[std::size_t{n} * components + m] = (n == 0   ? 0.4 * each
                                                     : n == 1 ? 4
                                                     : n < 6  ? 0.5
                                                              : 0.2) *
                                                    (0.8 + 0.4 * random.uniform());
    }
  }
  const double all = std::accumulate(out.weight.begin(), out.weight.end(), 0.0);
  for (double& w : out.weight) w /= all;
  return out;
}

// Eqs 3 to 7 once more, over all samples and components, moments about the means.
struct EmPlain {
  GmEmSums sums;
  std::vector<float>
      naive;  // of x alone: sums of q, q x and q x x in binary32, as one pass from the origin would
};
EmPlain em_plain(const GmSamples& samples, const GmEmMixture& mixture) {
  const std::size_t count = mixture.components;
  EmPlain out;
  GmEmSums& sums = out.sums;
  sums.clear(mixture.components, 9);
  out.naive.assign(3 * count, 0.0f);
  // Of a pair of directions: all but x, y and the colours. way[n * count + m].
  std::vector<double> inverse(9 * count), top(count), fixed(count), way(9 * count), of_y(count), l(count);
  for (std::size_t m = 0; m < count; ++m) {
    top[m] = std::log(mixture.weight[m]) - 4.5 * std::log(2 * std::numbers::pi);
    for (std::size_t n = 0; n < 9; ++n) {
      const double spread = mixture.spread[n * count + m];
      inverse[n * count + m] = 0.5 / (spread * spread);
      top[m] -= std::log(spread);
    }
  }
  const auto step = [&](std::size_t n, double at, std::size_t m) {
    const double t = at - mixture.mean[n * count + m];
    way[n * count + m] = t;
    return t * t * inverse[n * count + m];
  };
  for (std::size_t p = 0; p < samples.pairs.size(); ++p) {
    for (std::size_t m = 0; m < count; ++m) {
      fixed[m] = top[m];
      for (std::size_t n = 2; n < 6; ++n) fixed[m] -= step(n, double{samples.pairs[p].angle[n - 2]}, m);
    }
    for (std::uint32_t y = 0; y < samples.height; ++y) {
      for (std::size_t m = 0; m < count; ++m) of_y[m] = fixed[m] - step(1, y + 0.5, m);
      for (std::uint32_t x = 0; x < samples.width; ++x) {
        double colour[3], most = -1e300, total = 0;
        for (std::uint32_t c = 0; c < 3; ++c)
          colour[c] = double{samples.value(p, x, y, c)} - double{samples.mean[p * 3 + c]};
        for (std::size_t m = 0; m < count; ++m) {
          l[m] = of_y[m] - step(0, x + 0.5, m) - step(6, colour[0], m) - step(7, colour[1], m) -
                 step(8, colour[2], m);
        }
        for (const double v : l) most = std::max(most, v);
        // What is left out weighs less than M e^-40 of the whole.
        for (double& v : l) total += v = v > most - 40 ? std::exp(v - most) : 0;
        sums.log_likelihood += most + std::log(total);
        for (std::size_t m = 0; m < count; ++m) {
          if (l[m] == 0) continue;
          const double q = l[m] / total;
          sums.sum[m] += q;
          for (std::size_t n = 0; n < 9; ++n) {
            const double t = way[n * count + m];
            sums.first[n * count + m] += q * t;
            sums.second[n * count + m] += q * t * t;
          }
          const float single = static_cast<float>(x) + 0.5f, share = static_cast<float>(q);
          out.naive[m] += share;
          out.naive[count + m] += share * single;
          out.naive[2 * count + m] += share * single * single;
        }
      }
    }
  }
  sums.samples = samples.count();
  return out;
}

struct EmErrors {
  double likelihood = 0, sum = 0, mean = 0, spread = 0;  // relative; mean: over the spread
};
EmErrors em_errors(const GmSamples& samples, const GmEmMixture& mixture, const GmEmSums& sums,
                   const GmEmSums& plain) {
  std::array<double, kGmMostDims> none{};
  const GmEmMixture got = gm_em_maximise(mixture, sums, none), wanted = gm_em_maximise(mixture, plain, none);
  EmErrors out;
  out.likelihood = std::fabs(sums.log_likelihood / plain.log_likelihood - 1);
  for (std::size_t m = 0; m < mixture.components; ++m) {
    // Components that have a hundredth of an equal share of the samples, or more.
    if (plain.sum[m] * mixture.components < 0.01 * static_cast<double>(samples.count())) continue;
    out.sum = std::max(out.sum, std::fabs(sums.sum[m] / plain.sum[m] - 1));
    for (std::size_t n = 0; n < 9; ++n) {
      const std::size_t at = n * mixture.components + m;
      if (wanted.spread[at] < 1e-3) continue;  // one view: nothing but rounding
      out.mean = std::max(out.mean, std::fabs(got.mean[at] - wanted.mean[at]) / wanted.spread[at]);
      out.spread = std::max(out.spread, std::fabs(got.spread[at] / wanted.spread[at] - 1));
    }
  }
  return out;
}

TEST(GmExtremes, EmPassOver100MillionPairsFarFromTheOrigin) {
  const Dataset dataset = noisy_set(kStrip, 4, 1, 5);
  const GmSamples samples = noisy_samples(dataset);
  const GmEmMixture mixture = strip_mixture(samples, kStripComponents, true);
  const EmPlain plain = em_plain(samples, mixture);
  const std::uint64_t pairs = samples.count() * mixture.components;
  EXPECT_GE(pairs, kShare == 1 ? 100'000'000u : 1'000'000u);
  for (const float reach : {0.0f, 24.0f}) {
    GmEmPass pass;
    pass.reach = reach;
    const GmEmSums sums = gm_em_pass(samples, mixture, pass);
    ASSERT_EQ(sums.samples, samples.count());
    EXPECT_TRUE(reach > 0 || sums.listed == pairs);
    const EmErrors e = em_errors(samples, mixture, sums, plain.sums);
    fmt::print(
        "{} pairs of samples and components, reach {}: likelihood {:.2g}, sums {:.2g}, means {:.2g}, spreads "
        "{:.2g}\n",
        pairs, reach, e.likelihood, e.sum, e.mean, e.spread);
    EXPECT_LT(e.likelihood, 1e-6);
    EXPECT_LT(e.sum, 2e-6);
    EXPECT_LT(e.mean, 2e-6);
    EXPECT_LT(e.spread, 2e-6);
  }
  // That the test has teeth: one pass from the origin in binary32 loses the spreads.
  double worst = 0;
  const GmEmMixture wanted = gm_em_maximise(mixture, plain.sums, {});
  for (std::size_t m = mixture.components / 2; m < mixture.components; ++m) {
    const float *q = plain.naive.data(), middle = q[mixture.components + m] / q[m];
    const float variance = q[2 * mixture.components + m] / q[m] - middle * middle;
    worst = std::max(worst, std::fabs(double{variance} / (wanted.spread[m] * wanted.spread[m]) - 1));
  }
  EXPECT_GT(worst, 0.01);
}

// Means that binary32 does not hold: gates are those of the rounded means, moments those of the true ones.
TEST(GmExtremes, EmPassWithMeansBetweenFloats) {
  const Dataset dataset = noisy_set(kStrip, 4, 0, 2);
  const GmSamples samples = noisy_samples(dataset);
  const GmEmMixture mixture = strip_mixture(samples, kStripComponents, false);
  const EmErrors e =
      em_errors(samples, mixture, gm_em_pass(samples, mixture, {}), em_plain(samples, mixture).sums);
  fmt::print("means between floats: likelihood {:.2g}, sums {:.2g}, means {:.2g}, spreads {:.2g}\n",
             e.likelihood, e.sum, e.mean, e.spread);
  // At x = 4000 a mean is rounded by 1.2e-4, a 60,000th of its spread.
  EXPECT_LT(e.likelihood, 1e-6);
  EXPECT_LT(e.sum, 1e-4);
  EXPECT_LT(e.mean, 1e-4);
  EXPECT_LT(e.spread, 1e-4);
}

// ---- Fits of what is extreme ----

double log_rmse(const Dataset& set, const Bytes& file, const std::function<double(std::uint32_t)>& wanted,
                double* worst = nullptr) {
  const TexturePtr t = load(file);
  const DatasetInfo& info = set.info();
  std::vector<float> values(std::size_t{info.width} * info.height * info.channel_count());
  double sum = 0, most = 0;
  std::size_t count = 0;
  for (const DirectionPair& pair : info.pairs) {
    btfc_directions d{};
    const Vector3 view = unit_vector(info.views[pair.view]), light = unit_vector(info.lights[pair.light]);
    for (std::size_t i = 0; i < 3; ++i) {
      d.view[i] = static_cast<float>(view[i]);
      d.light[i] = static_cast<float>(light[i]);
    }
    EXPECT_EQ(btfc_decode_rect(t.get(), nullptr, 0, &d, 0, 0, info.width, info.height, BTFC_FLOAT32,
                               values.data(), values.size() * 4 / info.height, values.size() * 4),
              BTFC_OK);
    for (std::size_t i = 0; i < values.size(); ++i) {
      EXPECT_TRUE(std::isfinite(values[i]));
      const double off = std::log1p(std::max(-0.5, double{values[i]})) -
                         std::log1p(wanted(static_cast<std::uint32_t>(i / info.channel_count())));
      most = std::max(most, std::fabs(off));
      sum += off * off;
      ++count;
    }
  }
  if (worst != nullptr) *worst = most;
  return std::sqrt(sum / static_cast<double>(count));
}

// Both fits in each form that numbers have.
std::vector<OptionValues> all_fits(const char* components) {
  std::vector<OptionValues> out;
  for (const char* precision : {"f32", "f16", "u8"}) {
    out.push_back(
        {{"components", components}, {"fit", "refined"}, {"precision", precision}, {"iterations", "40"}});
    out.push_back({{"components", components}, {"fit", "em"}, {"precision", precision}, {"iterations", "5"}});
  }
  out.push_back({{"components", components}, {"fit", "em"}, {"layout", "paper"}, {"iterations", "5"}});
  return out;
}

TEST(GmExtremes, ConstantsAreThemselves) {
  double worst = 0;
  for (const auto& [type, v] : {std::pair{SampleType::unorm8, 0.0},
                                {SampleType::unorm8, 1.0},
                                {SampleType::unorm16, 0.3},
                                {SampleType::float16, 0.0},
                                {SampleType::float16, 0x1p-24},
                                {SampleType::float16, 0.125},
                                {SampleType::float16, 65504.0}}) {
    const Dataset set =
        make_btf(btf_info(5, 4, 3, type, rings(1), rings(1)), [v = v](auto&&...) { return v; });
    for (OptionValues options : all_fits("7")) {
      for (const char* mean : {"f32", "coded"}) {
        if (options.contains("layout") && mean[0] == 'c') continue;
        options["mean-brdf"] = mean;
        double most = 0;
        log_rmse(
            set, encode("gm", set, options), [v = v](std::uint32_t) { return v; }, &most);
        worst = std::max(worst, most);
        EXPECT_LT(most, 0.005) << v << testing::PrintToString(options);
      }
    }
  }
  fmt::print("constants: off by {:.3g} of log(1 + value) at most\n", worst);
}

// One texel 10^4 times the mean of the others, in half floats by their logarithms and as they are.
TEST(GmExtremes, OneTexelFarAboveAllOthers) {
  const auto value = [](std::uint32_t texel) { return texel == 14 ? 5000.0 : 0.5; };
  const Dataset set = make_btf(btf_info(6, 5, 3, SampleType::float16, rings(1), rings(1)),
                               [&](const Direction&, const Direction&, std::uint32_t x, std::uint32_t y,
                                   std::uint32_t) { return value(y * 6 + x); });
  for (OptionValues options : all_fits("12")) {
    const double rms = log_rmse(set, encode("gm", set, options), value);
    // The mean alone is off by 1.46.
    EXPECT_LT(rms, 1.45) << testing::PrintToString(options);
    options["transform"] = "identity";
    EXPECT_TRUE(std::isfinite(rmse(set, encode("gm", set, options)))) << testing::PrintToString(options);
  }
}

// A single pair of a single texel, and half floats from 0 to 65,504 side by side.
TEST(GmExtremes, LeastSetsAndWidestValues) {
  for (const SampleType type : {SampleType::unorm8, SampleType::float16}) {
    const Dataset set = make_btf(btf_info(1, 1, 1, type, rings(0), rings(0)), [](auto&&...) { return 0.75; });
    for (const OptionValues& options : all_fits("3")) {
      double most = 0;
      log_rmse(
          set, encode("gm", set, options), [](std::uint32_t) { return 0.75; }, &most);
      EXPECT_LT(most, 0.004) << testing::PrintToString(options);
    }
  }
  const auto steps = [](std::uint32_t texel) {
    return texel % 3 == 0 ? 0.0 : texel % 3 == 1 ? 0x1p-24 : 65504.0;
  };
  const Dataset set = make_btf(btf_info(6, 6, 1, SampleType::float16, rings(1), rings(0)),
                               [&](const Direction&, const Direction&, std::uint32_t x, std::uint32_t y,
                                   std::uint32_t) { return steps(y * 6 + x); });
  for (OptionValues options : all_fits("20")) {
    EXPECT_TRUE(std::isfinite(log_rmse(set, encode("gm", set, options), steps)));
    options["transform"] = "identity";
    EXPECT_TRUE(std::isfinite(rmse(set, encode("gm", set, options)))) << testing::PrintToString(options);
  }
}

// More components than there are samples: those that die must not spread the row of the peaks so far that the
// codes of the others are worth nothing.
TEST(GmExtremes, DeadComponentsLeaveTheOthersTheirCodes) {
  for (const char* components : {"40", "1100"}) {
    const Dataset set = make_btf(btf_info(5, 4, 3, SampleType::unorm8, rings(1), rings(1)), bumpy);
    OptionValues options = {{"components", components}, {"fit", "em"}, {"iterations", "12"}};
    double off[3];
    for (std::size_t i = 0; i < 3; ++i) {
      options["precision"] = kPrecisionNames[i];
      off[i] = rmse(set, encode("gm", set, options));
    }
    fmt::print("M {}: f32 {:.4f}, f16 {:.4f}, u8 {:.4f}\n", components, off[0], off[1], off[2]);
    EXPECT_LT(off[1], 1.05 * off[0]) << components;
    EXPECT_LT(off[2], 1.2 * off[0]) << components;
  }
}

}  // namespace
}  // namespace btfc::test
