#include "tools/report/html.h"

#include <gtest/gtest.h>

namespace vog {
namespace {

TEST(EscapeHtmlTest, LeavesNoMarkup) {
  EXPECT_EQ(EscapeHtml("a < b & \"c\" > 'd'"), "a &lt; b &amp; &quot;c&quot; &gt; &#39;d&#39;");
  EXPECT_EQ(EscapeHtml("± µ – 水"), "± µ – 水");
  EXPECT_EQ(EscapeHtml("line\n\tline"), "line\n\tline");
}

TEST(EscapeHtmlTest, ReplacesWhatIsNoText) {
  using namespace std::string_literals;
  EXPECT_EQ(EscapeHtml("a\0b\x1f"s), "a\xEF\xBF\xBD"s + "b\xEF\xBF\xBD");
  EXPECT_EQ(EscapeHtml("\xff\xc3<"), "\xEF\xBF\xBD\xEF\xBF\xBD&lt;");
  EXPECT_EQ(EscapeHtml("\xe6\xb0"), "\xEF\xBF\xBD\xEF\xBF\xBD");
}

TEST(HtmlTableTest, NamesRowsAndColumns) {
  EXPECT_EQ(HtmlTable({{"", "<a>"}, {"b", "1"}}),
            "<table>\n<thead>\n<tr><th scope=\"col\"></th><th scope=\"col\">&lt;a&gt;</th></tr>\n"
            "</thead>\n<tbody>\n<tr><th scope=\"row\">b</th><td>1</td></tr>\n</tbody>\n</table>\n");
}

}  // namespace
}  // namespace vog
