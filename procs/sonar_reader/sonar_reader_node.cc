#include "procs/sonar_reader/sonar_reader_node.h"

#include <utility>

#include "lib/bus/lcm_bus.h"
#include "lib/messages/convert.h"
#include "procs/sonar_reader/hauv_messages.h"

namespace vog {
namespace {

constexpr Duration kLinkPeriod = std::chrono::milliseconds(5);
constexpr std::size_t kLargestDatagram_bytes = 65536;
constexpr const char* kHauvFrame = "HAUV_DIDSON_FRAME";

}  // namespace

SonarReaderSettings SonarReaderSettings::From(const Config& config) {
  SonarReaderSettings settings{
      config.Read<SonarOptions>("sonar"), config.Read<RangeDetectorOptions>("range_detector"),
      config.Read<SonarLinkOptions>("sonar_link"), config.Read<BusOptions>("bus").run_id};
  settings.sonar.Validate();
  return settings;
}

SonarReaderNode::SonarReaderNode(Bus& bus, const SonarReaderSettings& settings,
                                 std::unique_ptr<ByteLink> link)
    : settings_(settings),
      bearings_rad_(BeamBearings(settings.sonar)),
      endpoint_(bus, "vog-sonar-reader", settings.run_id),
      link_(std::move(link)),
      datagram_(kLargestDatagram_bytes) {
  endpoint_.Subscribe(inputs::kSonarReturns,
                      [this](Time, const sonar_returns_t& message) { OnReturns(message); });
  endpoint_.Subscribe(inputs::kSonarFrame,
                      [this](Time, const sonar_frame_t& message) { OnFrame(message); });
  endpoint_.ReportStatus([this](auto& counters) {
    counters["other_beams"] = other_beams_;
    counters["other_windows"] = other_windows_;
    if (link_) CountLink(counters);
    if (other_beams_ > 0) return "the sonar has another number of beams than sonar.beams";
    return std::exchange(has_told_scan_, false) ? "ok" : "no sonar";
  });
  bus.Subscribe(kHauvFrame, [this](Time, Bytes bytes) { OnHauvFrame(bytes); });
  if (link_) bus.Every(kLinkPeriod, [this](Time) { StepLink(); });
}

void SonarReaderNode::StepLink() {
  link_->Step(since_start_.time());
  for (ByteRead read = link_->Read(datagram_); read.outcome == ReadOutcome::kData;
       read = link_->Read(datagram_)) {
    const auto whole = stream_.Add({datagram_.data(), read.size});
    if (whole) Tell(ToSonarFrame(*whole));
  }
}

void SonarReaderNode::OnHauvFrame(Bytes bytes) {
  const auto message = std::make_unique<hauv::didson_t>();  // 50 KB, not for the stack.
  if (Decode(bytes, *message)) {
    Tell(FromMessage(*message));
  } else {
    endpoint_.NoteMalformed();
  }
}

void SonarReaderNode::Tell(const std::optional<SonarFrame>& frame) {
  if (frame) {
    endpoint_.Publish(inputs::kSonarFrame, ToMessage(*frame), frame->time);
  } else {
    ++other_windows_;
  }
}

void SonarReaderNode::CountLink(std::map<std::string, std::int64_t>& counters) const {
  const DidsonStream::Counters& counted = stream_.counters();
  counters["link_dropped"] = link_->counters().dropped;
  counters["frames"] = counted.frames;
  counters["frames_incomplete"] = counted.incomplete;
  counters["datagrams_lost"] = counted.lost;
  counters["datagrams_twice"] = counted.duplicated;
  counters["datagrams_malformed"] = counted.malformed;
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
  has_told_scan_ = true;
}

}  // namespace vog
