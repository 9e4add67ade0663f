#include "tools/report/settings.h"

#include <gtest/gtest.h>

namespace vog {
namespace {

TEST(SettingsTest, EveryValueHasItsName) {
  const auto settings = SettingsOf(
      "[mission]\nname = 'a \"b\"'\nmax_submaps = 5\n[scene.tank]\ngate = true\n"
      "[exploration]\nmin_m = [-1.5, 0, 2]\n[[keep_out]]\nmin_m = [1]\n[[keep_out]]\nmin_m = "
      "[2]\n");
  EXPECT_EQ(settings.size(), 6u);
  EXPECT_EQ(settings.at("mission.max_submaps"), "5");
  EXPECT_EQ(settings.at("scene.tank.gate"), "true");
  EXPECT_EQ(settings.at("exploration.min_m"), "[ -1.5, 0, 2 ]");
  EXPECT_EQ(settings.at("keep_out[1].min_m"), "[ 2 ]");
  EXPECT_NE(settings.at("mission.name").find("a \"b\""), std::string::npos);
}

TEST(SettingsTest, WhatIsNoTomlHasNone) {
  EXPECT_TRUE(SettingsOf("[mission\n").empty());
  EXPECT_TRUE(SettingsOf("").empty());
}

}  // namespace
}  // namespace vog
