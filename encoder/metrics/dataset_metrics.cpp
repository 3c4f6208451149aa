// One record a pair, in parallel; then sums over records in order.
#include "encoder/metrics/dataset_metrics.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "encoder/metrics/flip.h"
#include "encoder/metrics/lab.h"
#include "encoder/metrics/ssim.h"
#include "encoder/segment/colour_histograms.h"

namespace btfc {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct PairRecord {
  double weight = 1;
  double squares = 0, peak = 0;  // sum of squared differences, largest one
  double ssim = kNaN, mae_lab = kNaN, flip = kNaN, colours = kNaN;
  double brdf_squares = 0;  // of channels' means, averaged over channels
  std::uint64_t differing = 0;
};

std::string shape_of(const DatasetInfo& info) {
  return fmt::format("{}x{} texels of {} channels, {} views, {} lights and {} images", info.width,
                     info.height, info.channel_count(), info.views.size(), info.lights.size(),
                     info.pairs.size());
}

Result<Done> check_directions(const char* what, std::span<const Direction> a, std::span<const Direction> b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!same_direction(a[i], b[i])) {
      return bad_argument(fmt::format("{} {} is {} in the reference and {} in the candidate", what, i,
                                      to_text(a[i]), to_text(b[i])));
    }
  }
  return Done{};
}

Result<Done> check_alike(const DatasetInfo& a, const DatasetInfo& b) {
  if (a.width != b.width || a.height != b.height || a.channels.size() != b.channels.size() ||
      a.views.size() != b.views.size() || a.lights.size() != b.lights.size() ||
      a.pairs.size() != b.pairs.size()) {
    return bad_argument(fmt::format("the data sets differ in form: the reference has {}, the candidate {}",
                                    shape_of(a), shape_of(b)));
  }
  if (const auto good = check_directions("view", a.views, b.views); !good) return good.error();
  if (const auto good = check_directions("light", a.lights, b.lights); !good) return good.error();
  for (std::size_t i = 0; i < a.pairs.size(); ++i) {
    if (!(a.pairs[i] == b.pairs[i])) {
      return bad_argument(fmt::format(
          "image {} is of view {} and light {} in the reference, and of view {} and light {} in the "
          "candidate",
          i, a.pairs[i].view, a.pairs[i].light, b.pairs[i].view, b.pairs[i].light));
    }
  }
  return Done{};
}

void compare_codes(const CodeView& a, const CodeView& b, bool same_type, PairRecord& record) {
  const float *const va = a.tables->display.data(), *const vb = b.tables->display.data();
  std::vector<double> means(a.channels);
  for (std::size_t i = 0; i < a.codes.size(); ++i) {
    const double d = static_cast<double>(va[a.codes[i]]) - static_cast<double>(vb[b.codes[i]]);
    means[i % a.channels] += d;
    record.squares += d * d;
    record.peak = std::fmax(record.peak, std::fabs(d));
    if (!same_type || a.codes[i] != b.codes[i]) ++record.differing;
  }
  const double texels = static_cast<double>(a.codes.size()) / a.channels;
  for (const double m : means) record.brdf_squares += (m / texels) * (m / texels) / a.channels;
}

double colour_distance(const CodeView& a, const CodeView& b) {
  const std::vector<float> fa = colour_histograms(a), fb = colour_histograms(b);
  double sum = 0;
  for (std::size_t i = 0; i < fa.size(); ++i) sum += double{fa[i] - fb[i]} * double{fa[i] - fb[i]};
  return std::sqrt(sum);
}

double psnr(double mean_square) {
  return mean_square == 0 ? std::numeric_limits<double>::infinity() : 10 * std::log10(1 / mean_square);
}

// Linear between ranks: 0 gives the least, 1 the largest. NaN where a value is.
double quantile(std::vector<double> values, double share) {
  for (const double v : values) {
    if (std::isnan(v)) return kNaN;
  }
  std::sort(values.begin(), values.end());
  const double rank = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(rank);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (rank - static_cast<double>(below)) * (values[above] - values[below]);
}

double mean(const std::vector<double>& values, const std::vector<double>& weights) {
  double sum = 0, all = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    sum += weights[i] * values[i];
    all += weights[i];
  }
  return sum / all;
}

std::vector<double> gather(std::span<const PairRecord* const> records, double PairRecord::*member) {
  std::vector<double> out;
  for (const PairRecord* r : records) out.push_back(r->*member);
  return out;
}

GroupMetrics group(std::span<const PairRecord* const> records, double image_samples) {
  GroupMetrics out;
  out.pairs = records.size();
  if (records.empty()) {
    out.psnr_db = out.rmse_8bit = out.peak_8bit = out.mean_psnr_db = out.ssim = out.mae_lab = out.flip = kNaN;
    out.brdf_rmse_8bit = out.colours = kNaN;
    out.psnr_db_p5 = out.ssim_p5 = out.mae_lab_p95 = out.flip_p95 = kNaN;
    return out;
  }
  const std::vector<double> weights = gather(records, &PairRecord::weight);
  double squares = 0, all = 0;
  std::vector<double> psnrs;
  for (const PairRecord* r : records) {
    squares += r->weight * r->squares;
    all += r->weight;
    out.peak_8bit = std::fmax(out.peak_8bit, 255 * r->peak);
    psnrs.push_back(std::fmin(psnr(r->squares / image_samples), kMostPsnrDb));
  }
  const double mse = squares / (image_samples * all);
  out.psnr_db = psnr(mse);
  out.rmse_8bit = 255 * std::sqrt(mse);
  const auto ssim = gather(records, &PairRecord::ssim), mae_lab = gather(records, &PairRecord::mae_lab),
             flip = gather(records, &PairRecord::flip);
  out.mean_psnr_db = mean(psnrs, weights);
  out.ssim = mean(ssim, weights);
  out.mae_lab = mean(mae_lab, weights);
  out.flip = mean(flip, weights);
  out.brdf_rmse_8bit = 255 * std::sqrt(mean(gather(records, &PairRecord::brdf_squares), weights));
  out.colours = mean(gather(records, &PairRecord::colours), weights);
  out.psnr_db_p5 = quantile(psnrs, 0.05);
  out.ssim_p5 = quantile(ssim, 0.05);
  out.mae_lab_p95 = quantile(mae_lab, 0.95);
  out.flip_p95 = quantile(flip, 0.95);
  return out;
}

DatasetMetrics summary(const DatasetInfo& info, const std::vector<PairRecord>& records) {
  const auto image_samples = static_cast<double>(info.image_samples());
  std::vector<const PairRecord*> all, steep, grazing;
  std::vector<std::vector<const PairRecord*>> views(info.views.size());
  DatasetMetrics out;
  out.weighted = !info.weights.empty();
  for (std::size_t i = 0; i < records.size(); ++i) {
    const std::uint32_t view = info.pairs[i].view;
    // Names round directions: as far beyond as same_direction takes for none.
    const bool is_steep = degrees(info.views[view].theta - 1e-5) <= kSteepDegrees;
    all.push_back(&records[i]);
    (is_steep ? steep : grazing).push_back(&records[i]);
    views[view].push_back(&records[i]);
    out.differing_samples += records[i].differing;
    out.samples += info.image_samples();
  }
  out.all = group(all, image_samples);
  out.steep = group(steep, image_samples);
  out.grazing = group(grazing, image_samples);
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (views[v].empty()) continue;
    const GroupMetrics g = group(views[v], image_samples);
    out.views.push_back({info.views[v], g.pairs, g.psnr_db, g.ssim, g.mae_lab, g.flip});
  }
  return out;
}

}  // namespace

Result<DatasetMetrics> compare_datasets(const Dataset& reference, const Dataset& candidate,
                                        const DatasetMetricOptions& options) {
  const DatasetInfo &a = reference.info(), &b = candidate.info();
  if (const auto good = check_alike(a, b); !good) return good.error();
  const CodeTables tables_a = code_tables(a.type, a.colour_space),
                   tables_b = code_tables(b.type, b.colour_space);
  DatasetInfo named = b;  // the candidate's colour space, the reference's names
  named.channels = a.channels;
  const ColourMeaning meaning =
      colour_meaning(named) == ColourMeaning::none ? ColourMeaning::none : colour_meaning(a);
  const bool colours = meaning != ColourMeaning::none;
  const FlipFilters filters = flip_filters();

  std::vector<PairRecord> records(a.pairs.size());
  std::mutex lock;
  std::size_t done = 0;
  tbb::parallel_for(std::size_t{0}, records.size(), [&](std::size_t i) {
    std::vector<std::uint16_t> codes_a(a.image_samples()), codes_b(b.image_samples());
    reference.read_image(i, codes_a);
    candidate.read_image(i, codes_b);
    const CodeView va{codes_a, a.width, a.height, a.channel_count(), meaning, &tables_a};
    const CodeView vb{codes_b, b.width, b.height, b.channel_count(), meaning, &tables_b};
    PairRecord& record = records[i];
    record.weight = a.weight(i);
    compare_codes(va, vb, a.type == b.type, record);
    if (options.measures.ssim) record.ssim = ssim_by_rows(va, vb);
    if (options.measures.mae_lab && colours) record.mae_lab = lab_difference(va, vb).mae;
    if (options.measures.mae_lab && colours) record.colours = colour_distance(va, vb);
    if (options.measures.flip && colours) record.flip = flip_by_rows(va, vb, filters);
    if (!options.progress) return;
    const std::lock_guard<std::mutex> hold(lock);
    options.progress(++done, records.size());
  });
  return summary(a, records);
}

}  // namespace btfc
