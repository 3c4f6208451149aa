// Subspaces of a BTF: the features, clusters of images made up and of synthetic material, threads.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <set>

#include "encoder/metrics/lab.h"
#include "encoder/run_on_threads.h"
#include "encoder/segment/colour_histograms.h"
#include "encoder/segment/missing_pairs.h"
#include "encoder/segment/subspaces.h"
#include "encoder/synth/btf_synth.h"
#include "tests/btf_support.h"

namespace btfc::test {
namespace {

std::vector<float> features(const Image& image) {
  return colour_histograms(code_view(image, code_tables(image.type, image.colour_space)));
}

double squared(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += double(a[i] - b[i]) * double(a[i] - b[i]);
  return sum;
}

// The sum over one axis of bin width times |F - F'|, from the features' root of the width.
double transport(const std::vector<float>& a, const std::vector<float>& b, std::size_t axis, double width) {
  double sum = 0;
  for (std::size_t i = axis * kHistogramBins; i < (axis + 1) * kHistogramBins; ++i)
    sum += std::fabs(double(a[i]) - double(b[i])) * std::sqrt(width);
  return sum;
}

constexpr double kLightnessBin = 100.0 / 32, kColourBin = 220.0 / 32;

DatasetInfo info_of(std::uint32_t side, std::uint32_t channels) {
  DatasetInfo info = btf_info(side, side, channels, SampleType::unorm8, rings(1), rings(2));
  info.colour_space = ColourSpace::srgb_rec709_scene;
  if (channels == 3) info.channels = {"R", "G", "B"};
  return info;
}

Subspaces segment(const Dataset& dataset, std::uint32_t clusters, std::uint64_t seed = 1) {
  const Result<Subspaces> found = segment_pairs(dataset, clusters, seed);
  EXPECT_TRUE(found) << found.error().message;
  return found ? *found : Subspaces{};
}

// Every pair has a subspace, no subspace is empty, they are in order, medoids lie in theirs.
void check(const Subspaces& found, const DatasetInfo& info) {
  ASSERT_EQ(found.of_pair.size(), info.pairs.size());
  std::vector<std::size_t> size(found.medoid.size());
  for (const std::uint16_t m : found.of_pair) {
    ASSERT_LT(m, size.size());
    ++size[m];
  }
  for (std::size_t m = 0; m < size.size(); ++m) {
    EXPECT_GT(size[m], 0u);
    ASSERT_LT(found.medoid[m], info.pairs.size());
    EXPECT_EQ(found.of_pair[found.medoid[m]], m);
    if (m == 0) continue;
    EXPECT_TRUE(size[m - 1] > size[m] || (size[m - 1] == size[m] && found.medoid[m - 1] < found.medoid[m]));
  }
  EXPECT_GE(found.explained, 0);
  EXPECT_LE(found.explained, 1);
}

TEST(ColourHistograms, AreTransportDistancesOfConstantImages) {
  const auto lightness = [](double v) {
    const double linear = linear_of_srgb(v);
    return lab_of_linear(linear, linear, linear)[0];
  };
  const auto dark = features(constant(5, 3, 1, SampleType::unorm8, 100)),
             bright = features(constant(7, 2, 1, SampleType::unorm8, 103));
  ASSERT_EQ(dark.size(), kHistogramBins);
  // Of a shift that is smaller than a bin: 1.2 of 3.1 L*.
  EXPECT_NEAR(transport(dark, bright, 0, kLightnessBin), lightness(103 / 255.0) - lightness(100 / 255.0),
              1e-3);
  const auto black = features(constant(4, 4, 1, SampleType::unorm8, 0)),
             white = features(constant(4, 4, 1, SampleType::unorm8, 255));
  EXPECT_NEAR(transport(black, white, 0, kLightnessBin), 100, 1e-3);
  EXPECT_NEAR(squared(black, white), 100, 1e-3);  // the integral of 1 over 0 … 100
}

TEST(ColourHistograms, HaveThreeAxesOfColour) {
  Image red = constant(3, 3, 3, SampleType::unorm8, 0);
  for (std::size_t i = 0; i < red.codes.size(); i += 3) red.codes[i] = 255;
  const auto a = features(red), b = features(constant(3, 3, 3, SampleType::unorm8, 0));
  ASSERT_EQ(a.size(), 3 * kHistogramBins);
  const Lab lab = lab_of_linear(1, 0, 0);
  EXPECT_NEAR(transport(a, b, 0, kLightnessBin), lab[0], 1e-3);
  EXPECT_NEAR(transport(a, b, 1, kColourBin), lab[1], 1e-3);
  EXPECT_NEAR(transport(a, b, 2, kColourBin), lab[2], 1e-3);
  // Without a meaning: each channel, whose weights together are those of L*.
  Image data = red;
  data.colour_space = ColourSpace::data;
  Image zero = data;
  std::fill(zero.codes.begin(), zero.codes.end(), std::uint16_t{0});
  EXPECT_NEAR(squared(features(data), features(zero)), 100.0 / 3, 1e-3);
}

TEST(ColourHistograms, RiseToTheRootOfTheWidthAndIgnoreOrder) {
  Image image = noise(30, 20, 3, SampleType::unorm8, 7);
  const auto a = features(image);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double top = std::sqrt(i < kHistogramBins ? kLightnessBin : kColourBin);
    EXPECT_GE(a[i], 0);
    EXPECT_LE(double(a[i]), top * (1 + 1e-6));
    if (i % kHistogramBins > 0) {
      EXPECT_GE(a[i], a[i - 1]);
    }
  }
  Image turned = image;
  for (std::size_t i = 0; i < image.codes.size(); i += 3)
    std::copy_n(&image.codes[i], 3, &turned.codes[image.codes.size() - 3 - i]);
  EXPECT_EQ(features(turned), a);
}

TEST(ColourHistograms, LargeImagesAreReadOnAGrid) {
  // 400 x 50 texels are more than the grid holds: every second texel of every second row from the second on.
  Image image = constant(400, 50, 1, SampleType::unorm8, 200);
  for (std::uint32_t y = 1; y < 50; y += 2) {
    for (std::uint32_t x = 1; x < 400; x += 2) image.codes[y * 400 + x] = 90;
  }
  EXPECT_EQ(features(image), features(constant(8, 8, 1, SampleType::unorm8, 90)));
  const auto narrow = features(constant(1, 60000, 1, SampleType::unorm8, 90));
  EXPECT_EQ(narrow, features(constant(8, 8, 1, SampleType::unorm8, 90)));
}

TEST(Subspaces, OneHoldsAll) {
  const Dataset dataset = make_btf(info_of(6, 3), bumpy);
  const Subspaces found = segment(dataset, 1);
  check(found, dataset.info());
  EXPECT_EQ(found.medoid.size(), 1u);
  EXPECT_NEAR(found.explained, 0, 1e-9);
}

TEST(Subspaces, AsManyAsPairs) {
  const Dataset dataset = make_btf(info_of(6, 3), bumpy);
  const std::size_t pairs = dataset.info().pairs.size();
  for (const std::size_t clusters : {pairs, pairs + 5, std::size_t{65536}}) {
    const Subspaces found = segment(dataset, static_cast<std::uint32_t>(clusters));
    check(found, dataset.info());
    EXPECT_EQ(found.medoid.size(), pairs);
    EXPECT_EQ(found.explained, 1);
    // All sizes are 1: the order is that of the pairs.
    for (std::size_t i = 0; i < pairs; ++i) EXPECT_EQ(found.of_pair[i], i);
  }
  const Subspaces fewer = segment(dataset, static_cast<std::uint32_t>(pairs - 1));
  check(fewer, dataset.info());
  EXPECT_EQ(fewer.medoid.size(), pairs - 1);
  EXPECT_FALSE(segment_pairs(dataset, 65537, 1));
}

TEST(Subspaces, EqualImagesAreOne) {
  const Dataset dataset =
      make_btf(info_of(5, 3), [](const Direction&, const Direction&, std::uint32_t x, std::uint32_t y,
                                 std::uint32_t c) { return (x + 2 * y + c) / 20.0; });
  for (const std::uint32_t clusters : {0u, 1u, 4u, 1000u}) {
    const Subspaces found = segment(dataset, clusters);
    check(found, dataset.info());
    EXPECT_EQ(found.medoid, std::vector<std::size_t>{0});
    EXPECT_EQ(found.explained, 1);
  }
}

TEST(Subspaces, ObviousGroupsAreFound) {
  for (const std::uint32_t channels : {1u, 3u, 5u}) {
    const DatasetInfo info = info_of(8, channels);
    // Dark under light from the left, bright under the other; the texture moves from pair to pair.
    const auto left = [](const Direction& light) { return unit_vector(light)[0] < -1e-6; };
    const Dataset dataset = make_btf(info, [&](const Direction& view, const Direction& light, std::uint32_t x,
                                               std::uint32_t y, std::uint32_t c) {
      return (left(light) ? 0.2 : 0.7) + 0.05 * std::sin(x + 3 * y + c + 20 * view.theta + light.phi);
    });
    // Two are found by themselves too: they explain nearly all.
    for (const std::uint32_t clusters : {2u, 0u}) {
      const Subspaces found = segment(dataset, clusters);
      check(found, info);
      ASSERT_EQ(found.medoid.size(), 2u) << channels << " channels";
      EXPECT_GT(found.explained, 0.9);
      const std::uint16_t dark = left(info.lights[info.pairs[found.medoid[0]].light]) ? 0 : 1;
      for (std::size_t i = 0; i < info.pairs.size(); ++i)
        EXPECT_EQ(found.of_pair[i] == dark, left(info.lights[info.pairs[i].light]));
    }
  }
}

TEST(Subspaces, FewerDifferentImagesThanClusters) {
  const Dataset dataset =
      make_btf(info_of(4, 1), [](const Direction&, const Direction& light, std::uint32_t, std::uint32_t,
                                 std::uint32_t) { return std::round(4 * light.theta) / 8; });
  const std::size_t different = 3;  // lights at 0, 15 and 30 degrees
  for (const std::uint32_t clusters : {3u, 4u, 50u}) {
    const Subspaces found = segment(dataset, clusters);
    check(found, dataset.info());
    EXPECT_EQ(found.medoid.size(), different);
    EXPECT_EQ(found.explained, 1);
  }
}

TEST(Subspaces, NoiseIsNotToldApart) {
  const DatasetInfo info = info_of(40, 3);
  Result<Dataset> dataset = Dataset::create(info, "");
  ASSERT_TRUE(dataset);
  for (std::size_t i = 0; i < info.pairs.size(); ++i)
    dataset->write_image(i, noise(40, 40, 3, SampleType::unorm8, i + 1).codes);
  EXPECT_EQ(segment(*dataset, 0).medoid.size(), 1u);
}

// Brightness is the light's cosine less a little for slanting views; a fifth of the pairs was measured.
TEST(MissingPairs, GetTheSubspaceThatTheirNeighboursSuggest) {
  const auto brightness = [](const Direction& view, const Direction& light) {
    return 0.9 * std::cos(light.theta) - 0.1 * std::sin(view.theta) + 0.05;
  };
  DatasetInfo info = btf_info(2, 2, 1, SampleType::unorm8, rings(4), rings(4));
  const std::vector<DirectionPair> all = info.pairs;
  const std::size_t lights = info.lights.size();
  std::erase_if(info.pairs, [&](const DirectionPair& p) { return (p.view * 7 + p.light * 3) % 5 != 0; });
  ASSERT_LT(info.pairs.size(), all.size() / 4);
  const Dataset dataset =
      make_btf(info, [&](const Direction& view, const Direction& light, std::uint32_t, std::uint32_t,
                         std::uint32_t) { return brightness(view, light); });
  const Subspaces found = segment(dataset, 8);
  const std::vector<std::uint16_t> index = complete_index(dataset, found.of_pair, found.medoid);
  ASSERT_EQ(index.size(), all.size());
  for (std::size_t p = 0; p < info.pairs.size(); ++p)
    EXPECT_EQ(index[info.pairs[p].view * lights + info.pairs[p].light], found.of_pair[p]);
  double off = 0, level = 0;
  std::vector<double> truth;
  for (const DirectionPair& p : all) truth.push_back(brightness(info.views[p.view], info.lights[p.light]));
  const double mean = std::accumulate(truth.begin(), truth.end(), 0.0) / static_cast<double>(truth.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    ASSERT_LT(index[i], found.medoid.size());
    const DirectionPair shown = info.pairs[found.medoid[index[i]]];
    off += std::fabs(brightness(info.views[shown.view], info.lights[shown.light]) - truth[i]);
    level += std::fabs(mean - truth[i]);
  }
  // Eight steps over a range of about 0.6 are off by 0.02 on average where nothing is missing.
  EXPECT_LT(off / static_cast<double>(all.size()), 0.04);
  EXPECT_LT(off, 0.3 * level);
}

// Tiles of 8 x 8 texels under every third view and light of 81.
Dataset material(const char* kind, SampleType type = SampleType::unorm8) {
  BtfSynthOptions options;
  options.width = options.height = 8;
  options.type = type;
  const Result<Dataset> all = synthesize_btf(kind, options);
  EXPECT_TRUE(all);
  DatasetInfo info = all->info();
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < info.pairs.size(); ++i) {
    if (info.pairs[i].view % 3 == 0 && info.pairs[i].light % 3 == 0) kept.push_back(i);
  }
  info.pairs.clear();
  for (const std::size_t i : kept) info.pairs.push_back(all->info().pairs[i]);
  Result<Dataset> dataset = Dataset::create(info, "");
  EXPECT_TRUE(dataset);
  for (std::size_t i = 0; i < kept.size(); ++i) dataset->write_image(i, all->image(kept[i]).codes);
  return std::move(*dataset);
}

TEST(Subspaces, SyntheticMaterials) {
  for (const BtfKind& kind : btf_kinds()) {
    const Dataset dataset = material(kind.name);
    const Subspaces found = segment(dataset, 0);
    check(found, dataset.info());
    EXPECT_GE(found.explained, 0.9) << kind.name;
    EXPECT_GT(found.medoid.size(), 2u) << kind.name;
    EXPECT_LT(found.medoid.size(), kMostAutomaticSubspaces) << kind.name;
    // Asking for the count that was found gives the same clusters.
    EXPECT_EQ(segment(dataset, static_cast<std::uint32_t>(found.medoid.size())).of_pair, found.of_pair);
  }
}

TEST(Subspaces, ThreadsDoNotShow) {
  const Dataset dataset = material(btf_kinds()[0].name);
  for (const std::uint32_t clusters : {0u, 7u}) {
    Subspaces one;
    run_on_threads(1, [&] { one = segment(dataset, clusters); });
    for (const unsigned threads : {2u, 4u}) {
      Subspaces found;
      run_on_threads(threads, [&] { found = segment(dataset, clusters); });
      EXPECT_EQ(found.of_pair, one.of_pair);
      EXPECT_EQ(found.medoid, one.medoid);
      EXPECT_EQ(found.explained, one.explained);
    }
  }
}

TEST(Subspaces, SeedsMatterLittleAndHalvesAreRead) {
  const Dataset dataset = material(btf_kinds()[0].name, SampleType::float16);
  const double first = segment(dataset, 12, 1).explained, other = segment(dataset, 12, 99).explained;
  EXPECT_GT(first, 0.5);
  EXPECT_NEAR(first, other, 0.02);
}

}  // namespace
}  // namespace btfc::test
