#pragma once

#include <deque>
#include <string>
#include <vector>

#include "hardware/link/backoff.h"
#include "hardware/link/link.h"
#include "hardware/link/unique_fd.h"

namespace vog {

/// Frames with (id & mask) == (this id & mask) pass.
struct CanFilter {
  std::uint32_t id = 0, mask = 0;
  bool extended = false;
};

/// A CAN interface of Linux (AF_CAN, raw), classic and FD. Error frames come as frames with
/// `error`; times are the kernel's. An interface that is down, gone or off the bus closes the link,
/// which opens again when the interface is up. At most kMaxWaiting frames wait to be sent; error
/// frames and those that the interface cannot send (FD where it is classic) are dropped.
class SocketCanLink : public CanLink {
 public:
  static constexpr std::size_t kMaxWaiting = 256;

  /// Without filters all frames pass. @throws SystemError where the kernel has no CAN.
  SocketCanLink(std::string interface, std::vector<CanFilter> filters);

  int fd() const override { return fd_.get(); }
  CanRead Read() override;
  void Write(const CanFrame& frame) override;
  void Step(Time now) override;

 private:
  UniqueFd Open() const;
  void Send();
  void Close();
  void Fail(int error);

  std::string interface_;
  std::vector<CanFilter> filters_;
  UniqueFd fd_;
  Backoff backoff_;
  bool was_open_ = false;
  std::uint32_t kernel_dropped_ = 0;
  std::deque<CanFrame> waiting_;
};

}  // namespace vog
