#include "procs/nav_bridge/vehicle_link.h"

#include <array>
#include <optional>

#include "hardware/link/open_link.h"
#include "hardware/nav_payload/can_records.h"
#include "hardware/nav_payload/line_splitter.h"
#include "hardware/nav_payload/time_of_day.h"

namespace vog {
namespace {

constexpr Duration kHeartbeatPeriod = std::chrono::seconds(1);
constexpr Duration kLogOnPeriod = std::chrono::seconds(5);

/// Tells when something is due that is done every period.
class Periodic {
 public:
  explicit Periodic(Duration period) : period_(period) {}
  bool IsDue(Time now) {
    if (last_ && now - *last_ < period_) return false;
    last_ = now;
    return true;
  }

 private:
  Duration period_;
  std::optional<Time> last_;
};

/// Speaks vogmap.dbc.
class CanVehicle final : public VehicleLink {
 public:
  explicit CanVehicle(std::unique_ptr<CanLink> link) : link_(std::move(link)) {}

  std::vector<NavigationRecord> Step(Time steady, Time) override {
    link_->Step(steady);
    if (heartbeat_.IsDue(steady)) Write(PayloadHeartbeat{{{}, ToSeconds(steady), true}});
    std::vector<NavigationRecord> records;
    for (CanRead read = link_->Read(); read.outcome == ReadOutcome::kData; read = link_->Read()) {
      if (const auto record = reader_.Add(read.frame)) Take(*record, records);
    }
    return records;
  }

  void Send(const VelocityCommand& command, Time answered) override {
    Write(CanVelocityCommand{answered, command});
  }

  void Count(std::map<std::string, std::int64_t>& counters) const override {
    CountLink(*link_, counters);
    counters["link_stalls"] = link_->counters().stalls;
    counters["rejected_frames"] = reader_.rejected_frames();
    counters["stray_frames"] = reader_.stray_frames();
    counters["lost_records"] = reader_.lost_records();
  }

 private:
  void Write(const CanRecord& record) {
    for (const CanFrame& frame : writer_.Write(record)) link_->Write(frame);
  }

  static void Take(const CanRecord& record, std::vector<NavigationRecord>& records) {
    if (const auto* dvl = std::get_if<CanDvl>(&record)) records.emplace_back(dvl->record);
    if (const auto* imu = std::get_if<ImuRecord>(&record)) records.emplace_back(*imu);
    if (const auto* depth = std::get_if<DepthRecord>(&record)) records.emplace_back(*depth);
    if (const auto* nav = std::get_if<VehicleNavRecord>(&record)) records.emplace_back(*nav);
  }

  std::unique_ptr<CanLink> link_;
  CanRecordReader reader_;
  CanRecordWriter writer_;
  Periodic heartbeat_{kHeartbeatPeriod};
};

/// Speaks Bluefin's sentences. The front seat has no command for velocities: it is told where to
/// be a moment later (GBP) and how far to turn until then (RBO), each time anew.
class BluefinVehicle final : public VehicleLink {
 public:
  BluefinVehicle(std::unique_ptr<ByteLink> link, const BluefinReader& reader)
      : link_(std::move(link)), reader_(reader) {}

  std::vector<NavigationRecord> Step(Time steady, Time now) override {
    link_->Step(steady);
    LogOn(steady, now);
    std::vector<NavigationRecord> records;
    std::array<std::uint8_t, 4096> buffer{};
    for (ByteRead read = link_->Read(buffer); read.outcome == ReadOutcome::kData;
         read = link_->Read(buffer)) {
      for (const std::string& line : lines_.Add({buffer.data(), read.size}))
        if (const auto record = Hear(line, now)) records.push_back(*record);
    }
    return records;
  }

  void Send(const VelocityCommand& command, Time answered) override {
    if (!reader_.newest()) return;
    const Pose3 X_OT =
        reader_.newest()->X_OB * MakePose(kBluefinLookahead_s * command.velocity_B_m_s);
    const Vec3 p_NED = SwapNedEnu(X_OT.translation());
    const Duration time = TimeOfDay(answered);
    Write(GbpSentence{time, p_NED.x(), p_NED.y(), true, p_NED.z()});
    Write(RboSentence{time, -kBluefinLookahead_s * command.yaw_rate_rad_s});
  }

  void Count(std::map<std::string, std::int64_t>& counters) const override {
    CountLink(*link_, counters);
    counters["link_stalls"] = link_->counters().stalls;
    counters["rejected_sentences"] = rejected_;
    counters["garbage_bytes"] = lines_.garbage_bytes();
  }

 private:
  /// Asks for everything until something comes, and again when the line was opened again.
  void LogOn(Time steady, Time now) {
    if (heartbeat_.IsDue(steady)) Write(StsSentence{TimeOfDay(now), true, "vogmap"});
    if (link_->counters().reconnects != reconnects_) {
      reconnects_ = link_->counters().reconnects;
      has_heard_ = false;
    }
    if (has_heard_ || !log_on_.IsDue(steady)) return;
    for (const char* wanted : {"ACK", "ALL"}) Write(LogSentence{wanted, true});
  }

  std::optional<NavigationRecord> Hear(const std::string& line, Time now) {
    const auto parsed = ParseSentence(line);
    if (const auto* sentence = std::get_if<Sentence>(&parsed)) {
      has_heard_ = true;
      return reader_.Add(*sentence, now);
    }
    rejected_ += std::get<SentenceError>(parsed) != SentenceError::kUnknownId;
    return std::nullopt;
  }

  void Write(const Sentence& sentence) {
    const std::string line = FormatSentence(sentence);
    link_->Write({reinterpret_cast<const std::uint8_t*>(line.data()), line.size()});
  }

  std::unique_ptr<ByteLink> link_;
  BluefinReader reader_;
  LineSplitter lines_;
  std::int64_t rejected_ = 0, reconnects_ = 0;
  bool has_heard_ = false;
  Periodic heartbeat_{kHeartbeatPeriod}, log_on_{kLogOnPeriod};
};

}  // namespace

std::unique_ptr<VehicleLink> MakeCanVehicle(std::unique_ptr<CanLink> link) {
  return std::make_unique<CanVehicle>(std::move(link));
}

std::unique_ptr<VehicleLink> MakeBluefinVehicle(std::unique_ptr<ByteLink> link,
                                                const BluefinReader& reader) {
  return std::make_unique<BluefinVehicle>(std::move(link), reader);
}

std::unique_ptr<VehicleLink> OpenVehicleLink(const VehicleLinkOptions& options,
                                             const BluefinReader& reader) {
  if (options.protocol == VehicleProtocol::kCan) return MakeCanVehicle(OpenCanLink({options.url}));
  return MakeBluefinVehicle(OpenByteLink({options.url}), reader);
}

}  // namespace vog
