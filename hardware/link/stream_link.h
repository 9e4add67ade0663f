#pragma once

#include <vector>

#include "hardware/link/backoff.h"
#include "hardware/link/link.h"
#include "hardware/link/unique_fd.h"

namespace vog {

/// A stream of bytes that may break and is opened again: what serial lines and TCP have in common.
/// At most kMaxWaiting bytes wait to be sent; those that wait when it breaks are dropped.
class StreamLink : public ByteLink {
 public:
  static constexpr std::size_t kMaxWaiting = 1 << 16;

  int fd() const override { return fd_.get(); }
  ByteRead Read(std::span<std::uint8_t> into) override;
  void Write(std::span<const std::uint8_t> bytes) override;
  void Step(Time now) override;

  bool is_open() const { return state_ == State::kOpen; }

 protected:
  /// Begins to open it. Nothing (a closed descriptor) where that cannot be now.
  virtual UniqueFd Open() = 0;
  enum class Progress { kPending, kDone, kFailed };
  /// How far the opening of `fd` has come.
  virtual Progress CheckOpening(int fd) = 0;
  /// As write(2), without a signal where the other end is gone.
  virtual std::int64_t SendSome(int fd, std::span<const std::uint8_t> bytes) = 0;

  /// Takes a descriptor that is open already.
  void Adopt(UniqueFd fd);

 private:
  enum class State { kClosed, kOpening, kOpen };

  void Attempt(Time now);
  void Send();
  void Close();

  State state_ = State::kClosed;
  UniqueFd fd_;
  Backoff backoff_;
  bool was_open_ = false;
  std::vector<std::uint8_t> waiting_;
};

}  // namespace vog
