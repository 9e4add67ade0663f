#include "tools/report/closure_history.h"

#include <algorithm>

#include "lib/messages/convert.h"

namespace vog {
namespace {

bool IsClosure(const graph_edge_t& edge) {
  return edge.kind >= graph_edge_t::FULL_CLOSURE && edge.kind <= graph_edge_t::REJECTED_CLOSURE;
}

/// The odometry edges that lead to submaps, by their numbers.
std::map<SubmapId, Pose3> MotionsTo(const graph_t& graph) {
  std::map<SubmapId, Pose3> X_PM;
  for (const graph_edge_t& edge : graph.edge) {
    if (edge.kind != graph_edge_t::ODOMETRY || edge.to_id <= 0 || edge.to_id - 1 != edge.from_id)
      continue;
    if (const auto motion = FromMessage(edge.X_ik)) X_PM[edge.to_id] = *motion;
  }
  return X_PM;
}

}  // namespace

void ClosureHistory::Add(const submap_poses_t& message) {
  const auto places = FromMessage(message);
  if (!places) return;
  if (message.version != version_) before_ = std::move(newest_);
  newest_.clear();
  for (const SubmapPlace& place : *places) newest_[place.id] = place.X_WM;
  version_ = message.version;
}

const ClosureHistory::Poses& ClosureHistory::PosesBefore(const graph_t& graph) const {
  return graph.version == version_ ? before_ : newest_;
}

std::optional<std::pair<ClosureHistory::Key, Pose3>> ClosureHistory::Read(
    const graph_edge_t& edge) {
  const auto X_ik = IsClosure(edge) ? FromMessage(edge.X_ik) : std::nullopt;
  if (!X_ik) return std::nullopt;
  const Vec3& p = X_ik->translation();
  return std::pair(Key(edge.from_id, edge.to_id, {p.x(), p.y(), p.z()}), *X_ik);
}

void ClosureHistory::Add(const graph_t& graph) {
  const Poses& X_WM = PosesBefore(graph);
  const std::map<SubmapId, Pose3> X_PM = MotionsTo(graph);
  const auto before = [&](const graph_edge_t& edge) -> std::optional<Pose3> {
    const auto i = X_WM.find(edge.from_id);
    const auto motion = X_PM.find(edge.to_id);
    if (i == X_WM.end() || motion == X_PM.end()) return std::nullopt;
    const auto previous = X_WM.find(edge.to_id - 1);
    if (previous == X_WM.end()) return std::nullopt;
    return Ominus(i->second, previous->second * motion->second);
  };
  for (const graph_edge_t& edge : graph.edge) {
    const auto read = Read(edge);
    if (!read) continue;
    const auto [entry, is_new] = past_.try_emplace(read->first);
    Past& past = entry->second;
    if (is_new) past.X_ik_before = before(edge);
    if (edge.kind != graph_edge_t::REJECTED_CLOSURE) {
      past.kind = edge.kind;
      past.dropped.reset();
    } else if (past.kind != graph_edge_t::REJECTED_CLOSURE && !past.dropped) {
      past.dropped = TimeOf(graph.header);
    }
  }
  last_ = graph;
}

std::vector<TriedClosure> ClosureHistory::Closures() const {
  std::vector<TriedClosure> closures;
  for (const graph_edge_t& edge : last_.edge) {
    const auto read = Read(edge);
    if (!read) continue;
    const Past& past = past_.at(read->first);
    closures.push_back({edge, read->second, past.X_ik_before, past.kind, past.dropped});
  }
  // GRAPH tells accepted ones first.
  std::stable_sort(
      closures.begin(), closures.end(), [](const TriedClosure& a, const TriedClosure& b) {
        return std::pair(a.edge.to_id, a.edge.from_id) < std::pair(b.edge.to_id, b.edge.from_id);
      });
  return closures;
}

}  // namespace vog
