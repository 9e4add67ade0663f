#include <arpa/inet.h>
#include <gtest/gtest.h>

#include <memory>

#include "hardware/link/link_testing.h"
#include "hardware/link/sockets.h"
#include "hardware/link/tcp_client_link.h"
#include "hardware/link/udp_link.h"
#include "hardware/link/unique_fd.h"
#include "lib/base/errors.h"

namespace vog {
namespace {

sockaddr_in LocalAddress(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

/// A socket on this machine at `port`, or at any that is free where it is 0.
UniqueFd BoundSocket(int type, std::uint16_t port) {
  UniqueFd fd(socket(AF_INET, type | SOCK_NONBLOCK, 0));
  SetOption(fd.get(), SOL_SOCKET, SO_REUSEADDR, 1, "SO_REUSEADDR");
  const sockaddr_in address = LocalAddress(port);
  EXPECT_EQ(bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return fd;
}

std::uint16_t PortOf(const UniqueFd& fd) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  getsockname(fd.get(), reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

std::uint16_t FreePort(int type) { return PortOf(BoundSocket(type, 0)); }

std::string At(std::uint16_t port) { return "127.0.0.1:" + std::to_string(port); }

/// A server for one client.
class Server {
 public:
  explicit Server(std::uint16_t port = 0) : listener_(BoundSocket(SOCK_STREAM, port)) {
    listen(listener_.get(), 1);
  }

  std::uint16_t port() const { return PortOf(listener_); }
  bool Accept() {
    client_ = UniqueFd(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK));
    return client_.is_open();
  }
  void Send(const std::string& text) { send(client_.get(), text.data(), text.size(), 0); }
  std::string Received() {
    std::string text(1 << 20, '\0');
    const ssize_t size = recv(client_.get(), text.data(), text.size(), 0);
    return text.substr(0, size > 0 ? static_cast<std::size_t>(size) : 0);
  }

 private:
  UniqueFd listener_, client_;
};

TEST(TcpClientLinkTest, BytesPassBothWays) {
  Server server;
  TcpClientLink dut(At(server.port()));
  ASSERT_TRUE(StepUntil(dut, [&] { return dut.is_open() && server.Accept(); }));
  server.Send(AllBytes());
  EXPECT_EQ(Gather(dut, 256), AllBytes());
  WriteText(dut, AllBytes());
  std::string received;
  EXPECT_TRUE(StepUntil(dut, [&] { return (received += server.Received()).size() >= 256; }));
  EXPECT_EQ(received, AllBytes());
  EXPECT_EQ(dut.counters().reconnects, 0);
}

TEST(TcpClientLinkTest, AServerThatIsKilledAndRestartedIsFoundAgain) {
  auto server = std::make_unique<Server>();
  const std::uint16_t port = server->port();
  TcpClientLink dut(At(port));
  for (int times = 0; times < 3; ++times) {
    ASSERT_TRUE(StepUntil(dut, [&] { return dut.is_open() && server->Accept(); }));
    EXPECT_EQ(dut.counters().reconnects, times);
    server->Send("hello");
    EXPECT_EQ(Gather(dut, 5), "hello");
    server.reset();
    EXPECT_TRUE(StepUntil(dut, [&] { return ReadText(dut).empty() && !dut.is_open(); }));
    WriteText(dut, "lost");
    EXPECT_EQ(dut.counters().dropped, times + 1);
    StepUntil(dut, [&, steps = 0]() mutable { return ++steps > 20; });  // Refused meanwhile.
    server = std::make_unique<Server>(port);
  }
  EXPECT_GT(dut.counters().errors, 0);
}

TEST(TcpClientLinkTest, WritingToAServerThatIsGoneClosesTheLink) {
  auto server = std::make_unique<Server>();
  TcpClientLink dut(At(server->port()));
  ASSERT_TRUE(StepUntil(dut, [&] { return dut.is_open() && server->Accept(); }));
  server.reset();
  EXPECT_TRUE(StepUntil(dut, [&] {
    WriteText(dut, "into the void");
    return !dut.is_open();
  }));
  EXPECT_GT(dut.counters().errors, 0);
}

TEST(TcpClientLinkTest, AServerThatIsNotThereIsAskedLessAndLess) {
  TcpClientLink dut(At(FreePort(SOCK_STREAM)));
  std::vector<int> attempts;
  for (int ms = 0; ms < 30'000; ++ms) {
    const std::int64_t before = dut.counters().errors;
    dut.Step(Time(std::chrono::milliseconds(ms)));
    if (dut.counters().errors > before) attempts.push_back(ms);
  }
  // After 10, 20, 40 ... 2560 ms and then every 5 s; a refusal is noticed at once or a step later.
  ASSERT_GE(attempts.size(), 14u);
  ASSERT_LE(attempts.size(), 15u);
  EXPECT_NEAR(attempts[1] - attempts[0], 10, 2);
  EXPECT_NEAR(attempts[2] - attempts[1], 20, 2);
  EXPECT_NEAR(attempts[13] - attempts[12], 5000, 2);
}

TEST(TcpClientLinkTest, WhatWaitsIsBounded) {
  Server server;
  TcpClientLink dut(At(server.port()));
  ASSERT_TRUE(StepUntil(dut, [&] { return dut.is_open() && server.Accept(); }));
  const std::string block(16'384, 'x');
  const int writes = 2000;
  for (int i = 0; i < writes; ++i) WriteText(dut, block);  // Nobody reads.
  EXPECT_GT(dut.counters().dropped, 0);
  EXPECT_GT(dut.counters().stalls, 0);
  const std::int64_t sent = 16'384 * (writes - dut.counters().dropped);
  std::int64_t received = 0;
  EXPECT_TRUE(StepUntil(dut, [&] {
    received += static_cast<std::int64_t>(server.Received().size());
    return received >= sent;
  }));
  EXPECT_EQ(received, sent);
}

TEST(TcpClientLinkTest, AddressesThatAreNoneAreRefused) {
  for (const char* address :
       {"", "host", ":1", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:65536", "h:x"})
    EXPECT_THROW(TcpClientLink{address}, UsageError) << address;
}

TEST(UdpLinkTest, DatagramsStayWholeAndHaveTheKernelsTime) {
  const std::uint16_t a = FreePort(SOCK_DGRAM);
  UdpLink receiver(a, std::nullopt);
  const std::uint16_t b = FreePort(SOCK_DGRAM);
  UdpLink sender(b, At(a));
  const std::vector<std::string> sent = {"one", AllBytes(), "", std::string(8200, 'x')};
  const Time before = SystemNow();
  for (const std::string& datagram : sent) WriteText(sender, datagram);
  for (const std::string& datagram : sent) {
    std::string text(10'000, '\0');
    const ByteRead read =
        receiver.Read({reinterpret_cast<std::uint8_t*>(text.data()), text.size()});
    EXPECT_EQ(read.outcome, ReadOutcome::kData);
    EXPECT_EQ(text.substr(0, read.size), datagram);
    EXPECT_LT(std::abs(ToSeconds(read.time - before)), 60);
  }
  EXPECT_EQ(ReadText(receiver), "");
  EXPECT_EQ(receiver.counters().bytes_in, sender.counters().bytes_out);
}

TEST(UdpLinkTest, WhatTheKernelLosesIsCounted) {
  const std::uint16_t port = FreePort(SOCK_DGRAM);
  UdpLink receiver(port, std::nullopt);
  UdpLink sender(FreePort(SOCK_DGRAM), At(port));
  std::int64_t sent = 0, received = 0;
  const auto read_all = [&] {
    while (!ReadText(receiver).empty()) ++received;
  };
  for (; sent < 5000; ++sent) WriteText(sender, std::string(1000, 'x'));
  read_all();
  WriteText(sender, "the next one says how many were lost");
  ++sent;
  read_all();
  EXPECT_GT(receiver.counters().dropped, 0);
  EXPECT_EQ(received + receiver.counters().dropped, sent - sender.counters().dropped);
}

TEST(UdpLinkTest, ADatagramThatDoesNotFitIsAnError) {
  const std::uint16_t port = FreePort(SOCK_DGRAM);
  UdpLink receiver(port, std::nullopt);
  UdpLink sender(FreePort(SOCK_DGRAM), At(port));
  WriteText(sender, "0123456789");
  EXPECT_EQ(ReadText(receiver, 4), "0123");
  EXPECT_EQ(receiver.counters().errors, 1);
  EXPECT_EQ(ReadText(receiver, 4), "");
}

TEST(UdpLinkTest, WithoutAPeerWritesAreDropped) {
  UdpLink dut(FreePort(SOCK_DGRAM), std::nullopt);
  WriteText(dut, "lost");
  EXPECT_EQ(dut.counters().dropped, 1);
  EXPECT_EQ(dut.counters().errors, 0);
}

TEST(UdpLinkTest, APortThatIsTakenIsSaid) {
  const std::uint16_t port = FreePort(SOCK_DGRAM);
  const UdpLink first(port, std::nullopt);
  EXPECT_THROW(UdpLink(port, std::nullopt), SystemError);
}

}  // namespace
}  // namespace vog
