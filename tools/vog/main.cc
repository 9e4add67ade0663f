#include <CLI/CLI.hpp>
#include <cstdio>

#include "lib/base/log.h"
#include "tools/vog/commands.h"

namespace {

int Run(int argc, char** argv) {
  CLI::App app("Vogmap: explore unknown 3D structures, build VOG-maps, and look at them.", "vog");
  app.set_version_flag("--version", VOG_VERSION);
  app.require_subcommand(1);
  vog::AddMissionCommand(app);
  vog::AddCampaignCommand(app);
  vog::AddLaunchCommand(app);
  vog::AddOperatorCommand(app);
  vog::AddStatusCommand(app);
  vog::AddViewCommand(app);
  vog::AddSpyCommand(app);
  vog::AddReplayCommand(app);
  vog::AddPlanCommand(app);
  vog::AddMapCommand(app);
  vog::AddGraphCommand(app);
  vog::AddLogCommand(app);
  vog::AddConfigCommand(app);
  vog::AddReportCommand(app);
  vog::AddRegisterCommand(app);
  vog::AddSlamCommand(app);
  vog::AddSonarCommand(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {  // --help and --version.
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    throw vog::UsageError(std::string(error.what()) + "; see vog --help");
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return vog::RunMain([&] { return Run(argc, argv); });
}
