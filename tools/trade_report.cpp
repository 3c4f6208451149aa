// Fronts, winners, and how they are written down.
#include "tools/trade_report.h"

#include <fmt/format.h>

#include <algorithm>

namespace btfc {
namespace {

constexpr std::uint64_t kBytes[] = {8 << 10, 16 << 10, 64 << 10, 256 << 10, 1 << 20};
constexpr std::uint64_t kOperations[] = {100, 300, 1000, 3000, 10000};

Json number(const std::optional<double>& v) { return v ? Json(*v) : Json(); }

std::string cell(const std::optional<double>& v, int digits) {
  return v ? fmt::format("{:.{}f}", *v, digits) : "-";
}

// Rates against the raw look-up of the same run.
Json rates_json(const TradePoint& p) {
  const DecodeRates& r = p.is.rates;
  Json json = {{"lookup_mtexel_s", r.lookup / 1e6}, {"full_mtexel_s", r.full / 1e6},
               {"random_mtexel_s", r.random / 1e6}, {"batch_mtexel_s", r.batch / 1e6},
               {"full", r.full / r.lookup},         {"random", r.random / r.lookup},
               {"batch", r.batch / r.lookup}};
  if (p.is.device) {
    const ShaderRates& s = p.is.device->rates;
    json["vulkan"] = {{"device", p.is.device->device},
                      {"full_mtexel_s", s.full / 1e6},
                      {"random_mtexel_s", s.random_full / 1e6},
                      {"full", s.full / s.fetch},
                      {"random", s.random_full / s.random_fetch}};
  }
  return json;
}

Json point_json(const TradePoint& p) {
  const MeasuredError& e = p.is.error;
  Json json = {{"model", p.model->name},
               {"options", p.options},
               {"levels", p.is.knobs.levels},
               {"gates", p.is.knobs.gates},
               {"culling", p.is.knobs.culling},
               {"file", p.file},
               {"payload_bytes", p.is.payload_bytes},
               {"file_bytes", p.is.file_bytes},
               {"judged_by", judged_by(e, p.keeps_texels())},
               {"psnr_db", number(e.psnr_db)},
               {"mae_lab", number(e.mae_lab)},
               {"ssim", number(e.ssim)},
               {"flip", number(e.flip)},
               {"brdf_rmse_8bit", number(e.brdf_rmse_8bit)},
               {"colour_distance", number(e.colour_distance)},
               {"texture_distance", number(e.texture_distance)},
               {"fit_seconds", p.fit_seconds}};
  json["cost"] =
      p.is.cost ? Json({{"operations", p.is.cost->operations}, {"reads", p.is.cost->reads}}) : Json();
  json["rates"] = rates_json(p);
  return json;
}

std::string row(const TradePoint& p, bool size_front, bool speed_front) {
  const MeasuredError& e = p.is.error;
  const DecodeRates& r = p.is.rates;
  const auto distance = e.texture_distance ? e.texture_distance : e.colour_distance;
  const auto cost = [&](std::uint64_t TexelCost::*of) {
    return p.is.cost ? fmt::format("{}", p.is.cost.value().*of) : "-";
  };
  return fmt::format(
      "{:<6} {:<62} {:>9} {:>9} {:>7} {:>7} {:>6} {:>6} {:>8} {:>7.1f} {:>8.4f} {:>8.4f} {:>8} {:>8} {:>7} "
      "{:>7} {}{}",
      p.model->name, setting_text(p), p.is.payload_bytes, p.is.file_bytes, cell(e.psnr_db, 2),
      cell(e.mae_lab, 2), cell(e.ssim, 3), cell(e.flip, 3), cell(distance, 4), p.fit_seconds,
      r.full / r.lookup, r.batch / r.lookup,
      p.is.device ? cell(p.is.device->rates.full / p.is.device->rates.fetch, 4) : "-",
      p.is.device ? cell(p.is.device->rates.random_full / p.is.device->rates.random_fetch, 4) : "-",
      cost(&TexelCost::operations), cost(&TexelCost::reads), size_front ? "s" : " ", speed_front ? "v" : " ");
}

bool has(const std::vector<std::size_t>& list, std::size_t i) {
  return std::find(list.begin(), list.end(), i) != list.end();
}

std::string winner_text(const Trade& trade, const TradeSummary::Winner& w) {
  std::string text;
  for (const auto& i : {w.texels, w.texture}) {
    if (!i) continue;
    const TradePoint& p = trade.points[*i];
    text += fmt::format("{}{} {} ({}, {} bytes, {} operations)", text.empty() ? "" : "; ", p.model->name,
                        setting_text(p), error_text(p), p.is.payload_bytes,
                        p.is.cost ? p.is.cost->operations : 0);
  }
  return text.empty() ? "none" : text;
}

Json winners_json(const std::vector<TradeSummary::Winner>& winners, const char* bound) {
  Json list = Json::array();
  const auto index = [](const std::optional<std::size_t>& i) { return i ? Json(*i) : Json(); };
  for (const auto& w : winners)
    list.push_back({{bound, w.most}, {"texels", index(w.texels)}, {"texture", index(w.texture)}});
  return list;
}

}  // namespace

TradeSummary summary_of(const Trade& trade) {
  TradeSummary s;
  for (const Coordinate& error : {Coordinate(texel_error), Coordinate(texture_error)}) {
    const auto size = trade_front(trade.points, payload_of, error);
    s.size_front.insert(s.size_front.end(), size.begin(), size.end());
    const auto speed = trade_front(trade.points, slowness_of, error);
    s.speed_front.insert(s.speed_front.end(), speed.begin(), speed.end());
  }
  const auto winners = [&](const Coordinate& x, std::span<const std::uint64_t> bounds) {
    std::vector<TradeSummary::Winner> list;
    for (const std::uint64_t most : bounds) {
      const auto best = [&](const Coordinate& y, double alike) {
        return winner(trade.points, x, y, static_cast<double>(most), alike);
      };
      list.push_back({most, best(texel_error, kAlikeDb), best(texture_error, kAlikeDistance)});
    }
    return list;
  };
  s.by_bytes = winners(payload_of, kBytes);
  s.by_operations = winners(operations_of, kOperations);
  return s;
}

std::string trade_text(const Trade& trade, const TradeSummary& s) {
  std::string text = fmt::format(
      "{:<6} {:<62} {:>9} {:>9} {:>7} {:>7} {:>6} {:>6} {:>8} {:>7} {:>8} {:>8} {:>8} {:>8} {:>7} {:>7} "
      "front",
      "model", "setting", "payload", "file", "psnr_db", "mae_lab", "ssim", "flip", "distance", "fit s",
      "full", "batch", "gpu full", "gpu rand", "ops", "reads");
  for (std::size_t i = 0; i < trade.points.size(); ++i)
    text += '\n' + row(trade.points[i], has(s.size_front, i), has(s.speed_front, i));
  if (s.pairs > 1) {
    text += fmt::format("\nErrors over {} of {} pairs, SSIM and FLIP over {}.", s.measured_pairs, s.pairs,
                        s.looked_at_pairs);
  }
  text += "\nfull, batch, gpu: over raw look-ups of the same run. front: s of size, v of speed.";
  for (const auto& w : s.by_bytes)
    text += fmt::format("\nat most {:>7}: {}", bytes_text(w.most), winner_text(trade, w));
  for (const auto& w : s.by_operations)
    text += fmt::format("\nat most {:>5} operations: {}", w.most, winner_text(trade, w));
  for (const std::string& line : trade.left_out) text += "\nleft out: " + line;
  if (!trade.no_time.empty()) text += fmt::format("\nno time left for: {}", fmt::join(trade.no_time, "; "));
  return text + fmt::format("\n{:.1f} minutes", s.seconds / 60);
}

Json trade_json(const Trade& trade, const TradeSummary& s) {
  Json points = Json::array();
  for (const TradePoint& p : trade.points) points.push_back(point_json(p));
  return {{"input", s.input},
          {"pairs", s.pairs},
          {"measured_pairs", s.measured_pairs},
          {"looked_at_pairs", s.looked_at_pairs},
          {"seconds", s.seconds},
          {"points", points},
          {"pareto", {{"size", s.size_front}, {"speed", s.speed_front}}},
          {"winners",
           {{"bytes", winners_json(s.by_bytes, "bytes")},
            {"operations", winners_json(s.by_operations, "operations")}}},
          {"left_out", trade.left_out},
          {"no_time", trade.no_time}};
}

std::string bytes_text(std::uint64_t bytes) {
  if (bytes >= 1 << 20) return fmt::format("{:.3g} MB", static_cast<double>(bytes) / (1 << 20));
  if (bytes >= 1 << 10) return fmt::format("{:.3g} KB", static_cast<double>(bytes) / (1 << 10));
  return fmt::format("{} B", bytes);
}

std::string error_text(const TradePoint& p) {
  const std::optional<double> v = p.judged();
  if (!v) return "no measure";
  if (p.keeps_texels()) return fmt::format("{:.2f} dB", -*v);
  std::string name = judged_by(p.is.error, false);
  std::replace(name.begin(), name.end(), '_', ' ');
  return fmt::format("{} {:.4f}", name, *v);
}

}  // namespace btfc
