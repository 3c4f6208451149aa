// What plots are written with.
#pragma once
#include <string>

namespace btfc {

// Text inside of HTML and SVG, attributes among it.
std::string escaped(const std::string& text);

// 1, 2 or 5 times a power of ten, so that about `count` steps fill the span.
double round_step(double span, double count);

}  // namespace btfc
