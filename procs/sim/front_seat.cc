#include "procs/sim/front_seat.h"

#include <array>
#include <cmath>

#include "hardware/link/open_link.h"
#include "hardware/nav_payload/bluefin_records.h"
#include "hardware/nav_payload/can_records.h"
#include "hardware/nav_payload/line_splitter.h"
#include "hardware/nav_payload/time_of_day.h"

namespace vog {
namespace {

/// Speaks vogmap.dbc.
class CanFrontSeat final : public FrontSeat {
 public:
  explicit CanFrontSeat(std::unique_ptr<CanLink> link) : link_(std::move(link)) {}

  void Tell(const Emissions& emissions) override {
    for (const auto& record : emissions.navigation) Write(record);
    for (const auto& record : emissions.dvl) Write(CanDvl{record, {}});
    for (const auto& record : emissions.depth) Write(record);
    for (const auto& record : emissions.imu) Write(record);
  }

  std::optional<Command> Step(Time steady) override {
    link_->Step(steady);
    std::optional<Command> newest;
    for (CanRead read = link_->Read(); read.outcome == ReadOutcome::kData; read = link_->Read()) {
      const auto record = reader_.Add(read.frame);
      if (!record) continue;
      if (const auto* command = std::get_if<CanVelocityCommand>(&*record))
        newest = Command{command->command, command->time};
    }
    return newest;
  }

  void Count(std::map<std::string, std::int64_t>& counters) const override {
    CountLink(*link_, counters);
    counters["rejected_frames"] = reader_.rejected_frames();
    counters["lost_commands"] = reader_.lost_records();
  }

 private:
  void Write(const CanRecord& record) {
    for (const CanFrame& frame : writer_.Write(record)) link_->Write(frame);
  }

  std::unique_ptr<CanLink> link_;
  CanRecordReader reader_;
  CanRecordWriter writer_;
};

/// Speaks Bluefin's sentences. Goes to where it is told to be (GBP), as fast as brings it there a
/// moment later, and turns as it is told (RBO).
class BluefinFrontSeat final : public FrontSeat {
 public:
  BluefinFrontSeat(std::unique_ptr<ByteLink> link, const PressureOptions& pressure)
      : link_(std::move(link)), pressure_(pressure) {}

  void Tell(const Emissions& emissions) override {
    for (const VehicleNavRecord& record : emissions.navigation) {
      const VehicleNavSentences sentences = ToVehicleNavSentences(record);
      Write(sentences.nvr);
      Write(sentences.rnv);
      Write(sentences.cnv);
      newest_ = record;
    }
    for (const DvlRecord& record : emissions.dvl) Write(ToDvlSentence(record));
    for (const DepthRecord& record : emissions.depth) Write(ToRdpSentence(record, pressure_));
    for (const ImuRecord& record : emissions.imu) {
      const NedAttitude attitude = ToNed({record.roll_rad, record.pitch_rad, 0});
      const Duration time = TimeOfDay(record.time);
      Write(
          RcmSentence{time, 1, attitude.heading_rad, attitude.pitch_rad, attitude.roll_rad, time});
      Write(ToImuSentence(record));
    }
  }

  std::optional<Command> Step(Time steady) override {
    link_->Step(steady);
    std::optional<Command> newest;
    std::array<std::uint8_t, 4096> buffer{};
    for (ByteRead read = link_->Read(buffer); read.outcome == ReadOutcome::kData;
         read = link_->Read(buffer)) {
      for (const std::string& line : lines_.Add({buffer.data(), read.size}))
        if (const auto command = Hear(line)) newest = command;
    }
    return newest;
  }

  void Count(std::map<std::string, std::int64_t>& counters) const override {
    CountLink(*link_, counters);
    counters["rejected_sentences"] = rejected_;
  }

 private:
  std::optional<Command> Hear(const std::string& line) {
    const auto parsed = ParseSentence(line);
    const auto* sentence = std::get_if<Sentence>(&parsed);
    if (sentence == nullptr) {
      ++rejected_;
      return std::nullopt;
    }
    if (const auto* log_on = std::get_if<LogSentence>(sentence)) {
      AckSentence ack;
      ack.command = log_on->kId;
      ack.status = 2;
      ack.description = log_on->wanted;
      Write(ack);
    }
    if (const auto* place = std::get_if<GbpSentence>(sentence)) place_ = *place;
    const auto* turn = std::get_if<RboSentence>(sentence);
    if (turn == nullptr || !place_ || place_->time != turn->time || !newest_) return std::nullopt;
    return Towards(*place_, *turn);
  }

  Command Towards(const GbpSentence& place, const RboSentence& turn) const {
    const Vec3 p_OT = SwapNedEnu({place.x_m, place.y_m, place.depth_or_altitude_m});
    Command command;
    command.velocities.velocity_B_m_s = newest_->X_OB.inverse() * p_OT / kBluefinLookahead_s;
    command.velocities.yaw_rate_rad_s = -turn.offset_rad / kBluefinLookahead_s;
    // The newest such time of day that is not to come.
    const Duration day = std::chrono::hours(24);
    command.answered = newest_->time - (TimeOfDay(newest_->time) - turn.time + day) % day;
    return command;
  }

  void Write(const Sentence& sentence) {
    const std::string line = FormatSentence(sentence);
    link_->Write({reinterpret_cast<const std::uint8_t*>(line.data()), line.size()});
  }

  std::unique_ptr<ByteLink> link_;
  PressureOptions pressure_;
  LineSplitter lines_;
  std::optional<VehicleNavRecord> newest_;
  std::optional<GbpSentence> place_;
  std::int64_t rejected_ = 0;
};

}  // namespace

std::unique_ptr<FrontSeat> MakeCanFrontSeat(std::unique_ptr<CanLink> link) {
  return std::make_unique<CanFrontSeat>(std::move(link));
}

std::unique_ptr<FrontSeat> MakeBluefinFrontSeat(std::unique_ptr<ByteLink> link,
                                                const PressureOptions& pressure) {
  return std::make_unique<BluefinFrontSeat>(std::move(link), pressure);
}

std::unique_ptr<FrontSeat> OpenFrontSeat(const VehicleLinkOptions& options,
                                         const PressureOptions& pressure) {
  if (options.protocol == VehicleProtocol::kCan)
    return MakeCanFrontSeat(OpenCanLink({options.url}));
  return MakeBluefinFrontSeat(OpenByteLink({options.url}), pressure);
}

}  // namespace vog
