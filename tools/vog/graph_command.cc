#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "lib/base/files.h"
#include "lib/base/log.h"
#include "lib/bus/stopwatch.h"
#include "lib/posegraph/chordal_start.h"
#include "lib/posegraph/g2o.h"
#include "lib/posegraph/robust_closures.h"
#include "tools/campaign/campaign.h"
#include "tools/graph/graph_bench.h"
#include "tools/vog/commands.h"

namespace vog {
namespace {

using Json = nlohmann::ordered_json;

const PoseGraphOptions kSolver{200, 1e-9};

void Print(const Json& json, bool as_json) {
  if (as_json) {
    std::printf("%s\n", json.dump(2).c_str());
    return;
  }
  for (const auto& [key, value] : json.items())
    std::printf("%-16s %s\n", key.c_str(),
                value.is_string() ? value.get<std::string>().c_str() : value.dump().c_str());
}

/// Reads a file and tells on standard error what in it was left out.
G2oFile Read(const std::string& path) {
  G2oFile file = ReadG2o(path);
  for (const auto& [tag, lines] : file.unknown)
    LogLine(path + ": left out " + std::to_string(lines) + " lines " + tag);
  return file;
}

/// How the numbers of a file are to be taken.
struct Reading {
  RotationInformation rotation = RotationInformation::kRadians;
  Objective objective = Objective::kGeodesic;
};

void AddReading(CLI::App& command, Reading& reading) {
  const std::map<std::string, Objective> objectives = {{"geodesic", Objective::kGeodesic},
                                                       {"chordal", Objective::kChordal}};
  const std::map<std::string, RotationInformation> rotations = {
      {"radians", RotationInformation::kRadians}, {"g2o", RotationInformation::kHalfAngles}};
  command
      .add_option("--objective", reading.objective,
                  "geodesic: the whole information; chordal: a weight for rotation and one for "
                  "translation an edge, for which certified optima are published")
      ->transform(CLI::CheckedTransformer(objectives).description(""))
      ->type_name("OBJECTIVE")
      ->default_str("geodesic");
  command
      .add_option("--rotation-information", reading.rotation,
                  "what the rotation part of an SE3 information matrix is about: radians, or g2o, "
                  "half of them")
      ->transform(CLI::CheckedTransformer(rotations).description(""))
      ->type_name("UNIT")
      ->default_str("radians");
}

void AddFile(CLI::App& command, const std::string& name, std::string& file) {
  command.add_option(name, file, ".g2o file")->required()->check(CLI::ExistingFile);
}

// --- optimize ---

struct OptimizeArguments {
  std::string in, out, robust = "none";
  Reading reading;
  bool json = false;
};

void Optimize(const OptimizeArguments& arguments) {
  G2oGraph g2o = Read(arguments.in).graph;
  const Stopwatch stopwatch;
  PoseGraph graph =
      ToPoseGraph(g2o, kSolver, arguments.reading.rotation, arguments.reading.objective);
  const double initial_cost = graph.Cost();
  RobustSummary summary;
  if (arguments.robust == "dcs") {
    summary = SolveRobustly(graph);
  } else {
    StartFromTheBetter(graph);
    summary.solve = graph.Solve();
    summary.iterations = summary.solve.iterations;
  }
  const double seconds = stopwatch.seconds();
  if (!summary.solve.usable)
    throw std::runtime_error(
        arguments.in + ": the solver found no lower cost; see vog graph check " + arguments.in);
  const std::size_t edges = g2o.edges.size();
  g2o.vertices = graph.nodes();
  for (auto number = summary.rejected.rbegin(); number != summary.rejected.rend(); ++number)
    g2o.edges.erase(g2o.edges.begin() + *number);
  WriteFileAtomically(arguments.out, ToG2oText(g2o));
  Print({{"nodes", g2o.vertices.size()},
         {"edges", edges},
         {"initial_cost", initial_cost},
         {"final_cost", summary.solve.final_cost},
         {"iterations", summary.iterations},
         {"seconds", seconds},
         {"rejected", summary.rejected.size()}},
        arguments.json);
}

void AddOptimize(CLI::App& graph) {
  auto* command = graph.add_subcommand(
      "optimize",
      "Find the poses of least cost, from the file's poses or a chordal initialisation, whichever "
      "costs less. Costs are sums of squares without 1/2.");
  const auto arguments = std::make_shared<OptimizeArguments>();
  AddFile(*command, "in", arguments->in);
  command->add_option("--out", arguments->out, "the .g2o file to write")->required();
  command
      ->add_option("--robust", arguments->robust,
                   "none, or dcs: start from odometry, the edges between vertices n and n+1, and "
                   "leave out the other edges that contradict it or each other")
      ->check(CLI::IsMember({"none", "dcs"}))
      ->capture_default_str();
  AddReading(*command, arguments->reading);
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments] { Optimize(*arguments); });
}

// --- check ---

struct CheckArguments {
  std::string file;
  Reading reading;
  int worst = 5;
  bool json = false;
};

/// The edges that fit the file's poses least.
Json WorstEdges(const PoseGraph& graph, int count) {
  std::vector<std::pair<double, const Constraint*>> edges;
  for (const auto& [number, constraint] : graph.constraints())
    edges.emplace_back(graph.ChiSquareOf(constraint), &constraint);
  std::stable_sort(edges.begin(), edges.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  if (edges.size() > static_cast<std::size_t>(count)) edges.resize(static_cast<std::size_t>(count));
  Json rows = Json::array();
  for (const auto& [chi_square, edge] : edges)
    rows.push_back({{"from", edge->from}, {"to", edge->to}, {"chi_square", chi_square}});
  return rows;
}

void Check(const CheckArguments& arguments) {
  const G2oFile file = ParseG2o(ReadFile(arguments.file), arguments.file);
  std::vector<std::string> problems = file.faults;
  const std::size_t parts = ConnectedParts(file.graph).size();
  if (parts > 1)
    problems.push_back(arguments.file + ": the graph falls into " + std::to_string(parts) +
                       " parts that no edge joins");
  const PoseGraph graph =
      ToPoseGraph(file.graph, {}, arguments.reading.rotation, arguments.reading.objective);
  const double cost = graph.Cost();
  const std::size_t edges = graph.constraints().size();
  Print({{"nodes", graph.nodes().size()},
         {"edges", file.graph.edges.size()},
         {"parts", parts},
         {"cost", cost},
         {"mean_chi_square", edges == 0 ? 0 : cost / static_cast<double>(edges)},
         {"worst_edges", WorstEdges(graph, arguments.worst)},
         {"unknown", file.unknown},
         {"problems", problems}},
        arguments.json);
  if (!problems.empty())
    throw std::runtime_error(arguments.file + ": " + std::to_string(problems.size()) +
                             " problems; the first: " + problems.front());
}

void AddCheck(CLI::App& graph) {
  auto* command = graph.add_subcommand("check",
                                       "What is wrong with a file: lines that make no sense, parts "
                                       "that no edge joins, and the edges "
                                       "that fit its poses least (chi-square; 99 % of good ones "
                                       "stay below 16.8). Exit status 1 when "
                                       "there are problems.");
  const auto arguments = std::make_shared<CheckArguments>();
  AddFile(*command, "file", arguments->file);
  command->add_option("--worst", arguments->worst, "how many of the worst edges to show")
      ->check(CLI::Range(0, 1000000))
      ->capture_default_str();
  AddReading(*command, arguments->reading);
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments] { Check(*arguments); });
}

// --- info ---

struct InfoArguments {
  std::string file;
  bool json = false;
};

void ShowInfo(const InfoArguments& arguments) {
  const G2oFile file = Read(arguments.file);
  const G2oGraph& graph = file.graph;
  const auto odometry = std::count_if(graph.edges.begin(), graph.edges.end(), [](const auto& edge) {
    return std::abs(edge.to - edge.from) == 1;
  });
  Eigen::AlignedBox3d bounds_W;
  for (const auto& [id, X_W] : graph.vertices) bounds_W.extend(X_W.translation());
  const auto corner = [&](const Vec3& p) {
    return bounds_W.isEmpty() ? Json(nullptr) : Json{p.x(), p.y(), p.z()};
  };
  Print({{"dimensions", graph.is_planar ? 2 : 3},
         {"nodes", graph.vertices.size()},
         {"edges", graph.edges.size()},
         {"odometry_edges", odometry},
         {"fixed", graph.fixed},
         {"parts", ConnectedParts(graph).size()},
         {"min_W_m", corner(bounds_W.min())},
         {"max_W_m", corner(bounds_W.max())},
         {"comments", file.comments},
         {"unknown", file.unknown}},
        arguments.json);
}

void AddInfo(CLI::App& graph) {
  auto* command = graph.add_subcommand("info", "What a file holds.");
  const auto arguments = std::make_shared<InfoArguments>();
  AddFile(*command, "file", arguments->file);
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments] { ShowInfo(*arguments); });
}

// --- bench ---

struct BenchArguments {
  std::string file, seeds = "1..10";
  Reading reading;
  GraphBenchOptions bench;
};

void Bench(BenchArguments& arguments) {
  const SeedRange seeds = ParseSeeds(arguments.seeds, "--seeds: ");
  arguments.bench.first_seed = seeds.first;
  arguments.bench.last_seed = seeds.last;
  BenchGraph(ToPoseGraph(Read(arguments.file).graph, kSolver, arguments.reading.rotation,
                         arguments.reading.objective),
             arguments.bench);
}

void AddBench(CLI::App& graph) {
  auto* command = graph.add_subcommand(
      "bench",
      "Add wrong closures to a file's graph, solve it as optimize --robust dcs does, and tell "
      "which closures were kept and how far the trajectory is from the one solved without wrong "
      "ones; then give it its last closures one at a time, and tell what each solve costs.");
  const auto arguments = std::make_shared<BenchArguments>();
  GraphBenchOptions& bench = arguments->bench;
  AddFile(*command, "file", arguments->file);
  command->add_option("--outliers", bench.shares, "shares of wrong closures among all, 0.1,0.5")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 0.95))
      ->capture_default_str();
  command->add_option("--seeds", arguments->seeds, "A..B: of the closures kept and the wrong ones")
      ->capture_default_str();
  command
      ->add_option("--closures", bench.outliers.closures, "true closures that are kept, by chance")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command
      ->add_option("--group", bench.outliers.group,
                   "wrong closures of neighbouring nodes that share one wrong registration")
      ->check(CLI::Range(1, 50))
      ->capture_default_str();
  command
      ->add_option("--shift", bench.outliers.shift_m,
                   "how far [m] wrong closures are from the truth; 0: anywhere")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--resolved", bench.resolved, "closures that come one at a time")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  AddReading(*command, arguments->reading);
  command->add_flag("--json", bench.json, "print JSON");
  command->callback([arguments] { Bench(*arguments); });
}

}  // namespace

void AddGraphCommand(CLI::App& app) {
  auto* graph = app.add_subcommand("graph", "Optimise, check, look at and try pose graphs (.g2o).");
  graph->require_subcommand(1);
  AddOptimize(*graph);
  AddCheck(*graph);
  AddInfo(*graph);
  AddBench(*graph);
}

}  // namespace vog
