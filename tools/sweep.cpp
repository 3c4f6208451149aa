// The formula point by point; rows of a table, members of JSON.
#include "tools/sweep.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/size_report.h"

namespace btfc {
namespace {

constexpr std::uint64_t kMostPoints = 65536;

Result<Json> size_of(const ModelFormat& model, const OptionValues& options) {
  const Result<ItemDescription> item = model.describe(options);
  if (!item) return item.error();
  const Result<Layout> layout = model.layout(item->head, item->parm);
  if (!layout) return layout.error();
  return size_json(item->head, *layout);
}

}  // namespace

std::optional<double> SweepPoint::formula_rate() const {
  if (size.is_null()) return std::nullopt;
  return size["bits_per_texel"].get<double>();
}
std::optional<double> SweepPoint::paper_rate() const {
  if (size.is_null() || !size.contains("paper")) return std::nullopt;
  return size["paper"]["bits_per_texel"].get<double>();
}

std::optional<double> SweepPoint::formula_ratio() const {
  if (size.is_null()) return std::nullopt;
  return size["ratio_u8"].get<double>();
}
std::optional<double> SweepPoint::paper_ratio() const {
  if (size.is_null() || !size.contains("paper") || !size["paper"].contains("ratio")) return std::nullopt;
  return size["paper"]["ratio"].get<double>();
}

bool Sweep::btf() const {
  return std::any_of(points.begin(), points.end(), [](const SweepPoint& p) { return p.paper_ratio(); });
}

Result<SweepRange> parse_sweep(const std::string& text) {
  const auto malformed = [&](const std::string& expected) {
    return bad_argument(fmt::format("--sweep is '{}', expected {}", text, expected));
  };
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) return malformed("NAME=FROM:TO:STEP");
  const auto numbers = split_numbers(text.substr(equals + 1), ':');
  if (!numbers || numbers->size() != 3) return malformed("NAME=FROM:TO:STEP with whole numbers");
  const SweepRange range = {text.substr(0, equals), (*numbers)[0], (*numbers)[1], (*numbers)[2]};
  if (range.step == 0) return malformed("a STEP of 1 or more");
  if (range.from > range.to) return malformed("FROM at most TO");
  if ((range.to - range.from) / range.step >= kMostPoints)
    return malformed(fmt::format("at most {} points", kMostPoints));
  return range;
}

Result<Sweep> run_sweep(const ModelFormat& model, const OptionValues& fixed, const SweepRange& range) {
  const auto option = std::find_if(model.size_options.begin(), model.size_options.end(),
                                   [&](const OptionSpec& o) { return range.name == o.name; });
  if (option == model.size_options.end())
    return bad_argument(fmt::format("--sweep: '{}' is no size option of model '{}'", range.name, model.name));
  if (option->metavar == nullptr)
    return bad_argument(fmt::format("--sweep: --{} takes no number", range.name));
  if (fixed.contains(range.name))
    return bad_argument(
        fmt::format("--sweep varies --{}, which is given as '{}' besides", range.name, fixed.at(range.name)));

  Sweep sweep = {model.name, fixed, range, {}};
  OptionValues options = fixed;
  bool some = false;
  for (std::uint64_t value = range.from; value <= range.to; value += range.step) {
    options[range.name] = std::to_string(value);
    Result<Json> size = size_of(model, options);
    some = some || size;
    if (size) {
      sweep.points.push_back({value, *std::move(size), ""});
    } else {
      sweep.points.push_back({value, nullptr, size.error().message});
    }
  }
  if (!some) {
    return bad_argument(fmt::format("--sweep: no value of --{} from {} to {} is possible: {}", range.name,
                                    range.from, range.to, sweep.points.front().reason));
  }
  return sweep;
}

std::string sweep_text(const Sweep& sweep) {
  std::string text =
      fmt::format("{:>8} {:>6} {:>6} {:>14} {:>14} {:>10} {:>14} {:>20}", sweep.range.name, "width", "height",
                  "formula_bits", "bits_per_texel", "ratio_u8", "paper.bits", "paper.bits_per_texel");
  if (sweep.btf()) text += fmt::format(" {:>12}", "paper.ratio");
  for (const SweepPoint& p : sweep.points) {
    text += fmt::format("\n{:>8} ", p.value);
    if (p.size.is_null()) {
      text += p.reason;
      continue;
    }
    text += fmt::format("{:>6} {:>6} {:>14} {:>14.6f} {:>10.4f}", p.size["width"].get<std::uint64_t>(),
                        p.size["height"].get<std::uint64_t>(), p.size["formula_bits"].get<std::uint64_t>(),
                        *p.formula_rate(), p.size["ratio_u8"].get<double>());
    if (const auto rate = p.paper_rate())
      text += fmt::format(" {:>14} {:>20.6f}", p.size["paper"]["bits"].get<std::uint64_t>(), *rate);
    if (const auto ratio = p.paper_ratio()) text += fmt::format(" {:>12.4f}", *ratio);
  }
  return text;
}

Json sweep_json(const Sweep& sweep) {
  Json points = Json::array();
  for (const SweepPoint& p : sweep.points) {
    Json point = {{"value", p.value}};
    if (p.size.is_null()) {
      point["error"] = p.reason;
    } else {
      for (const char* key :
           {"width", "height", "formula_bits", "bits_per_texel", "bits_per_sample", "ratio_u8", "paper"}) {
        if (p.size.contains(key)) point[key] = p.size[key];
      }
    }
    points.push_back(point);
  }
  Json fixed = Json::object();
  for (const auto& [name, value] : sweep.fixed) fixed[name] = value;
  return {{"sweep", sweep.range.name}, {"model", sweep.model}, {"options", fixed}, {"points", points}};
}

}  // namespace btfc
