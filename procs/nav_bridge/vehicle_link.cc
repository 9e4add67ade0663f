#include "procs/nav_bridge/vehicle_link.h"

#include <array>
#include <optional>

#include "hardware/link/open_link.h"
#include "hardware/nav_payload/bluefin_records.h"
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

void CountLink(const Link& link, std::map<std::string, std::int64_t>& counters) {
  const LinkCounters& counted = link.counters();
  counters["link_reconnects"] = counted.reconnects;
  counters["link_dropped"] = counted.dropped;
  counters["link_errors"] = counted.errors;
  counters["link_stalls"] = counted.stalls;
}

/// Speaks vogmap.dbc.
class CanVehicle final : public VehicleLink {
 public:
  explicit CanVehicle(std::unique_ptr<CanLink> link) : link_(std::move(link)) {}

  std::vector<NavigationRecord> Step(Time steady, Time) override {
    link_->Step(steady);
    if (heartbeat_.IsDue(steady)) Write(PayloadHeartbeat{{{}, ToSeconds(steady), true}});
    std::vector<NavigationRecord> records;
    for (CanRead read = link_->Read(); read.outcome == ReadOutcome::kData; read = link_->Read()) {
      if (read.frame.error) continue;  // The link counts them.
      if (const auto record = reader_.Add(read.frame)) Take(*record, records);
    }
    return records;
  }

  void Send(const VelocityCommand& command, Time answered) override {
    Write(CanVelocityCommand{answered, command});
  }

  void Count(std::map<std::string, std::int64_t>& counters) const override {
    CountLink(*link_, counters);
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
  BluefinVehicle(std::unique_ptr<ByteLink> link, const PressureOptions& pressure)
      : link_(std::move(link)), pressure_(pressure) {}

  std::vector<NavigationRecord> Step(Time steady, Time now) override {
    link_->Step(steady);
    LogOn(steady);
    if (!clock_) clock_.emplace(now);
    std::vector<NavigationRecord> records;
    std::array<std::uint8_t, 4096> buffer{};
    for (ByteRead read = link_->Read(buffer); read.outcome == ReadOutcome::kData;
         read = link_->Read(buffer)) {
      for (const std::string& line : lines_.Add({buffer.data(), read.size})) Hear(line, records);
    }
    return records;
  }

  void Send(const VelocityCommand& command, Time answered) override {
    if (!newest_) return;
    const Pose3 X_OT = newest_->X_OB * MakePose(kBluefinLookahead_s * command.velocity_B_m_s);
    const Vec3 p_NED = SwapNedEnu(X_OT.translation());
    const Duration time = TimeOfDay(answered);
    Write(GbpSentence{time, p_NED.x(), p_NED.y(), true, p_NED.z()});
    Write(RboSentence{time, -kBluefinLookahead_s * command.yaw_rate_rad_s});
  }

  void Count(std::map<std::string, std::int64_t>& counters) const override {
    CountLink(*link_, counters);
    counters["rejected_sentences"] = rejected_;
    counters["garbage_bytes"] = lines_.garbage_bytes();
  }

 private:
  /// Asks for everything until something comes, and again when the line was opened again.
  void LogOn(Time steady) {
    if (heartbeat_.IsDue(steady)) Write(StsSentence{TimeOfDay(newest_time_), true, "vogmap"});
    if (link_->counters().reconnects != reconnects_) {
      reconnects_ = link_->counters().reconnects;
      has_heard_ = false;
    }
    if (has_heard_ || !log_on_.IsDue(steady)) return;
    for (const char* wanted : {"ACK", "ALL"}) Write(LogSentence{wanted, true});
  }

  void Hear(const std::string& line, std::vector<NavigationRecord>& records) {
    const auto parsed = ParseSentence(line);
    if (const auto* sentence = std::get_if<Sentence>(&parsed)) {
      has_heard_ = true;
      std::visit([&](const auto& heard) { Take(heard, records); }, *sentence);
    } else {
      rejected_ += std::get<SentenceError>(parsed) != SentenceError::kUnknownId;
    }
  }

  Time Dated(Duration time_of_day) { return newest_time_ = clock_->ToTime(time_of_day); }

  template <class Other>
  void Take(const Other&, std::vector<NavigationRecord>&) {}
  void Take(const NvrSentence& nvr, std::vector<NavigationRecord>&) { nav_.nvr = nvr; }
  void Take(const RcmSentence& rcm, std::vector<NavigationRecord>&) { attitude_ = AttitudeOf(rcm); }
  void Take(const RnvSentence& rnv, std::vector<NavigationRecord>&) {
    nav_.rnv = rnv;
    if (rnv.absolute) attitude_ = AttitudeOf(*rnv.absolute);
  }
  void Take(const CnvSentence& cnv, std::vector<NavigationRecord>& records) {
    nav_.cnv = cnv;
    const auto record = ToVehicleNavRecord(nav_, /*origin=*/0, sequence_);
    if (!record) return;
    ++sequence_;
    newest_ = record;
    records.emplace_back(*record);
  }
  void Take(const DvlSentence& dvl, std::vector<NavigationRecord>& records) {
    records.emplace_back(ToDvlRecord(dvl, Dated(dvl.time), sequence_++));
  }
  void Take(const ImuSentence& imu, std::vector<NavigationRecord>& records) {
    if (attitude_) records.emplace_back(ToImuRecord(imu, *attitude_, Dated(imu.time), sequence_++));
  }
  void Take(const RdpSentence& rdp, std::vector<NavigationRecord>& records) {
    records.emplace_back(ToDepthRecord(rdp, pressure_, Dated(rdp.time), sequence_++));
  }

  void Write(const Sentence& sentence) {
    const std::string line = FormatSentence(sentence);
    link_->Write({reinterpret_cast<const std::uint8_t*>(line.data()), line.size()});
  }

  std::unique_ptr<ByteLink> link_;
  PressureOptions pressure_;
  LineSplitter lines_;
  std::optional<TimeOfDayClock> clock_;
  VehicleNavSentences nav_;
  std::optional<NedAttitude> attitude_;
  std::optional<VehicleNavRecord> newest_;
  Time newest_time_;
  std::int64_t sequence_ = 0, rejected_ = 0, reconnects_ = 0;
  bool has_heard_ = false;
  Periodic heartbeat_{kHeartbeatPeriod}, log_on_{kLogOnPeriod};
};

}  // namespace

std::unique_ptr<VehicleLink> MakeCanVehicle(std::unique_ptr<CanLink> link) {
  return std::make_unique<CanVehicle>(std::move(link));
}

std::unique_ptr<VehicleLink> MakeBluefinVehicle(std::unique_ptr<ByteLink> link,
                                                const PressureOptions& pressure) {
  return std::make_unique<BluefinVehicle>(std::move(link), pressure);
}

std::unique_ptr<VehicleLink> OpenVehicleLink(const VehicleLinkOptions& options,
                                             const PressureOptions& pressure) {
  if (options.protocol == VehicleProtocol::kCan) return MakeCanVehicle(OpenCanLink({options.url}));
  return MakeBluefinVehicle(OpenByteLink({options.url}), pressure);
}

}  // namespace vog
