// BTF files of OpenEXR parts: there and back, by OpenEXR's own C++ classes, and damaged.
#include <ImathBox.h>
#include <ImfAttribute.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfIntAttribute.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfStringAttribute.h>
#include <ImfVecAttribute.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <half.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "encoder/image_file.h"
#include "encoder/input/btf_exr_read.h"
#include "encoder/input/dataset_read.h"
#include "encoder/output/atomic_file.h"
#include "encoder/output/btf_exr_write.h"
#include "test_support.h"

namespace btfc {
namespace {

DatasetInfo info_of(std::uint32_t views, std::uint32_t lights, std::uint32_t width, std::uint32_t height,
                    std::vector<std::string> channels, SampleType type) {
  DatasetInfo info;
  info.width = width;
  info.height = height;
  info.channels = std::move(channels);
  info.type = type;
  info.colour_space =
      type == SampleType::float16 ? ColourSpace::lin_rec709_scene : ColourSpace::srgb_rec709_scene;
  const std::vector<Direction> all = ubo2014_directions();
  info.views.assign(all.begin(), all.begin() + views);
  info.lights.assign(all.rbegin(), all.rbegin() + lights);
  make_full_product(info);
  return info;
}

// Noise in every image; float16 values are finite.
Dataset dataset_of(const DatasetInfo& info, std::uint64_t seed = 1) {
  Result<Dataset> dataset = Dataset::create(info, "");
  if (!dataset) {
    ADD_FAILURE() << dataset.error().message;
    std::abort();
  }
  for (std::size_t p = 0; p < info.pairs.size(); ++p) {
    const Image image = test::noise(info.width, info.height, info.channel_count(), info.type, seed + p);
    dataset->write_image(p, image.codes);
  }
  return std::move(*dataset);
}

void expect_same(const Dataset& got, const Dataset& wanted) {
  const DatasetInfo &a = got.info(), &b = wanted.info();
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.channels, b.channels);
  EXPECT_EQ(a.type, b.type);
  EXPECT_EQ(a.colour_space, b.colour_space);
  EXPECT_EQ(a.quantity, b.quantity);
  EXPECT_EQ(a.wraps, b.wraps);
  ASSERT_EQ(a.pairs, b.pairs);
  ASSERT_EQ(a.views.size(), b.views.size());
  ASSERT_EQ(a.lights.size(), b.lights.size());
  for (const auto& list : {&DatasetInfo::views, &DatasetInfo::lights}) {
    for (std::size_t i = 0; i < (a.*list).size(); ++i) {
      EXPECT_NEAR((a.*list)[i].theta, (b.*list)[i].theta, 1e-15);
      EXPECT_NEAR((a.*list)[i].phi, (b.*list)[i].phi, 2e-15);
    }
  }
  for (std::size_t p = 0; p < a.pairs.size(); ++p) ASSERT_EQ(got.image(p).codes, wanted.image(p).codes) << p;
}

class BtfExrTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "btfc-exr-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    path_ = folder_ + "/t.exr";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void put(const Bytes& bytes) const {
    std::filesystem::remove(path_);  // truncating would wait for the disk
    std::FILE* file = std::fopen(path_.c_str(), "wb");
    if (!bytes.empty()) std::fwrite(bytes.data(), 1, bytes.size(), file);
    std::fclose(file);
  }
  Bytes taken() const {
    const Result<Bytes> bytes = read_file(path_);
    EXPECT_TRUE(bytes);
    return *bytes;
  }
  std::string folder_, path_;
};

TEST_F(BtfExrTest, ThereAndBack) {
  const std::vector<std::vector<std::string>> channel_sets = {
      {"R", "G", "B"}, {"Y"}, {"450", "500.5", "1000", "B", "an_uncommonly_long_name_of_a_channel"}};
  for (const auto& channels : channel_sets) {
    for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
      for (const bool product : {true, false}) {
        DatasetInfo info = info_of(4, 5, 19, 37, channels, type);
        if (!product) {  // light 0 comes late, and its number must stay
          info.pairs = {{0, 2}, {0, 4}, {1, 0}, {1, 1}, {1, 3}, {2, 2}, {3, 0}};
          info.quantity = Quantity::reflectance_cos;
          info.wraps = true;
          info.colour_space = ColourSpace::lin_ap1_scene;
        }
        const Dataset dataset = dataset_of(info);
        std::size_t seen = 0;
        const auto wrote = write_btf_exr(dataset, path_, [&](std::size_t done, std::size_t total) {
          EXPECT_EQ(done, ++seen);
          EXPECT_EQ(total, info.pairs.size());
        });
        ASSERT_TRUE(wrote) << wrote.error().message;
        EXPECT_EQ(seen, info.pairs.size());
        ASSERT_TRUE(is_dataset(path_));
        const auto got = read_dataset(path_, {});
        ASSERT_TRUE(got) << got.error().message;
        EXPECT_EQ(got->kind, "btf_exr");
        expect_same(got->dataset, dataset);
      }
    }
  }
}

TEST_F(BtfExrTest, OneViewOneLightOneTexel) {
  for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
    const Dataset dataset = dataset_of(info_of(1, 1, 1, 1, {"R", "G", "B"}, type));
    ASSERT_TRUE(write_btf_exr(dataset, path_));
    const auto got = read_dataset(path_, {});
    ASSERT_TRUE(got) << got.error().message;
    expect_same(got->dataset, dataset);
  }
}

TEST_F(BtfExrTest, EveryCodeComesBack) {
  for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
    const std::uint32_t side = type == SampleType::unorm8 ? 16 : 256;
    auto dataset = Dataset::create(info_of(1, 1, side, side, {"Y"}, type), "");
    ASSERT_TRUE(dataset);
    std::vector<std::uint16_t> codes(std::size_t{side} * side);
    for (std::size_t i = 0; i < codes.size(); ++i) {
      codes[i] = static_cast<std::uint16_t>(i);
      if (type == SampleType::float16 && (i & 0x7c00u) == 0x7c00u) codes[i] = 0;
    }
    dataset->write_image(0, codes);
    ASSERT_TRUE(write_btf_exr(*dataset, path_));
    const auto got = read_dataset(path_, {});
    ASSERT_TRUE(got) << got.error().message;
    EXPECT_EQ(got->dataset.image(0).codes, codes);
  }
}

TEST_F(BtfExrTest, ThreadsDoNotChangeTheFile) {
  const Dataset dataset = dataset_of(info_of(5, 6, 33, 21, {"R", "G", "B"}, SampleType::float16));
  ASSERT_TRUE(write_btf_exr(dataset, path_));
  const Bytes bytes = taken();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  ASSERT_TRUE(write_btf_exr(dataset, path_));
  EXPECT_EQ(taken(), bytes);
}

TEST_F(BtfExrTest, CropsAreThoseOfTheImages) {
  const Dataset dataset = dataset_of(info_of(2, 3, 31, 70, {"R", "G", "B"}, SampleType::unorm8));
  ASSERT_TRUE(write_btf_exr(dataset, path_));
  for (const Rectangle& r : {Rectangle{3, 20, 17, 40}, Rectangle{0, 69, 31, 1}, Rectangle{30, 0, 1, 16}}) {
    DatasetReadOptions options;
    options.crop = r;
    const auto got = read_dataset(path_, options);
    ASSERT_TRUE(got) << got.error().message;
    for (std::size_t p = 0; p < 6; ++p) {
      EXPECT_EQ(got->dataset.image(p).codes, crop(dataset.image(p), r.x, r.y, r.width, r.height).codes);
    }
  }
  DatasetReadOptions outside;
  outside.crop = Rectangle{1, 0, 31, 70};
  EXPECT_FALSE(read_dataset(path_, outside));
}

// Noise whose compressed chunks come out smaller, larger and just as large as the samples.
TEST_F(BtfExrTest, ChunksOfAnySizeComeBack) {
  const Dataset dataset = dataset_of(info_of(9, 9, 19, 5, {"R", "G", "B"}, SampleType::unorm8));
  ASSERT_TRUE(write_btf_exr(dataset, path_));
  const auto got = read_dataset(path_, {});
  ASSERT_TRUE(got) << got.error().message;
  expect_same(got->dataset, dataset);
}

TEST_F(BtfExrTest, DirectionsNearerThanNamesTell) {
  DatasetInfo info = info_of(3, 1, 2, 2, {"Y"}, SampleType::unorm8);
  info.views = {{0, 0}, {0, 1}, {0.3, 1}};
  info.views.push_back({0.3 + 1e-7, 1});
  info.views.push_back({std::acos(0.0), 6});
  make_full_product(info);
  const Dataset dataset = dataset_of(info);
  ASSERT_TRUE(write_btf_exr(dataset, path_));
  const auto got = read_dataset(path_, {});
  ASSERT_TRUE(got) << got.error().message;
  expect_same(got->dataset, dataset);
}

TEST_F(BtfExrTest, UnusedDirectionsAreLeftOut) {
  DatasetInfo info = info_of(3, 3, 2, 2, {"Y"}, SampleType::unorm8);
  info.pairs = {{0, 2}, {2, 1}};
  ASSERT_TRUE(write_btf_exr(dataset_of(info), path_));
  const auto got = read_dataset(path_, {});
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_EQ(got->dataset.info().views.size(), 2u);
  EXPECT_EQ(got->dataset.info().pairs, (std::vector<DirectionPair>{{0, 1}, {1, 0}}));
  EXPECT_TRUE(same_direction(got->dataset.info().views[1], info.views[2]));
}

TEST_F(BtfExrTest, NamesThatExrCannotHoldAreRefused) {
  for (const auto& channels :
       std::vector<std::vector<std::string>>{{"R", "R"}, {""}, {std::string(256, 'x')}}) {
    EXPECT_FALSE(write_btf_exr(dataset_of(info_of(1, 1, 1, 1, channels, SampleType::unorm8)), path_));
    EXPECT_FALSE(std::filesystem::exists(path_));
  }
  const Dataset dataset = dataset_of(info_of(1, 1, 1, 1, {"Y"}, SampleType::unorm8));
  EXPECT_FALSE(write_btf_exr(dataset, folder_ + "/missing/t.exr"));
  ASSERT_TRUE(write_btf_exr(dataset, path_));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
}

// What OpenEXR's C++ classes see in our files.
TEST_F(BtfExrTest, OpenExrReadsTheFile) {
  DatasetInfo info = info_of(2, 3, 9, 20, {"R", "G", "B"}, SampleType::float16);
  info.wraps = true;
  const Dataset dataset = dataset_of(info);
  ASSERT_TRUE(write_btf_exr(dataset, path_));
  Imf::MultiPartInputFile file(path_.c_str());
  ASSERT_EQ(file.parts(), 6);
  std::set<std::string> names;
  for (int p = 0; p < 6; ++p) {
    const Imf::Header& header = file.header(p);
    names.insert(header.name());
    const DirectionPair pair = info.pairs[static_cast<std::size_t>(p)];
    const auto view = header.typedAttribute<Imf::V2dAttribute>("btfc:view").value();
    const auto light = header.typedAttribute<Imf::V2dAttribute>("btfc:light").value();
    EXPECT_NEAR(view.x, degrees(info.views[pair.view].theta), 1e-12);
    EXPECT_NEAR(view.y, degrees(info.views[pair.view].phi), 1e-12);
    EXPECT_NEAR(light.x, degrees(info.lights[pair.light].theta), 1e-12);
    EXPECT_EQ(header.compression(), Imf::ZIP_COMPRESSION);
    EXPECT_EQ(header.dataWindow(), Imath::Box2i({0, 0}, {8, 19}));
    std::vector<half> samples(9 * 20 * 3);
    Imf::FrameBuffer buffer;
    const char* channels[] = {"R", "G", "B"};
    for (std::size_t c = 0; c < 3; ++c) {
      buffer.insert(channels[c], Imf::Slice(Imf::HALF, reinterpret_cast<char*>(&samples[c]), 6, 54));
    }
    Imf::InputPart part(file, p);
    part.setFrameBuffer(buffer);
    part.readPixels(0, 19);
    const Image image = dataset.image(static_cast<std::size_t>(p));
    for (std::size_t i = 0; i < samples.size(); ++i) ASSERT_EQ(samples[i].bits(), image.codes[i]);
  }
  EXPECT_EQ(names.size(), 6u);
  EXPECT_TRUE(names.count("v000.000_000.000 l075.000_345.000")) << *names.begin();
  EXPECT_EQ(file.header(0).typedAttribute<Imf::IntAttribute>("btfc:version").value(), 1);
  EXPECT_EQ(file.header(0).typedAttribute<Imf::IntAttribute>("btfc:wraps").value(), 1);
}

// A writer that knows spec/interchange.md alone, with the fewest attributes, parts in any order and a data
// window that begins elsewhere.
class Foreign {
 public:
  explicit Foreign(const std::string& path) : path_(path) {}
  std::vector<Imath::V2d> views = {{30, 120}, {0, 0}, {30, 120}, {0, 0}};
  std::vector<Imath::V2d> lights = {{60, -90}, {60, -90}, {75, 10}, {75, 10}};
  Imf::PixelType type = Imf::HALF;
  Imf::Compression compression = Imf::ZIPS_COMPRESSION;
  std::vector<std::string> channels = {"R", "G", "B"};
  float value = 0.5f;  // of the first sample; others count up by 1/1024
  bool version = true;
  int without_light = -1;  // a part
  std::function<void(int part, Imf::Header& header)> edit;

  void write() const {
    std::vector<Imf::Header> headers;
    const Imath::Box2i window({-3, 7}, {1, 25});
    for (std::size_t p = 0; p < views.size(); ++p) {
      Imf::Header header(window, window);
      header.setName(fmt::format("part {}", p));
      header.setType(Imf::SCANLINEIMAGE);
      header.compression() = compression;
      for (const std::string& name : channels) header.channels().insert(name, Imf::Channel(type));
      header.insert("btfc:view", Imf::V2dAttribute(views[p]));
      if (static_cast<int>(p) != without_light) header.insert("btfc:light", Imf::V2dAttribute(lights[p]));
      if (p == 0 && version) header.insert("btfc:version", Imf::IntAttribute(1));
      if (edit) edit(static_cast<int>(p), header);
      headers.push_back(header);
    }
    std::filesystem::remove(path_);
    Imf::MultiPartOutputFile file(path_.c_str(), headers.data(), static_cast<int>(headers.size()));
    for (std::size_t p = 0; p < views.size(); ++p) {
      std::vector<float> samples(5 * 19 * channels.size());
      for (std::size_t i = 0; i < samples.size(); ++i) {
        samples[i] = static_cast<float>(p) + static_cast<float>(i) / 1024;
      }
      samples[0] = value;
      std::vector<half> halves(samples.begin(), samples.end());
      Imf::FrameBuffer buffer;
      for (std::size_t c = 0; c < channels.size(); ++c) {
        const std::size_t size = type == Imf::HALF ? 2 : 4, x = channels.size() * size, y = 5 * x;
        char* data =
            type == Imf::HALF ? reinterpret_cast<char*>(&halves[c]) : reinterpret_cast<char*>(&samples[c]);
        buffer.insert(channels[c], Imf::Slice::Make(type, data, window, x, y));
      }
      Imf::OutputPart part(file, static_cast<int>(p));
      part.setFrameBuffer(buffer);
      part.writePixels(19);
    }
  }

 private:
  std::string path_;
};

TEST_F(BtfExrTest, ForeignFilesAreRead) {
  for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT}) {
    for (const Imf::Compression compression :
         {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,
          Imf::PIZ_COMPRESSION}) {
      Foreign foreign(path_);
      foreign.type = type;
      foreign.compression = compression;
      foreign.write();
      const auto got = read_dataset(path_, {});
      ASSERT_TRUE(got) << got.error().message;
      const DatasetInfo& info = got->dataset.info();
      EXPECT_EQ(info.type, SampleType::float16);
      EXPECT_EQ(info.channels, (std::vector<std::string>{"R", "G", "B"}));
      EXPECT_EQ(info.quantity, Quantity::unspecified);
      EXPECT_EQ(info.colour_space, ColourSpace::unknown);
      EXPECT_FALSE(info.wraps);
      EXPECT_EQ(info.width, 5u);
      EXPECT_EQ(info.height, 19u);
      ASSERT_TRUE(info.full_product());
      ASSERT_EQ(info.views.size(), 2u);
      EXPECT_TRUE(same_direction(info.views[0], direction_from_degrees(30, 120)));
      EXPECT_TRUE(same_direction(info.lights[0], direction_from_degrees(60, 270)));
      // Parts 0, 2, 1, 3 by view, then light.
      const double expected[] = {0, 2, 1, 3};
      for (std::size_t p = 0; p < 4; ++p) {
        EXPECT_EQ(code_value(SampleType::float16, got->dataset.image(p).codes[0]), 0.5f);
        EXPECT_EQ(code_value(SampleType::float16, got->dataset.image(p).codes[128]), expected[p] + 0.125);
      }
    }
  }
}

// A chunk that says it is shorter than its samples: OpenEXR would fill up with whatever memory holds.
TEST_F(BtfExrTest, ShortChunksAreRefused) {
  Foreign foreign(path_);
  foreign.compression = Imf::NO_COMPRESSION;
  foreign.write();
  Bytes bytes = taken();
  const std::size_t samples = 5 * 3 * 2;  // of the last row, behind part, row and size
  std::uint8_t* size = &bytes[bytes.size() - samples - 4];
  ASSERT_EQ(load_u32(size), samples);
  store_u32(size, 10);
  put(bytes);
  EXPECT_FALSE(read_dataset(path_, {}));
}

TEST_F(BtfExrTest, OtherExrFilesAreNoDatasets) {
  Foreign foreign(path_);
  foreign.version = false;
  foreign.write();
  EXPECT_FALSE(is_dataset(path_));
  EXPECT_FALSE(read_btf_exr(path_, {}));
  ASSERT_TRUE(write_image(path_, test::noise(8, 8, 3, SampleType::float16)));
  EXPECT_FALSE(is_dataset(path_));
  EXPECT_FALSE(is_dataset(folder_));
  EXPECT_FALSE(is_dataset(folder_ + "/missing.exr"));
}

TEST_F(BtfExrTest, FaultsAreNamed) {
  struct Fault {
    std::function<void(Foreign&)> make;
    std::string message;
    Status status = Status::invalid_file;
  };
  const auto edit = [](std::function<void(int, Imf::Header&)> change) {
    return [change](Foreign& f) { f.edit = change; };
  };
  const auto text = [&](const char* name, const char* value) {
    return edit([=](int part, Imf::Header& h) {
      if (part == 0) h.insert(name, Imf::StringAttribute(value));
    });
  };
  const std::vector<Fault> faults = {
      {[](Foreign& f) {
         f.views[1] = f.views[2];
         f.lights[1] = f.lights[2];
       },
       "parts 1 and 2 have the same view"},
      {[](Foreign& f) { f.views[2].x = 91; }, "part 2 has btfc:view (91, 120), expected theta 0 to 90"},
      {[](Foreign& f) { f.lights[3].y = NAN; }, "part 3 has btfc:light (75, nan)"},
      {[](Foreign& f) { f.compression = Imf::PXR24_COMPRESSION; }, "lossy compression", Status::unsupported},
      {[](Foreign& f) { f.value = INFINITY; }, "part 0 has inf at (0, 0)"},
      {[](Foreign& f) {
         f.value = NAN;
         f.type = Imf::FLOAT;
       },
       "part 0 has nan at (0, 0)"},
      {[](Foreign& f) {
         f.value = 70000;
         f.type = Imf::FLOAT;
       },
       "part 0 has 70000 at (0, 0)"},
      {[](Foreign& f) { f.type = Imf::UINT; }, "expected half or float samples"},
      {edit([](int part, Imf::Header& h) {
         if (part == 0) h.insert("btfc:version", Imf::IntAttribute(2));
       }),
       "btfc:version is 2, expected 1", Status::unsupported},
      {edit([](int part, Imf::Header& h) {
         if (part == 0) h.insert("btfc:wraps", Imf::IntAttribute(2));
       }),
       "btfc:wraps is '2'"},
      {edit([](int part, Imf::Header& h) {
         if (part == 2) h.insert("btfc:pair", Imf::V2iAttribute({1, 1}));
       }),
       "part 2 differs from part 0 in having btfc:pair"},
      {edit([](int part, Imf::Header& h) {
         h.insert("btfc:pair", Imf::V2iAttribute({part / 2, 1}));
       }),
       "part 1 has btfc:view (0, 0), and another part has (30, 120) with the same number"},
      {edit([](int part, Imf::Header& h) {
         h.insert("btfc:pair", Imf::V2iAttribute({part - 1, part}));
       }),
       "part 0 has the number -1 in btfc:pair"},
      {[](Foreign& f) { f.without_light = 1; }, "part 1 has no btfc:light"},
      {edit([](int part, Imf::Header& h) {
         if (part == 3) h.channels().insert("A", Imf::Channel(Imf::HALF));
       }),
       "part 3 has other channels"},
      {text("btfc:sampleType", "unorm8"), "part 0 has"},
      {text("btfc:sampleType", "unorm16"), "expected float channels"},
      {text("btfc:sampleType", "float"), "btfc:sampleType is 'float'"},
      {text("btfc:quantity", "light"), "btfc:quantity is 'light'"},
      {text("btfc:colourSpace", "sRGB"), "btfc:colourSpace is 'sRGB'"},
  };
  for (const Fault& fault : faults) {
    Foreign foreign(path_);
    fault.make(foreign);
    foreign.write();
    const auto got = read_dataset(path_, {});
    ASSERT_FALSE(got) << fault.message;
    EXPECT_NE(got.error().message.find(fault.message), std::string::npos)
        << "expected '" << fault.message << "' in: " << got.error().message;
    EXPECT_EQ(got.error().status, fault.status) << got.error().message;
  }
}

TEST_F(BtfExrTest, EveryTruncationIsAnError) {
  const Dataset dataset = dataset_of(info_of(2, 2, 5, 18, {"R", "G", "B"}, SampleType::float16));
  ASSERT_TRUE(write_btf_exr(dataset, path_));
  const Bytes bytes = taken();
  // Every length within the headers, some within the samples and all within the last chunk's end.
  const std::size_t headers = 2200;
  ASSERT_GT(bytes.size(), 3 * headers / 2);
  std::size_t tried = 0;
  for (std::size_t size = 0; size < bytes.size();
       size += size < headers || size + 40 > bytes.size() ? 1 : 19, ++tried) {
    put(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)));
    const auto got = read_btf_exr(path_, {});
    ASSERT_FALSE(got) << size << " of " << bytes.size();
    ASSERT_FALSE(got.error().message.empty());
  }
  RecordProperty("truncations", static_cast<int>(tried));
}

// Random bytes at random places: an error or a data set, never a crash.
TEST_F(BtfExrTest, RandomDamageNeverCrashes) {
  std::mt19937 random(11);
  std::size_t refused = 0, tried = 0;
  for (const SampleType type : {SampleType::unorm8, SampleType::unorm16, SampleType::float16}) {
    const Dataset dataset = dataset_of(info_of(2, 2, 7, 18, {"R", "G", "B"}, type));
    ASSERT_TRUE(write_btf_exr(dataset, path_));
    const Bytes bytes = taken();
    for (int i = 0; i < 400; ++i, ++tried) {
      Bytes damaged = bytes;
      for (std::size_t n = 1 + random() % 3; n > 0; --n) {
        static constexpr std::uint8_t kBytes[] = {0, 1, 2, 0x7f, 0x80, 0xff};
        damaged[random() % damaged.size()] =
            random() % 2 == 0 ? kBytes[random() % 6] : static_cast<std::uint8_t>(random());
      }
      put(damaged);
      if (!read_btf_exr(path_, {})) ++refused;
      is_btf_exr(path_);
    }
  }
  EXPECT_GT(refused, tried / 10);
  RecordProperty("mutations", static_cast<int>(tried));
}

}  // namespace
}  // namespace btfc
