#include "hardware/nav_payload/pressure.h"

#include <gtest/gtest.h>

#include "hardware/nav_payload/paroscientific.h"

namespace vog {
namespace {

PressureOptions InDecibar(double latitude_deg) {
  PressureOptions options;
  options.unit = PressureUnit::kDecibar;
  options.surface_dbar = 0;
  options.latitude_deg = latitude_deg;
  return options;
}

TEST(PressureTest, GivesUnescosDepths) {
  EXPECT_NEAR(ToDepth(1000, InDecibar(45)), 989.50, 0.005);
  EXPECT_NEAR(ToDepth(10'000, InDecibar(30)), 9712.653, 0.001);  // The paper's check value.
}

TEST(PressureTest, TheSurfaceIsAtTheSurface) {
  PressureOptions options;
  EXPECT_NEAR(ToDepth(14.6959, options), 0, 1e-3);
  EXPECT_NEAR(ToDepth(14.6959 + 14.5038, options), 9.93, 0.02);  // 10 dbar.
}

TEST(PressureTest, BothFormulasAreInvertedInAllUnits) {
  for (const auto formula : {DepthFormula::kUnesco, DepthFormula::kDensity}) {
    for (const auto unit :
         {PressureUnit::kPsi, PressureUnit::kMillibar, PressureUnit::kKilopascal,
          PressureUnit::kDecibar, PressureUnit::kBar, PressureUnit::kMetresOfWater}) {
      PressureOptions options;
      options.formula = formula;
      options.unit = unit;
      for (const double depth_m : {-0.5, 0.0, 3.0, 30.0, 300.0, 10'000.0})
        EXPECT_NEAR(ToDepth(ToGauge(depth_m, options), options), depth_m, 1e-6);
    }
  }
}

TEST(ParoscientificTest, ReadsReplies) {
  EXPECT_EQ(ParseParosReply("*000114.6959494"), 14.6959494);
  EXPECT_EQ(ParseParosReply("??*000114.6959494\r\n"), 14.6959494);
  EXPECT_EQ(ParseParosReply(FormatParosReply(29.5, 7)), 29.5);
  for (const char* line : {"", "*0001", "*010014.7", "*000014.7", "*0001-14.7", "*000114.7x",
                           "*00 114.7", "000114.7", "*00011.2.3"})
    EXPECT_FALSE(ParseParosReply(line)) << line;
}

TEST(ParoscientificTest, ReadsAndWritesCommands) {
  EXPECT_EQ(FormatParosCommand({ParosCommand::kContinuous}), "*0100P4\r\n");
  EXPECT_EQ(FormatParosCommand({ParosCommand::kSample}), "*0100P3\r\n");
  EXPECT_EQ(FormatParosCommand({ParosCommand::kUnit, 1, 1}), "*0100EW*0100UN=1\r\n");
  EXPECT_EQ(ParosPeriod(10), 13);
  for (const auto kind : {ParosCommand::kSample, ParosCommand::kContinuous, ParosCommand::kUnit,
                          ParosCommand::kPeriod}) {
    const ParosCommand command{kind, 12, kind >= ParosCommand::kUnit ? 8 : 0};
    EXPECT_EQ(ParseParosCommand(FormatParosCommand(command)), command);
  }
  for (const char* line : {"", "*01", "*0001P4", "*0000P4", "*0100P5", "*0100UN=1", "*0100P4x",
                           "*0100EW*0100UN=", "*0100EW*0200UN=1", "*0100EW*0100UN=x"})
    EXPECT_FALSE(ParseParosCommand(line)) << line;
}

}  // namespace
}  // namespace vog
