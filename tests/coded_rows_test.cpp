// Coded arrays: what rounding costs at each precision, and what a reader refuses.
#include "format/coded_rows.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

namespace btfc::test {
namespace {

TEST(CodedRows, RoundTripWithinHalfAStep) {
  std::mt19937 random(2);
  for (const Precision precision : {Precision::f32, Precision::f16, Precision::u8}) {
    for (const float range : {1e-6f, 1.0f, 60000.0f}) {
      const std::uint64_t rows = 5, columns = 37;
      std::vector<float> values(rows * columns);
      for (float& v : values) v = range * (static_cast<float>(random()) * 0x1p-31f - 1);
      const CodedRows coded = code_rows(values, rows, columns, precision);
      const Bytes raw = write_coded_rows(coded);
      EXPECT_EQ(raw.size(), coded_rows_bytes(rows, columns, precision).value());
      const Result<CodedRows> read = read_coded_rows(raw, rows, columns, precision, "X1", "an array");
      ASSERT_TRUE(read) << read.error().message;
      EXPECT_EQ(read->elements, coded.elements);
      for (std::uint64_t r = 0; r < rows; ++r) {
        for (std::uint64_t c = 0; c < columns; ++c) {
          const float v = values[r * columns + c];
          const float most = precision == Precision::f32   ? 0
                             : precision == Precision::f16 ? std::max(std::abs(v) * 0x1p-11f, 0x1p-25f)
                                                           : 0.5002f * read->scales[r].step;
          EXPECT_LE(std::abs(read->value(r, c) - v), most) << name_of(precision) << ' ' << v;
        }
      }
    }
  }
}

TEST(CodedRows, ExtremesStayInRange) {
  const std::vector<float> values = {3e38f, -3e38f, 0, 65504, -1e9f, 1e-45f};
  for (const Precision precision : {Precision::f32, Precision::f16, Precision::u8}) {
    const Bytes raw = write_coded_rows(code_rows(values, 2, 3, precision));
    EXPECT_TRUE(read_coded_rows(raw, 2, 3, precision, "X1", "an array"));
  }
  const CodedRows constant = code_rows(std::vector<float>(4, 0.3f), 1, 4, Precision::u8);
  EXPECT_EQ(constant.scales[0].step, 0);
  EXPECT_EQ(constant.value(0, 3), 0.3f);
}

TEST(CodedRows, FaultsAreRefused) {
  const auto refused = [](Bytes raw, Precision precision) {
    const Result<CodedRows> read = read_coded_rows(raw, 1, 3, precision, "X1", "an array");
    return !read && std::string(read.error().rule) == "X1";
  };
  const std::vector<float> values = {0.1f, 0.2f, 0.9f};
  Bytes f32 = write_coded_rows(code_rows(values, 1, 3, Precision::f32));
  for (const float bad : {std::numeric_limits<float>::infinity(), std::nanf(""), 5e9f, -5e9f}) {
    store_u32(&f32[4], std::bit_cast<std::uint32_t>(bad));
    EXPECT_TRUE(refused(f32, Precision::f32)) << bad;
  }
  Bytes f16 = write_coded_rows(code_rows(values, 1, 3, Precision::f16));
  ASSERT_EQ(f16.size(), 8u);
  f16[7] = 1;
  EXPECT_TRUE(refused(f16, Precision::f16));  // padding
  f16[7] = 0;
  store_u16(&f16[0], 0x7c00);
  EXPECT_TRUE(refused(f16, Precision::f16));
  const Bytes u8 = write_coded_rows(code_rows(values, 1, 3, Precision::u8));
  for (const float bad : {-1.0f, std::nanf(""), 1e8f}) {  // 255 steps of 1e8 leave the range
    Bytes raw = u8;
    store_u32(&raw[4], std::bit_cast<std::uint32_t>(bad));
    EXPECT_TRUE(refused(raw, Precision::u8)) << bad;
  }
}

}  // namespace
}  // namespace btfc::test
