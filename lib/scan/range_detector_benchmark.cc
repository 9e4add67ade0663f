#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "lib/scan/annotated_frames_testing.h"
#include "lib/scan/range_detector.h"
#include "lib/scan/sonar.h"

// Recall, precision, errors and false returns of range detectors on frames made after the published
// statistics of real ones and on frames that are unlike them; and what a frame costs.

namespace vog {
namespace {

using Detector = std::function<Bins(const SonarFrame&)>;

constexpr int kRounds = 10;

Bins FirstAbove(const SonarFrame& frame, double level) {
  Bins bins(frame.beams, -1);
  for (int i = static_cast<int>(frame.samples.size()) - 1; i >= 0; --i) {
    if (frame.samples[i] >= 255 * level) bins[i % frame.beams] = i / frame.beams;
  }
  return bins;
}

Bins StrongestAbove(const SonarFrame& frame, double level) {
  Bins bins(frame.beams, -1);
  std::vector<double> best(frame.beams, 255 * level);
  for (int i = 0; i < static_cast<int>(frame.samples.size()); ++i) {
    const int beam = i % frame.beams;
    if (frame.samples[i] > best[beam]) {
      best[beam] = frame.samples[i];
      bins[beam] = i / frame.beams;
    }
  }
  return bins;
}

Bins MatchedFilter(const SonarFrame& frame, double threshold) {
  const double bin_m = (frame.max_range_m - frame.min_range_m) / frame.bins;
  Bins bins(frame.beams, -1);
  for (int beam = 0; beam < frame.beams; ++beam) {
    double energy = 0, best = threshold;
    for (int bin = frame.bins - 1; bin >= 0; --bin) {
      energy = energy * std::exp(-10 * bin_m) + frame.samples[bin * frame.beams + beam] / 255.0;
      if (energy < best) continue;
      best = energy;
      bins[beam] = bin;
    }
  }
  return bins;
}

void Print(const std::string& name, const FrameStyle& style, const Detector& detector) {
  Score score = Measure(style, kRounds, detector);
  std::printf("| %-43s | %5.3f | %5.3f | %5.3f | %5d | %5.1f |\n", name.c_str(), score.recall(),
              score.near_recall(), score.precision(), score.Error90_bins(),
              static_cast<double>(score.false_in_empty) / kRounds);
}

std::vector<FrameStyle> Styles() {
  return {
      {},
      {.name = "everything x 0.5", .gain = 0.5},
      {.name = "everything x 2", .gain = 2},
      {.name = "background x 0.5", .noise_gain = 0.5},
      {.name = "background x 2", .noise_gain = 2},
      {.name = "echoes x 0.75", .echo_level = 69},
      {.name = "echoes x 1.4", .echo_level = 130},
      {.name = "clutter x 1.3", .clutter_gain = 1.3},
      {.name = "all beams alike", .beam_gain_spread = 1},
      {.name = "beams differ by 6", .beam_gain_spread = 6},
      {.name = "echoes 0.06 m", .echo_length_m = 0.06},
      {.name = "echoes 0.25 m", .echo_length_m = 0.25},
      {.name = "echoes are bells", .has_sharp_rise = false},
      {.name = "hardly any speckle", .speckle = 0.1},
      {.name = "bells with hardly any speckle", .speckle = 0.1, .has_sharp_rise = false},
      {.name = "fluctuation x 1.7", .echo_spread = 0.6},
      {.name = "crosstalk 6-9 dB", .crosstalk_min_db = 6, .crosstalk_max_db = 9},
      {.name = "crosstalk of the point spread", .crosstalk_min_db = 4.5, .crosstalk_max_db = 5.3},
      {.name = "crosstalk in the scale's dB", .is_logarithmic = true},
      {.name = "surfaces twice as steep", .is_turned = true}};
}

void PrintScores() {
  std::printf(
      "| detector or variation | recall | within 8 bins | precision | 90 %% error, bins | false in "
      "3 empty frames "
      "|\n");
  std::printf("|---|---|---|---|---|---|\n");
  Print("first >= 0.25", {}, [](const SonarFrame& frame) { return FirstAbove(frame, 0.25); });
  Print("first >= 0.35", {}, [](const SonarFrame& frame) { return FirstAbove(frame, 0.35); });
  Print("strongest >= 0.35", {},
        [](const SonarFrame& frame) { return StrongestAbove(frame, 0.35); });
  Print("matched filter >= 1", {}, [](const SonarFrame& frame) { return MatchedFilter(frame, 1); });
  for (const FrameStyle& style : Styles()) Print("DetectRanges, " + style.name, style, Detected);
}

void DetectOneFrame(benchmark::State& state) {
  const AnnotatedFrame made = AnnotatedFrames({}).Make(Sight::kBlades, 1);
  const std::vector<double> bearings_rad = BeamBearings(SonarOptions{});
  for (auto _ : state) benchmark::DoNotOptimize(DetectRanges({}, made.frame, bearings_rad));
}
BENCHMARK(DetectOneFrame)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace vog

int main(int argc, char** argv) {
  vog::PrintScores();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
