// Model patch: what is decoded is what was synthesised; search, cuts and blends against plain definitions.
#include "shaders/models/patch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "encoder/minimum_cut.h"
#include "encoder/models/patch_fit.h"
#include "encoder/models/patch_search.h"
#include "encoder/models/patch_synthesis.h"
#include "tests/test_support.h"

namespace btfc::test {
namespace {

// Encodes with --synthesized and returns the encoder's own picture beside the decoded one.
void expect_decoded_is_synthesised(const Image& image, OptionValues options, const std::string& what) {
  options["synthesized"] = "unused.png";
  const FitResult result = fit("patch", image, options);
  ASSERT_EQ(result.side_images.size(), 1u) << what;
  const Bytes file = pack(result, Codec::zstd);
  const Result<Done> verified = verify_bytes(file);
  ASSERT_TRUE(verified) << what << ": " << (verified ? "" : verified.error().message);
  const std::vector<Image> maps = decode(file);
  ASSERT_EQ(maps.size(), 1u) << what;
  EXPECT_EQ(maps[0].width, result.side_images[0].image.width) << what;
  EXPECT_TRUE(maps[0].codes == result.side_images[0].image.codes) << what;
}

TEST(PatchRoundTrip, BlendsTypesAndShapes) {
  const std::vector<OptionValues> shapes = {
      {{"wb", "9"}, {"we", "4"}, {"k", "4x3"}},        // w_E = w_B / 2, rounded down
      {{"wb", "8"}, {"we", "4"}, {"k", "3x5"}},        // w_E = w_B / 2: every texel is in an overlap
      {{"wb", "7"}, {"we", "1"}, {"k", "4"}},          // one texel of overlap, no cut bits
      {{"wb", "11"}, {"we", "5"}, {"size", "53x47"}},  // primes, cropped
      {{"wb", "2"}, {"we", "1"}, {"k", "6x2"}},        // the smallest patches
      {{"wb", "10"}, {"we", "3"}, {"k", "1x4"}},       // one column
      {{"wb", "10"}, {"we", "3"}, {"k", "4x1"}},       // one row
      {{"wb", "10"}, {"we", "0"}, {"k", "1"}},         // one patch, no overlap
      {{"wb", "10"}, {"we", "5"}, {"k", "1"}},        {{"wb", "13"}, {"we", "2"}, {"size", "40x30"}},
  };
  for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
    for (std::uint32_t channels = 1; channels <= 4; ++channels) {
      const Image image = noise(13, 19, channels, type, channels);
      for (OptionValues options : shapes) {
        const std::string what =
            std::string(name_of(type)) + " " + std::to_string(channels) + " w_B " + options["wb"];
        options["blend"] = "liang";
        expect_decoded_is_synthesised(image, options, what + " liang");
        options["blend"] = "quilting";
        options["pack"] = "packed";
        expect_decoded_is_synthesised(image, options, what + " packed");
        options["pack"] = "rgba8";
        expect_decoded_is_synthesised(image, options, what + " rgba8");
      }
    }
  }
}

TEST(PatchRoundTrip, Materials) {
  for (const char* kind : {"tiles", "bricks", "pebbles", "grain"}) {
    for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
      const Image image = material(kind, 64, 64, type);
      expect_decoded_is_synthesised(image, {{"size", "150x130"}, {"blend", "liang"}}, kind);
      expect_decoded_is_synthesised(image, {{"size", "150x130"}}, kind);
    }
  }
}

TEST(PatchRoundTrip, WideAndNarrowCoordinates) {
  for (const std::uint32_t width : {256u, 257u}) {
    const Image image = noise(width, 12, 1, SampleType::unorm8);
    const OptionValues options = {{"wb", "12"}, {"we", "4"}, {"k", "5"}};
    expect_decoded_is_synthesised(image, options, std::to_string(width));
    const FitResult result = fit("patch", image, options);
    for (const RawChunk& chunk : result.chunks) {
      if (type_name(chunk.key.type) == "COOR") {
        EXPECT_EQ(chunk.raw.size(), width == 256 ? 52u : 100u);
      }
    }
  }
}

TEST(PatchRoundTrip, SampleOfExactlyOnePatch) {
  const Image image = noise(12, 12, 3, SampleType::unorm8);
  expect_decoded_is_synthesised(image, {{"wb", "12"}, {"we", "6"}, {"k", "4"}}, "quilting");
  const FitResult result = fit("patch", image, {{"wb", "12"}, {"we", "6"}, {"k", "4"}});
  for (const RawChunk& chunk : result.chunks) {
    if (type_name(chunk.key.type) == "COOR") {
      EXPECT_EQ(chunk.raw, Bytes(chunk.raw.size()));
    }
  }
}

TEST(PatchRoundTrip, ConstantSamples) {
  for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
    for (const std::uint16_t code : {std::uint16_t{0}, std::uint16_t{255}, std::uint16_t{100}}) {
      const Image image = constant(16, 16, 3, type, code);
      for (const char* blend : {"liang", "quilting"}) {
        const std::vector<Image> maps = decode(encode("patch", image, {{"size", "40x40"}, {"blend", blend}}));
        ASSERT_EQ(maps.size(), 1u);
        EXPECT_EQ(maps[0].codes, constant(40, 40, 3, type, code).codes) << name_of(type) << code << blend;
      }
    }
  }
}

TEST(PatchRoundTrip, MinusZeroIsCopiedAndBlendsToPlusZero) {
  const Image image = constant(8, 8, 1, SampleType::float16, 0x8000);
  const OptionValues options = {{"wb", "4"}, {"we", "2"}, {"k", "2"}, {"blend", "liang"}};
  expect_decoded_is_synthesised(image, options, "-0");
  const std::vector<Image> maps = decode(encode("patch", image, options));
  EXPECT_EQ(maps[0].at(0, 0, 0), 0x8000);
  EXPECT_EQ(maps[0].at(2, 0, 0), 0x0000);
}

TEST(PatchRoundTrip, SeveralMapsShareTheRecipe) {
  const Image colour = material("bricks", 48, 48), height = noise(48, 48, 1, SampleType::unorm16);
  const Image light = material("bricks", 48, 48, SampleType::float16);
  FitSettings settings;
  settings.options = {{"size", "100x90"}, {"synthesized", "x.png"}};
  const Result<FitResult> result =
      fitter(ModelId::patch).fit({{{"albedo", colour}, {"height", height}, {"light", light}}}, settings);
  ASSERT_TRUE(result);
  const std::vector<Image> maps = decode(pack(*result));
  ASSERT_EQ(maps.size(), 3u);
  for (std::size_t m = 0; m < 3; ++m) {
    EXPECT_TRUE(maps[m].codes == result->side_images[m].image.codes) << m;
  }
  EXPECT_EQ(result->side_images[1].path, "x-height.png");
}

TEST(PatchRoundTrip, MapsOfDifferentSizesAreRefusedByName) {
  const FitInput input = {
      {{"albedo", noise(20, 20, 3, SampleType::unorm8)}, {"height", noise(20, 21, 1, SampleType::unorm8)}}};
  FitSettings settings;
  settings.options = {{"k", "2"}};
  const Result<FitResult> result = fitter(ModelId::patch).fit(input, settings);
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message.find("'height' has 20x21"), std::string::npos) << result.error().message;
}

// A texture that wraps: what is decoded is what was synthesised, also across the border, for one patch and
// for many.
TEST(PatchTileable, WrapsForOneTwoAndManyPatches) {
  for (const char* k : {"1", "2", "1x3", "4x1", "5x4"}) {
    for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
      const Image image = noise(24, 21, 3, type);
      for (OptionValues options :
           {OptionValues{{"wb", "12"}, {"we", "5"}}, OptionValues{{"wb", "8"}, {"we", "4"}},
            OptionValues{{"wb", "9"}, {"we", "1"}}}) {
        options["k"] = k;
        options["tileable"] = "";
        for (const char* blend : {"liang", "quilting"}) {
          options["blend"] = blend;
          expect_decoded_is_synthesised(image, options,
                                        std::string(blend) + " k " + k + " w_B " + options["wb"]);
          const Bytes file = encode("patch", image, options);
          const Result<OpenedFile> opened = open_bytes(file);
          ASSERT_TRUE(opened);
          EXPECT_EQ(opened->head.wrap_u, Wrap::repeat);
          const TexturePtr t = load(file);
          const auto w = static_cast<std::int32_t>(opened->head.width),
                     h = static_cast<std::int32_t>(opened->head.height);
          std::vector<std::uint16_t> here(3), there(3);
          const auto texel = [&](std::int32_t x, std::int32_t y, std::vector<std::uint16_t>& out) {
            const std::int32_t at[2] = {x, y};
            ASSERT_EQ(btfc_decode_texels(t.get(), nullptr, 0, nullptr, at, 1, BTFC_UNORM16, out.data(), 6),
                      BTFC_OK);
          };
          for (std::int32_t q = 0; q < 40; ++q) {
            texel(q % w, q * 3 % h, here);
            texel(q % w - w * 7, q * 3 % h + h * 5, there);
            EXPECT_EQ(here, there);
          }
        }
      }
    }
  }
}

// The seam of a wrapped texture is no worse than an inner join: a smooth periodic sample gives a smooth
// border.
TEST(PatchTileable, BorderIsAsSmoothAsTheInside) {
  const Image image = material("grain", 96, 96);
  for (const char* blend : {"liang", "quilting"}) {
    const Image out =
        decode(encode("patch", image, {{"size", "280x280"}, {"tileable", ""}, {"blend", blend}}))[0];
    ASSERT_EQ(out.width, 280u);
    const auto step = [&](std::uint32_t x0, std::uint32_t x1) {  // mean absolute difference of two columns
      double sum = 0;
      for (std::uint32_t y = 0; y < out.height; ++y) sum += std::abs(out.at(x0, y, 1) - out.at(x1, y, 1));
      return sum / out.height;
    };
    double inside = 0;
    for (std::uint32_t x = 0; x + 1 < out.width; ++x) inside += step(x, x + 1) / (out.width - 1);
    EXPECT_LT(step(out.width - 1, 0), 1.6 * inside) << blend;
  }
}

TEST(PatchTileable, SizesThatDoNotTileAreRefused) {
  FitSettings settings;
  settings.options = {{"size", "101x103"}, {"tileable", ""}, {"wb", "20"}};
  const Result<FitResult> result =
      fitter(ModelId::patch).fit({{{"image", noise(40, 40, 3, SampleType::unorm8)}}}, settings);
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message.find("must divide both sides"), std::string::npos)
      << result.error().message;
  for (const char* size : {"1024x1024", "512x768", "1000x600", "97x97"}) {
    const std::vector<Image> maps =
        decode(encode("patch", noise(128, 128, 1, SampleType::unorm8), {{"size", size}, {"tileable", ""}}));
    ASSERT_EQ(maps.size(), 1u) << size;
    EXPECT_EQ(std::to_string(maps[0].width) + "x" + std::to_string(maps[0].height), size);
  }
}

TEST(PatchTrim, DecodesTheSameAndIsSmaller) {
  const Image image = material("pebbles", 66, 59);  // blocks reach outside at the border
  for (const char* blend : {"liang", "quilting"}) {
    for (const char* tileable : {"no", "yes"}) {
      OptionValues options = {{"k", "3"}, {"wb", "12"}, {"we", "4"}, {"blend", blend}};
      if (std::string(tileable) == "yes") options["tileable"] = "";
      const Bytes whole = encode("patch", image, options);
      options["trim-sample"] = "";
      const Bytes trimmed = encode("patch", image, options);
      EXPECT_TRUE(verify_bytes(trimmed)) << verify_bytes(trimmed).error().message;
      EXPECT_LT(trimmed.size(), whole.size() * 9 / 10);
      EXPECT_EQ(decode(whole)[0].codes, decode(trimmed)[0].codes) << blend;
    }
  }
}

TEST(PatchTrim, AllUsedAndOneCorner) {
  const Image image = noise(16, 16, 3, SampleType::unorm8);
  const OptionValues all = {{"k", "1"}, {"wb", "16"}, {"we", "0"}, {"trim-sample", ""}};
  EXPECT_EQ(encode("patch", image, all), encode("patch", image, {{"k", "1"}, {"wb", "16"}, {"we", "0"}}));
  // One patch of a large sample, of which the texture shows four texels.
  const Image large = noise(64, 64, 3, SampleType::unorm8);
  const FitResult corner =
      fit("patch", large, {{"k", "1"}, {"wb", "32"}, {"we", "0"}, {"size", "2x2"}, {"trim-sample", ""}});
  for (const RawChunk& chunk : corner.chunks) {
    if (type_name(chunk.key.type) == "SMPL") {
      EXPECT_LE(chunk.raw.size(), 4u * 48u);
    }
  }
  EXPECT_TRUE(verify_bytes(pack(corner)));
}

TEST(PatchDeterminism, ThreadsAndSeeds) {
  const Image image = material("pebbles", 64, 64);
  const OptionValues options = {{"size", "200x200"}};
  const Bytes one = encode("patch", image, options, Codec::raw, 1);
  EXPECT_EQ(one, encode("patch", image, options, Codec::raw, 2));
  EXPECT_EQ(one, encode("patch", image, options, Codec::raw, 8));
  FitSettings other;
  other.options = options;
  other.seed = 2;
  EXPECT_NE(one, pack(*fitter(ModelId::patch).fit({{{"image", image}}}, other)));
}

TEST(PatchSearch, FastEqualsPlain) {
  for (const char* kind : {"tiles", "grain"}) {
    for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
      for (const double tau : {0.0, 0.05, 0.2, 3.0}) {
        const Image image = material(kind, 40, 37, type);
        for (const PatchBlend blend : {PatchBlend::liang, PatchBlend::quilting}) {
          PatchShape shape{40, 37, 6,     5,
                           14, 5,  blend, blend == PatchBlend::liang ? CutLayout::none : CutLayout::packed};
          SynthesisSettings settings;
          settings.tau = tau;
          const PatchRecipe fast = synthesize_patches(shape, {&image, 1}, settings, {});
          settings.plain_search = true;
          EXPECT_TRUE(fast == synthesize_patches(shape, {&image, 1}, settings, {})) << kind << tau;
        }
      }
    }
  }
}

TEST(PatchSearch, LongRowsDoNotOverflow) {
  // Largest differences over rows longer than one run of 32-bit sums; odd lengths, runs that do not begin at
  // 0; both codings of the planes.
  for (const SampleType type : {SampleType::unorm8, SampleType::unorm16}) {
    Image image = constant(500, 499, 1, type, 0);
    const std::uint16_t white = type == SampleType::unorm8 ? 255 : 65535;
    for (std::size_t i = 0; i < image.codes.size() / 2; ++i) image.codes[i] = white;
    const MatchImage match = match_image(MatchTables({&image, 1}), {&image, 1});
    for (const bool quads : {true, false}) {
      const SearchPlanes planes(match, quads);
      BoundaryZone zone;
      zone.runs = {{0, 0, 495}, {490, 3, 201}};
      for (const int shown : {type == SampleType::unorm8 ? 255 : 4095, 0}) {
        zone.values.assign(696, static_cast<std::int16_t>(shown));
        for (const double tau : {0.0, 0.1}) {
          EXPECT_EQ(find_candidates(planes, 495, zone, tau), find_candidates_plain(match, 495, zone, tau));
        }
      }
    }
  }
}

TEST(PatchSearch, ManyChannelsOfFullRange) {
  // 16 channels of 12 bits: a row of the zone takes several 32-bit sums.
  std::vector<Image> maps;
  for (std::uint32_t m = 0; m < 4; ++m) maps.push_back(noise(90, 70, 4, SampleType::unorm16));
  const MatchImage match = match_image(MatchTables(maps), maps);
  const SearchPlanes planes(match);
  BoundaryZone zone;
  for (std::uint32_t v = 0; v < 64; ++v) zone.runs.push_back({v, v % 2 == 0 ? 0u : 3u, v < 9 ? 61u : 7u});
  for (const ZoneRun& run : zone.runs) {
    for (std::uint32_t i = 0; i < run.length * 16; ++i) {
      zone.values.push_back(static_cast<std::int16_t>((i * 2654435761u + run.v * 40503u) % 4096));
    }
  }
  for (const double tau : {0.0, 0.7, 0.9}) {
    const Candidates fast = find_candidates(planes, 64, zone, tau);
    EXPECT_FALSE(fast.empty());
    EXPECT_EQ(fast, find_candidates_plain(match, 64, zone, tau));
  }
}

// All paths of a small overlap, by recursion.
std::uint64_t least_error(const std::vector<std::uint64_t>& e, std::uint32_t width, std::uint32_t row,
                          std::uint32_t c, std::uint32_t count) {
  std::uint64_t best = UINT64_MAX;
  if (row + 1 == count) best = 0;
  for (std::uint32_t next = c == 0 ? 0 : c - 1; row + 1 < count && next <= std::min(c + 1, width - 1);
       ++next) {
    best = std::min(best, least_error(e, width, row + 1, next, count));
  }
  return e[row * width + c] + best;
}

TEST(PatchCut, MatchesAllPaths) {
  const Image values = noise(64, 64, 1, SampleType::unorm8);
  for (std::uint32_t width = 1; width <= 5; ++width) {
    for (std::uint32_t count = 1; count <= 8; ++count) {
      std::vector<std::uint64_t> error(std::size_t{width} * count);
      for (std::size_t i = 0; i < error.size(); ++i) error[i] = values.codes[i * 7 + width * 100 + count];
      const Cut found = minimum_error_cut(error, width, count);
      const auto& cut = found.path;
      std::uint64_t sum = 0, best = UINT64_MAX;
      for (std::uint32_t r = 0; r < count; ++r) {
        ASSERT_LT(cut[r], width);
        if (r > 0) {
          EXPECT_LE(std::abs(cut[r] - cut[r - 1]), 1);
        }
        sum += error[r * width + cut[r]];
      }
      for (std::uint32_t c = 0; c < width; ++c) best = std::min(best, least_error(error, width, 0, c, count));
      EXPECT_EQ(sum, best);
      EXPECT_EQ(found.cost, best);
    }
  }
}

TEST(PatchLerp, IntegersRoundToNearestAndStayBetween) {
  for (std::uint32_t w = 0; w <= 256; ++w) {
    for (const auto& [a, b] : {std::pair(0u, 255u), std::pair(255u, 0u), std::pair(7u, 7u),
                               std::pair(65535u, 0u), std::pair(65535u, 65535u), std::pair(1u, 2u)}) {
      const std::uint32_t got = patch_lerp_code(BTFC_CODE_UNORM16, a, b, w);
      const double exact = (a * (256.0 - w) + b * static_cast<double>(w)) / 256;
      EXPECT_LE(std::fabs(got - exact), 0.5);
    }
  }
}

TEST(PatchLerp, HalvesAreTheRoundedExactValue) {
  const Image values = noise(2000, 1, 2, SampleType::float16);
  for (std::size_t i = 0; i + 1 < values.codes.size(); i += 2) {
    const std::uint32_t a = values.codes[i], b = values.codes[i + 1], w = static_cast<std::uint32_t>(i % 257);
    const std::uint32_t got = patch_lerp_code(BTFC_CODE_FLOAT16, a, b, w);
    const double va = btfc_half_to_float(a), vb = btfc_half_to_float(b);
    const double exact = (va * (256.0 - w) + vb * w) / 256, value = btfc_half_to_float(got);
    ASSERT_TRUE(std::isfinite(value));
    // Half an ulp of the half, and what one binary32 rounding may add.
    const double ulp =
        std::max(std::ldexp(1.0, std::ilogb(std::fmax(std::fabs(exact), 1e-30)) - 10), std::ldexp(1.0, -24));
    EXPECT_LE(std::fabs(value - exact), ulp * 0.5001) << va << ' ' << vb << ' ' << w;
    EXPECT_GE(value, std::fmin(va, vb));
    EXPECT_LE(value, std::fmax(va, vb));
    EXPECT_NE(got, 0x8000u);
  }
}

TEST(PatchWeights, RiseFromLeftToRight) {
  for (std::uint32_t overlap = 1; overlap <= 600; ++overlap) {
    std::uint32_t before = 0;
    for (std::uint32_t a = 0; a < overlap; ++a) {
      const std::uint32_t w = patch_weight(a, overlap);
      EXPECT_GE(w, before);
      EXPECT_LE(w, 256u);
      // The two sides mirror each other, up to the rounding of ties.
      EXPECT_LE(std::abs(static_cast<int>(w + patch_weight(overlap - 1 - a, overlap)) - 256), 1);
      before = w;
    }
  }
  EXPECT_EQ(patch_weight(32767, 32768), 256u);
}

TEST(Half, AllCodesAndTheirNeighbours) {
  for (std::uint32_t code = 0; code < 65536; ++code) {
    if ((code & 0x7c00) == 0x7c00) continue;
    const float value = btfc_half_to_float(code);
    ASSERT_EQ(btfc_float_to_half(value), code);
    const double exact = std::ldexp((code & 0x7c00) ? 1024 + (code & 0x3ff) : code & 0x3ff,
                                    static_cast<int>(std::max(code >> 10 & 31, 1u)) - 25);
    ASSERT_EQ(value, (code & 0x8000) ? -exact : exact);
    // The midpoint to the next code goes to the even one, a hair beside it to the nearer one.
    if ((code & 0x7fff) == 0x7bff) continue;
    const float next = btfc_half_to_float(code + 1), middle = value + (next - value) / 2;
    ASSERT_EQ(btfc_float_to_half(middle), code + (code & 1));
    ASSERT_EQ(btfc_float_to_half(std::nextafter(middle, next)), code + 1);
    ASSERT_EQ(btfc_float_to_half(std::nextafter(middle, value)), code);
  }
  EXPECT_EQ(btfc_float_to_half(65519.99f), 0x7bffu);
  EXPECT_EQ(btfc_float_to_half(65520.0f), 0x7c00u);
  EXPECT_EQ(btfc_float_to_half(-std::numeric_limits<float>::infinity()), 0xfc00u);
}

struct Refusal {
  const char* name;
  std::uint32_t width, height;
  OptionValues options;
  const char* words;  // what the sentence must say
};

TEST(PatchRefusals, SayWhatIsPossible) {
  const std::vector<Refusal> all = {
      {"no size", 8, 8, {}, "--size nor --k"},
      {"one texel", 1, 1, {{"k", "2"}}, "at least 2x2"},
      {"one row", 8, 1, {{"k", "2"}}, "at least 2x2"},
      {"patch larger than the sample", 2, 2, {{"k", "2"}, {"wb", "3"}}, "allows 2 to 2"},
      {"patch larger than one side", 20, 9, {{"k", "2"}, {"wb", "10"}}, "allows 2 to 9"},
      {"overlap above half", 20, 20, {{"k", "2"}, {"wb", "9"}, {"we", "5"}}, "allows 1 to 4"},
      {"no overlap", 20, 20, {{"k", "2"}, {"wb", "9"}, {"we", "0"}}, "expected 1 to 4"},
      {"too few patches", 20, 20, {{"k", "2"}, {"wb", "9"}, {"we", "3"}, {"size", "16x16"}}, "make 15x15"},
      {"too many patches", 20, 20, {{"k", "9"}, {"wb", "9"}, {"we", "3"}, {"size", "16x16"}}, "do not fit"},
      {"texture too large", 20, 20, {{"k", "65536"}, {"wb", "9"}, {"we", "3"}}, "at most 65536 a side"},
      {"window outside", 20, 20, {{"k", "2"}, {"sample", "10,10,11,10"}}, "inside the input of 20x20"},
      {"window malformed", 20, 20, {{"k", "2"}, {"sample", "10,10,4"}}, "X,Y,W,H"},
      {"window overflows", 20, 20, {{"k", "2"}, {"sample", "4294967290,0,10,10"}}, "inside the input"},
      {"pack with liang",
       20,
       20,
       {{"k", "2"}, {"blend", "liang"}, {"pack", "packed"}},
       "liang stores no cuts"},
      {"rgba8 with a wide overlap",
       600,
       600,
       {{"k", "2"}, {"wb", "600"}, {"we", "257"}, {"pack", "rgba8"}},
       "at most 256"},
      {"tau", 20, 20, {{"k", "2"}, {"tau", "-1"}}, "from 0 to 10"},
      {"tau is no number", 20, 20, {{"k", "2"}, {"tau", "nan"}}, "from 0 to 10"},
      {"blend", 20, 20, {{"k", "2"}, {"blend", "poisson"}}, "liang or quilting"},
  };
  for (const Refusal& one : all) {
    FitSettings settings;
    settings.options = one.options;
    const Result<FitResult> result =
        fitter(ModelId::patch)
            .fit({{{"image", noise(one.width, one.height, 1, SampleType::unorm8)}}}, settings);
    ASSERT_FALSE(result) << one.name;
    EXPECT_EQ(result.error().status, Status::bad_argument) << one.name;
    EXPECT_NE(result.error().message.find(one.words), std::string::npos)
        << one.name << ": " << result.error().message;
  }
}

TEST(PatchRefusals, TwoByTwoSampleIsEnough) {
  const Image image = noise(2, 2, 1, SampleType::unorm8);
  expect_decoded_is_synthesised(image, {{"k", "3"}}, "2x2");
  expect_decoded_is_synthesised(image, {{"k", "3"}, {"blend", "liang"}}, "2x2");
}

}  // namespace
}  // namespace btfc::test
