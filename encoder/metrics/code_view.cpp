// Table look-ups a row at a time.
#include "encoder/metrics/code_view.h"

#include "encoder/metrics/display_values.h"
#include "encoder/metrics/lab.h"

namespace btfc {
namespace {

bool has_rec709_primaries(ColourSpace space) {
  return space == ColourSpace::unknown || space == ColourSpace::srgb_rec709_scene ||
         space == ColourSpace::lin_rec709_scene;
}

}  // namespace

ColourMeaning colour_meaning(const Image& image) {
  if (!has_rec709_primaries(image.colour_space)) return ColourMeaning::none;
  if (image.channels <= 2) return ColourMeaning::grey;
  return image.channels <= 4 ? ColourMeaning::rgb : ColourMeaning::none;
}

ColourMeaning colour_meaning(const DatasetInfo& info) {
  const auto& names = info.channels;
  if (!has_rec709_primaries(info.colour_space)) return ColourMeaning::none;
  if (names.size() == 1) return ColourMeaning::grey;
  const bool rgb =
      (names.size() == 3 || names.size() == 4) && names[0] == "R" && names[1] == "G" && names[2] == "B";
  return rgb ? ColourMeaning::rgb : ColourMeaning::none;
}

CodeTables code_tables(SampleType type, ColourSpace colour_space) {
  CodeTables tables{display_table(type, colour_space), {}};
  for (const float v : tables.display) {
    tables.linear.push_back(static_cast<float>(linear_of_srgb(static_cast<double>(v))));
  }
  return tables;
}

void CodeView::grey_row(std::uint32_t y, std::span<float> grey) const {
  const std::uint16_t* c = codes.data() + std::size_t{y} * width * channels;
  const float* value = tables->display.data();
  for (std::uint32_t x = 0; x < width; ++x, c += channels) {
    if (meaning == ColourMeaning::rgb) {
      grey[x] = 0.299f * value[c[0]] + 0.587f * value[c[1]] + 0.114f * value[c[2]];
    } else if (meaning == ColourMeaning::grey) {
      grey[x] = value[c[0]];
    } else {
      float sum = 0;
      for (std::uint32_t i = 0; i < channels; ++i) sum += value[c[i]];
      grey[x] = sum / static_cast<float>(channels);
    }
  }
}

void CodeView::linear_row(std::uint32_t y, std::span<float> red, std::span<float> green,
                          std::span<float> blue) const {
  const std::uint16_t* c = codes.data() + std::size_t{y} * width * channels;
  const float* value = tables->linear.data();
  const std::size_t g = meaning == ColourMeaning::rgb ? 1 : 0, b = 2 * g;
  for (std::uint32_t x = 0; x < width; ++x, c += channels) {
    red[x] = value[c[0]];
    green[x] = value[c[g]];
    blue[x] = value[c[b]];
  }
}

CodeView code_view(const Image& image, const CodeTables& tables) {
  return {image.codes, image.width, image.height, image.channels, colour_meaning(image), &tables};
}

}  // namespace btfc
