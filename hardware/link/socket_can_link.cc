#include "hardware/link/socket_can_link.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "hardware/link/sockets.h"
#include "lib/base/errors.h"

namespace vog {
namespace {

// Of received frames, about 770 bytes each; the kernel doubles it. As many as come in a second at
// 1 Mbit/s. Who has no right to so much (CAP_NET_ADMIN) gets what the system allows: some 500.
constexpr int kReceiveBuffer = 4 << 20;

UniqueFd OpenSocket() {
  return UniqueFd(socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
}

bool IsUp(int fd, const std::string& interface) {
  ifreq request{};
  std::strncpy(request.ifr_name, interface.c_str(), sizeof request.ifr_name - 1);
  if (ioctl(fd, SIOCGIFFLAGS, &request) != 0) return false;
  return (request.ifr_flags & IFF_UP) != 0 && (request.ifr_flags & IFF_RUNNING) != 0;
}

void AskForReceiveBuffer(int fd) {
  const int size = kReceiveBuffer;
  if (setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &size, sizeof size) != 0)
    SetOption(fd, SOL_SOCKET, SO_RCVBUF, size, "SO_RCVBUF");
}

void SetFilters(int fd, const std::vector<CanFilter>& filters) {
  if (filters.empty()) return;
  std::vector<can_filter> raw;
  raw.reserve(filters.size());
  for (const CanFilter& filter : filters)
    raw.push_back({filter.id | (filter.extended ? CAN_EFF_FLAG : 0), filter.mask | CAN_EFF_FLAG});
  if (setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, raw.data(),
                 static_cast<socklen_t>(raw.size() * sizeof raw[0])) != 0)
    throw SystemError(std::string("CAN filters: ") + std::strerror(errno));
}

CanFrame FromKernel(const canfd_frame& raw, std::size_t size, const ReceivedExtras& extras) {
  CanFrame frame;
  frame.error = (raw.can_id & CAN_ERR_FLAG) != 0;
  frame.extended = !frame.error && (raw.can_id & CAN_EFF_FLAG) != 0;
  frame.remote = !frame.error && (raw.can_id & CAN_RTR_FLAG) != 0;
  frame.id = raw.can_id & (frame.error      ? CAN_ERR_MASK
                           : frame.extended ? CAN_EFF_MASK
                                            : CAN_SFF_MASK);
  frame.fd = size == CANFD_MTU;
  frame.fd_flags = frame.fd ? raw.flags & (CANFD_BRS | CANFD_ESI) : 0;
  frame.size = std::min(raw.len, frame.fd ? kMaxFdSize : kMaxClassicSize);
  if (!frame.remote) std::copy_n(raw.data, frame.size, frame.data.begin());
  frame.time = extras.time.value_or(SystemNow());
  return frame;
}

canfd_frame ToKernel(const CanFrame& frame) {
  canfd_frame raw{};
  raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0) | (frame.remote ? CAN_RTR_FLAG : 0);
  raw.flags = frame.fd_flags;
  raw.len = frame.size;
  std::copy_n(frame.data.begin(), frame.size, raw.data);
  return raw;
}

}  // namespace

SocketCanLink::SocketCanLink(std::string interface, std::vector<CanFilter> filters)
    : interface_(std::move(interface)), filters_(std::move(filters)) {
  if (!OpenSocket().is_open())
    throw SystemError("the kernel has no CAN: " + std::string(std::strerror(errno)));
}

UniqueFd SocketCanLink::Open() const {
  UniqueFd fd = OpenSocket();
  if (!fd.is_open() || !IsUp(fd.get(), interface_)) return UniqueFd();
  SetOption(fd.get(), SOL_CAN_RAW, CAN_RAW_FD_FRAMES, 1, "CAN_RAW_FD_FRAMES");
  SetOption(fd.get(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, CAN_ERR_MASK, "CAN_RAW_ERR_FILTER");
  SetOption(fd.get(), SOL_SOCKET, SO_TIMESTAMP, 1, "SO_TIMESTAMP");
  SetOption(fd.get(), SOL_SOCKET, SO_RXQ_OVFL, 1, "SO_RXQ_OVFL");
  AskForReceiveBuffer(fd.get());
  SetFilters(fd.get(), filters_);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface_.c_str()));
  const auto* generic = reinterpret_cast<const sockaddr*>(&address);
  if (address.can_ifindex == 0 || bind(fd.get(), generic, sizeof address) != 0) return UniqueFd();
  return fd;
}

CanRead SocketCanLink::Read() {
  if (!fd_.is_open()) return {ReadOutcome::kClosed};
  canfd_frame raw{};
  ReceivedExtras extras;
  const std::int64_t size = Receive(fd_.get(), &raw, sizeof raw, extras);
  if (size < 0 && IsTryLater(errno)) return {};
  if (size < 0) {
    Fail(errno);
    return {fd_.is_open() ? ReadOutcome::kNothing : ReadOutcome::kClosed};
  }
  if (extras.dropped) {
    counters_.dropped += *extras.dropped - kernel_dropped_;
    kernel_dropped_ = *extras.dropped;
  }
  backoff_.Reset();
  const CanFrame frame = FromKernel(raw, static_cast<std::size_t>(size), extras);
  counters_.bytes_in += frame.size;
  counters_.errors += frame.error;
  // The controller is silent until it is restarted: whoever does that takes the interface down.
  if (frame.error && (frame.id & CAN_ERR_BUSOFF) != 0) Close();
  return {ReadOutcome::kData, frame};
}

void SocketCanLink::Write(const CanFrame& frame) {
  if (frame.error || !fd_.is_open() || waiting_.size() == kMaxWaiting) {
    ++counters_.dropped;
    return;
  }
  waiting_.push_back(frame);
  Send();
}

void SocketCanLink::Send() {
  while (fd_.is_open() && !waiting_.empty()) {
    const CanFrame& frame = waiting_.front();
    const canfd_frame raw = ToKernel(frame);
    if (write(fd_.get(), &raw, frame.fd ? CANFD_MTU : CAN_MTU) < 0) {
      if (IsTryLater(errno) || errno == ENOBUFS) {
        ++counters_.stalls;
        return;
      }
      // The frame is at fault or, when that closes the link, the interface.
      Fail(errno);
      counters_.dropped += fd_.is_open();
    } else {
      counters_.bytes_out += frame.size;
    }
    if (fd_.is_open()) waiting_.pop_front();
  }
}

void SocketCanLink::Fail(int error) {
  ++counters_.errors;
  if (error == ENETDOWN || error == ENODEV || error == ENXIO || error == EBADF) Close();
}

void SocketCanLink::Close() {
  fd_.Close();
  counters_.dropped += static_cast<std::int64_t>(waiting_.size());
  waiting_.clear();
}

void SocketCanLink::Step(Time now) {
  if (!fd_.is_open() && backoff_.IsDue(now)) {
    backoff_.Fail(now);
    fd_ = Open();
    kernel_dropped_ = 0;
    counters_.reconnects += fd_.is_open() && was_open_;
    was_open_ = was_open_ || fd_.is_open();
  }
  Send();
}

}  // namespace vog
