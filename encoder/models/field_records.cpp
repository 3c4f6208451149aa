// Variances by responses, covariances by synthesis.
#include "encoder/models/field_records.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "encoder/for_each_index.h"
#include "encoder/linear/matrix.h"
#include "format/models/field_collapse.h"

namespace btfc {
namespace {

// Expanding what is this smooth already leaves its variance alone.
constexpr std::uint32_t kMostExpansions = 3;
constexpr std::uint32_t kSignatureSide = 96, kSignatureStep = 3;

double energy(const std::vector<float>& values) {
  double sum = 0;
  for (const float v : values) sum += double{v} * double{v};
  return sum;
}

// Variances of one response, expanded 0, 1, 2 … times.
void add_response(const float* response, std::uint32_t margin, std::uint32_t level,
                  std::vector<double>& variances) {
  FieldWindow window{-static_cast<std::int64_t>(margin), 0, 2 * margin + 1, margin + 1};
  std::vector<float> h(response, response + window.texels());
  double variance = energy(h);
  for (std::uint32_t up = 0; up <= level; ++up) {
    variances[level - up] += variance;
    if (up == level || up >= kMostExpansions) continue;
    // A border of zeros, and twice the place.
    FieldWindow wider{window.x - 4, window.y - 4, window.width + 8, window.height + 8};
    std::vector<float> padded(wider.texels());
    for (std::uint32_t y = 0; y < window.height; ++y)
      std::copy_n(&h[std::size_t{y} * window.width], window.width,
                  &padded[std::size_t{y + 4} * wider.width + 4]);
    window = {2 * window.x - 2, 2 * window.y - 2, 2 * window.width + 4, 2 * window.height + 4};
    h.assign(window.texels(), 0.0f);
    field_expand_add(padded.data(), wider, window, h.data());
    variance = energy(h) * std::pow(0.25, up + 1);
  }
}

}  // namespace

std::vector<double> factor_variances(const LoadedItem& item, const FieldParams& p, std::uint32_t subspace,
                                     std::uint32_t factor) {
  std::vector<double> variances(p.levels);
  const std::uint32_t subspaces[] = {subspace};
  if (p.kind == FIELD_GMRF) {
    for (std::uint32_t m = 0; m < p.levels; ++m) {
      const std::uint32_t side = item.words[0][p.level_word + FIELD_LEVEL_WORDS * m];
      const FieldWindow torus{0, 0, side, side};
      const std::vector<float> values = field_collapse(item, p, m, m, subspaces, torus);
      const auto own = values.begin() + static_cast<std::ptrdiff_t>(factor * torus.texels());
      variances[m] = energy({own, own + static_cast<std::ptrdiff_t>(torus.texels())}) /
                     static_cast<double>(torus.texels());
    }
    return variances;
  }
  const bool coupled = p.kind == FIELD_CAR3D;
  for (std::uint32_t l = 0; l < p.levels; ++l) {
    const std::uint32_t* record = &item.words[0][p.level_word + FIELD_LEVEL_WORDS * l];
    for (std::uint32_t g = 0; g < (coupled ? p.all_channels : 1); ++g) {
      const std::size_t row =
          (std::size_t{subspace} * p.all_channels + factor) * (coupled ? p.all_channels : 1) + g;
      const std::uint32_t* words = &item.words[1][record[1] + row * record[2]];
      std::vector<float> response(record[2]);
      std::transform(words, words + record[2], response.begin(),
                     [](std::uint32_t w) { return std::bit_cast<float>(w); });
      add_response(response.data(), record[0], l, variances);
    }
  }
  return variances;
}

std::vector<std::array<float, 4>> subspace_signatures(const LoadedItem& item, const FieldParams& p) {
  const std::size_t c = p.clusters, d = p.all_channels;
  std::vector<std::array<float, 4>> out(c);
  const BtfcWords words = {{item.words[0].data(), item.words[1].data(), nullptr, nullptr}};
  const FieldWindow window{0, 0, kSignatureSide, kSignatureSide};
  constexpr std::size_t kSide = kSignatureSide / kSignatureStep;
  MatrixD samples(as_index(c), as_index(kSide * kSide * d));
  (void)for_each_index(c, [&](std::size_t k) -> Result<Done> {
    const auto subspace = static_cast<std::uint32_t>(k);
    const std::uint32_t subspaces[] = {subspace};
    const std::vector<float> factors = field_collapse(item, p, 0, 0, subspaces, window);
    std::vector<float> deviations(window.texels() * d);
    field_deviations(words, p, subspace, 0, factors.data(), window.texels(), window.texels(),
                     deviations.data());
    for (std::size_t t = 0; t < kSide * kSide; ++t) {
      const std::size_t texel = t / kSide * kSignatureStep * kSignatureSide + t % kSide * kSignatureStep;
      for (std::size_t n = 0; n < d; ++n)
        samples(as_index(k), as_index(t * d + n)) = double{deviations[texel * d + n]};
    }
    return Done{};
  });
  const MatrixD covariance = samples * samples.transpose() / static_cast<double>(kSide * kSide);
  const Eigen::SelfAdjointEigenSolver<MatrixD> solver(covariance);
  for (std::size_t k = 0; k < c; ++k) {
    double rest = covariance(as_index(k), as_index(k));
    for (std::size_t i = 0; i < 3 && i < c; ++i) {
      const Eigen::Index column = as_index(c - 1 - i);
      const double s =
          solver.eigenvectors()(as_index(k), column) * std::sqrt(std::max(0.0, solver.eigenvalues()(column)));
      out[k][i] = static_cast<float>(s);
      rest -= s * s;
    }
    out[k][3] = static_cast<float>(std::sqrt(std::max(0.0, rest)));
  }
  return out;
}

}  // namespace btfc
