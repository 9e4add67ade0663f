#include <memory>

#include "lib/bus/process.h"
#include "procs/sonar_reader/sonar_reader_node.h"

int main(int argc, char** argv) {
  return vog::RunProcess({"vog-sonar-reader", "Turns sonar returns or frames into scans."}, argc,
                         argv, [](vog::LcmBus& bus, const vog::Config& config) {
                           return std::make_shared<vog::SonarReaderNode>(
                               bus, vog::SonarReaderSettings::From(config));
                         });
}
