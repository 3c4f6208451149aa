// Synthetic BTFs: what is asked for, the same on any number of threads, and what light must do to a relief.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "encoder/synth/btf_light.h"
#include "encoder/synth/btf_relief.h"
#include "encoder/synth/btf_shade.h"
#include "encoder/synth/btf_synth.h"

namespace btfc::test {
namespace {

BtfSynthOptions tile(std::uint32_t width, std::uint32_t height, std::uint64_t seed = 1) {
  BtfSynthOptions options;
  options.width = width;
  options.height = height;
  options.seed = seed;
  return options;
}

// Image of the view and the light nearest to angles in degrees.
std::size_t pair_of(const DatasetInfo& info, double view_theta, double view_phi, double light_theta,
                    double light_phi) {
  const auto nearest = [](const std::vector<Direction>& among, double theta, double phi) {
    const Direction wanted = direction_from_degrees(theta, phi);
    const auto best =
        std::min_element(among.begin(), among.end(), [&](const Direction& a, const Direction& b) {
          return angle_between(a, wanted) < angle_between(b, wanted);
        });
    return static_cast<std::size_t>(best - among.begin());
  };
  return nearest(info.views, view_theta, view_phi) * info.lights.size() +
         nearest(info.lights, light_theta, light_phi);
}

std::vector<std::uint16_t> all_codes(const Dataset& dataset) {
  std::vector<std::uint16_t> codes(dataset.info().image_samples() * dataset.info().pairs.size());
  for (std::size_t p = 0; p < dataset.info().pairs.size(); ++p) {
    dataset.read_image(
        p, std::span(codes).subspan(p * dataset.info().image_samples(), dataset.info().image_samples()));
  }
  return codes;
}

double mean_of(const Image& image) {
  double sum = 0;
  for (const std::uint16_t c : image.codes) sum += static_cast<double>(code_value(image.type, c));
  return sum / static_cast<double>(image.codes.size());
}

// Pearson's, of two lists of the same length.
double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<double>(a.size());
  const double ma = std::accumulate(a.begin(), a.end(), 0.0) / n;
  const double mb = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - ma) * (b[i] - mb);
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i] - mb) * (b[i] - mb);
  }
  return ab / std::sqrt(aa * bb);
}

// Component c of the unit normals.
std::vector<double> component(const Image& normals, std::uint32_t c) {
  std::vector<double> out;
  for (std::size_t i = c; i < normals.codes.size(); i += 3) {
    out.push_back(2 * static_cast<double>(code_value(normals.type, normals.codes[i])) - 1);
  }
  return out;
}

class SynthBtf : public testing::TestWithParam<BtfKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, SynthBtf, testing::ValuesIn(btf_kinds().begin(), btf_kinds().end()),
                         [](const auto& test) { return std::string(test.param.name); });

// Tiles smaller than a feature, single rows and texels; halves are finite and not negative.
TEST_P(SynthBtf, AnySizeAndSeedGivesFiniteValues) {
  struct Size {
    std::uint32_t width, height;
    std::uint64_t seed;
  };
  for (const Size& size : {Size{1, 1, 0}, Size{8, 8, UINT64_MAX}, Size{33, 1, 5}, Size{2, 9, 12345}}) {
    BtfSynthOptions options = tile(size.width, size.height, size.seed);
    options.type = SampleType::float16;
    const Result<Dataset> dataset = synthesize_btf(GetParam().name, options);
    ASSERT_TRUE(dataset) << dataset.error().message;
    EXPECT_EQ(dataset->info().width, size.width);
    EXPECT_EQ(dataset->info().height, size.height);
    EXPECT_EQ(dataset->info().type, SampleType::float16);
    EXPECT_EQ(dataset->info().colour_space, ColourSpace::lin_rec709_scene);
    std::size_t bad = 0;
    double sum = 0;
    for (const std::uint16_t code : all_codes(*dataset)) {
      bad += code >= 0x7c00;  // infinity, NaN, and all with a sign
      sum += static_cast<double>(code_value(SampleType::float16, code));
    }
    EXPECT_EQ(bad, 0u) << size.width << "x" << size.height;
    EXPECT_GT(sum, 0);
  }
}

TEST_P(SynthBtf, ThreadsDoNotShow) {
  const auto on_threads = [&](int threads, std::uint64_t seed) {
    tbb::task_arena arena(threads);
    return arena.execute([&] { return all_codes(*synthesize_btf(GetParam().name, tile(7, 5, seed))); });
  };
  const auto one = on_threads(1, 1);
  EXPECT_EQ(one, on_threads(2, 1));
  EXPECT_NE(one, on_threads(2, 2)) << "the seed does not matter";
}

// Between the last column or row and the first the values change as between any two neighbours.
void expect_no_seams(const Dataset& dataset) {
  const std::uint32_t side = dataset.info().width;
  std::vector<double> columns(side), rows(side);  // mean change from k to k + 1
  for (std::size_t p = 0; p < dataset.info().pairs.size(); p += 97) {
    const Image image = dataset.image(p);
    for (std::uint32_t k = 0; k < side; ++k) {
      for (std::uint32_t i = 0; i < side; ++i) {
        for (std::uint32_t c = 0; c < 3; ++c) {
          columns[k] += std::abs(image.at(k, i, c) - image.at((k + 1) % side, i, c));
          rows[k] += std::abs(image.at(i, k, c) - image.at(i, (k + 1) % side, c));
        }
      }
    }
  }
  for (const std::vector<double>& change : {columns, rows}) {
    EXPECT_LE(change.back(), 1.3 * *std::max_element(change.begin(), change.end() - 1));
  }
}

// Light from the right brightens what faces right, light from the top what faces up.
void expect_slopes_facing_light_brighter(const Dataset& dataset, const Image& normals) {
  for (const std::uint32_t axis : {0u, 1u}) {
    const double phi = axis == 0 ? 0 : 90;
    const Image towards = dataset.image(pair_of(dataset.info(), 0, 0, 60, phi));
    const Image away = dataset.image(pair_of(dataset.info(), 0, 0, 60, phi + 180));
    std::vector<double> difference;
    for (std::size_t i = 1; i < towards.codes.size(); i += 3) {
      difference.push_back(double(towards.codes[i]) - double(away.codes[i]));
    }
    EXPECT_GT(correlation(difference, component(normals, axis)), 0.4) << "axis " << axis;
  }
}

TEST_P(SynthBtf, LooksRight) {
  const BtfSynthOptions options = tile(16, 16, 3);
  const Result<Dataset> dataset = synthesize_btf(GetParam().name, options);
  const Result<BtfGroundTruth> truth = btf_ground_truth(GetParam().name, options);
  ASSERT_TRUE(dataset && truth);
  const DatasetInfo& info = dataset->info();
  EXPECT_EQ(info.channels, (std::vector<std::string>{"R", "G", "B"}));
  EXPECT_EQ(info.type, SampleType::unorm8);
  EXPECT_EQ(info.colour_space, ColourSpace::srgb_rec709_scene);
  EXPECT_EQ(info.quantity, Quantity::reflectance_cos);
  EXPECT_TRUE(info.wraps);
  EXPECT_TRUE(info.full_product());
  EXPECT_EQ(info.views, ubo2003_directions());
  EXPECT_EQ(info.lights, ubo2003_directions());
  expect_no_seams(*dataset);
  expect_slopes_facing_light_brighter(*dataset, truth->normals);
  // The lamp's cosine is in the values.
  const auto mean = [&](double light_theta) {
    return mean_of(dataset->image(pair_of(info, 0, 0, light_theta, 0)));
  };
  EXPECT_GT(mean(0), 0.1);
  EXPECT_LT(mean(75), 0.8 * mean(0));
  EXPECT_GT(mean(75), 0.02);
}

TEST_P(SynthBtf, NormalsAreTheHeightsGradient) {
  const Result<BtfGroundTruth> truth = btf_ground_truth(GetParam().name, tile(40, 32));
  ASSERT_TRUE(truth) << truth.error().message;
  const Image &height = truth->height, &normals = truth->normals;
  EXPECT_EQ(height.type, SampleType::float16);
  EXPECT_EQ(height.channels, 1u);
  EXPECT_EQ(normals.type, SampleType::unorm16);
  EXPECT_EQ(normals.channels, 3u);
  const auto at = [&](std::uint32_t x, std::uint32_t y) {
    return static_cast<double>(code_value(height.type, height.at(x % 40, y % 32, 0)));
  };
  const auto nx = component(normals, 0), ny = component(normals, 1), nz = component(normals, 2);
  std::vector<double> slope_x, slope_y, dx, dy;
  double sum = 0;
  for (std::uint32_t y = 0; y < 32; ++y) {
    for (std::uint32_t x = 0; x < 40; ++x) {
      const std::size_t i = std::size_t{y} * 40 + x;
      EXPECT_NEAR(nx[i] * nx[i] + ny[i] * ny[i] + nz[i] * nz[i], 1, 1e-3);
      EXPECT_GT(nz[i], 0);
      slope_x.push_back(-nx[i] / nz[i]);
      slope_y.push_back(-ny[i] / nz[i]);
      dx.push_back(0.5 * (at(x + 1, y) - at(x + 39, y)));
      dy.push_back(0.5 * (at(x, y + 31) - at(x, y + 1)));  // y goes up, rows go down
      sum += at(x, y);
    }
  }
  EXPECT_NEAR(sum / (40 * 32), 0, 1e-3);  // the plane z = 0 is the mean height
  EXPECT_GT(correlation(slope_x, dx), 0.6);
  EXPECT_GT(correlation(slope_y, dy), 0.6);
}

TEST(SynthBtfFacts, MetalIsAnisotropic) {
  // Streaks along x throw light across, along y: 30 degrees off the mirror, more arrives from y than from x.
  const Result<Dataset> dataset = synthesize_btf("brushed", tile(8, 8));
  ASSERT_TRUE(dataset) << dataset.error().message;
  const double across = mean_of(dataset->image(pair_of(dataset->info(), 0, 0, 60, 90)));
  const double along = mean_of(dataset->image(pair_of(dataset->info(), 0, 0, 60, 0)));
  EXPECT_GT(across, 1.2 * along);
}

TEST(SynthBtfFacts, HalvesKeepHighlightsAndEightBitsAreTheirSrgbCodes) {
  BtfSynthOptions options = tile(7, 7);
  const Result<Dataset> coded = synthesize_btf("brushed", options);
  options.type = SampleType::float16;
  const Result<Dataset> linear = synthesize_btf("brushed", options);
  ASSERT_TRUE(coded && linear);
  const auto codes = all_codes(*coded), halves = all_codes(*linear);
  double top = 0;
  std::size_t far = 0;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const double v = static_cast<double>(code_value(SampleType::float16, halves[i]));
    top = std::max(top, v);
    const double c = std::min(v, 1.0);
    const double srgb = c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
    far += std::abs(255 * srgb - codes[i]) > 0.65;  // half a code, the half's own rounding, and a little
  }
  EXPECT_GT(top, 1.2);
  EXPECT_EQ(far, 0u);
}

// A plateau of 8x8 texels on a floor, white on black: what must be seen of it is known.
class Plateau : public testing::Test {
 protected:
  static constexpr std::uint32_t kSide = 32;
  static procedural::SurfacePoint point(double x, double y, bool white_floor) {
    procedural::SurfacePoint p;
    const bool inside = x > 12 && x < 20 && y > 12 && y < 20;
    p.height = inside ? 3 : 0;
    const double white = inside != white_floor ? 1 : 0;
    p.albedo = {white, white, white};
    return p;
  }
  // Red of all texels.
  static std::vector<double> seen(bool white_floor, const Direction& view, const Direction& light) {
    const procedural::Relief relief =
        procedural::sample_relief([&](double x, double y) { return point(x, y, white_floor); }, kSide, kSide);
    const std::vector<procedural::ReliefDirection> lights{procedural::relief_direction(light)};
    const auto maps = procedural::light_maps(relief, procedural::BounceRays(relief), lights);
    std::vector<double> out;
    std::vector<float> row(kSide * 3);
    for (std::uint32_t y = 0; y < kSide; ++y) {
      procedural::shade_texels(relief, maps, lights, procedural::relief_direction(view), 0, y, kSide, row);
      for (std::uint32_t x = 0; x < kSide; ++x) out.push_back(static_cast<double>(row[3 * x]));
    }
    return out;
  }
  static double at(const std::vector<double>& values, std::uint32_t x, std::uint32_t y) {
    return values[std::size_t{y} * kSide + x];
  }
};

// What is high is seen away from the viewer: at height z by z tan(theta). The top lies 3 - 3 / 16 above z =
// 0.
TEST_F(Plateau, ShowsParallax) {
  const auto above = seen(false, {}, {});
  EXPECT_GT(at(above, 16, 16), 0.9);
  EXPECT_LT(at(above, 9, 16), 0.1);
  const auto from_right = seen(false, direction_from_degrees(60, 0), {});  // by 4.9 texels
  EXPECT_GT(at(from_right, 9, 16), 0.9);
  EXPECT_LT(at(from_right, 5, 16), 0.1);
  EXPECT_LT(at(from_right, 22, 16), 0.1);
  const auto from_top = seen(false, direction_from_degrees(60, 90), {});
  EXPECT_GT(at(from_top, 16, 22), 0.9);
  EXPECT_LT(at(from_top, 16, 26), 0.1);
  EXPECT_LT(at(from_top, 16, 9), 0.1);
}

TEST_F(Plateau, CastsItsShadowAwayFromTheLight) {
  const auto lit = seen(true, {}, direction_from_degrees(60, 0));  // 3 tan(60) = 5.2 texels to the left
  EXPECT_LT(at(lit, 9, 16), 0.1);
  EXPECT_NEAR(at(lit, 3, 16), 0.5, 0.02);  // a white Lambertian plane shows the cosine
  EXPECT_NEAR(at(lit, 28, 16), 0.5, 0.02);
  EXPECT_NEAR(at(lit, 9, 28), 0.5, 0.02);
}

// The floor beside a lit wall is brighter than the plane; the wall's own colour is in it.
TEST_F(Plateau, BouncesLight) {
  const auto grey = [](bool white_wall) {
    const procedural::Relief relief = procedural::sample_relief(
        [&](double x, double y) {
          procedural::SurfacePoint p = point(x, y, true);
          p.albedo = p.height > 0 && !white_wall ? procedural::Rgb{} : procedural::Rgb{1, 1, 1};
          return p;
        },
        kSide, kSide);
    const std::vector<procedural::ReliefDirection> lights{
        procedural::relief_direction(direction_from_degrees(60, 0))};
    const auto maps = procedural::light_maps(relief, procedural::BounceRays(relief), lights);
    std::vector<float> row(kSide * 3);
    procedural::shade_texels(relief, maps, lights, {}, 0, 16, kSide, row);
    return static_cast<double>(row[3 * 21]);
  };
  EXPECT_GT(grey(true), grey(false) + 0.05);
}

TEST(SynthBtfFacts, MoreDirectionsAndProgress) {
  BtfSynthOptions options = tile(2, 3);
  options.directions = 151;
  std::vector<std::size_t> done;
  std::size_t total = 0;
  options.progress = [&](std::size_t d, std::size_t of) {
    done.push_back(d);
    total = of;
  };
  const Result<Dataset> dataset = synthesize_btf("plaster", options);
  ASSERT_TRUE(dataset) << dataset.error().message;
  EXPECT_EQ(dataset->info().views, ubo2014_directions());
  EXPECT_EQ(total, 151u * 151u);
  EXPECT_TRUE(std::is_sorted(done.begin(), done.end()));
  EXPECT_EQ(done.back(), total);
}

TEST(SynthBtfFacts, RefusesWhatItCannotMake) {
  const auto refused = [](std::string_view kind, const BtfSynthOptions& options, std::string_view says) {
    const Result<Dataset> dataset = synthesize_btf(kind, options);
    ASSERT_FALSE(dataset);
    EXPECT_EQ(dataset.error().status, Status::bad_argument);
    EXPECT_NE(dataset.error().message.find(says), std::string::npos) << dataset.error().message;
  };
  for (const BtfKind& kind : btf_kinds()) refused("plaid", tile(4, 4), kind.name);
  refused("weave", tile(0, 4), "0x4");
  refused("weave", tile(4, 0), "4x0");
  refused("weave", tile(65536, 65536), "65536x65536");
  BtfSynthOptions options = tile(4, 4);
  options.directions = 80;
  refused("weave", options, "80");
  options = tile(4, 4);
  options.type = SampleType::unorm16;
  refused("weave", options, "unorm8");
  options = tile(4, 4);
  options.scratch_directory = "/no/such/place";
  const Result<Dataset> nowhere = synthesize_btf("weave", options);
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().status, Status::io);
  EXPECT_EQ(btf_ground_truth("plaid", tile(4, 4)).error().status, Status::bad_argument);
  EXPECT_EQ(btf_ground_truth("weave", tile(4, 0)).error().status, Status::bad_argument);
}

}  // namespace
}  // namespace btfc::test
