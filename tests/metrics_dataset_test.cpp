// Data sets against data sets: image by image what compare_images says, pooled, grouped and view by view.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "encoder/metrics/dataset_metrics.h"
#include "tests/test_support.h"

namespace btfc::test {
namespace {

DatasetInfo info_of(std::uint32_t width, std::uint32_t height, SampleType type = SampleType::unorm8) {
  DatasetInfo info;
  info.width = width;
  info.height = height;
  info.channels = {"R", "G", "B"};
  info.type = type;
  info.colour_space =
      type == SampleType::float16 ? ColourSpace::lin_rec709_scene : ColourSpace::srgb_rec709_scene;
  for (const double theta : {0, 45, 60, 75}) info.views.push_back(direction_from_degrees(theta, 2 * theta));
  for (const double theta : {15, 30, 45}) info.lights.push_back(direction_from_degrees(theta, 90));
  make_full_product(info);
  return info;
}

// fill(pair) gives the image of each pair.
template <class Fill>
Dataset dataset(const DatasetInfo& info, const Fill& fill) {
  Result<Dataset> out = Dataset::create(info, "");
  EXPECT_TRUE(out) << out.error().message;
  for (std::size_t i = 0; i < info.pairs.size(); ++i) out->write_image(i, fill(i).codes);
  return std::move(*out);
}

Dataset noise_set(const DatasetInfo& info, std::uint64_t seed) {
  return dataset(info, [&](std::size_t i) {
    return noise(info.width, info.height, info.channel_count(), info.type, seed + i);
  });
}

Dataset constant_set(const DatasetInfo& info, std::uint16_t code) {
  return dataset(info, [&](std::size_t) {
    return constant(info.width, info.height, info.channel_count(), info.type, code);
  });
}

double quantile(std::vector<double> v, double share) {
  std::sort(v.begin(), v.end());
  const double rank = share * double(v.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(rank), v.size() - 2);
  return v[i] + (rank - double(i)) * (v[i + 1] - v[i]);
}

struct Images {
  std::vector<double> mse, psnr, ssim, mae_lab, flip;
  double peak = 0;

  void add(const ImageMetrics& m) {
    mse.push_back(m.rmse_8bit * m.rmse_8bit / (255.0 * 255));
    psnr.push_back(m.psnr_db);
    ssim.push_back(m.ssim);
    mae_lab.push_back(m.mae_lab);
    flip.push_back(m.flip);
    peak = std::fmax(peak, m.peak_8bit);
  }
  static double mean(const std::vector<double>& v) {
    double sum = 0;
    for (const double x : v) sum += x;
    return sum / double(v.size());
  }
};

void expect_group(const GroupMetrics& g, const Images& images) {
  EXPECT_EQ(g.pairs, images.mse.size());
  EXPECT_NEAR(g.psnr_db, -10 * std::log10(Images::mean(images.mse)), 1e-9);
  EXPECT_NEAR(g.rmse_8bit, 255 * std::sqrt(Images::mean(images.mse)), 1e-9);
  EXPECT_NEAR(g.peak_8bit, images.peak, 1e-12);
  EXPECT_NEAR(g.mean_psnr_db, Images::mean(images.psnr), 1e-9);
  EXPECT_NEAR(g.ssim, Images::mean(images.ssim), 1e-5);
  EXPECT_NEAR(g.mae_lab, Images::mean(images.mae_lab), 1e-9);
  EXPECT_NEAR(g.flip, Images::mean(images.flip), 1e-9);
  EXPECT_NEAR(g.psnr_db_p5, quantile(images.psnr, 0.05), 1e-9);
  EXPECT_NEAR(g.ssim_p5, quantile(images.ssim, 0.05), 1e-5);
  EXPECT_NEAR(g.mae_lab_p95, quantile(images.mae_lab, 0.95), 1e-9);
  EXPECT_NEAR(g.flip_p95, quantile(images.flip, 0.95), 1e-9);
}

TEST(DatasetMetrics, AreThoseOfTheImages) {
  for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
    const DatasetInfo info = info_of(21, 13), other = info_of(21, 13, type);
    const Dataset a = noise_set(info, 1), b = noise_set(other, 100);
    const auto metrics = compare_datasets(a, b);
    ASSERT_TRUE(metrics) << metrics.error().message;
    Images all, steep, grazing;
    std::vector<Images> views(info.views.size());
    std::uint64_t differing = 0;
    for (std::size_t i = 0; i < info.pairs.size(); ++i) {
      const auto m = compare_images(a.image(i), b.image(i));
      ASSERT_TRUE(m);
      const std::uint32_t view = info.pairs[i].view;
      all.add(*m);
      (view < 2 ? steep : grazing).add(*m);  // theta 0 and 45
      views[view].add(*m);
      differing += m->differing_samples;
    }
    expect_group(metrics->all, all);
    expect_group(metrics->steep, steep);
    expect_group(metrics->grazing, grazing);
    ASSERT_EQ(metrics->views.size(), views.size());
    for (std::size_t v = 0; v < views.size(); ++v) {
      const ViewMetrics& m = metrics->views[v];
      EXPECT_EQ(m.view, info.views[v]);
      EXPECT_EQ(m.pairs, info.lights.size());
      EXPECT_NEAR(m.psnr_db, -10 * std::log10(Images::mean(views[v].mse)), 1e-9);
      EXPECT_NEAR(m.ssim, Images::mean(views[v].ssim), 1e-5);
      EXPECT_NEAR(m.mae_lab, Images::mean(views[v].mae_lab), 1e-9);
      EXPECT_NEAR(m.flip, Images::mean(views[v].flip), 1e-9);
    }
    EXPECT_EQ(metrics->differing_samples, differing);
    EXPECT_EQ(metrics->samples, info.pairs.size() * info.image_samples());
  }
}

TEST(DatasetMetrics, EqualSets) {
  const Dataset a = noise_set(info_of(12, 12), 1);
  const auto m = compare_datasets(a, a);
  ASSERT_TRUE(m);
  for (const GroupMetrics* g : {&m->all, &m->steep, &m->grazing}) {
    EXPECT_EQ(g->psnr_db, std::numeric_limits<double>::infinity());
    EXPECT_EQ(g->mean_psnr_db, kMostPsnrDb);
    EXPECT_EQ(g->psnr_db_p5, kMostPsnrDb);
    EXPECT_EQ(g->rmse_8bit, 0);
    EXPECT_EQ(g->peak_8bit, 0);
    EXPECT_NEAR(g->ssim, 1, 1e-6);
    EXPECT_EQ(g->mae_lab, 0);
    EXPECT_EQ(g->flip, 0);
  }
  EXPECT_EQ(m->views[3].psnr_db, std::numeric_limits<double>::infinity());
  EXPECT_EQ(m->differing_samples, 0u);
}

TEST(DatasetMetrics, OneEqualPairIsAHundredDecibelsInTheMean) {
  DatasetInfo info = info_of(4, 4);
  info.views.resize(1);
  info.lights.resize(2);
  make_full_product(info);
  const Dataset a = constant_set(info, 0);
  const Dataset b =
      dataset(info, [&](std::size_t i) { return constant(4, 4, 3, SampleType::unorm8, i == 0 ? 0 : 255); });
  const auto m = compare_datasets(a, b);
  ASSERT_TRUE(m);
  EXPECT_NEAR(m->all.mean_psnr_db, 50, 1e-9);
  EXPECT_NEAR(m->all.psnr_db, 10 * std::log10(2.0), 1e-9);
  EXPECT_NEAR(m->all.psnr_db_p5, 5, 1e-9);
}

TEST(DatasetMetrics, OppositeSets) {
  const DatasetInfo info = info_of(16, 11);
  const auto m = compare_datasets(constant_set(info, 0), constant_set(info, 255));
  ASSERT_TRUE(m);
  EXPECT_EQ(m->all.psnr_db, 0);
  EXPECT_FALSE(std::signbit(m->all.psnr_db));
  EXPECT_EQ(m->all.rmse_8bit, 255);
  EXPECT_EQ(m->all.peak_8bit, 255);
  EXPECT_NEAR(m->all.ssim, 1e-4, 1e-6);
  EXPECT_NEAR(m->all.mae_lab, 100.0 / 3, 1e-4);
  EXPECT_NEAR(m->all.flip, 0.96739, 2e-5);
}

TEST(DatasetMetrics, OneTexelOfOneViewAndLight) {
  DatasetInfo info = info_of(1, 1);
  info.views = {direction_from_degrees(60, 0)};
  info.lights = {direction_from_degrees(0, 0)};
  make_full_product(info);
  const auto m = compare_datasets(constant_set(info, 10), constant_set(info, 12));
  ASSERT_TRUE(m);
  EXPECT_NEAR(m->all.rmse_8bit, 2, 1e-5);
  EXPECT_TRUE(std::isnan(m->all.ssim) && std::isnan(m->all.ssim_p5));
  EXPECT_TRUE(m->all.flip > 0 && m->all.flip < 0.1);
  EXPECT_EQ(m->all.flip_p95, m->all.flip);
  EXPECT_EQ(m->steep.pairs, 0u);
  EXPECT_TRUE(std::isnan(m->steep.psnr_db) && std::isnan(m->steep.peak_8bit) &&
              std::isnan(m->steep.flip_p95));
  EXPECT_EQ(m->grazing.pairs, 1u);
}

TEST(DatasetMetrics, AHotTexelCountsAsWhite) {
  const DatasetInfo info = info_of(12, 12, SampleType::float16);
  const Dataset a = constant_set(info, 0x2e66);  // 0.1
  const Dataset b = dataset(info, [&](std::size_t i) {
    Image image = constant(12, 12, 3, info.type, 0x2e66);
    if (i == 5) image.at(3, 4, 1) = 0x63d0;  // 1000
    return image;
  });
  const auto m = compare_datasets(a, b);
  ASSERT_TRUE(m);
  EXPECT_NEAR(m->all.peak_8bit, 255 * (1 - 0.3492), 0.1);  // 0.3492 is the code of 0.1
  EXPECT_EQ(m->differing_samples, 1u);
  for (const double v : {m->all.psnr_db, m->all.ssim, m->all.mae_lab, m->all.flip})
    EXPECT_TRUE(std::isfinite(v));
  EXPECT_LT(m->all.ssim, 1);
}

TEST(DatasetMetrics, SpectralChannelsAreNoColours) {
  DatasetInfo info = info_of(12, 12);
  info.channels = {"450", "500", "550", "600", "650"};
  const Dataset a = noise_set(info, 1), b = noise_set(info, 50);
  const auto m = compare_datasets(a, b);
  ASSERT_TRUE(m);
  EXPECT_TRUE(std::isnan(m->all.mae_lab) && std::isnan(m->all.flip) && std::isnan(m->all.flip_p95));
  EXPECT_TRUE(std::isfinite(m->all.ssim));
  // A channel that SSIM of luma would not see.
  const Dataset c = dataset(info, [&](std::size_t i) {
    Image image = a.image(i);
    for (std::size_t q = 4; q < image.codes.size(); q += 5) image.codes[q] ^= 0xff;
    return image;
  });
  EXPECT_LT(compare_datasets(a, c)->all.ssim, 0.9);

  info.channels = {"550"};
  const auto grey = compare_datasets(noise_set(info, 1), noise_set(info, 50));
  ASSERT_TRUE(grey);
  EXPECT_TRUE(std::isfinite(grey->all.mae_lab) && std::isfinite(grey->all.flip));
}

TEST(DatasetMetrics, DoNotDependOnThreads) {
  const DatasetInfo info = info_of(16, 16);
  const Dataset a = noise_set(info, 1), b = noise_set(info, 50);
  const auto run = [&](int threads) {
    tbb::task_arena arena(threads);
    return arena.execute([&] { return *compare_datasets(a, b); });
  };
  const DatasetMetrics one = run(1), two = run(2);
  EXPECT_EQ(one.all.psnr_db, two.all.psnr_db);
  EXPECT_EQ(one.all.mean_psnr_db, two.all.mean_psnr_db);
  EXPECT_EQ(one.all.ssim, two.all.ssim);
  EXPECT_EQ(one.all.mae_lab, two.all.mae_lab);
  EXPECT_EQ(one.grazing.flip, two.grazing.flip);
}

TEST(DatasetMetrics, OptionsAndProgress) {
  const DatasetInfo info = info_of(12, 12);
  const Dataset a = noise_set(info, 1);
  DatasetMetricOptions options;
  options.measures = {false, true, false};
  std::size_t calls = 0, last = 0;
  options.progress = [&](std::size_t done, std::size_t total) {
    ++calls;
    last = std::max(last, done);
    EXPECT_EQ(total, info.pairs.size());
  };
  const auto m = compare_datasets(a, a, options);
  ASSERT_TRUE(m);
  EXPECT_TRUE(std::isnan(m->all.ssim) && std::isnan(m->all.flip));
  EXPECT_EQ(m->all.mae_lab, 0);
  EXPECT_EQ(calls, info.pairs.size());
  EXPECT_EQ(last, info.pairs.size());
}

TEST(DatasetMetrics, MissingImages) {
  DatasetInfo info = info_of(12, 12);
  std::erase_if(info.pairs,
                [](const DirectionPair& p) { return p.view == 1 || (p.view == 0 && p.light == 2); });
  const auto m = compare_datasets(noise_set(info, 1), noise_set(info, 50));
  ASSERT_TRUE(m);
  EXPECT_EQ(m->all.pairs, 8u);
  EXPECT_EQ(m->steep.pairs, 2u);
  ASSERT_EQ(m->views.size(), 3u);
  EXPECT_EQ(m->views[0].pairs, 2u);
  EXPECT_EQ(m->views[1].view, info.views[2]);
}

TEST(DatasetMetrics, NameWhatDiffers) {
  const DatasetInfo info = info_of(4, 4);
  const Dataset a = constant_set(info, 0);
  const auto refused = [&](const DatasetInfo& other) {
    const auto m = compare_datasets(a, constant_set(other, 0));
    EXPECT_FALSE(m);
    return m ? std::string() : m.error().message;
  };
  EXPECT_NE(refused(info_of(4, 5)).find("4x5"), std::string::npos);
  DatasetInfo other = info;
  other.channels = {"R", "G", "B", "A"};
  EXPECT_NE(refused(other).find("4 channels"), std::string::npos);
  other = info;
  other.views[2] = direction_from_degrees(61, 120);
  EXPECT_NE(refused(other).find("view 2 is (60, 120) in the reference and (61, 120)"), std::string::npos);
  other = info;
  other.lights[1].phi += 0.1;
  EXPECT_NE(refused(other).find("light 1"), std::string::npos);
  other = info;
  other.pairs.pop_back();
  EXPECT_NE(refused(other).find("11 images"), std::string::npos);
  DatasetInfo one = info, two = info;
  one.pairs.erase(one.pairs.begin());
  two.pairs.erase(two.pairs.begin() + 1);
  EXPECT_FALSE(compare_datasets(constant_set(one, 0), constant_set(two, 0)));
  other = info;  // at the pole phi is a name only
  other.views[0].phi = 1;
  EXPECT_TRUE(compare_datasets(a, constant_set(other, 0)));
}

}  // namespace
}  // namespace btfc::test
