#include <memory>

#include "lib/bus/process.h"
#include "procs/sim/sim_node.h"

namespace {

struct LiveSimulator {
  LiveSimulator(vog::LcmBus& bus, const vog::SimSettings& settings)
      : sim(bus, settings, vog::SimWires::Open(settings)), pacer(bus, sim, settings.live) {}

  vog::SimNode sim;
  vog::LivePacer pacer;
};

}  // namespace

int main(int argc, char** argv) {
  return vog::RunProcess({"vog-sim", "Simulates the vehicle, its instruments and the structure.",
                          /*is_time_source=*/true},
                         argc, argv, [](vog::LcmBus& bus, const vog::Config& config) {
                           return std::make_shared<LiveSimulator>(bus,
                                                                  vog::SimSettings::From(config));
                         });
}
