#include "hardware/link/stream_link.h"

#include <unistd.h>

#include <cerrno>
#include <utility>

#include "hardware/link/sockets.h"

namespace vog {

ByteRead StreamLink::Read(std::span<std::uint8_t> into) {
  if (state_ == State::kClosed) return {ReadOutcome::kClosed};
  if (state_ == State::kOpening || into.empty()) return {};
  const ssize_t size = read(fd_.get(), into.data(), into.size());
  if (size > 0) {
    counters_.bytes_in += size;
    backoff_.Reset();
    return {ReadOutcome::kData, static_cast<std::size_t>(size), SystemNow()};
  }
  if (size < 0 && IsTryLater(errno)) return {};
  if (size < 0) ++counters_.errors;
  Close();
  return {ReadOutcome::kClosed};
}

void StreamLink::Write(std::span<const std::uint8_t> bytes) {
  if (state_ != State::kOpen || waiting_.size() + bytes.size() > kMaxWaiting) {
    ++counters_.dropped;
    return;
  }
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
  Send();
}

void StreamLink::Send() {
  if (state_ != State::kOpen || waiting_.empty()) return;
  const std::int64_t size = SendSome(fd_.get(), waiting_);
  if (size > 0) {
    counters_.bytes_out += size;
    waiting_.erase(waiting_.begin(), waiting_.begin() + size);
  } else if (size < 0 && !IsTryLater(errno)) {
    ++counters_.errors;
    Close();
    return;
  }
  if (!waiting_.empty()) ++counters_.stalls;
}

void StreamLink::Step(Time now) {
  if (state_ == State::kClosed && backoff_.IsDue(now)) Attempt(now);
  if (state_ == State::kOpening) {
    const Progress progress = CheckOpening(fd_.get());
    if (progress == Progress::kDone) Adopt(std::move(fd_));
    if (progress == Progress::kFailed) Close();
  }
  Send();
}

/// The next attempt waits from now on, also where this one succeeds: a link that opens and breaks
/// at once is not opened in a rush. What it receives resets the wait.
void StreamLink::Attempt(Time now) {
  backoff_.Fail(now);
  fd_ = Open();
  if (fd_.is_open()) {
    state_ = State::kOpening;
  } else {
    ++counters_.errors;
  }
}

void StreamLink::Adopt(UniqueFd fd) {
  fd_ = std::move(fd);
  state_ = State::kOpen;
  counters_.reconnects += was_open_;
  was_open_ = true;
}

void StreamLink::Close() {
  fd_.Close();
  state_ = State::kClosed;
  counters_.dropped += !waiting_.empty();
  waiting_.clear();
}

}  // namespace vog
