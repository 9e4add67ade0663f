#include <memory>

#include "lib/bus/process.h"
#include "procs/controller/controller_node.h"

int main(int argc, char** argv) {
  return vog::RunProcess({"vog-controller", "Flies the planner's path."}, argc, argv,
                         [](vog::LcmBus& bus, const vog::Config& config) {
                           return std::make_shared<vog::ControllerNode>(
                               bus, vog::ControllerSettings::From(config));
                         });
}
