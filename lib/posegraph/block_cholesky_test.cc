#include "lib/posegraph/block_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <set>

#include "lib/base/random.h"

namespace vog {
namespace {

using Eigen::MatrixXd;

/// A positive definite matrix that grows: a chain with blocks between random rows.
template <int kSize>
class RandomMatrix {
 public:
  explicit RandomMatrix(const char* stream) : random_(1, stream) {}

  BlockMatrix<kSize> A;

  void AddRow() {
    A.diagonal.push_back(Diagonal());
    if (A.size() > 1) AddBlock(A.size() - 2, A.size() - 1);
  }

  void AddBlock(int row, int column) {
    if (row == column || !places_.emplace(row, column).second) return;
    A.places.emplace_back(row, column);
    A.blocks.push_back(Noise());
  }

  void AddBlocks(int count, int nearest = 0) {
    for (int i = 0; i < count; ++i) {
      const int a = random_.Index(A.size());
      const int b = nearest == 0 ? random_.Index(A.size())
                                 : std::min(A.size() - 1, a + random_.Index(nearest));
      AddBlock(std::min(a, b), std::max(a, b));
    }
  }

  /// Changes the blocks of a row.
  void Change(int row) {
    A.diagonal[static_cast<std::size_t>(row)] = Diagonal();
    for (std::size_t i = 0; i < A.places.size(); ++i)
      if (A.places[i].first == row || A.places[i].second == row) A.blocks[i] = Noise();
  }

  MatrixXd Dense() const {
    MatrixXd dense = MatrixXd::Zero(kSize * A.size(), kSize * A.size());
    for (int i = 0; i < A.size(); ++i)
      dense.block<kSize, kSize>(kSize * i, kSize * i) = A.diagonal[static_cast<std::size_t>(i)];
    for (std::size_t i = 0; i < A.places.size(); ++i) {
      const auto [row, column] = A.places[i];
      dense.block<kSize, kSize>(kSize * row, kSize * column) = A.blocks[i];
      dense.block<kSize, kSize>(kSize * column, kSize * row) = A.blocks[i].transpose();
    }
    return dense;
  }

 private:
  using Block = typename BlockMatrix<kSize>::Block;

  Block Noise() {
    Block block;
    for (double& number : block.reshaped()) number = random_.Gaussian(1);
    return block;
  }
  Block Diagonal() {
    const Block noise = Noise();
    return noise * noise.transpose() + 40 * kSize * Block::Identity();
  }

  Random random_;
  std::set<std::pair<int, int>> places_;
};

template <int kSize>
void ExpectFactorOf(const RandomMatrix<kSize>& matrix, const BlockCholesky<kSize>& dut) {
  const MatrixXd dense = matrix.Dense(), inverse = dense.inverse();
  const MatrixXd B = MatrixXd::Random(dense.rows(), 2);
  EXPECT_LT((dut.Solve(B) - inverse * B).norm(), 1e-10 * B.norm());
  const auto blocks = dut.Inverse();
  for (int i = 0; i < matrix.A.size(); ++i) {
    const auto expected = inverse.block<kSize, kSize>(kSize * i, kSize * i);
    const auto& block = blocks.diagonal[static_cast<std::size_t>(i)];
    EXPECT_LT((block - expected).norm(), 1e-10 * expected.norm());
  }
  EXPECT_EQ(blocks.places, matrix.A.places);
  for (std::size_t i = 0; i < blocks.places.size(); ++i) {
    const auto [row, column] = blocks.places[i];
    const auto expected = inverse.block<kSize, kSize>(kSize * row, kSize * column);
    EXPECT_LT((blocks.blocks[i] - expected).norm(), 1e-10 * inverse.norm());
  }
}

template <int kSize>
void ExpectRightAnswers() {
  RandomMatrix<kSize> matrix("answers");
  for (int i = 0; i < 40; ++i) matrix.AddRow();
  for (int round = 0; round < 3; ++round) {
    BlockCholesky<kSize> dut;
    ASSERT_TRUE(dut.Factor(matrix.A));
    ExpectFactorOf(matrix, dut);
    matrix.AddBlocks(25);
  }
}

TEST(BlockCholeskyTest, SolvesAndInverts) {
  ExpectRightAnswers<1>();
  ExpectRightAnswers<3>();
  ExpectRightAnswers<6>();
}

TEST(BlockCholeskyTest, FollowsAMatrixThatGrowsAndChanges) {
  RandomMatrix<6> matrix("growth");
  Random random(2, "growth");
  BlockCholesky<6> dut;
  for (int i = 0; i < 60; ++i) {
    matrix.AddRow();
    if (i % 4 == 0) matrix.Change(random.Index(matrix.A.size()));
    if (i % 3 == 0) matrix.AddBlocks(3, 10);
    ASSERT_TRUE(dut.Factor(matrix.A));
    ExpectFactorOf(matrix, dut);
  }
}

TEST(BlockCholeskyTest, PartsWithoutABlockBetweenThem) {
  RandomMatrix<3> matrix("parts");
  for (int i = 0; i < 4; ++i) matrix.A.diagonal.push_back(9 * Eigen::Matrix3d::Identity());
  matrix.AddBlock(0, 3);
  BlockCholesky<3> dut;
  ASSERT_TRUE(dut.Factor(matrix.A));
  ExpectFactorOf(matrix, dut);
}

TEST(BlockCholeskyTest, NothingToFactor) {
  BlockCholesky<6> dut;
  EXPECT_TRUE(dut.Factor({}));
  EXPECT_EQ(dut.Solve(MatrixXd(0, 1)).rows(), 0);
  EXPECT_EQ(dut.Inverse().size(), 0);
}

TEST(BlockCholeskyTest, TellsWhatIsNotPositiveDefiniteAndRecovers) {
  RandomMatrix<1> matrix("definite");
  for (int i = 0; i < 5; ++i) matrix.AddRow();
  const auto good = matrix.A;
  BlockCholesky<1> dut;
  matrix.A.diagonal[2](0, 0) = -1;
  EXPECT_FALSE(dut.Factor(matrix.A));
  matrix.A = good;
  ASSERT_TRUE(dut.Factor(matrix.A));
  ExpectFactorOf(matrix, dut);
}

TEST(BlockCholeskyTest, SmallestPivotTellsHowNearToSingular) {
  BlockMatrix<1> A;
  A.places = {{0, 1}};
  const auto pivot = [&](double off) {
    A.diagonal.assign(2, BlockMatrix<1>::Block(100));
    A.blocks = {BlockMatrix<1>::Block(off)};
    BlockCholesky<1> dut;
    EXPECT_TRUE(dut.Factor(A));
    return dut.SmallestPivot();
  };
  EXPECT_DOUBLE_EQ(pivot(0), 1);
  EXPECT_NEAR(pivot(60), 1 - 0.36, 1e-12);
  EXPECT_LT(pivot(100 - 1e-10), 1e-10);
}

}  // namespace
}  // namespace vog
