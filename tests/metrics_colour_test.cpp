// CIE Lab and SSIM: known colours, and the fast forms against the plain ones.
#include <gtest/gtest.h>

#include <cmath>

#include "encoder/metrics/image_metrics.h"
#include "encoder/metrics/lab.h"
#include "encoder/metrics/ssim.h"
#include "tests/test_support.h"

namespace btfc::test {
namespace {

TEST(Lab, KnownColours) {
  // sRGB's primaries and white under D65, as tables of the field have them.
  const struct {
    double red, green, blue;
    Lab lab;
  } known[] = {{1, 0, 0, {53.24, 80.09, 67.20}},
               {0, 1, 0, {87.73, -86.18, 83.18}},
               {0, 0, 1, {32.30, 79.19, -107.86}},
               {1, 1, 1, {100, 0, 0}},
               {0, 0, 0, {0, 0, 0}}};
  for (const auto& k : known) {
    const Lab lab = lab_of_linear(k.red, k.green, k.blue);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(lab[i], k.lab[i], 0.01) << k.red << k.green << k.blue;
  }
  EXPECT_NEAR(linear_of_srgb(0.5), 0.21404, 1e-5);
  EXPECT_NEAR(linear_of_srgb(0.04), 0.04 / 12.92, 1e-9);
}

TEST(Lab, RowsAreWhatColoursAre) {
  const Image image = noise(1000, 1, 3, SampleType::unorm16);
  std::vector<float> red{0, 1, 1e-7f, 0.0088f, 0.0089f}, green{0, 1, 0, 0.0088f, 0.0089f},
      blue{0, 1, 0, 0.1f, 0.2f};
  for (std::size_t q = 0; q < image.codes.size(); q += 3) {
    red.push_back(code_value(image.type, image.codes[q]));
    green.push_back(code_value(image.type, image.codes[q + 1]));
    blue.push_back(code_value(image.type, image.codes[q + 2]));
  }
  std::vector<float> l = red, a = green, b = blue;
  lab_row(l, a, b);
  for (std::size_t i = 0; i < l.size(); ++i) {
    const Lab lab = lab_of_linear(double(red[i]), double(green[i]), double(blue[i]));
    EXPECT_NEAR(l[i], lab[0], 2e-4);
    EXPECT_NEAR(a[i], lab[1], 2e-4);
    EXPECT_NEAR(b[i], lab[2], 2e-4);
  }
}

TEST(Lab, MeanDifferencesAreThoseOfTheirDefinition) {
  for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
    for (const std::uint32_t channels : {1u, 2u, 3u, 4u}) {
      const Image p = noise(9, 7, channels, type, 1), q = noise(9, 7, channels, type, 2);
      const CodeTables tables = code_tables(type, p.colour_space);
      double mae = 0, de76 = 0;
      for (std::size_t i = 0; i < 63; ++i) {
        const auto lab = [&](const Image& image) {
          const auto value = [&](std::size_t c) {
            const double v = double(tables.display[image.codes[i * channels + (channels < 3 ? 0 : c)]]);
            return linear_of_srgb(v);
          };
          return lab_of_linear(value(0), value(1), value(2));
        };
        const Lab a = lab(p), b = lab(q);
        mae += (std::fabs(a[0] - b[0]) + std::fabs(a[1] - b[1]) + std::fabs(a[2] - b[2])) / (3 * 63);
        de76 += std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) / 63;
      }
      const auto metrics = compare_images(p, q);
      ASSERT_TRUE(metrics);
      EXPECT_NEAR(metrics->mae_lab, mae, 1e-4) << channels;
      EXPECT_NEAR(metrics->de76, de76, 1e-4) << channels;
    }
  }
}

TEST(Lab, LinearHalvesAndDisplayCodesOfOneColourAgree) {
  Image coded = constant(4, 4, 3, SampleType::unorm8, 188),
        linear = constant(4, 4, 3, SampleType::float16, 0x3800);
  coded.colour_space = ColourSpace::srgb_rec709_scene;  // 188 / 255 is the code of 0.503
  linear.colour_space = ColourSpace::lin_rec709_scene;  // 0x3800 is 0.5
  const auto metrics = compare_images(coded, linear);
  ASSERT_TRUE(metrics);
  EXPECT_LT(metrics->mae_lab, 0.1);
  EXPECT_GT(metrics->psnr_db, 50);
}

TEST(Lab, BlackAgainstWhiteIsAThirdOfTheScale) {
  for (const std::uint32_t channels : {1u, 3u}) {
    const auto metrics = compare_images(constant(5, 3, channels, SampleType::unorm8, 0),
                                        constant(5, 3, channels, SampleType::unorm8, 255));
    ASSERT_TRUE(metrics);
    EXPECT_NEAR(metrics->mae_lab, 100.0 / 3, 1e-4);
    EXPECT_NEAR(metrics->de76, 100, 1e-4);
  }
}

TEST(Lab, NothingWhereChannelsAreNoColours) {
  Image data = noise(16, 16, 3, SampleType::unorm8);
  data.colour_space = ColourSpace::data;
  Image wide = noise(16, 16, 3, SampleType::float16);
  wide.colour_space = ColourSpace::lin_ap0_scene;
  for (const Image& image : {data, wide, noise(16, 16, 7, SampleType::unorm8)}) {
    const auto metrics = compare_images(image, image);
    ASSERT_TRUE(metrics);
    EXPECT_TRUE(std::isnan(metrics->mae_lab) && std::isnan(metrics->de76) && std::isnan(metrics->flip));
    EXPECT_EQ(metrics->ssim, 1);
  }
}

TEST(Ssim, RowsAreWhatPlanesAre) {
  Image hot = material("pebbles", 40, 33, SampleType::float16), mild = hot;
  hot.at(20, 17, 1) = 0x7bff;  // 65504
  const std::pair<Image, Image> pairs[] = {
      {noise(11, 11, 3, SampleType::unorm8), noise(11, 11, 3, SampleType::unorm8, 2)},
      {noise(13, 40, 1, SampleType::unorm16), noise(13, 40, 1, SampleType::unorm16, 2)},
      {material("bricks", 64, 50), material("bricks", 64, 50, SampleType::unorm16)},
      {constant(20, 20, 3, SampleType::unorm8, 0), constant(20, 20, 3, SampleType::unorm8, 255)},
      {constant(20, 20, 3, SampleType::unorm8, 7), constant(20, 20, 3, SampleType::unorm8, 7)},
      {hot, mild}};
  for (const auto& [a, b] : pairs) {
    const CodeTables ta = code_tables(a.type, a.colour_space), tb = code_tables(b.type, b.colour_space);
    const auto plain = compare_images(a, b, {true, false, false});
    ASSERT_TRUE(plain);
    EXPECT_NEAR(ssim_by_rows(code_view(a, ta), code_view(b, tb)), plain->ssim, 1e-5);
    EXPECT_NEAR(ssim_by_rows(code_view(b, tb), code_view(b, tb)), 1, 1e-6);
  }
}

TEST(Ssim, NothingBelowItsWindow) {
  for (const auto& [width, height] : {std::pair{1u, 1u}, {5u, 3u}, {10u, 64u}, {64u, 10u}}) {
    const Image image = noise(width, height, 3, SampleType::unorm8);
    const CodeTables tables = code_tables(image.type, image.colour_space);
    EXPECT_TRUE(std::isnan(ssim_by_rows(code_view(image, tables), code_view(image, tables))));
  }
}

TEST(ImageMetrics, OptionsLeaveMeasuresOut) {
  const Image a = noise(16, 16, 3, SampleType::unorm8), b = noise(16, 16, 3, SampleType::unorm8, 2);
  const auto none = compare_images(a, b, {false, false, false});
  ASSERT_TRUE(none);
  EXPECT_TRUE(std::isnan(none->ssim) && std::isnan(none->mae_lab) && std::isnan(none->flip));
  EXPECT_TRUE(std::isfinite(none->psnr_db));
}

}  // namespace
}  // namespace btfc::test
