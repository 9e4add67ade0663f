#include "hardware/nav_payload/hg1700.h"

#include <gtest/gtest.h>

#include "hardware/nav_payload/random_formats_testing.h"

namespace vog {
namespace {

TEST(Hg1700Test, TheCheckSequenceIsSdlcs) {
  const std::string text = "123456789";
  EXPECT_EQ(SdlcCheckOf({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}), 0x906E);
}

TEST(Hg1700Test, TheStepsAreTheManuals) {
  Hg1700Record record;
  record.increments.emplace();
  ByteVector bytes = EncodeHg1700(record, Hg1700Model::kAg17);
  StoreLittle(std::int16_t{1000}, 2, bytes);
  StoreLittle(std::int16_t{-1000}, 8, bytes);
  StoreLittle(std::int32_t{1} << 30, 18, bytes);
  StoreLittle(std::int32_t{1} << 27, 30, bytes);
  StoreLittle(SdlcCheckOf(ByteSpan(bytes).first(42)), 42, bytes);
  const auto fine = DecodeHg1700(bytes, Hg1700Model::kAg58);
  const auto coarse = DecodeHg1700(bytes, Hg1700Model::kAg62);
  ASSERT_TRUE(fine && coarse);
  EXPECT_NEAR(fine->rate_rad_s[0], 0.5722045898, 1e-9);
  EXPECT_NEAR(fine->acceleration_m_s2[0], -11.162109, 1e-5);
  EXPECT_NEAR(fine->increments->angle_rad[0], 0.125, 1e-12);
  EXPECT_NEAR(fine->increments->velocity_m_s[0], 0.3048, 1e-12);
  EXPECT_NEAR(coarse->increments->velocity_m_s[0], 0.6096, 1e-12);
}

TEST(Hg1700Test, WhatIsEncodedIsDecoded) {
  for (int i = 0; i < 1000; ++i) {
    const Hg1700Record record = RandomHg1700(i);
    const Hg1700Model model = static_cast<Hg1700Model>(i % 4);
    const ByteVector bytes = EncodeHg1700(record, model);
    const auto back = DecodeHg1700(bytes, model);
    ASSERT_TRUE(back);
    EXPECT_EQ(EncodeHg1700(*back, model), bytes);
    EXPECT_EQ(back->status, record.status);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(back->rate_rad_s[k], record.rate_rad_s[k], 3e-4);
      EXPECT_NEAR(back->acceleration_m_s2[k], record.acceleration_m_s2[k], 6e-3);
      if (record.increments) {
        EXPECT_NEAR(back->increments->velocity_m_s[k], record.increments->velocity_m_s[k], 3e-9);
      }
    }
  }
}

TEST(Hg1700Test, NeitherTruncationsNorFlippedBitsAreTaken) {
  for (int i = 0; i < 10; ++i) {
    ByteVector bytes = EncodeHg1700(RandomHg1700(i), Hg1700Model::kAg58);
    for (std::size_t size = 0; size < bytes.size(); ++size)
      EXPECT_FALSE(DecodeHg1700(ByteSpan(bytes).first(size), Hg1700Model::kAg58));
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      bytes[bit / 8] ^= 1 << bit % 8;
      EXPECT_FALSE(DecodeHg1700(bytes, Hg1700Model::kAg58)) << bit;
      bytes[bit / 8] ^= 1 << bit % 8;
    }
  }
}

TEST(Hg1700Test, TheFramerFindsMessagesBehindGarbage) {
  ByteVector stream = {0x0A, 0x02, 0x0A, 0x01, 0x0A};
  for (int i = 0; i < 5; ++i) {
    const ByteVector message = EncodeHg1700(RandomHg1700(i), Hg1700Model::kAg58);
    stream.insert(stream.end(), message.begin(), message.end());
  }
  ByteFramer dut = MakeHg1700Framer();
  EXPECT_EQ(dut.Add(stream).size(), 5u);
  EXPECT_EQ(dut.garbage_bytes(), 5);
}

}  // namespace
}  // namespace vog
