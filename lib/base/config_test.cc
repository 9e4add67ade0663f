#include "lib/base/config.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "lib/base/random.h"

namespace vog {
namespace {

namespace fs = std::filesystem;

enum class Shape { kRound, kSquare };

struct AllKinds {
  bool flag = false;
  int count = 3;
  std::int64_t big = 0;
  double size_m = 1.5;
  std::string name = "nobody";
  Eigen::Vector3d place_m = {1, 2, 3};
  Shape shape = Shape::kRound;
  std::vector<std::string> words = {"a", "b"}, colours;

  void Visit(OptionsVisitor& v) {
    v("flag", flag, "a flag");
    v("count", count, Between(1, 10), "a count");
    v("big", big, AtLeast(0), "a large count");
    v("size_m", size_m, Between(0, 100), "a size");
    v("name", name, "a name");
    v("place_m", place_m, Between(-10, 10), "a place");
    v("shape", shape, Names<Shape>{{Shape::kRound, "round"}, {Shape::kSquare, "square"}},
      "a shape");
    v("words", words, {}, "words");
    v("colours", colours, {"red", "blue"}, "colours");
  }
};

AllKinds Read(const std::string& text) {
  return Config::Parse(text, "a.toml").Read<AllKinds>("kinds");
}

template <class Action>
std::string ErrorOf(Action action) {
  try {
    action();
  } catch (const UsageError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ConfigTest, AbsentKeysAndTablesKeepTheirDefaults) {
  for (const char* text : {"", "[kinds]\n", "[other]\nx = 1\n"}) {
    const AllKinds read = Read(text);
    EXPECT_FALSE(read.flag);
    EXPECT_EQ(read.count, 3);
    EXPECT_EQ(read.size_m, 1.5);
    EXPECT_EQ(read.name, "nobody");
    EXPECT_EQ(read.place_m, Eigen::Vector3d(1, 2, 3));
    EXPECT_EQ(read.shape, Shape::kRound);
    EXPECT_EQ(read.words, std::vector<std::string>({"a", "b"}));
  }
}

TEST(ConfigTest, ReadsEachKind) {
  const AllKinds read = Read(
      "[kinds]\nflag = true\ncount = 7\nbig = 9007199254740993\nsize_m = 2\nname = \"x\"\n"
      "place_m = [1, -2.5, 3e0]\nshape = \"square\"\nwords = [\"c\"]\n"
      "colours = [\"blue\", \"red\"]\n");
  EXPECT_TRUE(read.flag);
  EXPECT_EQ(read.count, 7);
  EXPECT_EQ(read.big, 9007199254740993);  // More than a double holds.
  EXPECT_EQ(read.size_m, 2);              // An integer is a number, too.
  EXPECT_EQ(read.name, "x");
  EXPECT_EQ(read.place_m, Eigen::Vector3d(1, -2.5, 3));
  EXPECT_EQ(read.shape, Shape::kSquare);
  EXPECT_EQ(read.words, std::vector<std::string>({"c"}));
  EXPECT_EQ(read.colours, std::vector<std::string>({"blue", "red"}));
  EXPECT_TRUE(Read("[kinds]\nwords = []\n").words.empty());
}

TEST(ConfigTest, BoundsAreAllowedAndNothingBeyond) {
  EXPECT_EQ(Read("[kinds]\ncount = 1\nsize_m = 100\n").count, 1);
  EXPECT_EQ(Read("[kinds]\ncount = 10\nsize_m = 0.0\n").count, 10);
}

TEST(ConfigTest, ErrorsNameFileLineKeyAndWhatIsAllowed) {
  const std::vector<std::pair<std::string, std::string>> errors = {
      {"flag = 1", "flag must be true or false, not 1"},
      {"flag = \"true\"", "flag must be true or false, not 'true'"},
      {"count = 0", "count must be an integer from 1 to 10, not 0"},
      {"count = 11", "count must be an integer from 1 to 10, not 11"},
      {"count = 2.0", "count must be an integer from 1 to 10, not 2.0"},
      {"count = 4294967301", "count must be an integer from 1 to 10, not 4294967301"},
      {"big = -1", "big must be an integer of at least 0, not -1"},
      {"size_m = 100.5", "size_m must be a number from 0 to 100, not 100.5"},
      {"size_m = nan", "size_m must be a number from 0 to 100, not nan"},
      {"size_m = inf", "size_m must be a number from 0 to 100, not inf"},
      {"size_m = true", "size_m must be a number from 0 to 100, not true"},
      {"size_m = \"5\"", "size_m must be a number from 0 to 100, not '5'"},
      {"size_m = []", "size_m must be a number from 0 to 100, not []"},
      {"name = 5", "name must be a string, not 5"},
      {"place_m = [1, 2]", "place_m must be an array of 3 numbers, not [ 1, 2 ]"},
      {"place_m = 1", "place_m must be an array of 3 numbers, not 1"},
      {"place_m = [1, 2, 11]", "place_m must be a number from -10 to 10, not 11"},
      {"shape = \"oval\"", "shape must be one of \"round\" \"square\", not 'oval'"},
      {"shape = 1", "shape must be one of \"round\" \"square\", not 1"},
      {"words = \"a\"", "words must be a list of strings, not 'a'"},
      {"words = [\"a\", 1]", "words must be a list of strings, not 1"},
      {"colours = [\"green\"]",
       "colours must be a list of strings, each one of \"red\" \"blue\", not 'green'"}};
  for (const auto& [line, message] : errors)
    EXPECT_EQ(ErrorOf([&] { Read("[kinds]\n\n" + line + "\n"); }), "a.toml:3: kinds." + message);
}

TEST(ConfigTest, UnknownKeysAndTablesAreNamed) {
  EXPECT_EQ(
      ErrorOf([] { Read("[kinds]\nflag = true\nsice_m = 2\n"); }),
      "a.toml:3: unknown key kinds.sice_m; known keys: big colours count flag name place_m shape "
      "size_m words");
  const Config config = Config::Parse("[kinds]\n[kidns]\n", "a.toml");
  const std::string_view known[] = {"kinds", "others"};
  EXPECT_EQ(ErrorOf([&] { config.RejectUnknownTables(known); }),
            "a.toml:2: unknown table [kidns]; known tables: kinds others");
  Config::Parse("[kinds]\n", "a.toml").RejectUnknownTables(known);
  EXPECT_EQ(ErrorOf([] { Read("kinds = 5\n"); }), "a.toml:1: kinds must be a table: write [kinds]");
}

TEST(ConfigTest, TablesOfOneNameAreCountedAndReadByNumber) {
  const Config config =
      Config::Parse("[[kinds]]\ncount = 4\n[[kinds]]\ncount = 5\nsize_m = -1\n", "a.toml");
  EXPECT_EQ(config.CountOf("kinds"), 2);
  EXPECT_EQ(config.CountOf("others"), 0);
  EXPECT_EQ(config.Read<AllKinds>("kinds[0]").count, 4);
  EXPECT_EQ(ErrorOf([&] { config.Read<AllKinds>("kinds[1]"); }),
            "a.toml:5: kinds[1].size_m must be a number from 0 to 100, not -1");
  EXPECT_EQ(ErrorOf([] { Config::Parse("\n[kinds]\n", "a.toml").CountOf("kinds"); }),
            "a.toml:2: kinds must be tables: write [[kinds]]");
}

TEST(ConfigTest, TellsWhereAValueWasSet) {
  Config config = Config::Parse("[kinds]\n\ncount = 4\n[[more]]\nx = 1\n", "a.toml");
  config.Set("kinds.size_m=7");
  EXPECT_EQ(config.WhereIs("kinds.count"), "a.toml:3: ");
  EXPECT_EQ(config.WhereIs("more[0].x"), "a.toml:5: ");
  EXPECT_EQ(config.WhereIs("more[0]"), "a.toml:4: ");
  EXPECT_EQ(config.WhereIs("kinds.size_m"), "--set kinds.size_m=7: ");
  EXPECT_EQ(config.WhereIs("kinds.name"), "");
}

TEST(ConfigTest, UnknownTablesWithinTablesAreNamed) {
  const std::string_view known[] = {"kinds", "scene", "scene.tank"};
  Config::Parse("[scene.tank]\nx = 1\n[kinds]\n", "a.toml").RejectUnknownTables(known);
  const Config config = Config::Parse("[scene]\nx = 1\n[scene.tnak]\ny = 1\n", "a.toml");
  EXPECT_EQ(ErrorOf([&] { config.RejectUnknownTables(known); }),
            "a.toml:3: unknown table [scene.tnak]; known tables: kinds scene scene.tank");
}

TEST(ConfigTest, BrokenTomlNamesItsLine) {
  for (const char* text : {"[kinds]\ncount = \n", "[kinds]\ncount 3\n", "[kinds]\n[kinds\n",
                           "[kinds]\ncount = 1 2\n", "[kinds]\nname = \"x\n"}) {
    const std::string error = ErrorOf([&] { Read(text); });
    EXPECT_TRUE(error.starts_with("a.toml:")) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
}

TEST(ConfigTest, OverridesWinAndBareWordsAreStrings) {
  Config config = Config::Parse("[kinds]\ncount = 2\nname = \"a\"\n", "a.toml");
  for (const char* assignment : {"kinds.count=5", "kinds.name=bob", "kinds.shape=square",
                                 "kinds.place_m=[3,2,1]", "kinds.flag=true", "kinds.size_m=0.25"})
    config.Set(assignment);
  AllKinds read = config.Read<AllKinds>("kinds");
  EXPECT_EQ(read.count, 5);
  EXPECT_EQ(read.name, "bob");
  EXPECT_EQ(read.shape, Shape::kSquare);
  EXPECT_EQ(read.place_m, Eigen::Vector3d(3, 2, 1));
  EXPECT_TRUE(read.flag);
  EXPECT_EQ(read.size_m, 0.25);
  config.Set("kinds.count=6");  // The last one wins.
  config.Set("kinds.name=/a path/with=signs.toml");
  config.Set("new.table.x=1");
  read = config.Read<AllKinds>("kinds");
  EXPECT_EQ(read.count, 6);
  EXPECT_EQ(read.name, "/a path/with=signs.toml");
  config.Set("kinds.name=");
  EXPECT_EQ(config.Read<AllKinds>("kinds").name, "");
}

TEST(ConfigTest, BadOverridesAreNamed) {
  for (const char* assignment : {"kinds.count", "count=5", "=", ""}) {
    Config config;
    EXPECT_EQ(ErrorOf([&] { config.Set(assignment); }),
              std::string("--set ") + assignment + ": write --set table.key=value");
  }
  Config config;
  config.Set("kinds.count=77");
  EXPECT_EQ(ErrorOf([&] { config.Read<AllKinds>("kinds"); }),
            "--set kinds.count=77: kinds.count must be an integer from 1 to 10, not 77");
  Config other;
  other.Set("kinds.cuont=7");
  EXPECT_TRUE(ErrorOf([&] {
                other.Read<AllKinds>("kinds");
              }).starts_with("--set kinds.cuont=7: unknown key kinds.cuont"));
}

TEST(ConfigTest, TextReadsBackAsTheSameConfig) {
  Random random(1, "config");
  for (int i = 0; i < 50; ++i) {
    Config config = Config::Parse("[kinds]\n[scene.tank]\nx = 1\n", "a.toml");
    const double size_m = random.Uniform(0, 100), x = random.Uniform(-10, 10);
    std::ostringstream numbers;
    numbers.precision(17);
    numbers << size_m;
    config.Set("kinds.size_m=" + numbers.str());
    numbers.str("");
    numbers << "[" << x << ", 1e-300, 0]";
    config.Set("kinds.place_m=" + numbers.str());
    config.Set("kinds.name='quotes \" and \\ and #'");
    config.Set("kinds.shape=square");
    const std::string text = config.ToToml();
    const Config read = Config::Parse(text, "b.toml");
    EXPECT_EQ(read.ToToml(), text);
    const AllKinds kinds = read.Read<AllKinds>("kinds");
    EXPECT_EQ(kinds.size_m, size_m);
    EXPECT_EQ(kinds.place_m, Eigen::Vector3d(x, 1e-300, 0));
    EXPECT_EQ(kinds.name, "quotes \" and \\ and #");
    EXPECT_EQ(kinds.shape, Shape::kSquare);
  }
}

TEST(ConfigTest, DescribesEachOption) {
  AllKinds options;
  options.name = "somebody";
  const auto lines = DescribeOptions([&](OptionsVisitor& v) { options.Visit(v); });
  std::string all;
  for (const OptionDescription& line : lines)
    all += line.key + " | " + line.value + " | " + line.allowed + " | " + line.help + "\n";
  EXPECT_EQ(all,
            "flag | false | true or false | a flag\n"
            "count | 3 | an integer from 1 to 10 | a count\n"
            "big | 0 | an integer of at least 0 | a large count\n"
            "size_m | 1.5 | a number from 0 to 100 | a size\n"
            "name | \"somebody\" | a string | a name\n"
            "place_m | [1, 2, 3] | each a number from -10 to 10 | a place\n"
            "shape | \"round\" | one of \"round\" \"square\" | a shape\n"
            "words | [\"a\", \"b\"] | each a string | words\n"
            "colours | [] | each one of \"red\" \"blue\" | colours\n");
}

TEST(ConfigTest, NamesOfValues) {
  const Names<Shape> names = {{Shape::kSquare, "square"}};
  EXPECT_EQ(NameOf(names, Shape::kSquare), "square");
  EXPECT_EQ(NameOf(names, Shape::kRound), "");
}

class ConfigFileTest : public testing::Test {
 protected:
  ConfigFileTest() { fs::create_directories(folder_ / "below"); }
  ~ConfigFileTest() override { fs::remove_all(folder_); }

  std::string Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }

  fs::path folder_ =
      fs::path(testing::TempDir()) /
      (std::string("config_") + testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(ConfigFileTest, IncludesAreReadFirstAndLaterValuesWin) {
  Write("below/base.toml", "[kinds]\ncount = 1\nname = \"base\"\nsize_m = 10\n");
  Write("below/middle.toml", "include = [\"base.toml\"]\n[kinds]\ncount = 2\nname = \"middle\"\n");
  Write("other.toml", "[kinds]\nname = \"other\"\n[scene]\nx = 1\n");
  const std::string path =
      Write("top.toml", "include = [\"below/middle.toml\", \"other.toml\"]\n[kinds]\ncount = 3\n");
  const Config config = Config::Load(path);
  const AllKinds read = config.Read<AllKinds>("kinds");
  EXPECT_EQ(read.count, 3);
  EXPECT_EQ(read.name, "other");
  EXPECT_EQ(read.size_m, 10);
  EXPECT_EQ(config.directory(), folder_.string());
  EXPECT_EQ(config.ToToml().find("include"), std::string::npos);
}

TEST_F(ConfigFileTest, ErrorsNameTheIncludedFileAndLine) {
  const std::string base = Write("base.toml", "[kinds]\n\n\ncount = 99\n");
  const Config config = Config::Load(Write("top.toml", "include = [\"base.toml\"]\n"));
  EXPECT_EQ(ErrorOf([&] { config.Read<AllKinds>("kinds"); }),
            base + ":4: kinds.count must be an integer from 1 to 10, not 99");
}

TEST_F(ConfigFileTest, BadIncludesAreNamed) {
  const std::string top = Write("top.toml", "x.y = 1\ninclude = \"base.toml\"\n");
  EXPECT_EQ(ErrorOf([&] { Config::Load(top); }),
            top + ":2: include must be an array of file names");
  Write("top.toml", "include = [1]\n");
  EXPECT_EQ(ErrorOf([&] { Config::Load(top); }),
            top + ":1: include must be an array of file names");
  Write("top.toml", "include = [\"none.toml\"]\n");
  EXPECT_EQ(ErrorOf([&] { Config::Load(top); }),
            (folder_ / "none.toml").string() + ": no such configuration file");
  Write("top.toml", "include = [\"top.toml\"]\n");
  EXPECT_EQ(ErrorOf([&] { Config::Load(top); }), top + ":1: includes are nested too deeply");
  EXPECT_EQ(ErrorOf([&] { Config::Load(folder_.string()); }),
            folder_.string() + ": no such configuration file");
  EXPECT_EQ(ErrorOf([] { Config::Parse("include = [\"a\"]\n", "memory"); }),
            "memory:1: include is for files only");
}

TEST_F(ConfigFileTest, AnEmptyIncludeIncludesNothing) {
  const Config config = Config::Load(Write("top.toml", "include = []\n[kinds]\ncount = 4\n"));
  EXPECT_EQ(config.Read<AllKinds>("kinds").count, 4);
}

}  // namespace
}  // namespace vog
