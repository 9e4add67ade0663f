#pragma once

#include <algorithm>
#include <vector>

#include "lib/bus/stopwatch.h"

namespace vog {

/// The real time that `work()` takes.
template <class Work>
double SecondsOf(Work work) {
  const Stopwatch stopwatch;
  work();
  return stopwatch.seconds();
}

/// The median of what `measure()` returns in `repeats` calls. @pre repeats > 0.
template <class Measure>
double MedianOf(int repeats, Measure measure) {
  std::vector<double> values;
  for (int i = 0; i < repeats; ++i) values.push_back(measure());
  const auto middle = values.begin() + repeats / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The median time of `work()` in `repeats` calls.
template <class Work>
double MedianSeconds(int repeats, Work work) {
  return MedianOf(repeats, [&] { return SecondsOf(work); });
}

}  // namespace vog
