#include "hardware/link/serial_link.h"

#include <asm/termbits.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>

#include <fstream>

#include "hardware/link/link_testing.h"
#include "hardware/link/pty_link.h"
#include "lib/base/errors.h"

namespace vog {
namespace {

/// A pseudo terminal: the device that a SerialLink opens, and what is wired to it.
class Pty {
 public:
  Pty() : fd_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    grantpt(fd_.get());
    unlockpt(fd_.get());
  }

  std::string device() const { return ptsname(fd_.get()); }
  int fd() const { return fd_.get(); }
  void Unplug() { fd_.Close(); }
  void Send(const std::string& text) {
    EXPECT_EQ(write(fd_.get(), text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  std::string Received() {
    std::string text(1 << 17, '\0');
    const ssize_t size = read(fd_.get(), text.data(), text.size());
    return text.substr(0, size > 0 ? static_cast<std::size_t>(size) : 0);
  }

 private:
  UniqueFd fd_;
};

TEST(SerialLinkTest, AllBytesPassBothWays) {
  Pty pty;
  SerialLink dut(pty.device(), 115'200);
  EXPECT_EQ(ReadText(dut), "");
  pty.Send(AllBytes());
  EXPECT_EQ(Gather(dut, 256), AllBytes());
  WriteText(dut, AllBytes());
  std::string received;
  EXPECT_TRUE(StepUntil(dut, [&] { return (received += pty.Received()).size() >= 256; }));
  EXPECT_EQ(received, AllBytes());
  EXPECT_EQ(dut.counters().bytes_in, 256);
  EXPECT_EQ(dut.counters().bytes_out, 256);
  EXPECT_EQ(dut.counters().errors, 0);
}

TEST(SerialLinkTest, TheRateMayBeAny) {
  Pty pty;
  SerialLink dut(pty.device(), 123'456);
  termios2 settings{};
  ASSERT_EQ(ioctl(pty.fd(), TCGETS2, &settings), 0);
  EXPECT_EQ(settings.c_ospeed, 123'456u);
  EXPECT_EQ(settings.c_ispeed, 123'456u);
  EXPECT_EQ(settings.c_cflag & CSIZE, static_cast<tcflag_t>(CS8));
  EXPECT_EQ(settings.c_lflag, 0u);
}

TEST(SerialLinkTest, NobodyElseMayOpenIt) {
  Pty pty;
  const SerialLink first(pty.device(), 9600);
  try {
    SerialLink second(pty.device(), 9600);
    ADD_FAILURE() << "was opened twice";
  } catch (const SystemError& error) {
    EXPECT_EQ(std::string(error.what()), pty.device() + ": in use by another program");
  }
}

TEST(SerialLinkTest, WhatIsNoSerialLineIsRefused) {
  EXPECT_THROW(SerialLink("/dev/null", 9600), SystemError);
}

TEST(SerialLinkTest, ADeviceThatIsUnpluggedIsOpenedWhenItComesBack) {
  const TestFolder folder;
  const std::string device = folder.File("ttyTEST");
  SerialLink dut(device, 9600);  // Not there yet.
  EXPECT_EQ(dut.fd(), -1);
  WriteText(dut, "lost");
  EXPECT_EQ(dut.counters().dropped, 1);
  for (int times = 0; times < 3; ++times) {
    Pty pty;
    std::filesystem::create_symlink(pty.device(), device);
    ASSERT_TRUE(StepUntil(dut, [&] { return dut.is_open(); }));
    EXPECT_EQ(dut.counters().reconnects, times);
    pty.Send("hello");
    EXPECT_EQ(Gather(dut, 5), "hello");
    std::filesystem::remove(device);
    pty.Unplug();
    std::uint8_t byte;
    EXPECT_EQ(dut.Read({&byte, 1}).outcome, ReadOutcome::kClosed);
    EXPECT_EQ(dut.fd(), -1);
  }
}

TEST(SerialLinkTest, WhatWaitsIsBounded) {
  Pty pty;
  SerialLink dut(pty.device(), 9600);
  const std::string kilobyte(1024, 'x');
  const int writes = 200;
  for (int i = 0; i < writes; ++i) WriteText(dut, kilobyte);  // Nobody reads.
  EXPECT_GT(dut.counters().stalls, 0);
  EXPECT_GT(dut.counters().dropped, 0);
  const std::int64_t sent = 1024 * (writes - dut.counters().dropped);
  std::int64_t received = 0;
  EXPECT_TRUE(StepUntil(dut, [&] {
    received += static_cast<std::int64_t>(pty.Received().size());
    return received >= sent;
  }));
  EXPECT_EQ(received, sent);
  EXPECT_EQ(dut.counters().bytes_out, sent);
}

TEST(PtyLinkTest, ItIsTheFarEndOfASerialLine) {
  TestFolder folder;
  const std::string name = folder.File("vehicle");
  auto dut = std::make_unique<PtyLink>(name);
  SerialLink reader(name, 115'200);
  WriteText(*dut, AllBytes());
  EXPECT_EQ(Gather(reader, 256), AllBytes());
  WriteText(reader, AllBytes());
  EXPECT_EQ(Gather(*dut, 256), AllBytes());
  dut.reset();
  EXPECT_FALSE(std::filesystem::is_symlink(name));
  dut = std::make_unique<PtyLink>(name);
  ASSERT_TRUE(StepUntil(reader, [&] { return reader.is_open(); }));
  WriteText(*dut, "again");
  EXPECT_EQ(Gather(reader, 5), "again");
  EXPECT_EQ(reader.counters().reconnects, 1);
}

TEST(PtyLinkTest, WhatNobodyReadsIsLost) {
  TestFolder folder;
  PtyLink dut(folder.File("vehicle"));
  for (int i = 0; i < 2000; ++i) WriteText(dut, AllBytes());
  EXPECT_GT(dut.counters().dropped, 0);
  SerialLink reader(folder.File("vehicle"), 115'200);
  std::string old;
  for (std::string text = ReadText(reader); !text.empty(); text = ReadText(reader)) old += text;
  EXPECT_LT(old.size(), 20'000u) << "what the system holds";
  WriteText(dut, "new");
  EXPECT_EQ(Gather(reader, 3), "new");
}

TEST(PtyLinkTest, AFileInItsPlaceStays) {
  TestFolder folder;
  const std::string name = folder.File("file");
  std::ofstream(name) << "precious";
  EXPECT_THROW(PtyLink{name}, SystemError);
  EXPECT_TRUE(std::filesystem::is_regular_file(name));
}

}  // namespace
}  // namespace vog
