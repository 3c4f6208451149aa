// What compare says of two data sets.
#include "tools/compare_datasets.h"

#include <fmt/format.h>

#include <cmath>

namespace btfc {
namespace {

Json group_json(const GroupMetrics& g) {
  const auto n = number_or_null;
  return {{"pairs", g.pairs},
          {"psnr_db", n(g.psnr_db)},
          {"rmse_8bit", n(g.rmse_8bit)},
          {"peak_8bit", n(g.peak_8bit)},
          {"mean_psnr_db", n(g.mean_psnr_db)},
          {"ssim", n(g.ssim)},
          {"mae_lab", n(g.mae_lab)},
          {"flip", n(g.flip)},
          {"brdf_rmse_8bit", n(g.brdf_rmse_8bit)},
          {"colour_distance", n(g.colours)},
          {"psnr_db_p5", n(g.psnr_db_p5)},
          {"ssim_p5", n(g.ssim_p5)},
          {"mae_lab_p95", n(g.mae_lab_p95)},
          {"flip_p95", n(g.flip_p95)}};
}

std::string row(const char* name, const GroupMetrics& g) {
  if (g.pairs == 0) return fmt::format("{:<18} none", name);
  return fmt::format(
      "{:<18} {:>6} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.4f} {:>8.3f} {:>8.5f} {:>8.5f} {:>8.4f} {:>8.4f} "
      "{:>8.5f} {:>8.5f} {:>8.4f} {:>8.4f}",
      name, g.pairs, g.psnr_db, g.mean_psnr_db, g.psnr_db_p5, g.rmse_8bit, g.peak_8bit, g.ssim, g.ssim_p5,
      g.mae_lab, g.mae_lab_p95, g.flip, g.flip_p95, g.brdf_rmse_8bit, g.colours);
}

}  // namespace

Json number_or_null(double v) { return std::isfinite(v) ? Json(v) : Json(); }

Json dataset_metrics_json(const DatasetMetrics& m) {
  Json json = group_json(m.all);
  json["identical"] = m.differing_samples == 0;
  json["differing_samples"] = m.differing_samples;
  json["samples"] = m.samples;
  if (m.weighted) json["weighted"] = true;
  json["theta_to_45"] = group_json(m.steep);
  json["theta_above_45"] = group_json(m.grazing);
  json["views"] = Json::array();
  for (const ViewMetrics& v : m.views) {
    json["views"].push_back({{"theta", degrees(v.view.theta)},
                             {"phi", degrees(v.view.phi)},
                             {"pairs", v.pairs},
                             {"psnr_db", number_or_null(v.psnr_db)},
                             {"ssim", number_or_null(v.ssim)},
                             {"mae_lab", number_or_null(v.mae_lab)},
                             {"flip", number_or_null(v.flip)}});
  }
  return json;
}

std::string dataset_metrics_text(const DatasetMetrics& m) {
  std::string text = fmt::format(
      "{:<18} {:>6} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}\n", "views",
      "pairs", "psnr_db", "mean", "p5", "rmse", "peak", "ssim", "p5", "mae_lab", "p95", "flip", "p95", "brdf",
      "colours");
  text += row("all", m.all) + '\n' + row("theta <= 45", m.steep) + '\n' + row("theta > 45", m.grazing);
  text += fmt::format("\ndiffering samples {} of {}", m.differing_samples, m.samples);
  return text;
}

}  // namespace btfc
