// Colour models of the University of Bonn's factored BTFs.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "format/result.h"

namespace btfc {

// Numbers as in the files. Not supported: 2, CIE Lab, which the authors' reader turns into display-coded
// sRGB by a profile, and 6, a spectral sum whose published formula does not invert any mean or sum.
enum class Ubo2014ColourCoding : std::int32_t {
  linear = 0,
  yuv = 1,
  pca = 3,
  ycocg = 4,
  spectral_sum = 5,  // the sum of the channels, then the shares of all but the first
  log_y_uv = 9,
  log_y_log_uv = 10,       // sign and logarithm of U and V
  log_y_relative_uv = 11,  // U and V over Y: the files of UBO2014
  log = 12,                // also the reduced dynamic range of FMF
};

struct Ubo2014Colour {
  Ubo2014ColourCoding coding = Ubo2014ColourCoding::linear;
  std::array<float, 3> mean{};    // of pca
  std::array<float, 9> matrix{};  // of pca, row-major: colour = coefficients (a row) x matrix + mean
};

// The model of that number, where it can be decoded for so many channels; else a sentence that says why not.
struct Ubo2014ColourChoice {
  Ubo2014ColourCoding coding = Ubo2014ColourCoding::linear;
  std::string fault;
};
Ubo2014ColourChoice choose_ubo2014_colour(std::int32_t number, std::size_t channels);

// Stored values to linear ones, in place: value i of channel c is values[c * stride + i]. Infinite or NaN
// where the numbers are out of range. Thread-safe.
void ubo2014_to_linear(const Ubo2014Colour& colour, std::size_t channels, std::size_t stride,
                       std::size_t count, float* values);

}  // namespace btfc
