// QUAL: what a file's run-time knobs are worth, measured against what it was made from (spec/btfc.md section
// 5.5).
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "format/bytes.h"
#include "format/chunk.h"
#include "format/knobs.h"
#include "format/result.h"

namespace btfc {

// Not safe to copy: it speaks of the critical chunks.
inline constexpr std::uint32_t kQual = four_cc("QUAL");

// Which measures the points of a curve have; the others are 0.
enum QualityMeasure : std::uint32_t {
  kQualityPsnr = 1,      // of models that keep texels in place
  kQualityLab = 2,       // likewise, where channels are colours
  kQualityDistance = 4,  // of models that do not
  kQualityRate = 8,
  kQualityCost = 16,
};
inline constexpr std::uint32_t kAllQualityMeasures = 31;

// A PSNR is at most this, also where values equal the original.
inline constexpr double kMostQualityPsnr = 200;
inline constexpr std::uint32_t kMostQualityPoints = 1024;
inline constexpr std::uint64_t kMostQualityBytes = 16 + 40 * kMostQualityPoints;

struct QualityPoint {
  Knobs knobs;
  float psnr_db = 0, mae_lab = 0, distance = 0;
  float rate =
      0;  // of texels decoded by whole images on the CPU, over that of fetching random texels uncompressed
  std::uint32_t operations = 0, reads = 0;  // of a texel in a shader (TexelCost)
};

struct QualityCurve {
  std::uint32_t measures = 0;  // of QualityMeasure
  std::uint32_t pairs = 1;     // so many pairs of directions were measured
  std::vector<QualityPoint> points;
};

// The curve keeps rules QU1 and QU2; write then read gives the same.
Bytes write_quality(const QualityCurve& curve);

// Rules QU1 and QU2. pairs: of the file.
Result<QualityCurve> read_quality(ByteView raw, std::uint32_t pairs);

// What a caller asks of a file: any of the three, at least one.
struct Wanted {
  std::optional<float> psnr_db, distance;   // at least, at most
  std::optional<std::uint32_t> operations;  // a texel, at most
};

// Of the points that give what is wanted: the cheapest where an error is wanted, else that of the least
// error. Ties go to the better by the other, then to the higher rate, then to the first. The error says what
// is the nearest that there is.
Result<QualityPoint> choose_point(const QualityCurve& curve, const Wanted& wanted);

}  // namespace btfc
