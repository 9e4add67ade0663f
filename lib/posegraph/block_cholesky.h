#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace vog {

/// A sparse symmetric matrix of kSize x kSize blocks. Of two blocks that mirror each other the one
/// above the diagonal is kept.
template <int kSize>
struct BlockMatrix {
  using Block = Eigen::Matrix<double, kSize, kSize>;

  std::vector<Block> diagonal;
  std::vector<std::pair<int, int>> places;  ///< (row, column) of each block, row < column, unique.
  std::vector<Block> blocks;                ///< In the order of `places`.

  int size() const { return static_cast<int>(diagonal.size()); }
};

/// The Cholesky factor of a BlockMatrix by the multifrontal method [Duff and Reid 1983]. Plain C++
/// on one thread, so that no library of the machine has a say in the result. Made for 1, 3 and 6.
template <int kSize>
class BlockCholesky {
 public:
  using Matrix = BlockMatrix<kSize>;
  using Block = typename Matrix::Block;

  /// False when `A` is not positive definite: then nothing else may be asked.
  bool Factor(const Matrix& A);

  /// The smallest pivot as a share of the diagonal entry it came from: near 1e-16 when the matrix
  /// is singular for all that doubles can tell.
  double SmallestPivot() const;

  /// X with A X = B.
  Eigen::MatrixXd Solve(const Eigen::MatrixXd& B) const { return SolveUpper(SolveLower(B)); }
  /// Its two halves: A = L L^T, Z = L^-1 B, X = L^-T Z. The rows of L and Z are in an order of
  /// their own. Rows of zeros in B save time.
  Eigen::MatrixXd SolveLower(const Eigen::MatrixXd& B) const;
  Eigen::MatrixXd SolveUpper(Eigen::MatrixXd Z) const;

  /// Numbers in the factor: a Solve() multiplies by each of them twice.
  double entries() const;

  /// The blocks of A^-1 where A has some, without the rest of it [Takahashi, Fagan, Chin 1973].
  /// Costs about twice a factorisation.
  Matrix Inverse() const;

 private:
  /// Columns of the factor that share one structure, and what their elimination leaves to do. Rows
  /// and columns are places in the order of elimination.
  struct Front {
    int first = 0, last = 0;  ///< Its columns: first, ..., last - 1.
    std::vector<int> rows;    ///< Below them, ascending.
    int parent = -1;
    std::vector<int> children;
    Eigen::MatrixXd L;       ///< Its columns of the factor, at their own rows and at `rows`.
    Eigen::MatrixXd update;  ///< What it adds at `rows` x `rows`; lower triangle.
    double smallest_pivot = 1;

    Eigen::Index columns() const { return Eigen::Index{kSize} * (last - first); }
    Eigen::Index height() const {
      return columns() + Eigen::Index{kSize} * static_cast<Eigen::Index>(rows.size());
    }
  };
  /// A block beside the diagonal, seen from the column that is eliminated first.
  struct Entry {
    int row;
    std::size_t block;
    bool is_transposed;
  };
  using Structures = std::vector<std::vector<int>>;  ///< Rows below the diagonal, by column.

  void OrderByMinimumDegree(const Matrix& A);
  void BuildFronts(const Matrix& A);
  void Sort(const Matrix& A);
  Structures FindStructures() const;
  void Postorder(const Structures& structures);
  void MakeFronts(const Structures& structures);

  bool Compute(const Matrix& A, Front& front) const;
  Eigen::MatrixXd Assemble(const Matrix& A, const Front& front) const;

  std::vector<std::pair<int, int>> places_;  ///< Of the matrix.
  std::vector<int> order_;                   ///< Place -> row of the matrix.
  std::vector<int> place_;                   ///< Its inverse.
  std::vector<std::vector<Entry>> entries_;  ///< By column.
  std::vector<Front> fronts_;                ///< Children before parents.
};

}  // namespace vog
