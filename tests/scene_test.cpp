// Scenes: what their files may say, which pairs they choose, what a file then covers, and weighted measures.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "encoder/image_reduction.h"
#include "encoder/metrics/dataset_metrics.h"
#include "encoder/scene/scene_pairs.h"
#include "tests/btf_support.h"

namespace btfc::test {
namespace {

Scene scene_of(const std::string& text) {
  const Result<Scene> scene = parse_scene(text, "scene");
  EXPECT_TRUE(scene) << text << ": " << (scene ? "" : scene.error().message);
  return scene ? *scene : Scene();
}

DatasetInfo ring_info(int views, int lights) {
  return btf_info(4, 4, 3, SampleType::unorm8, rings(views), rings(lights));
}

PairChoice chosen(const std::string& text, const DatasetInfo& info) {
  const Result<PairChoice> choice = scene_pairs(scene_of(text), info);
  EXPECT_TRUE(choice) << text;
  return choice ? *choice : PairChoice();
}

DatasetInfo kept(const std::string& text, const DatasetInfo& info) {
  return chosen_info(info, chosen(text, info));
}

TEST(SceneFile, EveryWrongValueIsNamed) {
  const std::pair<const char*, const char*> wrong[] = {
      {"[]", "'scene' is no JSON object"},
      {R"({"view": {}})", "unknown member 'view'"},
      {R"({"views": {"theta": [0, 30], "psi": 1}})", "'scene' views has an unknown member 'psi'"},
      {R"({"views": {}})", "views is empty"},
      {R"({"views": {"theta": [30, 0]}})", "views.theta"},
      {R"({"views": {"theta": [0, 91]}})", "views.theta"},
      {R"({"lights": {"phi": [0, 361]}})", "lights.phi"},
      {R"({"lights": {"phi": [0]}})", "lights.phi"},
      {R"({"lights": {"list": [[0, 0]], "theta": [0, 1]}})", "lights has a 'list' and a range"},
      {R"({"lights": {"list": []}})", "lights.list"},
      {R"({"lights": {"list": [[0, 0], [95, 0]]}})", "lights.list[1]"},
      {R"({"lights": {"list": [{"direction": [0, 0], "weight": 0}]}})",
       "lights.list[0] has a wrong 'weight'"},
      {R"({"lights": {"list": [{"weight": 1}]}})", "lights.list[0]"},
      {R"({"pairs": [{"view": [0, 0]}]})", "pairs[0].light"},
      {R"({"pairs": [{"view": [0, 0], "light": [0, 0]}], "views": {"theta": [0, 1]}})", "expected one way"},
      {R"({"weights": "linear"})", "weights"},
      {R"({"radius": 3})", "lists none"},
      {R"({"tolerance": -1})", "tolerance"},
      {R"({"footprints": [4, 2]})", "footprints"},
      {R"({"region": [0, 0, 0, 4]})", "region"},
      {R"({"region": [0, 0, 1.5, 4]})", "region"},
      {R"({"channels": []})", "channels"},
      {R"({"channels": [-1]})", "channels"},
      {R"({"target": {"psnr": 30, "bytes": 100}})", "target"},
      {R"({"target": {"bytes": 0.5}})", "target"},
  };
  for (const auto& [text, says] : wrong) {
    const Result<Scene> scene = parse_scene(text, "scene");
    ASSERT_FALSE(scene) << text;
    EXPECT_NE(scene.error().message.find(says), std::string::npos) << text << ": " << scene.error().message;
  }
}

TEST(SceneFile, ValuesAreTakenAsTheyStand) {
  const Scene scene = scene_of(
      R"({"views": {"theta": [10, 40], "phi": [350, 10]}, "weights": "cosine", "footprints": [4.5, 9],
          "region": [1, 2, 3, 4], "channels": ["R", 2], "target": {"bytes": 20000}, "tolerance": 3})");
  EXPECT_NEAR(scene.views.range.phi_width, 20 * std::numbers::pi / 180, 1e-6);
  EXPECT_NEAR(scene.views.range.theta_least, 10 * std::numbers::pi / 180, 1e-6);
  EXPECT_EQ(scene.scale_log2(), 2u);
  EXPECT_EQ(scene.region->height, 4u);
  EXPECT_EQ(scene.channels, (std::vector<std::string>{"R", "2"}));
  EXPECT_EQ(scene.target->bytes, 20000u);
  EXPECT_TRUE(scene.cosine && scene.directions());
  EXPECT_FALSE(scene_of("{}").directions());
}

TEST(ScenePairs, RangesKeepWhatLiesInThemAndWhatSpansThem) {
  const DatasetInfo info = ring_info(5, 2);
  // Rings of 1, 6, 12, 18 …; between points of a ring its chord lies a degree inside.
  EXPECT_EQ(kept(R"({"views": {"theta": [0, 30]}})", info).views.size(), 19u);
  // Beyond the ring of 15 degrees that of 30 is needed.
  EXPECT_EQ(kept(R"({"views": {"theta": [0, 20]}})", info).views.size(), 19u);
  EXPECT_EQ(kept(R"({"views": {"theta": [0, 20]}, "tolerance": 10})", info).views.size(), 7u);
  // Between two rings both are.
  EXPECT_EQ(kept(R"({"views": {"theta": [20, 25]}})", info).views.size(), 18u);
  // Over 360 degrees, between two rings: the two triangles that meet in (15, 0).
  const DatasetInfo narrow =
      kept(R"({"views": {"theta": [25, 29], "phi": [340, 20]}, "tolerance": 1})", info);
  EXPECT_EQ(narrow.lights.size(), info.lights.size());
  ASSERT_EQ(narrow.views.size(), 4u);
  EXPECT_TRUE(same_direction(narrow.views[0], direction_from_degrees(15, 0)));
  EXPECT_TRUE(same_direction(narrow.views[3], direction_from_degrees(30, 330)));
  EXPECT_TRUE(narrow.weights.empty());
}

TEST(ScenePairs, ListedDirectionsHandTheirWeightToWhatAnswers) {
  const DatasetInfo info = ring_info(1, 3);
  // Measured ones alone.
  const DatasetInfo exact = kept(R"({"lights": {"list": [[0, 0], [30, 60], [45, 101]]}})", info);
  EXPECT_EQ(exact.lights.size(), 3u);
  EXPECT_TRUE(exact.weights.empty());
  EXPECT_EQ(exact.pairs.size(), 3 * info.views.size());
  // One between: the corners' weights are a decoder's.
  const DatasetInfo between = kept(R"({"lights": {"list": [{"direction": [38, 12], "weight": 5}]}})", info);
  EXPECT_EQ(between.lights.size(), 3u);
  ASSERT_EQ(between.weights.size(), between.pairs.size());
  EXPECT_NEAR(std::accumulate(between.weights.begin(), between.weights.end(), 0.0),
              static_cast<double>(between.pairs.size()), 1e-9);
  double x = 0, y = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Direction& d = between.lights[between.pairs[i].light];
    x += between.weights[i] / 3 * std::tan(d.theta / 2) * std::cos(d.phi);
    y += between.weights[i] / 3 * std::tan(d.theta / 2) * std::sin(d.phi);
  }
  const Direction asked = direction_from_degrees(38, 12);
  EXPECT_NEAR(x, std::tan(asked.theta / 2) * std::cos(asked.phi), 1e-5);
  EXPECT_NEAR(y, std::tan(asked.theta / 2) * std::sin(asked.phi), 1e-5);
  // A cap holds what was measured in it.
  EXPECT_GE(kept(R"({"lights": {"list": [[30, 0]]}, "radius": 16})", info).lights.size(), 4u);
}

TEST(ScenePairs, PairsCountAsOftenAsTheyAreListed) {
  const DatasetInfo info = ring_info(2, 2);
  const PairChoice choice = chosen(
      R"({"pairs": [{"view": [15, 0], "light": [30, 30], "weight": 3}, {"view": [0, 0], "light": [15, 60]}]})",
      info);
  ASSERT_EQ(choice.pairs.size(), 2u);
  EXPECT_NEAR(choice.weights[0], 0.5, 1e-12);
  EXPECT_NEAR(choice.weights[1], 1.5, 1e-12);
  const DatasetInfo part = chosen_info(info, choice);
  EXPECT_EQ(part.views.size(), 2u);
  EXPECT_EQ(part.lights.size(), 2u);
  const PairChoice cosine = chosen(R"({"lights": {"list": [[0, 0], [30, 0]]}, "weights": "cosine"})", info);
  EXPECT_NEAR(cosine.weights[1] / cosine.weights[0], std::cos(30 * std::numbers::pi / 180), 1e-9);
}

TEST(ScenePairs, WhatWasNotMeasuredIsAnsweredByItsNeighbour) {
  DatasetInfo info = ring_info(1, 1);
  // The view along the normal lacks the light at (15, 60): one 15 degrees from it stands for it.
  const auto gone = std::find_if(info.pairs.begin(), info.pairs.end(), [&](const DirectionPair& p) {
    return p.view == 0 && same_direction(info.lights[p.light], direction_from_degrees(15, 60));
  });
  ASSERT_NE(gone, info.pairs.end());
  info.pairs.erase(gone);
  const DatasetInfo part = kept(R"({"lights": {"list": [[15, 60]]}})", info);
  EXPECT_EQ(part.views.size(), info.views.size());
  EXPECT_EQ(part.lights.size(), 2u);
  EXPECT_EQ(part.pairs.size(), info.views.size());
  EXPECT_NEAR(degrees(angle_between(part.lights[part.pairs[0].light], direction_from_degrees(15, 60))), 15,
              0.3);
}

std::array<float, 3> vector_of(double theta, double phi) {
  const Vector3 v = unit_vector(direction_from_degrees(theta, phi));
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

// A file of what a scene keeps of a set, and whether it says so.
Bytes file_in_scene(const std::string& text, bool stated = true) {
  const Scene scene = scene_of(text);
  FitResult result = fit("pca", make_btf(kept(text, ring_info(4, 4)), bumpy), {{"rank", "3"}});
  if (stated) result.chunks.push_back({{kDomn, 0}, write_domain(scene_domain(scene, 8, 16))});
  return pack(result);
}

constexpr const char* kThreeLights =
    R"({"views": {"theta": [0, 30]}, "lights": {"list": [[0, 0], [45, 100], [60, 60]]}, "footprints": [2, 12]})";

TEST(SceneDomain, SaysWhatTheFileWasMadeFor) {
  const Bytes file = file_in_scene(kThreeLights);
  const TexturePtr t = load(file);
  ASSERT_TRUE(t);
  const auto covers = [&](std::array<float, 3> view, std::array<float, 3> light, float footprint) {
    return btfc_covers(t.get(), view.data(), light.data(), footprint);
  };
  EXPECT_EQ(covers(vector_of(0, 0), vector_of(0, 0), 1), BTFC_COVERS_ALL);
  EXPECT_EQ(covers(vector_of(30, 77), vector_of(45, 100), 6), BTFC_COVERS_ALL);
  EXPECT_EQ(covers(vector_of(31.9, 0), vector_of(60, 60), 1), BTFC_COVERS_ALL);  // within the tolerance
  EXPECT_EQ(covers(vector_of(32.1, 0), vector_of(60, 60), 1), BTFC_COVERS_LIGHT | BTFC_COVERS_FOOTPRINT);
  EXPECT_EQ(covers(vector_of(10, 0), vector_of(30, 100), 1), BTFC_COVERS_VIEW | BTFC_COVERS_FOOTPRINT);
  EXPECT_EQ(covers(vector_of(10, 0), vector_of(46.9, 100), 6.5f), BTFC_COVERS_VIEW | BTFC_COVERS_LIGHT);
  EXPECT_EQ(covers({0, 0, -1}, {0, 0, 0}, 0.5f), BTFC_COVERS_VIEW | BTFC_COVERS_LIGHT);
  EXPECT_EQ(covers({1, 0, -1}, {1, 0, -1}, 0.5f), 0u);  // the horizon

  const Texture wrapped = Texture::load(file);
  EXPECT_EQ(wrapped.covers(vector_of(10, 0), vector_of(0, 0)), BTFC_COVERS_ALL);
  const btfc_domain domain = wrapped.domain();
  EXPECT_EQ(domain.stated, 1);
  EXPECT_EQ(domain.views, BTFC_DOMAIN_RANGE);
  EXPECT_EQ(domain.lights, BTFC_DOMAIN_LIST);
  EXPECT_EQ(domain.light_count, 3u);
  EXPECT_FLOAT_EQ(domain.view_range.theta_most, static_cast<float>(std::numbers::pi / 6));
  EXPECT_EQ((std::array{domain.origin_x, domain.origin_y, domain.scale}), (std::array{8u, 16u, 2u}));
  EXPECT_EQ(domain.footprint_least, 1);
  EXPECT_EQ(domain.footprint_most, 6);
  std::array<float, 3> light{};
  ASSERT_EQ(btfc_domain_light(t.get(), 1, light.data()), BTFC_OK);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(light[i], vector_of(45, 100)[i], 1e-6);
}

TEST(SceneDomain, WithoutTheChunkItIsWhatTheDirectionsSpan) {
  const TexturePtr t = load(file_in_scene(R"({"views": {"theta": [0, 30]}})", false));
  ASSERT_TRUE(t);
  btfc_domain domain{};
  ASSERT_EQ(btfc_texture_domain(t.get(), &domain), BTFC_OK);
  EXPECT_EQ(domain.stated, 0);
  const auto light = vector_of(60, 0);
  EXPECT_EQ(btfc_covers(t.get(), vector_of(31.9, 0).data(), light.data(), 1e6f), BTFC_COVERS_ALL);
  EXPECT_EQ(btfc_covers(t.get(), vector_of(35, 0).data(), light.data(), 0),
            BTFC_COVERS_ALL - BTFC_COVERS_VIEW);
  // Half way between two points of the ring the chord lies a degree inside.
  EXPECT_EQ(btfc_covers(t.get(), vector_of(31.5, 15).data(), light.data(), 1),
            BTFC_COVERS_ALL - BTFC_COVERS_VIEW);
  EXPECT_EQ(btfc_covers(t.get(), vector_of(30.5, 15).data(), light.data(), 1), BTFC_COVERS_ALL);
}

TEST(SceneDomain, OfPairsBothTogetherCount) {
  const TexturePtr t = load(file_in_scene(
      R"({"pairs": [{"view": [0, 0], "light": [45, 0]}, {"view": [15, 0], "light": [0, 0]}], "radius": 3})"));
  ASSERT_TRUE(t);
  const auto covers = [&](std::array<float, 3> view, std::array<float, 3> light) {
    return btfc_covers(t.get(), view.data(), light.data(), 1);
  };
  EXPECT_EQ(covers(vector_of(4.9, 50), vector_of(45, 0)), BTFC_COVERS_ALL);
  EXPECT_EQ(covers(vector_of(15, 0), vector_of(0, 0)), BTFC_COVERS_ALL);
  EXPECT_EQ(covers(vector_of(15, 0), vector_of(45, 0)), BTFC_COVERS_VIEW | BTFC_COVERS_FOOTPRINT);
}

TEST(SceneDomain, OutsideTheNearestCoveredDirectionAnswers) {
  const TexturePtr t = load(file_in_scene(kThreeLights));
  ASSERT_TRUE(t);
  const auto value = [&](std::array<float, 3> v) {
    const float view[3] = {v[0], v[1], v[2]}, light[3] = {0, 0, 1};
    return value_at(t.get(), 2, 1, view, light);
  };
  // A point of the border ring, seen from farther out.
  for (const double phi : {0.0, 30.0, 330.0}) {
    const auto border = value(vector_of(30, phi));
    for (const double theta : {40.0, 75.0, 90.0}) {
      const auto outside = value(vector_of(theta, phi));
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(outside[c], border[c], 1e-5);
    }
  }
}

TEST(SceneDomain, BytesAndStructAgree) {
  const Scene scene = scene_of(
      R"({"views": {"theta": [5, 80], "phi": [200, 100]}, "lights": {"list": [[3, 4], [50, 6]]}, "radius": 2})");
  const Domain domain = scene_domain(scene, 7, 9);
  Head head;
  head.width = head.height = 16;
  const Result<Domain> again = read_domain(head, write_domain(domain));
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(*again, domain);
}

TEST(SceneDomain, DistancesToRangesAreThoseOnTheSphere) {
  const float degree = static_cast<float>(std::numbers::pi / 180);
  const DirectionRange range = {10 * degree, 40 * degree, 350 * degree, 20 * degree};
  const auto off = [&](double theta, double phi) {
    return degrees(angle_to_range(range, unit_vector(direction_from_degrees(theta, phi))));
  };
  EXPECT_NEAR(off(20, 5), 0, 1e-5);
  EXPECT_NEAR(off(50, 355), 10, 1e-4);
  EXPECT_NEAR(off(0, 123), 10, 1e-4);
  // To the meridian at 10 degrees: sin of the distance is sin theta sin dphi.
  EXPECT_NEAR(off(30, 20), degrees(std::asin(std::sin(std::numbers::pi / 6) * std::sin(10 * degree))), 1e-4);
}

TEST(ImageReductions, SquaresAreAveragedInLinearLight) {
  Image image;
  image.width = 4;
  image.height = 2;
  image.channels = 2;
  image.codes = {0, 10, 255, 10, 7, 20, 7, 20, 255, 10, 0, 10, 7, 20, 7, 20};
  image.colour_space = ColourSpace::srgb_rec709_scene;
  const Image out = reduced(image, {{}, 1});
  EXPECT_EQ(out.codes, (std::vector<std::uint16_t>{188, 10, 7, 20}));  // half of the light is code 188
  image.colour_space = ColourSpace::data;
  EXPECT_EQ(reduced(image, {{0}, 1}).codes, (std::vector<std::uint16_t>{128, 7}));
  EXPECT_FALSE(check_scale(4, 2, 2, "image"));
  EXPECT_FALSE(channel_numbers(std::vector<std::string>{"2"}, std::vector<std::string>{"R", "G"}));
}

// A set of one pair that is a little off and one that is far off.
TEST(WeightedMeasures, ErrorsCountAsTheirPairs) {
  DatasetInfo info =
      btf_info(2, 2, 1, SampleType::unorm8, rings(0), {Direction{}, direction_from_degrees(40, 0)});
  info.weights = {1.5, 0.5};
  const auto dark = [](const Direction&, const Direction&, std::uint32_t, std::uint32_t, std::uint32_t) {
    return 0.0;
  };
  const auto off = [](const Direction&, const Direction& light, std::uint32_t, std::uint32_t, std::uint32_t) {
    return light.theta == 0 ? 51 / 255.0 : 102 / 255.0;
  };
  const Result<DatasetMetrics> m =
      compare_datasets(make_btf(info, dark), make_btf(info, off), {{false, false, false}, {}});
  ASSERT_TRUE(m);
  EXPECT_NEAR(m->all.rmse_8bit, std::sqrt((1.5 * 51 * 51 + 0.5 * 102 * 102) / 2), 1e-4);
  EXPECT_NEAR(m->all.brdf_rmse_8bit, m->all.rmse_8bit, 1e-4);
  EXPECT_NEAR(m->all.peak_8bit, 102, 1e-4);
}

}  // namespace
}  // namespace btfc::test
