// Noise of the procedural materials, by integer hashing: the same on every machine.
#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "encoder/synth/synth_math.h"

namespace btfc::procedural {

// Four independent values in [0, 1) from one hash.
struct Draw {
  std::array<double, 4> v;
  double operator[](std::size_t i) const { return v[i]; }
};

// i modulo n, 0 … n-1, of whole numbers; i where n is 0.
inline double wrapped(double i, double n) { return n == 0 ? i : i - std::floor(i / n) * n; }

class Noise {
 public:
  explicit Noise(std::uint64_t seed) : seed_(scramble(seed)) {}

  std::uint64_t bits(double i, double j, std::uint64_t salt) const {
    const auto column = static_cast<std::uint64_t>(static_cast<std::int64_t>(i));
    const auto row = static_cast<std::uint64_t>(static_cast<std::int64_t>(j));
    return scramble(scramble(seed_ + salt * 0x9e3779b97f4a7c15u + column) + row);
  }
  // i and j are whole numbers.
  Draw draw(double i, double j, std::uint64_t salt) const {
    const std::uint64_t h = bits(i, j, salt);
    Draw d{};
    for (std::size_t k = 0; k < 4; ++k) d.v[k] = static_cast<double>((h >> (16 * k)) & 0xffffu) / 65536;
    return d;
  }
  // Gradient noise with features one unit across, about -1 … 1, mean 0. It repeats after the periods, whole
  // numbers of units; 0 for never.
  double smooth(double x, double y, std::uint64_t salt, double period_x = 0, double period_y = 0) const {
    const double i = std::floor(x), j = std::floor(y), u = x - i, v = y - j;
    const double a = fade(u), b = fade(v);
    const double i0 = wrapped(i, period_x), i1 = wrapped(i + 1, period_x);
    const double j0 = wrapped(j, period_y), j1 = wrapped(j + 1, period_y);
    const double top = mix(slope(i0, j0, u, v, salt), slope(i1, j0, u - 1, v, salt), a);
    const double bottom = mix(slope(i0, j1, u, v - 1, salt), slope(i1, j1, u - 1, v - 1, salt), a);
    return 1.6 * mix(top, bottom, b);
  }
  // Octaves of it, each of half the amplitude of the one before, the first with features size texels across.
  double fractal(double x, double y, double size, int octaves, std::uint64_t salt) const {
    double sum = 0, amplitude = 1;
    x /= size;
    y /= size;
    for (int k = 0; k < octaves; ++k) {
      sum += amplitude * smooth(x, y, salt + static_cast<std::uint64_t>(k));
      amplitude *= 0.5;
      // Turned by about 37 degrees, so that the lattices of the octaves do not add up to a visible grid.
      const double turned = 1.6 * x - 1.2 * y;
      y = 1.2 * x + 1.6 * y;
      x = turned;
    }
    return sum;
  }
  // White noise, -1 … 1, denser in the middle.
  double white(double x, double y, std::uint64_t salt) const {
    const Draw d = draw(std::floor(x), std::floor(y), salt);
    return 0.5 * (d[0] + d[1] + d[2] + d[3]) - 1;
  }

 private:
  static std::uint64_t scramble(std::uint64_t h) {
    h += 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9u;
    h = (h ^ (h >> 27)) * 0x94d049bb133111ebu;
    return h ^ (h >> 31);
  }
  static double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
  double slope(double i, double j, double u, double v, std::uint64_t salt) const {
    const std::uint64_t h = bits(i, j, salt);
    const double gx = static_cast<double>(h & 0xffffu) / 32768 - 1;
    const double gy = static_cast<double>((h >> 16) & 0xffffu) / 32768 - 1;
    return gx * u + gy * v;
  }

  std::uint64_t seed_;
};

}  // namespace btfc::procedural
