#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/report/report.h"
#include "tools/vog/commands.h"

namespace vog {
namespace {

struct Arguments {
  std::vector<std::string> folders;
  std::string out;
};

std::filesystem::path PageOf(const Arguments& arguments) {
  if (!arguments.out.empty()) return arguments.out;
  if (arguments.folders.size() > 1) return "comparison.html";
  return std::filesystem::path(arguments.folders.front()) / "report.html";
}

void Report(const Arguments& arguments) {
  const std::filesystem::path page = PageOf(arguments);
  if (arguments.folders.size() > 1) {
    WriteComparison({arguments.folders.begin(), arguments.folders.end()}, page);
  } else {
    WriteReport(arguments.folders.front(), page);
  }
  std::printf("%s\n", page.c_str());
}

}  // namespace

void AddReportCommand(CLI::App& app) {
  auto* command = app.add_subcommand(
      "report", "Draw a finished run as one page, or compare several runs on one.");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("folders", arguments->folders, "folders of finished runs")->required();
  command->add_option("--out", arguments->out,
                      "the page; else DIR/report.html, or comparison.html for several runs");
  command->callback([arguments] { Report(*arguments); });
}

}  // namespace vog
