// Fitting ladders, and who beats whom.
#include "tools/trade_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <sstream>

#include "tools/fit_input.h"

namespace btfc {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

}  // namespace

bool takes(const Fitter& fit, const FitInput& input) {
  return fit.input == InputKind::either || (fit.input == InputKind::dataset) == (input.dataset != nullptr);
}

OptionValues parse_options(const std::string& text) {
  OptionValues values;
  std::istringstream words(text);
  std::string* last = nullptr;
  for (std::string word; words >> word;) {
    if (word.starts_with("--")) {
      last = &values[word.substr(2)];
    } else if (last != nullptr) {
      *last = word;
    }
  }
  return values;
}

std::string setting_text(const TradePoint& p) {
  std::string text = p.options;
  const auto add = [&](const std::string& knob) { text += (text.empty() ? "" : ", ") + knob; };
  if (p.is.knobs.levels != 0)
    add(fmt::format("{} level{}", p.is.knobs.levels, p.is.knobs.levels == 1 ? "" : "s"));
  if (p.is.knobs.gates != 0)
    add(fmt::format("{} gate{}", p.is.knobs.gates, p.is.knobs.gates == 1 ? "" : "s"));
  if (p.is.knobs.culling > 0) add(fmt::format("culling {:g}", p.is.knobs.culling));
  return text.empty() ? "defaults" : text;
}

Result<Trade> run_trade(const FitInput& input, const Reference& reference, const TradeOptions& options) {
  const auto begin = Clock::now();
  Trade trade;
  std::optional<Error> first;
  std::size_t most = 0;
  for (const ModelId id : options.models) most = std::max(most, fitter(id).ladder.size());
  if (options.steps > 0) most = std::min(most, options.steps);
  for (std::size_t step = 0; step < most; ++step) {
    for (const ModelId id : options.models) {
      const Fitter& fit = fitter(id);
      if (step >= fit.ladder.size()) continue;
      const ModelFormat& model = *find_model(id);
      const std::string line = fit.ladder[step], name = fmt::format("{} {}", model.name, line);
      if (options.minutes > 0 && !trade.files.empty() && seconds_since(begin) > 60 * options.minutes) {
        trade.no_time.push_back(name);
        continue;
      }
      if (options.note) options.note(fmt::format("{:6.0f} s  {}", seconds_since(begin), name));
      const auto fit_begin = Clock::now();
      FitSettings settings;
      settings.options = parse_options(line);
      settings.seed = options.seed;
      settings.threads = options.threads;
      Result<FitResult> fitted = fit.fit(input, settings);
      if (!fitted) {
        trade.left_out.push_back(fmt::format("{}: {}", name, fitted.error().message));
        if (!first) first = fitted.error();
        continue;
      }
      TradePoint point;
      point.model = &model;
      point.options = line;
      point.file = trade.files.size();
      point.fit_seconds = seconds_since(fit_begin);
      add_meta(*fitted);
      TradeFile file;
      file.chunks = std::move(fitted->chunks);
      Result<Bytes> bytes = pack_file(file.chunks);
      if (!bytes) return bytes.error();
      file.bytes = *std::move(bytes);
      Result<std::vector<MeasuredSetting>> settings_of =
          measure_settings(file.bytes, reference, options.measure);
      if (!settings_of) return settings_of.error();
      for (MeasuredSetting& setting : *settings_of) {
        point.is = std::move(setting);
        trade.points.push_back(point);
      }
      trade.files.push_back(std::move(file));
    }
  }
  if (trade.points.empty()) return first.value_or(bad_argument("no model takes this input"));
  return trade;
}

Result<Bytes> with_curve(const Trade& trade, std::size_t file, const Reference& reference) {
  std::vector<MeasuredSetting> settings;
  bool keeps = true;
  for (const TradePoint& p : trade.points) {
    if (p.file != file) continue;
    settings.push_back(p.is);
    keeps = p.keeps_texels();
  }
  const Result<QualityCurve> curve = curve_of(settings, reference, keeps);
  if (!curve) return curve.error();
  std::vector<RawChunk> chunks = trade.files[file].chunks;
  chunks.push_back({{kQual, 0}, write_quality(*curve)});
  return pack_file(std::move(chunks));
}

std::vector<std::size_t> trade_front(const std::vector<TradePoint>& points, const Coordinate& x,
                                     const Coordinate& y) {
  std::vector<std::optional<ParetoPoint>> places;
  for (const TradePoint& p : points) {
    const auto px = x(p), py = y(p);
    places.push_back(px && py ? std::optional(ParetoPoint{*px, *py}) : std::nullopt);
  }
  return pareto_front(places);
}

std::optional<std::size_t> winner(const std::vector<TradePoint>& points, const Coordinate& x,
                                  const Coordinate& y, double most, double tolerance) {
  std::vector<std::size_t> allowed;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!x(points[i]) || !y(points[i]) || *x(points[i]) > most) continue;
    allowed.push_back(i);
    least = std::min(least, *y(points[i]));
  }
  std::optional<std::size_t> best;
  for (const std::size_t i : allowed) {
    if (*y(points[i]) > least + tolerance) continue;
    if (!best || points[i].is.payload_bytes < points[*best].is.payload_bytes) best = i;
  }
  return best;
}

std::optional<double> payload_of(const TradePoint& p) { return static_cast<double>(p.is.payload_bytes); }

std::optional<double> operations_of(const TradePoint& p) {
  return p.is.cost ? std::optional(static_cast<double>(p.is.cost->operations)) : std::nullopt;
}

std::optional<double> slowness_of(const TradePoint& p) {
  return p.is.rates.full > 0 ? std::optional(p.is.rates.lookup / p.is.rates.full) : std::nullopt;
}

std::optional<double> texel_error(const TradePoint& p) {
  return p.keeps_texels() ? p.judged() : std::nullopt;
}
std::optional<double> texture_error(const TradePoint& p) {
  return p.keeps_texels() ? std::nullopt : p.judged();
}

}  // namespace btfc
