#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "hardware/link/link.h"
#include "hardware/nav_payload/pressure.h"
#include "hardware/nav_payload/vehicle_link_options.h"
#include "lib/navigation/records.h"
#include "sim/world/world.h"

namespace vog {

/// The simulated vehicle's own computer: says on a wire what the instruments measure, and takes
/// commands from it.
class FrontSeat {
 public:
  struct Command {
    VelocityCommand velocities;
    Time answered;  ///< Of the pose that it answers.
  };

  virtual ~FrontSeat() = default;

  virtual void Tell(const Emissions& emissions) = 0;
  /// The newest command since; also opens again what broke. `steady` is real time.
  virtual std::optional<Command> Step(Time steady) = 0;
  virtual void Count(std::map<std::string, std::int64_t>& counters) const = 0;
};

/// A vehicle that speaks vogmap.dbc.
std::unique_ptr<FrontSeat> MakeCanFrontSeat(std::unique_ptr<CanLink> link);
/// A vehicle that speaks Bluefin's sentences.
std::unique_ptr<FrontSeat> MakeBluefinFrontSeat(std::unique_ptr<ByteLink> link,
                                                const PressureOptions& pressure);

/// @throws UsageError for a bad URL, SystemError when the line cannot be had.
std::unique_ptr<FrontSeat> OpenFrontSeat(const VehicleLinkOptions& options,
                                         const PressureOptions& pressure);

}  // namespace vog
