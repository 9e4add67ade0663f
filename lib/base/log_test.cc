#include "lib/base/log.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "lib/base/errors.h"

namespace vog {
namespace {

/// What RunMain() says and returns.
std::pair<int, std::string> Outcome(const std::function<int()>& body) {
  testing::internal::CaptureStderr();
  const int status = RunMain(body);
  return {status, testing::internal::GetCapturedStderr()};
}

TEST(RunMainTest, ReturnsTheBodysStatus) {
  EXPECT_EQ(Outcome([] { return 0; }), (std::pair<int, std::string>(0, "")));
  EXPECT_EQ(Outcome([] { return 5; }).first, 5);
}

TEST(RunMainTest, TurnsExceptionsIntoOneLineAndAStatus) {
  EXPECT_EQ(Outcome([]() -> int { throw UsageError("bad"); }),
            (std::pair<int, std::string>(2, "base_test: bad\n")));
  EXPECT_EQ(Outcome([]() -> int { throw SystemError("full"); }),
            (std::pair<int, std::string>(1, "base_test: full\n")));
  EXPECT_EQ(Outcome([]() -> int { throw std::logic_error("odd"); }),
            (std::pair<int, std::string>(1, "base_test: odd\n")));
}

}  // namespace
}  // namespace vog
