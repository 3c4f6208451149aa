// Cloth for synthetic BTFs: yarns as bent tubes with plies and fibres on them, and ribs of pile.
#include <array>
#include <cstddef>
#include <vector>

#include "encoder/synth/btf_surface.h"

namespace btfc::procedural {
namespace {

constexpr double kPi = 3.14159265358979323846;

// What is twisted into a yarn, at one place of its upper side.
struct Twist {
  double ply = 0;                          // -1 in the valley between two plies … 1 on the back of one
  double fibre = 0;                        // noise drawn out along the fibres, about -1 … 1
  double tone = 0;                         // of the yarn here, about -1 … 1
  double lean_along = 1, lean_across = 0;  // the fibres' direction, of length 1
};

// along in units of the crossings or stitches, repeating after `period` of them; across is -1 … 1 over the
// yarn; aspect is the yarn's half width in units of along.
struct YarnPlace {
  double along, across, period, aspect;
  std::uint64_t id;  // of the yarn
};
Twist twist(const Noise& noise, const YarnPlace& at, double plies, double turn, std::uint64_t salt) {
  // A helix seen from above: its phase runs with the angle around the yarn, near to asin(across).
  const double around = at.across * (1 + 0.25 * at.across * at.across);
  const std::uint64_t own = salt + 1000 * at.id;
  Twist out;
  out.ply = cosine(2 * kPi * (plies * at.along + turn * around));
  const double slant = std::floor(2 * plies);  // whole, so that the noise repeats with the yarn
  out.fibre =
      noise.smooth(2 * at.along, 4.5 * around + slant * at.along, own, 2 * at.period, slant * at.period);
  out.tone = noise.smooth(at.along + 0.5, 0.4, own + 1, at.period, 0);
  const double rise = plies, run = turn / at.aspect;  // the phase's gradient along and across
  const double length = std::sqrt(rise * rise + run * run);
  out.lean_along = run / length;
  out.lean_across = -rise / length;
  return out;
}

}  // namespace

Surface weave(const Tile& tile) {
  constexpr double kYarn = 10.7;
  const double warps = Tile::even_count(tile.width, kYarn), wefts = Tile::even_count(tile.height, kYarn);
  const double pitch_x = tile.width / warps, pitch_y = tile.height / wefts,
               pitch = std::min(pitch_x, pitch_y);
  const double round_height = 0.17 * pitch, crimp = 0.08 * pitch;
  return [=](double x, double y) {
    // Places in pitches, pulled a little out of the grid.
    const double px = x / pitch_x + 0.10 * tile.fractal(x, y, 2.3 * kYarn, 2, 100);
    const double py = y / pitch_y + 0.10 * tile.fractal(x, y, 2.3 * kYarn, 2, 110);
    const double i = std::floor(px), j = std::floor(py);

    struct Yarn {
      double height, across;
      Twist twist;
      Draw draw;
    };
    const auto yarn = [&](bool warp) {
      const double id = warp ? wrapped(i, warps) : wrapped(j, wefts);
      const double along = warp ? py : px, period = warp ? wefts : warps;
      const std::uint64_t salt = warp ? 120 : 140;
      Yarn out{};
      out.draw = tile.noise.draw(id, 0, salt);
      const std::uint64_t own = salt + 1000 * static_cast<std::uint64_t>(id);
      const double slub = tile.noise.smooth(along, 0.3, own + 2, period, 0);
      const double sway = tile.noise.smooth(along, 0.6, own + 3, period, 0);
      const double thickness = 0.79 + 0.12 * out.draw[0] + 0.07 * slub;
      const double offset = 2 * ((warp ? px : py) - (warp ? i : j)) - 1;
      out.across = (offset - 0.07 * sway) / thickness;
      // Over at every second crossing, under at the others, warp against weft.
      const double wave = cosine(kPi * (px - 0.5 + std::floor(py))) * (warp ? 0 : -1) +
                          cosine(kPi * (py - 0.5 + std::floor(px))) * (warp ? 1 : 0);
      const double round = 1 - square(out.across);
      if (round <= 0) {
        out.height = -1e3;
        return out;
      }
      out.twist =
          twist(tile.noise, {along, out.across, period, 0.5 * thickness, static_cast<std::uint64_t>(id)}, 2,
                warp ? 1.5 : -1.5, salt + 4);
      out.height = crimp * wave + round_height * (0.92 + 0.16 * out.draw[2]) * std::sqrt(round) +
                   pitch * (0.014 * out.twist.ply + 0.022 * out.twist.fibre) * std::sqrt(round);
      return out;
    };
    const Yarn warp = yarn(true), weft = yarn(false);
    const bool warp_on_top = warp.height > weft.height;
    const Yarn& top = warp_on_top ? warp : weft;
    const double floor_height = -crimp - 0.08 * pitch;
    const double fine = tile.white(x, y, 160);

    SurfacePoint p;
    p.height = std::max(top.height, floor_height) + 0.006 * pitch * fine;
    const Rgb indigo{0.075, 0.135, 0.27}, ecru{0.56, 0.475, 0.35};
    const double tone = 0.84 + 0.32 * top.draw[1] + 0.14 * top.twist.tone + 0.34 * top.twist.fibre +
                        0.13 * top.twist.ply + 0.10 * fine;
    p.albedo = (warp_on_top ? indigo : ecru) *
               (std::max(tone, 0.1) * (0.72 + 0.28 * std::sqrt(std::max(0.0, 1 - square(top.across)))));
    if (top.height < floor_height) p.albedo = Rgb{0.02, 0.02, 0.025};
    p.diffuse_roughness = 0.3;
    p.specular = warp_on_top ? 0.06 : 0.045;
    p.along = 0.32;
    p.across = 0.62;
    p.grain_x = warp_on_top ? top.twist.lean_across : top.twist.lean_along;
    p.grain_y = warp_on_top ? top.twist.lean_along : top.twist.lean_across;
    p.fuzz = 0.25;
    return p;
  };
}

Surface knit(const Tile& tile) {
  constexpr double kWale = 16, kCourse = 12.5;
  const double wales = Tile::count(tile.width, kWale), courses = Tile::count(tile.height, kCourse);
  const double wale = tile.width / wales, course = tile.height / courses,
               pitch = std::min(wale, 1.28 * course);
  const double radius = 0.205 * wale, round_height = 0.12 * pitch, depth = 0.08 * pitch;
  // One stitch of a course as a curve: sinker loop at 0, legs at a quarter and three quarters, needle loop at
  // one half, narrow at the foot and wide at the head so that neighbouring courses interlock.
  struct Node {
    double x, y, z;
  };
  constexpr std::size_t kSegments = 28;
  std::array<Node, kSegments + 1> loop{};
  for (std::size_t k = 0; k <= kSegments; ++k) {
    const double t = static_cast<double>(k) / kSegments;
    loop[k] = {wale * (t + 0.19 * sine(4 * kPi * t)), 0.92 * course * cosine(2 * kPi * t),
               -depth * cosine(4 * kPi * t)};
  }
  return [=](double x, double y) {
    const double sx = x + 0.055 * wale * tile.fractal(x, y, 1.6 * kWale, 2, 200);
    const double sy = y + 0.075 * course * tile.fractal(x, y, 1.6 * kWale, 2, 210);
    const double i0 = std::floor(sx / wale), j0 = std::floor(sy / course);
    struct Hit {
      double height = -1e3, along = 0, across = 0, tangent_x = 1, tangent_y = 0, stitch = 0, course = 0;
    };
    Hit top;
    for (double j = j0 - 2; j <= j0 + 2; j += 1) {
      const double v = sy - (j + 0.5) * course;
      if (std::abs(v) > 0.95 * course + radius) continue;
      for (double i = i0 - 1; i <= i0 + 1; i += 1) {
        const double u = sx - i * wale;
        const Draw stitch = tile.noise.draw(wrapped(i, wales), wrapped(j, courses), 220);
        const double girth = radius * (0.93 + 0.07 * stitch[0]);
        for (std::size_t k = 0; k < kSegments; ++k) {
          const Node &a = loop[k], &b = loop[k + 1];
          const double dx = b.x - a.x, dy = b.y - a.y, length2 = dx * dx + dy * dy;
          const double t = saturate(((u - a.x) * dx + (v - a.y) * dy) / length2);
          const double ex = u - a.x - t * dx, ey = v - a.y - t * dy, distance2 = ex * ex + ey * ey;
          if (distance2 >= girth * girth) continue;
          const double height = mix(a.z, b.z, t) + round_height * std::sqrt(1 - distance2 / (girth * girth));
          if (height <= top.height) continue;
          const double length = std::sqrt(length2), side = dx * ey - dy * ex;
          top = {height,
                 i + (static_cast<double>(k) + t) / kSegments,
                 (side < 0 ? -1 : 1) * std::sqrt(distance2) / girth,
                 dx / length,
                 dy / length,
                 stitch[1],
                 wrapped(j, courses)};
        }
      }
    }
    const double fine = tile.white(x, y, 230);
    SurfacePoint p;
    p.diffuse_roughness = 0.45;
    p.specular = 0.04;
    p.along = 0.40;
    p.across = 0.70;
    p.fuzz = 0.55;
    const double floor_height = -depth - 0.06 * pitch;
    if (top.height < floor_height) {
      p.height = floor_height;
      p.albedo = {0.05, 0.015, 0.012};
      return p;
    }
    const Twist yarn =
        twist(tile.noise, {top.along, top.across, wales, 0.07, static_cast<std::uint64_t>(top.course)}, 9,
              1.1, 240);
    const double round = std::sqrt(std::max(0.0, 1 - square(top.across)));
    p.height = top.height + pitch * (0.010 * yarn.ply + 0.015 * yarn.fibre) * round + 0.005 * pitch * fine;
    const double course_tone = tile.noise.draw(0, top.course, 250)[0];
    const double tone = 0.80 + 0.14 * course_tone + 0.12 * top.stitch + 0.14 * yarn.tone + 0.32 * yarn.fibre +
                        0.15 * yarn.ply + 0.09 * fine;
    // Heather: some fibres are paler than the dye.
    const double pale = step(0.35, 0.75, yarn.fibre + 0.25 * fine);
    p.albedo = mix(Rgb{0.46, 0.085, 0.055}, Rgb{0.56, 0.30, 0.22}, 0.6 * pale) *
               (std::max(tone, 0.1) * (0.42 + 0.58 * round));
    p.grain_x = top.tangent_x * yarn.lean_along - top.tangent_y * yarn.lean_across;
    p.grain_y = top.tangent_y * yarn.lean_along + top.tangent_x * yarn.lean_across;
    return p;
  };
}

Surface corduroy(const Tile& tile) {
  constexpr double kRib = 16;
  const double ribs = Tile::count(tile.width, kRib), pitch = tile.width / ribs;
  const double relief = 0.25 * pitch;
  return [=](double x, double y) {
    const double px = x / pitch + 0.035 * tile.fractal(x, y, 18, 3, 300);
    const double i = wrapped(std::floor(px), ribs), u = 2 * (px - std::floor(px)) - 1;
    const Draw rib = tile.noise.draw(i, 0, 310);
    // Pile in tufts, one each second weft, each bent its own way; hairs lean away from the rib's middle.
    const double side = u < 0 ? -1 : 1, out = std::abs(u);
    const double rows = Tile::count(tile.height, 4.2);
    const double row = y / tile.height * rows + 0.35 * tile.smooth(x, y, 7, 9, 320) + 0.5 * rib[3] * side;
    const double tuft = tile.noise.smooth(row, 2.2 * out + 40 * i + 20 * (side + 1), 330, rows, 0);
    const double hair = tile.smooth(x, y, 1.5, 1.3, 340), clump = tile.fractal(x, y, 5, 2, 350);
    const double fine = tile.white(x, y, 360);
    const double edge = 0.84 + 0.07 * rib[0] + 0.05 * tuft + 0.04 * hair;  // where the rib ends
    const double inside = (edge - out) / edge;
    const double pile = step(0, 0.09, inside);

    SurfacePoint p;
    const double dome = rounded(inside, 0.95);
    const double fuzz_height = pitch * (0.012 * hair + 0.015 * tuft + 0.013 * clump + 0.006 * fine);
    // The ground weave in the groove.
    const double ground = pitch * 0.015 * cosine(2 * kPi * row * 2);
    p.height = relief * (0.90 + 0.14 * rib[1]) * dome + mix(ground, fuzz_height, pile);
    const double tone = 0.84 + 0.16 * rib[2] + 0.20 * tuft + 0.24 * hair + 0.20 * clump + 0.12 * fine;
    const Rgb ochre{0.43, 0.265, 0.105}, base{0.17, 0.095, 0.04};
    p.albedo = mix(base, ochre * std::max(tone, 0.1), pile);
    p.diffuse_roughness = 0.6;
    p.specular = 0.035;
    p.along = 0.45;
    p.across = 0.65;
    p.grain_x = 0.9;
    p.grain_y = 0.43588989435406736;
    p.fuzz = mix(0.15, 1.1, pile);
    return p;
  };
}

}  // namespace btfc::procedural
