// Measures between textures that are not aligned: each against its definition, and all against known
// materials.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "encoder/metrics/autocorrelation.h"
#include "encoder/metrics/colour_marginals.h"
#include "encoder/metrics/display_values.h"
#include "encoder/metrics/steerable_pyramid.h"
#include "encoder/metrics/stsim.h"
#include "encoder/metrics/texture_distance.h"
#include "encoder/synth/texture_synth.h"
#include "tests/test_support.h"

namespace btfc::test {
namespace {

std::vector<double> luma_of(const Image& image) { return luma(image, display_table(image)); }

double power(const PyramidBand& band) {
  double sum = 0;
  for (const auto& c : band.values) sum += std::norm(c);
  return sum / double(band.values.size());
}

Image sample(const char* kind, std::uint64_t seed, std::uint32_t width = 128, std::uint32_t height = 64) {
  return *synthesize_texture(kind, {width, height, seed, SampleType::unorm8});
}

TEST(SteerablePyramid, KeepsThePower) {
  for (const std::size_t side : {8u, 32u, 64u}) {
    std::vector<double> values = luma_of(
        noise(static_cast<std::uint32_t>(side), static_cast<std::uint32_t>(side), 1, SampleType::unorm8));
    double total = 0;
    for (const double v : values) total += v * v / double(values.size());
    const SteerablePyramid p = steerable_pyramid(values, side);
    double sum = power(p.high) + power(p.low);
    for (const auto& scale : p.oriented) {
      for (const PyramidBand& band : scale) sum += 2 * power(band);
    }
    EXPECT_NEAR(sum, total, 1e-10 * total) << side;
    for (const auto& c : p.low.values) EXPECT_NEAR(c.imag(), 0, 1e-12);
  }
}

TEST(SteerablePyramid, TellsScalesAndOrientationsApart) {
  constexpr std::size_t n = 64;
  for (std::size_t scale = 0; scale < SteerablePyramid::kScales; ++scale) {
    std::vector<double> columns(n * n), rows(n * n);
    const double frequency =
        std::numbers::pi / 2 / double(1u << scale);  // where the scale's filter is highest
    for (std::size_t q = 0; q < n * n; ++q) {
      columns[q] = std::cos(frequency * double(q % n));
      rows[q] = std::cos(frequency * double(q / n));
    }
    const SteerablePyramid p = steerable_pyramid(columns, n), q = steerable_pyramid(rows, n);
    for (std::size_t s = 0; s < SteerablePyramid::kScales; ++s) {
      for (std::size_t k = 0; k < SteerablePyramid::kOrientations; ++k) {
        EXPECT_LE(power(p.oriented[s][k]), power(p.oriented[scale][0]) + 1e-12);
        EXPECT_LE(power(q.oriented[s][k]), power(q.oriented[scale][2]) + 1e-12);
      }
    }
    EXPECT_GT(power(p.oriented[scale][0]), 0.15);
    EXPECT_LT(power(p.oriented[scale][2]), 1e-12);
    // One side of the spectrum: the amplitude is the same everywhere.
    for (const auto& c : p.oriented[scale][0].values) {
      EXPECT_NEAR(std::norm(c), power(p.oriented[scale][0]), 1e-9);
    }
  }
}

TEST(Stsim, EqualImagesAndTheRange) {
  std::vector<StsimFeatures> features;
  for (const Image& image :
       {material("bricks", 32, 32), noise(32, 32, 3, SampleType::unorm8),
        constant(32, 32, 3, SampleType::unorm8, 0), constant(32, 32, 3, SampleType::unorm8, 255),
        noise(16, 16, 1, SampleType::unorm8)}) {
    features.push_back(stsim_features(luma_of(image), image.width));
  }
  for (const StsimFeatures& a : features) {
    EXPECT_EQ(a.bands.size(), 14u);
    EXPECT_EQ(a.cross_correlations.size(), 26u);
    EXPECT_NEAR(stsim2(a, a), 1, 1e-12);
    for (const StsimFeatures& b : features) {
      const double s = stsim2(a, b);
      EXPECT_TRUE(s > 0 && s <= 1 + 1e-12) << s;
      EXPECT_NEAR(s, stsim2(b, a), 1e-12);
    }
  }
  EXPECT_LT(stsim2(features[0], features[1]), 0.95);
}

TEST(Stsim, FeaturesAreTheirDefinition) {
  // Of the finest horizontal band, plainly.
  const std::size_t n = 32, margin = 4;
  const std::vector<double> values = luma_of(noise(32, 32, 1, SampleType::unorm8));
  const SteerablePyramid pyramid = steerable_pyramid(values, n);
  const auto& band = pyramid.oriented[0][0].values;
  std::complex<double> mean = 0, right = 0;
  double variance = 0;
  const double count = double((n - 2 * margin) * (n - 2 * margin));
  for (std::size_t y = margin; y < n - margin; ++y) {
    for (std::size_t x = margin; x < n - margin; ++x) mean += band[y * n + x] / count;
  }
  for (std::size_t y = margin; y < n - margin; ++y) {
    for (std::size_t x = margin; x < n - margin; ++x) variance += std::norm(band[y * n + x] - mean) / count;
    for (std::size_t x = margin; x + 1 < n - margin; ++x) {
      right += (band[y * n + x] - mean) * std::conj(band[y * n + x + 1] - mean);
    }
  }
  right /= double((n - 2 * margin) * (n - 2 * margin - 1));
  const StsimFeatures::Band f = stsim_features(values, n).bands[1];
  EXPECT_NEAR(f.mean, std::abs(mean), 1e-12);
  EXPECT_NEAR(f.deviation, std::sqrt(variance), 1e-12);
  EXPECT_NEAR(std::abs(f.right - right / variance), 0, 1e-3);  // but for the constant in the denominator
}

TEST(Autocorrelation, IsTheMeanOverPairs) {
  const std::size_t n = 16;
  const std::vector<double> v = luma_of(noise(16, 16, 1, SampleType::unorm8));
  double mean = 0, variance = 0;
  for (const double x : v) mean += x / 256;
  for (const double x : v) variance += (x - mean) * (x - mean) / 256;
  const std::vector<double> fast = autocorrelation(v, n);
  std::size_t i = 0;
  for (std::ptrdiff_t dy = 0; dy <= 8; ++dy) {
    for (std::ptrdiff_t dx = dy == 0 ? 1 : -8; dx <= 8; ++dx) {
      double sum = 0, count = 0;
      for (std::ptrdiff_t y = 0; y < 16 - dy; ++y) {
        for (std::ptrdiff_t x = std::max<std::ptrdiff_t>(0, -dx); x < std::min<std::ptrdiff_t>(16, 16 - dx);
             ++x) {
          sum += (v[static_cast<std::size_t>(y * 16 + x)] - mean) *
                 (v[static_cast<std::size_t>((y + dy) * 16 + x + dx)] - mean);
          ++count;
        }
      }
      ASSERT_LT(i, fast.size());
      EXPECT_NEAR(fast[i++], sum / count / (variance + 1 / (12.0 * 255 * 255)), 1e-10);
    }
  }
  EXPECT_EQ(i, fast.size());
}

TEST(Autocorrelation, KnowsPeriodsAndConstants) {
  std::vector<double> stripes(64 * 64), flat(64 * 64, 0.3);
  for (std::size_t q = 0; q < stripes.size(); ++q) stripes[q] = q % 8 < 4 ? 0 : 1;
  const auto r = autocorrelation(stripes, 64);
  EXPECT_NEAR(r[7], 1, 1e-3);   // (8, 0)
  EXPECT_NEAR(r[3], -1, 1e-3);  // (4, 0)
  for (const double v : autocorrelation(flat, 64)) EXPECT_NEAR(v, 0, 1e-9);
  EXPECT_EQ(autocorrelation_distance(r, r), 0);
  const std::vector<double> nothing(r.size());
  double sum = 0;
  for (const double v : r) sum += v * v;
  EXPECT_NEAR(autocorrelation_distance(r, nothing), std::sqrt(sum / double(r.size())), 1e-12);
}

TEST(ColourMarginals, AxesDecorrelate) {
  Image image = noise(64, 64, 3, SampleType::unorm8);
  for (std::size_t q = 0; q < image.codes.size(); q += 3) {  // grey, with a little of its own in blue
    image.codes[q] = image.codes[q + 1];
    image.codes[q + 2] = static_cast<std::uint16_t>((15 * image.codes[q] + image.codes[q + 2]) / 16);
  }
  const ColourAxes axes = colour_axes(std::span(&image, 1));
  ASSERT_EQ(axes.axes.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::fabs(axes.axes[0][i]), 1 / std::sqrt(3.0), 0.03);
    for (std::size_t j = 0; j < 3; ++j) {
      double dot = 0;
      for (std::size_t c = 0; c < 3; ++c) dot += axes.axes[i][c] * axes.axes[j][c];
      EXPECT_NEAR(dot, i == j, 1e-12);
    }
  }
  EXPECT_GT(axes.deviations[0], 0.4);
  EXPECT_EQ(axes.deviations[2], 1 / 255.0);  // red is green
  const std::vector<float> display = display_table(image);
  double mean[3] = {}, covariance = 0;
  const auto along = [&](std::size_t axis, std::size_t q) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += axes.axes[axis][c] * double(display[image.codes[3 * q + c]]);
    return sum;
  };
  for (std::size_t q = 0; q < 64 * 64; ++q) {
    for (std::size_t i = 0; i < 3; ++i) mean[i] += along(i, q) / (64 * 64);
  }
  for (std::size_t q = 0; q < 64 * 64; ++q) {
    covariance += (along(0, q) - mean[0]) * (along(1, q) - mean[1]) / (64 * 64);
  }
  EXPECT_NEAR(covariance, 0, 1e-12);
}

TEST(ColourMarginals, AShiftCountsInDeviations) {
  Image a = noise(32, 32, 1, SampleType::unorm8), b = a;
  for (std::uint16_t& code : a.codes) code = static_cast<std::uint16_t>(code / 2);
  for (std::size_t q = 0; q < a.codes.size(); ++q)
    b.codes[a.codes.size() - 1 - q] = static_cast<std::uint16_t>(a.codes[q] + 30);
  const ColourAxes axes = colour_axes(std::span(&a, 1));
  const ColourMarginals of_a = colour_marginals(axes, a), of_b = colour_marginals(axes, b);
  EXPECT_NEAR(marginal_distances(of_a, of_b)[0], 30 / 255.0 / axes.deviations[0], 1e-6);
  EXPECT_EQ(marginal_distances(of_a, of_a)[0], 0);
}

TEST(TextureDistances, TellMaterialsFromSamples) {
  const Image reference = sample("bricks", 1, 256, 128);
  const auto same = texture_distances(reference, sample("bricks", 2, 128, 128)),
             other = texture_distances(reference, sample("grain", 1, 128, 128));
  ASSERT_TRUE(same && other);
  EXPECT_EQ(same->crop, 128u);
  EXPECT_EQ(same->marginal.size(), 3u);
  EXPECT_LT(same->marginals.value, other->marginals.value / 3);
  EXPECT_LT(same->spectrum.value, other->spectrum.value / 3);
  EXPECT_LT(same->autocorrelation.value, other->autocorrelation.value / 1.5);
  EXPECT_GT(same->stsim2.value, other->stsim2.value + 0.02);
  // The ceiling is the reference's alone, and another sample is about there.
  EXPECT_EQ(same->stsim2.ceiling, other->stsim2.ceiling);
  EXPECT_EQ(same->spectrum.ceiling, other->spectrum.ceiling);
  EXPECT_EQ(same->marginals.ceiling, other->marginals.ceiling);
  EXPECT_LT(same->spectrum.value, 2 * same->spectrum.ceiling);
  EXPECT_NEAR(same->stsim2.value, same->stsim2.ceiling, 0.02);
}

TEST(TextureDistances, HalvesThatAreAlikeHaveNoDistance) {
  // The same square four times: both crops and the candidate's are equal.
  const Image square = material("pebbles", 32, 32);
  for (const bool across : {true, false}) {
    Image twice = constant(across ? 64 : 32, across ? 32 : 64, 3, SampleType::unorm8, 0);
    for (std::uint32_t y = 0; y < twice.height; ++y) {
      for (std::uint32_t x = 0; x < twice.width; ++x) {
        for (std::uint32_t c = 0; c < 3; ++c) twice.at(x, y, c) = square.at(x % 32, y % 32, c);
      }
    }
    const auto d = texture_distances(twice, square);
    ASSERT_TRUE(d);
    EXPECT_EQ(d->crop, 32u);
    for (const AgainstCeiling* m : {&d->marginals, &d->spectrum, &d->autocorrelation}) {
      EXPECT_EQ(m->value, 0);
      EXPECT_EQ(m->ceiling, 0);
    }
    EXPECT_NEAR(d->stsim2.value, 1, 1e-12);
    EXPECT_NEAR(d->stsim2.ceiling, 1, 1e-12);
  }
}

TEST(TextureDistances, AreMeansOverQuadrants) {
  // 69 x 67 texels: quadrants of 34 or 35 x 33 or 34 hold a crop of 32 each; 40 x 70: parts above one
  // another.
  const Image reference = sample("bricks", 1, 69, 67), candidate = sample("bricks", 2, 40, 70);
  std::vector<Image> own, others;
  for (const std::uint32_t y : {0u, 34u}) {
    for (const std::uint32_t x : {1u, 35u}) own.push_back(crop(reference, x, y, 32, 32));
  }
  for (const std::uint32_t y : {1u, 36u}) others.push_back(crop(candidate, 4, y, 32, 32));
  const auto similarity = [](const Image& a, const Image& b) {
    return stsim2(stsim_features(luma_of(a), 32), stsim_features(luma_of(b), 32));
  };
  const ColourAxes axes = colour_axes(own);
  const auto first_distance = [&](const Image& a, const Image& b) {
    return marginal_distances(colour_marginals(axes, a), colour_marginals(axes, b))[0];
  };
  AgainstCeiling stsim, first_axis;
  for (std::size_t i = 0; i < 4; ++i) {
    for (const Image& other : others) {
      stsim.value += similarity(own[i], other) / 8;
      first_axis.value += first_distance(own[i], other) / 8;
    }
    for (std::size_t j = 0; j < i; ++j) {
      stsim.ceiling += similarity(own[i], own[j]) / 6;
      first_axis.ceiling += first_distance(own[i], own[j]) / 6;
    }
  }
  const auto d = texture_distances(reference, candidate);
  ASSERT_TRUE(d);
  EXPECT_EQ(d->crop, 32u);
  EXPECT_NEAR(d->stsim2.value, stsim.value, 1e-12);
  EXPECT_NEAR(d->stsim2.ceiling, stsim.ceiling, 1e-12);
  EXPECT_NEAR(d->stsim2_ratio(), (1 - stsim.value) / (1 - stsim.ceiling), 1e-9);
  EXPECT_NEAR(d->marginal[0].value, first_axis.value, 1e-12);
  EXPECT_NEAR(d->marginal[0].ceiling, first_axis.ceiling, 1e-12);
  EXPECT_NEAR(d->marginal[0].ratio(), first_axis.value / first_axis.ceiling, 1e-9);
  // A copy: four of sixteen pairs are equal.
  const auto copy = texture_distances(reference, reference);
  ASSERT_TRUE(copy);
  for (const double ratio : {copy->marginals.ratio(), copy->spectrum.ratio(), copy->autocorrelation.ratio(),
                             copy->stsim2_ratio()}) {
    EXPECT_NEAR(ratio, 0.75, 1e-9);
  }
}

TEST(TextureDistances, AKeptReferenceSaysTheSameOfCandidatesOfAnySize) {
  const Image image = sample("bricks", 1, 256, 128);
  const TextureReference reference(image);
  for (const std::uint32_t side : {200u, 128u, 70u, 16u}) {
    const Image candidate = sample("grain", 1, side, side);
    const auto one = texture_distances(image, candidate), two = reference.distances(candidate);
    ASSERT_TRUE(one && two);
    EXPECT_EQ(one->crop, two->crop);
    for (const auto m : {&TextureDistances::marginals, &TextureDistances::spectrum,
                         &TextureDistances::autocorrelation, &TextureDistances::stsim2}) {
      EXPECT_EQ(((*one).*m).value, ((*two).*m).value);
      EXPECT_EQ(((*one).*m).ceiling, ((*two).*m).ceiling);
    }
  }
  EXPECT_FALSE(reference.distances(noise(15, 64, 3, SampleType::unorm8)));
  EXPECT_FALSE(TextureReference(noise(20, 20, 3, SampleType::unorm8)).distances(image));
}

TEST(TextureDistances, ConstantsOddSizesAndTypesAreDefined) {
  for (const std::uint32_t channels : {1u, 2u, 3u, 4u}) {
    const Image flat = constant(37, 20, channels, SampleType::unorm8, 9);
    const Image busy = noise(17, 90, channels, SampleType::float16);
    for (const auto& [r, c] : {std::pair{&flat, &busy}, {&busy, &flat}, {&flat, &flat}}) {
      const auto d = texture_distances(*r, *c);
      ASSERT_TRUE(d) << d.error().message;
      EXPECT_EQ(d->crop, 16u);
      for (const AgainstCeiling* m : {&d->marginals, &d->spectrum, &d->autocorrelation, &d->stsim2}) {
        EXPECT_TRUE(std::isfinite(m->value) && std::isfinite(m->ceiling));
      }
    }
  }
}

TEST(TextureDistances, RefuseWhatIsTooSmallOrOfOtherChannels) {
  const Image good = noise(64, 64, 3, SampleType::unorm8);
  for (const auto& [width, height] : {std::pair{1u, 1u}, {31u, 31u}, {64u, 15u}}) {
    const auto d = texture_distances(noise(width, height, 3, SampleType::unorm8), good);
    ASSERT_FALSE(d);
    EXPECT_NE(d.error().message.find("16x16"), std::string::npos);
  }
  EXPECT_FALSE(texture_distances(good, noise(15, 64, 3, SampleType::unorm8)));
  EXPECT_FALSE(texture_distances(good, noise(64, 64, 1, SampleType::unorm8)));
}

}  // namespace
}  // namespace btfc::test
