// QUAL: what is written is read, and what is chosen from a curve.
#include "format/quality_curve.h"

#include "tests/test_support.h"

namespace btfc::test {
namespace {

QualityPoint point(Knobs knobs, float psnr, std::uint32_t operations, float rate) {
  QualityPoint p;
  p.knobs = knobs;
  p.psnr_db = psnr;
  p.operations = operations;
  p.rate = rate;
  return p;
}

// Levels of a file, and of all levels one with more culling: as good by cost, faster.
QualityCurve levels_curve() {
  QualityCurve curve;
  curve.measures = kQualityPsnr | kQualityRate | kQualityCost;
  curve.pairs = 9;
  curve.points = {point({}, 40, 900, 0.1f), point({4, 0, 0}, 34, 500, 0.2f), point({2, 0, 0}, 30, 300, 0.3f),
                  point({1, 0, 0}, 21, 200, 0.5f), point({0, 0, 0.01f}, 39, 900, 0.4f)};
  return curve;
}

Knobs chosen(const QualityCurve& curve, const Wanted& wanted) {
  const Result<QualityPoint> p = choose_point(curve, wanted);
  EXPECT_TRUE(p) << p.error().message;
  return p ? p->knobs : Knobs{99, 99, 99};
}

TEST(QualityCurve, WhatIsWrittenIsRead) {
  const QualityCurve curve = levels_curve();
  const Result<QualityCurve> read = read_quality(write_quality(curve), 9);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->measures, curve.measures);
  EXPECT_EQ(read->pairs, 9u);
  ASSERT_EQ(read->points.size(), curve.points.size());
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    EXPECT_EQ(read->points[i].knobs, curve.points[i].knobs);
    EXPECT_EQ(read->points[i].psnr_db, curve.points[i].psnr_db);
    EXPECT_EQ(read->points[i].rate, curve.points[i].rate);
    EXPECT_EQ(read->points[i].operations, curve.points[i].operations);
  }
}

TEST(QualityCurve, AWantedErrorIsHadAtTheLeastCost) {
  const QualityCurve curve = levels_curve();
  EXPECT_EQ(chosen(curve, {30, {}, {}}), (Knobs{2, 0, 0}));
  EXPECT_EQ(chosen(curve, {30.5f, {}, {}}), (Knobs{4, 0, 0}));
  EXPECT_EQ(chosen(curve, {40, {}, {}}), Knobs{});
  // Equal in operations, so the faster one.
  EXPECT_EQ(chosen(curve, {39, {}, {}}), (Knobs{0, 0, 0.01f}));
}

TEST(QualityCurve, AWantedCostIsUsedForTheLeastError) {
  const QualityCurve curve = levels_curve();
  EXPECT_EQ(chosen(curve, {{}, {}, 499}), (Knobs{2, 0, 0}));
  EXPECT_EQ(chosen(curve, {{}, {}, 500}), (Knobs{4, 0, 0}));
  EXPECT_EQ(chosen(curve, {{}, {}, 100000}), Knobs{});
  EXPECT_EQ(chosen(curve, {29, {}, 499}), (Knobs{2, 0, 0}));
}

TEST(QualityCurve, WhatCannotBeHadIsSaidWithTheNearest) {
  const QualityCurve curve = levels_curve();
  const auto says = [&](const Wanted& wanted, const char* text) {
    const Result<QualityPoint> p = choose_point(curve, wanted);
    ASSERT_FALSE(p);
    EXPECT_NE(p.error().message.find(text), std::string::npos) << p.error().message;
  };
  says({41, {}, {}}, "40.00");
  says({{}, {}, 199}, "200");
  says({35, {}, 600}, "600");
  says({{}, 0.1f, {}}, "no distance");
  says({}, "nothing is wanted");
}

// A file that speaks of two settings.
Bytes file_with_curve() {
  FitResult result =
      fit("patch", noise(12, 10, 3, SampleType::unorm8), {{"wb", "8"}, {"we", "3"}, {"k", "3"}});
  QualityCurve curve;
  curve.measures = kQualityDistance | kQualityCost;
  curve.points.resize(2);
  curve.points[0].distance = 0.5f;
  curve.points[0].operations = 40;
  curve.points[1].knobs.levels = 1;
  curve.points[1].distance = 0.9f;
  curve.points[1].operations = 20;
  result.chunks.push_back({{kQual, 0}, write_quality(curve)});
  return pack(result);
}

TEST(QualityCurve, TheLibraryChoosesASelection) {
  const Bytes file = file_with_curve();
  btfc_reader* reader = nullptr;
  ASSERT_EQ(btfc_reader_open_memory(file.data(), file.size(), nullptr, &reader, nullptr), BTFC_OK);
  btfc_quality_info info{};
  btfc_quality_point points[2] = {};
  ASSERT_EQ(btfc_reader_quality(reader, &info, points, 2, nullptr), BTFC_OK);
  EXPECT_EQ(info.points, 2u);
  EXPECT_EQ(info.measures, BTFC_QUALITY_DISTANCE | BTFC_QUALITY_COST);
  EXPECT_EQ(points[1].levels, 1u);

  btfc_wanted wanted{};
  wanted.struct_size = sizeof wanted;
  wanted.operations = 30;
  btfc_selection selection{};
  selection.struct_size = sizeof selection;
  selection.period = 7;
  btfc_error error{};
  ASSERT_EQ(btfc_choose(reader, &wanted, &selection, points, &error), BTFC_OK) << error.message;
  EXPECT_EQ(selection.levels, 1u);
  EXPECT_EQ(selection.period, 7u);
  EXPECT_EQ(points[0].operations, 20u);
  wanted.operations = 10;
  EXPECT_EQ(btfc_choose(reader, &wanted, &selection, nullptr, &error), BTFC_BAD_ARGUMENT);
  EXPECT_NE(std::string(error.message).find("20"), std::string::npos) << error.message;
  btfc_reader_free(reader);
}

TEST(QualityCurve, AFileWithoutOneHasNoPoints) {
  const Bytes file =
      pack(fit("patch", noise(12, 10, 3, SampleType::unorm8), {{"wb", "8"}, {"we", "3"}, {"k", "3"}}));
  btfc_reader* reader = nullptr;
  ASSERT_EQ(btfc_reader_open_memory(file.data(), file.size(), nullptr, &reader, nullptr), BTFC_OK);
  btfc_quality_info info{1, 1, 1};
  EXPECT_EQ(btfc_reader_quality(reader, &info, nullptr, 0, nullptr), BTFC_OK);
  EXPECT_EQ(info.points, 0u);
  btfc_reader_free(reader);
}

}  // namespace
}  // namespace btfc::test
