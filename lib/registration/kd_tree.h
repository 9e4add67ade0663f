#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "lib/geometry/pose.h"

namespace vog {

/// A search tree over points, which must outlive it where they are.
class KdTree {
 public:
  explicit KdTree(const std::vector<Vec3>& points);
  ~KdTree();
  KdTree(const KdTree&) = delete;
  KdTree& operator=(const KdTree&) = delete;

  struct Neighbour {
    std::size_t index;
    double distance_m;
  };
  /// The point nearest to `p`. @pre there are points.
  Neighbour NearestTo(const Vec3& p) const;

  /// The same if it is nearer than `max_m`: the farther most points are from all others, the sooner
  /// that is known.
  std::optional<Neighbour> NearestWithin(const Vec3& p, double max_m) const;

  /// Replaces `indices` by those of the points within `radius_m` of `p`, nearest first.
  void Within(const Vec3& p, double radius_m, std::vector<std::size_t>& indices) const;

 private:
  struct Index;
  std::unique_ptr<Index> index_;
};

}  // namespace vog
