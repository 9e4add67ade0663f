#include "hardware/sonar/didson_header.h"

#include <chrono>
#include <cmath>

#include "lib/scan/sonar.h"

namespace vog {
namespace {

constexpr std::uint32_t kHighFrequency = 1, kClassicWindows = 1;
constexpr std::uint32_t kLastWindowStart = 31;

/// Calls `field(offset, member)` for each field: the one table of where things are.
template <class Header, class Field>
void VisitFields(Header& h, Field field) {
  field(0, h.frame_number);
  field(4, h.frame_time);
  field(12, h.version);
  field(16, h.status);
  field(20, h.year);
  field(24, h.month);
  field(28, h.day);
  field(32, h.hour);
  field(36, h.minute);
  field(40, h.second);
  field(44, h.hundredths);
  field(48, h.transmit_mode);
  field(52, h.window_start);
  field(56, h.window_length);
  field(60, h.threshold);
  field(64, h.intensity);
  field(68, h.receiver_gain);
  field(128, h.depth_m);
  field(132, h.altitude_m);
  field(136, h.pitch_deg);
  field(144, h.roll_deg);
  field(152, h.heading_deg);
  field(188, h.sonar_position);
  field(192, h.config_flags);
  field(196, h.prism_tilt_deg);
  field(224, h.water_temperature_degc);
  field(232, h.sonar_x);
  field(236, h.sonar_y);
  field(240, h.sonar_z);
  field(244, h.sonar_pan_deg);
  field(248, h.sonar_tilt_deg);
  field(252, h.sonar_roll_deg);
  field(268, h.vehicle_time_s);
  field(332, h.pan_offset_deg);
  field(336, h.tilt_offset_deg);
  field(340, h.roll_offset_deg);
}

bool IsHighFrequency(const DidsonHeader& header) { return header.transmit_mode & kHighFrequency; }

/// A window's start is a multiple of a step; its length is one of four.
struct Windows {
  double step_m;
  double lengths_m[4];
};

const Windows& WindowsOf(bool is_classic, bool is_high_frequency) {
  static constexpr Windows kWindows[2][2] = {
      {{0.84, {5, 10, 20, 40}}, {0.42, {1.25, 2.5, 5, 10}}},
      {{0.75, {4.5, 9, 18, 36}}, {0.375, {1.125, 2.25, 4.5, 9}}}};
  return kWindows[is_classic][is_high_frequency];
}

std::optional<Time> CalendarTimeOf(const DidsonHeader& h) {
  using namespace std::chrono;
  const auto date =
      year(static_cast<int>(h.year)) / static_cast<int>(h.month) / static_cast<int>(h.day);
  const bool is_date = h.year >= 1970 && h.year < 2200 && h.month <= 12 && h.day <= 31 && date.ok();
  if (!is_date || h.hour > 23 || h.minute > 59 || h.second > 60 || h.hundredths > 99)
    return std::nullopt;
  const auto second_of_day = hours(h.hour) + minutes(h.minute) + seconds(h.second);
  return Time(sys_days(date).time_since_epoch() + second_of_day + milliseconds(10 * h.hundredths));
}

/// Sets the header's window to that of a table; false if it is none of it.
bool SetWindow(const SonarFrame& frame, bool is_classic, DidsonHeader& header) {
  constexpr double kSame_m = 1e-6;
  const Windows& windows = WindowsOf(is_classic, IsHighFrequency(header));
  const double start = std::round(frame.min_range_m / windows.step_m);
  if (!(start >= 1 && start <= kLastWindowStart) ||
      std::abs(start * windows.step_m - frame.min_range_m) > kSame_m)
    return false;
  for (int i = 0; i < 4; ++i) {
    if (std::abs(frame.max_range_m - frame.min_range_m - windows.lengths_m[i]) > kSame_m) continue;
    header.window_start = static_cast<std::uint32_t>(start);
    header.window_length = i;
    header.config_flags = is_classic ? kClassicWindows : 0;
    return true;
  }
  return false;
}

}  // namespace

DidsonHeader DecodeDidsonHeader(ByteSpan bytes) {
  DidsonHeader header;
  VisitFields(header, [&](std::size_t offset, auto& field) {
    field = LoadLittle<std::remove_cvref_t<decltype(field)>>(bytes, offset);
  });
  return header;
}

ByteVector EncodeDidsonHeader(const DidsonHeader& header) {
  ByteVector bytes(kDidsonHeaderBytes);
  VisitFields(header, [&](std::size_t offset, auto field) { StoreLittle(field, offset, bytes); });
  return bytes;
}

int BeamsOf(const DidsonHeader& header) { return IsHighFrequency(header) ? 96 : 48; }

std::optional<SonarWindow> WindowOf(const DidsonHeader& header, WindowTable table) {
  if (header.window_start > kLastWindowStart || header.window_length > 3) return std::nullopt;
  const bool is_classic = table == WindowTable::kClassic || (table == WindowTable::kFromHeader &&
                                                             header.config_flags & kClassicWindows);
  const Windows& windows = WindowsOf(is_classic, IsHighFrequency(header));
  const double start_m = header.window_start * windows.step_m;
  return SonarWindow{start_m, start_m + windows.lengths_m[header.window_length]};
}

Time TimeOf(const DidsonHeader& header) {
  constexpr double kLatest_s = 7e9;
  if (header.vehicle_time_s > 0 && header.vehicle_time_s < kLatest_s)
    return Time(FromSeconds(header.vehicle_time_s));
  return CalendarTimeOf(header).value_or(Time());
}

std::optional<SonarFrame> ToSonarFrame(const DidsonFrame& frame, WindowTable table) {
  const auto window = WindowOf(frame.header, table);
  const int beams = BeamsOf(frame.header);
  if (!window || frame.samples.size() != static_cast<std::size_t>(beams) * kDidsonBins)
    return std::nullopt;
  const double tilt_rad = ToRadians(frame.header.sonar_tilt_deg);
  return SonarFrame{TimeOf(frame.header),
                    frame.header.frame_number,
                    std::isfinite(tilt_rad) ? tilt_rad : 0,
                    window->min_range_m,
                    window->max_range_m,
                    beams,
                    kDidsonBins,
                    frame.samples};
}

std::optional<DidsonFrame> FromSonarFrame(const SonarFrame& frame) {
  if ((frame.beams != 96 && frame.beams != 48) || frame.bins != kDidsonBins ||
      frame.samples.size() != static_cast<std::size_t>(frame.beams) * frame.bins)
    return std::nullopt;
  DidsonHeader header;
  header.frame_number = static_cast<std::uint32_t>(frame.sequence);
  header.transmit_mode = frame.beams == 96 ? 3 : 2;
  header.sonar_tilt_deg = static_cast<float>(ToDegrees(frame.tilt_rad));
  header.vehicle_time_s = ToSeconds(frame.time);
  if (!SetWindow(frame, true, header) && !SetWindow(frame, false, header)) return std::nullopt;
  return DidsonFrame{header, frame.samples};
}

}  // namespace vog
