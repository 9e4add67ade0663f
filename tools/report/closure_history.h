#pragma once

#include <array>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "lib/base/time.h"
#include "lib/submap/submap.h"
#include "vog/graph_t.hpp"
#include "vog/submap_poses_t.hpp"

namespace vog {

/// A loop closure that was tried.
struct TriedClosure {
  graph_edge_t edge{};  ///< As the last GRAPH tells it.
  Pose3 X_ik = Pose3::Identity();
  /// Where odometry had `to` before it closed loops, as far as the log tells.
  std::optional<Pose3> X_ik_before;
  /// Full or partial, as it was accepted, if it ever was.
  std::int8_t kind = graph_edge_t::REJECTED_CLOSURE;
  /// When it left the graph again.
  std::optional<Time> dropped;

  bool was_accepted() const { return kind != graph_edge_t::REJECTED_CLOSURE; }
};

/// Collects a log's GRAPH and SUBMAP_POSES, in their order, into what became of each closure.
class ClosureHistory {
 public:
  void Add(const submap_poses_t& message);
  void Add(const graph_t& graph);

  /// All that the last GRAPH tells of, in the order in which they were tried.
  std::vector<TriedClosure> Closures() const;

 private:
  /// From, to and position of X_ik: a pair may be tried more than once.
  using Key = std::tuple<SubmapId, SubmapId, std::array<double, 3>>;
  using Poses = std::map<SubmapId, Pose3>;
  struct Past {
    std::optional<Pose3> X_ik_before;
    std::int8_t kind = graph_edge_t::REJECTED_CLOSURE;
    std::optional<Time> dropped;
  };

  static std::optional<std::pair<Key, Pose3>> Read(const graph_edge_t& edge);
  /// The poses that the solution before `graph` had.
  const Poses& PosesBefore(const graph_t& graph) const;

  std::int64_t version_ = 0;
  Poses newest_, before_;
  std::map<Key, Past> past_;
  graph_t last_{};
};

}  // namespace vog
