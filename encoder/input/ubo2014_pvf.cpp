// PVF: the images of each view are a matrix with a PCA of its own.
#include <fmt/format.h>

#include "encoder/input/ubo2014_factors.h"

namespace btfc {
namespace {

void read_view(Ubo2014Cursor& cursor, Ubo2014Header& header, std::uint32_t view, Ubo2014Factored& body) {
  const std::string what = fmt::format("view {}", view);
  const Ubo2014Matrix shape = read_ubo2014_shape(cursor, what);
  const std::uint64_t weights = cursor.u32("the number of weights of " + what);
  const std::uint64_t dimension = cursor.u32("the dimension of " + what);
  if (cursor.failed()) return;
  const std::uint64_t channels = header.channels.size(), lights = header.lights.size();
  const std::uint64_t texels = header.texels();
  const bool by_light = dimension == channels * lights && weights == texels;
  const bool by_texel = dimension == channels * texels && weights == lights;
  if (!by_light && !by_texel) {
    cursor.refuse(
        fmt::format("{} has {} weights of dimension {}, expected {} lights and {} texels of {} channels",
                    what, weights, dimension, lights, texels, channels));
    return;
  }
  if (by_light && by_texel && texels > 1 && view == 0) {
    header.notes.push_back("there are as many lights as texels: a PCA's dimension is taken as lights");
  }
  skip_ubo2014_matrix(cursor, shape, 1, "the eigenvalues of " + what);
  Ubo2014Matrix column = shape;
  column.components = 1;
  const Ubo2014Matrix mean = skip_ubo2014_matrix(cursor, column, dimension, "the mean of " + what);
  const Ubo2014Matrix basis = skip_ubo2014_matrix(cursor, shape, dimension, "the components of " + what);
  const Ubo2014Matrix weight = skip_ubo2014_matrix(cursor, shape, weights, "the weights of " + what);
  // Channels run fastest in the dimension.
  for (std::uint64_t c = 0; c < channels; ++c) {
    Ubo2014Factors factors;
    factors.directions = by_light ? Ubo2014Rows{basis, c, channels} : Ubo2014Rows{weight, 0, 1};
    factors.texels = by_light ? Ubo2014Rows{weight, 0, 1} : Ubo2014Rows{basis, c, channels};
    factors.has_mean = by_light ? Ubo2014Factors::Mean::of_direction : Ubo2014Factors::Mean::of_texel;
    factors.mean = {mean, c, channels};
    body.factors.push_back(factors);
  }
}

}  // namespace

Ubo2014Factored read_ubo2014_pvf(Ubo2014Cursor& cursor, Ubo2014Header& header) {
  Ubo2014Factored body;
  body.group_a_view = true;
  cursor.u32("the number of components");  // again for each view
  const std::uint32_t slots = cursor.u32("the number of views");
  if (!cursor.failed() && slots != header.views.size()) {
    cursor.refuse(fmt::format("factorisations of {} views, expected {}", slots, header.views.size()));
  }
  for (std::uint32_t v = 0; v < slots && !cursor.failed(); ++v) read_view(cursor, header, v, body);
  return body;
}

}  // namespace btfc
