#include <memory>

#include "lib/bus/process.h"
#include "procs/planner/planner_node.h"

int main(int argc, char** argv) {
  return vog::RunProcess({"vog-planner", "Explores: plans next-best views on the map."}, argc, argv,
                         [](vog::LcmBus& bus, const vog::Config& config) {
                           return std::make_shared<vog::PlannerNode>(
                               bus, vog::PlannerSettings::From(config));
                         });
}
