// Model ptm: what it recovers exactly, lights that say little, files of others, sizes.
#include "shaders/models/ptm.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <numeric>

#include "encoder/input/ptm_file.h"
#include "encoder/models/ptm_exchange.h"
#include "encoder/models/ptm_fit.h"
#include "encoder/output/atomic_file.h"
#include "format/models/ptm_payload.h"
#include "tests/models/reflectance_support.h"

namespace btfc::test {
namespace {

// Different for every view, texel and channel; within 0 … 1 for all lights.
double polynomial(std::size_t view, const Vector3& light, std::uint32_t x, std::uint32_t y, std::uint32_t c) {
  const double s = 0.1 * static_cast<double>(view % 3) + 0.03 * x + 0.02 * y + 0.05 * c;
  const double u = light[0], v = light[1];
  return 0.1 * u * u - 0.08 * v * v + s * 0.2 * u * v + (0.1 - s * 0.2) * u + 0.06 * v + 0.4 + 0.2 * s;
}

TEST(Ptm, RecoversPolynomials) {
  const DatasetInfo info = small_info(5, 4, 3, 7, 25);
  const Bytes file = pack(fit("ptm", make_dataset(info, polynomial), {}));
  EXPECT_LT(worst_error(file, info, polynomial), 3e-5);
  // Between the lights, and at the horizon beyond them.
  const TexturePtr texture = load(file);
  for (const Vector3& light :
       {Vector3{0.3, 0.2, std::sqrt(0.87)}, Vector3{-0.6, 0.8, 0}, Vector3{0, -1, 0}}) {
    for (std::size_t view = 0; view < info.views.size(); ++view) {
      const auto found = values_at(texture.get(), unit_vector(info.views[view]), light, 3, 2);
      for (std::uint32_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], polynomial(view, light, 3, 2, c), 1e-4);
    }
  }
}

TEST(Ptm, Precisions) {
  const DatasetInfo info = small_info(5, 4, 3, 4, 25);
  const Dataset dataset = make_dataset(info, polynomial);
  EXPECT_LT(worst_error(pack(fit("ptm", dataset, {{"precision", "f16"}})), info, polynomial), 1e-3);
  EXPECT_LT(worst_error(pack(fit("ptm", dataset, {{"precision", "u8"}})), info, polynomial), 2e-3);
}

TEST(Ptm, MissingPairs) {
  DatasetInfo info = small_info(3, 3, 2, 5, 22);
  std::erase_if(info.pairs,
                [](DirectionPair p) { return p.light > 0 && (p.light * 7 + p.view * 3) % 4 == 0; });
  const FitResult fitted = fit("ptm", make_dataset(info, polynomial), {});
  EXPECT_EQ(reported(fitted, "least_rank"), 6);
  EXPECT_LT(worst_error(pack(fitted), info, polynomial), 3e-5);
}

// Few lights: the polynomial of least coefficients through the values.
TEST(Ptm, FewLights) {
  for (const std::size_t lights : {1u, 2u, 4u}) {
    const DatasetInfo info = small_info(2, 2, 1, 1, lights);
    const FitResult fitted = fit("ptm", make_dataset(info, polynomial), {});
    EXPECT_EQ(reported(fitted, "least_rank"), lights);
    EXPECT_LT(worst_error(pack(fitted), info, polynomial), 3e-5) << lights;
  }
}

TEST(Ptm, LightsOnALineOrOnOneSide) {
  DatasetInfo info = small_info(2, 2, 1, 1, 9);
  for (std::size_t i = 0; i < 9; ++i)
    info.lights[i] = direction_from_degrees(std::abs(static_cast<double>(i) * 20 - 80), i < 4 ? 180 : 0);
  FitResult fitted = fit("ptm", make_dataset(info, polynomial), {});
  EXPECT_EQ(reported(fitted, "least_rank"), 3);
  EXPECT_LT(worst_error(pack(fitted), info, polynomial), 3e-5);
  // What a line of lights cannot tell is 0, not some large number: nothing changes across it.
  const TexturePtr texture = load(pack(fitted));
  const Vector3 normal{0, 0, 1};
  EXPECT_NEAR(values_at(texture.get(), normal, {0, 0.9, std::sqrt(0.19)}, 1, 1)[0],
              values_at(texture.get(), normal, normal, 1, 1)[0], 1e-5);
  // All on the right: enough for six, and bounded on the left.
  info = small_info(2, 2, 1, 1, 12);
  for (std::size_t i = 0; i < 12; ++i)
    info.lights[i] =
        direction_from_degrees(25.0 + 25.0 * static_cast<double>(i % 3), 20.0 * static_cast<double>(i) - 110);
  fitted = fit("ptm", make_dataset(info, polynomial), {});
  EXPECT_EQ(reported(fitted, "least_rank"), 6);
  EXPECT_LT(worst_error(pack(fitted), info, polynomial), 3e-5);
}

TEST(Ptm, InverseIsThatOfLeastNorm) {
  std::vector<Vector3> ring;
  for (int i = 0; i < 12; ++i) ring.push_back(unit_vector(direction_from_degrees(45, 30 * i)));
  const PtmInverse inverse = ptm_inverse(ring);
  EXPECT_EQ(inverse.rank, 5u);  // on a ring u^2 + v^2 is a constant
  // Moore and Penrose's four conditions.
  const MatrixD &a = inverse.terms, &b = inverse.inverse;
  EXPECT_LT((a * b * a - a).norm(), 1e-9);
  EXPECT_LT((b * a * b - b).norm(), 1e-9);
  EXPECT_LT((a * b - (a * b).transpose()).norm(), 1e-9);
  EXPECT_LT((b * a - (b * a).transpose()).norm(), 1e-9);
}

TEST(Ptm, ConstantBlackSaturatedAndAHotTexel) {
  const DatasetInfo info = small_info(4, 3, 3, 3, 10);
  for (const char* precision : {"f32", "f16", "u8"}) {
    for (const double level : {0.0, 1.0, 0.25}) {
      const Reflectance flat = [&](auto&&...) { return level; };
      EXPECT_LT(
          worst_error(pack(fit("ptm", make_dataset(info, flat), {{"precision", precision}})), info, flat),
          1e-3);
    }
    const Reflectance hot = [](std::size_t, const Vector3&, std::uint32_t x, std::uint32_t y, std::uint32_t) {
      return x == 2 && y == 1 ? 1.0 : 0.0;
    };
    EXPECT_LT(worst_error(pack(fit("ptm", make_dataset(info, hot), {{"precision", precision}})), info, hot),
              1e-3);
  }
}

TEST(Ptm, BelowTheHorizonAndNoDirection) {
  const DatasetInfo info = small_info(2, 2, 1, 4, 12);
  const TexturePtr texture = load(pack(fit("ptm", make_dataset(info, polynomial), {})));
  const auto at = [&](const Vector3& view, const Vector3& light) {
    return values_at(texture.get(), view, light, 1, 0)[0];
  };
  const Vector3 normal{0, 0, 1};
  EXPECT_EQ(at(normal, {0.6, 0.8, -3}), at(normal, {0.6, 0.8, 0}));
  EXPECT_EQ(at(normal, {0, 0, -1}), at(normal, normal));
  EXPECT_EQ(at(normal, {0, 0, 0}), at(normal, normal));
  EXPECT_EQ(at(normal, {NAN, 0, 1}), at(normal, normal));
  EXPECT_EQ(at({0.6, 0.8, -3}, normal), at({0.6, 0.8, 0}, normal));
  EXPECT_NEAR(at(normal, {6, 8, 10}), at(normal, {0.6, 0.8, 1}), 1e-6);
}

TEST(Ptm, LevelsAreTermsOfThePolynomial) {
  const DatasetInfo info = small_info(3, 2, 2, 2, 12);
  const Bytes file = pack(fit("ptm", make_dataset(info, polynomial), {}));
  const Result<OpenedFile> opened = open_bytes(file);
  ASSERT_TRUE(opened);
  const ByteView bytes(file);
  BtfcQuery query{};
  query.texel = {2, 1};
  query.view = {0, 0, 1};
  query.light = {0.48f, 0.6f, 0.64f};
  const auto value = [&](std::uint32_t levels) {
    const Result<LoadedItem> item = load_item(source_of(bytes), *opened, levels);
    PtmParams params;
    std::memcpy(&params, item->map_params[0].data(), sizeof params);
    EXPECT_EQ(params.terms, kPtmFirstTerm[std::min(levels, 2u) + 1]);
    const BtfcWords words{
        {item->words[0].data(), item->words[1].data(), item->words[2].data(), item->words[3].data()}};
    return ptm_eval(words, params, query)[1];
  };
  const double s = 0.03 * 2 + 0.02 + 0.05, u = 0.48, v = 0.6;
  EXPECT_NEAR(value(0), 0.4 + 0.2 * s, 1e-4);
  EXPECT_NEAR(value(1), 0.4 + 0.2 * s + (0.1 - s * 0.2) * u + 0.06 * v, 1e-4);
  EXPECT_NEAR(value(2), polynomial(0, {u, v, 0.64}, 2, 1, 1), 1e-4);
  EXPECT_EQ(value(2), value(kAllLevels));
}

TEST(Ptm, ThreadsMakeNoDifference) {
  const DatasetInfo info = small_info(9, 7, 3, 3, 15, SampleType::unorm8);
  const Dataset dataset = make_dataset(info, polynomial);
  EXPECT_EQ(pack(fit("ptm", dataset, {{"precision", "u8"}}, 1)),
            pack(fit("ptm", dataset, {{"precision", "u8"}}, 3)));
}

RC_GTEST_PROP(Ptm, FormulaIsPayloadAndMemory, ()) {
  std::mt19937 random(*rc::gen::inRange(0u, 1u << 30));
  const auto [head, directions] = random_btf(ModelId::ptm, random);
  const PtmShape shape{static_cast<Precision>(*rc::gen::inRange(0, 3))};
  const std::size_t texels = std::size_t{head.width} * head.height;
  PtmPayload payload{directions, {}};
  for (std::uint32_t v = 0; v < head.views; ++v) {
    PtmView view;
    for (std::uint32_t level = 0; level < kPtmLevels; ++level) {
      const std::size_t rows = (kPtmFirstTerm[level + 1] - kPtmFirstTerm[level]) * head.channels();
      view[level] = random_rows(random, rows, texels, shape.precision);
    }
    payload.views.push_back(view);
  }
  const std::vector<RawChunk> chunks = ptm_write(head, shape, payload);
  check_sizes(head, chunks, ptm_formula_bits(head, shape), ptm_memory_bits(head, shape));
  check_fast_rows(chunks);
  RC_ASSERT(!testing::Test::HasFailure());
}

TEST(Ptm, SizesOfTheSurvey) {
  const ModelFormat& model = *find_model("ptm");
  const auto layout = [&](const OptionValues& options) {
    const Result<ItemDescription> item = model.describe(options);
    return item ? model.layout(item->head, item->parm) : Result<Layout>(item.error());
  };
  const Result<Layout> wool = layout({{"size", "25x25"}});
  ASSERT_TRUE(wool);
  EXPECT_EQ(wool->paper->bits, 32u * 911250u);
  EXPECT_EQ(wool->formula_bits, 32u * 911250u + 32u);
  // 364 MiB: three slots.
  const Result<Layout> large = layout({{"size", "256x256"}});
  ASSERT_TRUE(large);
  EXPECT_EQ(large->formula_bits, 8 * (4 + std::uint64_t{81} * 65536 * 18 * 4));
  EXPECT_FALSE(layout({{"size", "264x264"}}));
  EXPECT_TRUE(layout({{"size", "264x264"}, {"precision", "f16"}}));
  const Result<Layout> beyond =
      layout({{"size", "65536x65536"}, {"views", "1024"}, {"lights", "1024"}, {"precision", "u8"}});
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().status, Status::bad_argument);
}

// The raw bytes of the chunk of a type, changed by edit, break a rule.
TEST(Ptm, RulesOfTheFile) {
  const DatasetInfo info = small_info(3, 2, 1, 2, 8);
  const FitResult fitted = fit("ptm", make_dataset(info, polynomial), {});
  const auto rule_of = [&](const char* type, const std::function<void(Bytes&)>& edit) -> std::string {
    FitResult changed = fitted;
    for (RawChunk& chunk : changed.chunks) {
      if (type_name(chunk.key.type) == type) edit(chunk.raw);
    }
    const Result<Done> verified = verify_bytes(pack(changed));
    return verified ? "" : verified.error().rule;
  };
  EXPECT_EQ(rule_of("PARM", [](Bytes&) {}), "");
  EXPECT_EQ(rule_of("PARM", [](Bytes& raw) { raw[0] = 3; }), "PT1");
  EXPECT_EQ(rule_of("PARM", [](Bytes& raw) { raw[2] = 1; }), "PT1");
  EXPECT_EQ(rule_of("PARM", [](Bytes& raw) { raw.push_back(0); }), "PT1");
  EXPECT_EQ(rule_of("COEF", [](Bytes& raw) { store_u32(&raw[4], 0x7f800000); }), "PT3");
}

// Rows v texels + t: with three slots, not only the first is read.
TEST(Ptm, RowsOfAllSlotsAreFound) {
  PtmParams p{};
  p.width = 2;
  p.height = 1;
  p.channels = p.all_channels = 1;
  p.terms = 1;
  p.rows_per_slot = 1;
  std::vector<std::uint32_t> slot0;
  p.views_word = append_direction_words({{{0, 0}}, {{0, 0}}, {{0, 0}}}, slot0).views;
  p.scale_word = static_cast<std::uint32_t>(slot0.size());
  append_scales(std::vector<RowScale>(1), slot0);
  const std::vector<std::uint32_t> first = {std::bit_cast<std::uint32_t>(1.5f)},
                                   second = {std::bit_cast<std::uint32_t>(2.5f)};
  const BtfcWords words{{slot0.data(), first.data(), second.data(), nullptr}};
  BtfcQuery query{};
  query.view = query.light = {0, 0, 1};
  EXPECT_EQ(ptm_eval(words, p, query)[0], 1.5f);
  query.texel = {1, 0};
  EXPECT_EQ(ptm_eval(words, p, query)[0], 2.5f);
}

// Files of others.

Bytes foreign_file(const std::string& head, std::size_t bytes) {
  Bytes file(head.begin(), head.end());
  std::mt19937 random(5);
  for (std::size_t i = 0; i < bytes; ++i) file.push_back(static_cast<std::uint8_t>(random()));
  return file;
}

struct TemporaryFile {
  std::string path =
      (std::filesystem::temp_directory_path() / fmt::format("btfc_ptm_test_{}.ptm", ::getpid())).string();
  explicit TemporaryFile(const Bytes& bytes) { EXPECT_TRUE(write_file(path, bytes)); }
  ~TemporaryFile() { std::filesystem::remove(path); }
};

FitResult import(const Bytes& bytes, const OptionValues& options = {}) {
  const TemporaryFile file(bytes);
  FitSettings settings;
  settings.options = options;
  Result<FitResult> result = ptm_import(file.path, settings);
  EXPECT_TRUE(result) << result.error().message;
  return result ? *std::move(result) : FitResult();
}

Bytes export_of(const FitResult& fit) {
  const Bytes file = pack(fit);
  const Result<OpenedFile> opened = open_bytes(file);
  const ByteView view(file);
  const ByteSource source = source_of(view);
  const Result<Bytes> bytes = ptm_export(opened->head, opened->parm, chunk_reader(source, *opened));
  EXPECT_TRUE(bytes) << bytes.error().message;
  return bytes ? *bytes : Bytes();
}

const std::string kRgbHead = "PTM_1.2\nPTM_FORMAT_RGB\n3\n2\n0.5 1.25 0.333333 2 3 1.7\n100 120 0 5 30 12\n";

TEST(PtmFile, RgbBytesStayAsTheyAre) {
  const Bytes file = foreign_file(kRgbHead, 3 * 2 * 18);
  const FitResult fitted = import(file);
  EXPECT_EQ(export_of(fitted), file);
  // The value of a texel, as the format's own formula has it; the last row is stored first.
  const Result<PtmFile> parsed = parse_ptm_file("x", file);
  ASSERT_TRUE(parsed);
  const TexturePtr texture = load(pack(fitted));
  const Vector3 light{0.36, -0.48, 0.8};
  const double u = 0.36, v = -0.48, terms[] = {u * u, v * v, u * v, u, v, 1};
  for (std::uint32_t c = 0; c < 3; ++c) {
    double sum = 0;
    const std::size_t in_file = kRgbHead.size() + (std::size_t{c} * 6 + 2) * 6;  // bottom row, column 2
    for (std::size_t k = 0; k < 6; ++k)
      sum += terms[k] * parsed->scale[k] * (file[in_file + k] - parsed->bias[k]);
    EXPECT_NEAR(values_at(texture.get(), {0, 0, 1}, light, 2, 1)[c], sum / 255, 1e-5);
  }
}

TEST(PtmFile, HeadsOfOtherWriters) {
  for (const char* head :
       {"PTM_1.2\r\nPTM_FORMAT_RGB\r\n3 2\r\n0.50 1.250 3.33333e-1 +2 3 1.7 100 120 0 5 30 12\r\n",
        "PTM_1.1\nPTM_FORMAT_RGB\n3\n2\n0.5 1.25 0.333333 2 3 1.7\n100 120 0 5 30 12\n"}) {
    EXPECT_EQ(export_of(import(foreign_file(head, 3 * 2 * 18))), foreign_file(kRgbHead, 3 * 2 * 18));
  }
}

TEST(PtmFile, WrittenReadAndWrittenAgainIsTheSame) {
  const std::string lrgb = "PTM_1.2\nPTM_FORMAT_LRGB\n3\n2\n0.5 1.25 0.333333 2 3 1.7\n100 120 0 5 30 12\n";
  std::vector<FitResult> fits = {import(foreign_file(lrgb, 3 * 2 * 9)),
                                 import(foreign_file(lrgb, 3 * 2 * 9), {{"precision", "u8"}}),
                                 import(foreign_file(kRgbHead, 3 * 2 * 18), {{"precision", "f32"}})};
  for (const std::uint32_t channels : {1u, 3u}) {
    const DatasetInfo info = small_info(7, 5, channels, 1, 20);
    for (const char* precision : {"f32", "f16", "u8"})
      fits.push_back(fit("ptm", make_dataset(info, polynomial), {{"precision", precision}}));
    fits.push_back(fit("ptm", make_dataset(info, [](auto&&...) { return 0.0; }), {}));
  }
  for (const FitResult& fitted : fits) {
    const Bytes first = export_of(fitted);
    EXPECT_EQ(export_of(import(first)), first);
    EXPECT_EQ(export_of(import(export_of(import(first)))), first);
  }
}

TEST(PtmFile, CodingErrorIsHalfAStep) {
  const DatasetInfo info = small_info(7, 5, 3, 1, 20);
  const Bytes file = pack(import(export_of(fit("ptm", make_dataset(info, polynomial), {}))));
  EXPECT_LT(worst_error(file, info, polynomial), 4e-3);
}

TEST(PtmFile, LrgbIsMultipliedOut) {
  const std::string head = "PTM_1.1\nPTM_FORMAT_LRGB\n1\n1\n1 1 1 1 1 2\n0 0 0 0 0 10\n";
  Bytes file(head.begin(), head.end());
  for (const int byte : {0, 0, 0, 0, 0, 110, 255, 51, 0}) file.push_back(static_cast<std::uint8_t>(byte));
  const TexturePtr texture = load(pack(import(file)));
  const auto value = values_at(texture.get(), {0, 0, 1}, {0.6, 0, 0.8}, 0, 0);
  EXPECT_NEAR(value[0], 200.0 / 255, 1e-6);
  EXPECT_NEAR(value[1], 40.0 / 255, 1e-6);
  EXPECT_NEAR(value[2], 0, 1e-6);
}

TEST(PtmFile, RefusesWhatItCannotRead) {
  const auto refused = [](const std::string& head, std::size_t bytes) {
    const Result<PtmFile> parsed = parse_ptm_file("x.ptm", foreign_file(head, bytes));
    return parsed ? Status::ok : parsed.error().status;
  };
  EXPECT_EQ(refused(kRgbHead, 3 * 2 * 18 - 1), Status::invalid_file);
  EXPECT_EQ(refused("PTM_2.0\nPTM_FORMAT_RGB\n3\n2\n", 400), Status::invalid_file);
  EXPECT_EQ(refused("PTM_1.2\nPTM_FORMAT_JPEG_RGB\n3\n2\n", 400), Status::unsupported);
  EXPECT_EQ(refused("PTM_1.2\nPTM_FORMAT_RGB\n0\n2\n1 1 1 1 1 1\n0 0 0 0 0 0\n", 400), Status::invalid_file);
  EXPECT_EQ(refused("PTM_1.2\nPTM_FORMAT_RGB\n65536\n65536\n1 1 1 1 1 1\n0 0 0 0 0 0\n", 400),
            Status::invalid_file);
  EXPECT_EQ(refused("PTM_1.2\nPTM_FORMAT_RGB\n3\n2\n1 1 nan 1 1 1\n0 0 0 0 0 0\n", 400),
            Status::invalid_file);
  EXPECT_EQ(refused("PTM_1.2\nPTM_FORMAT_RGB\n3\n2\n1 1 1 1 1 1\n0 0 0.5 0 0 0\n", 400),
            Status::invalid_file);
  EXPECT_EQ(refused("", 0), Status::invalid_file);
}

TEST(PtmFile, SeveralViewsAreNoPtmFile) {
  const DatasetInfo info = small_info(2, 2, 3, 2, 8);
  const Bytes file = pack(fit("ptm", make_dataset(info, polynomial), {}));
  const Result<OpenedFile> opened = open_bytes(file);
  const ByteView view(file);
  const ByteSource source = source_of(view);
  const Result<Bytes> bytes = ptm_export(opened->head, opened->parm, chunk_reader(source, *opened));
  ASSERT_FALSE(bytes);
  EXPECT_EQ(bytes.error().status, Status::bad_argument);
}

}  // namespace
}  // namespace btfc::test
