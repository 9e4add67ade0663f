#include "procs/sonar_reader/hauv_messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "procs/map_service/node_testing.h"
#include "procs/sonar_reader/sonar_reader_node.h"

namespace vog {
namespace {

std::unique_ptr<hauv::didson_t> FrameOf2016() {
  auto message = std::make_unique<hauv::didson_t>();
  message->m_nTransmitMode = 3;
  message->m_nWindowStart = 6;
  message->m_nWindowLength = 3;
  message->m_fSonarTilt = -20;
  message->m_dVehicleTime = 1468966347.25;
  for (int bin = 300; bin < 306; ++bin)
    for (int beam = 30; beam < 50; ++beam) message->m_cData[bin * 96 + beam] = 210;
  return message;
}

TEST(HauvFrameTest, TheTypeIsThatOfTheLogs) {
  EXPECT_EQ(static_cast<std::uint64_t>(hauv::didson_t::getHash()), 0x183799dfce714987u);
  EXPECT_EQ(FrameOf2016()->getEncodedSize(), 50189);
}

TEST(HauvFrameTest, AFrameBecomesTheScanThatItIs) {
  Bench bench;
  SonarReaderSettings settings;
  settings.run_id = Bench::kRun;
  ProcessBus bus(bench.queue, "dut", 10);
  SonarReaderNode dut(bus, settings);
  bench.queue.PublishAt(bench.queue.now(), "HAUV_DIDSON_FRAME", Encode(*FrameOf2016()));
  bench.RunFor(std::chrono::seconds(1));
  const Scan scan = *FromMessage(bench.Last(outputs::kScan));
  EXPECT_EQ(ToUtime(scan.time), 1468966347250000);
  EXPECT_NEAR(scan.min_range_m, 2.25, 1e-9);
  EXPECT_NEAR(scan.max_range_m, 11.25, 1e-9);
  for (int beam = 32; beam < 48; ++beam) {
    EXPECT_EQ(scan.beams[beam].status, BeamStatus::kReturn) << beam;
    EXPECT_NEAR(scan.beams[beam].range_m, 2.25 + 300.5 * 9 / 512, 0.06);
  }
  EXPECT_NE(scan.beams[5].status, BeamStatus::kReturn);
}

TEST(HauvFrameTest, WhatNoDidsonSaysIsNoFrame) {
  auto message = FrameOf2016();
  message->m_nWindowLength = 4;
  EXPECT_FALSE(FromMessage(*message));
  message = FrameOf2016();
  message->m_nWindowStart = -1;
  EXPECT_FALSE(FromMessage(*message));
  message = FrameOf2016();
  message->m_dVehicleTime = std::nan("");
  EXPECT_FALSE(FromMessage(*message));
}

}  // namespace
}  // namespace vog
