// What the curve has, and only that.
#include "tools/quality_report.h"

#include <fmt/format.h>

namespace btfc {

Json quality_json(const QualityCurve& curve) {
  const auto has = [&](std::uint32_t measure) { return (curve.measures & measure) != 0; };
  Json points = Json::array();
  for (const QualityPoint& p : curve.points) {
    Json point = {{"levels", p.knobs.levels}, {"gates", p.knobs.gates}, {"culling", p.knobs.culling}};
    if (has(kQualityPsnr)) point["psnr_db"] = p.psnr_db;
    if (has(kQualityLab)) point["mae_lab"] = p.mae_lab;
    if (has(kQualityDistance)) point["distance"] = p.distance;
    if (has(kQualityRate)) point["rate"] = p.rate;
    if (has(kQualityCost)) {
      point["operations"] = p.operations;
      point["reads"] = p.reads;
    }
    points.push_back(point);
  }
  return {{"pairs", curve.pairs}, {"points", points}};
}

std::string quality_text(const QualityCurve& curve) {
  const auto has = [&](std::uint32_t measure) { return (curve.measures & measure) != 0; };
  std::string text = "levels  gates  culling";
  const std::pair<std::uint32_t, const char*> titles[] = {{kQualityPsnr, "   psnr_db"},
                                                          {kQualityLab, "   mae_lab"},
                                                          {kQualityDistance, "  distance"},
                                                          {kQualityRate, "      rate"},
                                                          {kQualityCost, "  operations     reads"}};
  for (const auto& [measure, title] : titles) text += has(measure) ? title : "";
  const auto knob = [](std::uint32_t v) { return v == 0 ? "all" : std::to_string(v); };
  for (const QualityPoint& p : curve.points) {
    text += fmt::format("\n{:>6} {:>6} {:>8}", knob(p.knobs.levels),
                        p.knobs.gates == 0 ? "own" : knob(p.knobs.gates),
                        p.knobs.culling > 0 ? fmt::format("{:g}", p.knobs.culling) : "own");
    if (has(kQualityPsnr)) text += fmt::format(" {:9.2f}", p.psnr_db);
    if (has(kQualityLab)) text += fmt::format(" {:9.3f}", p.mae_lab);
    if (has(kQualityDistance)) text += fmt::format(" {:9.4f}", p.distance);
    if (has(kQualityRate)) text += fmt::format(" {:9.4f}", p.rate);
    if (has(kQualityCost)) text += fmt::format(" {:11} {:9}", p.operations, p.reads);
  }
  if (curve.pairs > 1) text += fmt::format("\nmeasured under {} pairs of directions", curve.pairs);
  return text;
}

}  // namespace btfc
