// Formulas: undecorrelate and restore_dynamic_range of btflib (University of Bonn, 2014).
#include "encoder/input/ubo2014_colour.h"

#include <fmt/format.h>

#include <cmath>

namespace btfc {
namespace {

// Kept the logarithm finite at 0 when the files were made.
constexpr float kEpsilon = 1e-5f;

// The values of one place in the first three channels.
struct Triple {
  float a, b, c;
};

Triple yuv_to_rgb(Triple v) {
  return {v.a + 1.13983f * v.c, v.a - 0.39465f * v.b - 0.5806f * v.c, v.a + 2.03211f * v.b};
}

float signed_exp(float v) {
  if (v == 0) return 0;
  return std::copysign(std::exp(std::fabs(v)) * kEpsilon, v);
}

template <class Formula>
void each_triple(std::size_t stride, std::size_t count, float* values, const Formula& formula) {
  float *a = values, *b = values + stride, *c = values + 2 * stride;
  for (std::size_t i = 0; i < count; ++i) {
    const Triple out = formula(Triple{a[i], b[i], c[i]});
    a[i] = out.a;
    b[i] = out.b;
    c[i] = out.c;
  }
}

// The first channel's share is what the others leave of 1.
void spectral_sum(std::size_t channels, std::size_t stride, std::size_t count, float* values) {
  for (std::size_t i = 0; i < count; ++i) {
    const float sum = values[i];
    float first = 1;
    for (std::size_t c = 1; c < channels; ++c) {
      first -= values[c * stride + i];
      values[c * stride + i] *= sum;
    }
    values[i] = first * sum;
  }
}

}  // namespace

Ubo2014ColourChoice choose_ubo2014_colour(std::int32_t number, std::size_t channels) {
  Ubo2014ColourChoice choice{static_cast<Ubo2014ColourCoding>(number), {}};
  switch (choice.coding) {
    case Ubo2014ColourCoding::linear:
    case Ubo2014ColourCoding::log:
    case Ubo2014ColourCoding::spectral_sum:
      return choice;
    case Ubo2014ColourCoding::yuv:
    case Ubo2014ColourCoding::pca:
    case Ubo2014ColourCoding::ycocg:
    case Ubo2014ColourCoding::log_y_uv:
    case Ubo2014ColourCoding::log_y_log_uv:
    case Ubo2014ColourCoding::log_y_relative_uv:
      if (channels != 3) {
        choice.fault = fmt::format("colour model {} of {} channels, expected 3", number, channels);
      }
      return choice;
  }
  const char* name = number == 2 ? " (CIE Lab)" : number == 6 ? " (a spectral sum)" : "";
  choice.fault = fmt::format("colour model {}{} is not supported, expected 0, 1, 3, 4, 5, 9, 10, 11 or 12",
                             number, name);
  return choice;
}

void ubo2014_to_linear(const Ubo2014Colour& colour, std::size_t channels, std::size_t stride,
                       std::size_t count, float* values) {
  switch (colour.coding) {
    case Ubo2014ColourCoding::linear:
      return;
    case Ubo2014ColourCoding::yuv:
      return each_triple(stride, count, values, yuv_to_rgb);
    case Ubo2014ColourCoding::pca:
      return each_triple(stride, count, values, [&](Triple v) {
        const auto& m = colour.matrix;
        return Triple{v.a * m[0] + v.b * m[3] + v.c * m[6] + colour.mean[0],
                      v.a * m[1] + v.b * m[4] + v.c * m[7] + colour.mean[1],
                      v.a * m[2] + v.b * m[5] + v.c * m[8] + colour.mean[2]};
      });
    case Ubo2014ColourCoding::ycocg:
      return each_triple(stride, count, values, [](Triple v) {
        return Triple{v.a + v.b - v.c, v.a + v.c, v.a - v.b - v.c};
      });
    case Ubo2014ColourCoding::spectral_sum:
      return spectral_sum(channels, stride, count, values);
    case Ubo2014ColourCoding::log_y_uv:
      return each_triple(stride, count, values, [](Triple v) {
        return yuv_to_rgb({std::exp(v.a) - kEpsilon, v.b, v.c});
      });
    case Ubo2014ColourCoding::log_y_log_uv:
      return each_triple(stride, count, values, [](Triple v) {
        return yuv_to_rgb({std::exp(v.a) - kEpsilon, signed_exp(v.b), signed_exp(v.c)});
      });
    case Ubo2014ColourCoding::log_y_relative_uv:
      // U and V are multiplied by Y + epsilon, which is the exponential itself.
      return each_triple(stride, count, values, [](Triple v) {
        const float e = std::exp(v.a);
        return yuv_to_rgb({e - kEpsilon, v.b * e, v.c * e});
      });
    case Ubo2014ColourCoding::log:
      for (std::size_t c = 0; c < channels; ++c) {
        float* channel = values + c * stride;
        for (std::size_t i = 0; i < count; ++i) channel[i] = std::exp(channel[i]) - kEpsilon;
      }
      return;
  }
}

}  // namespace btfc
