// btfc size --sweep: the size formula over a range of one option, as a table, JSON and a plot.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "format/model_table.h"
#include "format/options.h"
#include "format/result.h"
#include "tools/json.h"

namespace btfc {

// NAME=FROM:TO:STEP, both ends included where the steps meet them.
struct SweepRange {
  std::string name;
  std::uint64_t from = 0, to = 0, step = 1;
};

struct SweepPoint {
  std::uint64_t value = 0;
  Json size;           // what `btfc size` says; null where the parameters are not possible
  std::string reason;  // why not
  std::optional<double> formula_rate() const;
  std::optional<double> paper_rate() const;  // bits per texel by the paper's count, where there is one
  // Of a BTF: raw samples of 8 bits over the payload, and samples over values as the paper counts.
  std::optional<double> formula_ratio() const;
  std::optional<double> paper_ratio() const;
};

struct Sweep {
  std::string model;
  OptionValues fixed;
  SweepRange range;
  std::vector<SweepPoint> points;
  // Whether it is about images under many directions, of which ratios are told rather than bits per texel.
  bool btf() const;
};

Result<SweepRange> parse_sweep(const std::string& text);

// Refuses an option that the model has not, one that is given besides, and a range without a valid point.
Result<Sweep> run_sweep(const ModelFormat& model, const OptionValues& fixed, const SweepRange& range);

std::string sweep_text(const Sweep& sweep);
Json sweep_json(const Sweep& sweep);

// One picture with axes and both curves; needs nothing from outside.
std::string sweep_svg(const Sweep& sweep);

}  // namespace btfc
