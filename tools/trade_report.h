// A trade-off as a table and as JSON, and what stands in both.
#pragma once
#include <string>
#include <vector>

#include "tools/json.h"
#include "tools/trade_points.h"

namespace btfc {

// What a trade-off says beside its points.
struct TradeSummary {
  std::string input;
  std::uint32_t pairs = 1, measured_pairs = 1, looked_at_pairs = 1;  // of directions
  double seconds = 0;
  // Indices of points. The front of size: payload against error; of speed: slowness of whole images against
  // error. Models that keep texels in place first, then those that do not.
  std::vector<std::size_t> size_front, speed_front;
  // Of each bound the best that keeps texels, and the best that does not.
  struct Winner {
    std::uint64_t most = 0;
    std::optional<std::size_t> texels, texture;
  };
  std::vector<Winner> by_bytes, by_operations;
};

TradeSummary summary_of(const Trade& trade);

std::string trade_text(const Trade& trade, const TradeSummary& summary);
Json trade_json(const Trade& trade, const TradeSummary& summary);

// "24.1 KB"
std::string bytes_text(std::uint64_t bytes);
// "31.24 dB", or the distance that the point is judged by and its name.
std::string error_text(const TradePoint& point);

}  // namespace btfc
