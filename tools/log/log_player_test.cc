#include "tools/log/log_player.h"

#include "lib/base/errors.h"
#include "tools/log/keyboard.h"
#include "tools/log/log_testing.h"

namespace vog {
namespace {

/// Plays a log with a message a second: "0" to "9".
class LogPlayerTest : public LogTest {
 protected:
  void Make(const LogSelection& selection = {}, double speed = 1, bool is_endless = false) {
    std::vector<LogEvent> events;
    for (int i = 0; i < 10; ++i) events.push_back(EventAt(i, "A", std::to_string(i)));
    player_.emplace(
        Write("a.log", events), selection, speed, is_endless,
        [this](const std::string&, Bytes bytes) { said_.append(bytes.begin(), bytes.end()); });
  }
  std::string SaidUntil(double wall_s) {
    wait_s_ = player_->Play(wall_s);
    return std::exchange(said_, "");
  }

  std::optional<LogPlayer> player_;
  std::optional<double> wait_s_;
  std::string said_;
};

TEST_F(LogPlayerTest, KeepsThePace) {
  Make();
  EXPECT_EQ(SaidUntil(0), "0");
  EXPECT_NEAR(*wait_s_, 1, 1e-9);
  EXPECT_EQ(SaidUntil(2.5), "12");
  EXPECT_NEAR(*wait_s_, 0.5, 1e-9);
  player_->SetSpeed(4, 2.5);
  EXPECT_NEAR(player_->PositionAt(3), 4.5, 1e-9);
  EXPECT_EQ(SaidUntil(3), "34");
  EXPECT_EQ(SaidUntil(100), "56789");
  EXPECT_TRUE(player_->HasEnded());
  EXPECT_EQ(player_->published(), 10);
}

TEST_F(LogPlayerTest, PausesAndSteps) {
  Make();
  SaidUntil(1.5);
  player_->TogglePause(1.5);
  EXPECT_EQ(SaidUntil(50), "");
  EXPECT_FALSE(wait_s_);
  player_->StepOne(50);
  player_->StepOne(51);
  EXPECT_EQ(SaidUntil(52), "23");
  EXPECT_NEAR(player_->PositionAt(60), 3, 1e-9);
  player_->TogglePause(60);
  EXPECT_EQ(SaidUntil(61.1), "4");
  player_->StepOne(61.1);  // Pauses what plays.
  EXPECT_TRUE(player_->is_paused());
}

TEST_F(LogPlayerTest, Skips) {
  Make();
  SaidUntil(1);
  player_->Skip(5.5, 1);
  EXPECT_EQ(SaidUntil(1), "");
  EXPECT_EQ(SaidUntil(1.6), "7");
  player_->Skip(-100, 2);
  EXPECT_EQ(SaidUntil(2), "0");
  player_->Skip(100, 2);
  SaidUntil(2);
  EXPECT_TRUE(player_->HasEnded());
}

TEST_F(LogPlayerTest, PlaysAPartAgainAndAgain) {
  Make({".*", 3, 5}, 1, true);
  EXPECT_EQ(SaidUntil(0), "3");
  EXPECT_EQ(SaidUntil(2), "45");
  EXPECT_EQ(SaidUntil(2.5), "3");
  player_->Skip(-10, 2.5);
  EXPECT_EQ(SaidUntil(2.5), "3");
  EXPECT_FALSE(player_->HasEnded());
}

TEST_F(LogPlayerTest, ManyAtOnceComeInPortions) {
  const std::vector<LogEvent> events(1000, EventAt(0, "A", "x"));
  LogPlayer player(Write("many.log", events), {}, 1, false, [](const std::string&, Bytes) {});
  EXPECT_EQ(player.Play(0), 0);
  EXPECT_LT(player.published(), 1000);
  while (!player.HasEnded()) player.Play(0);
  EXPECT_EQ(player.published(), 1000);
}

TEST(Keyboard, KnowsKeys) {
  EXPECT_EQ(ParseKeys(" s+-q"),
            (std::vector<Key>{Key::kPause, Key::kStep, Key::kFaster, Key::kSlower, Key::kQuit}));
  EXPECT_EQ(ParseKeys("\033[C\033[Dxx\033[A"), (std::vector<Key>{Key::kForward, Key::kBack}));
  EXPECT_TRUE(ParseKeys("").empty());
}

}  // namespace
}  // namespace vog
