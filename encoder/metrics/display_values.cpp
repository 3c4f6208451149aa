// Tables from codes to display-coded values, and luma.
#include "encoder/metrics/display_values.h"

#include <cmath>

#include "encoder/metrics/lab.h"

namespace btfc {

std::vector<float> display_table(SampleType type, ColourSpace colour_space) {
  const bool linear = type == SampleType::float16 && colour_space != ColourSpace::data &&
                      colour_space != ColourSpace::srgb_rec709_scene;
  std::vector<float> table(type == SampleType::unorm8 ? 256 : 65536);
  for (std::size_t code = 0; code < table.size(); ++code) {
    double v = code_value(type, static_cast<std::uint16_t>(code));
    v = std::isnan(v) ? 0 : std::fmin(std::fmax(v, 0), 1);
    if (linear) v = srgb_of_linear(v);
    table[code] = static_cast<float>(v);
  }
  return table;
}

std::vector<float> display_table(const Image& image) { return display_table(image.type, image.colour_space); }

std::vector<double> luma(const Image& image, const std::vector<float>& display) {
  std::vector<double> out(std::size_t{image.width} * image.height);
  for (std::size_t q = 0; q < out.size(); ++q) {
    const std::uint16_t* c = &image.codes[q * image.channels];
    out[q] = image.channels >= 3 ? 0.299 * display[c[0]] + 0.587 * display[c[1]] + 0.114 * display[c[2]]
                                 : static_cast<double>(display[c[0]]);
  }
  return out;
}

}  // namespace btfc
