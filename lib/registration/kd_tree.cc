#include "lib/registration/kd_tree.h"

#include <cmath>
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
  std::uint32_t index = 0;
  double squared = 0;
  index_->tree.knnSearch(p.data(), 1, &index, &squared);
  return {index, std::sqrt(squared)};
}

void KdTree::Within(const Vec3& p, double radius_m, std::vector<std::size_t>& indices) const {
  std::vector<std::pair<std::uint32_t, double>> found;
  index_->tree.radiusSearch(p.data(), radius_m * radius_m, found, nanoflann::SearchParams());
  indices.clear();
  for (const auto& [index, squared] : found) indices.push_back(index);
}

}  // namespace vog
