#include "hardware/link/socket_can_link.h"

#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>

#include <cstdlib>

#include "hardware/link/link_testing.h"
#include "hardware/link/sockets.h"
#include "lib/base/errors.h"

namespace vog {
namespace {

const std::string kInterface = "vogtest0";

CanFrame FrameOf(std::uint32_t id, std::uint8_t size) {
  CanFrame frame;
  frame.id = id;
  frame.size = size;
  for (int i = 0; i < size; ++i) frame.data[i] = static_cast<std::uint8_t>(i + 1);
  return frame;
}

bool Succeeds(const std::string& command) {
  return std::system((command + " >/dev/null 2>&1").c_str()) == 0;
}
bool IpLink(const std::string& words) { return Succeeds("ip link " + words); }

/// A virtual interface of the kernel's own, where the machine can have one.
class SocketCanLinkTest : public testing::Test {
 protected:
  void SetUp() override {
    const UniqueFd fd(socket(PF_CAN, SOCK_RAW, 0));
    if (!fd.is_open() && errno == EAFNOSUPPORT) GTEST_SKIP() << "the kernel has no CAN";
    IpLink("del " + kInterface);
    if (!IpLink("add " + kInterface + " type vcan"))
      GTEST_SKIP() << "no interface can be made: not root, or no vcan";
    ASSERT_TRUE(IpLink("set " + kInterface + " up"));
  }
  void TearDown() override { IpLink("del " + kInterface); }

  static void Connect(SocketCanLink& link) {
    ASSERT_TRUE(StepUntil(link, [&] { return link.fd() >= 0; }));
  }
  static CanRead ReadSoon(SocketCanLink& link) {
    CanRead read;
    StepUntil(link, [&] { return (read = link.Read()).outcome == ReadOutcome::kData; });
    return read;
  }
  /// Reads until the link has closed.
  static bool IsClosedSoon(SocketCanLink& link) {
    for (int i = 0; i < 1000; ++i) {
      if (link.Read().outcome == ReadOutcome::kClosed) return true;
      poll(nullptr, 0, 1);
    }
    return false;
  }
  /// What a controller reports, said by a socket of our own.
  static void SayError(std::uint32_t error_class) {
    const UniqueFd fd(socket(PF_CAN, SOCK_RAW, CAN_RAW));
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(if_nametoindex(kInterface.c_str()));
    ASSERT_EQ(bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    can_frame raw{};
    raw.can_id = CAN_ERR_FLAG | error_class;
    raw.can_dlc = CAN_ERR_DLC;
    ASSERT_EQ(write(fd.get(), &raw, sizeof raw), static_cast<ssize_t>(sizeof raw));
  }
};

TEST_F(SocketCanLinkTest, FramesOfAllKindsPass) {
  SocketCanLink a(kInterface, {}), b(kInterface, {});
  Connect(a);
  Connect(b);
  CanFrame extended = FrameOf(0x12345678, 5), remote = FrameOf(0x123, 0), fd = FrameOf(0x321, 48);
  CanFrame full = FrameOf(0, 64);
  extended.extended = true;
  remote.remote = true;
  remote.size = 4;
  fd.fd = full.fd = true;
  fd.fd_flags = 1;
  for (const CanFrame& frame : {FrameOf(0x7FF, 8), FrameOf(0, 0), extended, remote, fd, full}) {
    a.Write(frame);
    CanFrame received = ReadSoon(b).frame;
    EXPECT_GT(ToUtime(received.time), 0);
    received.time = {};
    EXPECT_EQ(received, frame);
  }
  EXPECT_EQ(a.Read().outcome, ReadOutcome::kNothing);  // Not what it said itself.
  EXPECT_EQ(a.counters().bytes_out, b.counters().bytes_in);
  EXPECT_EQ(a.counters().dropped + a.counters().errors + b.counters().errors, 0);
}

TEST_F(SocketCanLinkTest, FiltersKeepOthersOutButNoErrors) {
  SocketCanLink a(kInterface, {}), b(kInterface, {{0x110, 0x7F0, false}, {0x115, 0x7FF, true}});
  Connect(a);
  Connect(b);
  CanFrame extended = FrameOf(0x110, 3);
  extended.extended = true;
  for (const CanFrame& frame : {FrameOf(0x200, 1), extended, FrameOf(0x115, 2)}) a.Write(frame);
  EXPECT_EQ(ReadSoon(b).frame.size, 2);
  extended.id = 0x115;
  a.Write(extended);
  EXPECT_TRUE(ReadSoon(b).frame.extended);
  SayError(CAN_ERR_CRTL);
  EXPECT_TRUE(ReadSoon(b).frame.error);
  EXPECT_EQ(b.Read().outcome, ReadOutcome::kNothing);
}

TEST_F(SocketCanLinkTest, TimesAreTheKernels) {
  SocketCanLink a(kInterface, {}), b(kInterface, {});
  Connect(a);
  Connect(b);
  a.Write(FrameOf(1, 1));  // The kernel begins to stamp a moment after it is asked to.
  ReadSoon(b);
  poll(nullptr, 0, 100);
  const Time before = SystemNow();
  a.Write(FrameOf(2, 1));
  const Time written = SystemNow();
  poll(nullptr, 0, 200);
  const Time received = ReadSoon(b).frame.time;
  EXPECT_GE(received, before - std::chrono::microseconds(1));
  EXPECT_LE(received, written + std::chrono::microseconds(1));
}

TEST_F(SocketCanLinkTest, ErrorFramesAreReadAndNeverSent) {
  SocketCanLink a(kInterface, {}), b(kInterface, {});
  Connect(a);
  Connect(b);
  SayError(CAN_ERR_CRTL | CAN_ERR_PROT);
  const CanFrame frame = ReadSoon(b).frame;
  EXPECT_TRUE(frame.error);
  EXPECT_EQ(frame.id, static_cast<std::uint32_t>(CAN_ERR_CRTL | CAN_ERR_PROT));
  EXPECT_EQ(frame.size, CAN_ERR_DLC);
  EXPECT_EQ(b.counters().errors, 1);
  EXPECT_GE(b.fd(), 0);
  a.Write(frame);
  a.Write(FrameOf(5, 1));
  EXPECT_EQ(ReadSoon(b).frame.id, 5u);
  EXPECT_EQ(a.counters().dropped, 1);
}

TEST_F(SocketCanLinkTest, ABusThatIsOffIsOpenedAgain) {
  SocketCanLink a(kInterface, {}), b(kInterface, {});
  Connect(a);
  Connect(b);
  SayError(CAN_ERR_BUSOFF);
  EXPECT_EQ(ReadSoon(b).frame.id, CAN_ERR_BUSOFF);
  EXPECT_EQ(b.Read().outcome, ReadOutcome::kClosed);
  Connect(b);
  EXPECT_EQ(b.counters().reconnects, 1);
  a.Write(FrameOf(5, 1));
  EXPECT_EQ(ReadSoon(b).frame.id, 5u);
}

TEST_F(SocketCanLinkTest, AnInterfaceThatGoesDownIsFoundAgainWhenItIsUp) {
  SocketCanLink a(kInterface, {}), b(kInterface, {});
  for (int times = 0; times < 3; ++times) {
    Connect(a);
    Connect(b);
    EXPECT_EQ(b.counters().reconnects, times);
    a.Write(FrameOf(times + 1, 1));
    EXPECT_EQ(ReadSoon(b).frame.id, static_cast<std::uint32_t>(times + 1));
    ASSERT_TRUE(IpLink("set " + kInterface + " down"));
    EXPECT_TRUE(IsClosedSoon(b));
    a.Write(FrameOf(9, 1));  // Notices it while it writes.
    EXPECT_EQ(a.fd(), -1);
    EXPECT_EQ(a.counters().dropped, times + 1);
    EXPECT_EQ(a.counters().errors, times + 1);
    EXPECT_EQ(b.counters().errors, times + 1);
    StepUntil(b, [steps = 0]() mutable { return ++steps > 20; });
    EXPECT_EQ(b.fd(), -1);
    ASSERT_TRUE(IpLink("set " + kInterface + " up"));
  }
}

TEST_F(SocketCanLinkTest, AnInterfaceThatIsUnpluggedIsFoundAgain) {
  SocketCanLink a(kInterface, {}), b(kInterface, {});
  for (int times = 0; times < 3; ++times) {
    Connect(a);
    Connect(b);
    EXPECT_EQ(b.counters().reconnects, times);
    a.Write(FrameOf(times + 1, 1));
    EXPECT_EQ(ReadSoon(b).frame.id, static_cast<std::uint32_t>(times + 1));
    ASSERT_TRUE(IpLink("del " + kInterface));
    EXPECT_TRUE(IsClosedSoon(b));
    a.Write(FrameOf(9, 1));
    EXPECT_EQ(a.fd(), -1);
    EXPECT_EQ(a.counters().dropped, times + 1);
    ASSERT_TRUE(IpLink("add " + kInterface + " type vcan"));
    StepUntil(b, [steps = 0]() mutable { return ++steps > 20; });
    EXPECT_EQ(b.fd(), -1);  // It is there but down.
    ASSERT_TRUE(IpLink("set " + kInterface + " up"));
  }
}

TEST_F(SocketCanLinkTest, FdFramesThatAClassicInterfaceCannotSendAreDropped) {
  ASSERT_TRUE(IpLink("set " + kInterface + " down"));
  ASSERT_TRUE(IpLink("set " + kInterface + " mtu 16"));
  ASSERT_TRUE(IpLink("set " + kInterface + " up"));
  SocketCanLink a(kInterface, {}), b(kInterface, {});
  Connect(a);
  Connect(b);
  CanFrame fd = FrameOf(0x321, 48);
  fd.fd = true;
  a.Write(fd);
  a.Write(FrameOf(5, 1));
  EXPECT_EQ(ReadSoon(b).frame.id, 5u);
  EXPECT_EQ(a.counters().dropped, 1);
  EXPECT_EQ(a.counters().errors, 1);
  EXPECT_GE(a.fd(), 0);
}

TEST_F(SocketCanLinkTest, ASlowBusIsWaitedForAndWhatWaitsIsBounded) {
  // 1000 frames a second; ten of them fit into the interface's queue.
  if (!Succeeds("tc qdisc add dev " + kInterface + " root tbf rate 128kbit burst 100 limit 160"))
    GTEST_SKIP() << "the kernel cannot slow an interface down (tc, sch_tbf)";
  SocketCanLink a(kInterface, {}), b(kInterface, {});
  Connect(a);
  Connect(b);
  for (std::uint32_t id = 0; id < 200; ++id) a.Write(FrameOf(id, 8));
  EXPECT_GT(a.counters().stalls, 0);
  EXPECT_EQ(a.counters().dropped, 0);
  std::uint32_t received = 0;
  const auto read_all = [&] {
    for (CanRead read = b.Read(); read.outcome == ReadOutcome::kData; read = b.Read())
      EXPECT_EQ(read.frame.id, received++);
    return received == 200;
  };
  EXPECT_TRUE(StepUntil(a, read_all));
  EXPECT_EQ(a.counters().dropped, 0);
  for (int i = 0; i < 1000; ++i) a.Write(FrameOf(0x400, 8));
  EXPECT_GT(a.counters().dropped, 500);
  EXPECT_EQ(a.counters().errors, 0);
}

TEST_F(SocketCanLinkTest, FramesOfASecondWaitToBeReadAndLostOnesAreCounted) {
  SocketCanLink a(kInterface, {}), b(kInterface, {});
  Connect(a);
  Connect(b);
  const auto received_of = [&](std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i) a.Write(FrameOf(0x100, 8));
    std::int64_t received = 0;
    while (b.Read().outcome == ReadOutcome::kData) ++received;
    return received;
  };
  EXPECT_EQ(received_of(8'000), 8'000);
  EXPECT_EQ(b.counters().dropped, 0);
  std::int64_t received = received_of(40'000);
  received += received_of(1);  // The kernel says what was lost with the next frame.
  EXPECT_GT(b.counters().dropped, 0);
  EXPECT_EQ(received + b.counters().dropped, 40'001);
}

TEST_F(SocketCanLinkTest, AnInterfaceThatIsNotThereIsAwaited) {
  SocketCanLink dut("vcan_none", {});
  StepUntil(dut, [steps = 0]() mutable { return ++steps > 20; });
  EXPECT_EQ(dut.fd(), -1);
  EXPECT_EQ(dut.Read().outcome, ReadOutcome::kClosed);
  dut.Write(FrameOf(1, 1));
  EXPECT_EQ(dut.counters().dropped, 1);
}

TEST(SocketCanLinkWithoutCanTest, IsRefusedWithAReason) {
  if (UniqueFd(socket(PF_CAN, SOCK_RAW, 0)).is_open() || errno != EAFNOSUPPORT)
    GTEST_SKIP() << "the kernel has CAN";
  EXPECT_THROW(SocketCanLink("vcan0", {}), SystemError);
}

}  // namespace
}  // namespace vog
