// Procedural textures: a height field and a base colour per texel, lit from the upper left and photographed.
// Only integer hashing, + - * / and square roots, so that no libm or standard library shows in the codes.
#include "encoder/synth/texture_synth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include "encoder/synth/noise.h"
#include "encoder/synth/synth_math.h"

namespace btfc {
namespace {

using namespace procedural;

// --- Materials ------------------------------------------------------------------------------------------

struct Texel {
  double height = 0;  // in texels
  Rgb albedo;         // linear
  double gloss = 0;   // strength of the mirror reflection
  double glint = 0;   // light thrown at the camera by a facet too small for the height field
};
using Material = Texel (*)(const Noise&, double x, double y);

// Salts: each material has a hundred of its own; the octaves of one fractal take consecutive ones.

// Octagons with a painted flower and blue dots between: the outlines repeat exactly every 40 texels, and only
// the glaze, the grout and the tone of a tile differ, as in a photograph of a new floor.
Texel tiles(const Noise& noise, double x, double y) {
  constexpr double kPeriod = 40, kHalf = kPeriod / 2, kDot = 12, kGrout = 1.9,
                   kDiagonal = 0.70710678118654752;
  const double column = std::floor(x / kPeriod), row = std::floor(y / kPeriod);
  const double u = std::abs(x - column * kPeriod - kHalf), v = std::abs(y - row * kPeriod - kHalf);
  const double slant = (kPeriod - kDot - u - v) * kDiagonal;  // from the edge between octagon and dot
  const double octagon = std::min(kHalf - std::max(u, v), slant) - kGrout;
  const double dot = -slant - kGrout;
  const double wear = noise.fractal(x, y, 7, 3, 100);
  const double fine = noise.white(x, y, 110);

  const bool in_dot = dot > octagon;
  const double inside = in_dot ? dot : octagon;
  const double tile_i = in_dot ? std::floor(x / kPeriod + 0.5) : column;
  const double tile_j = in_dot ? std::floor(y / kPeriod + 0.5) : row;
  const Draw tone = noise.draw(tile_i, tile_j, in_dot ? 121 : 120);

  const Rgb cobalt{0.030, 0.075, 0.26};
  Rgb glaze = cobalt;
  if (!in_dot) {
    const double along = std::max(u, v), across = std::min(u, v);
    const double petal = 1 - std::sqrt(square((along - 6.2) / 4.6) + square(across / 2.5));
    const double ring = 1.1 - std::abs(std::sqrt(u * u + v * v) - 13.4);
    const double heart = 1.9 - std::sqrt(u * u + v * v);
    const double brush = 0.10 * wear;
    const double ink = std::max(step(-0.12, 0.16, petal + brush), step(-0.5, 0.5, ring + 3 * brush));
    glaze = mix(Rgb{0.50, 0.46, 0.37}, mix(cobalt, Rgb{0.10, 0.19, 0.42}, saturate(0.5 + wear)), 0.93 * ink);
    glaze = mix(glaze, Rgb{0.58, 0.27, 0.035}, step(-0.6, 0.6, heart));
  }
  const double body = step(-0.6, 0.6, inside);
  const Rgb grout = Rgb{0.23, 0.21, 0.185} * (1 + 0.30 * wear + 0.35 * fine);
  const double warm = 0.05 * (tone[1] - 0.5);
  glaze = Rgb{glaze.r * (1 + warm), glaze.g, glaze.b * (1 - warm)} *
          (0.95 + 0.10 * tone[0] + 0.045 * wear + 0.03 * fine);
  Texel texel;
  texel.albedo = mix(grout, glaze, body);
  texel.height = 1.5 * rounded(inside + 0.6, 2.8) + mix(0.35 * wear + 0.4 * fine, 0.05 * wear, body);
  texel.gloss = 0.55 * body;
  return texel;
}

// A plain weave of coarse yarns, 10 texels a yarn, each of its own thickness and tone.
Texel weave(const Noise& noise, double x, double y) {
  constexpr double kYarn = 10;
  const double px = x + 0.9 * noise.fractal(x, y, 17, 2, 200), py = y + 0.9 * noise.fractal(x, y, 17, 2, 210);
  const double i = std::floor(px / kYarn), j = std::floor(py / kYarn);
  const double u = 2 * (px / kYarn - i) - 1, v = 2 * (py / kYarn - j) - 1;  // -1 … 1 in the crossing
  const bool warp_on_top = std::floor((i + j) / 2) * 2 == i + j;

  struct Yarn {
    double height, across, along, tone, thickness;
  };
  // across and along are -1 … 1 over the crossing; a yarn on top here dives under at both ends.
  const auto yarn = [&](bool warp, bool on_top) {
    const Draw d = noise.draw(warp ? i : 0, warp ? 0 : j, warp ? 220 : 221);
    const Draw local = noise.draw(i, j, warp ? 222 : 223);
    Yarn out{};
    out.thickness = 0.80 + 0.16 * d[0] + 0.10 * (local[0] - 0.5);
    out.across = (warp ? u : v) / out.thickness;
    out.along = warp ? v : u;
    out.tone = 0.84 + 0.26 * d[1] + 0.12 * (local[1] - 0.5);
    const double round = 1 - square(out.across);
    const double arch = 1 - square(out.along);
    out.height = round <= 0 ? -9 : 3.0 * std::sqrt(round) + (on_top ? 1.9 * arch : -1.9 * arch);
    return out;
  };
  const Yarn warp = yarn(true, warp_on_top), weft = yarn(false, !warp_on_top);
  const bool top_is_warp = warp.height > weft.height;
  const Yarn& top = top_is_warp ? warp : weft;

  // Twisted fibres: noise drawn out along the yarn, leaning across it.
  const double length = (top_is_warp ? py : px), width = (top_is_warp ? px : py);
  const double fibre =
      noise.smooth(length / 7 + width / 3.2, (width - 0.45 * length) / 1.7, top_is_warp ? 230 : 231);
  const double fine = noise.white(x, y, 240);
  const Rgb ecru{0.47, 0.36, 0.215}, jute{0.36, 0.245, 0.125};
  Texel texel;
  texel.height = std::max(top.height, -1.5) + 0.38 * fibre + 0.12 * fine;
  texel.albedo = mix(ecru, jute, top_is_warp ? 0.25 : 0.75) * (top.tone * (1 + 0.22 * fibre + 0.10 * fine));
  const double seen = step(-1.5, 0.8, top.height);
  texel.albedo = mix(Rgb{0.035, 0.026, 0.018}, texel.albedo, seen);
  texel.gloss = 0.10 * seen;
  const Draw spark = noise.draw(x, y, 250);
  if (spark[0] < 0.0005) texel.glint = 1.3 * spark[1] * seen;
  return texel;
}

// A running bond of weathered bricks, module 40 x 17 texels.
Texel bricks(const Noise& noise, double x, double y) {
  constexpr double kLength = 40, kCourse = 17;
  const double px = x + 1.1 * noise.fractal(x, y, 9, 2, 300), py = y + 1.0 * noise.fractal(x, y, 9, 2, 310);
  // Joints wander: a course's from its height, a brick's from its place in the course.
  const auto bed = [&](double j) { return j * kCourse + 1.6 * (noise.draw(0, j, 320)[0] - 0.5); };
  double j = std::floor(py / kCourse);
  if (py < bed(j)) j -= 1;
  if (py >= bed(j + 1)) j += 1;
  const double half = std::floor(j / 2) * 2 == j ? 0 : kLength / 2;
  const auto head = [&](double i) { return i * kLength + half + 5.0 * (noise.draw(i, j, 321)[0] - 0.5); };
  double i = std::floor((px - half) / kLength);
  if (px < head(i)) i -= 1;
  if (px >= head(i + 1)) i += 1;

  const Draw shape = noise.draw(i, j, 322), tone = noise.draw(i, j, 323), kind = noise.draw(i, j, 324);
  const double left = head(i) + 1.1 + 0.9 * shape[0], right = head(i + 1) - 1.1 - 0.9 * shape[1];
  const double tilt = 0.022 * (tone[3] - 0.5) * (px - 0.5 * (left + right));
  const double top = bed(j) + 1.1 + 0.8 * shape[2] + tilt, bottom = bed(j + 1) - 1.1 - 0.8 * shape[3] + tilt;
  // Distance inside a rectangle of rounded corners.
  constexpr double kCorner = 2.2;
  const double dx = std::max(0.0, kCorner - std::min(px - left, right - px));
  const double dy = std::max(0.0, kCorner - std::min(py - top, bottom - py));
  const double edge = std::min(std::min(px - left, right - px), std::min(py - top, bottom - py));
  const double inside = edge < kCorner ? kCorner - std::sqrt(dx * dx + dy * dy) : edge;

  const double rough = noise.fractal(x, y, 5, 3, 330), stain = noise.fractal(x, y, 15, 3, 340);
  const double fine = noise.white(x, y, 350);
  const double pit = step(0.55, 0.95, noise.smooth(x / 2.7, y / 2.7, 360) + 0.25 * rough);
  // Mostly red, some burnt dark, some pale.
  Rgb clay = mix(Rgb{0.30, 0.088, 0.046}, Rgb{0.40, 0.155, 0.080}, tone[0]);
  if (kind[0] < 0.16) clay = mix(clay, Rgb{0.105, 0.050, 0.042}, 0.55 + 0.4 * kind[1]);
  if (kind[0] > 0.86) clay = mix(clay, Rgb{0.50, 0.29, 0.165}, 0.5 + 0.4 * kind[1]);
  clay = clay * (0.88 + 0.24 * tone[1]) * (1 + 0.16 * rough + 0.20 * stain + 0.11 * fine);
  clay = mix(clay, Rgb{0.48, 0.42, 0.36},
             0.34 * step(0.30, 0.95, stain + 0.35 * rough) * tone[2]);  // lime bloom
  clay = clay * (1 - 0.5 * pit);
  const Draw sand = noise.draw(std::floor(x / 1.5), std::floor(y / 1.5), 370);
  Rgb mortar = Rgb{0.345, 0.315, 0.265} * (1 + 0.16 * stain + 0.16 * rough + 0.5 * (sand[0] - 0.5));
  if (sand[1] < 0.07) mortar = mortar * 0.5;

  const double body = step(-0.7, 0.7, inside + 0.45 * rough);
  Texel texel;
  texel.albedo = mix(mortar, clay, body);
  texel.height = (2.0 + 0.9 * (kind[2] - 0.5)) * rounded(inside + 0.4 * rough + 0.5, 2.6) +
                 mix(0.30 * rough + 0.5 * (sand[0] - 0.5), 0.42 * rough + 0.12 * fine - 0.9 * pit, body);
  texel.gloss = 0.05 * body;
  const Draw spark = noise.draw(x, y, 380);
  if (spark[0] < 0.0007) texel.glint = 1.4 * square(spark[1]);  // quartz sand
  return texel;
}

// Pebbles of 8 to 40 texels lying close on dark grit: an anisotropic Voronoi diagram with rounded cells.
Texel pebbles(const Noise& noise, double x, double y) {
  constexpr double kCell = 21;
  const double px = x + 0.9 * noise.fractal(x, y, 11, 2, 400), py = y + 0.9 * noise.fractal(x, y, 11, 2, 410);
  const double ci = std::floor(px / kCell), cj = std::floor(py / kCell);

  struct Stone {
    double distance, radius, u, v, i, j;
  };
  Stone stone{1e30, 0, 0, 0, 0, 0};  // the nearest
  std::array<double, 75> distances{};
  std::size_t count = 0, nearest = 0;
  const auto add = [&](double sx, double sy, double radius, const Draw& shape, double i, double j) {
    // A direction on the circle without sine or cosine.
    const double t = 2 * shape[0] - 1, c = (1 - t * t) / (1 + t * t), s = 2 * t / (1 + t * t);
    const double stretch = 1 + 0.55 * shape[1];
    const double u = (c * (px - sx) + s * (py - sy)) / stretch, v = (c * (py - sy) - s * (px - sx)) * stretch;
    const double distance = std::sqrt(u * u + v * v) - radius;
    if (distance < stone.distance) {
      stone = {distance, radius, u, v, i, j};
      nearest = count;
    }
    distances[count] = distance;
    ++count;
  };
  for (double j = cj - 2; j <= cj + 2; j += 1) {
    for (double i = ci - 2; i <= ci + 2; i += 1) {
      const Draw place = noise.draw(i, j, 420), shape = noise.draw(i, j, 421), size = noise.draw(i, j, 422);
      // A stone a cell, or two or three small ones on a triangle turned at random.
      if (size[0] < 0.68) {
        add((i + 0.15 + 0.7 * place[0]) * kCell, (j + 0.15 + 0.7 * place[1]) * kCell,
            5 + 7.5 * square(size[1]), shape, i, j);
      } else {
        const Draw more = noise.draw(i, j, 423);
        add((i + 0.28 * place[0]) * kCell, (j + 0.10 + 0.35 * place[1]) * kCell, 3 + 2 * size[1], shape,
            i + 0.25, j);
        add((i + 0.55 + 0.35 * place[2]) * kCell, (j + 0.25 * place[3]) * kCell, 3 + 2 * size[2], more,
            i + 0.5, j);
        add((i + 0.25 + 0.5 * more[2]) * kCell, (j + 0.65 + 0.3 * more[3]) * kCell, 3 + 2 * size[3], shape,
            i + 0.75, j);
      }
    }
  }
  // Distance to the border with each neighbour, joined by a norm that rounds the corners off.
  double sum = 0;
  for (std::size_t k = 0; k < count; ++k) {
    if (k == nearest) continue;
    const double border = std::max(0.5 * (distances[k] - stone.distance), 1e-3);
    sum += 1 / square(square(border));
  }
  const double inside = 1 / std::sqrt(std::sqrt(sum)) - 0.7;

  const double stone_key = 4 * stone.i;  // whole again: stones of one cell differ by quarters
  const Draw tone = noise.draw(stone_key, stone.j, 430), kind = noise.draw(stone_key, stone.j, 431);
  const double rough = noise.fractal(x, y, 6, 3, 440), fine = noise.white(x, y, 450);
  const double span = std::max(4.0, 0.62 * (stone.radius + 5));
  const double dome = rounded(inside, span);

  // Rock types.
  Rgb rock{0.235, 0.225, 0.21};
  if (kind[0] < 0.20)
    rock = {0.40, 0.315, 0.225};
  else if (kind[0] < 0.34)
    rock = {0.235, 0.130, 0.092};
  else if (kind[0] < 0.50)
    rock = {0.088, 0.094, 0.102};
  else if (kind[0] < 0.60)
    rock = {0.56, 0.53, 0.48};
  rock = rock * (0.80 + 0.40 * tone[0]);
  rock = {rock.r * (0.95 + 0.10 * tone[1]), rock.g, rock.b * (1.05 - 0.10 * tone[1])};
  // Bedding in some, speckles in others, mottling in all.
  const double t = 2 * kind[2] - 1, c = (1 - t * t) / (1 + t * t), s = 2 * t / (1 + t * t);
  const double band = noise.smooth((c * x + s * y) / 14, (c * y - s * x) / 2.6, 460);
  rock = rock * (1 + (kind[1] < 0.4 ? 0.34 : 0.06) * band + 0.16 * rough + 0.09 * fine);
  if (kind[1] > 0.72) {
    const double speck = noise.smooth(x / 1.9, y / 1.9, 470);
    rock = rock * (1 - 0.55 * step(0.25, 0.6, speck)) + Rgb{0.22, 0.21, 0.20} * step(0.35, 0.7, -speck);
  }
  if (kind[3] < 0.16) {  // a quartz vein
    const double vein = std::abs((c * stone.v + s * stone.u) - 2 + 1.6 * rough);
    rock = mix(rock, Rgb{0.60, 0.58, 0.54}, 0.8 * step(1.3, 0.5, vein));
  }
  // Grit in the gaps: small cells of their own.
  const double gi = std::floor(px / 2.6), gj = std::floor(py / 2.6);
  const Draw grit = noise.draw(gi, gj, 480);
  const double lump = noise.smooth(x / 2.8, y / 2.8, 490);
  const Rgb bed = Rgb{0.125, 0.102, 0.075} * (0.65 + 0.5 * grit[0] + 0.35 * lump + 0.2 * fine);

  const double body = step(-0.5, 0.7, inside);
  Texel texel;
  texel.albedo = mix(bed, rock, body);
  texel.height = mix(1.1 * lump, dome * span * (0.78 + 0.2 * tone[2]) + 0.26 * rough + 0.05 * fine, body);
  texel.gloss = body * (0.12 + 0.38 * tone[3]);
  return texel;
}

// Rough granite: interlocking crystals of feldspar, quartz and mica at two sizes over multi-octave relief.
Texel grain(const Noise& noise, double x, double y) {
  const double px = x + 2.2 * noise.fractal(x, y, 6, 3, 500), py = y + 2.2 * noise.fractal(x, y, 6, 3, 510);
  struct Crystal {
    double i, j, edge;
  };
  // The nearest of one jittered point a cell, and how far inside its crystal the texel lies.
  const auto crystal = [&](double size, std::uint64_t salt) {
    const double ci = std::floor(px / size), cj = std::floor(py / size);
    double first = 1e30, second = 1e30;
    Crystal out{};
    for (double j = cj - 1; j <= cj + 1; j += 1) {
      for (double i = ci - 1; i <= ci + 1; i += 1) {
        const Draw d = noise.draw(i, j, salt);
        const double distance = square((i + d[0]) * size - px) + square((j + d[1]) * size - py);
        if (distance < first) {
          second = first;
          first = distance;
          out.i = i;
          out.j = j;
        } else if (distance < second) {
          second = distance;
        }
      }
    }
    out.edge = std::sqrt(second) - std::sqrt(first);
    return out;
  };
  const Crystal coarse = crystal(10, 520), small = crystal(4, 521);
  const Draw mineral = noise.draw(coarse.i, coarse.j, 530), chip = noise.draw(small.i, small.j, 531);
  const double cloud = noise.fractal(x, y, 24, 4, 540), rough = noise.fractal(x, y, 8, 4, 550);
  const double fine = noise.white(x, y, 560);

  const Rgb pink{0.46, 0.27, 0.195}, white{0.53, 0.50, 0.455}, quartz{0.25, 0.245, 0.24},
      mica{0.032, 0.030, 0.030};
  Rgb rock = quartz;
  double relief = 0;
  const double pick = mineral[0] + 0.22 * cloud;
  if (pick > 0.66) {
    rock = pink;
    relief = 0.35;
  } else if (pick > 0.36) {
    rock = white;
    relief = 0.25;
  }
  rock = rock * (0.80 + 0.40 * mineral[1]);
  // Small grains break the coarse crystals up; mica gathers where the cloud noise is low.
  rock = rock * (0.84 + 0.32 * chip[1]);
  if (chip[0] < 0.12) rock = mix(rock, white, 0.55);
  double dark = 0;
  if (chip[2] < 0.20 - 0.26 * cloud) dark = 0.6 + 0.4 * step(0, 1.2, small.edge);
  rock = mix(rock, mica, dark);
  relief -= 0.5 * dark;
  rock = rock * (1 - 0.20 * step(1.2, 0, coarse.edge)) * (1 + 0.13 * rough + 0.10 * fine);
  const double rust = step(0.35, 0.9, noise.fractal(x, y, 16, 4, 570));
  rock = mix(rock, Rgb{0.36, 0.17, 0.06}, 0.25 * rust);

  Texel texel;
  texel.albedo = rock;
  texel.height = relief + 1.0 * rough + 0.5 * (chip[3] - 0.5) + 0.10 * fine;
  texel.gloss = 0.25;
  const Draw spark = noise.draw(x, y, 580);
  if (spark[0] < (dark > 0 ? 0.010 : 0.0015)) texel.glint = 0.3 + 1.6 * square(spark[1]);
  return texel;
}

constexpr std::array<TextureKind, 5> kKinds{{
    {"tiles", "regular", "glazed octagon and dot tiles, period 40 x 40 texels"},
    {"weave", "near-regular", "coarse plain-woven cloth, yarns of about 10 texels"},
    {"bricks", "near-regular", "weathered brick wall in running bond, module 40 x 17 texels"},
    {"pebbles", "irregular", "close-lying pebbles of 8 to 40 texels on grit"},
    {"grain", "stochastic", "rough granite with mica speckles"},
}};
constexpr std::array<Material, kKinds.size()> kMaterials{tiles, weave, bricks, pebbles, grain};

// --- Camera ---------------------------------------------------------------------------------------------

constexpr std::uint32_t kBandRows = 128;  // bands keep the height field small, however tall the image
constexpr int kReach = 7;                 // texels that shadows and occlusion look away
constexpr int kMargin = kReach + 1;       // and one more for the lens

// A window of doubles on the endless texture plane; x0, y0 is its top left texel.
template <class T>
class Window {
 public:
  Window(std::int64_t x0, std::int64_t y0, std::size_t columns, std::size_t rows)
      : x0_(x0), y0_(y0), columns_(columns), data_(columns * rows) {}
  T& at(std::int64_t x, std::int64_t y) {
    return data_[static_cast<std::size_t>(y - y0_) * columns_ + static_cast<std::size_t>(x - x0_)];
  }

 private:
  std::int64_t x0_, y0_;
  std::size_t columns_;
  std::vector<T> data_;
};

// Light that leaves a texel towards a camera straight above, under a low sun at the upper left and a sky.
Rgb radiance(Window<Texel>& scene, std::int64_t x, std::int64_t y) {
  const auto height = [&](std::int64_t dx, std::int64_t dy) { return scene.at(x + dx, y + dy).height; };
  const Texel& texel = scene.at(x, y);
  const double nx = 0.5 * (height(-1, 0) - height(1, 0)), ny = 0.5 * (height(0, -1) - height(0, 1));
  const double scale = 1 / std::sqrt(nx * nx + ny * ny + 1);

  constexpr double kSunX = -0.48, kSunY = -0.52, kSunZ = 0.7065;     // length 1
  constexpr double kHalfX = -0.26, kHalfY = -0.28, kHalfZ = 0.9241;  // half way between sun and camera
  constexpr double kClimb = 0.95;  // what the sun's ray climbs a diagonal step
  double lit = 1;
  double sky = 0;
  for (int k = 1; k <= kReach; ++k) {
    const double above = height(-k, -k) - texel.height - kClimb * k;
    lit = std::min(lit, 1 - step(-0.4, 0.9, above));
    const double ring = 0.25 * (height(-k, 0) + height(k, 0) + height(0, -k) + height(0, k)) - texel.height;
    sky = std::max(sky, ring / k);
  }
  const double open = 1 / (1 + 1.6 * sky);
  const double facing = std::max(0.0, (nx * kSunX + ny * kSunY + kSunZ) * scale);
  double mirror = std::max(0.0, (nx * kHalfX + ny * kHalfY + kHalfZ) * scale);
  for (int k = 0; k < 5; ++k) mirror *= mirror;  // to the 32nd
  const Rgb sun{1.30, 1.22, 1.08}, ambient{0.29, 0.33, 0.40};
  return Rgb{texel.albedo.r * (sun.r * facing * lit + ambient.r * open),
             texel.albedo.g * (sun.g * facing * lit + ambient.g * open),
             texel.albedo.b * (sun.b * facing * lit + ambient.b * open)} +
         sun * (lit * (texel.gloss * mirror + texel.glint));
}

// Rows [first, first + rows) of the image.
void photograph(const Noise& noise, Material material, std::uint32_t first, std::uint32_t rows,
                Image& image) {
  const std::int64_t x1 = image.width, y0 = first, y1 = y0 + rows;
  const std::size_t columns = image.width;
  Window<Texel> scene(-kMargin - 1, y0 - kMargin - 1, columns + 2 * kMargin + 2, rows + 2 * kMargin + 2);
  for (std::int64_t y = y0 - kMargin - 1; y <= y1 + kMargin; ++y) {
    for (std::int64_t x = -kMargin - 1; x <= x1 + kMargin; ++x) {
      scene.at(x, y) = material(noise, static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
    }
  }
  Window<Rgb> light(-1, y0 - 1, columns + 2, rows + 2);
  for (std::int64_t y = y0 - 1; y <= y1; ++y) {
    for (std::int64_t x = -1; x <= x1; ++x) light.at(x, y) = radiance(scene, x, y);
  }
  for (std::int64_t y = y0; y < y1; ++y) {
    for (std::int64_t x = 0; x < x1; ++x) {
      // A lens a little soft, then a sensor a little noisy: neighbours in a photograph are never independent.
      const Rgb sides = light.at(x - 1, y) + light.at(x + 1, y) + light.at(x, y - 1) + light.at(x, y + 1);
      const Rgb seen = light.at(x, y) * 0.6 + sides * 0.1;
      const Draw d = noise.draw(static_cast<double>(x), static_cast<double>(y), 1);
      const std::array<double, 3> linear{seen.r, seen.g, seen.b};
      for (std::uint32_t k = 0; k < 3; ++k) {
        const double grainy = linear[k] * (1 + 0.03 * (d[k] - 0.5)) + 0.002 * (d[3] - 0.5);
        image.at(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), k) =
            encode(image.type, std::max(grainy, 0.0));
      }
    }
  }
}

}  // namespace

std::span<const TextureKind> texture_kinds() { return kKinds; }

Result<Image> synthesize_texture(std::string_view kind, const TextureOptions& options) {
  const auto found =
      std::find_if(kKinds.begin(), kKinds.end(), [&](const TextureKind& k) { return k.name == kind; });
  if (found == kKinds.end()) {
    std::string names;
    for (const TextureKind& k : kKinds) names += std::string(names.empty() ? "" : ", ") + k.name;
    return bad_argument("no texture kind is named '" + std::string(kind) + "'; the kinds are " + names);
  }
  if (options.width == 0 || options.height == 0) {
    return bad_argument("a texture's width and height must be at least 1");
  }
  if (options.type != SampleType::unorm8 && options.type != SampleType::unorm16 &&
      options.type != SampleType::float16) {
    return bad_argument("a texture's sample type must be unorm8, unorm16 or float16");
  }
  try {
    Image image;
    image.width = options.width;
    image.height = options.height;
    image.channels = 3;
    image.type = options.type;
    image.colour_space =
        options.type == SampleType::float16 ? ColourSpace::lin_rec709_scene : ColourSpace::srgb_rec709_scene;
    const std::size_t texels = std::size_t{options.width} * options.height;
    if (texels > image.codes.max_size() / image.channels) throw std::bad_alloc();
    image.codes.resize(texels * image.channels);
    const Noise noise(options.seed);
    const Material material = kMaterials[static_cast<std::size_t>(found - kKinds.begin())];
    for (std::uint32_t first = 0; first < options.height;) {
      const std::uint32_t rows = std::min(kBandRows, options.height - first);
      photograph(noise, material, first, rows, image);
      first += rows;
    }
    return image;
  } catch (const std::bad_alloc&) {
  } catch (const std::length_error&) {
  }
  return Error{Status::out_of_memory, "no memory for a texture of " + std::to_string(options.width) + " x " +
                                          std::to_string(options.height) + " texels"};
}

}  // namespace btfc
