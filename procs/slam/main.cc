#include <memory>

#include "lib/bus/process.h"
#include "procs/slam/slam_node.h"

int main(int argc, char** argv) {
  return vog::RunProcess(
      {"vog-slam", "Registers submaps, closes loops, and tells the corrected poses."}, argc, argv,
      [](vog::LcmBus& bus, const vog::Config& config) {
        return std::make_shared<vog::SlamNode>(bus, vog::SlamNodeSettings::From(config));
      });
}
