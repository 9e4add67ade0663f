#include "procs/sonar_reader/sonar_reader_node.h"

#include "lib/bus/lcm_bus.h"
#include "lib/messages/convert.h"

namespace vog {

SonarReaderSettings SonarReaderSettings::From(const Config& config) {
  SonarReaderSettings settings{config.Read<SonarOptions>("sonar"),
                               config.Read<RangeDetectorOptions>("range_detector"),
                               config.Read<BusOptions>("bus").run_id};
  settings.sonar.Validate();
  return settings;
}

SonarReaderNode::SonarReaderNode(Bus& bus, const SonarReaderSettings& settings)
    : settings_(settings),
      bearings_rad_(BeamBearings(settings.sonar)),
      endpoint_(bus, "vog-sonar-reader", settings.run_id) {
  endpoint_.Subscribe(inputs::kSonarReturns,
                      [this](Time, const sonar_returns_t& message) { OnReturns(message); });
  endpoint_.Subscribe(inputs::kSonarFrame,
                      [this](Time, const sonar_frame_t& message) { OnFrame(message); });
  endpoint_.ReportStatus([this](auto& counters) {
    counters["other_beams"] = other_beams_;
    return other_beams_ == 0 ? "ok" : "the sonar has another number of beams than sonar.beams";
  });
}

void SonarReaderNode::OnReturns(const sonar_returns_t& message) {
  const auto returns = FromMessage(message);
  if (!returns) {
    endpoint_.NoteMalformed();
    return;
  }
  if (returns->range_m.size() != bearings_rad_.size()) {
    ++other_beams_;
    return;
  }
  Scan scan{
      returns->time,        returns->sequence,    SonarPose(settings_.sonar, returns->tilt_rad),
      returns->min_range_m, returns->max_range_m, {}};
  for (std::size_t i = 0; i < bearings_rad_.size(); ++i) {
    const float range_m = returns->range_m[i];
    const bool has_echo = range_m >= returns->min_range_m && range_m <= returns->max_range_m;
    scan.beams.push_back({static_cast<float>(bearings_rad_[i]), has_echo ? range_m : 0,
                          returns->strength[i],
                          has_echo ? BeamStatus::kReturn : BeamStatus::kUncertain});
  }
  ClassifySilentBeams(settings_.range_detector.guard_beams, scan.beams);
  PublishScan(scan);
}

void SonarReaderNode::OnFrame(const sonar_frame_t& message) {
  const auto frame = FromMessage(message);
  if (!frame) {
    endpoint_.NoteMalformed();
    return;
  }
  if (frame->beams != static_cast<int>(bearings_rad_.size())) {
    ++other_beams_;
    return;
  }
  PublishScan({frame->time, frame->sequence, SonarPose(settings_.sonar, frame->tilt_rad),
               frame->min_range_m, frame->max_range_m,
               DetectRanges(settings_.range_detector, *frame, bearings_rad_)});
}

void SonarReaderNode::PublishScan(const Scan& scan) {
  endpoint_.Publish(outputs::kScan, ToMessage(scan), scan.time);
}

}  // namespace vog
