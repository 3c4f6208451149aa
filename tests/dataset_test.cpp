// Data sets: samples by image and by texel, what is refused, and directions.
#include "encoder/dataset/dataset.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace btfc::test {
namespace {

DatasetInfo info_of(std::uint32_t width, std::uint32_t height, std::size_t channels, SampleType type) {
  DatasetInfo info;
  info.width = width;
  info.height = height;
  for (std::size_t c = 0; c < channels; ++c) info.channels.push_back(std::to_string(c));
  info.type = type;
  info.views = {direction_from_degrees(0, 0), direction_from_degrees(45, 90)};
  info.lights = {direction_from_degrees(0, 0), direction_from_degrees(15, 0), direction_from_degrees(15, 60)};
  make_full_product(info);
  return info;
}

std::uint16_t expected(std::size_t pair, std::size_t sample, SampleType type) {
  const std::size_t v = pair * 7919 + sample * 31 + 5;
  return static_cast<std::uint16_t>(type == SampleType::unorm8 ? v % 256 : v % 65536);
}

TEST(DatasetSamples, AreTheSameByImageByTexelAndOneByOne) {
  struct Form {
    std::uint32_t width, height;
    std::size_t channels;
    SampleType type;
  };
  // Several rows a band, one row a band, rows that leave a shorter last band, more than a page a row.
  for (const Form& form : {Form{1, 1, 1, SampleType::unorm8}, Form{64, 50, 3, SampleType::unorm8},
                           Form{37, 23, 5, SampleType::float16}, Form{1500, 3, 3, SampleType::unorm16}}) {
    Result<Dataset> dataset = Dataset::create(info_of(form.width, form.height, form.channels, form.type), "");
    ASSERT_TRUE(dataset) << dataset.error().message;
    const std::size_t pairs = 6, samples = dataset->info().image_samples();
    std::vector<std::uint16_t> codes(samples);
    for (const std::size_t pair : {4u, 0u, 5u, 1u, 3u, 2u}) {
      for (std::size_t s = 0; s < samples; ++s) codes[s] = expected(pair, s, form.type);
      dataset->write_image(pair, codes);
    }
    for (std::size_t pair = 0; pair < pairs; ++pair) {
      dataset->read_image(pair, codes);
      for (std::size_t s = 0; s < samples; ++s) ASSERT_EQ(codes[s], expected(pair, s, form.type));
      EXPECT_EQ(dataset->image(pair).codes, codes);
    }
    const std::uint32_t x = form.width / 3, count = form.width - x;
    std::vector<std::uint16_t> texels(count * pairs * form.channels);
    for (std::uint32_t y = 0; y < form.height; ++y) {
      dataset->read_texels(x, y, count, texels);
      for (std::uint32_t t = 0; t < count; ++t) {
        for (std::size_t pair = 0; pair < pairs; ++pair) {
          for (std::uint32_t c = 0; c < form.channels; ++c) {
            const std::size_t sample = (std::size_t{y} * form.width + x + t) * form.channels + c;
            ASSERT_EQ(texels[(t * pairs + pair) * form.channels + c], expected(pair, sample, form.type));
            ASSERT_EQ(dataset->code(pair, x + t, y, c), expected(pair, sample, form.type));
          }
        }
      }
    }
  }
}

TEST(DatasetSamples, AreZeroBeforeTheyAreWritten) {
  const Result<Dataset> dataset = Dataset::create(info_of(9, 7, 3, SampleType::float16), "");
  ASSERT_TRUE(dataset);
  EXPECT_EQ(dataset->image(5).codes, std::vector<std::uint16_t>(9 * 7 * 3));
  EXPECT_EQ(dataset->scratch_bytes(), 9u * 7 * 3 * 2 * 6);
}

TEST(DatasetForm, IsChecked) {
  const DatasetInfo good = info_of(4, 4, 3, SampleType::unorm8);
  const auto refused = [&](const char* part, auto change) {
    DatasetInfo info = good;
    change(info);
    const Result<Dataset> dataset = Dataset::create(info, "");
    ASSERT_FALSE(dataset) << part;
    EXPECT_NE(dataset.error().message.find(part), std::string::npos) << dataset.error().message;
  };
  refused("0x4", [](DatasetInfo& i) { i.width = 0; });
  refused("65537", [](DatasetInfo& i) { i.height = 65537; });
  refused("channels", [](DatasetInfo& i) { i.channels.clear(); });
  refused("257 channels", [](DatasetInfo& i) { i.channels.resize(257); });
  refused("images", [](DatasetInfo& i) { i.pairs.clear(); });
  refused("light 3", [](DatasetInfo& i) { i.pairs.back() = {1, 3}; });
  refused("twice", [](DatasetInfo& i) { i.pairs[1] = i.pairs[0]; });
  refused("out of order", [](DatasetInfo& i) { std::swap(i.pairs[0], i.pairs[5]); });
  refused("below the surface", [](DatasetInfo& i) { i.lights[1].theta = 1.6; });
  const Result<Dataset> nowhere = Dataset::create(good, "/nowhere/at/all");
  ASSERT_FALSE(nowhere);
  EXPECT_EQ(nowhere.error().status, Status::io);
}

TEST(Directions, TurnsAndVectors) {
  EXPECT_EQ(direction_from_degrees(30, 360).phi, 0);
  EXPECT_NEAR(degrees(direction_from_degrees(30, -180).phi), 180, 1e-12);
  for (const Direction& d : ubo2014_directions()) {
    EXPECT_TRUE(same_direction(d, direction_from_vector(unit_vector(d)))) << to_text(d);
  }
  EXPECT_FALSE(same_direction(direction_from_degrees(30, 10), direction_from_degrees(30, 10.1)));
  EXPECT_TRUE(same_direction(direction_from_degrees(0, 10), direction_from_degrees(0, 200)));
}

// The published lists, where they are: index theta phi x y z a line.
TEST(Directions, AreThePublishedOnes) {
  const char* named = std::getenv("BTFC_DATA");
  const std::filesystem::path folder =
      std::filesystem::path(named != nullptr ? named : BTFC_SPEC "/../../shared/data") / "directions";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no lists: " << folder << " does not exist";
  for (const auto& [name, mine] : {std::pair("ubo2003_81.txt", ubo2003_directions()),
                                   std::pair("ubo2014_151.txt", ubo2014_directions())}) {
    std::ifstream file(folder / name);
    std::size_t index = 0;
    for (std::string line; std::getline(file, line);) {
      if (line.empty() || line[0] == '#') continue;
      std::istringstream fields(line);
      std::size_t number = 0;
      double theta = 0, phi = 0;
      fields >> number >> theta >> phi;
      ASSERT_EQ(number, index);
      ASSERT_LT(index, mine.size());
      EXPECT_TRUE(same_direction(mine[index], direction_from_degrees(theta, phi))) << name << ' ' << line;
      ++index;
    }
    EXPECT_EQ(index, mine.size());
  }
}

}  // namespace
}  // namespace btfc::test
