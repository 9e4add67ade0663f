#include <memory>

#include "hardware/link/open_link.h"
#include "lib/bus/process.h"
#include "procs/sonar_reader/sonar_reader_node.h"

int main(int argc, char** argv) {
  return vog::RunProcess({"vog-sonar-reader", "Turns sonar returns or frames into scans."}, argc,
                         argv, [](vog::LcmBus& bus, const vog::Config& config) {
                           const auto settings = vog::SonarReaderSettings::From(config);
                           std::unique_ptr<vog::ByteLink> link;
                           if (!settings.sonar_link.url.empty())
                             link = vog::OpenByteLink({settings.sonar_link.url});
                           return std::make_shared<vog::SonarReaderNode>(bus, settings,
                                                                         std::move(link));
                         });
}
