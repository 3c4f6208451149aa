// Reading, checking and writing QUAL, and choosing from it.
#include "format/quality_curve.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace btfc {
namespace {

constexpr std::size_t kHeadBytes = 16, kPointBytes = 40;
constexpr std::uint32_t kMostLevels = 256, kMostGates = 32;

// A number that is there or, where the curve has no such measure, 0.
bool good(std::uint32_t measures, std::uint32_t measure, float v, double most) {
  if (!(v >= 0 && static_cast<double>(v) <= most)) return false;
  return (measures & measure) != 0 || v == 0;
}

// The same as sort keys, the best first: error, cost.
float error_of(const QualityCurve& curve, const QualityPoint& p) {
  return (curve.measures & kQualityDistance) != 0 ? p.distance : -p.psnr_db;
}

bool gives(const QualityPoint& p, const Wanted& w) {
  return (!w.psnr_db || p.psnr_db >= *w.psnr_db) && (!w.distance || p.distance <= *w.distance) &&
         (!w.operations || p.operations <= *w.operations);
}

}  // namespace

Bytes write_quality(const QualityCurve& curve) {
  Bytes raw(kHeadBytes + kPointBytes * curve.points.size());
  store_u32(&raw[0], static_cast<std::uint32_t>(curve.points.size()));
  store_u32(&raw[4], curve.measures);
  store_u32(&raw[8], curve.pairs);
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    const QualityPoint& p = curve.points[i];
    std::uint8_t* at = &raw[kHeadBytes + kPointBytes * i];
    store_u32(at, p.knobs.levels);
    store_u32(at + 4, p.knobs.gates);
    store_f32(at + 8, p.knobs.culling);
    store_f32(at + 12, p.psnr_db);
    store_f32(at + 16, p.mae_lab);
    store_f32(at + 20, p.distance);
    store_f32(at + 24, p.rate);
    store_u32(at + 28, p.operations);
    store_u32(at + 32, p.reads);
  }
  return raw;
}

Result<QualityCurve> read_quality(ByteView raw, std::uint32_t pairs) {
  if (raw.size() < kHeadBytes + kPointBytes || (raw.size() - kHeadBytes) % kPointBytes != 0)
    return invalid("QU1", 0, fmt::format("QUAL has {} bytes, expected 16 and 40 a point", raw.size()));
  const std::uint32_t count = load_u32(&raw[0]);
  QualityCurve curve{load_u32(&raw[4]), load_u32(&raw[8]), {}};
  if (count > kMostQualityPoints || count != (raw.size() - kHeadBytes) / kPointBytes) {
    return invalid("QU1", 0,
                   fmt::format("QUAL has {} points in {} bytes, expected 1 to {} of 40 bytes", count,
                               raw.size(), kMostQualityPoints));
  }
  if (curve.measures == 0 || (curve.measures & ~kAllQualityMeasures) != 0)
    return invalid("QU1", 4, fmt::format("QUAL has measures {}, expected 1 to 31", curve.measures));
  if (curve.pairs < 1 || curve.pairs > pairs) {
    return invalid("QU1", 8,
                   fmt::format("QUAL was measured under {} pairs, expected 1 to {}", curve.pairs, pairs));
  }
  if (load_u32(&raw[12]) != 0) return invalid("QU1", 12, "QUAL: reserved is not 0");
  std::set<std::tuple<std::uint32_t, std::uint32_t, float>> seen;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::size_t offset = kHeadBytes + kPointBytes * i;
    const std::uint8_t* at = &raw[offset];
    const QualityPoint p = {{load_u32(at), load_u32(at + 4), load_f32(at + 8)},
                            load_f32(at + 12),
                            load_f32(at + 16),
                            load_f32(at + 20),
                            load_f32(at + 24),
                            load_u32(at + 28),
                            load_u32(at + 32)};
    const auto wrong = [&](const char* what) {
      return invalid("QU2", offset, fmt::format("QUAL: point {} has {}", i, what));
    };
    if (p.knobs.levels > kMostLevels) return wrong("more than 256 levels");
    if (p.knobs.gates > kMostGates) return wrong("more than 32 gates");
    if (!(p.knobs.culling >= 0 && p.knobs.culling <= 1)) return wrong("a culling that is not 0 to 1");
    const std::uint32_t m = curve.measures;
    constexpr double kMost = 1e30;
    if (!good(m, kQualityPsnr, p.psnr_db, kMostQualityPsnr) || !good(m, kQualityLab, p.mae_lab, kMost) ||
        !good(m, kQualityDistance, p.distance, kMost) || !good(m, kQualityRate, p.rate, kMost))
      return wrong("a measure out of its range, or one that the curve has not");
    if ((m & kQualityCost) == 0 && (p.operations != 0 || p.reads != 0))
      return wrong("a cost, which the curve has not");
    if (load_u32(at + 36) != 0) return wrong("a reserved field that is not 0");
    if (!seen.insert(p.knobs.order()).second) return wrong("the knobs of a point before it");
    curve.points.push_back(p);
  }
  return curve;
}

Result<QualityPoint> choose_point(const QualityCurve& curve, const Wanted& w) {
  const auto has = [&](std::uint32_t measure) { return (curve.measures & measure) != 0; };
  if (!w.psnr_db && !w.distance && !w.operations)
    return bad_argument("nothing is wanted: neither an error nor a cost");
  if (w.psnr_db && !has(kQualityPsnr))
    return bad_argument("the file's curve has no psnr_db: its model does not keep texels in place");
  if (w.distance && !has(kQualityDistance))
    return bad_argument("the file's curve has no distance: its model keeps texels in place");
  if (w.operations && !has(kQualityCost)) return bad_argument("the file's curve has no cost");

  const bool by_error = w.psnr_db || w.distance;
  const auto before = [&](const QualityPoint& a, const QualityPoint& b) {
    const auto key = [&](const QualityPoint& p) {
      const double error = static_cast<double>(error_of(curve, p)), cost = p.operations;
      const double rate = -static_cast<double>(p.rate);
      return by_error ? std::array{cost, rate, error} : std::array{error, cost, rate};
    };
    return key(a) < key(b);
  };
  std::optional<QualityPoint> best;
  for (const QualityPoint& p : curve.points) {
    if (gives(p, w) && (!best || before(p, *best))) best = p;
  }
  if (best) return *best;

  // What there is instead.
  const QualityPoint nearest = *std::min_element(
      curve.points.begin(), curve.points.end(), [&](const QualityPoint& a, const QualityPoint& b) {
        return by_error ? error_of(curve, a) < error_of(curve, b) : a.operations < b.operations;
      });
  if (w.psnr_db && nearest.psnr_db < *w.psnr_db) {
    return bad_argument(
        fmt::format("no setting of the file has {} dB, the best has {:.2f}", *w.psnr_db, nearest.psnr_db));
  }
  if (w.distance && nearest.distance > *w.distance) {
    return bad_argument(fmt::format("no setting of the file has a distance of {}, the best has {:.4g}",
                                    *w.distance, nearest.distance));
  }
  return bad_argument(fmt::format("no setting of the file {}at {} operations a texel, the nearest takes {}",
                                  by_error ? "has that error " : "can be read ", *w.operations,
                                  nearest.operations));
}

}  // namespace btfc
