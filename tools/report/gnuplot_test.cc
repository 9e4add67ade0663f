#include "tools/report/gnuplot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "lib/base/errors.h"

namespace vog {
namespace {

Plot LinePlot() {
  Plot plot;
  plot.data["line"] = DataLine({0, 1}) + DataLine({1, std::nan("")}) + DataLine({2, 3});
  plot.commands = "plot 'line' with linespoints title " + PlotText("it's _plain_");
  return plot;
}

/// Sets a variable of the environment as long as it lives.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* const old = std::getenv(name)) old_ = old;
    ::setenv(name, value, 1);
  }
  ~Variable() {
    if (old_) {
      ::setenv(name_, old_->c_str(), 1);
    } else {
      ::unsetenv(name_);
    }
  }

 private:
  const char* name_;
  std::optional<std::string> old_;
};

class GnuplotTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!HasGnuplot()) GTEST_SKIP() << "gnuplot is not installed";
  }
};

TEST_F(GnuplotTest, DrawsBothFormatsTheSameEachTime) {
  Plot plot = LinePlot();
  const Picture svg = DrawPlot(plot);
  EXPECT_EQ(svg.bytes, DrawPlot(plot).bytes);
  EXPECT_NE(svg.bytes.find("<svg"), std::string::npos);
  EXPECT_NE(svg.bytes.find("_plain_"), std::string::npos);
  EXPECT_EQ(svg.width_px, plot.width_px);
  plot.format = PictureFormat::kPng;
  const Picture png = DrawPlot(plot);
  EXPECT_EQ(png.bytes, DrawPlot(plot).bytes);
  EXPECT_TRUE(png.bytes.starts_with("\x89PNG"));
}

TEST_F(GnuplotTest, TellsWhatGnuplotSays) {
  Plot plot = LinePlot();
  plot.commands = "plot 'nothing'";
  try {
    DrawPlot(plot);
    FAIL();
  } catch (const SystemError& error) {
    EXPECT_NE(std::string(error.what()).find("nothing"), std::string::npos) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

TEST_F(GnuplotTest, LeavesNothingBehind) {
  const auto folder = std::filesystem::temp_directory_path() / "vog-gnuplot-test";
  std::filesystem::create_directories(folder);
  {
    const Variable tmpdir("TMPDIR", folder.c_str());
    DrawPlot(LinePlot());
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  std::filesystem::remove_all(folder);
}

TEST(GnuplotMissingTest, IsSaid) {
  const Variable path("PATH", "/nowhere");
  EXPECT_FALSE(HasGnuplot());
  EXPECT_THROW(DrawPlot(LinePlot()), SystemError);
}

}  // namespace
}  // namespace vog
