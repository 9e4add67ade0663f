#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <memory>

#include "hardware/frames/candump.h"
#include "hardware/nav_payload/line_splitter.h"
#include "hardware/nav_payload/paroscientific.h"
#include "hardware/nav_payload/random_formats_testing.h"

namespace vog {
namespace {

/// One decoder over a stream of bytes.
struct Stream {
  virtual ~Stream() = default;
  /// Good records in `chunk`, and those that it completes.
  virtual int Add(ByteSpan chunk) = 0;
  virtual std::size_t buffered_bytes() const = 0;
};

class FrameStream : public Stream {
 public:
  FrameStream(ByteFramer framer, std::function<bool(ByteSpan)> decode)
      : framer_(std::move(framer)), decode_(std::move(decode)) {}

  int Add(ByteSpan chunk) override {
    int good = 0;
    for (const ByteVector& frame : framer_.Add(chunk)) good += decode_(frame);
    return good;
  }
  std::size_t buffered_bytes() const override { return framer_.buffered_bytes(); }

 private:
  ByteFramer framer_;
  std::function<bool(ByteSpan)> decode_;
};

class LineStream : public Stream {
 public:
  explicit LineStream(std::function<bool(const std::string&)> decode)
      : decode_(std::move(decode)) {}

  int Add(ByteSpan chunk) override {
    int good = 0;
    for (const std::string& line : splitter_.Add(chunk)) good += decode_(line);
    return good;
  }
  std::size_t buffered_bytes() const override { return splitter_.buffered_bytes(); }

 private:
  LineSplitter splitter_;
  std::function<bool(const std::string&)> decode_;
};

ByteVector ToBytes(std::string_view text) { return {text.begin(), text.end()}; }

bool DecodeCandump(const std::string& line, CanRecordReader& reader) {
  const auto parsed = ParseCandumpLine(line);
  return parsed && reader.Add(parsed->frame);
}

ByteVector EncodeCandump(int seed) {
  CanRecordWriter writer;
  std::vector<CanFrame> frames;
  for (int counter = 0; counter <= seed % 16; ++counter)
    frames = writer.Write(RandomCanRecord(seed));
  std::string text;
  for (const CanFrame& frame : frames) text += FormatCandumpLine({"vcan0", frame}) + "\n";
  return ToBytes(text);
}

bool DecodeParos(const std::string& line) {
  return ParseParosReply(line).has_value() || ParseParosCommand(line).has_value();
}

/// A format: valid bytes, and a fresh decoder of them that holds at most `max_buffered`.
struct Format {
  const char* name;
  std::size_t max_buffered;
  ByteVector (*encode)(int seed);
  std::function<std::unique_ptr<Stream>()> make;
};

template <class Function>
std::function<std::unique_ptr<Stream>()> Lines(Function decode) {
  return [decode] { return std::make_unique<LineStream>(decode()); };
}

std::vector<Format> AllFormats() {
  return {
      {"bluefin", 512, [](int seed) { return ToBytes(FormatSentence(RandomSentence(seed))); },
       Lines([] {
         return [](const std::string& line) {
           return std::holds_alternative<Sentence>(ParseSentence(line));
         };
       })},
      {"pd0", kMaxPd0Size, [](int seed) { return EncodePd0(RandomPd0(seed)); },
       [] {
         return std::make_unique<FrameStream>(
             MakePd0Framer(), [](ByteSpan frame) { return DecodePd0(frame).has_value(); });
       }},
      {"pd45", kMaxPd45Size, [](int seed) { return EncodePd45(RandomPd45(seed)); },
       [] {
         return std::make_unique<FrameStream>(
             MakePd45Framer(), [](ByteSpan frame) { return DecodePd45(frame).has_value(); });
       }},
      {"pd6", 512, [](int seed) { return ToBytes(FormatPd6(RandomPd6(seed))); }, Lines([] {
         return [reader = Pd6Reader()](const std::string& line) mutable {
           return reader.Add(line).has_value();
         };
       })},
      {"hg1700", kMaxHg1700Size,
       [](int seed) { return EncodeHg1700(RandomHg1700(seed), Hg1700Model::kAg58); },
       [] {
         return std::make_unique<FrameStream>(MakeHg1700Framer(), [](ByteSpan frame) {
           return DecodeHg1700(frame, Hg1700Model::kAg58).has_value();
         });
       }},
      {"paroscientific", 512,
       [](int seed) {
         return ToBytes(seed % 2 ? FormatParosReply(0.01 * (seed % 1000))
                                 : FormatParosCommand({ParosCommand::kUnit, 1, 2}));
       },
       Lines([] { return &DecodeParos; })},
      {"can", 512, &EncodeCandump, Lines([] {
         return [reader = CanRecordReader()](const std::string& line) mutable {
           return DecodeCandump(line, reader);
         };
       })},
  };
}

ByteVector Garbage(Random& random, int size) {
  ByteVector bytes;
  for (int i = 0; i < size; ++i) bytes.push_back(random.Index(256));
  return bytes;
}

/// A place within `bytes`, or its end.
ByteVector::iterator Place(Random& random, ByteVector& bytes) {
  return bytes.begin() + random.Index(static_cast<int>(bytes.size()) + 1);
}

void Mutate(Random& random, const ByteVector& other, ByteVector& bytes) {
  switch (random.Index(5)) {
    case 0:
      for (int i = random.Index(8); i >= 0 && !bytes.empty(); --i)
        bytes[random.Index(static_cast<int>(bytes.size()))] ^= 1 << random.Index(8);
      break;
    case 1:
      bytes.erase(Place(random, bytes), bytes.end());
      break;
    case 2: {
      const ByteVector copy = bytes;
      bytes.insert(Place(random, bytes), copy.begin(), copy.end());
      break;
    }
    case 3: {
      const ByteVector garbage = Garbage(random, random.Index(100));
      bytes.insert(Place(random, bytes), garbage.begin(), garbage.end());
      break;
    }
    default: {  // A splice: the head of one, the tail of another.
      ByteVector tail = other;
      bytes.erase(Place(random, bytes), bytes.end());
      bytes.insert(bytes.end(), Place(random, tail), tail.end());
    }
  }
}

int CountOfInputs() {
  const char* set = std::getenv("VOG_FUZZ_INPUTS");
  return set ? std::atoi(set) : 20'000;
}

/// Feeds good records until one is decoded: at most so many bytes of them.
bool DecodesAgain(const Format& format, Stream& stream) {
  std::size_t fed = 0;
  for (int seed = 0; fed <= 2 * format.max_buffered + 1000; ++seed) {
    const ByteVector good = format.encode(seed);
    fed += good.size();
    if (stream.Add(good) > 0) return true;
  }
  return false;
}

class DecodersFuzzTest : public testing::TestWithParam<Format> {};

TEST_P(DecodersFuzzTest, LivesOnWhateverComes) {
  const Format& format = GetParam();
  const int inputs = CountOfInputs() / static_cast<int>(AllFormats().size());
  auto stream = format.make();
  for (int i = 0; i < inputs; ++i) {
    Random random(1, format.name, i);
    ByteVector bytes = format.encode(i);
    const ByteVector other = format.encode(i + 1);
    for (int k = random.Index(4); k >= 0; --k) Mutate(random, other, bytes);
    stream->Add(bytes);
    ASSERT_LE(stream->buffered_bytes(), format.max_buffered) << i;
    if (i % 10 == 0) {
      ASSERT_TRUE(DecodesAgain(format, *stream)) << i;
    }
  }
}

TEST_P(DecodersFuzzTest, PureGarbageIsNoRecordAndNoHarm) {
  const Format& format = GetParam();
  auto stream = format.make();
  Random random(2, format.name);
  for (int i = 0; i < 200; ++i) {
    stream->Add(Garbage(random, random.Index(2000)));
    ASSERT_LE(stream->buffered_bytes(), format.max_buffered);
  }
  EXPECT_TRUE(DecodesAgain(format, *stream));
}

INSTANTIATE_TEST_SUITE_P(All, DecodersFuzzTest, testing::ValuesIn(AllFormats()),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace vog
