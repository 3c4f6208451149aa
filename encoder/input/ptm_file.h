// Polynomial texture maps as .ptm files (T. Malzbender et al.): read and write.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "format/bytes.h"
#include "format/result.h"

namespace btfc {

enum class PtmForm { rgb, lrgb };

// Coefficient k of a texel is scale[k] (byte - bias[k]), in the order of eq. 2 of the survey; a polynomial's
// values run from 0 to 255. Rows from the top.
struct PtmFile {
  PtmForm form = PtmForm::rgb;
  std::uint32_t width = 0, height = 0;
  std::array<double, 6> scale{};
  std::array<std::int32_t, 6> bias{};
  // rgb: [channel][texel][k], the three polynomials are the colour; lrgb: [texel][k], one polynomial, and
  std::vector<std::uint8_t> coefficients;
  // lrgb: [texel][channel], colour = this polynomial / 255.
  std::vector<std::uint8_t> colours;

  std::size_t texels() const { return std::size_t{width} * height; }
};

// Whether bytes begin as such a file does.
bool is_ptm_file(ByteView bytes);
// Versions 1.1 and 1.2, PTM_FORMAT_RGB and PTM_FORMAT_LRGB; the other forms are not supported. path is for
// errors.
Result<PtmFile> parse_ptm_file(const std::string& path, ByteView bytes);
// Version 1.2.
Bytes write_ptm_file(const PtmFile& file);

}  // namespace btfc
