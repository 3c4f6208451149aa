// Leather, plaster and brushed metal for synthetic BTFs.
#include <array>
#include <cstddef>

#include "encoder/synth/btf_surface.h"

namespace btfc::procedural {
namespace {

// The Voronoi diagram of one jittered point a cell, on the tile.
struct Cell {
  double i = 0, j = 0;  // whose cell it is, wrapped
  double border = 0;    // distance to the nearest border, texels, corners rounded off
};
Cell voronoi(const Tile& tile, double x, double y, double size, std::uint64_t salt) {
  const double columns = Tile::count(tile.width, size), rows = Tile::count(tile.height, size);
  const double cell_x = tile.width / columns, cell_y = tile.height / rows;
  const double ci = std::floor(x / cell_x), cj = std::floor(y / cell_y);
  struct Site {
    double x, y, distance2, i, j;
  };
  std::array<Site, 25> sites{};
  std::size_t count = 0, nearest = 0;
  for (double j = cj - 2; j <= cj + 2; j += 1) {
    for (double i = ci - 2; i <= ci + 2; i += 1) {
      const double wi = wrapped(i, columns), wj = wrapped(j, rows);
      const Draw d = tile.noise.draw(wi, wj, salt);
      const double dx = (i + 0.08 + 0.84 * d[0]) * cell_x - x, dy = (j + 0.08 + 0.84 * d[1]) * cell_y - y;
      sites[count] = {dx, dy, dx * dx + dy * dy, wi, wj};
      if (sites[count].distance2 < sites[nearest].distance2) nearest = count;
      ++count;
    }
  }
  const Site& own = sites[nearest];
  // Distances to the bisectors, joined by a norm that rounds the corners off.
  double sum = 0;
  for (std::size_t k = 0; k < count; ++k) {
    if (k == nearest) continue;
    const double dx = sites[k].x - own.x, dy = sites[k].y - own.y, apart = std::sqrt(dx * dx + dy * dy);
    const double border = std::max(0.5 * (sites[k].distance2 - own.distance2) / std::max(apart, 1e-6), 1e-3);
    sum += 1 / square(square(border));
  }
  return {own.i, own.j, 1 / std::sqrt(std::sqrt(sum))};
}

}  // namespace

Surface leather(const Tile& tile) {
  const double side = std::min(tile.width, tile.height), scale = std::min(1.0, side / 9);
  return [=](double x, double y) {
    const double px = x + 1.1 * scale * tile.fractal(x, y, 9, 2, 400);
    const double py = y + 1.1 * scale * tile.fractal(x, y, 9, 2, 410);
    const Cell large = voronoi(tile, px, py, 9, 420);
    const Cell small = voronoi(tile, px + 0.4 * scale * tile.smooth(x, y, 3, 3, 425), py, 3.6, 421);
    const Draw d = tile.noise.draw(large.i, large.j, 430), e = tile.noise.draw(small.i, small.j, 431);
    const double fold = tile.fractal(x, y, 26, 3, 440), fine = tile.fractal(x, y, 2.2, 2, 450);
    // Creases where a slow noise changes its sign, as the skin folds.
    const double crease = step(0.16, 0.0, std::abs(tile.fractal(px, py, 21, 2, 460)));

    const double plump = rounded(large.border / scale, 2.6 + 1.0 * d[0]);
    const double pebble = rounded(small.border / scale, 1.3);
    SurfacePoint p;
    p.height = scale * ((1.3 + 0.6 * d[1]) * plump + (0.26 + 0.18 * e[0]) * pebble + 0.6 * fold -
                        0.9 * crease + 0.05 * fine);
    const double top = plump * (1 - 0.8 * crease);
    const double tone = 0.82 + 0.20 * d[2] + 0.16 * e[1] + 0.18 * fold + 0.10 * fine;
    p.albedo = mix(Rgb{0.050, 0.018, 0.010}, Rgb{0.27, 0.105, 0.045}, top) * std::max(tone, 0.1);
    p.diffuse_roughness = 0.15;
    p.specular = 0.045 * mix(0.35, 1.0, top);
    p.along = p.across = 0.24 + 0.10 * e[2] + 0.16 * (1 - top);
    return p;
  };
}

Surface plaster(const Tile& tile) {
  const double side = std::min(tile.width, tile.height), scale = std::min(1.0, side / 12);
  return [=](double x, double y) {
    const double wave = tile.fractal(x, y, 24, 5, 500);
    // Strokes of the trowel: noise drawn out along x, bent.
    const double bend = y + 3.0 * scale * tile.fractal(x, y, 20, 2, 510);
    const double stroke = tile.smooth(x, bend, 26, 4.5, 520);
    const double edge = step(0.02, 0.30, stroke);
    const Cell sand = voronoi(tile, x, y, 2.7, 530);
    const Draw d = tile.noise.draw(sand.i, sand.j, 531);
    const double grit = d[0] > 0.45 ? (d[0] - 0.3) * rounded(sand.border / scale, 1.2) : 0;
    const double pit = step(0.46, 0.72, tile.smooth(x, y, 4.2, 4.2, 540));
    const double fine = tile.white(x, y, 550);
    SurfacePoint p;
    p.height = scale * (0.9 * wave + 0.55 * edge + 0.75 * grit - 1.0 * pit + 0.06 * fine);
    const double tone = 0.92 + 0.10 * wave + 0.16 * (d[1] - 0.5) + 0.05 * fine - 0.12 * pit;
    p.albedo = Rgb{0.66, 0.585, 0.47} * tone;
    if (d[2] < 0.10) p.albedo = mix(p.albedo, Rgb{0.27, 0.24, 0.20}, 0.7 * step(0, 0.8, sand.border / scale));
    p.diffuse_roughness = 0.7;
    p.specular = 0.02;
    p.along = p.across = 0.6;
    return p;
  };
}

Surface brushed(const Tile& tile) {
  const double scale = std::min(1.0, tile.height / 8);
  return [=](double x, double y) {
    const double long_streak = tile.smooth(x, y, 48, 1.0, 600) + 0.7 * tile.smooth(x, y, 64, 2.6, 610);
    const double streak = tile.smooth(x, y, 20, 0.8, 620), nick = tile.smooth(x, y, 9, 0.9, 630);
    const double scratch = step(0.50, 0.85, tile.smooth(x, y, 30, 1.2, 640));
    const double dent = tile.fractal(x, y, 30, 2, 650);
    SurfacePoint p;
    p.height = scale * (0.24 * long_streak + 0.22 * streak + 0.17 * nick - 0.50 * scratch + 0.36 * dent);
    p.albedo = Rgb{0.060, 0.058, 0.055} * (1 + 0.3 * streak);
    p.specular = 0.55 * saturate(0.74 + 0.26 * long_streak + 0.22 * streak + 0.18 * nick - 0.40 * scratch);
    p.along = std::clamp(0.22 + 0.05 * streak, 0.12, 0.4);
    p.across = std::clamp(0.52 + 0.16 * long_streak, 0.3, 0.8);
    return p;
  };
}

}  // namespace btfc::procedural
