// Formulas against the papers and against files.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "format/checked.h"
#include "format/models/patch_payload.h"
#include "tests/test_support.h"

namespace btfc::test {
namespace {

// What `btfc size` computes.
struct Sizes {
  Head head;
  Layout layout;
  double paper_bpp() const {
    return static_cast<double>(layout.paper->bits) / (static_cast<double>(head.width) * head.height);
  }
};

Sizes sizes(const OptionValues& options) {
  const ModelFormat& model = *find_model("patch");
  const Result<ItemDescription> item = model.describe(options);
  if (!item) {
    ADD_FAILURE() << item.error().message;
    return {};
  }
  const Result<Layout> layout = model.layout(item->head, item->parm);
  if (!layout) {
    ADD_FAILURE() << layout.error().message;
    return {};
  }
  return {item->head, *layout};
}

Sizes paper_case(const char* blend, const char* sample, int k, int wb, int we) {
  return sizes({{"blend", blend},
                {"sample", sample},
                {"k", std::to_string(k)},
                {"wb", std::to_string(wb)},
                {"we", std::to_string(we)}});
}

TEST(PaperSizes, NumericalExamples) {
  const Sizes liang = paper_case("liang", "64x64", 11, 36, 14);
  EXPECT_EQ(liang.layout.paper->bits, 100304u);
  EXPECT_EQ(liang.head.width, 256u);
  EXPECT_EQ(liang.head.height, 256u);
  EXPECT_EQ(liang.layout.formula_bits, 100512u);  // the spec page's worked example
  const Sizes quilting = paper_case("quilting", "64x64", 11, 36, 14);
  EXPECT_EQ(quilting.layout.paper->bits, 131984u);
  EXPECT_EQ(quilting.layout.formula_bits, 132192u);
  const Sizes large = paper_case("quilting", "64x64", 20, 36, 14);
  EXPECT_EQ(large.layout.paper->bits, 214208u);  // printed 214224, spec/errata.md
  EXPECT_EQ(large.head.width, 454u);
  const Sizes rgba8 =
      sizes({{"pack", "rgba8"}, {"sample", "64x64"}, {"k", "11"}, {"wb", "36"}, {"we", "14"}});
  EXPECT_EQ(rgba8.layout.formula_bits, 163872u);
}

// Table II, as printed. The parameters, which the paper does not give, follow from the printed digits.
TEST(PaperSizes, TableTwo) {
  struct Row {
    const char* texture;
    const char* sample;
    int k, wb, we;
    const char* liang;
    const char* quilting;
  };
  constexpr Row kRows[] = {
      {"r1", "74x75", 11, 36, 14, "", "2.55"},          {"r1", "74x75", 19, 44, 18, "", "1.10"},
      {"r1 as 74x74", "74x74", 11, 36, 14, "2.04", ""}, {"r1 as 74x74", "74x74", 19, 44, 18, "0.52", ""},
      {"r2", "64x64", 8, 46, 16, "1.52", "1.83"},       {"r2", "64x64", 19, 44, 18, "0.40", "0.97"},
      {"nr1", "64x64", 11, 36, 14, "1.53", "2.01"},     {"nr1", "64x64", 19, 44, 18, "0.40", "0.97"},
      {"nr2", "64x64", 8, 46, 16, "1.52", "1.83"},      {"nr2", "64x64", 19, 44, 18, "0.40", "0.97"},
      {"i1", "90x90", 8, 46, 16, "2.98", "3.30"},       {"i1", "90x90", 19, 44, 18, "0.76", "1.34"},
      {"i2", "80x80", 11, 36, 14, "2.37", "2.86"},      {"i2", "80x80", 19, 44, 18, "0.61", "1.18"},
      {"s1", "60x60", 11, 36, 14, "1.35", "1.83"},      {"s1", "60x60", 19, 44, 18, "0.35", "0.93"},
      {"s2", "60x60", 11, 36, 14, "1.35", "1.83"},      {"s2", "60x60", 19, 44, 18, "0.35", "0.93"},
  };
  for (const Row& row : kRows) {
    const Sizes liang = paper_case("liang", row.sample, row.k, row.wb, row.we);
    const Sizes quilting = paper_case("quilting", row.sample, row.k, row.wb, row.we);
    EXPECT_EQ(liang.head.width, row.k == 19 ? 512u : 256u);
    if (*row.liang != '\0') {
      EXPECT_EQ(fmt::format("{:.2f}", liang.paper_bpp()), row.liang) << row.texture << row.k;
    }
    if (*row.quilting != '\0') {
      EXPECT_EQ(fmt::format("{:.2f}", quilting.paper_bpp()), row.quilting) << row.texture << row.k;
    }
  }
}

// Random parameters, random contents: the formula is what a file holds, and a raw file is exactly Fmax.
RC_GTEST_PROP(Sizes, FormulaEqualsPayloadAndFileEqualsFmax, ()) {
  PatchShape s;
  s.sample_width = *rc::gen::inRange(2u, 40u);
  s.sample_height = *rc::gen::inRange(2u, 40u);
  if (*rc::gen::inRange(0, 8) == 0) s.sample_width = *rc::gen::inRange(250u, 262u);
  s.size = *rc::gen::inRange(2u, std::min(s.sample_width, s.sample_height) + 1);
  s.count_x = *rc::gen::inRange(1u, 9u);
  s.count_y = *rc::gen::inRange(1u, 9u);
  s.wraps = *rc::gen::inRange(0, 3) == 0;
  const bool single = s.patches() == 1 && !s.wraps;
  s.overlap = *rc::gen::inRange(single ? 0u : 1u, s.size / 2 + 1);
  const int kind = *rc::gen::inRange(0, 3);
  s.blend = kind == 0 ? PatchBlend::liang : PatchBlend::quilting;
  s.cuts = static_cast<CutLayout>(kind);

  Head head;
  const auto side = [&](std::uint64_t full, std::uint32_t count) {
    const auto most = static_cast<std::uint32_t>(full);
    return s.wraps ? most : *rc::gen::inRange((count - 1) * s.step() + 1, most + 1);
  };
  head.width = side(s.full_width(), s.count_x);
  head.height = side(s.full_height(), s.count_y);
  head.wrap_u = head.wrap_v = s.wraps ? Wrap::repeat : Wrap::clamp;
  std::vector<SampleCodes> samples;
  const std::uint32_t maps = *rc::gen::inRange(1u, 4u);
  for (std::uint32_t m = 0; m < maps; ++m) {
    Map map;
    map.name = fmt::format("m{}", m);
    map.channels = *rc::gen::inRange(1u, 5u);
    map.type = static_cast<SampleType>(*rc::gen::inRange(0, 3));
    head.maps.push_back(map);
    samples.push_back(noise(s.sample_width, s.sample_height, map.channels, map.type, m).codes);
  }
  PatchRecipe recipe;
  for (std::uint64_t p = 0; p < s.patches(); ++p) {
    recipe.positions.push_back({*rc::gen::inRange(0u, s.sample_width - s.size + 1),
                                *rc::gen::inRange(0u, s.sample_height - s.size + 1)});
  }
  const auto entries = [&](std::uint64_t cuts) {
    std::vector<std::uint16_t> all(cuts * s.size);
    for (std::size_t i = 0; i < all.size(); ++i)
      all[i] = static_cast<std::uint16_t>((i * 7 + i / 3) % s.overlap);
    return all;
  };
  recipe.cuts_v = entries(s.cuts_v());
  recipe.cuts_h = entries(s.cuts_h());
  if (*rc::gen::inRange(0, 3) == 0) {
    for (std::uint32_t b = 0; b < s.blocks_x() * s.blocks_y(); ++b)
      recipe.blocks.push_back(*rc::gen::inRange(0, 4) != 0);
    s.stored_blocks =
        static_cast<std::uint32_t>(std::count(recipe.blocks.begin(), recipe.blocks.end(), true));
    if (s.stored_blocks == recipe.blocks.size()) s.stored_blocks = 0;
    if (s.stored_blocks == 0) recipe.blocks.clear();
  }

  RC_ASSERT(static_cast<bool>(check_patch_shape(s, head)));
  PackOptions options;
  options.codec = Codec::raw;
  options.align_log2 = *rc::gen::inRange(4u, 9u);
  const Result<Bytes> file = pack_file(patch_write(head, s, recipe, samples), options);
  RC_ASSERT(static_cast<bool>(file));
  const Result<OpenedFile> opened = open_bytes(*file);
  RC_ASSERT(static_cast<bool>(opened));
  RC_ASSERT(static_cast<bool>(verify_bytes(*file)));
  RC_ASSERT(opened->head == head);

  std::uint64_t payload = 0;
  std::vector<std::uint64_t> raw;
  for (const IndexEntry& e : opened->directory.entries) {
    raw.push_back(e.raw_bytes);
    if (e.key.flags & kPayload) payload += e.raw_bytes;
  }
  RC_ASSERT(8 * payload == opened->layout.formula_bits);
  RC_ASSERT(8 * payload == patch_formula_bits(s, head.maps));
  RC_ASSERT(file->size() == file_bytes_of(raw, options.align_log2));

  const ByteView view(*file);
  const Result<LoadedItem> item = load_item(source_of(view), *opened);
  RC_ASSERT(static_cast<bool>(item));
  std::uint64_t words = 0;
  for (const auto& slot : item->words) words += slot.size();
  RC_ASSERT(32 * words == opened->layout.memory_bits);

  options.codec = Codec::zstd;
  const Result<Bytes> packed = pack_file(patch_write(head, s, recipe, samples), options);
  RC_ASSERT(packed->size() <= file->size());
  const Result<OpenedFile> reopened = open_bytes(*packed);
  for (std::size_t i = 0; i < raw.size(); ++i) {
    RC_ASSERT(reopened->directory.entries[i].raw_hash == opened->directory.entries[i].raw_hash);
  }
}

TEST(Sizes, ZstdOnlyWhereSmaller) {
  const Bytes random = encode("patch", noise(32, 32, 3, SampleType::unorm8), {{"k", "2"}}, Codec::zstd);
  const Bytes flat = encode("patch", constant(32, 32, 3, SampleType::unorm8, 9), {{"k", "2"}}, Codec::zstd);
  const auto entries = [](const Bytes& file) { return open_bytes(file)->directory.entries; };
  for (const IndexEntry& e : entries(random)) {
    if (type_name(e.key.type) == "SMPL") {
      EXPECT_EQ(e.codec, Codec::raw);
    }
    EXPECT_LE(e.stored_bytes, e.raw_bytes);
  }
  for (const IndexEntry& e : entries(flat)) {
    if (type_name(e.key.type) == "SMPL") {
      EXPECT_EQ(e.codec, Codec::zstd);
    }
  }
}

TEST(Checked, OverflowSticks) {
  const CheckedSize big(std::uint64_t{1} << 33);
  EXPECT_TRUE((big * CheckedSize(std::uint64_t{1} << 30)).valid());
  EXPECT_FALSE((big * big).valid());
  EXPECT_FALSE((big * big + CheckedSize(1)).valid());
  EXPECT_EQ((big * big).saturated(), UINT64_MAX);
  EXPECT_FALSE(align_up(CheckedSize(UINT64_MAX), 4).valid());
  EXPECT_EQ(align_up(CheckedSize(17), 4).value(), 32u);
  EXPECT_EQ(ceil_div(UINT64_MAX, 2), (UINT64_MAX >> 1) + 1);
  EXPECT_EQ(ceil_log2(1), 0u);
  EXPECT_EQ(ceil_log2(14), 4u);
  EXPECT_EQ(ceil_log2(16), 4u);
  EXPECT_EQ(ceil_log2(17), 5u);
  EXPECT_FALSE(file_bytes_of({UINT64_MAX, 5}, 4));
  EXPECT_FALSE(file_bytes_of({std::uint64_t{1} << 63}, 4));
}

}  // namespace
}  // namespace btfc::test
