#include "tools/launch/procman_messages.h"

#include <gtest/gtest.h>

#include <limits>

namespace vog {
namespace {

// Published with bot2-procman: others' sheriffs and deputies know the types by these.
TEST(ProcmanMessages, FingerprintsAreProcmans) {
  const auto fingerprint = [](std::int64_t hash) { return static_cast<std::uint64_t>(hash); };
  EXPECT_EQ(fingerprint(bot_procman::orders2_t::getHash()), 0xef1277a9fdb17943u);
  EXPECT_EQ(fingerprint(bot_procman::info2_t::getHash()), 0xd0cf2ed34edd8314u);
  EXPECT_EQ(fingerprint(bot_procman::printf_t::getHash()), 0x0abac44d8e3a7badu);
  EXPECT_EQ(fingerprint(bot_procman::discovery_t::getHash()), 0x1116e1fff6333a71u);
}

TEST(ProcmanMessages, ACommandComesBackTheSame) {
  CommandSpec spec{"n", "localhost", "A=1 x 'y z'", "g/h", true, 15, 3};
  EXPECT_EQ(procman::FromMessage(procman::ToMessage(spec)), spec);
}

TEST(ProcmanMessages, WhatCannotBeHasDefaults) {
  bot_procman::command2_t message{};
  EXPECT_EQ(procman::FromMessage(message), CommandSpec{});
  message.command_name = std::string("a\0b", 3);
  message.stop_signal = -1;
  message.stop_time_allowed = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(procman::FromMessage(message).name, "a");
  EXPECT_EQ(procman::FromMessage(message).stop_signal, 2);
  EXPECT_EQ(procman::FromMessage(message).stop_time_allowed_s, 7);
  message.stop_time_allowed = std::numeric_limits<float>::infinity();
  EXPECT_EQ(procman::FromMessage(message).stop_time_allowed_s, 3600);
}

TEST(ProcmanMessages, TheReasonForGivingUpTravels) {
  bot_procman::command2_t message{};
  EXPECT_EQ(procman::GivenUp(message), "");
  procman::SetGivenUp(message, "why");
  bot_procman::command2_t read{};
  ASSERT_TRUE(Decode(Encode(message), read));
  EXPECT_EQ(procman::GivenUp(read), "why");
}

}  // namespace
}  // namespace vog
