#pragma once

#include <filesystem>

#include "hardware/link/stream_link.h"

namespace vog {

/// The far end of a serial line that a program in this machine opens: what a simulated device has
/// instead of a cable. `name` becomes a link to it and goes with it. What nobody reads is lost, as
/// on a cable.
class PtyLink : public StreamLink {
 public:
  /// @throws SystemError where `name` is there and no link, or cannot be made.
  explicit PtyLink(std::filesystem::path name);
  ~PtyLink() override;

 protected:
  UniqueFd Open() override;
  Progress CheckOpening(int) override { return Progress::kDone; }
  std::int64_t SendSome(int fd, std::span<const std::uint8_t> bytes) override;

 private:
  std::filesystem::path name_;
  UniqueFd device_;  ///< Held open, or the line would hang up whenever nobody else has it.
};

}  // namespace vog
