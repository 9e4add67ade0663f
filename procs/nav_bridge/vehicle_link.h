#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "hardware/link/link.h"
#include "hardware/nav_payload/bluefin_reader.h"
#include "hardware/nav_payload/vehicle_link_options.h"
#include "lib/navigation/records.h"

namespace vog {

/// The vehicle at the other end of a wire.
class VehicleLink {
 public:
  virtual ~VehicleLink() = default;

  /// What came since. Also opens again what broke, and says what is due: that the payload lives,
  /// once a second. `steady` is real time, which goes on when nothing comes; `now` the vehicle's,
  /// which dates a time of day.
  virtual std::vector<NavigationRecord> Step(Time steady, Time now) = 0;

  /// Asks for velocities, in answer to the pose at `answered`.
  virtual void Send(const VelocityCommand& command, Time answered) = 0;

  /// What was lost or refused on the way.
  virtual void Count(std::map<std::string, std::int64_t>& counters) const = 0;
};

/// A vehicle that speaks vogmap.dbc.
std::unique_ptr<VehicleLink> MakeCanVehicle(std::unique_ptr<CanLink> link);
/// A vehicle that speaks Bluefin's sentences, read by a copy of `reader`.
std::unique_ptr<VehicleLink> MakeBluefinVehicle(std::unique_ptr<ByteLink> link,
                                                const BluefinReader& reader);

/// @throws UsageError for a bad URL, SystemError when another program has the line.
std::unique_ptr<VehicleLink> OpenVehicleLink(const VehicleLinkOptions& options,
                                             const BluefinReader& reader);

}  // namespace vog
