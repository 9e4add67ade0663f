#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "lib/scan/range_detector.h"
#include "tools/sonar/frame_files.h"
#include "tools/vog/commands.h"
#include "tools/vog/config_arguments.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;

void AddFormat(CLI::App& command, std::string& format) {
  command
      .add_option("--format", format,
                  "what the files are: pgm, png, ddf or aris; without, by their endings")
      ->check(CLI::IsMember({"pgm", "png", "ddf", "aris"}).description(""))
      ->type_name("FORMAT");
}

// --- detect ---

struct DetectArguments {
  std::string frames;
  FrameReading reading;
  std::vector<double> window_m;
  ConfigArguments config;
  bool json = false;
};

/// A beam with a return.
struct Return {
  int beam, range_bin;
  double range_m, strength;
};

std::vector<Return> ReturnsOf(const RangeDetectorOptions& options, const SonarFrame& frame) {
  // Only beams and bins are told, so the bearings do not matter.
  const std::vector<double> bearings_rad(frame.beams);
  const double bin_m = (frame.max_range_m - frame.min_range_m) / frame.bins;
  const std::vector<Beam> beams = DetectRanges(options, frame, bearings_rad);
  std::vector<Return> returns;
  for (int i = 0; i < frame.beams; ++i) {
    if (beams[i].status != BeamStatus::kReturn) continue;
    const int bin = static_cast<int>((beams[i].range_m - frame.min_range_m) / bin_m);
    returns.push_back({i, std::clamp(bin, 0, frame.bins - 1), beams[i].range_m, beams[i].strength});
  }
  return returns;
}

void PrintReturns(const std::string& file, const std::vector<Return>& returns) {
  for (const Return& r : returns)
    std::printf("%s %d %d %.3f\n", file.c_str(), r.beam, r.range_bin, r.strength);
}

Json JsonOf(const std::string& file, const SonarFrame& frame, const std::vector<Return>& returns) {
  Json list = Json::array();
  for (const Return& r : returns) {
    list.push_back({{"beam", r.beam},
                    {"range_bin", r.range_bin},
                    {"range_m", r.range_m},
                    {"strength", r.strength}});
  }
  return {
      {"file", file},       {"utime_us", ToUtime(frame.time)},  {"beams", frame.beams},
      {"bins", frame.bins}, {"min_range_m", frame.min_range_m}, {"max_range_m", frame.max_range_m},
      {"returns", list}};
}

void Detect(DetectArguments arguments) {
  if (!arguments.window_m.empty()) {
    arguments.reading.window = SonarWindow{arguments.window_m[0], arguments.window_m[1]};
    if (!(arguments.window_m[0] >= 0 && arguments.window_m[0] < arguments.window_m[1]))
      throw UsageError("--window: from 0 or more to something larger, in metres");
  }
  const auto options = arguments.config.Load().Read<RangeDetectorOptions>("range_detector");
  Json frames = Json::array();
  for (const auto& path : FrameFiles(arguments.frames, arguments.reading)) {
    ForEachFrame(path, arguments.reading, [&](const std::string& file, const SonarFrame& frame) {
      const std::vector<Return> returns = ReturnsOf(options, frame);
      if (arguments.json)
        frames.push_back(JsonOf(file, frame, returns));
      else
        PrintReturns(file, returns);
    });
  }
  if (arguments.json) std::printf("%s\n", Json{{"frames", frames}}.dump(2).c_str());
}

void AddDetect(CLI::App& sonar) {
  auto* command = sonar.add_subcommand(
      "detect",
      "Find the ranges in frames: a line `file beam range_bin strength` for each beam with a "
      "return, "
      "counted from 0; strength 0..1 is the echo's peak. In images a row is a range bin, from near "
      "to far, and a column a beam.");
  const auto arguments = std::make_shared<DetectArguments>();
  command->add_option("frames", arguments->frames, "a file, or a folder of them")->required();
  AddFormat(*command, arguments->reading.format);
  command
      ->add_option("--window", arguments->window_m,
                   "ranges [m] where the first bin begins and the last ends; without, images: "
                   "2.25 11.25, recordings: as they say")
      ->expected(2)
      ->type_name("MIN MAX");
  command->add_option("--config", arguments->config.file,
                      "mission or vehicle file with a table range_detector");
  command->add_option("--set", arguments->config.settings,
                      "range_detector.key=value, any number of times; vog config lists the keys");
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments] { Detect(*arguments); });
}

// --- info ---

struct InfoArguments {
  std::string file;
  bool json = false;
};

/// Over all frames: of the window when it changes, first to last time.
Json InfoOf(const SonarRecording& recording) {
  const RecordingLayout& layout = recording.layout();
  double min_range_m = 0, max_range_m = 0;
  std::vector<Time> times;
  for (int i = 0; i < recording.size(); ++i) {
    const auto frame = recording.Frame(i);
    if (!frame) continue;
    min_range_m = times.empty() ? frame->min_range_m : std::min(min_range_m, frame->min_range_m);
    max_range_m = std::max(max_range_m, frame->max_range_m);
    times.push_back(frame->time);
  }
  Json info = {{"format", layout.format},    {"frames", times.size()},
               {"beams", layout.beams},      {"bins", layout.bins},
               {"min_range_m", min_range_m}, {"max_range_m", max_range_m},
               {"rate_hz", layout.rate_hz}};
  if (!times.empty()) {
    const double duration_s = ToSeconds(times.back() - times.front());
    info["first_utime_us"] = ToUtime(times.front());
    info["last_utime_us"] = ToUtime(times.back());
    if (duration_s > 0)
      info["measured_rate_hz"] = static_cast<double>(times.size() - 1) / duration_s;
  }
  info["fault"] = recording.Fault();
  return info;
}

void Info(const InfoArguments& arguments) {
  const RecordingFile file(arguments.file);
  const Json info = InfoOf(file.recording());
  if (arguments.json) {
    std::printf("%s\n", info.dump(2).c_str());
    return;
  }
  for (const auto& [key, value] : info.items())
    std::printf("%-17s %s\n", key.c_str(),
                value.is_string() ? value.get<std::string>().c_str() : value.dump().c_str());
}

void AddInfo(CLI::App& sonar) {
  auto* command = sonar.add_subcommand(
      "info", "What a recording (.ddf, .aris) holds: frames, beams, window, rate, times.");
  const auto arguments = std::make_shared<InfoArguments>();
  command->add_option("file", arguments->file, ".ddf or .aris file")->required();
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments] { Info(*arguments); });
}

// --- export ---

struct ExportArguments {
  std::string file, out;
};

void Export(const ExportArguments& arguments) {
  const RecordingFile file(arguments.file);
  const SonarRecording& recording = file.recording();
  const std::filesystem::path out(arguments.out);
  std::error_code error;
  std::filesystem::create_directories(out, error);
  if (error) throw UsageError(arguments.out + ": " + error.message());
  int written = 0;
  for (int i = 0; i < recording.size(); ++i) {
    const auto frame = recording.Frame(i);
    if (!frame) continue;
    char name[32];
    std::snprintf(name, sizeof(name), "frame_%06d.pgm", i);
    WriteFileAtomically(out / name, ToPgm(*frame));
    ++written;
  }
  std::printf("%d frames in %s\n", written, arguments.out.c_str());
}

void AddExport(CLI::App& sonar) {
  auto* command = sonar.add_subcommand(
      "export",
      "Write a recording's frames as images, frame_000000.pgm and so on: a row a range bin, "
      "a column a beam.");
  const auto arguments = std::make_shared<ExportArguments>();
  command->add_option("file", arguments->file, ".ddf or .aris file")->required();
  command->add_option("--out", arguments->out, "folder for the images")->required();
  command->callback([arguments] { Export(*arguments); });
}

}  // namespace

void AddSonarCommand(CLI::App& app) {
  auto* sonar =
      app.add_subcommand("sonar", "Find ranges in an imaging sonar's frames; look at recordings.");
  sonar->require_subcommand(1);
  AddDetect(*sonar);
  AddInfo(*sonar);
  AddExport(*sonar);
}

}  // namespace vog
