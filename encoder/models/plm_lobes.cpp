// Lobes, a texel a lane, in plain loops that the compiler turns into vectors: one binary, compiled for each
// instruction set by Highway's means. Without fused operations, so that the bits are the same everywhere.
#include "encoder/models/plm_lobes.h"

#include <algorithm>
#include <cmath>

#include "encoder/linear/matrix.h"
#include "shaders/models/plm.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encoder/models/plm_lobes.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace btfc {
namespace HWY_NAMESPACE {

constexpr std::size_t W = kLobeLanes, P = kLobeParameters, kProducts = P * (P + 1) / 2;
constexpr float kLn2 = 0.69314718f;
constexpr float kMostRho = 65536;
constexpr float kMostPeak =
    4;  // rho, in units of the texel's largest value: peaks between lights stay bounded
constexpr float kLeastDamping = 1e-5f, kMostDamping = 1e7f, kFirstDamping = 1e-2f;
constexpr float kLeastGain = 1e-4f;  // of the error
constexpr unsigned kMostSteps = 100;

// The value of the lobes towards a light, their logarithms and powers; all 0 where the lobe is turned away.
struct Powers {
  float base[W], log[W], power[W], live[W];
};

inline void powers_of(const float (&p)[P][W], const std::array<float, 3>& u, Powers& out) {
  for (std::size_t l = 0; l < W; ++l) {
    const float base = p[1][l] * u[0] + p[2][l] * u[1] + p[3][l] * u[2];
    const float live = base > BTFC_PLM_LEAST_BASE ? 1.0f : 0.0f;
    const float safe = live > 0 ? base : 1.0f;
    const float log = btfc_log2(safe);
    const float exponent = p[4][l] * log;
    out.base[l] = safe;
    out.log[l] = log;
    out.live[l] = live;
    out.power[l] = live * btfc_exp2(exponent < BTFC_PLM_MOST_EXPONENT ? exponent : BTFC_PLM_MOST_EXPONENT);
  }
}

// At some parameters: the weighted error, and the normal equations J^T J (upper half, row by row) and J^T r.
struct Equations {
  float error[W], product[kProducts][W], right[P][W];
};

void form_equations(const LobeLights& view, const float* values, const float (&p)[P][W], Equations& e) {
  e = Equations{};
  Powers f;
  float jacobian[P][W];
  float rest[W];
  for (std::size_t i = 0; i < view.lights.size(); ++i) {
    const std::array<float, 3> u = view.lights[i];
    const float root = view.root[i];
    powers_of(p, u, f);
    for (std::size_t l = 0; l < W; ++l) {
      const float power = root * f.power[l];
      const float value = p[0][l] * power;
      const float slope = p[4][l] * value / f.base[l];
      rest[l] = root * values[i * W + l] - value;
      jacobian[0][l] = power;
      jacobian[1][l] = slope * u[0];
      jacobian[2][l] = slope * u[1];
      jacobian[3][l] = slope * u[2];
      jacobian[4][l] = value * f.log[l] * kLn2;
      e.error[l] += rest[l] * rest[l];
    }
    std::size_t at = 0;
    for (std::size_t a = 0; a < P; ++a) {
      for (std::size_t l = 0; l < W; ++l) e.right[a][l] += jacobian[a][l] * rest[l];
      for (std::size_t b = a; b < P; ++b, ++at) {
        for (std::size_t l = 0; l < W; ++l) e.product[at][l] += jacobian[a][l] * jacobian[b][l];
      }
    }
  }
}

// (J^T J + damping diagonal) step = J^T r by L D L^T in every lane. The damping also decides along a, whose
// length eq. 3 leaves open.
void solve(const Equations& e, const float (&damping)[W], float (&step)[P][W]) {
  float lower[P][P][W], diagonal[P][W];
  std::size_t at = 0;
  for (std::size_t a = 0; a < P; ++a) {
    for (std::size_t b = a; b < P; ++b, ++at) {
      for (std::size_t l = 0; l < W; ++l) {
        const float product = e.product[at][l];
        lower[b][a][l] = a == b ? product * (1 + damping[l]) + 1e-12f : product;
      }
    }
  }
  for (std::size_t a = 0; a < P; ++a) {
    for (std::size_t k = 0; k < a; ++k) {
      for (std::size_t l = 0; l < W; ++l) lower[a][a][l] -= lower[a][k][l] * lower[a][k][l] * diagonal[k][l];
    }
    for (std::size_t l = 0; l < W; ++l) diagonal[a][l] = lower[a][a][l] > 1e-20f ? lower[a][a][l] : 1e-20f;
    for (std::size_t b = a + 1; b < P; ++b) {
      for (std::size_t k = 0; k < a; ++k) {
        for (std::size_t l = 0; l < W; ++l)
          lower[b][a][l] -= lower[b][k][l] * lower[a][k][l] * diagonal[k][l];
      }
      for (std::size_t l = 0; l < W; ++l) lower[b][a][l] /= diagonal[a][l];
    }
  }
  for (std::size_t a = 0; a < P; ++a) {
    for (std::size_t l = 0; l < W; ++l) step[a][l] = e.right[a][l];
    for (std::size_t k = 0; k < a; ++k) {
      for (std::size_t l = 0; l < W; ++l) step[a][l] -= lower[a][k][l] * step[k][l];
    }
  }
  for (std::size_t a = P; a-- > 0;) {
    for (std::size_t l = 0; l < W; ++l) step[a][l] /= diagonal[a][l];
    for (std::size_t k = a + 1; k < P; ++k) {
      for (std::size_t l = 0; l < W; ++l) step[a][l] -= lower[k][a][l] * step[k][l];
    }
  }
}

// Parameters after a step, with |a| = 1 and rho and n in their ranges; unchanged where the step is no number.
void take_step(const float (&p)[P][W], const float (&step)[P][W], const float (&most_rho)[W],
               float (&q)[P][W]) {
  for (std::size_t l = 0; l < W; ++l) {
    const float x = p[1][l] + step[1][l], y = p[2][l] + step[2][l], z = p[3][l] + step[3][l];
    float n = p[4][l] + step[4][l];
    n = n > kLeastLobeExponent ? n : kLeastLobeExponent;
    n = n < kMostLobeExponent ? n : kMostLobeExponent;
    const float square = x * x + y * y + z * z;
    const bool sound = square > 1e-12f && square < 1e12f;
    const float safe = sound ? square : 1.0f;
    const float length = std::sqrt(safe);
    float rho = (p[0][l] + step[0][l]) * btfc_exp2(0.5f * n * btfc_log2(safe));
    rho = rho > 0 ? rho : 0;
    rho = rho < most_rho[l] ? rho : most_rho[l];
    q[0][l] = sound ? rho : p[0][l];
    q[1][l] = sound ? x / length : p[1][l];
    q[2][l] = sound ? y / length : p[2][l];
    q[3][l] = sound ? z / length : p[3][l];
    q[4][l] = sound ? n : p[4][l];
  }
}

// The bound of rho in every lane.
void find_most_rho(const LobeLights& view, const float* values, float (&most)[W]) {
  for (std::size_t l = 0; l < W; ++l) most[l] = 0;
  for (std::size_t i = 0; i < view.lights.size(); ++i) {
    for (std::size_t l = 0; l < W; ++l) {
      const float value = kMostPeak * values[i * W + l];
      most[l] = most[l] > value ? most[l] : value;
    }
  }
  for (std::size_t l = 0; l < W; ++l) most[l] = most[l] < kMostRho ? most[l] : kMostRho;
}

void refine_target(const LobeLights& view, const float* values, unsigned steps, LobeBatch& lobes) {
  Equations now, then;
  float q[P][W], step[P][W], damping[W];
  bool done[W];
  for (std::size_t l = 0; l < W; ++l) {
    damping[l] = kFirstDamping;
    done[l] = false;
  }
  float most_rho[W];
  find_most_rho(view, values, most_rho);
  float(&p)[P][W] = lobes.parameter;
  form_equations(view, values, p, now);
  const unsigned most = steps == 0 ? kMostSteps : steps;
  for (unsigned round = 0; round < most; ++round) {
    solve(now, damping, step);
    take_step(p, step, most_rho, q);
    form_equations(view, values, q, then);
    bool all_done = true;
    for (std::size_t l = 0; l < W; ++l) {
      const bool better = !done[l] && then.error[l] < now.error[l];
      // Only a step with little damping tells that there is nothing more to gain.
      if (better && steps == 0 && damping[l] < 1 &&
          now.error[l] - then.error[l] < kLeastGain * now.error[l]) {
        done[l] = true;
      }
      if (better) {
        for (std::size_t a = 0; a < P; ++a) {
          p[a][l] = q[a][l];
          now.right[a][l] = then.right[a][l];
        }
        for (std::size_t k = 0; k < kProducts; ++k) now.product[k][l] = then.product[k][l];
        now.error[l] = then.error[l];
      }
      damping[l] = better ? std::max(0.2f * damping[l], kLeastDamping) : 5 * damping[l];
      if (damping[l] > kMostDamping) done[l] = true;
      all_done = all_done && done[l];
    }
    if (all_done) break;
  }
  for (std::size_t l = 0; l < W; ++l) lobes.error[l] = now.error[l];
}

void start_target(const LobeLights& view, const float* values, LobeBatch& lobes) {
  constexpr std::size_t kExponents = 4;
  constexpr float kExponent[kExponents] = {0.25f, 1, 4, 16};
  float direction[3][3][W] = {}, squares[W] = {};
  for (std::size_t i = 0; i < view.lights.size(); ++i) {
    const float root = view.root[i];
    for (std::size_t l = 0; l < W; ++l) {
      const float value = values[i * W + l], weighted = root * value;
      for (std::size_t a = 0; a < 3; ++a) {
        direction[0][a][l] += view.linear[i][a] * value;
        direction[1][a][l] += view.lights[i][a] * (weighted * weighted);
      }
      squares[l] += weighted * weighted;
    }
  }
  for (std::size_t l = 0; l < W; ++l) {
    // Half way from the linear fit's direction to the normal: fewer lights are turned away from.
    const auto& linear = direction[0];
    const float length =
        std::sqrt(linear[0][l] * linear[0][l] + linear[1][l] * linear[1][l] + linear[2][l] * linear[2][l]);
    for (std::size_t a = 0; a < 3; ++a) direction[2][a][l] = linear[a][l] + (a == 2 ? length : 0);
    lobes.parameter[0][l] = 0;
    lobes.parameter[1][l] = 0;
    lobes.parameter[2][l] = 0;
    lobes.parameter[3][l] = 1;
    lobes.parameter[4][l] = 1;
    lobes.error[l] = squares[l];
  }
  float most_rho[W];
  find_most_rho(view, values, most_rho);
  for (auto& way : direction) {
    float p[P][W];
    for (std::size_t l = 0; l < W; ++l) {
      const float length = std::sqrt(way[0][l] * way[0][l] + way[1][l] * way[1][l] + way[2][l] * way[2][l]);
      const bool sound = length > 1e-12f;
      p[0][l] = 1;
      p[1][l] = sound ? way[0][l] / length : 0;
      p[2][l] = sound ? way[1][l] / length : 0;
      p[3][l] = sound ? way[2][l] / length : 1;
      p[4][l] = kExponent[0];
    }
    // With the n given the best rho is R . f / f . f, and it leaves R . R - (R . f)^2 / f . f.
    float across[kExponents][W] = {}, self[kExponents][W] = {};
    Powers f;
    for (std::size_t i = 0; i < view.lights.size(); ++i) {
      powers_of(p, view.lights[i], f);
      const float root = view.root[i];
      for (std::size_t l = 0; l < W; ++l) {
        float power = f.power[l];
        for (std::size_t k = 0; k < kExponents; ++k) {
          const float weighted = root * power;
          across[k][l] += weighted * (root * values[i * W + l]);
          self[k][l] += weighted * weighted;
          const float square = power * power;
          power = square * square;  // the next n is four times this one
        }
      }
    }
    for (std::size_t k = 0; k < kExponents; ++k) {
      for (std::size_t l = 0; l < W; ++l) {
        if (!(self[k][l] > 0 && across[k][l] > 0)) continue;
        const float error = squares[l] - across[k][l] * across[k][l] / self[k][l];
        if (!(error < lobes.error[l])) continue;
        lobes.error[l] = error;
        lobes.parameter[0][l] = std::min(across[k][l] / self[k][l], most_rho[l]);
        for (std::size_t a = 1; a < 4; ++a) lobes.parameter[a][l] = p[a][l];
        lobes.parameter[4][l] = kExponent[k];
      }
    }
  }
}

void values_target(const std::array<const float*, P>& parameters, std::size_t count,
                   const std::array<float, 3>& light, float* out) {
  const float *rho = parameters[0], *x = parameters[1], *y = parameters[2], *z = parameters[3],
              *n = parameters[4];
  const float u = light[0], v = light[1], w = light[2];
  for (std::size_t i = 0; i < count; ++i) {
    const float base = x[i] * u + y[i] * v + z[i] * w;
    const bool live = base > BTFC_PLM_LEAST_BASE;
    float exponent = n[i] * btfc_log2(live ? base : 1.0f);
    exponent = exponent < BTFC_PLM_MOST_EXPONENT ? exponent : BTFC_PLM_MOST_EXPONENT;
    float value = rho[i] * btfc_exp2(exponent);
    value = value < -BTFC_PLM_MOST ? -BTFC_PLM_MOST : value;
    value = value > BTFC_PLM_MOST ? BTFC_PLM_MOST : value;
    out[i] = live ? value : 0.0f;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace btfc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace btfc {

HWY_EXPORT(start_target);
HWY_EXPORT(refine_target);
HWY_EXPORT(values_target);

LobeLights lobe_lights(const std::vector<Vector3>& lights, std::span<const double> weights) {
  LobeLights view;
  Eigen::MatrixXd u(static_cast<Eigen::Index>(lights.size()), 3);
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const Vector3& l = lights[i];
    const double root = weights.empty() ? 1.0 : std::sqrt(weights[i]);
    view.lights.push_back({static_cast<float>(l[0]), static_cast<float>(l[1]), static_cast<float>(l[2])});
    view.root.push_back(static_cast<float>(root));
    u.row(static_cast<Eigen::Index>(i)) << root * l[0], root * l[1], root * l[2];
  }
  const Eigen::MatrixXd inverse = u.completeOrthogonalDecomposition().pseudoInverse();
  for (Eigen::Index i = 0; i < u.rows(); ++i) {
    const double root = weights.empty() ? 1.0 : std::sqrt(weights[static_cast<std::size_t>(i)]);
    view.linear.push_back({static_cast<float>(root * inverse(0, i)), static_cast<float>(root * inverse(1, i)),
                           static_cast<float>(root * inverse(2, i))});
  }
  return view;
}

void start_lobes(const LobeLights& view, const float* values, LobeBatch& lobes) {
  HWY_DYNAMIC_DISPATCH(start_target)(view, values, lobes);
}

void refine_lobes(const LobeLights& view, const float* values, unsigned steps, LobeBatch& lobes) {
  HWY_DYNAMIC_DISPATCH(refine_target)(view, values, steps, lobes);
}

void lobe_values(const std::array<const float*, kLobeParameters>& parameters, std::size_t count,
                 const std::array<float, 3>& light, float* out) {
  HWY_DYNAMIC_DISPATCH(values_target)(parameters, count, light, out);
}

}  // namespace btfc
#endif
