// Makes one text compile as GLSL 4.60 and as C++20: types, qualifiers, and how data is read.
//
// GLSL: the including shader defines, before any model header, btfc_word(), btfc_param(), btfc_bound() and
// btfc_least(), as btfc.glsl says. C++: words come from a BtfcWords. Floating point is built with
// -ffp-contract=off, see CMakeLists.txt.
#ifndef BTFC_LANGUAGE_H
#define BTFC_LANGUAGE_H

#ifdef __cplusplus

#include <bit>
#include <cstdint>
#include <glm/glm.hpp>

namespace btfc {

using glm::ivec2;
using glm::max;
using glm::min;
using glm::sqrt;
using glm::uint;
using glm::uvec2;
using glm::uvec3;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;

// The word arrays of a loaded item; counts are for checks outside the maths.
struct BtfcWords {
  const std::uint32_t* slot[4];
};

inline uint btfc_word(const BtfcWords& words, uint slot, uint index) { return words.slot[slot][index]; }
// Where data that nobody checked may be read, bounds what a loop's end is taken from.
inline uint btfc_bound(uint value, uint) { return value; }
inline uint floatBitsToUint(float f) { return std::bit_cast<uint>(f); }
inline float uintBitsToFloat(uint u) { return std::bit_cast<float>(u); }

}  // namespace btfc

#define BTFC_BEGIN namespace btfc {
#define BTFC_END }
#define BTFC_FN inline
#define BTFC_WORDS const BtfcWords&
#define BTFC_IN(T) const T&
#define BTFC_OUT(T) T&
#define BTFC_INOUT(T) T&
#define BTFC_PRECISE

#else

#define BTFC_BEGIN
#define BTFC_END
#define BTFC_FN
#define BTFC_WORDS uint
#define BTFC_IN(T) T
#define BTFC_OUT(T) out T
#define BTFC_INOUT(T) inout T
#define BTFC_PRECISE precise

// Words of a map's parameters, as arguments of its struct: a number that is not the struct's does not
// compile.
#define BTFC_P(i) btfc_param(handle, i)
#define BTFC_P4(i) BTFC_P(i), BTFC_P(i + 1u), BTFC_P(i + 2u), BTFC_P(i + 3u)
#define BTFC_P16(i) BTFC_P4(i), BTFC_P4(i + 4u), BTFC_P4(i + 8u), BTFC_P4(i + 12u)

#endif

#endif
