// What fuzz targets make of their bytes: numbers, a file with choices behind it, and what must hold.
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "format/bytes.h"

#define FUZZ_CHECK(condition)                                                             \
  do {                                                                                    \
    if (!(condition)) {                                                                   \
      std::fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                       \
    }                                                                                     \
  } while (false)

namespace btfc::fuzz {

// Numbers from bytes; 0 where none are left.
class Choices {
 public:
  explicit Choices(ByteView bytes) : bytes_(bytes) {}
  std::size_t left() const { return bytes_.size() - at_; }
  std::uint8_t u8() { return left() > 0 ? bytes_[at_++] : std::uint8_t{0}; }
  std::uint16_t u16() {
    const std::uint16_t low = u8();
    return static_cast<std::uint16_t>(low | u8() << 8);
  }
  std::uint32_t u32() {
    const std::uint32_t low = u16();
    return low | std::uint32_t{u16()} << 16;
  }
  float f32() {
    const std::uint32_t bits = u32();
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  std::uint32_t below(std::uint32_t bound) { return bound == 0 ? 0 : (bound <= 256 ? u8() : u16()) % bound; }
  // At most so many of the bytes that are left.
  ByteView take(std::size_t most) {
    const ByteView some = bytes_.subspan(at_, most < left() ? most : left());
    at_ += some.size();
    return some;
  }

 private:
  ByteView bytes_;
  std::size_t at_ = 0;
};

// Targets of whole files take what is done with the file from so many bytes behind it.
inline constexpr std::size_t kChoiceBytes = 64;

struct FileInput {
  // The file in memory of exactly its size, so that a read beyond it is noticed.
  std::unique_ptr<std::uint8_t[]> data;
  std::size_t size = 0;
  ByteView choices;

  ByteView file() const { return {data.get(), size}; }
};

inline FileInput file_input(const std::uint8_t* data, std::size_t size) {
  FileInput input;
  input.size = size > kChoiceBytes ? size - kChoiceBytes : 0;
  input.data = std::make_unique<std::uint8_t[]>(input.size);
  if (input.size != 0) std::memcpy(input.data.get(), data, input.size);
  input.choices = {data + input.size, size - input.size};
  return input;
}

}  // namespace btfc::fuzz
