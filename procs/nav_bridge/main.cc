#include <memory>

#include "lib/bus/process.h"
#include "procs/nav_bridge/nav_bridge_node.h"

int main(int argc, char** argv) {
  return vog::RunProcess(
      {"vog-nav-bridge", "Dead-reckons the vehicle and passes commands on to it."}, argc, argv,
      [](vog::LcmBus& bus, const vog::Config& config) {
        const auto settings = vog::NavBridgeSettings::From(config);
        std::unique_ptr<vog::VehicleLink> link;
        if (!settings.vehicle_link.url.empty())
          link = vog::OpenVehicleLink(settings.vehicle_link, {settings.pressure, settings.doppler});
        return std::make_shared<vog::NavBridgeNode>(bus, settings, std::move(link));
      });
}
