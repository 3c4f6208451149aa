// Descent, splitting, rounding.
#include "encoder/models/gm_refined.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numeric>

#include "encoder/models/gm_adam.h"
#include "encoder/models/gm_gradient.h"
#include "encoder/models/gm_state.h"
#include "encoder/split_mix.h"

namespace btfc {
namespace {

// Partial sums of an iteration; fixed, so that threads do not change a bit.
constexpr std::size_t kChunks = 8;
constexpr std::size_t kAdamRange = 256;  // components a task

// Of an iteration: constant rates first, then falling to zero; rounding begins with the fall.
constexpr double kFallShare = 0.35;

// Wider than the domain says no more than wide; and codes need narrow ranges.
constexpr double kMostSpread = 4;    // widths of the tile
constexpr double kMostAngle = 4;     // radians
constexpr double kMostShear = 0.15;  // widths of the tile, for what lies at 45 degrees

// Steps of descent: of mu and shear in spreads, of log2 sigma and log2 of the peak, of the outputs. Found by
// trial on measured cloth: half or double of any costs 0 to 0.2 dB.
constexpr float kMeanRate = 0.012f, kSpreadRate = 0.03f, kHeightRate = 0.024f, kOutputRate = 0.0024f;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Cell {
  std::uint32_t x, y, width, height, group;
};

// All rectangles of a grid laid at random, times all groups of pairs, in random order.
std::vector<Cell> deal(const GmSamples& samples, SplitMix64& random) {
  const std::uint32_t shift_x = random.below(kGmTile), shift_y = random.below(kGmTile);
  const auto cuts = [](std::uint32_t size, std::uint32_t shift) {
    std::vector<std::uint32_t> at{0};
    for (std::uint32_t x = shift; x < size; x += kGmTile) {
      if (x > 0) at.push_back(x);
    }
    at.push_back(size);
    return at;
  };
  const auto xs = cuts(samples.width, shift_x), ys = cuts(samples.height, shift_y);
  std::vector<Cell> cells;
  for (std::size_t j = 0; j + 1 < ys.size(); ++j) {
    for (std::size_t i = 0; i + 1 < xs.size(); ++i) {
      for (std::uint32_t g = 0; g < samples.groups.size(); ++g) {
        cells.push_back({xs[i], ys[j], xs[i + 1] - xs[i], ys[j + 1] - ys[j], g});
      }
    }
  }
  random.shuffle(cells);
  return cells;
}

GmLimits limits_of(const GmSamples& samples) {
  GmLimits limits;
  limits.low.fill(-1e6f);
  limits.high.fill(1e6f);
  const auto set = [&](std::uint32_t row, double low, double high) {
    limits.low[row] = static_cast<float>(low);
    limits.high[row] = static_cast<float>(high);
  };
  const double margin = 0.25;
  set(0, -margin * samples.width, (1 + margin) * samples.width);
  set(1, -margin * samples.height, (1 + margin) * samples.height);
  for (std::uint32_t n = 2; n < 6; ++n) set(n, -2.2, 2.2);
  const auto floors = gm_spread_floors(samples);
  for (std::uint32_t n = 0; n < 6; ++n) {
    const double most = n == 0   ? kMostSpread * samples.width
                        : n == 1 ? kMostSpread * samples.height
                                 : kMostAngle;
    set(kGmSpreadRow + n, std::log2(floors[n]), std::log2(most));
  }
  set(kGmHeightRow, -60, 60);
  const double drift = kMostShear * std::max(samples.width, samples.height);
  for (const std::uint32_t row : {GM_SHEAR, GM_SHEAR + 1}) set(row, -drift, drift);
  return limits;
}

// About the largest value of samples without an upper end: the unit of steps of the outputs.
float largest_value(const GmSamples& samples, std::uint64_t seed) {
  constexpr int kProbe = 65536;
  SplitMix64 random(seed);
  float most = 1e-3f;
  for (int i = 0; i < kProbe; ++i) {
    const std::uint32_t p = random.below(samples.pairs.size()), x = random.below(samples.width),
                        y = random.below(samples.height), c = random.below(samples.channels);
    most = std::max(most, std::fabs(samples.value(p, x, y, c)));
  }
  return most;
}

class Fit {
 public:
  Fit(const GmSamples& samples, const GmRefinedOptions& options)
      : samples_(samples),
        options_(options),
        random_(options.seed),
        limits_(limits_of(samples)),
        total_(options.iterations) {
    const std::uint32_t most = options.components;
    master_.stride = (most + kGmPad - 1) / kGmPad * kGmPad;
    master_.numbers.assign(std::size_t{kGmFieldRows} * master_.stride, 0.0f);
    master_.first = master_.second = master_.numbers;
    std::uint32_t first = options.first_components > 0 ? options.first_components : most / 2;
    first = std::clamp(first, std::min(most, 16u), most);
    for (std::uint32_t m = 0; m < first; ++m) place(m, first);
    master_.components = first;
    field_.channels = samples.channels;
    field_.width = static_cast<float>(samples.width);
    field_.height = static_cast<float>(samples.height);
    field_.wraps = samples.wraps;
    for (std::uint32_t n = 0; n < 6; ++n) {
      adam_.rate[n] = kMeanRate;
      adam_.rate[kGmSpreadRow + n] = kSpreadRate;
    }
    adam_.rate[kGmHeightRow] = kHeightRate;
    const float scale = samples.low < 0 ? largest_value(samples, options.seed) : 1;
    for (std::uint32_t c = 0; c < 4; ++c) adam_.rate[GM_OUTPUT + c] = kOutputRate * scale;
    if (options.shear) adam_.rate[GM_SHEAR] = adam_.rate[GM_SHEAR + 1] = kMeanRate;
    gm_master_field(master_, adam_, field_);
    sums_.resize(kChunks);
    for (GmSums& s : sums_) s.clear(master_.stride);
  }

  GmRefined run() {
    const double begin = now();
    double reported = begin, saved = begin, squares = 0, listed = 0;
    std::uint64_t seen = 0, seen_all = 0;
    while (total_ == 0 || steps_ < total_) {
      if (!falling_ && steps_ > 0 && (total_ > 0 ? steps_ >= steady_steps(total_) : must_fall(begin))) {
        falling_ = true;
        while (master_.components < options_.components) split();  // of a short fit
        if (total_ == 0) total_ = total_for(steps_);
        fall_begin_ = steps_;
        begin_rounding();
      }
      if (!falling_ && steps_ > 0 && steps_ % options_.split_every == 0) split();
      const std::uint64_t left =
          falling_ ? total_ - steps_ : options_.split_every - steps_ % options_.split_every;
      const bool gather = left <= kGatherSteps;
      adam_.scale = options_.rate;
      if (falling_) {
        adam_.scale *=
            1 - static_cast<float>(steps_ - fall_begin_) / static_cast<float>(total_ - fall_begin_);
      }
      iterate(gather, squares, listed, seen);
      if (options_.progress && now() - reported > 5) {
        reported = now();
        report(reported - begin, squares, listed, seen);
        seen_all += seen;
        squares = listed = 0;
        seen = 0;
      }
      // Between a split and the next gathering nothing but the numbers is under way.
      if (options_.save && left > kGatherSteps + 1 && now() - saved >= options_.save_seconds) {
        options_.save(state());
        saved = now();
      }
    }
    GmRefined out;
    out.iterations = steps_;
    out.samples = seen_all + seen;
    if (options_.progress && seen > 0) report(now() - begin, squares, listed, seen);
    finish(out);
    return out;
  }

  // All that the next step depends on.
  Bytes state() const {
    StateWriter w;
    w.put(steps_, total_, fall_begin_, falling_, random_, next_cell_, master_.components, adam_.precision,
          adam_.scales, limits_);
    w.put_all(cells_);
    w.put_all(master_.numbers);
    w.put_all(master_.first);
    w.put_all(master_.second);
    return w.bytes();
  }
  // False where the bytes are not those of a fit with these options.
  bool restore(ByteView bytes) {
    StateReader r(bytes);
    const std::size_t numbers = master_.numbers.size();
    r.get(steps_, total_, fall_begin_, falling_, random_, next_cell_, master_.components, adam_.precision,
          adam_.scales, limits_);
    r.get_all(cells_);
    r.get_all(master_.numbers);
    r.get_all(master_.first);
    r.get_all(master_.second);
    if (!r.complete() || master_.numbers.size() != numbers || master_.first.size() != numbers ||
        master_.second.size() != numbers || master_.components > options_.components)
      return false;
    gm_master_field(master_, adam_, field_);
    return true;
  }

 private:
  static constexpr std::uint64_t kGatherSteps = 64;

  static std::uint64_t steady_steps(std::uint64_t total) {
    return static_cast<std::uint64_t>(static_cast<double>(total) * (1 - kFallShare));
  }
  std::uint32_t grown(std::uint32_t count) const {
    return static_cast<std::uint32_t>(static_cast<float>(count) * options_.growth) + 1;
  }
  // The least number of steps whose steady part is this long.
  static std::uint64_t total_for(std::uint64_t steady) {
    auto total = static_cast<std::uint64_t>(static_cast<double>(steady) / (1 - kFallShare));
    while (steady_steps(total) < steady) ++total;
    return total;
  }
  // Whether the fall that belongs to so many steps takes the rest of the time, at the pace of the last ones.
  bool must_fall(double begin) {
    const double t = now();
    if (steps_ % 64 == 0) {
      pace_ = (t - pace_time_) / 64;
      pace_time_ = t;
    }
    const double left = begin + options_.seconds - t;
    return static_cast<double>(total_for(steps_) - steps_) * pace_ >= left;
  }

  void report(double seconds, double squares, double listed, std::uint64_t seen) const {
    GmProgress p;
    p.iteration = steps_;
    p.iterations = total_;
    p.seconds = seconds;
    const double count = static_cast<double>(seen);
    p.psnr_db = -10 * std::log10(squares / (count * samples_.channels));
    p.components = master_.components;
    p.listed = listed / count;
    options_.progress(p);
  }

  // A component at a random sample, as wide as its share of the domain.
  void place(std::uint32_t m, std::uint32_t count) {
    const std::uint32_t x = random_.below(samples_.width), y = random_.below(samples_.height),
                        p = samples_.draw_pair(random_);
    const double shrink = std::pow(static_cast<double>(count), -1.0 / 6);
    const float at[6] = {static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f,
                         samples_.pairs[p].angle[0],   samples_.pairs[p].angle[1],
                         samples_.pairs[p].angle[2],   samples_.pairs[p].angle[3]};
    const double wide[6] = {samples_.width * 0.5 * shrink,
                            samples_.height * 0.5 * shrink,
                            1.5 * shrink,
                            1.5 * shrink,
                            1.5 * shrink,
                            1.5 * shrink};
    for (std::uint32_t n = 0; n < 6; ++n) {
      set(n, m, at[n]);
      set(kGmSpreadRow + n, m, static_cast<float>(std::log2(wide[n])));
    }
    set(kGmHeightRow, m, 0);
    for (std::uint32_t c = 0; c < samples_.channels; ++c) {
      set(GM_OUTPUT + c, m,
          samples_.value(p, x, y, c) - samples_.mean[std::size_t{p} * samples_.channels + c]);
    }
    set(GM_SHEAR, m, 0);
    set(GM_SHEAR + 1, m, 0);
  }
  void set(std::uint32_t row, std::uint32_t m, float value) {
    master_.row(row)[m] = std::clamp(value, limits_.low[row], limits_.high[row]);
  }

  void iterate(bool gather, double& squares, double& listed, std::uint64_t& seen) {
    std::vector<GmVisit> visits(options_.visits);
    std::vector<std::uint32_t> pairs(std::size_t{options_.visits} * options_.pairs_per_visit);
    for (std::uint32_t v = 0; v < options_.visits; ++v) {
      if (next_cell_ >= cells_.size()) {
        cells_ = deal(samples_, random_);
        next_cell_ = 0;
      }
      const Cell& cell = cells_[next_cell_++];
      const GmPairGroup& group = samples_.groups[cell.group];
      // Mostly different pairs: a random first one, then in strides.
      std::uint32_t* first = pairs.data() + std::size_t{v} * options_.pairs_per_visit;
      const std::size_t count = std::min<std::size_t>(options_.pairs_per_visit, group.pairs.size());
      std::size_t at = random_.below(group.pairs.size());
      for (std::size_t i = 0; i < count; ++i) {
        first[i] = group.pairs[at];
        at = (at + std::max<std::size_t>(1, group.pairs.size() / count)) % group.pairs.size();
      }
      visits[v] = {cell.x, cell.y, cell.width, cell.height, &group, {first, count}};
    }
    GmGradientOptions gradient;
    gradient.gates = options_.gates;
    gradient.reach = options_.reach;
    gradient.statistics = gather;
    tbb::parallel_for(std::size_t{0}, kChunks, [&](std::size_t c) {
      thread_local GmScratch scratch;
      for (std::size_t v = c; v < visits.size(); v += kChunks) {
        gm_add_gradient(field_, samples_, visits[v], gradient, scratch, sums_[c]);
      }
    });
    std::uint64_t count = 0;
    for (GmSums& s : sums_) {
      squares += s.squared_error;
      listed += static_cast<double>(s.listed);
      count += s.samples;
      s.squared_error = 0;
      s.samples = s.listed = 0;
    }
    seen += count;
    adam_.step = ++steps_;
    adam_.inverse_samples = 1.0f / static_cast<float>(count);
    const std::size_t ranges = (master_.stride + kAdamRange - 1) / kAdamRange;
    tbb::parallel_for(std::size_t{0}, ranges, [&](std::size_t r) {
      gm_adam_step(master_, sums_, limits_, adam_, r * kAdamRange,
                   std::min<std::size_t>(master_.stride, (r + 1) * kAdamRange), field_);
    });
  }

  // Components that hold little make room; those that lose most are split.
  void split() {
    const std::uint32_t count = master_.components;
    std::vector<double> usage(count), error(count);
    for (GmSums& s : sums_) {
      for (std::uint32_t m = 0; m < count; ++m) {
        usage[m] += static_cast<double>(s.usage[m]);
        error[m] += static_cast<double>(s.error[m]);
      }
      std::fill(s.usage.begin(), s.usage.end(), 0.0f);
      std::fill(s.error.begin(), s.error.end(), 0.0f);
    }
    const double mean = std::accumulate(usage.begin(), usage.end(), 0.0) / count;
    const double mean_error = std::accumulate(error.begin(), error.end(), 0.0) / count;
    const std::uint32_t target = std::min(options_.components, grown(count));
    std::vector<std::uint32_t> places;
    for (std::uint32_t m = count; m < target; ++m) places.push_back(m);
    for (std::uint32_t m = 0; m < count; ++m) {
      if (usage[m] < 0.03 * mean && error[m] < 0.03 * mean_error) places.push_back(m);
    }
    std::vector<std::uint32_t> worst(count);
    std::iota(worst.begin(), worst.end(), 0u);
    std::stable_sort(worst.begin(), worst.end(), [&](auto a, auto b) { return error[a] > error[b]; });
    master_.components = target;
    for (std::size_t i = 0; i < places.size() && i < count / 2; ++i) halve(worst[i], places[i]);
    gm_master_field(master_, adam_, field_);
  }

  // The axis along which samples pull hardest in different ways: by the mean square of the gradient of mu.
  std::uint32_t torn_axis(std::uint32_t m) {
    double sum = 0, share[6];
    for (std::uint32_t n = 0; n < 6; ++n) {
      const double square = double{master_.second[std::size_t{n} * master_.stride + m]};
      sum += share[n] = square * square;
    }
    double at = random_.uniform() * sum;
    std::uint32_t axis = 0;
    while (axis < 5 && at >= share[axis]) at -= share[axis++];
    return axis;
  }

  void halve(std::uint32_t parent, std::uint32_t child) {
    for (std::uint32_t r = 0; r < kGmFieldRows; ++r) {
      master_.row(r)[child] = master_.row(r)[parent];
      for (const std::uint32_t m : {parent, child}) {
        master_.first[std::size_t{r} * master_.stride + m] = 0;
      }
      master_.second[std::size_t{r} * master_.stride + child] =
          master_.second[std::size_t{r} * master_.stride + parent];
    }
    const std::uint32_t axis = torn_axis(parent);
    const float spread = std::exp2(master_.row(kGmSpreadRow + axis)[parent]);
    set(axis, parent, master_.row(axis)[parent] - 0.5f * spread);
    set(axis, child, master_.row(axis)[child] + 0.5f * spread);
    for (const std::uint32_t m : {parent, child}) {
      set(kGmSpreadRow + axis, m, master_.row(kGmSpreadRow + axis)[m] - 0.35f);
      set(kGmHeightRow, m, master_.row(kGmHeightRow)[m] - 0.5f);
    }
  }

  // Fixes the ranges of u8 codes where nearly all numbers lie; the field is rounded from here on.
  void begin_rounding() {
    for (GmSums& s : sums_) std::fill(s.usage.begin(), s.usage.end(), 0.0f);
    adam_.precision = options_.precision;
    if (options_.precision == Precision::u8) {
      for (std::uint32_t r = 0; r < kGmFieldRows; ++r) {
        std::vector<float> row(master_.row(r), master_.row(r) + master_.components);
        std::sort(row.begin(), row.end());
        const std::size_t cut = row.size() / 500;
        const float low = row[cut], high = row[row.size() - 1 - cut];
        adam_.scales[r] = scale_between(low, high);
        limits_.low[r] = std::max(limits_.low[r], low);
        limits_.high[r] = std::min(limits_.high[r], high);
      }
    }
    gm_master_field(master_, adam_, field_);
  }

  // Of the last steps: how much of the samples each component holds.
  std::vector<double> energy() const {
    std::vector<double> out(master_.components, 0);
    for (const GmSums& s : sums_) {
      for (std::uint32_t m = 0; m < master_.components; ++m) out[m] += static_cast<double>(s.usage[m]);
    }
    return out;
  }

  void finish(GmRefined& out) const {
    const GmShape shape{master_.components, samples_.channels, options_.shear};
    out.energy = energy();
    const GmMixture mixture = gm_ordered(gm_master_mixture(master_, shape), out.energy);
    std::stable_sort(out.energy.begin(), out.energy.end(), std::greater<>());
    std::vector<RowScale> scales;
    for (std::uint32_t r = 0; r < shape.rows(); ++r) {
      scales.push_back(adam_.scales[r >= shape.shear_row() ? GM_SHEAR + (r - shape.shear_row()) : r]);
    }
    out.codes = gm_quantise(mixture, options_.precision, scales);
  }

  const GmSamples& samples_;
  const GmRefinedOptions& options_;
  SplitMix64 random_;
  GmLimits limits_;
  GmMaster master_;
  GmField field_;
  GmAdamOptions adam_;
  std::vector<GmSums> sums_;
  std::vector<Cell> cells_;
  std::size_t next_cell_ = 0;
  std::uint64_t steps_ = 0, total_ = 0, fall_begin_ = 0;
  bool falling_ = false;                 // rates fall to zero from step fall_begin_ to total_
  double pace_ = 0, pace_time_ = now();  // seconds a step
};

}  // namespace

std::optional<GmRefined> gm_fit_refined(const GmSamples& samples, const GmRefinedOptions& options) {
  Fit fit(samples, options);
  if (!options.resume.empty() && !fit.restore(options.resume)) return std::nullopt;
  return fit.run();
}

}  // namespace btfc
