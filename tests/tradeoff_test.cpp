// What a trade-off reckons with: fronts, and what is expected of settings between those that were measured.
#include <gtest/gtest.h>

#include "tools/pareto.h"
#include "tools/setting_family.h"

namespace btfc {
namespace {

TEST(Tradeoff, TheFrontIsWhatNoOtherPointBeats) {
  using Points = std::vector<std::optional<ParetoPoint>>;
  const Points points = {ParetoPoint{2, 5}, ParetoPoint{1, 9}, std::nullopt, ParetoPoint{3, 6},
                         ParetoPoint{4, 1}};
  EXPECT_EQ(pareto_front(points), (std::vector<std::size_t>{1, 0, 4}));
  // Equal points and equal coordinates: the first, and the better.
  EXPECT_EQ(pareto_front(Points{ParetoPoint{1, 1}, ParetoPoint{1, 1}, ParetoPoint{1, 0}}),
            (std::vector<std::size_t>{2}));
  EXPECT_EQ(pareto_front(Points{ParetoPoint{2, 2}, ParetoPoint{2, 2}}), (std::vector<std::size_t>{0}));
  EXPECT_TRUE(pareto_front(Points{std::nullopt}).empty());
}

FamilyPoint at(double dial, double quality) { return {dial, {quality, 100 + 10 * dial, 7 + 3 * dial}}; }

TEST(Tradeoff, BetweenPointsAFamilyIsStraightInTheLogarithmOfItsDial) {
  SettingFamily family;
  family.dial = "rank";
  family.points = best_points({at(7, 30), at(1, 20), at(3, 25)});
  EXPECT_NEAR(family.at(3).quality, 25, 1e-9);
  EXPECT_NEAR(family.at(15).quality, 35, 1e-9);  // beyond the last
  EXPECT_NEAR(family.at(5).bytes, 150, 1e-9);
  EXPECT_NEAR(family.at(5).operations, 22, 1e-9);
  family.quality_off = -2;
  family.bytes_off = 5;
  EXPECT_NEAR(family.at(3).quality, 23, 1e-9);
  EXPECT_NEAR(family.at(5).bytes, 155, 1e-9);
}

TEST(Tradeoff, PointsThatAFitOfTheirOwnWouldBeatDoNotCount) {
  const auto hull = best_points({at(1, 20), at(3, 12), at(7, 30), at(7, 26)});
  ASSERT_EQ(hull.size(), 2u);
  EXPECT_EQ(hull[0].dial, 1);
  EXPECT_EQ(hull[1].is.quality, 30);
}

TEST(Tradeoff, AModelWithoutADialIsOnePoint) {
  SettingFamily family;
  family.points = {at(0, 31)};
  EXPECT_EQ(family.at(99).quality, 31);
  EXPECT_EQ(family.least_dial(), family.most_dial());
}

}  // namespace
}  // namespace btfc
