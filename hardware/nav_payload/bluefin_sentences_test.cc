#include "hardware/nav_payload/bluefin_sentences.h"

#include <gtest/gtest.h>

#include <numbers>

#include "hardware/nav_payload/random_formats_testing.h"
#include "hardware/nav_payload/time_of_day.h"

namespace vog {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

template <class Kind>
Kind Parsed(std::string_view line) {
  const auto result = ParseSentence(line);
  if (const auto* error = std::get_if<SentenceError>(&result)) {
    ADD_FAILURE() << line << ": error " << static_cast<int>(*error);
    return {};
  }
  return std::get<Kind>(std::get<Sentence>(result));
}

SentenceError ErrorOf(std::string_view line) {
  const auto result = ParseSentence(line);
  EXPECT_TRUE(std::holds_alternative<SentenceError>(result)) << line;
  return std::get<SentenceError>(result);
}

/// With its check sum, which FormatSentence() would give only to sentences that are whole.
std::string Signed(const std::string& body) {
  std::uint8_t sum = 0;
  for (const char c : body) sum ^= static_cast<std::uint8_t>(c);
  char text[4];
  std::snprintf(text, sizeof text, "*%02x", sum);
  return "$" + body + text;
}

TEST(BluefinSentencesTest, ReadsWhatTheVehicleIsKnownToSend) {
  const auto sus = Parsed<SusSentence>("$BPSUS,123456.78*4D");
  EXPECT_EQ(sus.time, FromSeconds(12 * 3600 + 34 * 60 + 56.78));
  const auto ghp = Parsed<GhpSentence>("$BPGHP,123456.78,1.5,2.0,1.2*40\r\n");
  EXPECT_EQ(ghp.horizontal_m, 1.5);
  EXPECT_EQ(ghp.vertical_m, 2);
  EXPECT_EQ(ghp.distance_m, 1.2);
  const auto pit = Parsed<PitSentence>("$BFPIT,123456.78,-90.0,0.0*57");
  EXPECT_NEAR(pit.dvl_pitch_rad, -90 * kDeg, 1e-12);
  const auto cnv = Parsed<CnvSentence>("$BFCNV,1468966347.175925,1.00,2.00,3.45,12.3*53");
  EXPECT_EQ(ToUtime(cnv.time_nav), 1468966347175925);
  EXPECT_EQ(cnv.z_m, 3.45);
  EXPECT_NEAR(cnv.heading_rad, 12.3 * kDeg, 1e-12);
  const auto rnv = Parsed<RnvSentence>(
      "$BFRNV,123456.78,0.10,-1.25,1.02,12.3,3.45,271.2,-0.4,1.1,1468966347.175925*7D");
  ASSERT_TRUE(rnv.absolute);
  EXPECT_EQ(rnv.vertical_m, -1.25);
  EXPECT_EQ(rnv.absolute->depth_m, 3.45);
  EXPECT_NEAR(rnv.absolute->heading_rad, 271.2 * kDeg, 1e-12);
  EXPECT_NEAR(rnv.absolute->roll_rad, -0.4 * kDeg, 1e-12);
  EXPECT_NEAR(rnv.absolute->pitch_rad, 1.1 * kDeg, 1e-12);
  EXPECT_EQ(rnv.absolute->time_nav, cnv.time_nav);
}

TEST(BluefinSentencesTest, TheCheckSumMayHaveEitherCaseAndLogMayHaveNone) {
  Parsed<SusSentence>("$BPSUS,123456.78*4d");
  const auto log = Parsed<LogSentence>("$BPLOG,ALL,ON\r\n");
  EXPECT_EQ(log.wanted, "ALL");
  EXPECT_TRUE(log.on);
  EXPECT_FALSE(Parsed<LogSentence>("$BPLOG,PIT,OFF").on);
  EXPECT_EQ(ErrorOf("$BPSUS,123456.78"), SentenceError::kNoSentence);
}

TEST(BluefinSentencesTest, SaysWhatIsWrong) {
  EXPECT_EQ(ErrorOf(""), SentenceError::kNoSentence);
  EXPECT_EQ(ErrorOf("BPSUS,123456.78*4D"), SentenceError::kNoSentence);
  EXPECT_EQ(ErrorOf("$BPSUS,123456.78*4E"), SentenceError::kBadChecksum);
  EXPECT_EQ(ErrorOf("$BPSUS,123456.78*GG"), SentenceError::kBadChecksum);
  EXPECT_EQ(ErrorOf(Signed("BFXYZ,123456.78")), SentenceError::kUnknownId);
  EXPECT_EQ(ErrorOf(Signed("BPGHP,123456.78,1,2")), SentenceError::kWrongFieldCount);
  EXPECT_EQ(ErrorOf(Signed("BPGHP,123456.78,1,2,3,4")), SentenceError::kWrongFieldCount);
  EXPECT_EQ(ErrorOf(Signed("BPSUS")), SentenceError::kWrongFieldCount);
  for (const char* field : {"", "x", "1.2x", "nan", "inf", "1e300", "--1", "0x10"})
    EXPECT_EQ(ErrorOf(Signed(std::string("BPGHP,123456.78,1,2,") + field)),
              SentenceError::kBadField)
        << field;
  for (const char* time :
       {"", "12345", "1234567", "240000", "126000", "123460", "12-456", "123456,"})
    EXPECT_NE(ErrorOf(Signed(std::string("BPSUS,") + time)), SentenceError::kBadChecksum) << time;
}

TEST(BluefinSentencesTest, GarbageBeforeASentenceDoesNotMatter) {
  Parsed<SusSentence>("$BFNVG,1234$BPSUS,123456.78*4D");
}

TEST(BluefinSentencesTest, EmptyFieldsAreNotKnown) {
  const auto dvl = Parsed<DvlSentence>(Signed("BFDVL,120000.000,,,,,,,,4.5,120000.000"));
  for (const auto& velocity : dvl.velocity_m_s) EXPECT_FALSE(velocity);
  EXPECT_EQ(dvl.temperature_degc, 4.5);
  const auto nvg = Parsed<NvgSentence>(
      Signed("BFNVG,120000.000,4221.5,N,07105.25,W,1,,2.5,90.0,1.0,-2.0,120000.000"));
  EXPECT_FALSE(nvg.altitude_m);
  EXPECT_NEAR(nvg.latitude_rad.value(), (42 + 21.5 / 60) * kDeg, 1e-12);
  EXPECT_NEAR(nvg.longitude_rad.value(), -(71 + 5.25 / 60) * kDeg, 1e-12);
  EXPECT_EQ(ErrorOf(Signed("BFNVG,120000,4221.5,X,07105.25,W,1,,2.5,90,1,-2,120000")),
            SentenceError::kBadField);
}

TEST(BluefinSentencesTest, BothVersionsOfRnvAreRead) {
  EXPECT_FALSE(Parsed<RnvSentence>(Signed("BFRNV,120000.000,1,2,3,4")).absolute);
  EXPECT_EQ(ErrorOf(Signed("BFRNV,120000.000,1,2,3,4,5")), SentenceError::kWrongFieldCount);
}

TEST(BluefinSentencesTest, WhatIsWrittenIsReadBack) {
  for (int i = 0; i < 5000; ++i) {
    const Sentence sentence = RandomSentence(i);
    const std::string line = FormatSentence(sentence);
    const auto parsed = ParseSentence(line);
    ASSERT_TRUE(std::holds_alternative<Sentence>(parsed)) << line;
    EXPECT_EQ(std::get<Sentence>(parsed).index(), sentence.index());
    // What is read is within the text's steps, so its text is the same.
    ASSERT_EQ(FormatSentence(std::get<Sentence>(parsed)), line);
  }
}

TEST(BluefinSentencesTest, ValuesComeBackWithinAStep) {
  for (int i = 0; i < 1000; ++i) {
    Random random(2, "nvg", i);
    NvgSentence nvg;
    nvg.latitude_rad = random.Uniform(-1.57, 1.57);
    nvg.longitude_rad = random.Uniform(-3.14, 3.14);
    nvg.depth_m = random.Uniform(0, 100);
    nvg.heading_rad = random.Uniform(0, 6.28);
    nvg.time = FromSeconds(random.Uniform(0, 86399));
    const auto read = Parsed<NvgSentence>(FormatSentence(nvg));
    EXPECT_NEAR(*read.latitude_rad, *nvg.latitude_rad, 2e-10);
    EXPECT_NEAR(*read.longitude_rad, *nvg.longitude_rad, 2e-10);
    EXPECT_NEAR(*read.depth_m, *nvg.depth_m, 5.1e-4);
    EXPECT_NEAR(read.heading_rad, nvg.heading_rad, 5.1e-4 * kDeg);
    EXPECT_LE(std::abs((read.time - nvg.time).count()), 500);
  }
}

TEST(BluefinSentencesTest, NoTruncationOfASignedSentenceIsTaken) {
  for (int i = 0; i < 300; ++i) {
    const Sentence sentence = RandomSentence(i);
    if (std::holds_alternative<LogSentence>(sentence)) continue;  // May come without a check sum.
    const std::string line = FormatSentence(sentence);
    for (std::size_t size = 0; size + 2 < line.size(); ++size)
      EXPECT_TRUE(std::holds_alternative<SentenceError>(ParseSentence(line.substr(0, size))))
          << line;
  }
}

TEST(BluefinSentencesTest, NoFlippedBitIsTakenForAnotherSentence) {
  for (int i = 0; i < 200; ++i) {
    std::string line = FormatSentence(RandomSentence(i));
    line.resize(line.size() - 2);
    for (std::size_t bit = 0; bit < 8 * line.size(); ++bit) {
      std::string damaged = line;
      damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
      const auto parsed = ParseSentence(damaged);
      // A digit of the check sum in its other case says the same.
      if (const auto* sentence = std::get_if<Sentence>(&parsed)) {
        EXPECT_EQ(FormatSentence(*sentence), line + "\r\n") << damaged;
      }
    }
  }
}

TEST(BluefinSentencesTest, TextsCannotEndASentence) {
  AckSentence ack;
  ack.command = "BP,G*HP";
  ack.description = "a, b*$\n";
  const auto read = Parsed<AckSentence>(FormatSentence(ack));
  EXPECT_EQ(read.command, "BP G HP");
  EXPECT_EQ(read.description, "a,b");  // Blanks at the ends of fields are not kept.
}

TEST(TimeOfDayClockTest, MidnightIsTheNextDay) {
  const Time noon = FromUtime(1'468'929'600'000'000);  // 2016-07-19 12:00 UTC.
  EXPECT_EQ(TimeOfDay(noon), Duration(std::chrono::hours(12)));
  TimeOfDayClock dut(noon);
  const auto at = [&](const char* text) { return dut.ToTime(*ParseTimeOfDay(text)) - noon; };
  EXPECT_EQ(at("110000"), Duration(std::chrono::hours(-1)));  // Somewhat late is the same day,
  EXPECT_EQ(at("235959.999"), FromSeconds(12 * 3600 - 0.001));
  EXPECT_EQ(at("000000.000"), Duration(std::chrono::hours(12)));  // earlier by more the next.
  EXPECT_EQ(at("235900"), FromSeconds(12 * 3600 - 60));           // A late one of the day before.
  EXPECT_EQ(at("120000"), Duration(std::chrono::hours(24)));
}

TEST(TimeOfDayTest, IsWrittenRounded) {
  EXPECT_EQ(FormatTimeOfDay(FromSeconds(45296.7804)), "123456.780");
  EXPECT_EQ(FormatTimeOfDay(FromSeconds(86399.9999)), "000000.000");
  EXPECT_EQ(FormatTimeOfDay(Duration{}), "000000.000");
}

}  // namespace
}  // namespace vog
