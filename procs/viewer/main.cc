#include <memory>

#include "lib/base/log.h"
#include "lib/bus/process.h"
#include "procs/viewer/viewer_node.h"

int main(int argc, char** argv) {
  return vog::RunProcess(
      {.name = "vog-viewer",
       .purpose = "Shows the run as a page in a browser.",
       .may_be_many = true},
      argc, argv, [](vog::LcmBus& bus, const vog::Config& config) {
        const auto node = std::make_shared<vog::ViewerNode>(bus, vog::ViewerSettings::From(config));
        vog::LogLine("the page is at " + node->server().url());
        bus.Every(std::chrono::milliseconds(10), [node](vog::Time now) { node->Step(now); });
        return node;
      });
}
