#include "tools/log/log_files.h"

#include "lib/base/errors.h"
#include "tools/log/log_testing.h"

namespace vog {
namespace {

class LogFilesTest : public LogTest {
 protected:
  LogFilesTest() {
    log_ = Write("a.log", {EventAt(0, "A", "0"), EventAt(1, "B", "1"), EventAt(2, "A", "2"),
                           EventAt(3, "DVL", "3"), EventAt(4, "A", "4")});
  }
  std::string CutOf(const LogSelection& selection) {
    CutLog(log_, selection, PathOf("cut.log"));
    return TextOf(PathOf("cut.log"));
  }

  std::string log_;
};

TEST_F(LogFilesTest, CutsByChannelAndTime) {
  EXPECT_EQ(CutOf({}), "01234");
  EXPECT_EQ(CutOf({"A"}), "024");
  EXPECT_EQ(CutOf({"A|B", 1, 3}), "12");
  EXPECT_EQ(CutOf({"inputs"}), "3");
  EXPECT_EQ(CutOf({".*", 3.5}), "4");
}

TEST_F(LogFilesTest, RefusesWhatCannotBe) {
  EXPECT_THROW(CutOf({"("}), UsageError);
  EXPECT_THROW(CutOf({"NONE"}), UsageError);
  EXPECT_THROW(CutOf({".*", 4.5}), UsageError);
  EXPECT_THROW(CutLog(log_, {}, log_), UsageError);
  EXPECT_THROW(MergeLogs({log_, PathOf("nosuch.log")}, PathOf("out.log")), UsageError);
  EXPECT_THROW(MergeLogs({log_}, (folder_ / "." / "a.log").string()), UsageError);
  EXPECT_EQ(TextOf(log_), "01234");
}

TEST_F(LogFilesTest, MergesByTime) {
  const std::string other =
      Write("b.log", {EventAt(0.5, "A", "a"), EventAt(1, "A", "b"), EventAt(9, "A", "c")});
  EXPECT_EQ(MergeLogs({log_, other}, PathOf("out.log")), 8);
  EXPECT_EQ(TextOf(PathOf("out.log")), "0a1b234c");
  MergeLogs({other, log_}, PathOf("out.log"));
  EXPECT_EQ(TextOf(PathOf("out.log")), "0ab1234c");
}

}  // namespace
}  // namespace vog
