#include <utility>

#include "hardware/nav_payload/random_formats_testing.h"
#include "hardware/nav_payload/time_of_day.h"

namespace vog {
namespace {

Time RandomTime(Random& random) {
  return FromUtime(1'500'000'000'000'000 + 1'000'000LL * random.Index(500'000'000) +
                   10'000LL * random.Index(100));
}

std::optional<double> Maybe(Random& random, double lo, double hi) {
  return random.Chance(0.8) ? std::optional(random.Uniform(lo, hi)) : std::nullopt;
}

std::array<std::optional<double>, 4> FourOf(Random& random, double lo, double hi) {
  std::array<std::optional<double>, 4> values;
  for (auto& value : values) value = Maybe(random, lo, hi);
  return values;
}

DopplerFrame RandomFrame(Random& random) { return static_cast<DopplerFrame>(random.Index(4)); }

Pd6Velocity RandomPd6Velocity(Random& random, int count) {
  Pd6Velocity velocity{FourOf(random, -5, 5), random.Chance(0.5)};
  if (count == 3) velocity.velocity_m_s[3].reset();
  return velocity;
}

Pd6Distance RandomPd6Distance(Random& random) {
  return {random.Uniform(-99, 99), random.Uniform(-99, 99), random.Uniform(-9, 9),
          random.Uniform(0.1, 90), random.Uniform(0, 99)};
}

/// Fills whatever a sentence visits, by the text of each field.
template <class Kind>
Sentence RandomKind(Random& random) {
  for (;;) {
    const double share =
        random.Uniform(0, 1);  // Some kinds have fields that must stay as they are.
    std::vector<std::string> texts;
    Kind kind;
    SentenceFields writer;
    kind.Visit(writer);
    for (const std::string& text : writer.fields()) {
      const bool is_number =
          text.empty() || (text.find('.') != std::string::npos && text.size() < 9);
      texts.push_back(is_number && random.Chance(share) ? std::to_string(random.Uniform(-90, 90))
                                                        : text);
    }
    SentenceFields reader(texts);
    kind.Visit(reader);
    if (reader.is_count_right() && !reader.has_bad_field()) return kind;
  }
}

template <std::size_t... I>
Sentence RandomOf(Random& random, std::size_t index, std::index_sequence<I...>) {
  Sentence sentence;
  static_cast<void>(
      ((I == index ? (sentence = RandomKind<std::variant_alternative_t<I, Sentence>>(random), true)
                   : false) ||
       ...));
  return sentence;
}

}  // namespace

Sentence RandomSentence(int seed) {
  constexpr std::size_t kKinds = std::variant_size_v<Sentence>;
  Random random(1, "sentence", seed);
  Sentence sentence = RandomOf(random, seed % kKinds, std::make_index_sequence<kKinds>());
  if (auto* nvg = std::get_if<NvgSentence>(&sentence)) {
    nvg->latitude_rad = Maybe(random, -1.5, 1.5);
    nvg->longitude_rad = Maybe(random, -3.1, 3.1);
  }
  if (auto* rnv = std::get_if<RnvSentence>(&sentence); rnv && random.Chance(0.5))
    rnv->absolute = RnvAbsolute{random.Uniform(0, 30), random.Uniform(0, 6), random.Uniform(-1, 1),
                                random.Uniform(-1, 1), RandomTime(random)};
  return sentence;
}

Pd0Ensemble RandomPd0(int seed) {
  Random random(1, "pd0", seed);
  Pd0Ensemble e;
  e.fixed.frame = RandomFrame(random);
  e.fixed.uses_tilts = random.Chance(0.5);
  e.fixed.serial_number = random.Index(1 << 30);
  e.variable.ensemble = random.Index(1 << 24);
  e.variable.time = RandomTime(random);
  e.variable.transducer_depth_m = random.Uniform(0, 100);
  e.variable.heading_rad = random.Uniform(0, 6.28);
  e.variable.pitch_rad = random.Uniform(-1.5, 1.5);
  e.variable.roll_rad = random.Uniform(-3.1, 3.1);
  e.variable.temperature_degc = random.Uniform(-2, 30);
  if (random.Chance(0.8)) {
    e.bottom_track.emplace();
    e.bottom_track->range_m = FourOf(random, 0.1, random.Chance(0.5) ? 50 : 150'000);
    e.bottom_track->velocity_m_s = FourOf(random, -10, 10);
    e.bottom_track->correlation[2] = random.Index(256);
    e.bottom_track->percent_good[3] = random.Index(101);
  }
  return e;
}

Pd45Ensemble RandomPd45(int seed) {
  Random random(1, "pd45", seed);
  Pd45Ensemble e;
  e.frame = RandomFrame(random);
  e.uses_tilts = random.Chance(0.5);
  e.bottom_velocity_m_s = FourOf(random, -10, 10);
  e.water_velocity_m_s = FourOf(random, -10, 10);
  e.range_m = FourOf(random, 0.1, 600);
  e.bottom_status = random.Index(256);
  e.time_of_first_ping = TimeOfDay(RandomTime(random));
  e.temperature_degc = random.Uniform(-2, 30);
  if (random.Chance(0.5)) {
    e.extra.emplace();
    e.extra->depth_m = random.Uniform(0, 100);
    e.extra->heading_rad = random.Uniform(0, 6.28);
    e.extra->pitch_rad = random.Uniform(-1.5, 1.5);
    e.extra->roll_rad = random.Uniform(-3.1, 3.1);
    for (double& distance : e.extra->distance_bottom_m) distance = random.Uniform(-1e6, 1e6);
  }
  return e;
}

Pd6Ensemble RandomPd6(int seed) {
  Random random(1, "pd6", seed);
  Pd6Ensemble e;
  e.attitude = NedAttitude{random.Uniform(0, 6.28), random.Uniform(-1, 1), random.Uniform(-1, 1)};
  e.time = RandomTime(random);
  e.transducer_depth_m = random.Uniform(0, 100);
  if (random.Chance(0.5)) e.water_instrument = RandomPd6Velocity(random, 4);
  if (random.Chance(0.5)) e.water_distance = RandomPd6Distance(random);
  if (random.Chance(0.8)) e.bottom_instrument = RandomPd6Velocity(random, 4);
  if (random.Chance(0.8)) e.bottom_ship = RandomPd6Velocity(random, 3);
  if (random.Chance(0.8)) e.bottom_earth = RandomPd6Velocity(random, 3);
  e.bottom_distance = RandomPd6Distance(random);
  return e;
}

Hg1700Record RandomHg1700(int seed) {
  Random random(1, "hg1700", seed);
  Hg1700Record record;
  for (double& rate : record.rate_rad_s) rate = random.Uniform(-15, 15);
  for (double& acceleration : record.acceleration_m_s2) acceleration = random.Uniform(-300, 300);
  record.status = random.Index(1 << 16);
  if (random.Chance(0.5)) {
    record.increments.emplace();
    for (double& angle : record.increments->angle_rad) angle = random.Uniform(-0.2, 0.2);
    for (double& velocity : record.increments->velocity_m_s) velocity = random.Uniform(-4, 4);
  }
  return record;
}

VehicleNavRecord RandomVehicleNav(int seed) {
  Random random(1, "nav", seed);
  const auto within = [&](double limit) { return random.Uniform(-limit, limit); };
  VehicleNavRecord nav;
  nav.time = RandomTime(random);
  nav.origin = ToUtime(RandomTime(random));
  nav.X_OB = MakePose({within(100), within(100), within(100)}, {within(3), within(1.5), within(3)});
  nav.velocity_B_m_s = {within(1), within(1), within(1)};
  nav.yaw_rate_rad_s = within(1);
  return nav;
}

CanRecord RandomCanRecord(int seed) {
  Random random(1, "can", seed);
  const Time time = RandomTime(random);
  const auto vector = [&](double limit) {
    return Vec3(random.Uniform(-limit, limit), random.Uniform(-limit, limit),
                random.Uniform(-limit, limit));
  };
  switch (random.Index(10)) {
    case 0:
      return CanDvl{{time, 0, vector(6), random.Chance(0.5)}, FourOf(random, 0.1, 80)};
    case 1:
      return ImuRecord{time, 0, random.Uniform(-3, 3), random.Uniform(-1.5, 1.5), vector(3)};
    case 2:
      return DepthRecord{time, 0, random.Uniform(-5, 11'000)};
    case 3:
      return RandomVehicleNav(seed);
    case 4:
      return VehicleTime{time, time};
    case 5:
      return VehicleStatus{time, static_cast<VehicleMode>(random.Index(5)), random.Uniform(0, 60),
                           random.Uniform(0, 1), random.Chance(0.5)};
    case 6:
      return VehicleHeartbeat{{time, random.Uniform(0, 1e6), random.Chance(0.5)}};
    case 7:
      return PayloadHeartbeat{{time, random.Uniform(0, 1e6), random.Chance(0.5)}};
    case 8:
      return CanVelocityCommand{time, {vector(3), random.Uniform(-1.5, 1.5)}};
    default:
      ThrusterCommand command;
      for (double& thrust : command.thrust) thrust = random.Uniform(-1, 1);
      return command;
  }
}

std::optional<std::filesystem::path> FindRecording(const std::string& name) {
  const char* set = std::getenv("VOG_SHARED_DATA");
  const std::filesystem::path folder =
      set ? std::filesystem::path(set) : std::filesystem::path(VOG_SOURCE_DIR) / "../shared/data";
  if (!std::filesystem::exists(folder / name)) return std::nullopt;
  return folder / name;
}

}  // namespace vog
