#include "hardware/nav_payload/pd6.h"

#include <charconv>
#include <utility>
#include <vector>

#include "hardware/nav_payload/text_numbers.h"
#include "hardware/nav_payload/time_of_day.h"
#include "lib/geometry/pose.h"

namespace vog {
namespace {

constexpr double kFill = -32768;
constexpr double kStep = 1e-3;

using Fields = std::vector<std::string>;

std::optional<Time> ParseStamp(std::string_view text) {
  using namespace std::chrono;
  if (text.size() != 14 || text.find_first_not_of("0123456789") != std::string_view::npos)
    return std::nullopt;
  const auto number = [&](std::size_t at) { return ParseInteger(text.substr(at, 2)).value(); };
  const int century = number(0) < 80 ? 2000 : 1900;
  const year_month_day date(year(century + number(0)), month(number(2)), day(number(4)));
  const auto time =
      ParseTimeOfDay(std::string(text.substr(6, 6)) + "." + std::string(text.substr(12)));
  if (!date.ok() || !time) return std::nullopt;
  return Time(sys_days(date).time_since_epoch()) + *time;
}

std::string FormatStamp(Time time) {
  using namespace std::chrono;
  const Time rounded(round<duration<std::int64_t, std::centi>>(time.time_since_epoch()));
  const year_month_day date{sys_days(floor<days>(rounded.time_since_epoch()))};
  const double yymmdd =
      int{date.year()} % 100 * 10'000 + unsigned{date.month()} * 100 + unsigned{date.day()};
  const std::string time_of_day = FormatTimeOfDay(TimeOfDay(rounded));
  return ToPadded(yymmdd, 0, 6) + time_of_day.substr(0, 6) + time_of_day.substr(7, 2);
}

/// All fields but the first, which names the line; nothing where one is no number.
std::optional<std::vector<double>> Numbers(const Fields& fields, std::size_t count) {
  std::vector<double> numbers;
  for (std::size_t i = 1; i <= count && i < fields.size(); ++i) {
    const auto number = ParseNumber(fields[i]);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers.size() == count ? std::optional(numbers) : std::nullopt;
}

bool ReadAttitude(const Fields& fields, Pd6Ensemble& ensemble) {
  const auto n = Numbers(fields, 3);
  if (!n || fields.size() != 4) return false;
  ensemble.attitude = NedAttitude{ToRadians((*n)[2]), ToRadians((*n)[0]), ToRadians((*n)[1])};
  return true;
}

bool ReadScaling(const Fields& fields, Pd6Ensemble& ensemble) {
  const auto time = fields.size() == 7 ? ParseStamp(fields[1]) : std::nullopt;
  const auto n = time ? Numbers({fields.begin() + 1, fields.end()}, 5) : std::nullopt;
  if (!n) return false;
  ensemble.time = time;
  ensemble.salinity_ppt = (*n)[0];
  ensemble.temperature_degc = (*n)[1];
  ensemble.transducer_depth_m = (*n)[2];
  ensemble.sound_speed_m_s = (*n)[3];
  ensemble.built_in_test = static_cast<int>((*n)[4]);
  return true;
}

bool ReadVelocity(const Fields& fields, std::size_t count, std::optional<Pd6Velocity>& velocity) {
  const auto n = Numbers(fields, count);
  if (!n || fields.size() != count + 2 || (fields.back() != "A" && fields.back() != "V"))
    return false;
  velocity.emplace();
  velocity->good = fields.back() == "A";
  for (std::size_t i = 0; i < count; ++i) {
    if ((*n)[i] != kFill) velocity->velocity_m_s[i] = kStep * (*n)[i];
  }
  return true;
}

bool ReadDistance(const Fields& fields, std::optional<Pd6Distance>& distance) {
  const auto n = Numbers(fields, 5);
  if (!n || fields.size() != 6) return false;
  distance = Pd6Distance{(*n)[0], (*n)[1], (*n)[2], (*n)[3], (*n)[4]};
  return true;
}

bool ReadLine(std::string_view line, Pd6Ensemble& e) {
  const Fields fields = SplitFields(line, ',');
  const std::string& name = fields[0];
  if (name == ":SA") return ReadAttitude(fields, e);
  if (name == ":TS") return ReadScaling(fields, e);
  if (name == ":WI") return ReadVelocity(fields, 4, e.water_instrument);
  if (name == ":WS") return ReadVelocity(fields, 3, e.water_ship);
  if (name == ":WE") return ReadVelocity(fields, 3, e.water_earth);
  if (name == ":WD") return ReadDistance(fields, e.water_distance);
  if (name == ":BI") return ReadVelocity(fields, 4, e.bottom_instrument);
  if (name == ":BS") return ReadVelocity(fields, 3, e.bottom_ship);
  if (name == ":BE") return ReadVelocity(fields, 3, e.bottom_earth);
  if (name == ":BD") return ReadDistance(fields, e.bottom_distance);
  return false;
}

bool BeginsEnsemble(std::string_view line, const Pd6Ensemble& so_far) {
  if (line.starts_with(":SA")) return true;
  return line.starts_with(":TS") && so_far.time.has_value();
}

std::string AttitudeLine(const NedAttitude& attitude) {
  return ":SA," + ToSigned(ToDegrees(attitude.pitch_rad), 2) + "," +
         ToSigned(ToDegrees(attitude.roll_rad), 2) + "," +
         ToPadded(ToDegrees(attitude.heading_rad), 2, 6) + "\r\n";
}

std::string ScalingLine(const Pd6Ensemble& e) {
  return ":TS," + FormatStamp(*e.time) + "," + ToPadded(e.salinity_ppt, 1, 4) + "," +
         ToSigned(e.temperature_degc, 1) + "," + ToPadded(e.transducer_depth_m, 1, 6) + "," +
         ToPadded(e.sound_speed_m_s, 1, 6) + "," + ToPadded(e.built_in_test, 0, 3) + "\r\n";
}

std::string VelocityLine(const char* name, int count, const std::optional<Pd6Velocity>& velocity) {
  if (!velocity) return {};
  std::string line = name;
  for (int i = 0; i < count; ++i) {
    const auto& v = velocity->velocity_m_s[i];
    line += "," + ToSigned(v ? *v / kStep : kFill, 0);
  }
  return line + (velocity->good ? ",A\r\n" : ",V\r\n");
}

std::string DistanceLine(const char* name, const std::optional<Pd6Distance>& distance) {
  if (!distance) return {};
  std::string line = name;
  for (const double made_good : {distance->east_m, distance->north_m, distance->up_m})
    line += "," + ToSigned(made_good, 2);
  return line + "," + ToPadded(distance->range_m, 2, 7) + "," +
         ToPadded(distance->since_good_s, 2, 6) + "\r\n";
}

}  // namespace

std::optional<Pd6Ensemble> Pd6Reader::Add(std::string_view line) {
  const std::size_t colon = line.rfind(':');
  if (colon == std::string_view::npos) return std::nullopt;
  line.remove_prefix(colon);
  std::optional<Pd6Ensemble> complete;
  if (has_lines_ && BeginsEnsemble(line, ensemble_)) complete = std::exchange(ensemble_, {});
  if (!ReadLine(line, ensemble_)) {
    ++bad_lines_;
    return complete;
  }
  has_lines_ = !line.starts_with(":BD");
  if (!has_lines_) complete = std::exchange(ensemble_, {});
  return complete;
}

std::string FormatPd6(const Pd6Ensemble& e) {
  return (e.attitude ? AttitudeLine(*e.attitude) : "") + (e.time ? ScalingLine(e) : "") +
         VelocityLine(":WI", 4, e.water_instrument) + VelocityLine(":WS", 3, e.water_ship) +
         VelocityLine(":WE", 3, e.water_earth) + DistanceLine(":WD", e.water_distance) +
         VelocityLine(":BI", 4, e.bottom_instrument) + VelocityLine(":BS", 3, e.bottom_ship) +
         VelocityLine(":BE", 3, e.bottom_earth) + DistanceLine(":BD", e.bottom_distance);
}

std::optional<DopplerSample> ToDopplerSample(const Pd6Ensemble& ensemble) {
  if (!ensemble.time) return std::nullopt;
  DopplerSample sample;
  sample.time = *ensemble.time;
  sample.attitude = ensemble.attitude.value_or(NedAttitude{});
  sample.is_levelled = true;
  if (ensemble.bottom_distance && ensemble.bottom_distance->range_m > 0)
    sample.range_m.fill(ensemble.bottom_distance->range_m);
  for (const auto& [velocity, frame] :
       {std::pair{&ensemble.bottom_instrument, DopplerFrame::kInstrument},
        std::pair{&ensemble.bottom_ship, DopplerFrame::kShip},
        std::pair{&ensemble.bottom_earth, DopplerFrame::kEarth}}) {
    if (!*velocity || !(*velocity)->good) continue;
    sample.frame = frame;
    sample.velocity_m_s = (*velocity)->velocity_m_s;
    break;
  }
  return sample;
}

}  // namespace vog
