// Axes with round numbers, points by model, the front as a line.
#include "tools/trade_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/svg_text.h"
#include "tools/trade_report.h"

namespace btfc {
namespace {

constexpr double kWidth = 720, kHeight = 400, kLeft = 58, kRight = 16, kTop = 14, kBottom = 46;

struct Axis {
  double low, high, begin, end;  // values (of x: logarithms), and where they lie
  double at(double v) const { return begin + (v - low) / (high - low) * (end - begin); }
};

std::string tick_text(double v, bool bytes) {
  return bytes ? bytes_text(static_cast<std::uint64_t>(std::llround(v))) : fmt::format("{:g}", v);
}

// Ticks of the logarithmic axis: powers of 4 of bytes, else so many a power of ten as there is room for.
std::vector<double> log_ticks(const Axis& x, bool bytes) {
  std::vector<double> ticks;
  const double low = std::pow(10, x.low), high = std::pow(10, x.high);
  if (bytes) {
    for (double v = 64; v <= high; v *= 4) {
      if (v >= low) ticks.push_back(v);
    }
    return ticks;
  }
  const double span = x.high - x.low;
  const std::vector<double> steps = span > 3     ? std::vector<double>{1}
                                    : span > 0.8 ? std::vector<double>{1, 2, 5}
                                                 : std::vector<double>{1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9};
  for (double power = std::floor(x.low); power <= x.high; ++power) {
    for (const double m : steps) {
      const double v = m * std::pow(10, power);
      if (v >= low && v <= high) ticks.push_back(v);
    }
  }
  return ticks;
}

}  // namespace

std::string model_class(const ModelFormat& model) {
  return fmt::format("m{}", static_cast<std::uint32_t>(model.id) % kModelCount);
}

namespace {

// Elements that are still open, of about the radius r.
std::string circle(double x, double y, double r) {
  return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"", x, y, r);
}
std::string square(double x, double y, double r) {
  return fmt::format("<path d=\"M{:.1f} {:.1f}h{:.1f}v{:.1f}h{:.1f}z\"", x - 0.9 * r, y - 0.9 * r, 1.8 * r,
                     1.8 * r, -1.8 * r);
}
std::string triangle(double x, double y, double r) {
  return fmt::format("<path d=\"M{:.1f} {:.1f}l{:.1f} {:.1f}h{:.1f}z\"", x, y - 1.15 * r, 1.15 * r, 2 * r,
                     -2.3 * r);
}
std::string diamond(double x, double y, double r) {
  const double s = 1.25 * r;
  return fmt::format("<path d=\"M{:.1f} {:.1f}l{:.1f} {:.1f}l{:.1f} {:.1f}l{:.1f} {:.1f}z\"", x, y - s, s, s,
                     -s, s, -s, -s);
}

constexpr std::string (*kMarks[])(double x, double y, double r) = {circle, square, triangle, diamond};

}  // namespace

// Each model has a shape of its own beside its colour, for those to whom colours are alike.
std::string plot_mark(const ModelFormat& model, double x, double y, double r) {
  return kMarks[static_cast<std::uint32_t>(model.id) % std::size(kMarks)](x, y, r);
}

std::string trade_plot(const std::vector<TradePoint>& points, const TradePlot& plot) {
  const auto shown = [&](const TradePoint& p) {
    const auto x = plot.x(p), y = plot.y(p);
    return x && y && *x > 0;
  };
  const auto place = [&](const TradePoint& p) {
    return std::pair(std::log10(*plot.x(p)), plot.rises ? -*plot.y(p) : *plot.y(p));
  };
  std::vector<std::pair<double, double>> places;
  for (const TradePoint& p : points) {
    if (shown(p)) places.push_back(place(p));
  }
  if (places.empty()) return "";
  const auto [left, right] = std::minmax_element(places.begin(), places.end());
  const auto [lowest, highest] = std::minmax_element(
      places.begin(), places.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  const double wide = std::max(right->first - left->first, 0.3);
  const double step = round_step(std::max(highest->second - lowest->second, 1e-3), 6);
  const Axis x{left->first - 0.04 * wide, right->first + 0.04 * wide, kLeft, kWidth - kRight};
  const Axis y{step * std::floor(lowest->second / step - 0.1), step * std::ceil(highest->second / step + 0.1),
               kHeight - kBottom, kTop};

  std::string svg = fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{} over {}\">", kWidth,
                                kHeight, escaped(plot.y_title), escaped(plot.x_title));
  for (double v = y.low; v < y.high + step / 2; v += step) {
    const double shown_value = std::abs(v) < step / 1e6 ? 0 : v;
    svg += fmt::format(
        "\n<path class=\"grid\" d=\"M{} {:.1f}H{}\"/><text x=\"{}\" y=\"{:.1f}\" "
        "text-anchor=\"end\">{:g}</text>",
        kLeft, y.at(v), kWidth - kRight, kLeft - 8, y.at(v) + 4, shown_value);
  }
  for (const double v : log_ticks(x, plot.x_is_bytes)) {
    const double at = x.at(std::log10(v));
    svg += fmt::format(
        "\n<path class=\"grid\" d=\"M{:.1f} {}V{}\"/><text x=\"{:.1f}\" y=\"{}\" "
        "text-anchor=\"middle\">{}</text>",
        at, kTop, kHeight - kBottom, at, kHeight - kBottom + 18, tick_text(v, plot.x_is_bytes));
  }
  svg += fmt::format("\n<text class=\"title\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>",
                     kWidth - kRight, kHeight - 6, escaped(plot.x_title));
  svg += fmt::format("\n<text class=\"title\" x=\"{}\" y=\"{}\">{}</text>", kLeft + 8, kTop + 14,
                     escaped(plot.y_title));
  std::string line;
  for (const std::size_t i : plot.front) {
    if (!shown(points[i])) continue;
    const auto [px, py] = place(points[i]);
    // What may be had with so much: the best so far, until the next is reached.
    line += line.empty() ? fmt::format("M{:.1f} {:.1f}", x.at(px), y.at(py))
                         : fmt::format("H{:.1f}V{:.1f}", x.at(px), y.at(py));
  }
  if (!line.empty()) svg += fmt::format("\n<path class=\"front\" d=\"{}H{}\"/>", line, kWidth - kRight);
  // Those of the front last, on top.
  for (const bool on_front : {false, true}) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const TradePoint& p = points[i];
      const bool is = std::find(plot.front.begin(), plot.front.end(), i) != plot.front.end();
      if (!shown(p) || is != on_front) continue;
      const auto [px, py] = place(p);
      svg += fmt::format("\n<a href=\"#p{}\" class=\"point {}{}\"><title>{} {}\n{}, {}{}</title>{}/></a>", i,
                         model_class(*p.model), is ? " best" : "", p.model->name, escaped(setting_text(p)),
                         error_text(p), bytes_text(p.is.payload_bytes),
                         p.is.cost ? fmt::format(", {} operations", p.is.cost->operations) : "",
                         plot_mark(*p.model, x.at(px), y.at(py), is ? 5.2 : 3.4));
    }
  }
  return svg + "\n</svg>";
}

}  // namespace btfc
