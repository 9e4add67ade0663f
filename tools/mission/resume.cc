#include "tools/mission/resume.h"

#include <algorithm>
#include <cmath>

#include "lib/base/files.h"
#include "lib/base/random.h"
#include "lib/planner/planner_options.h"
#include "procs/map_service/earlier_map.h"
#include "procs/sim/sim_node.h"
#include "sim/scene/overlap.h"
#include "sim/scene/scene.h"
#include "tools/mission/replay.h"
#include "tools/mission/run_record.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxPutIns = 1000;

/// Where the vehicle truly was; nothing where no log tells.
struct Truth {
  std::optional<Pose3> X_WB_first, X_WB_last;
  Time end;
};

Truth TruthOf(const EarlierRun& run) {
  Truth truth;
  if (!run.log) return truth;
  const Trajectory poses = ReadRun(*run.log).truth;
  truth.X_WB_last = poses.back().X_WB;
  truth.end = poses.back().time;
  truth.X_WB_first = run.earlier ? TruthOf(FindEarlierRun(*run.earlier)).X_WB_first
                                 : std::optional(poses.front().X_WB);
  return truth;
}

/// Where the vehicle would be put in without any error.
Pose3 TruePlace(const Truth& truth, PutInPlace place, const Pose3& X_WE_told) {
  switch (place) {
    case PutInPlace::kEnd:
      return truth.X_WB_last.value_or(X_WE_told);
    case PutInPlace::kStart:
      return truth.X_WB_first.value_or(X_WE_told);
    case PutInPlace::kPlace:
      break;
  }
  return X_WE_told;
}

/// The first of many tries to put the vehicle in at `place` that finds room for it.
Pose3 PutIn(const Config& config, const Pose3& place, std::uint64_t seed) {
  const auto options = config.Read<PutInOptions>("put_in");
  const auto hull_size_m = config.Read<VehicleOptions>("vehicle").hull_size_m;
  const Eigen::AlignedBox3d box_W = config.Read<ExplorationOptions>("exploration").box_W();
  const TriangleMesh scene_W = MakeScene(SceneSettings::From(config));
  const RayCaster scene(scene_W);
  for (int attempt = 0; attempt < kMaxPutIns; ++attempt) {
    Random random(seed, "put_in", attempt);
    const Vec3 error =
        random.GaussianVector({options.sigma_m, options.sigma_m, ToRadians(options.sigma_yaw_deg)});
    const Pose3 X_WB =
        Level(place) * MakePose({error.x(), error.y(), place.translation().z()}, {0, 0, error.z()});
    if (box_W.contains(X_WB.translation()) && !scene.Inside(X_WB.translation()) &&
        !BoxTouches(scene_W, X_WB, hull_size_m))
      return X_WB;
  }
  throw UsageError("there is no room for the vehicle where it is to be put in; set [put_in]");
}

}  // namespace

EarlierRun FindEarlierRun(const fs::path& path) {
  EarlierRun run;
  run.map = IsMapFolder(path / "map") ? path / "map" : path;
  const std::int64_t run_id = RunIdOfMap(run.map);  // Throws where there is none.
  const fs::path folder = fs::weakly_canonical(run.map).parent_path();
  const fs::path log = folder / "lcm.log", earlier = folder / kEarlier;
  if (!fs::is_regular_file(log)) return run;
  const auto logged = FirstRun(log);
  if (!logged || logged->header.run_id != run_id) return run;
  run.log = log;
  if (IsMapFolder(earlier / "map")) run.earlier = earlier;
  return run;
}

void GoOnFrom(const EarlierRun& run, Config& config) {
  const auto mission = config.Read<MissionOptions>("mission");
  if (mission.mode == MissionMode::kStandard)
    throw UsageError("mode standard cannot go on from a map: it has one grid and no submaps");
  const auto put_in = config.Read<PutInOptions>("put_in");
  const StoredMap map = LoadEarlierMap(run.map, mission, config.Read<SubmapOptions>("submap"),
                                       config.Read<SensorModelOptions>("sensor_model"));
  const Pose3 X_WE = map.X_WM.at(map.submaps.back()->id()) * PutInPlaceOf(map, put_in).X_ME;
  const Truth truth = TruthOf(run);
  const double end_s = ToSeconds(std::max(truth.end, EndOf(map).time));
  const Time start(FromSeconds(std::floor(end_s) + 2));
  const Pose3 X_WB = PutIn(config, TruePlace(truth, put_in.place, X_WE),
                           NoiseSeed(static_cast<std::uint64_t>(mission.seed), start));
  const Vec3 error_m = X_WE.translation() - X_WB.translation();
  const auto set = [&](const std::string& key, const std::string& value) {
    config.Set(key + "=" + value);
  };
  set("map.resume", "'" + (fs::path(kEarlier) / "map").string() + "'");
  set("simulation.start_time_s", ToText(ToSeconds(start)));
  set("simulation.start_position_m", ToToml(X_WB.translation()));
  set("simulation.start_yaw_deg", ToText(ToDegrees(YawOf(X_WB))));
  set("simulation.start_error_x_m", ToText(error_m.x()));
  set("simulation.start_error_y_m", ToText(error_m.y()));
  set("simulation.start_error_yaw_deg", ToText(ToDegrees(WrapAngle(YawOf(X_WE) - YawOf(X_WB)))));
}

void RejectFolderOf(const EarlierRun& run, const fs::path& folder) {
  const fs::path map = fs::weakly_canonical(run.map), out = fs::weakly_canonical(folder);
  if (std::mismatch(out.begin(), out.end(), map.begin(), map.end()).first == out.end())
    throw UsageError(folder.string() +
                     ": holds the map to go on from, which stays as it is; choose another folder");
}

void KeepEarlierRun(const EarlierRun& run, const fs::path& folder) {
  const fs::path kept = folder / kEarlier;
  const auto keep = [&](const fs::path& from, const fs::path& to) {
    constexpr auto kAll = fs::copy_options::recursive | fs::copy_options::overwrite_existing;
    std::error_code error;
    fs::copy(from, to, fs::copy_options::recursive | fs::copy_options::create_hard_links, error);
    if (error) fs::copy(from, to, kAll, error);  // Another file system.
    if (error) throw SystemError(to.string() + ": cannot copy: " + error.message());
  };
  std::error_code error;
  fs::create_directories(kept, error);  // What cannot be created cannot be copied into.
  keep(run.map, kept / "map");
  if (run.log) keep(*run.log, kept / "lcm.log");
  if (run.earlier) keep(*run.earlier, kept / kEarlier);
}

}  // namespace vog
