#include "lib/posegraph/block_cholesky.h"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

namespace vog {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Columns go into one front when their different structures leave at most this share of it zero.
constexpr double kMaxZeros = 0.15;

/// Eigen cuts products to fit the machine's caches, and with that changes the order of sums: it is
/// told the same sizes on every machine.
void FixCacheSizes() {
  [[maybe_unused]] static const bool is_fixed = [] {
    constexpr std::ptrdiff_t kKiB = 1024;
    Eigen::setCpuCacheSizes(32 * kKiB, 512 * kKiB, 4096 * kKiB);
    return true;
  }();
}

/// Where the rows of a child stand in its parent, which has all of them: both ascending.
template <class Front>
std::vector<Index> PlacesIn(const Front& parent, const std::vector<int>& child_rows) {
  std::vector<Index> places;
  places.reserve(child_rows.size());
  Index below = 0;
  for (const int row : child_rows) {
    if (row < parent.last) {
      places.push_back(row - parent.first);
      continue;
    }
    while (parent.rows[static_cast<std::size_t>(below)] < row) ++below;
    places.push_back(parent.last - parent.first + below);
  }
  return places;
}

template <class Front>
Index PlaceIn(const Front& front, int row) {
  if (row < front.last) return row - front.first;
  const auto found = std::lower_bound(front.rows.begin(), front.rows.end(), row);
  return front.last - front.first + (found - front.rows.begin());
}

/// Eigen has a faster way for vectors.
template <class Triangular, class Rows>
void SolveInPlace(const Triangular& L, Rows& B) {
  if (B.cols() == 1) {
    auto vector = B.col(0);
    L.solveInPlace(vector);
  } else {
    L.solveInPlace(B);
  }
}

}  // namespace

template <int kSize>
bool BlockCholesky<kSize>::Factor(const Matrix& A) {
  FixCacheSizes();
  places_ = A.places;
  OrderByMinimumDegree(A);
  BuildFronts(A);
  for (Front& front : fronts_)
    if (!Compute(A, front)) return false;
  return true;
}

template <int kSize>
double BlockCholesky<kSize>::SmallestPivot() const {
  double smallest = 1;
  for (const Front& front : fronts_) smallest = std::min(smallest, front.smallest_pivot);
  return smallest;
}

template <int kSize>
void BlockCholesky<kSize>::OrderByMinimumDegree(const Matrix& A) {
  std::vector<Eigen::Triplet<double>> triplets;
  for (int i = 0; i < A.size(); ++i) triplets.emplace_back(i, i, 1);
  for (const auto& [row, column] : A.places) triplets.emplace_back(row, column, 1);
  Eigen::SparseMatrix<double> pattern(A.size(), A.size());
  pattern.setFromTriplets(triplets.begin(), triplets.end());
  Eigen::AMDOrdering<int>::PermutationType permutation;
  Eigen::AMDOrdering<int>()(pattern, permutation);
  order_.assign(permutation.indices().begin(), permutation.indices().end());
}

template <int kSize>
void BlockCholesky<kSize>::BuildFronts(const Matrix& A) {
  Sort(A);
  Postorder(FindStructures());
  Sort(A);
  MakeFronts(FindStructures());
}

template <int kSize>
void BlockCholesky<kSize>::Sort(const Matrix& A) {
  place_.resize(order_.size());
  for (std::size_t i = 0; i < order_.size(); ++i)
    place_[static_cast<std::size_t>(order_[i])] = static_cast<int>(i);
  entries_.assign(order_.size(), {});
  for (std::size_t block = 0; block < A.places.size(); ++block) {
    const int row = place_[static_cast<std::size_t>(A.places[block].first)];
    const int column = place_[static_cast<std::size_t>(A.places[block].second)];
    entries_[static_cast<std::size_t>(std::min(row, column))].push_back(
        {std::max(row, column), block, row < column});
  }
}

/// By the rule that a column passes its structure on to the column of its first row.
template <int kSize>
typename BlockCholesky<kSize>::Structures BlockCholesky<kSize>::FindStructures() const {
  Structures structures(order_.size()), children(order_.size());
  std::vector<int> seen(order_.size(), -1);
  for (std::size_t column = 0; column < order_.size(); ++column) {
    const int j = static_cast<int>(column);
    std::vector<int>& rows = structures[column];
    seen[column] = j;
    const auto add = [&](int row) {
      if (std::exchange(seen[static_cast<std::size_t>(row)], j) != j) rows.push_back(row);
    };
    for (const Entry& entry : entries_[column]) add(entry.row);
    for (const int child : children[column])
      for (const int row : structures[static_cast<std::size_t>(child)]) add(row);
    std::sort(rows.begin(), rows.end());
    if (!rows.empty()) children[static_cast<std::size_t>(rows.front())].push_back(j);
  }
  return structures;
}

/// Brings each column next to its descendants, which changes the structures in nothing but names.
template <int kSize>
void BlockCholesky<kSize>::Postorder(const Structures& structures) {
  // From behind: a column's descendants end right before it, and before them those of its sisters.
  const std::vector<int> order = order_;
  std::vector<int> descendants(order.size(), 1), end(order.size());
  for (std::size_t j = 0; j < order.size(); ++j)
    if (!structures[j].empty())
      descendants[static_cast<std::size_t>(structures[j].front())] += descendants[j];
  int roots_end = static_cast<int>(order.size());
  for (std::size_t j = order.size(); j-- > 0;) {
    int& free_end =
        structures[j].empty() ? roots_end : end[static_cast<std::size_t>(structures[j].front())];
    const int place = free_end - 1;
    free_end -= descendants[j];
    end[j] = place;
    order_[static_cast<std::size_t>(place)] = order[j];
  }
}

template <int kSize>
void BlockCholesky<kSize>::MakeFronts(const Structures& structures) {
  fronts_.clear();
  std::vector<int> front_of(order_.size());
  double zeros = 0;
  for (std::size_t column = 0; column < order_.size(); ++column) {
    const int j = static_cast<int>(column);
    const std::vector<int>& rows = structures[column];
    bool joins = false;
    if (!fronts_.empty() && !fronts_.back().rows.empty() && fronts_.back().rows.front() == j) {
      const Front& front = fronts_.back();
      const double columns = front.last - front.first, below = static_cast<double>(rows.size());
      const double more = columns * (below - static_cast<double>(front.rows.size()) + 1);
      joins = zeros + more <= kMaxZeros * (columns + 1) * (below + (columns + 2) / 2);
      zeros += more;
    }
    if (!joins) {
      fronts_.emplace_back().first = j;
      zeros = 0;
    }
    fronts_.back().last = j + 1;
    fronts_.back().rows = rows;
    front_of[column] = static_cast<int>(fronts_.size()) - 1;
  }
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    if (fronts_[f].rows.empty()) continue;
    fronts_[f].parent = front_of[static_cast<std::size_t>(fronts_[f].rows.front())];
    fronts_[static_cast<std::size_t>(fronts_[f].parent)].children.push_back(static_cast<int>(f));
  }
}

template <int kSize>
bool BlockCholesky<kSize>::Compute(const Matrix& A, Front& front) const {
  MatrixXd F = Assemble(A, front);
  const Index columns = front.columns(), below = front.height() - columns;
  Eigen::Ref<MatrixXd> F11 = F.topLeftCorner(columns, columns);
  const Eigen::LLT<Eigen::Ref<MatrixXd>> L11(F11);
  if (L11.info() != Eigen::Success) return false;
  front.smallest_pivot = 1;
  for (Index i = 0; i < columns; ++i) {
    const int row = order_[static_cast<std::size_t>(front.first + i / kSize)];
    const double entry = A.diagonal[static_cast<std::size_t>(row)](i % kSize, i % kSize);
    front.smallest_pivot = std::min(front.smallest_pivot, F11(i, i) * F11(i, i) / entry);
  }
  auto F21 = F.bottomLeftCorner(below, columns);
  F11.triangularView<Eigen::Lower>().transpose().template solveInPlace<Eigen::OnTheRight>(F21);
  front.L = F.leftCols(columns);
  front.update = F.bottomRightCorner(below, below);
  if (below > 0)
    front.update.template selfadjointView<Eigen::Lower>().rankUpdate(front.L.bottomRows(below), -1);
  return true;
}

/// The lower triangle of the front's part of `A` with the updates of its children.
template <int kSize>
MatrixXd BlockCholesky<kSize>::Assemble(const Matrix& A, const Front& front) const {
  MatrixXd F = MatrixXd::Zero(front.height(), front.height());
  const auto block = [&](Index row, Index column) {
    return F.block<kSize, kSize>(kSize * row, kSize * column);
  };
  for (int j = front.first; j < front.last; ++j) {
    const Index column = j - front.first;
    block(column, column) =
        A.diagonal[static_cast<std::size_t>(order_[static_cast<std::size_t>(j)])];
    for (const Entry& entry : entries_[static_cast<std::size_t>(j)]) {
      const Block& value = A.blocks[entry.block];
      const Index row = PlaceIn(front, entry.row);
      if (entry.is_transposed) {
        block(row, column) = value.transpose();
      } else {
        block(row, column) = value;
      }
    }
  }
  for (const int c : front.children) {
    const Front& child = fronts_[static_cast<std::size_t>(c)];
    const std::vector<Index> places = PlacesIn(front, child.rows);
    for (std::size_t column = 0; column < places.size(); ++column)
      for (std::size_t row = column; row < places.size(); ++row)
        block(places[row], places[column]) += child.update.template block<kSize, kSize>(
            kSize * static_cast<Index>(row), kSize * static_cast<Index>(column));
  }
  return F;
}

template <int kSize>
double BlockCholesky<kSize>::entries() const {
  double entries = 0;
  for (const Front& front : fronts_)
    entries += static_cast<double>(front.columns()) *
               (static_cast<double>(front.height()) - static_cast<double>(front.columns() - 1) / 2);
  return entries;
}

template <int kSize>
MatrixXd BlockCholesky<kSize>::SolveLower(const MatrixXd& B) const {
  MatrixXd Z(B.rows(), B.cols());
  const auto rows_of = [](MatrixXd& matrix, Index row) {
    return matrix.middleRows<kSize>(kSize * row);
  };
  for (std::size_t place = 0; place < order_.size(); ++place)
    rows_of(Z, static_cast<Index>(place)) = B.middleRows<kSize>(kSize * order_[place]);
  MatrixXd below;
  for (const Front& front : fronts_) {
    auto own = Z.middleRows(kSize * front.first, front.columns());
    if (own.isZero(0)) continue;
    SolveInPlace(front.L.topRows(front.columns()).template triangularView<Eigen::Lower>(), own);
    below.noalias() = front.L.bottomRows(front.height() - front.columns()) * own;
    for (std::size_t i = 0; i < front.rows.size(); ++i)
      rows_of(Z, front.rows[i]) -= rows_of(below, static_cast<Index>(i));
  }
  return Z;
}

template <int kSize>
MatrixXd BlockCholesky<kSize>::SolveUpper(MatrixXd Z) const {
  const auto rows_of = [](MatrixXd& matrix, Index row) {
    return matrix.middleRows<kSize>(kSize * row);
  };
  MatrixXd below;
  for (auto front = fronts_.rbegin(); front != fronts_.rend(); ++front) {
    auto own = Z.middleRows(kSize * front->first, front->columns());
    below.resize(front->height() - front->columns(), Z.cols());
    for (std::size_t i = 0; i < front->rows.size(); ++i)
      rows_of(below, static_cast<Index>(i)) = rows_of(Z, front->rows[i]);
    own.noalias() -= front->L.bottomRows(below.rows()).transpose() * below;
    const auto L11 = front->L.topRows(front->columns()).template triangularView<Eigen::Lower>();
    SolveInPlace(L11.transpose(), own);
  }
  MatrixXd X(Z.rows(), Z.cols());
  for (std::size_t place = 0; place < order_.size(); ++place)
    rows_of(X, order_[place]) = rows_of(Z, static_cast<Index>(place));
  return X;
}

template <int kSize>
typename BlockCholesky<kSize>::Matrix BlockCholesky<kSize>::Inverse() const {
  // With Y = L21 L11^-1 and Z the inverse, Z21 = -Z22 Y and Z11 = L11^-T L11^-1 - Y^T Z21; Z22 is
  // part of the parent's Z.
  Matrix inverse;
  inverse.diagonal.resize(order_.size());
  inverse.places = places_;
  inverse.blocks.resize(places_.size());
  std::vector<MatrixXd> inverses(fronts_.size());
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    const Index columns = front.columns(), below = front.height() - columns;
    MatrixXd& Z = inverses[f];
    Z.resize(front.height(), front.height());
    MatrixXd L11_inverse = MatrixXd::Identity(columns, columns);
    const auto L11 = front.L.topRows(columns).template triangularView<Eigen::Lower>();
    L11.solveInPlace(L11_inverse);
    Z.topLeftCorner(columns, columns).noalias() = L11_inverse.transpose() * L11_inverse;
    if (front.parent >= 0) {
      const auto parent = static_cast<std::size_t>(front.parent);
      const std::vector<Index> places = PlacesIn(fronts_[parent], front.rows);
      auto Z22 = Z.bottomRightCorner(below, below);
      for (std::size_t column = 0; column < places.size(); ++column)
        for (std::size_t row = 0; row < places.size(); ++row)
          Z22.template block<kSize, kSize>(kSize * static_cast<Index>(row),
                                           kSize * static_cast<Index>(column)) =
              inverses[parent].template block<kSize, kSize>(kSize * places[row],
                                                            kSize * places[column]);
      const MatrixXd Y = front.L.bottomRows(below) * L11_inverse;
      Z.bottomLeftCorner(below, columns).noalias() = -Z22 * Y;
      Z.topRightCorner(columns, below) = Z.bottomLeftCorner(below, columns).transpose();
      Z.topLeftCorner(columns, columns).noalias() -=
          Y.transpose() * Z.bottomLeftCorner(below, columns);
      if (fronts_[parent].children.front() == static_cast<int>(f)) inverses[parent].resize(0, 0);
    }
    for (int j = front.first; j < front.last; ++j) {
      const auto block = [&](int row) {
        return Z.template block<kSize, kSize>(kSize * PlaceIn(front, row),
                                              kSize * (j - front.first));
      };
      const auto column = static_cast<std::size_t>(j);
      inverse.diagonal[static_cast<std::size_t>(order_[column])] = block(j);
      for (const Entry& entry : entries_[column]) {
        Block& of_entry = inverse.blocks[entry.block];
        if (entry.is_transposed) {
          of_entry = block(entry.row).transpose();
        } else {
          of_entry = block(entry.row);
        }
      }
    }
    if (front.children.empty()) Z.resize(0, 0);
  }
  return inverse;
}

template class BlockCholesky<1>;
template class BlockCholesky<3>;
template class BlockCholesky<6>;

}  // namespace vog
