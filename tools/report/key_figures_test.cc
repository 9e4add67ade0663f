#include "tools/report/key_figures.h"

#include <gtest/gtest.h>

namespace vog {
namespace {

constexpr auto kNone = std::nullopt;

TEST(KeyFiguresTest, ReadsAndScales) {
  const nlohmann::ordered_json metrics = {{"coverage", {{"surface", 0.5}, {"volume", nullptr}}}};
  const nlohmann::ordered_json timing = {{"wall_s", 2.0}};
  const KeyFigure surface{"", "", "/coverage/surface", "%", 1, 100};
  EXPECT_EQ(ValueOf(surface, metrics, timing), 50.0);
  EXPECT_EQ(ValueOf({"", "", "/coverage/volume", "%"}, metrics, timing), kNone);
  EXPECT_EQ(ValueOf({"", "", "/nothing/there", ""}, metrics, timing), kNone);
  EXPECT_EQ(ValueOf({"", "", "timing/wall_s", "s"}, metrics, timing), 2.0);
  EXPECT_EQ(ValueOf(surface, nullptr, nullptr), kNone);
}

TEST(KeyFiguresTest, ShowsValues) {
  const KeyFigure length{"", "", "", "m", 2}, count{"", "", "", "", 0};
  EXPECT_EQ(ShowValue(length, 1.239), "1.24 m");
  EXPECT_EQ(ShowValue(count, 3), "3");
  EXPECT_EQ(ShowValue(count, kNone), "–");
}

TEST(KeyFiguresTest, ShowsSpreads) {
  const KeyFigure length{"", "", "", "m", 2}, count{"", "", "", "", 0};
  EXPECT_EQ(ShowSpread(length, {1.0, 3.0}), "2.00 ± 1.41");
  EXPECT_EQ(ShowSpread(count, {1.0, 2.0, 4.0}), "2.3 ± 1.5");
  EXPECT_EQ(ShowSpread(length, {1.0}), "1.00");
  EXPECT_EQ(ShowSpread(length, {1.0, kNone, 3.0}), "2.00 ± 1.41 (2 of 3)");
  EXPECT_EQ(ShowSpread(length, {kNone, kNone}), "–");
}

}  // namespace
}  // namespace vog
