#include "procs/sim/sim_node.h"

#include <algorithm>

#include "lib/base/errors.h"
#include "lib/bus/lcm_bus.h"
#include "lib/messages/convert.h"
#include "sim/scene/scene.h"

namespace vog {
namespace {

constexpr const char* kVersion = VOG_VERSION;
constexpr double kMaxLag_s = 0.2;
constexpr Duration kRunPeriod = std::chrono::seconds(10);

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
                    0};
  settings.world.seed = NoiseSeed(static_cast<std::uint64_t>(settings.mission.seed),
                                  settings.world.simulation.start());
  settings.scene_W = MakeScene(SceneSettings::From(config));
  settings.live = config.Read<LiveOptions>("live");
  settings.vehicle_link = config.Read<VehicleLinkOptions>("sim_vehicle_link");
  settings.sonar_link = config.Read<SonarLinkOptions>("sim_sonar_link");
  settings.pressure = config.Read<PressureOptions>("pressure");
  settings.config_toml = config.ToToml();
  settings.run_id = config.Read<BusOptions>("bus").run_id;
  return settings;
}

SimWires SimWires::Open(const SimSettings& settings) {
  SimWires wires;
  if (!settings.vehicle_link.url.empty())
    wires.front_seat = OpenFrontSeat(settings.vehicle_link, settings.pressure);
  if (settings.sonar_link.url.empty()) return wires;
  if (settings.world.sonar_model.emits != SonarOutput::kFrames)
    throw UsageError(
        "sim_sonar_link: only frames go over a wire: sonar_model.emits must be frames");
  wires.sonar_head = std::make_unique<SonarHead>(settings.sonar_link);
  return wires;
}

SimNode::SimNode(Bus& bus, const SimSettings& settings, SimWires wires)
    : settings_(settings),
      wires_(std::move(wires)),
      endpoint_(bus, "vog-sim", settings.run_id),
      world_(settings.world, settings.scene_W),
      time_(settings.world.simulation.start()),
      commanded_(time_) {
  endpoint_.Subscribe(outputs::kVehicleCommand,
                      [this](Time, const control_t& message) { OnCommand(message); });
  endpoint_.ReportStatus(
      [this](auto& counters) {
        counters["vehicle_time_s"] = static_cast<std::int64_t>(ToSeconds(time_));
        if (wires_.front_seat) wires_.front_seat->Count(counters);
        if (wires_.sonar_head) counters["sonar_dropped"] = wires_.sonar_head->dropped();
        return "ok";
      },
      [this] { return time_; });
}

void SimNode::PublishRunIfDue() {
  if (time_ < run_due_) return;
  run_due_ = time_ + kRunPeriod;
  run_t run{};
  run.program_version = kVersion;
  run.config_toml = settings_.config_toml;
  run.seed = settings_.mission.seed;
  run.mode = NameOf(MissionModeNames(), settings_.mission.mode);
  endpoint_.Publish(inputs::kRun, run, time_);
}

void SimNode::AdvanceTo(Time time) {
  time_ = time;
  PublishRunIfDue();
  const Emissions emissions = world_.AdvanceTo(time);
  PublishAll(endpoint_, inputs::kTruth, emissions.truth);
  TellNavigation(emissions);
  TellSonar(emissions);
}

void SimNode::TellNavigation(const Emissions& emissions) {
  if (wires_.front_seat) {
    wires_.front_seat->Tell(emissions);
    return;
  }
  PublishAll(endpoint_, inputs::kVehicleNav, emissions.navigation);
  PublishAll(endpoint_, inputs::kDvl, emissions.dvl);
  PublishAll(endpoint_, inputs::kDepth, emissions.depth);
  PublishAll(endpoint_, inputs::kImu, emissions.imu);
}

void SimNode::TellSonar(const Emissions& emissions) {
  if (wires_.sonar_head) {
    wires_.sonar_head->Tell(emissions.sonar_frames);
    return;
  }
  PublishAll(endpoint_, inputs::kSonarReturns, emissions.sonar_returns);
  PublishAll(endpoint_, inputs::kSonarFrame, emissions.sonar_frames);
}

void SimNode::StepWires() {
  const Time steady = since_start_.time();
  if (wires_.sonar_head) wires_.sonar_head->Step(steady);
  if (!wires_.front_seat) return;
  if (const auto command = wires_.front_seat->Step(steady)) {
    world_.SetCommand(command->velocities);
    commanded_ = command->answered;
  }
}

void SimNode::OnCommand(const control_t& message) {
  if (wires_.front_seat) return;  // It comes over the wire.
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
  sim_.StepWires();
  if (!anchor_) {
    anchor_ = advanced_ = now;
    anchor_sim_ = sim_.time();
    sim_.AdvanceTo(anchor_sim_);
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
