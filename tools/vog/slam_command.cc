#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "lib/base/log.h"
#include "lib/geometry/cloud_file.h"
#include "lib/registration/icp.h"
#include "lib/vogmap/map_folder.h"
#include "tools/mission/evaluate.h"
#include "tools/mission/progress_bar.h"
#include "tools/slam/rerun.h"
#include "tools/vog/commands.h"
#include "tools/vog/config_arguments.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;

void AddConfigOptions(CLI::App& command, ConfigArguments& arguments) {
  command.add_option("--config", arguments.file,
                     "mission file; without, all settings are defaults");
  command.add_option("--set", arguments.settings, "table.key=value, any number of times");
}

// --- register ---

struct RegisterArguments {
  std::string source, target;
  std::vector<double> initial;
  ConfigArguments config;
  bool json = false;
};

Pose3 InitialPose(const RegisterArguments& arguments, const CloudFile& source,
                  const CloudFile& target) {
  if (arguments.initial.empty()) return Ominus(target.X_WV, source.X_WV);
  const auto& n = arguments.initial;
  const Eigen::Quaterniond q(n[6], n[3], n[4], n[5]);
  if (!(q.norm() > 1e-6)) throw UsageError("--initial: the quaternion's length is 0");
  return MakePose({n[0], n[1], n[2]}, q.normalized());
}

std::vector<double> NumbersOf(const Pose3& X) {
  const Eigen::Quaterniond q(X.linear());
  return {
      X.translation().x(), X.translation().y(), X.translation().z(), q.x(), q.y(), q.z(), q.w()};
}

Json JsonOf(const Mat6& matrix) {
  Json rows = Json::array();
  for (int row = 0; row < 6; ++row) {
    rows.push_back(Json::array());
    for (int col = 0; col < 6; ++col) rows.back().push_back(matrix(row, col));
  }
  return rows;
}

Json JsonOf(const IcpResult& result) {
  Json measured = Json::array();
  for (Eigen::Index i = 0; i < result.basis.cols(); ++i)
    measured.push_back(std::vector<double>(result.basis.col(i).begin(), result.basis.col(i).end()));
  return {{"usable", result.usable},
          {"X_target_source", NumbersOf(result.X_ik)},
          {"rmse_m", result.rmse_m},
          {"overlap", result.overlap},
          {"correspondences", result.correspondences},
          {"iterations", result.iterations},
          {"degenerate_directions", result.degenerate_directions},
          {"signal_to_noise", result.signal_to_noise},
          {"measured_directions", measured},
          {"covariance", JsonOf(result.covariance)}};
}

void PrintRegistration(const IcpResult& result) {
  if (!result.usable) {
    std::printf("no registration: too little in common\n");
    return;
  }
  std::printf("X_target_source");
  for (const double number : NumbersOf(result.X_ik)) std::printf(" %.6f", number);
  std::printf("   (x y z qx qy qz qw)\nrmse_m %.4f   overlap %.2f   correspondences %d\n",
              result.rmse_m, result.overlap, result.correspondences);
  std::printf("degenerate directions %d; signal to noise", result.degenerate_directions);
  for (const double ratio : result.signal_to_noise) std::printf(" %.3g", ratio);
  std::printf("\nmeasured directions (x y z roll pitch yaw of the source) and their sigma\n");
  for (Eigen::Index i = 0; i < result.basis.cols(); ++i) {
    const Vec6 direction = result.basis.col(i);
    for (const double entry : direction) std::printf(" %7.3f", entry);
    std::printf("   %.4f\n", std::sqrt(direction.dot(result.covariance * direction)));
  }
}

void Run(const RegisterArguments& arguments) {
  const auto options = arguments.config.Load().Read<IcpOptions>("registration");
  const CloudFile source = ReadCloud(arguments.source), target = ReadCloud(arguments.target);
  const auto cloud = [&](const CloudFile& file) {
    return CloudFor(options, file.points_V, Vec3::Zero());
  };
  const IcpResult result =
      Register(options, cloud(target), cloud(source), InitialPose(arguments, source, target));
  if (arguments.json)
    std::printf("%s\n", JsonOf(result).dump(2).c_str());
  else
    PrintRegistration(result);
  if (!result.usable) throw UsageError("the clouds could not be registered");
}

// --- slam ---

struct SlamArguments {
  std::string map, out, run;
  ConfigArguments config;
  FaultOptions faults;
  bool json = false;
};

Json JsonOf(const Rerun& rerun) {
  const RerunSummary& summary = rerun.summary;
  Json poses = Json::array();
  for (std::size_t i = 0; i < rerun.map.submaps.size(); ++i) {
    const Submap& submap = *rerun.map.submaps[i];
    poses.push_back({{"id", submap.id()},
                     {"first_utime_us", ToUtime(submap.first_scan)},
                     {"last_utime_us", ToUtime(submap.last_scan)},
                     {"X_WM", NumbersOf(rerun.map.X_WM.at(submap.id()))},
                     {"X_WC", NumbersOf(rerun.X_WC[i])}});
    if (!rerun.covariances.empty()) poses.back()["covariance"] = JsonOf(rerun.covariances[i]);
  }
  Json revisits = Json::array();
  for (const auto& [id, gain] : rerun.revisits) revisits.push_back({{"id", id}, {"gain", gain}});
  return {{"submaps", rerun.map.submaps.size()},
          {"full", summary.full},
          {"partial", summary.partial},
          {"rejected", summary.rejected},
          {"faults", summary.faults},
          {"faults_kept", summary.faults_kept},
          {"seconds_per_submap",
           {{"median", summary.median_s},
            {"last_tenth_median", summary.last_tenth_median_s},
            {"worst", summary.worst_s}}},
          {"revisits", revisits},
          {"poses", poses}};
}

/// The submaps that are most worth being seen again.
void PrintRevisits(const std::map<SubmapId, double>& gains) {
  constexpr std::size_t kMost = 5;
  std::vector<std::pair<SubmapId, double>> best(gains.begin(), gains.end());
  std::stable_sort(best.begin(), best.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  if (best.size() > kMost) best.resize(kMost);
  const char* separator = "seen again, submaps would lower the mean position error: ";
  for (const auto& [id, gain] : best) {
    std::printf("%s%d by %.0f %%", separator, id, 100 * gain);
    separator = ", ";
  }
  if (!best.empty()) std::printf("\n");
}

void PrintSummary(const StoredMap& map, const RerunSummary& summary) {
  std::printf("submaps %zu, closures %d full, %d partial\n", map.submaps.size(), summary.full,
              summary.partial);
  for (const auto& [reason, count] : summary.rejected)
    std::printf("rejected %6d  %s\n", count, reason.c_str());
  if (summary.faults > 0)
    std::printf("wrong on purpose %d, of these kept %d\n", summary.faults, summary.faults_kept);
  std::printf(
      "a submap took %.0f ms (median), %.0f ms (median of the last tenth), %.0f ms (worst)\n",
      1e3 * summary.median_s, 1e3 * summary.last_tenth_median_s, 1e3 * summary.worst_s);
}

void Run(const SlamArguments& arguments) {
  if (!arguments.out.empty() && IsMapFolder(arguments.out))
    throw UsageError(arguments.out + ": there is a map already; choose another folder");
  const SlamSettings settings = SlamSettings::From(arguments.config.Load());
  LoadedMap loaded = LoadMapFolder(arguments.map);
  for (const std::string& fault : loaded.faults) LogLine(fault);
  const Rerun rerun = [&] {
    ProgressBar bar;
    return RerunSlam(loaded.map, settings, arguments.faults,
                     [&](double share) { bar.Show(share, "submaps"); });
  }();
  if (!arguments.out.empty()) {
    SaveMapFolder(rerun.map, arguments.out);
    PackMapFolder(arguments.out);
  }
  Json metrics;
  if (!arguments.run.empty()) metrics = JudgeMap(arguments.run, rerun.map);
  if (arguments.json) {
    Json json = JsonOf(rerun);
    if (!metrics.empty()) json["metrics"] = metrics;
    std::printf("%s\n", json.dump(2).c_str());
    return;
  }
  PrintSummary(rerun.map, rerun.summary);
  PrintRevisits(rerun.revisits);
  for (const auto& [key, value] : metrics.items())
    std::printf("%s %s\n", key.c_str(), value.dump().c_str());
}

}  // namespace

void AddRegisterCommand(CLI::App& app) {
  auto* command = app.add_subcommand(
      "register",
      "Register one point cloud to another, and tell how sure the result is in which directions.\n"
      "Clouds are .pcd or .ply. Without --initial the search begins where the VIEWPOINTs of .pcd "
      "files put the clouds. Clouds that cannot be registered end the program with status 2.");
  const auto arguments = std::make_shared<RegisterArguments>();
  command->add_option("source", arguments->source, "cloud that is moved")->required();
  command->add_option("target", arguments->target, "cloud that stays")->required();
  command
      ->add_option("--initial", arguments->initial,
                   "X Y Z QX QY QZ QW: X_target_source to begin with")
      ->expected(7);
  AddConfigOptions(*command, arguments->config);
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments] { Run(*arguments); });
}

void AddSlamCommand(CLI::App& app) {
  auto* command = app.add_subcommand(
      "slam",
      "Run SLAM anew on a saved map: the same submaps and odometry, other settings. With --faults "
      "some registrations are made wrong, to see whether they are found.");
  const auto arguments = std::make_shared<SlamArguments>();
  FaultOptions& faults = arguments->faults;
  command->add_option("map", arguments->map, "map folder")->required();
  command->add_option("--out", arguments->out, "folder for the map at its new poses");
  command->add_option("--run", arguments->run,
                      "folder of the simulated run that the map is from: tells how good the new "
                      "poses are");
  AddConfigOptions(*command, arguments->config);
  command
      ->add_option("--faults", faults.share,
                   "share of registrations to make wrong, by 0.5-2 m or 10-60 deg")
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--fault-group", faults.group, "so many in a row are wrong in the same way")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--fault-seed", faults.seed, "of the faults")->capture_default_str();
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments] { Run(*arguments); });
}

}  // namespace vog
