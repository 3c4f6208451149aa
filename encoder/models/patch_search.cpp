// Plain search, and the driver of the fast one: positions are pruned once they can no longer matter.
#include "encoder/models/patch_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstddef>

namespace btfc {
namespace {

// Squared distances below this are candidates; an integer compare, since distances are integers.
double threshold_of(const BoundaryZone& zone, double tau) {
  std::uint64_t energy = 0;
  for (const std::int32_t value : zone.values) energy += static_cast<std::uint64_t>(value * value);
  return tau * tau * static_cast<double>(energy);
}

// What one row of positions contributes.
struct RowCandidates {
  Candidates below;  // distance below the threshold
  Candidates best;   // those that share the row's smallest distance, kept while `below` is empty
  std::uint64_t best_distance = UINT64_MAX;

  void add(PatchPosition at, std::uint64_t distance, double threshold) {
    if (static_cast<double>(distance) < threshold) {
      below.push_back(at);
    } else if (below.empty() && distance <= best_distance) {
      if (distance < best_distance) best.clear();
      best_distance = distance;
      best.push_back(at);
    }
  }
};

Candidates merge(const std::vector<RowCandidates>& rows) {
  Candidates all;
  for (const RowCandidates& row : rows) all.insert(all.end(), row.below.begin(), row.below.end());
  if (!all.empty()) return all;
  std::uint64_t best = UINT64_MAX;
  for (const RowCandidates& row : rows) best = std::min(best, row.best_distance);
  for (const RowCandidates& row : rows) {
    if (row.best_distance == best) all.insert(all.end(), row.best.begin(), row.best.end());
  }
  return all;
}

}  // namespace

Candidates find_candidates_plain(const MatchImage& sample, std::uint32_t patch_size, const BoundaryZone& zone,
                                 double tau) {
  const double threshold = threshold_of(zone, tau);
  std::vector<RowCandidates> rows(1);
  for (std::uint32_t y = 0; y + patch_size <= sample.height; ++y) {
    for (std::uint32_t x = 0; x + patch_size <= sample.width; ++x) {
      std::uint64_t distance = 0;
      const std::int16_t* shown = zone.values.data();
      for (const ZoneRun& run : zone.runs) {
        const std::int16_t* patch = sample.row(x + run.u, y + run.v);
        for (std::uint32_t t = 0; t < run.length * sample.channels; ++t) {
          const std::int32_t difference = *shown++ - patch[t];
          distance += static_cast<std::uint64_t>(difference * difference);
        }
      }
      rows[0].add({x, y}, distance, threshold);
    }
  }
  return merge(rows);
}

Candidates find_candidates(const SearchPlanes& sample, std::uint32_t patch_size, const BoundaryZone& zone,
                           double tau) {
  const double threshold = threshold_of(zone, tau);
  const ZoneTemplate wanted = zone_template(zone, sample);
  const std::uint32_t columns = sample.width() - patch_size + 1, row_count = sample.height() - patch_size + 1;
  // A distance above both the threshold and the best so far, of any thread, no longer matters; once a
  // candidate is below the threshold, only its like do. Which sums are given up depends on timing, the result
  // does not.
  std::atomic<std::uint64_t> best{UINT64_MAX};
  const auto bound = static_cast<std::uint64_t>(threshold);
  std::vector<RowCandidates> rows(row_count);
  tbb::parallel_for(std::uint32_t{0}, row_count, [&](std::uint32_t y) {
    constexpr std::uint32_t kGroup = 256;  // positions between two looks at the best so far
    std::uint64_t distances[kGroup];
    for (std::uint32_t x = 0; x < columns; x += kGroup) {
      const std::uint32_t count = std::min(kGroup, columns - x);
      const std::uint64_t limit = std::max(bound, best.load(std::memory_order_relaxed));
      zone_distances(sample, wanted, x, y, count, limit, distances);
      for (std::uint32_t p = 0; p < count; ++p) {
        if (distances[p] <= limit) rows[y].add({x + p, y}, distances[p], threshold);
      }
    }
    const std::uint64_t mine = rows[y].below.empty() ? rows[y].best_distance : 0;
    std::uint64_t seen = best.load(std::memory_order_relaxed);
    while (mine < seen && !best.compare_exchange_weak(seen, mine, std::memory_order_relaxed)) {
    }
  });
  return merge(rows);
}

}  // namespace btfc
