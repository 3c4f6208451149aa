// k-means of reflectance fields with lobes as centres.
#include "encoder/models/plm_clusters.h"

#include <algorithm>
#include <numeric>

namespace btfc {
namespace {

constexpr int kRounds = 8;
constexpr unsigned kRoundSteps = 4;  // of a lobe's fit, between rounds

// Columns times the roots of the lights' weights.
Matrix weighted(Matrix rows, const LobeLights& view) {
  const Eigen::Map<const Eigen::RowVectorXf> roots(view.root.data(), as_index(view.root.size()));
  rows.array().rowwise() *= roots.array();
  return rows;
}

// What the entries' lobes give under all lights: a row an entry.
Matrix responses(const LobeLights& view, const LobeBook& book) {
  Matrix out(as_index(book.entries), as_index(view.lights.size()));
  std::vector<float> column(book.entries);
  std::array<const float*, kLobeParameters> parameters{};
  for (std::size_t m = 0; m < kLobeParameters; ++m) parameters[m] = &book.parameters[m * book.entries];
  for (std::size_t i = 0; i < view.lights.size(); ++i) {
    lobe_values(parameters, book.entries, view.lights[i], column.data());
    for (std::size_t k = 0; k < book.entries; ++k) out(as_index(k), as_index(i)) = column[k];
  }
  return out;
}

struct Assignment {
  std::vector<std::uint8_t> entry;
  std::vector<float> error;  // less the texel's own sum of squares, which is the same for all entries
};

// Of weighted values. |v - y|^2 = v.v - 2 v.y + y.y; of equal entries the first.
Assignment assign(const Matrix& values, const Matrix& centres) {
  constexpr Eigen::Index kRows = 1024;
  const Eigen::VectorXf squares = centres.rowwise().squaredNorm();
  Assignment result;
  for (Eigen::Index first = 0; first < values.rows(); first += kRows) {
    const Eigen::Index rows = std::min(kRows, values.rows() - first);
    const Matrix products = values.middleRows(first, rows) * centres.transpose();
    for (Eigen::Index r = 0; r < rows; ++r) {
      Eigen::Index best = 0;
      const float error = (squares.transpose() - 2 * products.row(r)).minCoeff(&best);
      result.entry.push_back(static_cast<std::uint8_t>(best));
      result.error.push_back(error);
    }
  }
  return result;
}

// Lobes for the rows of targets, from the book's own parameters or from new ones.
void fit_entries(const LobeLights& view, const Matrix& targets, bool start, unsigned steps, LobeBook& book) {
  const std::size_t lights = view.lights.size();
  std::vector<float> values(lights * kLobeLanes);
  for (std::size_t first = 0; first < book.entries; first += kLobeLanes) {
    const std::size_t used = std::min(kLobeLanes, book.entries - first);
    LobeBatch batch{};
    // Lanes that are not needed repeat the last one.
    for (std::size_t l = 0; l < kLobeLanes; ++l) {
      const std::size_t k = first + std::min(l, used - 1);
      for (std::size_t i = 0; i < lights; ++i) values[i * kLobeLanes + l] = targets(as_index(k), as_index(i));
      for (std::size_t m = 0; m < kLobeParameters; ++m)
        batch.parameter[m][l] = book.parameters[m * book.entries + k];
    }
    if (start) start_lobes(view, values.data(), batch);
    refine_lobes(view, values.data(), steps, batch);
    for (std::size_t l = 0; l < used; ++l) {
      for (std::size_t m = 0; m < kLobeParameters; ++m)
        book.parameters[m * book.entries + first + l] = batch.parameter[m][l];
    }
  }
}

// Means of the clusters. An empty one takes the texel of the largest error that none has taken yet.
Matrix cluster_means(const Matrix& values, const Matrix& weighted_values, const Assignment& assigned,
                     std::size_t entries) {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> sums =
      MatrixD::Zero(as_index(entries), values.cols());
  std::vector<std::size_t> count(entries);
  for (std::size_t t = 0; t < assigned.entry.size(); ++t) {
    sums.row(assigned.entry[t]) += values.row(as_index(t)).cast<double>();
    ++count[assigned.entry[t]];
  }
  std::vector<float> error(assigned.error);
  for (std::size_t t = 0; t < error.size(); ++t) error[t] += weighted_values.row(as_index(t)).squaredNorm();
  for (std::size_t k = 0; k < entries; ++k) {
    if (count[k] == 0) {
      const auto worst = std::max_element(error.begin(), error.end());
      sums.row(as_index(k)) = values.row(worst - error.begin()).cast<double>();
      *worst = -1;
      count[k] = 1;
    }
    sums.row(as_index(k)) /= static_cast<double>(count[k]);
  }
  return sums.cast<float>();
}

}  // namespace

LobeBook fit_book(const LobeLights& view, const Matrix& values, std::size_t entries, unsigned steps) {
  const auto texels = static_cast<std::size_t>(values.rows());
  LobeBook book;
  book.entries = std::min(entries, texels);
  book.parameters.resize(kLobeParameters * book.entries);
  // To begin with, texels evenly spread over the order of their means.
  std::vector<std::size_t> order(texels);
  std::iota(order.begin(), order.end(), std::size_t{0});
  const Matrix weighted_values = weighted(values, view);
  const Eigen::VectorXf means = weighted_values.rowwise().mean();
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return means[as_index(a)] < means[as_index(b)]; });
  Matrix centres(as_index(book.entries), values.cols());
  for (std::size_t k = 0; k < book.entries; ++k) {
    centres.row(as_index(k)) = values.row(as_index(order[(2 * k + 1) * texels / (2 * book.entries)]));
  }
  fit_entries(view, centres, true, kRoundSteps, book);
  for (int round = 0; round < kRounds; ++round) {
    const Assignment assigned = assign(weighted_values, weighted(responses(view, book), view));
    centres = cluster_means(values, weighted_values, assigned, book.entries);
    const bool last = round == kRounds - 1;
    fit_entries(view, centres, round == 0 || last, last ? steps : kRoundSteps, book);
  }
  return book;
}

std::vector<std::uint8_t> nearest_entries(const LobeLights& view, const Matrix& values,
                                          const LobeBook& book) {
  return assign(weighted(values, view), weighted(responses(view, book), view)).entry;
}

}  // namespace btfc
