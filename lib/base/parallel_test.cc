#include "lib/base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace vog {
namespace {

class ParallelTest : public testing::TestWithParam<int> {
 protected:
  ParallelTest() { SetParallelThreads(GetParam()); }
  ~ParallelTest() override { SetParallelThreads(0); }
};

TEST_P(ParallelTest, CallsEachIndexOnce) {
  for (const std::size_t count : {0u, 1u, 2u, 7u, 1000u}) {
    std::vector<std::atomic<int>> calls(count);
    ParallelFor(count, [&](std::size_t i) { ++calls.at(i); });
    for (const auto& called : calls) EXPECT_EQ(called, 1);
  }
}

TEST_P(ParallelTest, GivesWhatOneThreadGives) {
  std::vector<double> results(500), expected(500);
  const auto value = [](std::size_t i) { return std::sin(static_cast<double>(i)) / (1 + i); };
  for (std::size_t i = 0; i < expected.size(); ++i) expected[i] = value(i);
  ParallelFor(results.size(), [&](std::size_t i) { results[i] = value(i); });
  EXPECT_EQ(results, expected);
}

TEST_P(ParallelTest, PassesOnTheFailureOfTheSmallestIndexAfterAllHaveRun) {
  for (int round = 0; round < 20; ++round) {
    std::atomic<int> calls = 0;
    try {
      ParallelFor(100, [&](std::size_t i) {
        ++calls;
        if (i % 10 == 3) throw std::runtime_error(std::to_string(i));
      });
      FAIL();
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "3");
    }
    EXPECT_EQ(calls, 100);
  }
}

TEST_P(ParallelTest, MayBeNested) {
  std::atomic<int> calls = 0;
  ParallelFor(5, [&](std::size_t) { ParallelFor(6, [&](std::size_t) { ++calls; }); });
  EXPECT_EQ(calls, 30);
}

INSTANTIATE_TEST_SUITE_P(Threads, ParallelTest, testing::Values(0, 1, 2, 3, 8));

}  // namespace
}  // namespace vog
