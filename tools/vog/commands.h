#pragma once

#include "lib/base/errors.h"

namespace CLI {
class App;
}

namespace vog {

// Each adds one command to the program and runs it when it is parsed.
void AddMissionCommand(CLI::App& app);
void AddCampaignCommand(CLI::App& app);
void AddLaunchCommand(CLI::App& app);
void AddPlanCommand(CLI::App& app);
void AddOperatorCommand(CLI::App& app);
void AddStatusCommand(CLI::App& app);
void AddSpyCommand(CLI::App& app);
void AddReplayCommand(CLI::App& app);
void AddLogCommand(CLI::App& app);
void AddMapCommand(CLI::App& app);
void AddGraphCommand(CLI::App& app);
void AddConfigCommand(CLI::App& app);
void AddReportCommand(CLI::App& app);
void AddRegisterCommand(CLI::App& app);
void AddSlamCommand(CLI::App& app);
void AddSonarCommand(CLI::App& app);
void AddViewCommand(CLI::App& app);

}  // namespace vog
