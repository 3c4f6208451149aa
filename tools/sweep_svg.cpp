// A sweep as a picture: bits per texel, or of a BTF the ratio, over the option: the formula's curve and the
// paper's.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/svg_text.h"
#include "tools/sweep.h"

namespace btfc {
namespace {

constexpr double kWidth = 720, kHeight = 440, kLeft = 70, kRight = 20, kTop = 50, kBottom = 60;
constexpr double kPlotWidth = kWidth - kLeft - kRight, kPlotHeight = kHeight - kTop - kBottom;

struct Axes {
  double x0, x1, y1;  // y begins at 0
  double x(double value) const { return kLeft + (value - x0) / (x1 - x0) * kPlotWidth; }
  double y(double value) const { return kTop + (1 - value / y1) * kPlotHeight; }
};

// Invalid points interrupt the curve; a point between two of them is a dot.
std::string curve(const Sweep& sweep, const Axes& axes, std::optional<double> (SweepPoint::*rate)() const,
                  const char* style) {
  std::string path, dots;
  bool drawing = false;
  for (std::size_t i = 0; i < sweep.points.size(); ++i) {
    const auto value = (sweep.points[i].*rate)();
    if (!value) {
      drawing = false;
      continue;
    }
    const double x = axes.x(static_cast<double>(sweep.points[i].value)), y = axes.y(*value);
    const bool goes_on = i + 1 < sweep.points.size() && (sweep.points[i + 1].*rate)();
    path += fmt::format("{}{:.2f} {:.2f}", drawing ? "L" : "M", x, y);
    if (!drawing && !goes_on)
      dots += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"3\" {}/>\n", x, y, style);
    drawing = true;
  }
  return fmt::format("<path d=\"{}\" fill=\"none\" {}/>\n{}", path, style, dots);
}

std::string ticks(const Axes& axes) {
  std::string svg;
  const double bottom = kHeight - kBottom;
  const double step_x = std::max(1.0, round_step(axes.x1 - axes.x0, 10)), step_y = round_step(axes.y1, 8);
  for (double n = std::ceil(axes.x0 / step_x); n * step_x <= axes.x1; ++n) {
    const double v = n * step_x, at = axes.x(v);
    svg += fmt::format(
        "<path d=\"M{0:.2f} {1}v5\" stroke=\"#333\"/><text x=\"{0:.2f}\" y=\"{2}\" "
        "text-anchor=\"middle\">{3:g}</text>\n",
        at, bottom, bottom + 20, v);
  }
  for (double n = 0; n * step_y <= axes.y1 * 1.0001; ++n) {
    const double v = n * step_y, at = axes.y(v);
    svg += fmt::format(
        "<path d=\"M{0} {1:.2f}h{2}\" stroke=\"#ddd\"/><path d=\"M{0} {1:.2f}h-5\" stroke=\"#333\"/>"
        "<text x=\"{3}\" y=\"{4:.2f}\" text-anchor=\"end\">{5:g}</text>\n",
        kLeft, at, kPlotWidth, kLeft - 9, at + 4, v);
  }
  return svg;
}

std::string legend(double y, const char* style, const std::string& label) {
  return fmt::format("<path d=\"M{0} {1}h36\" {2}/><text x=\"{3}\" y=\"{4}\">{5}</text>\n",
                     kWidth - kRight - 190, y, style, kWidth - kRight - 146, y + 4, label);
}

}  // namespace

std::string sweep_svg(const Sweep& sweep) {
  constexpr const char* kFormula = "stroke=\"#1f5fa8\" stroke-width=\"2.5\"";
  constexpr const char* kPaper = "stroke=\"#e07b00\" stroke-width=\"2.5\" stroke-dasharray=\"4 6\"";
  const auto formula_of = sweep.btf() ? &SweepPoint::formula_ratio : &SweepPoint::formula_rate;
  const auto paper_of = sweep.btf() ? &SweepPoint::paper_ratio : &SweepPoint::paper_rate;
  double most = 0;
  bool paper = false;
  for (const SweepPoint& p : sweep.points) {
    most = std::max({most, (p.*formula_of)().value_or(0), (p.*paper_of)().value_or(0)});
    paper = paper || (p.*paper_of)();
  }
  const double from = static_cast<double>(sweep.range.from);
  const double to = std::max(from + 1, static_cast<double>(sweep.points.back().value));
  const double step = round_step(most, 8);
  const Axes axes = {from, to, step * std::ceil(most / step)};

  std::string title = "btfc size --model " + sweep.model;
  for (const auto& [name, value] : sweep.fixed) title += " --" + name + (value.empty() ? "" : " " + value);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"sans-serif\" font-size=\"12\" fill=\"#222\">\n<rect width=\"{0}\" height=\"{1}\" "
      "fill=\"#fff\"/>\n<text x=\"{2}\" y=\"26\" font-size=\"14\">{3}</text>\n",
      kWidth, kHeight, kLeft, escaped(title));
  svg += ticks(axes);
  svg += fmt::format("<path d=\"M{} {}V{}H{}\" fill=\"none\" stroke=\"#333\"/>\n", kLeft, kTop,
                     kHeight - kBottom, kWidth - kRight);
  svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", kLeft + kPlotWidth / 2,
                     kHeight - 16, escaped(sweep.range.name));
  svg += fmt::format("<text transform=\"translate(20 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                     kTop + kPlotHeight / 2, sweep.btf() ? "compression ratio" : "bits per texel");
  svg += curve(sweep, axes, formula_of, kFormula);
  if (paper) svg += curve(sweep, axes, paper_of, kPaper);
  svg += legend(kTop + 14, kFormula, "formula");
  if (paper) svg += legend(kTop + 34, kPaper, "paper&#8217;s count");
  return svg + "</svg>\n";
}

}  // namespace btfc
