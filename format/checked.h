// Unsigned 64-bit sizes that remember an overflow: the only place where sizes from a file are multiplied.
#pragma once
#include <cstdint>

namespace btfc {

// Sticky: once an operation overflowed, the result stays invalid. Test valid() before using value().
class CheckedSize {
 public:
  constexpr CheckedSize(std::uint64_t value = 0) : value_(value) {}
  constexpr bool valid() const { return valid_; }
  constexpr std::uint64_t value() const { return value_; }
  // The value, or the largest one where it overflowed: still right in a comparison against a limit.
  constexpr std::uint64_t saturated() const { return valid_ ? value_ : UINT64_MAX; }

  friend constexpr CheckedSize operator+(CheckedSize a, CheckedSize b) {
    CheckedSize r;
    r.valid_ = !__builtin_add_overflow(a.value_, b.value_, &r.value_) && a.valid_ && b.valid_;
    return r;
  }
  friend constexpr CheckedSize operator*(CheckedSize a, CheckedSize b) {
    CheckedSize r;
    r.valid_ = !__builtin_mul_overflow(a.value_, b.value_, &r.value_) && a.valid_ && b.valid_;
    return r;
  }

 private:
  std::uint64_t value_ = 0;
  bool valid_ = true;
};

constexpr std::uint64_t ceil_div(std::uint64_t n, std::uint64_t d) { return n / d + (n % d != 0 ? 1 : 0); }
constexpr CheckedSize ceil_div(CheckedSize n, std::uint64_t d) {
  return n.valid() ? CheckedSize(ceil_div(n.value(), d)) : n;
}

// Smallest b with 2^b >= n, for n >= 1.
constexpr unsigned ceil_log2(std::uint64_t n) {
  unsigned b = 0;
  while (b < 64 && (std::uint64_t{1} << b) < n) ++b;
  return b;
}

// Smallest multiple of the power of two 2^log2 that is >= n.
constexpr CheckedSize align_up(CheckedSize n, unsigned log2) {
  const CheckedSize up = n + CheckedSize((std::uint64_t{1} << log2) - 1);
  return up.valid() ? CheckedSize(up.value() >> log2 << log2) : up;
}

}  // namespace btfc
