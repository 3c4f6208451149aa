// A scatter plot of a trade-off as SVG.
#pragma once
#include <string>
#include <vector>

#include "tools/trade_points.h"

namespace btfc {

struct TradePlot {
  std::string x_title, y_title;
  Coordinate x;  // on a logarithmic axis
  Coordinate y;  // on a linear one, drawn as -y where `rises`
  bool rises = false;
  bool x_is_bytes = false;
  std::vector<std::size_t> front;
};

// Points of at least one model that has both coordinates; empty where there is none.
std::string trade_plot(const std::vector<TradePoint>& points, const TradePlot& plot);

// A model's mark as an SVG element that is still open.
std::string plot_mark(const ModelFormat& model, double x, double y, double r);

// The CSS class of a model's points, "m0" to "m9".
std::string model_class(const ModelFormat& model);

}  // namespace btfc
