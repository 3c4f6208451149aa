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

FamilyPoint at(double dial, double quality, bool own = true) {
  return {dial, {quality, 100 + 10 * dial, 7 + 3 * dial}, own};
}

TEST(Tradeoff, BetweenPointsAFamilyIsStraightInTheLogarithmOfItsDial) {
  SettingFamily family;
  family.dial = "rank";
  family.points = telling_points({at(7, 30), at(1, 20), at(3, 25)});
  EXPECT_NEAR(family.at(3).quality, 25, 1e-9);
  EXPECT_NEAR(family.at(15).quality, 35, 1e-9);  // beyond the last
  EXPECT_NEAR(family.at(5).bytes, 150, 1e-9);
  EXPECT_NEAR(family.at(5).operations, 22, 1e-9);
}

TEST(Tradeoff, AFamilyLearnsFromFitsOfTheWhole) {
  SettingFamily family;
  family.dial = "rank";
  family.points = telling_points({at(1, 20), at(3, 25), at(7, 30)});
  family.doubt = -1;
  EXPECT_NEAR(family.at(3).quality, 24, 1e-9);
  family.learn(3, {23, 135, 16});
  EXPECT_NEAR(family.at(3).quality, 23, 1e-9);
  EXPECT_NEAR(family.at(1).quality, 18, 1e-9);  // as much everywhere
  EXPECT_NEAR(family.at(5).bytes, 155, 1e-9);
  family.learn(7, {26, 175, 28});
  EXPECT_NEAR(family.at(3).quality, 23, 1e-9);
  EXPECT_NEAR(family.at(15).quality, 29, 1e-9);  // 3 dB a doubling, where the points have 5
  // A dial as good as the same replaces what it said.
  family.learn(7.2, {25, 180, 28});
  EXPECT_NEAR(family.at(7.2).quality, 25, 1e-9);
  EXPECT_EQ(family.off.size(), 2u);
}

TEST(Tradeoff, PartsOfAFitCountWhereItIsTheOnlyOne) {
  const auto all = telling_points({at(7, 30), at(1, 20, false), at(3, 12, false), at(7, 26, false)});
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[1].is.quality, 12);
  EXPECT_EQ(all[2].is.quality, 30);
  const auto own = telling_points({at(1, 20), at(3, 12, false), at(7, 30)});
  ASSERT_EQ(own.size(), 2u);
  EXPECT_EQ(own[1].dial, 7);
}

TEST(Tradeoff, AModelWithoutADialIsOnePoint) {
  SettingFamily family;
  family.points = {at(0, 31)};
  EXPECT_EQ(family.at(99).quality, 31);
  EXPECT_EQ(family.least_dial(), family.most_dial());
}

}  // namespace
}  // namespace btfc
