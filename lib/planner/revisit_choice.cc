#include "lib/planner/revisit_choice.h"

#include <algorithm>

namespace vog {
namespace {

/// Of its error that a revisit must take away for its share of the time.
constexpr double kErrorForTime = 2;
/// What is expected is no more certain than this.
constexpr double kLeastGain = 0.1;
/// While it looks, a whole submap begins and ends.
constexpr double kSubmapsToLook = 2;
/// Of the time at which a place was tried, that must have passed.
constexpr double kTriedAgainAfter = 1.25;

}  // namespace

double RevisitChoice::WorthOf(const RevisitPlace& place, double way_s,
                              const FlightTime& time) const {
  if (place.gain < kLeastGain) return 0;
  const auto tried = tried_at_s_.find(place.submap);
  if (tried != tried_at_s_.end() && time.all_s < kTriedAgainAfter * tried->second) return 0;
  const double takes_s = 2 * way_s + kSubmapsToLook * time.submap_s;
  if (time.revisits_s + takes_s > share_ * time.all_s) return 0;
  return place.gain - kErrorForTime * takes_s / time.all_s;
}

double RevisitChoice::GainOf(int submap) const {
  for (const RevisitPlace& place : places_)
    if (place.submap == submap) return place.gain;
  return 0;
}

bool RevisitChoice::IsWorthASearch(const Waypoint& at, const FlightTime& time) const {
  return std::any_of(places_.begin(), places_.end(), [&](const RevisitPlace& place) {
    return WorthOf(place, LengthOf(at, place.first) / limits_.max_speed_m_s, time) > 0;
  });
}

std::optional<RevisitPlace> RevisitChoice::Best(const Routes& routes, const FlightTime& time) {
  is_new_ = false;
  std::optional<RevisitPlace> best;
  double most = 0;
  for (const RevisitPlace& place : places_) {
    if (WorthOf(place, 0, time) <= most) continue;
    const auto near = routes.ReachedNear(place.first.position_W_m, kRevisitNear_m,
                                         1u << HeadingOfYaw(place.first.yaw_rad));
    if (!near) continue;
    const double way_s = routes.reached()[static_cast<std::size_t>(*near)].time_s;
    const double worth = WorthOf(place, way_s, time);
    if (worth <= most) continue;
    most = worth;
    best = place;
  }
  return best;
}

}  // namespace vog
