// Arrays of numbers as chunks hold them: rows of f32, f16 or scaled u8 (spec/tables.md section 5).
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "format/bytes.h"
#include "format/checked.h"
#include "format/options.h"
#include "format/result.h"

namespace btfc {

enum class Precision : std::uint8_t { f32 = 0, f16 = 1, u8 = 2 };

const char* name_of(Precision precision);
inline constexpr const char* kPrecisionNames[] = {"f32", "f16", "u8"};
// The option's value, or `otherwise` where it is absent.
Result<Precision> parse_precision(const OptionValues& options, const char* name, Precision otherwise);

constexpr std::uint32_t element_bytes(Precision p) {
  return p == Precision::f32 ? 4 : p == Precision::f16 ? 2 : 1;
}

// Bytes of a chunk: the elements, filled up to a word, and with u8 eight bytes a row before them.
CheckedSize coded_rows_bytes(std::uint64_t rows, std::uint64_t columns, Precision precision);

struct RowScale {
  float offset = 0, step = 1;  // value = offset + step * element
  bool operator==(const RowScale&) const = default;
};
// Codes 0 … 255 between two values, which are clamped to +-2^31; a step of 0 where they are the same.
RowScale scale_between(float least, float most);
// What a value becomes once stored: the nearest element's value. scale is used by u8 only.
float rounded(float value, Precision precision, const RowScale& scale);

struct CodedRows {
  Precision precision = Precision::f32;
  std::uint64_t rows = 0, columns = 0;
  std::vector<RowScale> scales;  // one a row; of f32 and f16 all are {0, 1}
  std::vector<std::uint32_t>
      elements;  // rows x columns: bits of binary32, bits of binary16, or codes 0 … 255

  bool operator==(const CodedRows&) const = default;
  float element(std::uint64_t row, std::uint64_t column) const;
  float value(std::uint64_t row, std::uint64_t column) const;
};

// rows x columns finite values -> the nearest elements; values beyond 2^31 (f16: 65504) are clamped. u8: by
// the scales given, one a row, or between each row's least and most value.
CodedRows code_rows(std::span<const float> values, std::uint64_t rows, std::uint64_t columns,
                    Precision precision, std::span<const RowScale> scales = {});

Bytes write_coded_rows(const CodedRows& coded);
// raw has the size of coded_rows_bytes. Refused under `rule`: elements and values that are not
// finite or larger than 2^32, steps below 0, padding that is not 0. `what` names the array.
Result<CodedRows> read_coded_rows(ByteView raw, std::uint64_t rows, std::uint64_t columns,
                                  Precision precision, const char* rule, const std::string& what);

// Elements of 8, 16 or 32 bits in a run of words, in any order.
class ElementWriter {
 public:
  // Room for count elements behind what words holds.
  ElementWriter(std::vector<std::uint32_t>& words, std::uint64_t count, Precision precision);
  std::uint32_t first_word() const { return first_word_; }
  void set(std::uint64_t index, std::uint32_t element) {
    const unsigned bits = 8 * bytes_;
    const std::uint64_t bit = index * bits;
    words_[first_word_ + (bit >> 5)] |= element << (bit & 31);
  }

 private:
  std::vector<std::uint32_t>& words_;
  std::uint32_t first_word_;
  unsigned bytes_;
};

// Words that so many elements take.
constexpr std::uint64_t element_words(std::uint64_t count, Precision p) {
  return ceil_div(count * element_bytes(p), 4);
}

// Appends the scales, two words each.
void append_scales(std::span<const RowScale> scales, std::vector<std::uint32_t>& words);

}  // namespace btfc
