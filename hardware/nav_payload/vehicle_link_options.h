#pragma once

#include <string>

#include "lib/base/config.h"

namespace vog {

/// What the vehicle's computer speaks.
enum class VehicleProtocol {
  kCan,      ///< Our CAN bus, vogmap.dbc.
  kBluefin,  ///< Sentences of Bluefin's Standard Payload Interface.
};

/// Where the vehicle is: tables [vehicle_link] of the bridge and [sim_vehicle_link] of the
/// simulator, which stands at the other end.
struct VehicleLinkOptions {
  std::string url;
  VehicleProtocol protocol = VehicleProtocol::kCan;

  void Visit(OptionsVisitor& v) {
    v("url", url,
      "a link's URL (hardware/README.md), such as can:can0, tcp:HOST:PORT or serial:DEVICE?baud=N; "
      "empty: messages take its place");
    v("protocol", protocol,
      Names<VehicleProtocol>{{VehicleProtocol::kCan, "can"},
                             {VehicleProtocol::kBluefin, "bluefin"}},
      "frames of vogmap.dbc, or Bluefin's sentences");
  }
};

}  // namespace vog
