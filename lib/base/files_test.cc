#include "lib/base/files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "lib/base/errors.h"
#include "lib/base/random.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

std::string RandomBytes(int size, int symbols, Random& random) {
  std::string bytes(size, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random.Index(symbols));
  return bytes;
}

class FilesTest : public testing::Test {
 protected:
  FilesTest() { fs::create_directories(folder_); }
  ~FilesTest() override { fs::remove_all(folder_); }

  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_))
      names.push_back(entry.path().filename().string());
    return names;
  }

  template <class Action>
  static std::string ErrorOf(Action action) {
    try {
      action();
    } catch (const SystemError& error) {
      return error.what();
    }
    return "no error";
  }

  Random random_{1, "files"};
  fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("files_") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(FilesTest, FilesReadBackAsWritten) {
  for (const int size : {0, 1, 4096, 65536, 200'001}) {
    const std::string bytes = RandomBytes(size, 256, random_);
    WriteFileAtomically(folder_ / "a", bytes);
    EXPECT_TRUE(ReadFile(folder_ / "a") == bytes) << size;
  }
  EXPECT_EQ(Names(), std::vector<std::string>{"a"});  // Nothing temporary is left.
}

TEST_F(FilesTest, AFailedWriteLeavesTheOldFileAndNothingElse) {
  fs::create_directories(folder_ / "target" / "full");  // A folder that no file can replace.
  const fs::path target = folder_ / "target";
  const std::string error = ErrorOf([&] { WriteFileAtomically(target, "new"); });
  EXPECT_TRUE(error.starts_with(target.string() + ": cannot replace: ")) << error;
  EXPECT_EQ(Names(), std::vector<std::string>{"target"});
  EXPECT_TRUE(fs::is_directory(target / "full"));
}

TEST_F(FilesTest, AWriteIntoNowhereIsTold) {
  const fs::path target = folder_ / "none" / "a";
  const std::string error = ErrorOf([&] { WriteFileAtomically(target, "new"); });
  EXPECT_TRUE(error.starts_with(target.string())) << error;
  EXPECT_NE(error.find("cannot create: No such file or directory"), std::string::npos) << error;
  EXPECT_EQ(error.find('\n'), std::string::npos);
}

TEST_F(FilesTest, ALeftoverOfACrashIsOverwritten) {
  std::ofstream(folder_ / "a.tmp") << "half of something that was longer";
  WriteFileAtomically(folder_ / "a", "new");
  EXPECT_EQ(ReadFile(folder_ / "a"), "new");
  EXPECT_EQ(Names(), std::vector<std::string>{"a"});
}

TEST_F(FilesTest, WhatCannotBeReadIsTold) {
  const fs::path none = folder_ / "none";
  EXPECT_EQ(ErrorOf([&] { ReadFile(none); }),
            none.string() + ": cannot read: No such file or directory");
  EXPECT_TRUE(ErrorOf([&] { ReadFile(folder_); }).starts_with(folder_.string() + ": cannot read"));
}

TEST_F(FilesTest, AFileInPiecesIsThereWhenItIsCommitted) {
  WriteFileAtomically(folder_ / "a", "old");
  {
    AtomicFileWriter dropped(folder_ / "a");
    dropped.Write("new");
  }
  EXPECT_EQ(ReadFile(folder_ / "a"), "old");
  AtomicFileWriter file(folder_ / "a");
  file.Write("new, ");
  file.Write("in pieces");
  EXPECT_EQ(ReadFile(folder_ / "a"), "old");
  file.Commit();
  EXPECT_EQ(ReadFile(folder_ / "a"), "new, in pieces");
  EXPECT_EQ(Names(), std::vector<std::string>{"a"});
}

TEST_F(FilesTest, TellsWhetherAFileHoldsBytes) {
  WriteFileAtomically(folder_ / "a", "bytes");
  EXPECT_TRUE(FileHolds(folder_ / "a", "bytes"));
  EXPECT_FALSE(FileHolds(folder_ / "a", "bites"));
  EXPECT_FALSE(FileHolds(folder_ / "a", "bytes and more"));
  EXPECT_FALSE(FileHolds(folder_ / "none", ""));
  EXPECT_FALSE(FileHolds(folder_ / "a" / "below", "bytes"));
  const auto state = StateOf(folder_);
  ASSERT_TRUE(state);
  EXPECT_FALSE(FileHolds(folder_, std::string(state->size, ' ')));
}

TEST_F(FilesTest, TellsSizeAndTimeOfAFile) {
  WriteFileAtomically(folder_ / "a", "bytes");
  const auto before = StateOf(folder_ / "a");
  ASSERT_TRUE(before);
  EXPECT_EQ(before->size, 5u);
  fs::last_write_time(folder_ / "a",
                      fs::last_write_time(folder_ / "a") + std::chrono::nanoseconds(1));
  EXPECT_EQ(StateOf(folder_ / "a")->modified_ns, before->modified_ns + 1);
  EXPECT_FALSE(StateOf(folder_ / "none"));
}

TEST_F(FilesTest, AMappedFileStaysWhatItWas) {
  WriteFileAtomically(folder_ / "a", "old");
  const auto mapped = MappedFile::Open(folder_ / "a");
  ASSERT_NE(mapped, nullptr);
  WriteFileAtomically(folder_ / "a", "another");
  EXPECT_EQ(mapped->bytes(), "old");
  fs::remove(folder_ / "a");
  EXPECT_EQ(mapped->bytes(), "old");
  EXPECT_EQ(mapped->state().size, 3u);
  WriteFileAtomically(folder_ / "empty", "");
  for (const char* name : {"a", "empty", "."})
    EXPECT_EQ(MappedFile::Open(folder_ / name), nullptr) << name;
}

TEST(Checksum64Test, NoticesEveryFlippedBitAndMissingByte) {
  Random random(5, "files");
  for (const int size : {1, 7, 8, 63, 64, 65, 200}) {
    const std::string bytes = RandomBytes(size, 256, random);
    const std::uint64_t sum = Checksum64(bytes);
    EXPECT_EQ(Checksum64(std::string(bytes)), sum);
    EXPECT_NE(Checksum64(bytes.substr(1)), sum);
    EXPECT_NE(Checksum64(bytes + '\0'), sum);
    for (int first = 0; first < 8 * size; ++first) {
      std::string damaged = bytes;
      damaged[first / 8] ^= 1 << first % 8;
      EXPECT_NE(Checksum64(damaged), sum) << first;
      const int second = random.Index(8 * size);
      damaged[second / 8] ^= 1 << second % 8;
      EXPECT_EQ(Checksum64(damaged) == sum, first == second) << first << " " << second;
    }
  }
}

TEST(Crc32Test, IsThatOfZlibAndPng) {
  EXPECT_EQ(Crc32(""), 0u);
  EXPECT_EQ(Crc32("123456789"), 0xcbf43926u);  // The check value of CRC-32/ISO-HDLC.
  EXPECT_EQ(ToHex(Crc32("123456789")), "cbf43926");
  EXPECT_EQ(ToHex(0x2a), "0000002a");
}

TEST(ToTextTest, ReadsBackExactlyAndIsShort) {
  EXPECT_EQ(ToText(0.1), "0.1");
  EXPECT_EQ(ToText(0.095), "0.095");
  EXPECT_EQ(ToText(-2), "-2");
  Random random(2, "files");
  for (int i = 0; i < 1000; ++i) {
    const double value = random.Gaussian(1) * std::pow(10, random.Uniform(-300, 300));
    EXPECT_EQ(std::strtod(ToText(value).c_str(), nullptr), value);
  }
  for (const double value : {0.0, std::numeric_limits<double>::max(),
                             std::numeric_limits<double>::denorm_min(), -1e-300})
    EXPECT_EQ(std::strtod(ToText(value).c_str(), nullptr), value);
}

TEST(CompressTest, BytesSurvive) {
  Random random(3, "files");
  for (const int size : {0, 1, 100, 100'000}) {
    for (const int symbols : {1, 4, 256}) {
      const std::string bytes = RandomBytes(size, symbols, random);
      const auto read = Decompress(Compress(bytes), bytes.size());
      ASSERT_TRUE(read);
      EXPECT_TRUE(*read == bytes);
    }
  }
}

TEST(CompressTest, DamageIsTold) {
  Random random(4, "files");
  const std::string bytes = RandomBytes(500, 256, random), compressed = Compress(bytes);
  for (std::size_t size = 0; size < compressed.size(); ++size)
    EXPECT_FALSE(Decompress(compressed.substr(0, size), bytes.size())) << size;
  EXPECT_FALSE(Decompress(compressed, bytes.size() - 1));
  EXPECT_FALSE(Decompress(compressed, bytes.size() + 1));
  EXPECT_FALSE(Decompress(compressed, 0));
  for (std::size_t bit = 0; bit < 8 * compressed.size(); ++bit) {
    std::string damaged = compressed;
    damaged[bit / 8] ^= 1 << bit % 8;
    const auto read = Decompress(damaged, bytes.size());
    EXPECT_TRUE(!read || *read == bytes) << bit;  // Some header bits mean nothing.
  }
}

}  // namespace
}  // namespace vog
