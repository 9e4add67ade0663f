#include "lib/registration/kd_tree.h"

#include <cmath>
#include <limits>
#include <nanoflann.hpp>
#include <utility>

namespace vog {
namespace {

struct Adaptor {
  const std::vector<Vec3>& points;

  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t index, std::size_t axis) const { return points[index][axis]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Adaptor>, Adaptor, 3>;

}  // namespace

struct KdTree::Index {
  explicit Index(const std::vector<Vec3>& points) : adaptor{points}, tree(3, adaptor) {}

  Adaptor adaptor;
  Tree tree;
};

KdTree::KdTree(const std::vector<Vec3>& points) : index_(std::make_unique<Index>(points)) {}
KdTree::~KdTree() = default;

KdTree::Neighbour KdTree::NearestTo(const Vec3& p) const {
  return *NearestWithin(p, std::numeric_limits<double>::infinity());
}

std::optional<KdTree::Neighbour> KdTree::NearestWithin(const Vec3& p, double max_m) const {
  std::uint32_t index = 0;
  double squared = 0;
  nanoflann::KNNResultSet<double, std::uint32_t> result(1);
  result.init(&index, &squared);
  squared = max_m * max_m;  // The set's worst so far: the tree leaves out what is farther.
  index_->tree.findNeighbors(result, p.data(), nanoflann::SearchParams());
  if (result.size() == 0) return std::nullopt;
  return Neighbour{index, std::sqrt(squared)};
}

void KdTree::Within(const Vec3& p, double radius_m, std::vector<std::size_t>& indices) const {
  std::vector<std::pair<std::uint32_t, double>> found;
  index_->tree.radiusSearch(p.data(), radius_m * radius_m, found, nanoflann::SearchParams());
  indices.clear();
  for (const auto& [index, squared] : found) indices.push_back(index);
}

}  // namespace vog
