// Texture statistics against what they must say of known pictures, and the automatic choice of the sample.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "encoder/metrics/texture_statistics.h"
#include "encoder/models/patch_joins.h"
#include "encoder/models/patch_sample.h"
#include "format/fourier.h"
#include "tests/test_support.h"

namespace btfc::test {
namespace {

TextureStatistics statistics(const Image& image) {
  return texture_statistics(image, spectrum_block(image.width, image.height));
}

// The mean of the 3x3 texels around each, as far as they lie inside.
Image blurred(const Image& image) {
  Image out = image;
  for (std::uint32_t y = 0; y < image.height; ++y) {
    for (std::uint32_t x = 0; x < image.width; ++x) {
      for (std::uint32_t c = 0; c < image.channels; ++c) {
        std::uint32_t sum = 0, count = 0;
        for (std::uint32_t v = y == 0 ? 0 : y - 1; v <= std::min(y + 1, image.height - 1); ++v) {
          for (std::uint32_t u = x == 0 ? 0 : x - 1; u <= std::min(x + 1, image.width - 1); ++u) {
            sum += image.at(u, v, c);
            ++count;
          }
        }
        out.at(x, y, c) = static_cast<std::uint16_t>(sum / count);
      }
    }
  }
  return out;
}

void fill(Image& image, std::uint32_t x, std::uint32_t y, std::uint32_t side, std::uint16_t code) {
  for (std::uint32_t v = y; v < y + side; ++v) {
    for (std::uint32_t u = x; u < x + side; ++u) {
      for (std::uint32_t c = 0; c < image.channels; ++c) image.at(u, v, c) = code;
    }
  }
}

TEST(Fourier, IsTheSumItIsDefinedAs) {
  for (const std::size_t n : {1u, 2u, 4u, 16u}) {
    std::vector<std::complex<double>> f(n);
    for (std::size_t t = 0; t < n; ++t) f[t] = {std::sin(3.0 * double(t)), double(t % 5)};
    std::vector<std::complex<double>> fast = f;
    Fourier(n).transform(fast);
    for (std::size_t k = 0; k < n; ++k) {
      std::complex<double> sum = 0;
      for (std::size_t t = 0; t < n; ++t) {
        sum += f[t] * std::polar(1.0, -2 * std::numbers::pi * double(k * t) / double(n));
      }
      EXPECT_NEAR(std::abs(sum - fast[k]), 0, 1e-12) << n << " " << k;
    }
  }
}

TEST(Statistics, SpectrumOfNoiseIsItsVariance) {
  const Image image = noise(256, 256, 1, SampleType::unorm8);
  const TextureStatistics s = statistics(image);
  double mean = 0;
  for (const double p : s.spectrum.power) mean += p / double(s.spectrum.power.size());
  EXPECT_NEAR(mean, s.deviations[0] * s.deviations[0], 0.02 * mean);
  EXPECT_NEAR(s.deviations[0], 1 / std::sqrt(12.0), 0.01);
}

TEST(Statistics, IdenticalPictures) {
  for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
    const TextureStatistics a = statistics(material("bricks", 96, 80, type));
    EXPECT_EQ(gradient_kept(a, a), 1);
    EXPECT_EQ(spectrum_distance(a.spectrum, a.spectrum), 0);
    EXPECT_EQ(colour_distance(a, a), 0);
  }
}

TEST(Statistics, PicturesOfOneMaterialAreClose) {
  // Other sizes, and a part of it: much closer than another material.
  const Image bricks = material("bricks", 512, 512);
  const TextureStatistics whole = statistics(bricks), part = statistics(crop(bricks, 64, 32, 384, 320)),
                          other = statistics(material("grain", 256, 256));
  EXPECT_LT(spectrum_distance(whole.spectrum, part.spectrum),
            spectrum_distance(whole.spectrum, other.spectrum) / 3);
  EXPECT_LT(colour_distance(whole, part), colour_distance(whole, other) / 3);
}

TEST(Statistics, BlurLosesGradient) {
  const Image image = material("pebbles", 128, 128);
  const TextureStatistics a = statistics(image), b = statistics(blurred(image));
  EXPECT_LT(gradient_kept(a, b), 0.8);
  EXPECT_GT(gradient_kept(b, a), 1.25);
  EXPECT_GT(spectrum_distance(a.spectrum, b.spectrum), 0.3);
}

TEST(Statistics, ColourDistanceCountsStandardDeviations) {
  Image a = noise(64, 64, 1, SampleType::unorm8), b = a;
  for (std::uint16_t& code : a.codes) code = static_cast<std::uint16_t>(code / 4);
  for (std::size_t q = 0; q < b.codes.size(); ++q) b.codes[q] = static_cast<std::uint16_t>(a.codes[q] + 20);
  const TextureStatistics sa = statistics(a), sb = statistics(b);
  EXPECT_NEAR(colour_distance(sa, sb), 20 / 255.0 / sa.deviations[0], 1e-9);
}

TEST(Statistics, ConstantAndTinyPicturesAreDefined) {
  for (const auto& [width, height] : {std::pair{1u, 1u}, {3u, 2u}, {1u, 5u}, {70u, 64u}}) {
    for (const std::uint32_t channels : {1u, 2u, 3u, 4u}) {
      const Image flat = constant(width, height, channels, SampleType::unorm8, 77);
      const Image busy = noise(width, height, channels, SampleType::unorm8);
      const TextureStatistics a = statistics(flat), b = statistics(busy);
      EXPECT_EQ(gradient_kept(a, a), 1);
      EXPECT_EQ(spectrum_distance(a.spectrum, a.spectrum), 0);
      for (const auto& [r, c] : {std::pair{&a, &b}, {&b, &a}}) {
        EXPECT_TRUE(std::isfinite(gradient_kept(*r, *c)));
        EXPECT_TRUE(std::isfinite(std::log(gradient_kept(*r, *c))));
        EXPECT_TRUE(std::isfinite(spectrum_distance(r->spectrum, c->spectrum)));
        EXPECT_TRUE(std::isfinite(colour_distance(*r, *c)));
      }
      JoinMask mask{width, height, std::vector<std::uint8_t>(std::size_t{width} * height)};
      EXPECT_FALSE(join_gradients(flat, mask).seam_ratio());
      mask.bits.assign(mask.bits.size(), JoinMask::kRight);
      const auto ratio = join_gradients(flat, mask).seam_ratio();
      EXPECT_EQ(ratio.has_value(), width > 1 && height > 1);
      EXPECT_EQ(ratio.value_or(1), 1);
    }
  }
}

TEST(Statistics, ShuffledBoxesHaveSeams) {
  const Image image = blurred(blurred(material("pebbles", 128, 128)));
  Image shuffled = image;
  JoinMask mask{128, 128, std::vector<std::uint8_t>(128 * 128)};
  for (std::uint32_t y = 0; y < 128; ++y) {
    for (std::uint32_t x = 0; x < 128; ++x) {
      const std::uint32_t box = (y / 16 * 8 + x / 16) * 27 % 64;  // 27 is coprime to 64: a permutation
      for (std::uint32_t c = 0; c < 3; ++c)
        shuffled.at(x, y, c) = image.at(box % 8 * 16 + x % 16, box / 8 * 16 + y % 16, c);
      mask.bits[y * 128 + x] = static_cast<std::uint8_t>((x % 16 == 15 ? JoinMask::kRight : 0) |
                                                         (y % 16 == 15 ? JoinMask::kBelow : 0));
    }
  }
  EXPECT_NEAR(*join_gradients(image, mask).seam_ratio(), 1, 0.25);
  EXPECT_GT(*join_gradients(shuffled, mask).seam_ratio(), 2);
}

TEST(Joins, AreWherePatchesMeet) {
  // Two patches that continue each other, and one that does not.
  Head head;
  head.model = ModelId::patch;
  head.width = 3 * 6 + 2;
  head.height = 8;
  PatchShape shape{32, 16, 3, 1, 8, 2, PatchBlend::quilting, CutLayout::packed, false, 0};
  PatchRecipe recipe;
  recipe.positions = {{3, 4}, {9, 4}, {0, 0}};
  recipe.cuts_v.assign(2 * 8, 1);  // the earlier patch shows one texel of the overlap
  const JoinMask mask = patch_joins(head, shape, recipe);
  for (std::uint32_t y = 0; y < 8; ++y) {
    for (std::uint32_t x = 0; x < head.width; ++x)
      EXPECT_EQ(mask.bits[y * head.width + x], x == 12 ? JoinMask::kRight : 0) << x << " " << y;
  }
  shape.blend = PatchBlend::liang;
  shape.cuts = CutLayout::none;
  const JoinMask zones = patch_joins(head, shape, recipe);
  for (std::uint32_t x = 0; x + 1 < head.width; ++x) {
    const bool in = (x >= 6 && x < 8) || (x >= 12 && x < 14);
    EXPECT_EQ(zones.bits[x], (in || x == 5 || x == 11 ? JoinMask::kRight : 0) | (in ? JoinMask::kBelow : 0))
        << x;
  }
}

TEST(Joins, OfARecipeAndOfItsFileAreTheSame) {
  const Image image = material("bricks", 48, 48);
  for (const OptionValues& more :
       {OptionValues{{"blend", "liang"}}, {}, {{"tileable", ""}}, {{"trim-sample", ""}}}) {
    OptionValues options = {{"k", "5x4"}, {"wb", "18"}, {"we", "5"}, {"tries", "1"}};
    options.insert(more.begin(), more.end());
    const Bytes file = encode("patch", image, options);
    const Result<OpenedFile> opened = open_bytes(file);
    ASSERT_TRUE(opened);
    ByteView view(file);
    const Result<LoadedItem> item = load_item(source_of(view), *opened);
    ASSERT_TRUE(item);
    const Result<JoinMask> mask = fitter(ModelId::patch).joins(*item, opened->parm);
    ASSERT_TRUE(mask);
    const Result<PatchShape> shape = read_patch_parm(opened->parm, opened->head);
    ASSERT_TRUE(shape);
    const PatchRecipe recipe = synthesize_patches(*shape, {&image, 1}, {}, {});
    EXPECT_EQ(patch_joins(opened->head, *shape, recipe).bits, mask->bits);
    const std::optional<double> ratio = join_gradients(decode(file)[0], *mask).seam_ratio();
    ASSERT_TRUE(ratio);
    EXPECT_GT(*ratio, 0.3);
    EXPECT_LT(*ratio, 3);
  }
}

// Bricks with a black blob of a fifth of the picture's side.
constexpr std::uint32_t kBlob = 64;

Image with_defect(std::uint32_t x, std::uint32_t y) {
  Image image = material("bricks", 320, 320);
  fill(image, x, y, kBlob, 0);
  return image;
}

bool touches(const std::string& window, std::uint32_t x, std::uint32_t y) {
  const auto w = split_numbers(window, ',');
  return !w || w->size() != 4 ||
         ((*w)[0] < x + kBlob && (*w)[0] + (*w)[2] > x && (*w)[1] < y + kBlob && (*w)[1] + (*w)[3] > y);
}

TEST(ChooseSample, AvoidsADefectWhereverItIs) {
  for (const auto& [x, y] : {std::pair{0u, 0u}, {120u, 130u}, {200u, 30u}, {90u, 200u}, {160u, 100u}}) {
    const FitResult result =
        fit("patch", with_defect(x, y), {{"sample", "auto"}, {"sample-size", "64x64"}, {"k", "2"}}, 2);
    EXPECT_FALSE(touches(result.meta.at("patch.sample"), x, y)) << x << "," << y;
  }
}

TEST(ChooseSample, DoesNotDependOnThreads) {
  const Image image = with_defect(120, 130);
  const OptionValues options = {{"sample", "auto"}, {"sample-size", "80x64"}, {"size", "200x160"}};
  const FitResult one = fit("patch", image, options, 1), four = fit("patch", image, options, 4);
  const auto n = split_numbers(one.meta.at("patch.sample"), ',');
  ASSERT_TRUE(n);
  EXPECT_EQ((*n)[2], 80u);
  EXPECT_EQ((*n)[3], 64u);
  EXPECT_EQ(one.report[0].name, "sample");
  EXPECT_EQ(one.report[0].value, one.meta.at("patch.sample"));
  EXPECT_EQ(pack(one), pack(four));

  // The same as the window by hand, but for META.
  OptionValues by_hand = {{"sample", one.meta.at("patch.sample")}, {"size", "200x160"}};
  const FitResult again = fit("patch", image, by_hand, 2);
  EXPECT_EQ(decode(pack(again))[0].codes, decode(pack(one))[0].codes);
}

TEST(ChooseSample, AllMapsHaveASay) {
  // The defect lies in the height map alone.
  const FitInput input = {{{"albedo", material("bricks", 320, 320)}, {"height", with_defect(120, 130)}}};
  FitSettings settings;
  settings.options = {{"sample", "auto"}, {"sample-size", "64x64"}, {"size", "150x150"}};
  const Result<FitResult> result = fitter(ModelId::patch).fit(input, settings);
  ASSERT_TRUE(result);
  EXPECT_FALSE(touches(result->meta.at("patch.sample"), 120, 130)) << result->meta.at("patch.sample");
}

TEST(ChooseSample, SmallAndFlatInputs) {
  for (const auto& [width, height] : {std::pair{2u, 2u}, {5u, 3u}, {200u, 4u}, {20u, 20u}}) {
    for (const char* blend : {"liang", "quilting"}) {
      const Image image = constant(width, height, 3, SampleType::unorm8, 9);
      const FitResult result =
          fit("patch", image, {{"sample", "auto"}, {"k", "3"}, {"wb", "2"}, {"we", "1"}, {"blend", blend}});
      EXPECT_EQ(result.meta.at("patch.sample").substr(0, 4), "0,0,");  // equal scores: the first
      for (const Parameter& p : result.report) {
        if (p.number) {
          EXPECT_TRUE(std::isfinite(std::stod(p.value))) << p.name;
        }
      }
    }
  }
}

TEST(ChooseSample, OptionsBelongTogether) {
  const FitInput input = {{{"image", material("bricks", 40, 40)}}};
  const auto refused = [&](OptionValues options) {
    FitSettings settings;
    settings.options = std::move(options);
    settings.options["k"] = "2";
    const Result<FitResult> result = fitter(ModelId::patch).fit(input, settings);
    EXPECT_FALSE(result);
    return result ? "" : result.error().message;
  };
  EXPECT_NE(refused({{"sample-size", "16x16"}}).find("--sample auto"), std::string::npos);
  EXPECT_NE(refused({{"sample", "0,0,16,16"}, {"sample-size", "16x16"}}).find("--sample auto"),
            std::string::npos);
  EXPECT_NE(refused({{"sample", "auto"}, {"sample-size", "16x41"}}).find("40x40"), std::string::npos);
  EXPECT_NE(refused({{"sample", "auto"}, {"sample-size", "16"}}).find("--sample-size"), std::string::npos);
  EXPECT_NE(refused({{"sample", "automatic"}}).find("auto"), std::string::npos);
}

}  // namespace
}  // namespace btfc::test
