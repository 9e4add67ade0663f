#include <memory>

#include "lib/bus/process.h"
#include "procs/map_service/map_service_node.h"

int main(int argc, char** argv) {
  return vog::RunProcess(
      {"vog-map-service", "Builds, keeps and saves the VOG-map, and answers questions about it."},
      argc, argv, [](vog::LcmBus& bus, const vog::Config& config) {
        return std::make_shared<vog::MapServiceNode>(bus, vog::MapServiceSettings::From(config));
      });
}
