#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "lib/base/files.h"
#include "lib/bus/lcm_log.h"
#include "lib/geometry/cloud_file.h"
#include "lib/geometry/trajectory.h"
#include "lib/messages/convert.h"
#include "lib/messages/endpoint.h"
#include "lib/vogmap/map_folder.h"
#include "sim/scene/mesh_file.h"

namespace vog {

/// Makes folders such as missions leave, small ones, in a place that goes with the test.
class RunFolderTest : public testing::Test {
 protected:
  RunFolderTest()
      : root_(std::filesystem::temp_directory_path() /
              ("vog-report-test-" + std::to_string(::getpid()) + "-" +
               testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::remove_all(root_);
    std::filesystem::create_directories(root_);
  }
  ~RunFolderTest() override { std::filesystem::remove_all(root_); }

  struct Options {
    std::string scene = "box", mode = "vog", reason = "disagrees with the odometry";
    std::string config_toml = "[mission]\nname = \"box\"\n";
    int seed = 3;
    double rmse_m = 0.0523;
    bool has_truth = true, has_planning = true;
    int more_closures = 0;  ///< Of the first two submaps, each elsewhere.
    int lost_submap = -1;   ///< One that the map has not got.
  };

  std::filesystem::path MakeRun(const std::string& name, const Options& options) {
    const std::filesystem::path folder = root_ / name;
    std::filesystem::create_directories(folder);
    WriteLog(folder / "lcm.log", options);
    WriteMap(folder / "map", options);
    WriteTiming(folder / "timing.json", options);
    if (!options.has_truth) return folder;
    WriteMetrics(folder, options);
    WriteTruth(folder);
    return folder;
  }

  const std::filesystem::path& root() const { return root_; }

 private:
  static constexpr int kSubmaps = 3;
  static constexpr double kVoxel_m = 0.1;

  static Pose3 NodePose(int i) { return MakePose({-2.0 + i, -1.5 + 0.5 * i, 0.1 * i}); }

  static graph_edge_t Edge(int from, int to, std::int8_t kind, const std::string& reason) {
    graph_edge_t edge{};
    edge.from_id = from;
    edge.to_id = to;
    edge.kind = kind;
    edge.X_ik = ToMessage(Ominus(NodePose(from), NodePose(to)));
    edge.reason = reason;
    return edge;
  }

  template <class Message>
  static void Say(LcmLogWriter& log, const Channel<Message>& channel, const Message& message) {
    log.Write(FromUtime(message.header.utime_us), channel.name, Encode(message));
  }

  /// Of the solution for the first `count` submaps.
  static void SayPoses(LcmLogWriter& log, int count) {
    std::vector<SubmapPlace> places(static_cast<std::size_t>(count));
    for (int id = 0; id < count; ++id) {
      SubmapPlace& place = places[static_cast<std::size_t>(id)];
      place.id = id;
      place.X_WM = NodePose(id);
    }
    submap_poses_t message = ToMessage(places);
    message.version = count;
    Say(log, outputs::kSubmapPoses, message);
  }

  static void WriteLog(const std::filesystem::path& file, const Options& options) {
    LcmLogWriter log(file.string());
    run_t run{};
    run.program_version = "0.1.0";
    run.config_toml = options.config_toml;
    run.seed = options.seed;
    run.mode = options.mode;
    Say(log, inputs::kRun, run);
    truth_t truth{};
    truth.X_WB = ToMessage(NodePose(0));
    if (options.has_truth) Say(log, inputs::kTruth, truth);
    for (int i = 0; i < kSubmaps; ++i) {
      pose_estimate_t pose{};
      pose.header.utime_us = 1'000'000 * i;
      pose.X_WB = ToMessage(NodePose(i));
      Say(log, outputs::kPose, pose);
    }
    for (int count = 1; count <= kSubmaps; ++count) SayPoses(log, count);
    graph_t graph{};
    graph.version = kSubmaps;
    graph.edge = {Edge(0, 1, 0, ""), Edge(1, 2, 0, ""), Edge(0, 2, 1, ""), Edge(0, 1, 2, ""),
                  Edge(1, 2, 3, options.reason)};
    for (int i = 0; i < options.more_closures; ++i) {
      graph.edge.push_back(Edge(0, 1, graph_edge_t::FULL_CLOSURE, ""));
      graph.edge.back().X_ik.position_m[0] += 0.01 * (i + 1);
    }
    graph.count = static_cast<std::int32_t>(graph.edge.size());
    Say(log, outputs::kGraph, graph);
  }

  static void WriteMap(const std::filesystem::path& folder, const Options& options) {
    StoredMap map;
    map.voxel_size_m = kVoxel_m;
    map.complete = true;
    for (int id = 0; id < kSubmaps; ++id) {
      if (id == options.lost_submap) continue;
      Submap submap{
          .base = {}, .first_scan = {}, .last_scan = {}, .scans = 0, .grid = BrickGrid(kVoxel_m)};
      submap.base.id = id;
      submap.scans = 1;
      for (int x = -10; x < 10; ++x)
        for (int y = -10; y < 10; ++y) submap.grid.At({x, y, 0}) = ToUnits(y > 7 ? 2.0f : -1.0f);
      map.submaps.push_back(std::make_shared<const Submap>(std::move(submap)));
      map.X_WM[id] = NodePose(id);
    }
    SaveMapFolder(map, folder);
  }

  static void WriteTiming(const std::filesystem::path& file, const Options& options) {
    nlohmann::ordered_json timing = {{"wall_s", 12.5},
                                     {"node_wall_s", nlohmann::ordered_json::object()},
                                     {"planning", nlohmann::ordered_json::array()}};
    if (options.has_planning) {
      timing["node_wall_s"]["vog-planner"] = 7.25;
      for (int i = 0; i < 6; ++i)
        timing["planning"].push_back({{"submaps", i / 2}, {"wall_s", 0.01 * (i + 1)}});
    }
    WriteFileAtomically(file, timing.dump());
  }

  static void WriteMetrics(const std::filesystem::path& folder, const Options& options) {
    const nlohmann::ordered_json metrics = {
        {"scene", options.scene},
        {"mode", options.mode},
        {"planner", "nbvp"},
        {"seed", options.seed},
        {"end_reason", "max_submaps"},
        {"submaps", kSubmaps},
        {"rmse_m", {{"vog", options.rmse_m}, {"vog_no_lc", 0.2}, {"standard", 0.3}}},
        {"nees_per_dimension", 1.25},
        {"nees_share_below_95", 0.9},
        {"coverage", {{"surface", 0.914}, {"volume", 0.8}}},
        {"time_to_s", {{"surface_90", 42.0}, {"volume_95", nullptr}}},
        {"loop_closures", {{"full", 1}, {"partial", 1}, {"rejected", 1}}},
        {"collisions", 0}};
    WriteFileAtomically(folder / "metrics.json", metrics.dump(2));
    nlohmann::ordered_json series;
    for (const char* key : {"surface", "volume", "odometry_error_m", "estimate_error_m"})
      for (int t = 0; t < 5; ++t) series[key].push_back({1.0 * t, 0.2 * t});
    series["nees_per_dimension"] = {{1.0, 0.5}, {2.0, 2.0}};
    WriteFileAtomically(folder / "timeseries.json", series.dump());
  }

  static void WriteTruth(const std::filesystem::path& folder) {
    Trajectory path;
    for (int i = 0; i < kSubmaps; ++i) path.push_back({FromUtime(1'000'000 * i), NodePose(i)});
    for (const char* name : {"truth.tum", "odometry.tum", "estimate.tum"})
      WriteTum(folder / name, path);
    std::vector<Vec3> cloud;
    for (int i = 0; i < 20; ++i)
      for (int k = 0; k < 20; ++k) cloud.push_back({0.1 * i, 0.1 * k, 0.01 * i * k});
    WriteCloud(folder / "reconstruction_truth.ply", cloud);
    for (const char* name : {"vog", "vog_no_lc", "standard"}) {
      for (Vec3& p : cloud) p.z() += 0.02 * std::sin(20 * p.x());
      WriteCloud(folder / ("reconstruction_" + std::string(name) + ".ply"), cloud);
    }
    SaveMesh({{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 1}},
              {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}},
             folder / "scene.ply");
  }

  std::filesystem::path root_;
};

}  // namespace vog
