// Directories of images as data sets: names, light lists, fits, descriptions; and writing them.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <set>
#include <stdexcept>

#include "encoder/image_file.h"
#include "encoder/input/dataset_read.h"
#include "encoder/input/directory_files.h"
#include "encoder/input/ubo2003_name.h"
#include "encoder/input/ubo2003_read.h"
#include "encoder/input/wavelengths.h"
#include "encoder/output/atomic_file.h"
#include "encoder/output/ubo2003_write.h"
#include "shaders/btfc_half.h"
#include "tests/test_support.h"

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/lsan_interface.h>
#endif

namespace btfc::test {
namespace {

namespace fs = std::filesystem;

// A grey JPEG of 8x8 texels.
constexpr std::uint8_t kJpeg[] = {
    0xff, 0xd8, 0xff, 0xe0, 0x00, 0x10, 0x4a, 0x46, 0x49, 0x46, 0x00, 0x01, 0x01, 0x00, 0x00, 0x01, 0x00,
    0x01, 0x00, 0x00, 0xff, 0xdb, 0x00, 0x43, 0x00, 0x1b, 0x12, 0x14, 0x17, 0x14, 0x11, 0x1b, 0x17, 0x16,
    0x17, 0x1e, 0x1c, 0x1b, 0x20, 0x28, 0x42, 0x2b, 0x28, 0x25, 0x25, 0x28, 0x51, 0x3a, 0x3d, 0x30, 0x42,
    0x60, 0x55, 0x65, 0x64, 0x5f, 0x55, 0x5d, 0x5b, 0x6a, 0x78, 0x99, 0x81, 0x6a, 0x71, 0x90, 0x73, 0x5b,
    0x5d, 0x85, 0xb5, 0x86, 0x90, 0x9e, 0xa3, 0xab, 0xad, 0xab, 0x67, 0x80, 0xbc, 0xc9, 0xba, 0xa6, 0xc7,
    0x99, 0xa8, 0xab, 0xa4, 0xff, 0xc0, 0x00, 0x0b, 0x08, 0x00, 0x08, 0x00, 0x08, 0x01, 0x01, 0x11, 0x00,
    0xff, 0xc4, 0x00, 0x14, 0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0xff, 0xc4, 0x00, 0x1d, 0x10, 0x00, 0x02, 0x02, 0x01, 0x05, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x02, 0x11, 0x01, 0x03, 0x04, 0x00, 0x05, 0x21,
    0x22, 0x61, 0xff, 0xda, 0x00, 0x08, 0x01, 0x01, 0x00, 0x00, 0x3f, 0x00, 0x62, 0xc0, 0x6d, 0xd8, 0x53,
    0x79, 0x0b, 0x29, 0xeb, 0x5c, 0x26, 0xc9, 0x70, 0xfc, 0xd7, 0xff, 0xd9};

std::uint16_t half(double value) {
  return static_cast<std::uint16_t>(btfc_float_to_half(static_cast<float>(value)));
}

class DatasetImages : public ::testing::Test {
 protected:
  void SetUp() override {
    // In memory where that is possible: hundreds of small files, and each written one is synced.
    std::error_code none;
    const fs::path place = fs::is_directory("/dev/shm", none) ? "/dev/shm" : fs::temp_directory_path();
    std::string pattern = (place / "btfc-images-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    root_ = pattern;
  }
  void TearDown() override { fs::remove_all(root_); }

  std::string path(const std::string& name) const { return (root_ / name).string(); }

  void put(const std::string& name, const Bytes& bytes) const {
    fs::create_directories((root_ / name).parent_path());
    std::ofstream file(path(name), std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  void put(const std::string& name, const std::string& text) const {
    put(name, Bytes(text.begin(), text.end()));
  }
  void put(const std::string& name, const Image& image, const std::vector<std::string>& channels = {}) const {
    fs::create_directories((root_ / name).parent_path());
    const auto written = write_image(path(name), image, channels);
    ASSERT_TRUE(written) << written.error().message;
  }

  Result<DatasetRead> read(const std::string& name = "", DatasetReadOptions options = {}) const {
    options.scratch_directory = fs::temp_directory_path().string();
    return read_dataset(path(name), options);
  }
  DatasetRead good(const std::string& name = "", DatasetReadOptions options = {}) const {
    Result<DatasetRead> result = read(name, std::move(options));
    if (!result) throw std::runtime_error(result.error().message);  // fails the test with the message
    return std::move(*result);
  }
  // The message holds all these words.
  void expect_refused(const std::vector<std::string>& words, const std::string& name = "",
                      DatasetReadOptions options = {}) const {
    const Result<DatasetRead> result = read(name, std::move(options));
    ASSERT_FALSE(result) << "expected an error with '" << words[0] << "'";
    for (const std::string& word : words) {
      EXPECT_NE(result.error().message.find(word), std::string::npos)
          << word << " in " << result.error().message;
    }
  }

  fs::path root_;
};

Image grey(std::uint16_t code) { return constant(1, 1, 1, SampleType::unorm8, code); }

DatasetReadOptions skipping() {
  DatasetReadOptions options;
  options.skip_missing = true;
  return options;
}

// --- names ---

TEST(Ubo2003Name, IsReadInAllItsSpellings) {
  const auto expect = [](const char* name, double tl, double pl, double tv, double pv) {
    const auto angles = ubo2003_angles(name);
    ASSERT_TRUE(angles) << name;
    EXPECT_EQ(angles->light_theta, tl) << name;
    EXPECT_EQ(angles->light_phi, pl) << name;
    EXPECT_EQ(angles->view_theta, tv) << name;
    EXPECT_EQ(angles->view_phi, pv) << name;
  };
  expect("00083 tl015 pl060 tv030 pv345", 15, 60, 30, 345);
  expect("tl015_pl060_tv030_pv345", 15, 60, 30, 345);
  expect("wool_tv30_pv345_tl15_pl60", 30 - 15, 60, 30, 345);
  expect("TL15PL60TV30PV345", 15, 60, 30, 345);
  expect("tl_15 pl 60 tv_ 30 pv345 final", 15, 60, 30, 345);
  expect("tl23.5 pl-60 tv007.692308 pv+7.5", 23.5, -60, 7.692308, 7.5);
  expect("tl15-pl60-tv30-pv345", 15, 60, 30, 345);
  expect("bottl1 tl15 pl60 tv30 pv345", 15, 60, 30, 345);
  for (const char* name : {"", "tl015 pl060 tv030", "tl015 pl060 tv030 pvx", "tl1 tl1 pl060 tv030 pv0",
                           "atl015 pl060 tv030 pv0", "tl pl tv pv", "tl9999999999 pl0 tv0 pv0"}) {
    EXPECT_FALSE(ubo2003_angles(name)) << name;
  }
  EXPECT_TRUE(is_utia_name("tl015_pl060_tv030_pv345"));
  EXPECT_FALSE(is_utia_name("00001 tl015 pl060 tv030 pv345"));
  EXPECT_FALSE(is_utia_name("tv015_pv060_tl030_pl345"));
}

TEST(Ubo2003Name, AnglesAreAsShortAsTheyCanBe) {
  EXPECT_EQ(ubo2003_angle_text(0), "000");
  EXPECT_EQ(ubo2003_angle_text(15), "015");
  EXPECT_EQ(ubo2003_angle_text(23.5), "023.5");
  EXPECT_EQ(ubo2003_angle_text(345), "345");
  EXPECT_EQ(ubo2003_angle_text(100.0 / 13), "007.692308");
  EXPECT_EQ(ubo2003_angle_text(22.5 * (1 + 1e-15)), "022.5");
}

TEST(Wavelengths, AreReadFromNames) {
  const auto of = [](std::vector<std::string> names) { return wavelengths_of(names); };
  EXPECT_EQ(of({"550", "400.5"}), (std::vector<double>{550, 400.5}));
  EXPECT_EQ(of({"w550nm", "w400 NM"}), (std::vector<double>{550, 400}));
  EXPECT_EQ(of({"S0.550,500nm", "S0.600,000nm"}), (std::vector<double>{550.5, 600}));
  EXPECT_EQ(of({"S0.550nm"}), (std::vector<double>{550}));
  EXPECT_TRUE(of({"R", "G", "B"}).empty());
  EXPECT_TRUE(of({"550", "A"}).empty());
  EXPECT_TRUE(of({"S0.550nm", "S1.550nm"}).empty());
  EXPECT_TRUE(of({"channel4", "channel5"}).empty());
  EXPECT_TRUE(of({"nm", "", "99", "1e3"}).empty());
  EXPECT_TRUE(of({}).empty());
}

TEST(DirectoryFiles, NaturalOrderComparesNumbers) {
  std::vector<std::string> names = {"x10", "x2", "x", "x02", "x1y", "y1", "x1"};
  std::sort(names.begin(), names.end(), natural_less);
  EXPECT_EQ(names, (std::vector<std::string>{"x", "x1", "x1y", "x02", "x2", "x10", "y1"}));
}

// --- UBO2003 ---

TEST_F(DatasetImages, OneViewOneLightOneTexel) {
  put("00000 tl000 pl000 tv000 pv000.png", grey(77));
  const DatasetRead set = good();
  EXPECT_EQ(set.kind, "ubo2003");
  EXPECT_TRUE(is_dataset(path("")));
  const DatasetInfo& info = set.dataset.info();
  EXPECT_EQ(info.width, 1u);
  EXPECT_EQ(info.height, 1u);
  EXPECT_EQ(info.channels.size(), 1u);
  EXPECT_EQ(info.views, std::vector<Direction>{Direction{}});
  EXPECT_EQ(info.lights, std::vector<Direction>{Direction{}});
  EXPECT_EQ(info.pairs, (std::vector<DirectionPair>{{0, 0}}));
  EXPECT_EQ(set.dataset.code(0, 0, 0, 0), 77);
  EXPECT_TRUE(set.notes.empty());
}

TEST_F(DatasetImages, TheGridOf81ComesInThePublishedOrder) {
  const std::vector<Direction> grid = ubo2003_directions();
  put("one.png", grey(1));
  for (const Direction& d : grid) {
    const auto named = [&](const char* way) {
      return fmt::format("t{0}{1:03.0f} p{0}{2:03.0f}", way, degrees(d.theta), degrees(d.phi));
    };
    fs::create_directories(root_ / "views");
    fs::create_directories(root_ / "lights");
    fs::copy_file(path("one.png"), root_ / "views" / ("tl000 pl000 " + named("v") + ".png"));
    fs::copy_file(path("one.png"), root_ / "lights" / (named("l") + " tv000 pv000.png"));
  }
  EXPECT_EQ(good("views").dataset.info().views, grid);
  EXPECT_EQ(good("lights").dataset.info().lights, grid);
}

TEST_F(DatasetImages, AllSpellingsOfADirectionAreOne) {
  put("a/b/tl015_pl-60_tv000_pv000.png", grey(1));      // phi 300
  put("a/00002 TL015 PL660 TV000 PV090.PNG", grey(2));  // the same, and theta 0
  put("tv30 pv360 tl15 pl300.png", grey(3));
  put("notes.md", std::string("no image"));
  put("photo.png", grey(9));
  expect_refused({"00002 TL015", "tl015_pl-60", "(15, 300)"});
  fs::remove(root_ / "a/00002 TL015 PL660 TV000 PV090.PNG");
  const DatasetRead set = good();
  EXPECT_EQ(set.dataset.info().views, (std::vector<Direction>{Direction{}, direction_from_degrees(30, 0)}));
  EXPECT_EQ(set.dataset.info().lights, (std::vector<Direction>{direction_from_degrees(15, 300)}));
  EXPECT_EQ(set.dataset.code(0, 0, 0, 0), 1);
  EXPECT_EQ(set.dataset.code(1, 0, 0, 0), 3);
  ASSERT_EQ(set.notes.size(), 1u);
  EXPECT_NE(set.notes[0].find("2 files"), std::string::npos) << set.notes[0];
}

TEST_F(DatasetImages, RepeatedPairsAreRefusedWithBothFiles) {
  const std::vector<std::pair<std::string, std::string>> twins = {
      {"x/tl010 pl000 tv000 pv000.png", "y/tl010 pl000 tv000 pv000.png"},
      {"tl010 pl000 tv000 pv000.png", "tl010 pl360 tv000 pv000.png"},
      {"tl010 pl180 tv000 pv000.png", "tl010 pl-180 tv000 pv000.png"},
      {"tl010 pl000 tv000 pv000.png", "tl010 pl000 tv000 pv075.png"},
      {"tl010 pl000 tv000 pv000.png", "tl-10 pl180 tv000 pv000.png"},
      {"tl000 pl010 tv045 pv000.png", "tl000 pl020 tv045 pv000.png"},
  };
  for (const auto& [a, b] : twins) {
    put("t/" + a, grey(1));
    put("t/" + b, grey(2));
    expect_refused({a, b, "both"}, "t");
    fs::remove_all(root_ / "t");
  }
}

TEST_F(DatasetImages, MissingPairsAreCountedOrSkipped) {
  for (const char* name : {"tl000 pl000 tv000 pv000.png", "tl030 pl090 tv000 pv000.png",
                           "tl000 pl000 tv015 pv060.png", "tl060 pl000 tv015 pv060.png"}) {
    put(name, grey(static_cast<std::uint16_t>(name[2])));
  }
  expect_refused({"2 of 6 images are missing", "view (0, 0) light (60, 0), view (15, 60) light (30, 90)"});
  const DatasetRead set = good("", skipping());
  EXPECT_EQ(set.dataset.info().pairs, (std::vector<DirectionPair>{{0, 0}, {0, 1}, {1, 0}, {1, 2}}));
  EXPECT_FALSE(set.dataset.info().full_product());
  ASSERT_EQ(set.notes.size(), 1u);
  EXPECT_NE(set.notes[0].find("2 of 6"), std::string::npos);
}

TEST_F(DatasetImages, ImagesThatDifferAreNamed) {
  const std::string first = "tl000 pl000 tv000 pv000.png", second = "tl015 pl000 tv000 pv000";
  put(first, constant(2, 2, 3, SampleType::unorm8, 5));
  const std::vector<std::pair<std::string, Image>> others = {
      {"2x3 texels", constant(2, 3, 3, SampleType::unorm8, 5)},
      {"unorm16", constant(2, 2, 3, SampleType::unorm16, 5)},
      {"1 unorm8 channels", constant(2, 2, 1, SampleType::unorm8, 5)},
  };
  for (const auto& [word, image] : others) {
    put(second + ".png", image);
    expect_refused({second, first, word, "alike"});
  }
  fs::remove(root_ / (second + ".png"));
  put(second + ".exr", constant(2, 2, 3, SampleType::float16, 0x3c00));
  expect_refused({second + ".exr", first, "float16"});
}

TEST_F(DatasetImages, SixteenBitsAndHalvesKeepTheirCodes) {
  const Image wide = noise(3, 2, 3, SampleType::unorm16, 3), halves = noise(3, 2, 3, SampleType::float16, 4);
  put("w/tl000 pl000 tv000 pv000.png", wide);
  put("h/00000 tl000 pl000 tv000 pv000.exr", halves);
  const DatasetRead w = good("w"), h = good("h");
  EXPECT_EQ(w.dataset.info().type, SampleType::unorm16);
  EXPECT_EQ(w.dataset.info().colour_space, ColourSpace::srgb_rec709_scene);
  EXPECT_EQ(w.dataset.image(0).codes, wide.codes);
  EXPECT_EQ(h.dataset.info().type, SampleType::float16);
  EXPECT_EQ(h.dataset.info().colour_space, ColourSpace::lin_rec709_scene);
  EXPECT_EQ(h.dataset.image(0).codes, halves.codes);
}

TEST_F(DatasetImages, ANanIsNamedWithFileTexelAndChannel) {
  Image image = constant(4, 3, 3, SampleType::float16, 0x3c00);
  put("tl000 pl000 tv000 pv000.exr", image);
  image.at(2, 1, 1) = 0x7e00;
  put("tl015 pl000 tv000 pv000.exr", image);
  expect_refused({"tl015 pl000 tv000 pv000.exr", "nan", "(2, 1)", "channel 1"});
}

TEST_F(DatasetImages, DamagedImagesAreNamed) {
  const std::string good_name = "tl000 pl000 tv000 pv000.jpg", bad_name = "tl015 pl000 tv000 pv000.jpg";
  const Bytes jpeg(std::begin(kJpeg), std::end(kJpeg));
  put(good_name, jpeg);
  put(bad_name, jpeg);
  EXPECT_EQ(good().dataset.info().pairs.size(), 2u);
  for (std::size_t size = 0; size < jpeg.size(); size += size + 12 < jpeg.size() ? 11 : 1) {
    put(bad_name, Bytes(jpeg.begin(), jpeg.begin() + static_cast<std::ptrdiff_t>(size)));
    expect_refused({bad_name});
  }
  put(bad_name, std::string("no JPEG at all"));
  expect_refused({bad_name});
  fs::remove(root_ / bad_name);
  put("whole.png", noise(20, 20, 3, SampleType::unorm8));
  const Bytes png = *read_file(path("whole.png"));
  put("png/tl000 pl000 tv000 pv000.png",
      Bytes(png.begin(), png.begin() + static_cast<std::ptrdiff_t>(png.size() / 2)));
#ifdef __SANITIZE_ADDRESS__
  // libpng's long jump leaves a string of OpenImageIO's behind.
  const __lsan::ScopedDisabler libraries;
#endif
  expect_refused({"tl000 pl000 tv000 pv000.png"}, "png");
}

TEST_F(DatasetImages, DirectoriesWithoutImagesAreNoDataSets) {
  EXPECT_FALSE(is_dataset(path("")));
  EXPECT_FALSE(is_dataset(path("nowhere")));
  put("a.png", grey(1));
  EXPECT_FALSE(is_dataset(path("")));
  EXPECT_FALSE(is_dataset(path("a.png")));
  expect_refused({"no data set of a known kind"});
  const Result<DatasetRead> direct = read_ubo2003(path(""), {});
  ASSERT_FALSE(direct);
  EXPECT_NE(direct.error().message.find("no image whose name says"), std::string::npos);
  fs::create_directories(root_ / "tl000 pl000 tv000 pv000.png");  // a folder with an image's name
  EXPECT_FALSE(is_dataset(path("")));
}

TEST_F(DatasetImages, LoopsOfLinksEndAndBadThetasAreRefused) {
  put("a/tl000 pl000 tv000 pv000.png", grey(1));
  fs::create_directory_symlink(root_, root_ / "a/loop");
  fs::create_directory_symlink(root_ / "a", root_ / "b");
  EXPECT_EQ(good().dataset.info().pairs.size(), 1u);
  put("a/tl095 pl000 tv000 pv000.png", grey(1));
  expect_refused({"tl095", "95"});
}

TEST_F(DatasetImages, CropKeepsTheAskedTexels) {
  const Image image = noise(7, 5, 3, SampleType::unorm8);
  put("tl000 pl000 tv000 pv000.png", image);
  DatasetReadOptions options;
  options.crop = Rectangle{2, 1, 4, 3};
  EXPECT_EQ(good("", options).dataset.image(0).codes, crop(image, 2, 1, 4, 3).codes);
  for (const Rectangle& wrong :
       {Rectangle{4, 1, 4, 3}, Rectangle{0, 0, 0, 1}, Rectangle{0xffffffffu, 0, 2, 1}}) {
    options.crop = wrong;
    expect_refused({"crop", "tl000", "7x5"}, "", options);
  }
}

TEST_F(DatasetImages, UtiaXyzBecomesRec709) {
  // The white point, and Rec. 709's red: x 0.64, y 0.33, Y 0.2126.
  Image image = constant(2, 1, 3, SampleType::float16, 0);
  const double xyz[2][3] = {{0.95046, 1, 1.08906}, {0.41239, 0.21264, 0.01933}};
  const double rgb[2][3] = {{1, 1, 1}, {1, 0, 0}};
  for (std::uint32_t x = 0; x < 2; ++x) {
    for (std::uint32_t c = 0; c < 3; ++c) image.at(x, 0, c) = half(xyz[x][c]);
  }
  put("u/tv000_pv000/tl000_pl000_tv000_pv000.exr", image);
  put("x/00000 tl000 pl000 tv000 pv000.exr", image, {"X", "Y", "Z"});
  put("r/00000 tl000 pl000 tv000 pv000.exr", image);
  for (const char* name : {"u", "x"}) {
    const DatasetRead set = good(name);
    EXPECT_EQ(set.dataset.info().colour_space, ColourSpace::lin_rec709_scene);
    EXPECT_EQ(set.dataset.info().channels, (std::vector<std::string>{"R", "G", "B"}));
    ASSERT_EQ(set.notes.size(), 1u);
    for (std::uint32_t x = 0; x < 2; ++x) {
      for (std::uint32_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(code_value(SampleType::float16, set.dataset.code(0, x, 0, c)), rgb[x][c], 2e-3);
      }
    }
  }
  EXPECT_EQ(good("r").dataset.image(0).codes, image.codes);
  for (std::uint32_t c = 0; c < 3; ++c) image.at(1, 0, c) = half(c == 0 ? 60000 : 0);
  put("u/tv000_pv000/tl000_pl000_tv000_pv000.exr", image);
  expect_refused({"tl000_pl000_tv000_pv000.exr", "(1, 0)"}, "u");
}

TEST_F(DatasetImages, SpectralChannelsAreSortedByWavelength) {
  Image image = constant(2, 2, 5, SampleType::float16, 0);
  for (std::size_t i = 0; i < image.codes.size(); ++i) image.codes[i] = half(static_cast<double>(i % 5));
  put("tv000_pv000_tl000_pl000.exr", image, {"400", "1000.5", "500", "450.25", "90000"});
  EXPECT_EQ(good().dataset.info().channels.size(), 5u);  // 90000 is none: names as they are
  put("tv000_pv000_tl000_pl000.exr", image, {"400nm", "1000.5nm", "500nm", "450.25nm", "410nm"});
  const DatasetRead set = good();
  EXPECT_EQ(set.dataset.info().channels, (std::vector<std::string>{"400", "410", "450.25", "500", "1000.5"}));
  const double expected[5] = {0, 4, 3, 2, 1};
  for (std::uint32_t c = 0; c < 5; ++c) EXPECT_EQ(set.dataset.code(0, 1, 1, c), half(expected[c]));
  put("tv015_pv000_tl000_pl000.exr", image, {"400nm", "1000.5nm", "500nm", "450.25nm", "411nm"});
  expect_refused({"tv015", "411nm"});
  fs::remove(root_ / "tv015_pv000_tl000_pl000.exr");
  put("tv000_pv000_tl000_pl000.exr", image, {"400nm", "1000.5nm", "500nm", "450nm", "450.0nm"});
  expect_refused({"tv000", "two channels of 450"});
}

TEST_F(DatasetImages, ShiftedLightsAreLightsOfTheirOwn) {
  for (const char* name : {"tl000_pl000_tv000_pv000.png", "tl030_pl090_tv000_pv000.png",
                           "tl000_pl000_tv030_pv090.png", "tl030_pl090_tv030_pv090.png"}) {
    put(name, grey(static_cast<std::uint16_t>(10 * (name[3] - '0') + (name[15] - '0'))));
  }
  put("readme.txt", std::string("5 words are no numbers\n"));
  EXPECT_TRUE(good().dataset.info().full_product());
  put("shift.txt",
      std::string("# number theta phi theta' phi'\n1 0 0 7 180\n2 30 450 35.5 90\n3 60 0 1 2\n"));
  const DatasetRead set = good();
  const DatasetInfo& info = set.dataset.info();
  EXPECT_EQ(info.views, (std::vector<Direction>{Direction{}, direction_from_degrees(30, 90)}));
  EXPECT_EQ(info.lights,
            (std::vector<Direction>{Direction{}, direction_from_degrees(7, 180),
                                    direction_from_degrees(30, 90), direction_from_degrees(35.5, 90)}));
  EXPECT_EQ(info.pairs, (std::vector<DirectionPair>{{0, 1}, {0, 2}, {1, 0}, {1, 3}}));
  EXPECT_EQ(set.dataset.code(0, 0, 0, 0), 0);
  EXPECT_EQ(set.dataset.code(1, 0, 0, 0), 30);
  EXPECT_EQ(set.dataset.code(2, 0, 0, 0), 3);
  EXPECT_EQ(set.dataset.code(3, 0, 0, 0), 33);
  put("other.txt", std::string("1 0 0 7 180\n"));
  expect_refused({"shift.txt", "other.txt", "both"});
  fs::remove(root_ / "other.txt");
  put("shift.txt", std::string("1 0 0 7 180\n1 0 90 8 0\n"));
  expect_refused({"shift.txt", "twice"});
  put("shift.txt", std::string("1 0 0 120 180\n"));
  expect_refused({"shift.txt", "120"});
  fs::remove(root_ / "shift.txt");
  fs::remove(root_ / "tl030_pl090_tv030_pv090.png");
  put("shift.txt", std::string("1 0 0 7 180\n"));
  expect_refused({"1 of 4 images are missing", "view (30, 90) light (30, 90)"});  // nominal directions
}

// --- writing ---

DatasetInfo info_of(SampleType type, std::uint32_t channels, std::vector<Direction> views,
                    std::vector<Direction> lights) {
  DatasetInfo info;
  info.width = 5;
  info.height = 3;
  info.type = type;
  for (std::uint32_t c = 0; c < channels; ++c) info.channels.push_back(fmt::format("{}", 400 + 25.5 * c));
  info.views = std::move(views);
  info.lights = std::move(lights);
  make_full_product(info);
  return info;
}

Dataset filled(DatasetInfo info) {
  Result<Dataset> created = Dataset::create(std::move(info), fs::temp_directory_path().string());
  if (!created) throw std::runtime_error(created.error().message);
  Dataset set = std::move(*created);
  for (std::size_t pair = 0; pair < set.info().pairs.size(); ++pair) {
    set.write_image(pair, noise(5, 3, set.info().channel_count(), set.info().type, pair + 1).codes);
  }
  return set;
}

void expect_same(const Dataset& a, const Dataset& b) {
  ASSERT_EQ(a.info().pairs, b.info().pairs);
  EXPECT_EQ(a.info().type, b.info().type);
  for (const auto& [x, y] : {std::pair(a.info().views, b.info().views), {a.info().lights, b.info().lights}}) {
    ASSERT_EQ(x.size(), y.size());
    for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LT(angle_between(x[i], y[i]), 1e-7);
  }
  for (std::size_t pair = 0; pair < a.info().pairs.size(); ++pair) {
    EXPECT_EQ(a.image(pair).codes, b.image(pair).codes) << pair;
  }
}

TEST_F(DatasetImages, WhatIsWrittenIsReadAgain) {
  const std::vector<Direction> views = {Direction{}, direction_from_degrees(23.5, 30),
                                        direction_from_degrees(52.5, 7.5)};
  const std::vector<Direction> lights = {direction_from_degrees(15, 360.0 / 7),
                                         direction_from_degrees(90, 359.9999995),
                                         direction_from_degrees(90, 10)};
  std::vector<Direction> sorted = lights;
  sorted = {lights[0], direction_from_degrees(90, 0), lights[2]};  // 359.9999995 is the next millionth's 0
  int number = 0;
  for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
    for (const std::uint32_t channels : {1u, 2u, 3u, 4u, 7u}) {
      if (channels > 4 && type != SampleType::float16) continue;
      const std::string name = fmt::format("set{}", number++);
      const Dataset set = filled(info_of(type, channels, views, sorted));
      const auto written = write_ubo2003(path(name), set);
      ASSERT_TRUE(written) << written.error().message;
      const DatasetRead back = good(name);
      expect_same(set, back.dataset);
      if (type == SampleType::float16) {
        EXPECT_EQ(back.dataset.info().channels, set.info().channels);
      }
    }
  }
  EXPECT_TRUE(fs::exists(root_ / "set0/tv023.5_pv030/00001 tl015 pl051.428571 tv023.5 pv030.png"));
  EXPECT_EQ(static_cast<int>(std::distance(fs::directory_iterator(root_), fs::directory_iterator())), number);
}

TEST_F(DatasetImages, APairListIsWrittenAndReadAgain) {
  DatasetInfo info =
      info_of(SampleType::unorm8, 3, ubo2003_directions(), {Direction{}, direction_from_degrees(75, 15)});
  std::erase_if(info.pairs, [](const DirectionPair& p) { return p.view % 3 == 0 && p.light == 1; });
  const Dataset set = filled(std::move(info));
  ASSERT_TRUE(write_ubo2003(path("set/"), set));
  expect_same(set, good("set", skipping()).dataset);
  expect_refused({"27 of 162"}, "set");
}

TEST_F(DatasetImages, TheSetDoesNotDependOnThreads) {
  ASSERT_TRUE(write_ubo2003(path("set"),
                            filled(info_of(SampleType::unorm8, 3, ubo2003_directions(), {Direction{}}))));
  const DatasetRead many = good("set");
  tbb::task_arena alone(1);
  alone.execute([&] { expect_same(many.dataset, good("set").dataset); });
  put("set/tv075_pv345/b tl000 pl000 tv075 pv345x.png", std::string("none"));
  for (const auto& entry : fs::recursive_directory_iterator(root_ / "set/tv075_pv345"))
    fs::remove(entry.path());
  put("set/tv015_pv000/00001 tl000 pl000 tv015 pv000.png", std::string("damaged"));
  put("set/tv060_pv018/00038 tl000 pl000 tv060 pv018.png", std::string("damaged"));
  for (int i = 0; i < 10; ++i) expect_refused({"tv015 pv000"}, "set");  // the first one, whoever meets it
}

TEST_F(DatasetImages, WritingRefusesWhatReadingWouldNotGiveBack) {
  const auto refused = [&](DatasetInfo info, const std::string& word) {
    const auto written = write_ubo2003(path("set"), filled(std::move(info)));
    ASSERT_FALSE(written) << word;
    EXPECT_NE(written.error().message.find(word), std::string::npos) << written.error().message;
    EXPECT_TRUE(fs::is_empty(root_)) << word;
  };
  refused(info_of(SampleType::unorm8, 3, {direction_from_degrees(30, 0), direction_from_degrees(30, 1e-7)},
                  {Direction{}}),
          "two views are (30, 0)");
  refused(info_of(SampleType::unorm8, 3, {Direction{}}, {Direction{}, Direction{0, 1}}),
          "two lights are (0, 0)");
  DatasetInfo linear = info_of(SampleType::unorm16, 3, {Direction{}}, {Direction{}});
  linear.colour_space = ColourSpace::lin_rec709_scene;
  refused(linear, "lin_rec709_scene");
  linear.type = SampleType::float16;
  linear.colour_space = ColourSpace::lin_ap0_scene;
  refused(linear, "lin_ap0_scene");
}

TEST_F(DatasetImages, ADirectoryAppearsWholeOrNotAtAll) {
  const Dataset set = filled(info_of(SampleType::unorm8, 3, ubo2003_directions(), {Direction{}}));
  put("full/keep.txt", std::string("mine"));
  put("file", std::string("mine"));
  fs::create_directories(root_ / "empty");
  for (const char* name : {"full", "file", "nowhere/set"})
    EXPECT_FALSE(write_ubo2003(path(name), set)) << name;
  EXPECT_TRUE(fs::exists(root_ / "full/keep.txt"));
  EXPECT_TRUE(write_ubo2003(path("empty"), set));
  EXPECT_EQ(good("empty").dataset.info().pairs.size(), 81u);

  // A disk that takes no more: files end at 20 bytes.
  struct rlimit before {};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old = std::signal(SIGXFSZ, SIG_IGN);
  struct rlimit small = before;
  small.rlim_cur = 20;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const auto written = write_ubo2003(path("set"), set);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, old);
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().message.find("00000 tl000"), std::string::npos) << written.error().message;
  std::set<std::string> left;
  for (const auto& entry : fs::directory_iterator(root_)) left.insert(entry.path().filename().string());
  EXPECT_EQ(left, (std::set<std::string>{"empty", "file", "full"}));
}

// --- light lists ---

std::uint16_t first_code(const DatasetRead& set, std::size_t pair) { return set.dataset.code(pair, 0, 0, 0); }

TEST_F(DatasetImages, AnLpFileNamesItsImages) {
  put("b.png", grey(1));
  put("Some Name.PNG", grey(2));
  put("c.10.png", grey(3));
  put("unused.png", grey(9));
  put("mask.png", grey(9));
  put("dome.lp", std::string("\xef\xbb\xbf 3\r\nC:\\RTI\\my files\\some name.png\t2 0 0.5\r\n\r\n"
                             "/home/x/c.10.png 0 -1 +1\r\nb.png 0.0 0.0 1e0\r\n"));
  for (const char* name : {"", "dome.lp"}) {
    const DatasetRead set = good(name);
    EXPECT_EQ(set.kind, "lights");
    EXPECT_EQ(set.dataset.info().views, std::vector<Direction>{Direction{}});
    EXPECT_EQ(set.dataset.info().quantity, Quantity::reflectance_cos);
    ASSERT_EQ(set.dataset.info().lights.size(), 3u);
    EXPECT_TRUE(same_direction(set.dataset.info().lights[0], direction_from_vector({4, 0, 1})));
    EXPECT_TRUE(same_direction(set.dataset.info().lights[1], direction_from_degrees(45, 270)));
    EXPECT_EQ(first_code(set, 0), 2);
    EXPECT_EQ(first_code(set, 1), 3);
    EXPECT_EQ(first_code(set, 2), 1);
  }
  fs::remove(root_ / "b.png");
  expect_refused({"1 of 3 images", "dome.lp", "'b.png' of light 3"});
  const DatasetRead set = good("", skipping());
  EXPECT_EQ(set.dataset.info().lights.size(), 2u);
  EXPECT_EQ(set.dataset.info().pairs.size(), 2u);
  put("second.lp", std::string("1\nb.png 0 0 1\n"));
  expect_refused({"dome.lp", "second.lp", "both"});
}

TEST_F(DatasetImages, AnLpFileWithoutNamesGoesByOrder) {
  for (const int i : {1, 2, 10}) put(fmt::format("x{}.png", i), grey(static_cast<std::uint16_t>(i)));
  const std::vector<std::string> texts = {"3\n0 0 1\n 0 1 1\n1 0 1\n",
                                          "3\nold1.tif 0 0 1\nold2.tif 0 1 1\nold3.tif 1 0 1\n"};
  for (const std::string& text : texts) {
    put("dome.lp", text);
    const DatasetRead set = good();
    EXPECT_EQ(first_code(set, 0), 1);
    EXPECT_EQ(first_code(set, 1), 2);
    EXPECT_EQ(first_code(set, 2), 10);
    EXPECT_TRUE(same_direction(set.dataset.info().lights[1], direction_from_degrees(45, 90)));
    ASSERT_EQ(set.notes.size(), 1u);
  }
  put("x11.png", grey(11));
  expect_refused({"3 lights", "4 images"});
}

TEST_F(DatasetImages, WrongLightListsAreRefused) {
  for (const char* name : {"a.png", "b.png"}) put(name, grey(1));
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {"3\na.png 0 0 1\nb.png 0 1 1\n", {"says 3 images and lists 2"}},
      {"1\na.png 0 0 1\nb.png 0 1 1\n", {"says 1 images and lists 2"}},
      {"", {"expected the number of images"}},
      {"0\n", {"lists 0 lights"}},
      {"-2\na.png 0 0 1\nb.png 0 1 1\n", {"says -2"}},
      {"a.png 0 0 1\nb.png 0 1 1\n", {"expected the number of images"}},
      {"2\na.png 0 0 1\nb.png 0 1\n", {"line 3", "three numbers"}},
      {"2\na.png 0 0 1\nb.png 0 nan 1\n", {"line 3"}},
      {"2\na.png 0 0 1\nb.png 0 inf 1\n", {"line 3"}},
      {"2\na.png 0 0 1\nb.png 0 1 -0.5\n", {"light 2", "below the surface"}},
      {"2\na.png 0 0 1\nb.png 0 0.00001 0.00001\n", {"light 2", "longer than 0.0001"}},
      {"2\na.png 0 0 1\nb.png 0 0 7\n", {"twice", "light 1 and 2"}},
      {"2\na.png 0 0 1\n 0 1 1\n", {"names 1 of its 2"}},
      {"2\na.png 0 0 1\nA.PNG 0 1 1\n", {"a.png", "light 1 and 2"}},
  };
  for (const auto& [text, words] : cases) {
    put("dome.lp", text);
    std::vector<std::string> all = words;
    all.push_back("dome.lp");
    expect_refused(all);
  }
}

TEST_F(DatasetImages, TablesOfLightsInTheirThreeShapes) {
  for (int i = 0; i < 4; ++i)
    put(fmt::format("uw/owl/owl.{}.png", i + 8), grey(static_cast<std::uint16_t>(i)));
  put("uw/owl/owl.mask.png", grey(255));
  put("uw/lights.txt", std::string("4\n0 0 1\n0.6 0 0.8\n0 0.6 0.8\n-0.6 0 0.8\n"));
  fs::create_directories(root_ / "ps");
  fs::create_directories(root_ / "dl");
  fs::copy(root_ / "uw/owl", root_ / "ps");
  fs::copy(root_ / "uw/owl", root_ / "dl");
  put("ps/light_directions.txt", std::string("0 0.6 0 -0.6\n0 0 0.6 0\n1 0.8 0.8 0.8\n"));
  put("dl/light_directions.txt", std::string("0 0 1\n0.6 0 0.8\n0 0.6 0.8\n-0.6 0 0.8"));
  for (const char* name : {"uw/owl", "ps", "dl"}) {
    const DatasetRead set = good(name);
    const auto& lights = set.dataset.info().lights;
    ASSERT_EQ(lights.size(), 4u) << name;
    EXPECT_TRUE(same_direction(lights[1], direction_from_vector({0.6, 0, 0.8}))) << name;
    EXPECT_TRUE(same_direction(lights[2], direction_from_vector({0, 0.6, 0.8}))) << name;
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(first_code(set, i), i) << name;
  }
  // Three by three: unit vectors tell rows from columns.
  put("three/a.png", grey(0));
  put("three/b.png", grey(1));
  put("three/c.png", grey(2));
  for (const char* text : {"0 0.6 0\n0 0 0.6\n1 0.8 0.8\n", "0 0 1\n0.6 0 0.8\n0 0.6 0.8\n"}) {
    put("three/light_directions.txt", std::string(text));
    EXPECT_TRUE(same_direction(good("three").dataset.info().lights[1], direction_from_vector({0.6, 0, 0.8})))
        << text;
  }
  EXPECT_FALSE(is_dataset(path("uw")));  // the lights of its folders, no images
  put("dl/light_directions.txt", std::string("0 0 1\n0.6 0 0.8 9\n"));
  expect_refused({"no table of lights"}, "dl");
  put("dl/light_directions.txt", std::string("5\n0 0 1\n0.6 0 0.8\n"));
  expect_refused({"says 5", "lists 2"}, "dl");
  put("dl/light_directions.txt", std::string("0 0 1\n0.6 0 0.8\n"));
  expect_refused({"2 lights", "4 images"}, "dl");
}

TEST_F(DatasetImages, IntensitiesDivideTheSamples) {
  Image image = constant(1, 1, 3, SampleType::unorm16, 0);
  image.codes = {13107, 26214, 65535};  // 0.2, 0.4, 1
  put("b.png", image);
  put("a.png", image);
  put("light_directions.txt", std::string("0 0 1\n0 0.6 0.8\n"));
  put("filenames.txt", std::string("b.png\r\na.png \r\n"));
  EXPECT_EQ(good().dataset.info().type, SampleType::unorm16);
  put("light_intensities.txt", std::string("1 1 1\n0.5 2 4\n"));
  const DatasetRead set = good();
  EXPECT_EQ(set.dataset.info().type, SampleType::float16);
  EXPECT_EQ(set.dataset.info().colour_space, ColourSpace::lin_rec709_scene);
  EXPECT_EQ(set.dataset.image(0).codes, (std::vector<std::uint16_t>{half(0.2), half(0.4), half(1)}));
  EXPECT_EQ(set.dataset.image(1).codes, (std::vector<std::uint16_t>{half(0.4), half(0.2), half(0.25)}));
  for (const char* text : {"1 1 1\n", "1 1 1\n1 0 1\n", "1 1 1\n1 1\n", "a b c\n1 1 1\n"}) {
    put("light_intensities.txt", std::string(text));
    expect_refused({"light_intensities.txt", "2 lines"});
  }
  put("light_intensities.txt", std::string("1\n1\n"));
  expect_refused({"3 channels", "1 intensities"});
  put("light_intensities.txt", std::string("1 1 1\n1 1e-9 1\n"));
  expect_refused({"a.png", "beyond 65504"});
  put("light_intensities.txt", std::string("1 1 1\n1 1 1\n"));
  put("filenames.txt", std::string("b.png\n"));
  expect_refused({"filenames.txt", "1 images", "2 lights"});
}

// --- fits ---

std::string info_json(const std::string& type, const std::string& colours, int planes,
                      const std::string& more) {
  std::string scale, bias, range;
  for (int p = 0; p < planes; ++p) {
    scale += fmt::format("{}{}", p == 0 ? "" : ",", 1 + 0.1 * p);
    bias += fmt::format("{}{}", p == 0 ? "" : ",", 0.01 * p);
    range += fmt::format("{}{}", p == 0 ? "" : ",", 100 + p);
  }
  return fmt::format(
      R"({{"width":2,"height":1,"format":"png","type":"{}","colorspace":"{}","nplanes":{},)"
      R"("lights":[0,0,2, 0.6,0,0.8, 0.48,0.64,0.6],"materials":[{{"scale":[{}],"bias":[{}],"range":[{}]}}]{}}})",
      type, colours, planes, scale, bias, range, more);
}

TEST_F(DatasetImages, FitsAreRelitByTheirFormulas) {
  const double pi = std::numbers::pi;
  std::vector<Image> planes;
  for (std::uint64_t i = 0; i < 9; ++i) {
    planes.push_back(noise(2, 1, 3, SampleType::unorm8, 40 + i));
    for (auto& code : planes.back().codes)
      code = static_cast<std::uint16_t>(code / 4 + 20);  // few results clip
    put(fmt::format("plane_{}.png", i), planes.back());
  }
  const auto c = [&](std::uint32_t x, std::uint32_t p) {
    return (planes[p / 3].at(x, 0, p % 3) / 255.0 - 0.01 * p) * (1 + 0.1 * p);
  };
  const auto expect_colours = [&](const std::string& json, auto colour) {
    put("info.json", json);
    const DatasetRead set = good();
    EXPECT_EQ(set.kind, "relight");
    EXPECT_EQ(set.dataset.info().type, SampleType::unorm8);
    EXPECT_EQ(set.dataset.info().lights.size(), 3u);
    for (std::uint32_t i = 0; i < 3; ++i) {
      const Vector3 l = unit_vector(set.dataset.info().lights[i]);
      for (std::uint32_t x = 0; x < 2; ++x) {
        for (std::uint32_t k = 0; k < 3; ++k) {
          const double expected = 255 * std::clamp(colour(i, l, x, k), 0.0, 1.0);
          EXPECT_NEAR(set.dataset.code(i, x, 0, k), expected, 0.501) << json << " " << i << x << k;
        }
      }
    }
  };
  using U = std::uint32_t;
  expect_colours(info_json("ptm", "rgb", 18, ""), [&](U, const Vector3& l, U x, U k) {
    const double u = l[0], v = l[1];
    return c(x, k) + c(x, 3 + k) * u + c(x, 6 + k) * v + c(x, 9 + k) * u * u + c(x, 12 + k) * u * v +
           c(x, 15 + k) * v * v;
  });
  expect_colours(info_json("ptm", "lrgb", 9, ""), [&](U, const Vector3& l, U x, U k) {
    const double u = l[0], v = l[1];
    const double luminance =
        c(x, 3) + c(x, 4) * u + c(x, 5) * v + c(x, 6) * u * u + c(x, 7) * u * v + c(x, 8) * v * v;
    return planes[0].at(x, 0, k) / 255.0 * luminance;
  });
  expect_colours(info_json("hsh", "rgb", 12, ""), [&](U, const Vector3& l, U x, U k) {
    // sin(theta) = 2 sin(theta/2) cos(theta/2): the first band is linear in the light over sqrt(1 + z)
    const double f = std::sqrt(6 / pi) * std::sqrt(l[2] / (1 + l[2]));
    return c(x, k) / std::sqrt(2 * pi) + c(x, 3 + k) * f * l[0] +
           c(x, 6 + k) * std::sqrt(3 / (2 * pi)) * (2 * l[2] - 1) + c(x, 9 + k) * f * l[1];
  });
  // All nine, in x, y and z alone: cos 2 phi = (x^2 - y^2) / (1 - z^2), sin 2 phi = 2 x y / (1 - z^2).
  expect_colours(info_json("hsh", "rgb", 27, ""), [&](U, const Vector3& l, U x, U k) {
    const double z = l[2], f = std::sqrt(z / (1 + z)), a = std::sqrt(6 / pi), b = std::sqrt(30 / pi);
    const double w[9] = {1 / std::sqrt(2 * pi),
                         a * l[0] * f,
                         std::sqrt(3 / (2 * pi)) * (2 * z - 1),
                         a * l[1] * f,
                         -b * (l[0] * l[0] - l[1] * l[1]) * z / (1 + z),
                         b * l[0] * (2 * z - 1) * f,
                         std::sqrt(5 / (2 * pi)) * (6 * z * z - 6 * z + 1),
                         b * l[1] * (2 * z - 1) * f,
                         -2 * b * l[0] * l[1] * z / (1 + z)};
    double sum = 0;
    for (U i = 0; i < 9; ++i) sum += w[i] * c(x, 3 * i + k);
    return sum;
  });
  // Narrow Gaussians: light i alone. Node bytes 127 + 10 i + p + k, mean 50 i + k.
  std::string basis;
  for (int p = 0; p <= 3; ++p) {
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        basis += fmt::format("{}{}", basis.empty() ? "" : ",", p == 0 ? 50 * i + k : 127 + 10 * i + p + k);
      }
    }
  }
  const auto principal = [&](double mean, double node, U x, U k) {
    double sum = mean;
    for (U p = 0; p < 3; ++p) sum += c(x, p) * (node + p + 1 + k) / (100 + p);
    return sum;
  };
  const std::string rbf = info_json("rbf", "mrgb", 3, R"(,"sigma":0.05,"basis":[)" + basis + "]");
  expect_colours(
      rbf, [&](U i, const Vector3&, U x, U k) { return principal((50 * i + k) / 255.0, 10 * i, x, k); });
  // Octahedral nodes 2x2 with bytes by node: the zenith is the mean of all four.
  Bytes bin;
  for (int p = 0; p <= 3; ++p) {
    for (int node = 0; node < 4; ++node) {
      for (int k = 0; k < 3; ++k)
        bin.push_back(static_cast<std::uint8_t>(p == 0 ? 40 * node : 127 + node * p));
    }
  }
  put("materials.bin", bin);
  expect_colours(info_json("bilinear", "mrgb", 3, R"(,"resolution":2)"), [&](U, const Vector3& l, U x, U) {
    const double s = std::fabs(l[0]) + std::fabs(l[1]) + l[2];
    const double a = ((l[0] + l[1]) / s + 1) / 2, b = ((l[1] - l[0]) / s + 1) / 2;
    const double node = a + 2 * b;  // linear in the node's number
    double sum = 40 * node / 255;
    for (U p = 0; p < 3; ++p) sum += c(x, p) * node * (p + 1) / (100 + p);
    return sum;
  });
}

TEST_F(DatasetImages, GaussiansOfManyLightsKeepSomeWeight) {
  // 1,600 lights within one width: each has less than the cut, and all have the same node.
  std::string lights, basis = "1,2,3";
  for (int i = 0; i < 1600; ++i) {
    lights += fmt::format("{}{},{},1", i == 0 ? "" : ",", i % 40 * 0.01, i / 40 * 0.01);
    basis += i == 0 ? "" : ",1,2,3";
  }
  for (int i = 0; i < 1600; ++i) basis += ",127,127,127";
  put("plane_0.png", constant(2, 1, 3, SampleType::unorm8, 100));
  put("info.json", fmt::format(R"({{"width":2,"height":1,"format":"png","type":"rbf","colorspace":"mrgb",)"
                               R"("nplanes":1,"sigma":10,"lights":[{}],"basis":[{}],)"
                               R"("materials":[{{"scale":[1],"bias":[0],"range":[100]}}]}})",
                               lights, basis));
  const DatasetRead set = good();
  EXPECT_EQ(set.dataset.image(1599).codes, (std::vector<std::uint16_t>{1, 2, 3, 1, 2, 3}));
}

TEST_F(DatasetImages, FitsThatCannotBeRelitAreRefused) {
  for (int i = 0; i < 6; ++i) put(fmt::format("plane_{}.png", i), constant(2, 1, 3, SampleType::unorm8, 100));
  const std::string ptm = info_json("ptm", "rgb", 18, "");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = ptm;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  put("info.json", ptm);
  EXPECT_EQ(good().dataset.info().pairs.size(), 3u);
  DatasetReadOptions options;
  options.crop = Rectangle{1, 0, 1, 1};
  EXPECT_EQ(good("", options).dataset.info().width, 1u);
  options.crop = Rectangle{1, 0, 2, 1};
  expect_refused({"crop"}, "", options);
  const std::vector<std::pair<std::string, std::string>> cases = {
      {info_json("sh", "rgb", 18, ""), "type 'sh' in 'rgb'"},
      {info_json("rbf", "mycc", 18, ""), "'mycc'"},
      {info_json("ptm", "rgb", 17, ""), "'nplanes'"},
      {info_json("rbf", "mrgb", 18, R"(,"sigma":0.1)"), "materials.bin, which has 0"},
      {info_json("rbf", "mrgb", 18, R"(,"sigma":0)"), "'sigma'"},
      {info_json("bilinear", "mrgb", 18, R"(,"resolution":1)"), "'resolution'"},
      {info_json("rbf", "mrgb", 1, R"(,"sigma":0.1,"basis":[1,2,3,4,5,6,7,8,9,1,2,3,4,5,6,7,8,256])"),
       "'basis'"},
      {with("\"width\":2", "\"width\":3"), "plane_0.png"},
      {with("\"width\":2", "\"width\":0"), "'width'"},
      {with("\"width\":2", "\"width\":1e300"), "'width'"},
      {with("0,0,2,", "0,0,-2,"), "light 0"},
      {with("0,0,2,", "0,0,0,"), "light 0"},
      {with("0,0,2,", "0,0,"), "'lights'"},
      {with("0,0,2,", "0,\"0\",2,"), "'lights'"},
      {with("\"scale\":[1,", "\"scale\":["), "'scale'"},
      {with("\"png\"", "\"../png\""), "'format'"},
      {with("}]", "},{}]"), "'materials'"},
      {"[]", "no JSON object"},
      {"{", "no JSON object"},
      {"{}", "'type'"},
  };
  for (const auto& [json, word] : cases) {
    put("info.json", json);
    expect_refused({word});
  }
  put("info.json", ptm);
  fs::remove(root_ / "plane_5.png");
  expect_refused({"plane_5.png"});
}

// --- descriptions ---

TEST_F(DatasetImages, AStackIsReadAsDescribed) {
  put("images/a.png", constant(2, 1, 3, SampleType::unorm8, 11));
  put("images/b.png", constant(2, 1, 3, SampleType::unorm8, 22));
  put("c.png", constant(2, 1, 3, SampleType::unorm8, 33));
  put("sub/set.json", fmt::format(R"({{"images":[
    {{"file":"../images/b.png","view":[30,-90],"light_vector":[0,0,5]}},
    {{"file":"../images/a.png","view_vector":[0,0,1],"light":[45,10.5]}},
    {{"file":"{}","view":[0,77],"light":[0,0]}}],
    "colour_space":"lin_rec709_scene","quantity":"radiance","wraps":true}})",
                                  path("c.png")));
  const DatasetRead set = good("sub/set.json");
  EXPECT_EQ(set.kind, "stack");
  const DatasetInfo& info = set.dataset.info();
  EXPECT_EQ(info.colour_space, ColourSpace::lin_rec709_scene);
  EXPECT_EQ(info.quantity, Quantity::radiance);
  EXPECT_TRUE(info.wraps);
  EXPECT_EQ(info.views, (std::vector<Direction>{Direction{}, direction_from_degrees(30, 270)}));
  EXPECT_EQ(info.lights, (std::vector<Direction>{Direction{}, direction_from_degrees(45, 10.5)}));
  EXPECT_EQ(info.pairs, (std::vector<DirectionPair>{{0, 0}, {0, 1}, {1, 0}}));
  EXPECT_EQ(first_code(set, 0), 33);
  EXPECT_EQ(first_code(set, 1), 11);
  EXPECT_EQ(first_code(set, 2), 22);
  ASSERT_EQ(set.notes.size(), 1u);
}

TEST_F(DatasetImages, WrongDescriptionsAreRefused) {
  put("a.png", grey(1));
  const auto images = [](const std::string& image) { return R"({"images":[)" + image + "]}"; };
  const std::string one = R"({"file":"a.png","view":[0,0],"light":[0,0]})";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "no JSON object"},
      {"[1]", "no JSON object"},
      {"{}", "'images'"},
      {R"({"images":[]})", "'images'"},
      {R"({"images":{}})", "'images'"},
      {R"({"image":[)" + one + "]}", "unknown member 'image'"},
      {R"({"images":[)" + one + R"(],"colour_space":"sRGB"})", "'colour_space'"},
      {R"({"images":[)" + one + R"(],"quantity":3})", "'quantity'"},
      {R"({"images":[)" + one + R"(],"wraps":1})", "'wraps'"},
      {images("7"), "images[0] is no JSON object"},
      {images(R"({"view":[0,0],"light":[0,0]})"), "'file'"},
      {images(R"({"file":7,"view":[0,0],"light":[0,0]})"), "'file'"},
      {images(R"({"file":"a.png","view":[0,0],"light":[0,0],"lights":1})"), "unknown member 'lights'"},
      {images(R"({"file":"a.png","view":[0,0]})"), "none of 'light'"},
      {images(R"({"file":"a.png","view":[0,0],"view_vector":[0,0,1],"light":[0,0]})"), "both of 'view'"},
      {images(R"({"file":"a.png","view":[0],"light":[0,0]})"), "wrong 'view'"},
      {images(R"({"file":"a.png","view":["0",0],"light":[0,0]})"), "wrong 'view'"},
      {images(R"({"file":"a.png","view":[91,0],"light":[0,0]})"), "wrong 'view'"},
      {images(R"({"file":"a.png","view":[-1,0],"light":[0,0]})"), "wrong 'view'"},
      {images(R"({"file":"a.png","view":[0,1e999],"light":[0,0]})"), ""},
      {images(R"({"file":"a.png","view":[0,0],"light_vector":[0,1,-0.1]})"), "wrong 'light_vector'"},
      {images(R"({"file":"a.png","view":[0,0],"light_vector":[0,0,0]})"), "wrong 'light_vector'"},
      {images(one + "," + one), "both the image"},
      {images(R"({"file":"b.png","view":[0,0],"light":[0,0]})"), "b.png"},
  };
  for (const auto& [json, word] : cases) {
    put("set.json", json);
    expect_refused({word}, "set.json");
  }
}

// --- Radiance ---

Bytes radiance(const std::string& header, const Bytes& texels) {
  const std::string text = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n" + header + "\n";
  Bytes out(text.begin(), text.end());
  out.insert(out.end(), texels.begin(), texels.end());
  return out;
}

TEST_F(DatasetImages, RadianceAxesAreHonoured) {
  // The picture: red is 10 y + x + 1, 3 wide and 2 high; e 136 makes the mantissa the value.
  struct Order {
    const char* line;
    bool columns, right, bottom;  // the raster: by columns, from the right, from the bottom
  };
  for (const Order& order : {Order{"-Y 2 +X 3", false, false, false}, Order{"-Y 2 -X 3", false, true, false},
                             Order{"+Y 2 +X 3", false, false, true}, Order{"+Y 2 -X 3", false, true, true},
                             Order{"+X 3 -Y 2", true, false, false}, Order{"-X 3 -Y 2", true, true, false},
                             Order{"+X 3 +Y 2", true, false, true}, Order{"-X 3 +Y 2", true, true, true}}) {
    Bytes texels;
    for (int i = 0; i < 6; ++i) {
      const int slow = order.columns ? i / 2 : i / 3, fast = order.columns ? i % 2 : i % 3;
      int x = order.columns ? slow : fast, y = order.columns ? fast : slow;
      if (order.right) x = 2 - x;
      if (order.bottom) y = 1 - y;
      for (const int byte : {10 * y + x + 1, 7, 0, 136}) texels.push_back(static_cast<std::uint8_t>(byte));
    }
    put("tl000 pl000 tv000 pv000.hdr", radiance(fmt::format("\n{}", order.line), texels));
    const DatasetRead set = good();
    ASSERT_EQ(set.dataset.info().width, 3u) << order.line;
    EXPECT_EQ(set.dataset.info().colour_space, ColourSpace::lin_rec709_scene);
    for (std::uint32_t y = 0; y < 2; ++y) {
      for (std::uint32_t x = 0; x < 3; ++x) {
        EXPECT_EQ(set.dataset.code(0, x, y, 0), half(10 * y + x + 1)) << order.line << " " << x << "," << y;
        EXPECT_EQ(set.dataset.code(0, x, y, 1), half(7));
      }
    }
  }
}

TEST_F(DatasetImages, RadianceRunLengthsOldAndNew) {
  // Eight texels: red 1 … 8, green 5, blue 3 3 3 3 9 9 9 9, e 136.
  const Bytes separate = {2, 2, 0, 8, 8, 1, 2, 3, 4, 5, 6, 7, 8, 136, 5, 132, 3, 132, 9, 136, 136};
  // The same twice over 258 texels: a first one and 257 repeats, 1 + 256.
  const Bytes repeated = {9, 8, 7, 136, 1, 1, 1, 1, 1, 1, 1, 1};
  put("s/tl000 pl000 tv000 pv000.hdr", radiance("EXPOSURE=2\nEXPOSURE= 2.0\n\n-Y 1 +X 8", separate));
  put("r/tl000 pl000 tv000 pv000.hdr", radiance("\n-Y 1 +X 258", repeated));
  const DatasetRead s = good("s"), r = good("r");
  for (std::uint32_t x = 0; x < 8; ++x) {
    EXPECT_EQ(s.dataset.code(0, x, 0, 0), half((x + 1) / 4.0));
    EXPECT_EQ(s.dataset.code(0, x, 0, 1), half(5 / 4.0));
    EXPECT_EQ(s.dataset.code(0, x, 0, 2), half((x < 4 ? 3 : 9) / 4.0));
  }
  EXPECT_EQ(r.dataset.code(0, 257, 0, 0), half(9));
  EXPECT_EQ(r.dataset.code(0, 257, 0, 2), half(7));

  const std::string name = "d/tl000 pl000 tv000 pv000.hdr";
  for (const auto& [header, texels] :
       {std::pair(std::string("\n-Y 1 +X 8"), separate), {"\n-Y 1 +X 258", repeated}}) {
    const Bytes whole = radiance(header, texels);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      put(name, Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)));
      expect_refused({"pv000.hdr"}, "d");
    }
  }
  const std::vector<std::pair<Bytes, std::string>> cases = {
      {radiance("\n-Y 1 +Y 8", separate), "resolution line"},
      {radiance("\n-Y 1 +X 0", separate), "resolution line"},
      {radiance("\n-Y 65537 +X 65537", separate), "resolution line"},
      {radiance("\n-Y 65536 +X 65536", separate), "at most 268435456"},
      {radiance("\n-Y 16384 +X 16384", separate), "another length"},
      {radiance("\n-Y 99999999999999999999 +X 8", separate), "resolution line"},
      {radiance("EXPOSURE=0\n\n-Y 1 +X 8", separate), "EXPOSURE"},
      {radiance("EXPOSURE=nan\n\n-Y 1 +X 8", separate), "EXPOSURE"},
      {radiance("FORMAT=32-bit_rle_xyze\n\n-Y 1 +X 8", separate), "xyze"},
      {radiance("\n-Y 1 +X 9", separate), "another length"},
      {radiance("\n-Y 1 +X 8", {2, 2, 0, 8, 137, 1, 1, 1}), "beyond its scanline"},
      {radiance("\n-Y 1 +X 8", {2, 2, 0, 8, 0, 1, 1, 1}), "beyond its scanline"},
      {radiance("\n-Y 1 +X 4", {1, 1, 1, 4, 1, 1, 1, 4}), "beyond its scanline"},
      {radiance("\n-Y 1 +X 4", {5, 5, 5, 136, 1, 1, 1, 4}), "beyond its scanline"},
      {radiance("\n-Y 1 +X 1", {255, 1, 1, 255}), "not finite or beyond 65504"},
      {Bytes{'P', '6', '\n'}, "'#?'"},
  };
  for (const auto& [bytes, word] : cases) {
    put(name, bytes);
    expect_refused({word, "pv000.hdr"}, "d");
  }
}

// --- kept data ---

fs::path data_folder() {
  const char* named = std::getenv("BTFC_DATA");
  return named != nullptr ? fs::path(named) : fs::path(BTFC_SPEC) / "../../shared/data";
}

Result<DatasetRead> read_kept(const char* name, DatasetReadOptions options = {}) {
  return read_dataset((data_folder() / name).string(), options);
}

TEST(KeptDatasets, PhotometricSets) {
  if (!fs::exists(data_folder() / "photometric_uw")) GTEST_SKIP() << "no " << data_folder();
  struct Kept {
    const char* name;
    std::size_t lights;
    std::uint32_t width, height, channels;
    SampleType type;
  };
  for (const Kept& kept : {Kept{"photometric_uw/gray", 12, 512, 340, 3, SampleType::unorm8},
                           Kept{"photometric_psbox12", 12, 430, 550, 1, SampleType::unorm8},
                           Kept{"photometric_diligent_ball96", 96, 160, 160, 3, SampleType::float16}}) {
    const Result<DatasetRead> set = read_kept(kept.name);
    ASSERT_TRUE(set) << set.error().message;
    const DatasetInfo& info = set->dataset.info();
    EXPECT_EQ(info.lights.size(), kept.lights) << kept.name;
    EXPECT_EQ(info.width, kept.width) << kept.name;
    EXPECT_EQ(info.height, kept.height) << kept.name;
    EXPECT_EQ(info.channel_count(), kept.channels) << kept.name;
    EXPECT_EQ(info.type, kept.type) << kept.name;
    // Balls are brightest towards the light: the centroid's shift from the mean picture's follows it.
    if (kept.channels == 1) continue;
    std::vector<std::array<double, 2>> centres;
    std::array<double, 2> mean{};
    for (std::size_t pair = 0; pair < info.pairs.size(); ++pair) {
      const Image image = set->dataset.image(pair);
      double x_sum = 0, y_sum = 0, sum = 0;
      for (std::uint32_t y = 0; y < image.height; ++y) {
        for (std::uint32_t x = 0; x < image.width; ++x) {
          const double v = code_value(image.type, image.at(x, y, 1));
          x_sum += v * x;
          y_sum -= v * y;
          sum += v;
        }
      }
      centres.push_back({x_sum / sum, y_sum / sum});
      for (std::size_t c = 0; c < 2; ++c)
        mean[c] += centres.back()[c] / static_cast<double>(info.pairs.size());
    }
    for (std::size_t c = 0; c < 2; ++c) {
      double light_mean = 0, product = 0, a = 0, b = 0;
      for (const Direction& d : info.lights)
        light_mean += unit_vector(d)[c] / static_cast<double>(info.lights.size());
      for (std::size_t pair = 0; pair < centres.size(); ++pair) {
        const double p = centres[pair][c] - mean[c], q = unit_vector(info.lights[pair])[c] - light_mean;
        product += p * q;
        a += p * p;
        b += q * q;
      }
      EXPECT_GT(product / std::sqrt(a * b), 0.8) << kept.name << " axis " << c;
    }
  }
}

TEST(KeptDatasets, FitsOfTheCoin) {
  if (!fs::exists(data_folder() / "rti_coin_fits")) GTEST_SKIP() << "no " << data_folder();
  DatasetReadOptions options;
  options.crop = Rectangle{160, 224, 48, 48};
  const Result<Image> photo = read_image((data_folder() / "rti_coin_fits/coin10.jpg").string());
  ASSERT_TRUE(photo);
  const Image truth = crop(*photo, 160, 224, 48, 48);
  // The photograph is the one of light 6; its PSNR tells the forms apart, and a wrong formula is far below.
  for (const auto& [name, least] :
       {std::pair("ptm", 20.5), {"lptm", 20.0}, {"hsh", 24.0}, {"rbf27", 26.0}, {"bilinear18", 25.5}}) {
    const Result<DatasetRead> set = read_kept(fmt::format("rti_coin_fits/{}", name).c_str(), options);
    ASSERT_TRUE(set) << set.error().message;
    EXPECT_EQ(set->dataset.info().lights.size(), 116u);
    double best = 0;
    std::size_t best_at = 0;
    for (std::size_t pair = 0; pair < 116; ++pair) {
      const Image image = set->dataset.image(pair);
      double error = 0;
      for (std::size_t i = 0; i < truth.codes.size(); ++i) {
        const double d = (double(truth.codes[i]) - double(image.codes[i])) / 255;
        error += d * d;
      }
      const double psnr = -10 * std::log10(error / static_cast<double>(truth.codes.size()));
      if (psnr > best) {
        best = psnr;
        best_at = pair;
      }
    }
    EXPECT_EQ(best_at, 6u) << name;
    EXPECT_GT(best, least) << name;
    RecordProperty(name, std::to_string(best));
  }
}

}  // namespace
}  // namespace btfc::test
