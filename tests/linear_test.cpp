// The truncated singular value decomposition against Eigen's exact one.
#include <gtest/gtest.h>

#include <random>

#include "encoder/linear/truncated_svd.h"
#include "encoder/run_on_threads.h"

namespace btfc::test {
namespace {

RowBlocks blocks_of(const Matrix& m, std::size_t block_rows) {
  RowBlocks rows;
  rows.rows = static_cast<std::size_t>(m.rows());
  rows.columns = static_cast<std::size_t>(m.cols());
  rows.block_rows = block_rows;
  rows.read = [&m](std::size_t first, Matrix& block) { block = m.middleRows(as_index(first), block.rows()); };
  return rows;
}

// Singular values that fall slowly, as those of measured BTFs do.
Matrix slowly_falling(Eigen::Index rows, Eigen::Index columns, double power) {
  std::mt19937 random(4);
  std::normal_distribution<float> normal;
  Matrix a(rows, rows), b(columns, rows);
  for (Matrix* m : {&a, &b}) {
    for (Eigen::Index i = 0; i < m->size(); ++i) m->data()[i] = normal(random);
  }
  Matrix m = Matrix::Zero(rows, columns);
  for (Eigen::Index k = 0; k < rows; ++k)
    m += static_cast<float>(std::pow(static_cast<double>(k + 1), -power)) * a.col(k) * b.col(k).transpose();
  return m;
}

TEST(TruncatedSvd, ErrorIsThatOfTheExactOne) {
  for (const double power : {0.5, 1.0, 2.0}) {
    const Matrix m = slowly_falling(150, 400, power);
    const Eigen::JacobiSVD<Eigen::MatrixXd> exact(m.cast<double>());
    const double total = exact.singularValues().squaredNorm();
    for (const std::size_t rank : {1u, 8u, 41u}) {
      const TruncatedSvd svd = truncated_svd(blocks_of(m, 37), rank, {});
      ASSERT_EQ(svd.right.cols(), as_index(rank));
      EXPECT_NEAR(svd.total_energy, total, 1e-5 * total);
      const double best = total - exact.singularValues().head(as_index(rank)).squaredNorm();
      const double left = (m - svd.left * svd.right.transpose()).cast<double>().squaredNorm();
      EXPECT_GE(left, best * (1 - 1e-4));
      EXPECT_LE(10 * std::log10(left / best), 0.02) << "power " << power << ", rank " << rank;  // dB
      EXPECT_LE((svd.right.transpose() * svd.right - Matrix::Identity(as_index(rank), as_index(rank))).norm(),
                1e-4);
    }
  }
}

TEST(TruncatedSvd, RankIsThatOfTheMatrix) {
  const Matrix m = slowly_falling(6, 50, 1.0);
  EXPECT_EQ(truncated_svd(blocks_of(m, 4), 40, {}).right.cols(), 6);
  Matrix flat = Matrix::Ones(30, 1) * Matrix::Ones(1, 20);
  const TruncatedSvd one = truncated_svd(blocks_of(flat, 7), 5, {});
  EXPECT_EQ(one.right.cols(), 1);
  EXPECT_LE((flat - one.left * one.right.transpose()).norm(), 1e-4);
  EXPECT_EQ(truncated_svd(blocks_of(Matrix::Zero(9, 9), 4), 3, {}).right.cols(), 0);
  EXPECT_EQ(truncated_svd(blocks_of(m, 4), 0, {}).right.cols(), 0);
}

TEST(TruncatedSvd, IsTheSameOnAnyNumberOfThreads) {
  const Matrix m = slowly_falling(200, 90, 1.0);
  TruncatedSvd found[3];
  for (unsigned i = 0; i < 3; ++i)
    run_on_threads(1u << i, [&] { found[i] = truncated_svd(blocks_of(m, 16), 5, {}); });
  EXPECT_EQ(found[0].left, found[1].left);
  EXPECT_EQ(found[0].right, found[2].right);
}

}  // namespace
}  // namespace btfc::test
