// Rows of numbers <-> bytes.
#include "format/coded_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "shaders/btfc_half.h"

namespace btfc {
namespace {

constexpr float kLargestHalf = 65504;
constexpr float kLargest = 4294967296.0f;  // 2^32: sums of products of two stay finite

// False for what is no number.
bool fit_value(float v) { return v >= -kLargest && v <= kLargest; }

float element_of(Precision precision, std::uint32_t e) {
  if (precision == Precision::f32) return std::bit_cast<float>(e);
  return precision == Precision::f16 ? btfc_half_to_float(e) : static_cast<float>(e);
}

std::uint32_t half_of(float value) {
  return btfc_float_to_half(std::clamp(value, -kLargestHalf, kLargestHalf));
}

std::uint32_t u8_of(float value, const RowScale& scale) {
  const double code = scale.step > 0 ? (static_cast<double>(value) - scale.offset) / scale.step : 0;
  return static_cast<std::uint32_t>(std::lround(std::clamp(code, 0.0, 255.0)));
}

std::uint32_t element_for(float value, Precision precision, const RowScale& scale) {
  if (precision == Precision::f32)
    return std::bit_cast<std::uint32_t>(std::clamp(value, -kLargest, kLargest));
  return precision == Precision::f16 ? half_of(value) : u8_of(value, scale);
}

}  // namespace

const char* name_of(Precision precision) { return kPrecisionNames[static_cast<std::size_t>(precision)]; }

Result<Precision> parse_precision(const OptionValues& options, const char* name, Precision otherwise) {
  const auto choice = parse_choice(options, name, kPrecisionNames);
  if (!choice) return choice.error();
  return *choice ? static_cast<Precision>(**choice) : otherwise;
}

CheckedSize coded_rows_bytes(std::uint64_t rows, std::uint64_t columns, Precision precision) {
  const CheckedSize elements = CheckedSize(rows) * CheckedSize(columns);
  const CheckedSize bytes = align_up(elements * CheckedSize(element_bytes(precision)), 2);
  return precision == Precision::u8 ? bytes + CheckedSize(8) * CheckedSize(rows) : bytes;
}

float CodedRows::element(std::uint64_t row, std::uint64_t column) const {
  return element_of(precision, elements[row * columns + column]);
}

float CodedRows::value(std::uint64_t row, std::uint64_t column) const {
  return scales[row].offset + scales[row].step * element(row, column);
}

RowScale scale_between(float least, float most) {
  const float offset = std::clamp(least, -kLargest / 2, kLargest / 2);
  const float end = std::clamp(most, -kLargest / 2, kLargest / 2);
  return {offset, static_cast<float>((static_cast<double>(end) - offset) / 255)};
}

float rounded(float value, Precision precision, const RowScale& scale) {
  const float element = element_of(precision, element_for(value, precision, scale));
  return precision == Precision::u8 ? scale.offset + scale.step * element : element;
}

CodedRows code_rows(std::span<const float> values, std::uint64_t rows, std::uint64_t columns,
                    Precision precision, std::span<const RowScale> scales) {
  CodedRows coded{precision, rows, columns, std::vector<RowScale>(rows), {}};
  coded.elements.reserve(values.size());
  for (std::uint64_t r = 0; r < rows; ++r) {
    const auto row = values.subspan(r * columns, columns);
    if (precision == Precision::u8) {
      const auto [least, most] = std::minmax_element(row.begin(), row.end());
      coded.scales[r] = scales.empty() ? scale_between(*least, *most) : scales[r];
    }
    for (const float v : row) coded.elements.push_back(element_for(v, precision, coded.scales[r]));
  }
  return coded;
}

Bytes write_coded_rows(const CodedRows& coded) {
  Bytes raw(coded_rows_bytes(coded.rows, coded.columns, coded.precision).value());
  std::uint8_t* to = raw.data();
  if (coded.precision == Precision::u8) {
    for (const RowScale& s : coded.scales) {
      store_f32(to, s.offset);
      store_f32(to + 4, s.step);
      to += 8;
    }
  }
  for (const std::uint32_t e : coded.elements) {
    if (coded.precision == Precision::f32) store_u32(to, e);
    if (coded.precision == Precision::f16) store_u16(to, static_cast<std::uint16_t>(e));
    if (coded.precision == Precision::u8) *to = static_cast<std::uint8_t>(e);
    to += element_bytes(coded.precision);
  }
  return raw;
}

Result<CodedRows> read_coded_rows(ByteView raw, std::uint64_t rows, std::uint64_t columns,
                                  Precision precision, const char* rule, const std::string& what) {
  CodedRows coded{precision, rows, columns, std::vector<RowScale>(rows), {}};
  const std::uint8_t* from = raw.data();
  for (std::uint64_t r = 0; precision == Precision::u8 && r < rows; ++r, from += 8) {
    RowScale& s = coded.scales[r];
    s = {load_f32(from), load_f32(from + 4)};
    if (!fit_value(s.offset) || !fit_value(s.step) || s.step < 0 || !fit_value(s.offset + s.step * 255)) {
      return invalid(rule, 0,
                     fmt::format("row {} of {} has offset {} and step {}, expected a step of at least 0 and "
                                 "values within 2^32",
                                 r, what, s.offset, s.step));
    }
  }
  coded.elements.resize(rows * columns);
  for (std::uint64_t i = 0; i < coded.elements.size(); ++i, from += element_bytes(precision)) {
    std::uint32_t& e = coded.elements[i];
    if (precision == Precision::f32) e = load_u32(from);
    if (precision == Precision::f16) e = load_u16(from);
    if (precision == Precision::u8) e = *from;
    if (precision != Precision::u8 && !fit_value(element_of(precision, e))) {
      return invalid(
          rule, 0,
          fmt::format("element {} of row {} of {} is no number within 2^32", i % columns, i / columns, what));
    }
  }
  for (; from != raw.data() + raw.size(); ++from) {
    if (*from != 0) return invalid(rule, 0, fmt::format("the padding of {} is not 0", what));
  }
  return coded;
}

ElementWriter::ElementWriter(std::vector<std::uint32_t>& words, std::uint64_t count, Precision precision)
    : words_(words), first_word_(static_cast<std::uint32_t>(words.size())), bytes_(element_bytes(precision)) {
  words.resize(words.size() + element_words(count, precision));
}

void append_scales(std::span<const RowScale> scales, std::vector<std::uint32_t>& words) {
  for (const RowScale& s : scales) {
    words.push_back(std::bit_cast<std::uint32_t>(s.offset));
    words.push_back(std::bit_cast<std::uint32_t>(s.step));
  }
}

}  // namespace btfc
