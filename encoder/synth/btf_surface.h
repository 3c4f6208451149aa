// The materials of synthetic BTFs: a relief and its microfacets, point by point on a tile that wraps.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>

#include "encoder/synth/noise.h"
#include "encoder/synth/synth_math.h"

namespace btfc::procedural {

// Lengths in texels, x to the right, y downwards.
struct SurfacePoint {
  double height = 0;
  Rgb albedo;                       // of the diffuse part
  double diffuse_roughness = 0;     // 0 Lambert … 1, sigma of Fujii's Oren-Nayar
  double specular = 0;              // reflectance of the microfacets at normal incidence
  double grain_x = 1, grain_y = 0;  // direction of fibres or scratches in the plane, of length 1
  double along = 1, across = 1;     // GGX roughness along the grain and across it, 0.05 … 1
  double fuzz = 0;                  // strength of the fibres that stand off, coloured as the albedo
};

// x in [0, width), y in [0, height).
using Surface = std::function<SurfacePoint(double x, double y)>;

// A torus with a noise of its own.
struct Tile {
  double width, height;  // texels
  Noise noise;

  // How many features of about that size fit, at least one.
  static double count(double length, double size) { return std::max(1.0, std::floor(length / size + 0.5)); }
  static double even_count(double length, double size) { return 2 * count(length, 2 * size); }

  // Noise with features of about size_x by size_y texels, about -1 … 1.
  double smooth(double x, double y, double size_x, double size_y, std::uint64_t salt) const {
    const double columns = count(width, size_x), rows = count(height, size_y);
    return noise.smooth(x / width * columns, y / height * rows, salt, columns, rows);
  }
  // Octaves of it, each of half the size and amplitude of the one before.
  double fractal(double x, double y, double size, int octaves, std::uint64_t salt) const {
    double sum = 0, amplitude = 1;
    for (int k = 0; k < octaves; ++k) {
      // Each shifted, so that the zeros at the lattices' points do not fall together.
      sum += amplitude *
             smooth(x + 0.37 * size, y + 0.71 * size, size, size, salt + static_cast<std::uint64_t>(k));
      amplitude *= 0.5;
      size *= 0.5;
    }
    return sum;
  }
  // White noise, one value each half texel: the step of the relief.
  double white(double x, double y, std::uint64_t salt) const { return noise.white(2 * x, 2 * y, salt); }
};

// Prepares what the points share.
Surface weave(const Tile& tile);
Surface knit(const Tile& tile);
Surface corduroy(const Tile& tile);
Surface leather(const Tile& tile);
Surface plaster(const Tile& tile);
Surface brushed(const Tile& tile);

}  // namespace btfc::procedural
