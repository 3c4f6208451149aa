// A trade-off: settings of models, fitted and measured against each other.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "encoder/model_table.h"
#include "tools/measure_file.h"
#include "tools/pareto.h"

namespace btfc {

// One setting. Those that differ in knobs alone share a file.
struct TradePoint {
  const ModelFormat* model = nullptr;
  std::string options;     // as the ladder has them
  std::size_t file = 0;    // of Trade::files
  double fit_seconds = 0;  // of the file
  MeasuredSetting is;

  bool keeps_texels() const { return fitter(model->id).keeps_texels; }
  // The smaller the better; comparable among points whose models both keep texels, or both do not.
  std::optional<double> judged() const { return btfc::judged(is.error, keeps_texels()); }
};

struct TradeFile {
  Bytes bytes;  // without QUAL
  std::vector<RawChunk> chunks;
};

struct Trade {
  std::vector<TradePoint> points;
  std::vector<TradeFile> files;
  // Settings that could not be fitted, with the reason, and those for which there was no time.
  std::vector<std::string> left_out, no_time;
};

struct TradeOptions {
  std::vector<ModelId> models;
  std::size_t steps = 0;  // so many settings of each ladder, the first; 0: all
  double minutes = 0;     // no fit is begun later but the first; 0: no limit
  std::uint64_t seed = 1;
  unsigned threads = 0;
  MeasureOptions measure;
  std::function<void(const std::string&)> note;
};

// Fits the ladders of the models, turn by turn, and measures each file's knobs. A setting that cannot be
// fitted is left out; the error of the first is returned where none can.
Result<Trade> run_trade(const FitInput& input, const Reference& reference, const TradeOptions& options);

// Whether a model can be fitted to such an input.
bool takes(const Fitter& fit, const FitInput& input);

// "--rank 8 --trim-sample" as values.
OptionValues parse_options(const std::string& text);
// The other way round, with the knobs that are not the file's own.
std::string setting_text(const TradePoint& point);

// A file with its measured curve in it.
Result<Bytes> with_curve(const Trade& trade, std::size_t file, const Reference& reference);

// What is as good: then the smaller payload counts.
inline constexpr double kAlikeDb = 0.05, kAlikeDistance = 0.01;

// What points are held against each other by; the smaller the better.
using Coordinate = std::function<std::optional<double>(const TradePoint&)>;
std::vector<std::size_t> trade_front(const std::vector<TradePoint>& points, const Coordinate& x,
                                     const Coordinate& y);

// The point of least y among those with x at most `most`; of those that are as good within `tolerance` the
// one of the smallest payload. Nothing where there is none.
std::optional<std::size_t> winner(const std::vector<TradePoint>& points, const Coordinate& x,
                                  const Coordinate& y, double most, double tolerance);

// Coordinates.
std::optional<double> payload_of(const TradePoint& point);
std::optional<double> operations_of(const TradePoint& point);
std::optional<double> slowness_of(const TradePoint& point);  // of whole images: look-ups a decoded texel
// The error of models that keep texels, or of those that do not.
std::optional<double> texel_error(const TradePoint& point);
std::optional<double> texture_error(const TradePoint& point);

}  // namespace btfc
