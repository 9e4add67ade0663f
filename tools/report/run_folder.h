#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "lib/geometry/trajectory.h"
#include "lib/geometry/triangle_mesh.h"
#include "lib/vogmap/map_folder.h"
#include "tools/report/closure_history.h"
#include "vog/graph_edge_t.hpp"

namespace vog {

/// What a finished run left on the disk. Parts that a run need not have are empty.
struct RunFolder {
  std::string program_version, mode, mission_name, config_toml;
  std::int64_t seed = 0;
  /// Vehicle time over real time, of a run of real processes.
  std::optional<double> live_speed;
  nlohmann::ordered_json metrics;  ///< Null for a run that could not be judged: it has no truth.
  nlohmann::ordered_json timing, series;
  Trajectory truth;
  /// Of a run without truth, what the nodes said while it went on.
  Trajectory odometry, estimate;
  std::optional<TriangleMesh> scene_W;
  std::optional<Eigen::AlignedBox3d> exploration_box_W;
  StoredMap map;
  std::vector<graph_edge_t> edges;  ///< Of the pose graph.
  std::vector<TriedClosure> closures;

  int CountEdges(std::int8_t kind) const;
  /// The scene (or the mission, where that is not known) and what else tells this run from others,
  /// in a line.
  std::string Title() const;
};

/// Reads the parts that make up a run: the log's RUN and GRAPH, the map, metrics.json and the files
/// beside it. @throws UsageError for a folder that is not a finished run.
RunFolder ReadRunFolder(const std::filesystem::path& folder);

/// The numbers of a run alone, for comparisons: cheaper than the above.
struct RunNumbers {
  std::string name;  ///< The folder, as it was given.
  nlohmann::ordered_json metrics, timing, series;
};

/// @throws UsageError for a folder that is not a finished run with metrics.
RunNumbers ReadRunNumbers(const std::filesystem::path& folder);

/// A number deep inside, "/rmse_m/vog"; nothing where there is none.
std::optional<double> NumberAt(const nlohmann::ordered_json& json, const std::string& pointer);
/// A text there, "" where there is none.
std::string TextAt(const nlohmann::ordered_json& json, const std::string& pointer);

}  // namespace vog
