#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "hardware/nav_payload/sentence_fields.h"

namespace vog {

/// The sentences of the vehicle's front seat: Bluefin's "Standard Payload Interface", lines of text
/// over TCP; $BF... from the vehicle, $BP... to it. Angles in radians, else SI. Frames are the
/// vehicle's own: x forward, y starboard, z down (FRD); north, east, down; roll is positive with
/// starboard down, pitch with the bow up, heading from north to east. bluefin_records.h turns them.
///
/// Empty fields stand for what the instrument does not know, most often for want of bottom lock.

/// Navigation fix.
struct NvgSentence {
  static constexpr std::string_view kId = "BFNVG";
  Duration time{};
  std::optional<double> latitude_rad, longitude_rad;  ///< North and east positive.
  int quality = 0;                                    ///< 1: GPS.
  std::optional<double> altitude_m, depth_m;
  double heading_rad = 0, roll_rad = 0, pitch_rad = 0;
  Duration time_computed{};

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Geographic(latitude_rad, 2, "N", "S");
    f.Geographic(longitude_rad, 3, "E", "W");
    f.Integer(quality);
    f.Number(altitude_m);
    f.Number(depth_m);
    f.Degrees(heading_rad);
    f.Degrees(roll_rad);
    f.Degrees(pitch_rad);
    f.TimeOfDay(time_computed);
  }
};

/// Rates of the fix: of position along east, north and down, of the three angles.
struct NvrSentence {
  static constexpr std::string_view kId = "BFNVR";
  Duration time{};
  double east_m_s = 0, north_m_s = 0, down_m_s = 0;
  double pitch_rate_rad_s = 0, roll_rate_rad_s = 0, yaw_rate_rad_s = 0;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    for (double* speed : {&east_m_s, &north_m_s, &down_m_s}) f.Number(*speed, 4);
    for (double* rate : {&pitch_rate_rad_s, &roll_rate_rad_s, &yaw_rate_rad_s}) f.Degrees(*rate);
  }
};

/// Raw compass.
struct RcmSentence {
  static constexpr std::string_view kId = "BFRCM";
  Duration time{};
  int compass = 0;
  double heading_rad = 0, pitch_rad = 0, roll_rad = 0;
  Duration time_measured{};

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Integer(compass);
    f.Degrees(heading_rad);
    f.Degrees(pitch_rad);
    f.Degrees(roll_rad);
    f.TimeOfDay(time_measured);
  }
};

/// Raw pressure. No public source says its unit: PressureOptions (pressure.h) does.
struct RdpSentence {
  static constexpr std::string_view kId = "BFRDP";
  Duration time{};
  double pressure = 0;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Number(pressure, 5);
  }
};

/// The thruster's speed and the vehicle's.
struct RvlSentence {
  static constexpr std::string_view kId = "BFRVL";
  Duration time{};
  double thruster_rpm = 0, speed_m_s = 0;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Number(thruster_rpm);
    f.Number(speed_m_s);
  }
};

/// Inertial unit: rates about and accelerations along x, y, z of FRD.
struct ImuSentence {
  static constexpr std::string_view kId = "BFIMU";
  Duration time{};
  std::array<double, 3> rate_rad_s{}, acceleration_m_s2{};
  Duration time_measured{};

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    for (double& rate : rate_rad_s) f.Degrees(rate, 5);
    for (double& acceleration : acceleration_m_s2) f.Number(acceleration, 5);
    f.TimeOfDay(time_measured);
  }
};

/// What the Doppler log says, in so many velocities. `range_m` as the log has it: without the
/// slant's 1/cos.
template <std::size_t kVelocities>
struct DopplerSentence {
  Duration time{};
  std::array<std::optional<double>, kVelocities> velocity_m_s;
  std::array<std::optional<double>, 4> range_m;
  std::optional<double> temperature_degc;
  Duration time_measured{};

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    for (auto& velocity : velocity_m_s) f.Number(velocity);
    for (auto& range : range_m) f.Number(range);
    f.Number(temperature_degc);
    f.TimeOfDay(time_measured);
  }
};

/// Doppler log, along x, y, z of FRD.
struct DvlSentence : DopplerSentence<3> {
  static constexpr std::string_view kId = "BFDVL";
};

/// Doppler log, along its four beams.
struct Dv2Sentence : DopplerSentence<4> {
  static constexpr std::string_view kId = "BFDV2";
};

/// Battery: of the whole and of its weakest and strongest cell.
struct RbsSentence {
  static constexpr std::string_view kId = "BFRBS";
  Duration time{};
  int battery = 0;
  double voltage_v = 0, min_cell_v = 0, max_cell_v = 0;
  std::optional<double> temperature_degc;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Integer(battery);
    for (double* voltage : {&voltage_v, &min_cell_v, &max_cell_v}) f.Number(*voltage);
    f.Number(temperature_degc, 1);
  }
};

/// What RNV says more since version 1.4 of the interface.
struct RnvAbsolute {
  double depth_m = 0, heading_rad = 0, roll_rad = 0, pitch_rad = 0;
  Time time_nav;

  void Visit(SentenceFields& f) {
    f.Number(depth_m, 4);
    f.Degrees(heading_rad);
    f.Degrees(roll_rad);
    f.Degrees(pitch_rad);
    f.UnixSeconds(time_nav);
  }
};

/// Navigation relative to the hull.
struct RnvSentence {
  static constexpr std::string_view kId = "BFRNV";
  Duration time{};
  double horizontal_m = 0, vertical_m = 0, distance_m = 0, heading_rad = 0;
  std::optional<RnvAbsolute> absolute;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    for (double* length : {&horizontal_m, &vertical_m, &distance_m}) f.Number(*length);
    f.Degrees(heading_rad);
    f.Newer(absolute);
  }
};

/// The vehicle's reckoning: north, east and down of where it began.
struct CnvSentence {
  static constexpr std::string_view kId = "BFCNV";
  Time time_nav;
  double x_m = 0, y_m = 0, z_m = 0, heading_rad = 0;

  void Visit(SentenceFields& f) {
    f.UnixSeconds(time_nav);
    for (double* length : {&x_m, &y_m, &z_m}) f.Number(*length, 4);
    f.Degrees(heading_rad);
  }
};

/// Where the servos of Doppler log and sonar stand: bow up positive.
struct PitSentence {
  static constexpr std::string_view kId = "BFPIT";
  Duration time{};
  double dvl_pitch_rad = 0, sonar_pitch_rad = 0;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Degrees(dvl_pitch_rad);
    f.Degrees(sonar_pitch_rad);
  }
};

/// Answer to a command.
struct AckSentence {
  static constexpr std::string_view kId = "BFACK";
  Duration time{};
  std::string command;
  Duration time_of_command{};
  int behaviour = 0;
  int status = 0;  ///< 0 invalid, 1 failed, 2 done, 3 pending.
  int future = 0;
  std::string description;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Text(command);
    f.TimeOfDay(time_of_command);
    f.Integer(behaviour);
    f.Integer(status);
    f.Integer(future);
    f.Rest(description);
  }
};

/// The mission: `status` holds the word "Running" while one runs.
struct MisSentence {
  static constexpr std::string_view kId = "BFMIS";
  Duration time{};
  std::string mission;
  std::string status;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Text(mission);
    f.Rest(status);
  }
};

/// Whether the payload has control.
struct CtlSentence {
  static constexpr std::string_view kId = "BFCTL";
  Duration time{};
  bool has_control = false;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Flag(has_control);
  }
};

/// Asks for one kind of sentence, or for "ALL". The one that may come without a check sum.
struct LogSentence {
  static constexpr std::string_view kId = "BPLOG";
  std::string wanted;
  bool on = true;

  void Visit(SentenceFields& f) {
    f.Text(wanted);
    f.Choice(on, "ON", "OFF");
  }
};

/// Heartbeat, every second.
struct StsSentence {
  static constexpr std::string_view kId = "BPSTS";
  Duration time{};
  bool ready = false;
  std::string text;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Flag(ready);
    f.Rest(text);
  }
};

/// A command that is all said by its name.
struct BareSentence {
  Duration time{};

  void Visit(SentenceFields& f) { f.TimeOfDay(time); }
};

/// Suspends the vehicle's own mission.
struct SusSentence : BareSentence {
  static constexpr std::string_view kId = "BPSUS";
};

/// Takes it up again.
struct ResSentence : BareSentence {
  static constexpr std::string_view kId = "BPRES";
};

/// Aborts.
struct AbtSentence : BareSentence {
  static constexpr std::string_view kId = "BPABT";
};

/// The sonar servo's angle, up positive.
struct SanSentence {
  static constexpr std::string_view kId = "BPSAN";
  Duration time{};
  double angle_rad = 0;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Degrees(angle_rad);
  }
};

/// Goes to a place relative to the hull.
struct GhpSentence {
  static constexpr std::string_view kId = "BPGHP";
  Duration time{};
  double horizontal_m = 0, vertical_m = 0, distance_m = 0;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    for (double* length : {&horizontal_m, &vertical_m, &distance_m}) f.Number(*length);
  }
};

/// Goes to a place of the reckoning's frame, at a depth or an altitude.
struct GbpSentence {
  static constexpr std::string_view kId = "BPGBP";
  Duration time{};
  double x_m = 0, y_m = 0;
  bool is_depth = true;
  double depth_or_altitude_m = 0;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Number(x_m);
    f.Number(y_m);
    f.Choice(is_depth, "D", "A");
    f.Number(depth_or_altitude_m);
  }
};

/// Turns by an angle relative to the bearing it holds.
struct RboSentence {
  static constexpr std::string_view kId = "BPRBO";
  Duration time{};
  double offset_rad = 0;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Degrees(offset_rad, 1);
  }
};

/// Sets where the reckoning is.
struct RnsSentence {
  static constexpr std::string_view kId = "BPRNS";
  Duration time{};
  double x_m = 0, y_m = 0, heading_rad = 0;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Number(x_m);
    f.Number(y_m);
    f.Degrees(heading_rad, 1);
  }
};

/// Limit of the speed relative to the hull.
struct SpdSentence {
  static constexpr std::string_view kId = "BPSPD";
  Duration time{};
  double speed_m_s = 0;

  void Visit(SentenceFields& f) {
    f.TimeOfDay(time);
    f.Number(speed_m_s);
  }
};

using Sentence =
    std::variant<NvgSentence, NvrSentence, RcmSentence, RdpSentence, RvlSentence, ImuSentence,
                 DvlSentence, Dv2Sentence, RbsSentence, RnvSentence, CnvSentence, PitSentence,
                 AckSentence, MisSentence, CtlSentence, LogSentence, StsSentence, SusSentence,
                 ResSentence, AbtSentence, SanSentence, GhpSentence, GbpSentence, RboSentence,
                 RnsSentence, SpdSentence>;

/// Why a line is no sentence.
enum class SentenceError {
  kNoSentence,       ///< No "$", or no check sum where one must be.
  kBadChecksum,      ///< Damaged on the way.
  kUnknownId,        ///< Of a kind that is not read here.
  kWrongFieldCount,  ///< Fewer or more fields than this kind has.
  kBadField,         ///< A field that is not what this kind has there.
};

/// Reads a line, with or without its end. What stands before the last "$" is garbage and left out;
/// the digits of the check sum may have either case.
std::variant<Sentence, SentenceError> ParseSentence(std::string_view line);

/// The line, "\r\n" included. Times are rounded to 1 ms, lengths to 1 mm or less; "$", "*" and what
/// is not printable become blanks.
std::string FormatSentence(const Sentence& sentence);

}  // namespace vog
