#include "procs/sim/sim_node.h"

#include <algorithm>

#include "lib/bus/lcm_bus.h"
#include "lib/messages/convert.h"
#include "sim/scene/scene.h"

namespace vog {
namespace {

constexpr const char* kVersion = VOG_VERSION;
constexpr double kMaxLag_s = 0.2;

truth_t ToMessage(const TruthRecord& record) {
  truth_t message{};
  message.X_WB = vog::ToMessage(record.X_WB);
  std::copy_n(record.velocity_B_m_s.data(), 3, message.velocity_B_m_s);
  std::copy_n(record.current_W_m_s.data(), 3, message.current_W_m_s);
  return message;
}

template <class Message, class Record>
void PublishAll(Endpoint& endpoint, const Channel<Message>& channel,
                const std::vector<Record>& records) {
  for (const Record& record : records) endpoint.Publish(channel, ToMessage(record), record.time);
}

}  // namespace

SimSettings SimSettings::From(const Config& config) {
  SimSettings settings;
  settings.mission = config.Read<MissionOptions>("mission");
  settings.world = {config.Read<WorldOptions>("simulation"),
                    config.Read<VehicleOptions>("vehicle"),
                    config.Read<CurrentOptions>("current"),
                    config.Read<SonarOptions>("sonar"),
                    config.Read<SonarModelOptions>("sonar_model"),
                    config.Read<DriftOptions>("drift"),
                    config.Read<SensorOptions>("navigation_sensors"),
                    config.Read<NavigationFaultOptions>("navigation_faults"),
                    static_cast<std::uint64_t>(settings.mission.seed)};
  settings.scene_W = MakeScene(SceneSettings::From(config));
  settings.live = config.Read<LiveOptions>("live");
  settings.config_toml = config.ToToml();
  settings.run_id = config.Read<BusOptions>("bus").run_id;
  return settings;
}

SimNode::SimNode(Bus& bus, const SimSettings& settings)
    : settings_(settings),
      endpoint_(bus, "vog-sim", settings.run_id),
      world_(settings.world, settings.scene_W) {
  endpoint_.Subscribe(outputs::kVehicleCommand,
                      [this](Time, const control_t& message) { OnCommand(message); });
  endpoint_.ReportStatus(
      [this](auto& counters) {
        counters["vehicle_time_s"] = static_cast<std::int64_t>(ToSeconds(time_));
        return "ok";
      },
      [this] { return time_; });
}

void SimNode::PublishRun() {
  run_t run{};
  run.program_version = kVersion;
  run.config_toml = settings_.config_toml;
  run.seed = settings_.mission.seed;
  run.mode = NameOf(MissionModeNames(), settings_.mission.mode);
  endpoint_.Publish(inputs::kRun, run, Time{});
}

void SimNode::AdvanceTo(Time time) {
  if (time == Time{}) PublishRun();
  time_ = time;
  const Emissions emissions = world_.AdvanceTo(time);
  PublishAll(endpoint_, inputs::kTruth, emissions.truth);
  PublishAll(endpoint_, inputs::kVehicleNav, emissions.navigation);
  PublishAll(endpoint_, inputs::kDvl, emissions.dvl);
  PublishAll(endpoint_, inputs::kDepth, emissions.depth);
  PublishAll(endpoint_, inputs::kImu, emissions.imu);
  PublishAll(endpoint_, inputs::kSonarReturns, emissions.sonar_returns);
  PublishAll(endpoint_, inputs::kSonarFrame, emissions.sonar_frames);
}

void SimNode::OnCommand(const control_t& message) {
  const auto command = FromMessage(message);
  if (!command) {
    endpoint_.NoteMalformed();
    return;
  }
  world_.SetCommand(*command);
  commanded_ = TimeOf(message.header);
}

LivePacer::LivePacer(Bus& bus, SimNode& sim, const LiveOptions& options)
    : sim_(sim), options_(options) {
  bus.Every(std::chrono::milliseconds(1), [this](Time now) { OnTick(now); });
}

void LivePacer::OnTick(Time now) {
  if (!anchor_) {
    anchor_ = advanced_ = now;
    sim_.AdvanceTo(Time{});
  }
  const Time next = sim_.next_due();
  const double lag_s = options_.speed * ToSeconds(now - *anchor_) - ToSeconds(next - anchor_sim_);
  if (lag_s < 0) return;
  if (next - sim_.commanded() <= FromSeconds(options_.max_ahead_s)) {
    is_stalled_ = false;
  } else {
    const Duration wait = is_stalled_ ? next - sim_.time() : FromSeconds(options_.stall_s);
    if (now - advanced_ < wait) return;
    is_stalled_ = true;
  }
  if (lag_s > options_.speed * kMaxLag_s) {  // Time that was waited away is not made up for.
    anchor_ = now;
    anchor_sim_ = next;
  }
  advanced_ = now;
  sim_.AdvanceTo(next);
}

}  // namespace vog
