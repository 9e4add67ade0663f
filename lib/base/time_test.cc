#include "lib/base/time.h"

#include <gtest/gtest.h>

#include "lib/base/random.h"

namespace vog {
namespace {

TEST(TimeTest, MicrosecondsSurvive) {
  for (const std::int64_t utime_us :
       {std::int64_t{0}, std::int64_t{-1}, std::int64_t{1'700'000'000'123'456}})
    EXPECT_EQ(ToUtime(FromUtime(utime_us)), utime_us);
}

TEST(TimeTest, SecondsAreRoundedToTheNearestMicrosecond) {
  EXPECT_EQ(FromSeconds(0.2).count(), 200'000);
  EXPECT_EQ(FromSeconds(1e-6 * 0.6).count(), 1);
  EXPECT_EQ(FromSeconds(1e-6 * 0.4).count(), 0);
  EXPECT_EQ(FromSeconds(-1e-6 * 0.6).count(), -1);
  EXPECT_EQ(FromSeconds(-0.2).count(), -200'000);
}

TEST(TimeTest, SecondsOfAnyDateKeepTheirMicroseconds) {
  Random random(1, "time");
  for (int i = 0; i < 1000; ++i) {
    const Time time = FromUtime(static_cast<std::int64_t>(random.Uniform(-2e15, 2e15)));
    EXPECT_EQ(Time(FromSeconds(ToSeconds(time))), time);
  }
}

}  // namespace
}  // namespace vog
