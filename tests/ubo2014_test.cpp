// Readers of the University of Bonn's BTF files against files written here, value by value.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "encoder/input/dataset_read.h"
#include "encoder/input/ubo2014_bdi.h"
#include "encoder/input/ubo2014_product.h"
#include "encoder/output/atomic_file.h"
#include "shaders/btfc_half.h"

namespace btfc {
namespace {

double half_of(double v) { return btfc_half_to_float(btfc_float_to_half(static_cast<float>(v))); }

// What a file of the tests holds, before it is laid out.
struct Recipe {
  std::string signature = "!DFMF08FCR";
  std::uint32_t version = 4, cosine = 1;
  float scale = 1;
  std::vector<std::string> channels = {"R", "G", "B"};
  std::uint32_t views = 3, lights = 4, width = 4, height = 3, rotations = 0;
  std::uint32_t components = 3;
  unsigned scalar_bytes = 2;
  bool transposed = false;  // DFMF, FMF: rows are texels; PVF: the dimension runs over texels
  std::int32_t model = 0;
  float mean[3] = {0.1f, 0.2f, 0.3f};
  float matrix[9] = {1, 0.2f, 0.1f, 0.3f, 0.9f, 0.05f, 0.02f, 0.1f, 1.1f};
  unsigned fmf_version = 2;
  std::uint32_t dynamic_range = 0, height_map = 0;
  std::uint32_t scan_lines = 2;
  unsigned compression = 2;
  bool holes = false;   // texels whose mask is 0
  bool padded = false;  // the last chunk is as large as the others
  double range = 0.6;   // of the factors' scalars
  std::uint64_t seed = 1;

  std::size_t pairs() const { return std::size_t{views} * lights; }
  std::size_t texels() const { return std::size_t{width} * height; }
};

using Matrix = std::vector<std::vector<double>>;

// The layout, with the offsets of what tests damage, and the values that it must decode to.
struct Written {
  Bytes bytes;
  std::map<std::string, std::size_t> marks;
  std::vector<double> values;  // [(pair * texels + texel) * channels + channel]

  void u8(unsigned v) { bytes.push_back(static_cast<std::uint8_t>(v)); }
  void u32(std::uint32_t v) {
    for (int i = 0; i < 4; ++i) u8(v >> (8 * i) & 255);
  }
  void f32(float v) { u32(std::bit_cast<std::uint32_t>(v)); }
  void text(const std::string& t, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) u8(i < t.size() ? static_cast<unsigned char>(t[i]) : 0);
  }
  void scalar(double v, unsigned size) {
    if (size == 2) {
      const std::uint32_t h = btfc_float_to_half(static_cast<float>(v));
      u8(h & 255);
      u8(h >> 8);
    } else if (size == 4) {
      f32(static_cast<float>(v));
    } else {
      const auto bits = std::bit_cast<std::uint64_t>(v);
      u32(static_cast<std::uint32_t>(bits));
      u32(static_cast<std::uint32_t>(bits >> 32));
    }
  }
  void matrix(const Matrix& m, unsigned size) {
    for (const auto& row : m) {
      for (const double v : row) scalar(v, size);
    }
  }
  void mark(const std::string& name) { marks[name] = bytes.size(); }
};

class Maker {
 public:
  explicit Maker(const Recipe& recipe) : r_(recipe), random_(recipe.seed) {}

  Written make() {
    out_.text(r_.signature, r_.signature.size());
    meta();
    directions();
    out_.mark("size");
    out_.u32(r_.width);
    out_.u32(r_.height);
    if (r_.signature.back() == 'R') rotations();
    out_.values.resize(r_.pairs() * r_.texels() * channels());
    if (r_.signature[1] == 'D') dfmf();
    if (r_.signature[1] == 'F') fmf();
    if (r_.signature[1] == 'P') pvf();
    if (r_.signature[1] == 'B') bdi();
    return std::move(out_);
  }

 private:
  std::size_t channels() const { return r_.channels.size(); }
  double& value(std::size_t pair, std::size_t texel, std::size_t c) {
    return out_.values[(pair * r_.texels() + texel) * channels() + c];
  }
  double uniform(double range) { return range * (static_cast<double>(random_() >> 11) * 0x1p-52 - 1); }
  double stored(double v) const {
    return r_.scalar_bytes == 2   ? half_of(v)
           : r_.scalar_bytes == 4 ? static_cast<double>(static_cast<float>(v))
                                  : v;
  }
  Matrix noise(std::size_t rows, std::size_t columns) {
    Matrix m(rows, std::vector<double>(columns));
    for (auto& row : m) {
      for (double& v : row) v = stored(uniform(r_.range));
    }
    return m;
  }
  static double dot(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
    return sum;
  }

  void meta() {
    Written block;
    block.u32(r_.version);
    for (const char* name : {"setup", "sensor", "light"}) block.text(name, 80);
    block.f32(12.5f);
    for (int i = 0; i < 3; ++i) block.f32(r_.scale);
    if (r_.version > 1) block.u32(r_.cosine);
    if (r_.version > 2) {
      block.u32(6);
      block.text("<btf/>", 6);
    }
    if (r_.version > 3) {
      block.mark("channels");
      block.u32(static_cast<std::uint32_t>(channels()));
      for (const std::string& name : r_.channels) {
        block.u32(static_cast<std::uint32_t>(name.size()));
        block.text(name, name.size());
      }
    }
    out_.mark("meta");
    out_.u32(static_cast<std::uint32_t>(block.bytes.size() + 4));
    for (const auto& [name, at] : block.marks) out_.marks[name] = out_.bytes.size() + at;
    out_.bytes.insert(out_.bytes.end(), block.bytes.begin(), block.bytes.end());
  }

  // Distinct, in rings of five.
  void direction(std::uint32_t i) {
    out_.f32(i == 0 ? 0.0f : 0.2f * static_cast<float>(1 + i % 5));
    out_.f32(static_cast<float>(std::remainder(0.77 * i, 6.28)));
  }
  void directions() {
    out_.mark("views");
    out_.u32(r_.views);
    for (std::uint32_t v = 0; v < r_.views; ++v) {
      out_.mark(fmt::format("view {}", v));
      direction(v);
      out_.mark(fmt::format("lights {}", v));
      out_.u32(r_.lights);
      for (std::uint32_t l = 0; l < r_.lights; ++l) direction(l);
    }
  }
  void rotations() {
    out_.mark("rotations");
    out_.u32(r_.rotations);
    for (std::uint32_t i = 0; i < 9 * r_.rotations; ++i) out_.f32(i % 4 == 0 ? 1 : 0);
  }
  void shape(std::size_t rows, std::size_t columns) {
    out_.mark("scalar");
    out_.u8(r_.scalar_bytes);
    out_.mark("components");
    out_.u32(r_.components);
    out_.mark("rows");
    out_.u32(static_cast<std::uint32_t>(rows));
    out_.u32(static_cast<std::uint32_t>(columns));
  }

  void dfmf() {
    out_.u32(r_.components);
    out_.mark("model");
    out_.u32(static_cast<std::uint32_t>(r_.model));
    for (const float v : r_.mean) out_.f32(v);
    for (const float v : r_.matrix) out_.f32(v);
    for (std::size_t c = 0; c < channels(); ++c) {
      const std::size_t rows = r_.transposed ? r_.texels() : r_.pairs();
      const std::size_t columns = r_.transposed ? r_.pairs() : r_.texels();
      shape(rows, columns);
      out_.matrix(noise(1, r_.components), r_.scalar_bytes);
      const Matrix u = noise(rows, r_.components), sxv = noise(columns, r_.components);
      out_.mark("U");
      out_.matrix(u, r_.scalar_bytes);
      out_.mark("SxV");
      out_.matrix(sxv, r_.scalar_bytes);
      for (std::size_t p = 0; p < r_.pairs(); ++p) {
        for (std::size_t t = 0; t < r_.texels(); ++t) {
          value(p, t, c) = r_.transposed ? dot(u[t], sxv[p]) : dot(u[p], sxv[t]);
        }
      }
    }
    for (std::size_t i = 0; i < out_.values.size(); i += channels()) to_linear(&out_.values[i]);
  }

  // The colour models once more, one texel at a time in doubles.
  void to_linear(double* v) const {
    const double e = 1e-5;
    if (channels() != 3 && r_.model != 5 && r_.model != 12) return;
    const auto yuv = [&](double y, double u, double w) {
      v[0] = y + 1.13983 * w;
      v[1] = y - 0.39465 * u - 0.5806 * w;
      v[2] = y + 2.03211 * u;
    };
    const auto log_uv = [&](double x) { return (x > 0 ? 1 : -1) * std::exp(std::fabs(x) + std::log(e)); };
    if (r_.model == 1) yuv(v[0], v[1], v[2]);
    if (r_.model == 3) {
      const double in[3] = {v[0], v[1], v[2]};
      for (int j = 0; j < 3; ++j) {
        v[j] = static_cast<double>(r_.mean[j]);
        for (int i = 0; i < 3; ++i) v[j] += in[i] * static_cast<double>(r_.matrix[3 * i + j]);
      }
    }
    if (r_.model == 4) {
      const double y = v[0], co = v[1], cg = v[2];
      v[0] = y + co - cg;
      v[1] = y + cg;
      v[2] = y - co - cg;
    }
    if (r_.model == 5) {
      double rest = 1;
      for (std::size_t c = 1; c < channels(); ++c) rest -= v[c];
      for (std::size_t c = 1; c < channels(); ++c) v[c] *= v[0];
      v[0] *= rest;
    }
    if (r_.model == 9) yuv(std::exp(v[0]) - e, v[1], v[2]);
    if (r_.model == 10) yuv(std::exp(v[0]) - e, log_uv(v[1]), log_uv(v[2]));
    if (r_.model == 11) {
      const double y = std::exp(v[0]) - e;
      yuv(y, v[1] * (y + e), v[2] * (y + e));
    }
    if (r_.model == 12) {
      for (std::size_t c = 0; c < channels(); ++c) v[c] = std::exp(v[c]) - e;
    }
  }

  void fmf() {
    if (r_.signature == "!FMF12FCER") {
      out_.mark("fmf version");
      out_.u8(r_.fmf_version);
      if (r_.fmf_version >= 1) out_.u32(r_.dynamic_range);
      if (r_.fmf_version >= 2) {
        out_.u32(r_.height_map);
        out_.u32(r_.height_map);
        for (std::uint32_t i = 0; i < r_.height_map * r_.height_map; ++i) out_.scalar(0.5, 2);
      }
    }
    out_.u32(r_.components);
    const std::size_t n = channels();
    const std::size_t rows = n * (r_.transposed ? r_.texels() : r_.pairs());
    const std::size_t columns = r_.transposed ? r_.pairs() : r_.texels();
    shape(rows, columns);
    out_.matrix(noise(1, r_.components), r_.scalar_bytes);
    const Matrix u = noise(rows, r_.components), sxv = noise(columns, r_.components);
    out_.matrix(u, r_.scalar_bytes);
    out_.matrix(sxv, r_.scalar_bytes);
    for (std::size_t p = 0; p < r_.pairs(); ++p) {
      for (std::size_t t = 0; t < r_.texels(); ++t) {
        for (std::size_t c = 0; c < n; ++c) {
          double& v = value(p, t, c);
          v = r_.transposed ? dot(u[t * n + c], sxv[p]) : dot(u[p * n + c], sxv[t]);
          if (r_.dynamic_range != 0) v = std::exp(v) - 1e-5;
        }
      }
    }
  }

  void pvf() {
    out_.u32(r_.components);
    out_.mark("slots");
    out_.u32(r_.views);
    const std::size_t n = channels();
    for (std::uint32_t view = 0; view < r_.views; ++view) {
      const std::size_t dimension = n * (r_.transposed ? r_.texels() : r_.lights);
      const std::size_t weights = r_.transposed ? r_.lights : r_.texels();
      shape(weights, dimension);
      out_.matrix(noise(1, r_.components), r_.scalar_bytes);
      const Matrix mean = noise(dimension, 1), basis = noise(dimension, r_.components);
      const Matrix weight = noise(weights, r_.components);
      out_.mark("mean");
      out_.matrix(mean, r_.scalar_bytes);
      out_.matrix(basis, r_.scalar_bytes);
      out_.matrix(weight, r_.scalar_bytes);
      for (std::size_t l = 0; l < r_.lights; ++l) {
        for (std::size_t t = 0; t < r_.texels(); ++t) {
          for (std::size_t c = 0; c < n; ++c) {
            const std::size_t d = (r_.transposed ? t : l) * n + c;
            value(view * r_.lights + l, t, c) = mean[d][0] + dot(basis[d], weight[r_.transposed ? l : t]);
          }
        }
      }
    }
  }

  void bdi() {
    out_.mark("scan lines");
    out_.u32(r_.scan_lines);
    out_.mark("compression");
    out_.u8(r_.compression);
    out_.mark("mask");
    std::vector<bool> there;
    for (std::size_t t = 0; t < r_.texels(); ++t) {
      const bool hole = r_.holes && t % 3 == 1;
      out_.u8(hole ? 0 : 1);
      there.push_back(r_.compression != 2 || !hole);
    }
    rotations();
    std::vector<std::size_t> stored;
    for (std::size_t t = 0; t < r_.texels(); ++t) {
      if (there[t]) stored.push_back(t);
    }
    const std::size_t chunk = std::size_t{r_.scan_lines} * r_.width;
    for (std::size_t first = 0; first < stored.size(); first += chunk) {
      const std::size_t count = std::min(chunk, stored.size() - first);
      out_.mark("chunk");
      const std::size_t texel_bytes = r_.pairs() * channels() * 2;
      out_.u32(static_cast<std::uint32_t>((r_.padded ? chunk : count) * texel_bytes));
      for (std::size_t i = first; i < first + count; ++i) {
        for (std::size_t p = 0; p < r_.pairs(); ++p) {
          for (std::size_t c = 0; c < channels(); ++c) {
            const double v = half_of(uniform(2));
            value(p, stored[i], c) = v;
            out_.scalar(v, 2);
          }
        }
      }
      if (r_.padded) out_.bytes.resize(out_.bytes.size() + (chunk - count) * texel_bytes);
    }
  }

  Recipe r_;
  std::mt19937_64 random_;
  Written out_;
};

class Ubo2014Test : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "btfc-ubo2014-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string put(const Bytes& bytes) const {
    const std::string path = folder_ + "/t.btf";
    std::filesystem::remove(path);  // truncating would wait for the disk
    std::FILE* file = std::fopen(path.c_str(), "wb");
    if (!bytes.empty()) std::fwrite(bytes.data(), 1, bytes.size(), file);
    std::fclose(file);
    return path;
  }
  Result<DatasetRead> read(const Bytes& bytes, const DatasetReadOptions& options = {}) const {
    return read_dataset(put(bytes), options);
  }
  std::string folder_;
};

std::vector<std::uint16_t> codes_of(const Dataset& dataset) {
  std::vector<std::uint16_t> all;
  for (std::size_t p = 0; p < dataset.info().pairs.size(); ++p) {
    const Image image = dataset.image(p);
    all.insert(all.end(), image.codes.begin(), image.codes.end());
  }
  return all;
}

// Within half's rounding of the value, and what single precision loses in a sum of small terms.
void expect_values(const Dataset& dataset, const std::vector<double>& values, const std::string& what) {
  const std::vector<std::uint16_t> codes = codes_of(dataset);
  ASSERT_EQ(codes.size(), values.size()) << what;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const double v = values[i], got = code_value(SampleType::float16, codes[i]);
    ASSERT_NEAR(got, v, std::fabs(v) * 0x1p-11 + 0x1p-25 + 1e-6 * std::max(1.0, std::fabs(v)))
        << what << " value " << i;
  }
}

// Recipes of all bodies, small enough to damage at every byte.
std::vector<Recipe> small_recipes() {
  std::vector<Recipe> all;
  for (const char* signature :
       {"!DFMF08FCR", "!FMF12FCER", "!FMF06FCR", "!FMF06FC", "!PVF06FCR", "!PVF06FC", "!BDIF06R2!"}) {
    Recipe r;
    r.signature = signature;
    r.views = r.lights = r.width = r.height = r.components = 2;
    r.lights = 3;
    r.scan_lines = 1;
    r.rotations = 1;
    r.holes = true;
    r.height_map = 1;
    r.model = 11;
    all.push_back(r);
  }
  return all;
}

TEST_F(Ubo2014Test, EveryBodyGivesItsValues) {
  const std::vector<std::vector<std::string>> channel_sets = {
      {"R", "G", "B"}, {"550.5"}, {"450", "500", "550", "600", "650"}};
  for (Recipe base : small_recipes()) {
    for (const auto& channels : channel_sets) {
      for (const unsigned scalar_bytes : {2u, 4u, 8u}) {
        for (const bool flag : {false, true}) {
          Recipe r = base;
          r.channels = channels;
          r.scalar_bytes = scalar_bytes;
          r.transposed = flag;
          r.views = 3;
          r.lights = 5;
          r.width = 7;
          r.height = 4;
          r.components = 4;
          r.model = channels.size() == 3 ? 11 : 12;
          r.dynamic_range = flag && r.signature == "!FMF12FCER" ? 1 : 0;
          r.compression = flag ? 2 : 0;
          r.padded = flag;
          r.scan_lines = flag ? 3 : 1;
          const std::string what = fmt::format("{} {} channels, {} bytes, transposed {}", r.signature,
                                               channels.size(), scalar_bytes, flag);
          const Written written = Maker(r).make();
          const auto got = read(written.bytes);
          ASSERT_TRUE(got) << what << ": " << got.error().message;
          EXPECT_EQ(got->kind, "ubo2014");
          EXPECT_EQ(got->dataset.info().channels, channels);
          EXPECT_EQ(got->dataset.info().colour_space,
                    channels.size() == 3 ? ColourSpace::lin_rec709_scene : ColourSpace::unknown);
          expect_values(got->dataset, written.values, what);
        }
      }
    }
  }
}

TEST_F(Ubo2014Test, EveryColourModel) {
  for (const std::int32_t model : {0, 1, 3, 4, 5, 9, 10, 11, 12}) {
    Recipe r;
    r.model = model;
    r.scalar_bytes = 4;
    const Written written = Maker(r).make();
    const auto got = read(written.bytes);
    ASSERT_TRUE(got) << got.error().message;
    expect_values(got->dataset, written.values, fmt::format("model {}", model));
  }
  for (const std::int32_t model : {-1, 2, 6, 7, 8, 13}) {
    Recipe r;
    r.model = model;
    const auto got = read(Maker(r).make().bytes);
    ASSERT_FALSE(got) << model;
    EXPECT_EQ(got.error().status, Status::unsupported);
    EXPECT_NE(got.error().message.find(fmt::format("colour model {}", model)), std::string::npos)
        << got.error().message;
  }
  Recipe spectral;
  spectral.model = 11;
  spectral.channels = {"450", "650"};
  EXPECT_FALSE(read(Maker(spectral).make().bytes));
}

TEST_F(Ubo2014Test, HeaderFieldsReachTheDataset) {
  for (std::uint32_t version = 1; version <= 4; ++version) {
    for (const std::uint32_t cosine : {0u, 1u}) {
      Recipe r;
      r.version = version;
      r.cosine = cosine;
      const auto got = read(Maker(r).make().bytes);
      ASSERT_TRUE(got) << got.error().message;
      const DatasetInfo& info = got->dataset.info();
      EXPECT_EQ(info.quantity, version == 1  ? Quantity::unspecified
                               : cosine == 1 ? Quantity::reflectance_cos
                                             : Quantity::reflectance);
      EXPECT_FALSE(info.wraps);
      EXPECT_TRUE(info.full_product());
      ASSERT_EQ(info.views.size(), 3u);
      ASSERT_EQ(info.lights.size(), 4u);
      EXPECT_NEAR(info.lights[3].theta, 0.8, 1e-6);
      EXPECT_NEAR(info.lights[3].phi, 2.31, 1e-6);
    }
  }
  Recipe r;
  r.scale = 0.5f;
  r.rotations = 2;
  r.channels = {"red", "green", "blue"};
  const auto got = read(Maker(r).make().bytes);
  ASSERT_TRUE(got) << got.error().message;
  EXPECT_EQ(got->dataset.info().channels, (std::vector<std::string>{"R", "G", "B"}));
  std::string notes;
  for (const std::string& note : got->notes) notes += note + "\n";
  for (const char* expected :
       {"RGB scale 0.5, 0.5, 0.5", "2 rotations", "'red', 'green', 'blue'", "below 0"}) {
    EXPECT_NE(notes.find(expected), std::string::npos) << expected << " in " << notes;
  }
  Recipe holes;
  holes.signature = "!BDIF06R2!";
  holes.holes = true;
  const auto sparse = read(Maker(holes).make().bytes);
  ASSERT_TRUE(sparse) << sparse.error().message;
  ASSERT_EQ(sparse->notes.size(), 1u);
  EXPECT_NE(sparse->notes[0].find("4 of 12 texels are not stored"), std::string::npos) << sparse->notes[0];
}

TEST_F(Ubo2014Test, AsManyImagesAsTexelsAreTakenAsRows) {
  Recipe r;  // 12 pairs and 12 texels
  r.views = 3;
  r.lights = 4;
  const Written written = Maker(r).make();
  const auto got = read(written.bytes);
  ASSERT_TRUE(got) << got.error().message;
  expect_values(got->dataset, written.values, "square");
  EXPECT_NE(got->notes[0].find("rows are taken as images"), std::string::npos);
}

// Tiles and blocks have borders: many images and texels, on one thread and on four, whole and cropped.
TEST_F(Ubo2014Test, BlocksTilesThreadsAndCropsAgree) {
  Recipe r;
  r.views = 9;
  r.lights = 11;
  r.width = 61;
  r.height = 37;
  r.components = 70;
  r.model = 11;
  r.range = 0.2;
  const Written written = Maker(r).make();
  const std::string path = put(written.bytes);
  std::size_t seen = 0;
  DatasetReadOptions options;
  options.progress = [&](std::size_t done, std::size_t total) {
    EXPECT_EQ(total, 99u);
    seen = std::max(seen, done);
  };
  const auto whole = read_dataset(path, options);
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(seen, 99u);
  expect_values(whole->dataset, written.values, "whole");
  const std::vector<std::uint16_t> codes = codes_of(whole->dataset);
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const auto again = read_dataset(path, {});
    ASSERT_TRUE(again);
    EXPECT_EQ(codes_of(again->dataset), codes);
  }
  options.crop = Rectangle{13, 5, 47, 30};
  const auto part = read_dataset(path, options);
  ASSERT_TRUE(part) << part.error().message;
  ASSERT_EQ(part->dataset.info().width, 47u);
  ASSERT_EQ(part->dataset.info().height, 30u);
  for (std::size_t p = 0; p < 99; ++p) {
    ASSERT_EQ(part->dataset.image(p).codes, crop(whole->dataset.image(p), 13, 5, 47, 30).codes);
  }
  options.crop = Rectangle{15, 5, 47, 30};
  EXPECT_FALSE(read_dataset(path, options));
}

TEST_F(Ubo2014Test, GatheringInGroupsGivesTheSameImages) {
  Recipe r;
  r.signature = "!BDIF06R2!";
  r.holes = true;
  const Written written = Maker(r).make();
  const auto file = Ubo2014File::open(put(written.bytes));
  ASSERT_TRUE(file);
  Ubo2014Cursor cursor(*file);
  Ubo2014Header header = read_ubo2014_header(cursor);
  const Ubo2014Bdi body = read_ubo2014_bdi(cursor, header);
  ASSERT_FALSE(cursor.failed()) << cursor.fault().message;
  for (const std::uint64_t bytes : {1u, 200u, 350u, 100000u}) {
    for (const Rectangle& crop : {Rectangle{0, 0, 4, 3}, Rectangle{1, 1, 2, 2}}) {
      DatasetInfo info;
      info.width = crop.width;
      info.height = crop.height;
      info.channels = header.channels;
      info.type = SampleType::float16;
      info.views = header.views;
      info.lights = header.lights;
      make_full_product(info);
      auto dataset = Dataset::create(info, "");
      ASSERT_TRUE(dataset);
      ASSERT_TRUE(gather_ubo2014_bdi(*file, header, body, crop, {}, *dataset, bytes));
      std::vector<double> expected;
      for (std::size_t p = 0; p < r.pairs(); ++p) {
        for (std::uint32_t y = crop.y; y < crop.y + crop.height; ++y) {
          for (std::uint32_t x = crop.x; x < crop.x + crop.width; ++x) {
            for (std::size_t c = 0; c < 3; ++c) {
              expected.push_back(written.values[(p * 12 + y * 4 + x) * 3 + c]);
            }
          }
        }
      }
      expect_values(*dataset, expected, fmt::format("{} bytes", bytes));
    }
  }
}

TEST_F(Ubo2014Test, EveryTruncationIsAnError) {
  std::size_t tried = 0;
  for (const Recipe& r : small_recipes()) {
    Bytes bytes = Maker(r).make().bytes;
    ASSERT_TRUE(read(bytes)) << r.signature;
    bytes.push_back(0);
    EXPECT_FALSE(read(bytes)) << r.signature << " with a byte more";
    for (std::size_t size = 0; size + 1 < bytes.size(); ++size, ++tried) {
      const auto got = read(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)));
      ASSERT_FALSE(got) << r.signature << " of " << size << " bytes";
      ASSERT_FALSE(got.error().message.empty());
    }
  }
  RecordProperty("truncations", static_cast<int>(tried));
}

// Random bytes at random places: an error or a data set, never a crash.
TEST_F(Ubo2014Test, RandomDamageNeverCrashes) {
  std::mt19937 random(7);
  std::size_t refused = 0, tried = 0;
  for (const Recipe& r : small_recipes()) {
    const Bytes bytes = Maker(r).make().bytes;
    for (int i = 0; i < 150; ++i, ++tried) {
      Bytes damaged = bytes;
      const std::size_t header = 260;  // names of setup and the like are no place for damage
      for (std::size_t n = 1 + random() % 3; n > 0; --n) {
        std::size_t at = random() % damaged.size();
        if (at > 18 && at < header) at = header + random() % (damaged.size() - header);
        static constexpr std::uint8_t kBytes[] = {0, 1, 2, 0x7f, 0x80, 0xff};
        damaged[at] = random() % 2 == 0 ? kBytes[random() % 6] : static_cast<std::uint8_t>(random());
      }
      if (!read(damaged)) ++refused;
    }
  }
  EXPECT_GT(refused, tried / 10);
  RecordProperty("mutations", static_cast<int>(tried));
}

// What a fault is called, and by which status.
struct Fault {
  std::string signature;
  std::string mark;      // where the damage begins
  std::size_t skip = 0;  // bytes behind the mark
  std::vector<std::uint8_t> bytes;
  std::string message;
  Status status = Status::invalid_file;
};

std::vector<std::uint8_t> word(std::uint32_t v) {
  return {static_cast<std::uint8_t>(v), static_cast<std::uint8_t>(v >> 8), static_cast<std::uint8_t>(v >> 16),
          static_cast<std::uint8_t>(v >> 24)};
}
std::vector<std::uint8_t> word(float v) { return word(std::bit_cast<std::uint32_t>(v)); }

TEST_F(Ubo2014Test, FaultsAreNamed) {
  const std::string dfmf = "!DFMF08FCR", fmf = "!FMF12FCER", pvf = "!PVF06FCR", bdi = "!BDIF06R2!";
  const std::vector<Fault> faults = {
      {dfmf, "meta", 0, word(7u), "the meta block has"},
      {dfmf, "meta", 4, word(2u), "the meta block has"},
      {dfmf, "channels", 0, word(0u), "0 channels"},
      {dfmf, "channels", 0, word(0xffffffffu), "4294967295 channels"},
      {dfmf, "channels", 4, word(0xfffffff0u), "within a channel's name"},
      {dfmf, "views", 0, word(0u), "0 views"},
      {dfmf, "views", 0, word(0xffffffffu), "4294967295 views"},
      {dfmf, "views", 0, word(60000u), "view 2 has"},
      {dfmf, "lights 0", 0, word(0u), "0 lights of view 0"},
      {dfmf, "lights 0", 0, word(60000u), "the lights of view 0"},
      {dfmf, "lights 1", 0, word(2u), "view 1 has 2 lights and view 0 has 3"},
      {dfmf, "lights 1", 12, word(0.5f), "light 1 of view 1 is"},
      {dfmf, "lights 0", 12, word(1.6f), "light 1 is (91.6"},
      {dfmf, "view 1", 0, word(-0.1f), "below the surface"},
      {dfmf, "view 1", 4, word(NAN), "view 1 has the angles"},
      {dfmf, "lights 0", 8, word(INFINITY), "light 0 has the angles"},
      {dfmf, "view 1", 0, word(0.0f), "view 0 (0, 0) and 1 (0"},
      {dfmf, "size", 0, word(0u), "images of 0x2 texels"},
      {dfmf, "size", 4, word(65537u), "images of 2x65537 texels"},
      {dfmf, "size", 0, word(3u), "is a matrix of 6 rows and 4 columns"},
      {dfmf, "rotations", 0, word(0xffffffffu), "within the rotations"},
      {dfmf, "rotations", 8, word(NAN), "rotation 0"},
      {dfmf, "scalar", 0, {3}, "scalars of 3 bytes"},
      {dfmf, "scalar", 0, {8}, "within U of channel 2"},
      {dfmf, "components", 0, word(0u), "0 components"},
      {dfmf, "components", 0, word(65537u), "65537 components"},
      {dfmf, "components", 0, word(3u), "the file ends within SxV of channel 2"},
      {dfmf, "components", 0, word(1u), "bytes follow the last field"},
      {dfmf, "rows", 0, word(0xffffffffu), "4294967295 rows"},
      {dfmf,
       "U",
       2 * 2 * 4,
       {0, 0x7e},
       "view 1 (22.9183, 44.1177), light 1 (22.9183, 44.1177), texel (0, 0), "
       "channel 'B' is nan"},
      {dfmf, "SxV", 2 * 2 * 2, {0, 0xfc}, "texel (0, 1), channel"},
      {dfmf, "model", 0, word(2u), "colour model 2 (CIE Lab)", Status::unsupported},
      {fmf, "fmf version", 0, {3}, "an FMF header of version 3", Status::unsupported},
      {fmf, "rows", 0, word(17u), "17 rows"},
      {pvf, "meta", 0, word(301074u), "older than the meta block", Status::unsupported},
      {pvf, "slots", 0, word(0u), "factorisations of 0 views, expected 2"},
      {pvf, "rows", 4, word(1u), "dimension 1"},
      {pvf, "mean", 0, {0, 0x7c}, "view 1"},
      {bdi, "scan lines", 0, word(0u), "chunks of 0 scan lines"},
      {bdi, "compression", 0, {1}, "bzip", Status::unsupported},
      {bdi, "compression", 0, {3}, "compression 3"},
      {bdi, "mask", 0, {0, 0, 0, 0}, "the mask leaves no texel"},
      {bdi, "chunk", 0, word(0xffffffffu), "chunk 1 has 4294967295 bytes"},
      {bdi, "chunk", 4, {0, 0x7c}, "texel (1, 1), channel 'R' is not finite"},
  };
  std::map<std::string, Recipe> recipes;
  for (const Recipe& r : small_recipes()) recipes[r.signature] = r;
  for (const Fault& fault : faults) {
    Written written = Maker(recipes[fault.signature]).make();
    ASSERT_TRUE(written.marks.count(fault.mark)) << fault.mark;
    std::copy(fault.bytes.begin(), fault.bytes.end(),
              written.bytes.begin() + static_cast<std::ptrdiff_t>(written.marks[fault.mark] + fault.skip));
    const auto got = read(written.bytes);
    ASSERT_FALSE(got) << fault.message;
    EXPECT_NE(got.error().message.find(fault.message), std::string::npos)
        << "expected '" << fault.message << "' in: " << got.error().message;
    EXPECT_EQ(got.error().status, fault.status) << got.error().message;
  }
}

TEST_F(Ubo2014Test, ValuesBeyondHalfAreNamed) {
  Recipe r;
  r.range = 300;
  r.scalar_bytes = 4;
  const auto got = read(Maker(r).make().bytes);
  ASSERT_FALSE(got);
  EXPECT_NE(got.error().message.find("expected finite values up to 65504"), std::string::npos)
      << got.error().message;
  EXPECT_NE(got.error().message.find("view "), std::string::npos);
  r.range = 9;
  r.model = 12;  // the exponential of a large sum
  EXPECT_FALSE(read(Maker(r).make().bytes));
}

TEST(Ubo2014Product, HalvesAreLoadedExactly) {
  std::vector<std::uint8_t> bytes;
  for (std::uint32_t h = 0; h < 65536; ++h) {
    bytes.push_back(static_cast<std::uint8_t>(h));
    bytes.push_back(static_cast<std::uint8_t>(h >> 8));
  }
  std::vector<float> values(65536);
  ubo2014_load_scalars(bytes.data(), 2, values.size(), values.data());
  for (std::uint32_t h = 0; h < 65536; ++h) {
    ASSERT_EQ(std::bit_cast<std::uint32_t>(values[h]), std::bit_cast<std::uint32_t>(btfc_half_to_float(h)))
        << h;
  }
}

TEST(Ubo2014Product, HalvesAreRoundedAsEverywhere) {
  std::vector<float> values;
  for (std::uint32_t h = 0; h < 0x7c00; ++h) {
    const float v = btfc_half_to_float(h), next = btfc_half_to_float(h + 1);
    const float middle = h + 1 == 0x7c00 ? 65520.0f : (v + next) / 2;
    for (const float each :
         {v, middle, std::nextafter(middle, 0.0f), std::nextafter(middle, 1e9f), std::nextafter(v, 0.0f)}) {
      values.push_back(each);
      values.push_back(-each);
    }
  }
  std::mt19937 random(3);
  for (int i = 0; i < 100000; ++i)
    values.push_back(std::bit_cast<float>(static_cast<std::uint32_t>(random())));
  std::vector<std::uint16_t> codes(values.size());
  ubo2014_to_half(values.data(), values.size(), codes.data());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) {
      ASSERT_EQ(codes[i] & 0x7fff, 0x7e00);
    } else {
      ASSERT_EQ(codes[i], btfc_float_to_half(values[i])) << values[i];
    }
  }
}

}  // namespace
}  // namespace btfc
