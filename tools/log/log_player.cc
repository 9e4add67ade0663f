#include "tools/log/log_player.h"

#include <algorithm>
#include <utility>

namespace vog {
namespace {

// Published in one go at most: between them the operator is heard.
constexpr int kMostAtOnce = 200;

}  // namespace

LogPlayer::LogPlayer(const std::string& log, const LogSelection& selection, double speed,
                     bool is_endless, Publish publish)
    : log_(log, selection),
      next_(log_.Next()),
      from_s_(selection.from_s),
      speed_(speed),
      is_endless_(is_endless),
      publish_(std::move(publish)),
      anchor_s_(selection.from_s) {}

double LogPlayer::PositionAt(double wall_s) const {
  return is_paused_ ? anchor_s_ : anchor_s_ + speed_ * (wall_s - anchor_wall_s_);
}

void LogPlayer::Anchor(double position_s, double wall_s) {
  anchor_s_ = position_s;
  anchor_wall_s_ = wall_s;
}

std::optional<double> LogPlayer::Play(double wall_s) {
  if (is_paused_) return std::nullopt;
  for (int left = kMostAtOnce; left > 0 && next_ && next_->at_s <= PositionAt(wall_s); --left)
    PublishNext();
  if (!next_ && is_endless_) {
    log_.SeekTo(from_s_);
    next_ = log_.Next();
    Anchor(from_s_, wall_s);
  }
  if (!next_) return std::nullopt;
  return std::max(0.0, (next_->at_s - PositionAt(wall_s)) / speed_);
}

void LogPlayer::PublishNext() {
  publish_(next_->event.channel, next_->event.bytes);
  ++published_;
  next_ = log_.Next();
}

void LogPlayer::TogglePause(double wall_s) {
  Anchor(PositionAt(wall_s), wall_s);
  is_paused_ = !is_paused_;
}

void LogPlayer::StepOne(double wall_s) {
  if (!next_) return;
  Anchor(next_->at_s, wall_s);
  is_paused_ = true;
  PublishNext();
}

void LogPlayer::SetSpeed(double speed, double wall_s) {
  Anchor(PositionAt(wall_s), wall_s);
  speed_ = speed;
}

void LogPlayer::Skip(double by_s, double wall_s) {
  Anchor(std::max(from_s_, PositionAt(wall_s) + by_s), wall_s);
  log_.SeekTo(anchor_s_);
  next_ = log_.Next();
}

}  // namespace vog
