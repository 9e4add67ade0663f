#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tools/report/gnuplot.h"

namespace vog {

/// `text` for an HTML element or a quoted attribute. Bytes that HTML cannot hold (controls, what is
/// no UTF-8) become U+FFFD.
std::string EscapeHtml(std::string_view text);

/// The picture inside the page, with its text for those who cannot see it. `caption_html` may be
/// empty.
std::string HtmlFigure(const Picture& picture, std::string_view alt, std::string_view caption_html);

/// Some figures beside each other, as far as there is room.
std::string HtmlRow(const std::vector<std::string>& figures);

/// A headed part of the page.
std::string HtmlSection(std::string_view id, std::string_view title, std::string_view body_html);

/// A note in place of something that the run does not have.
std::string HtmlMissing(std::string_view why);

/// A table. The first row is its head, the first column names the rows; all cells are plain text.
std::string HtmlTable(const std::vector<std::vector<std::string>>& rows,
                      std::string_view css_class = "");

/// The same of cells that are HTML already.
std::string HtmlTableOfHtml(const std::vector<std::vector<std::string>>& rows_html,
                            std::string_view css_class = "");

/// Lets a table scroll by itself where the page is narrower.
std::string HtmlWide(const std::string& table_html);

/// A text that leads to another file. @pre `href` is a relative path without special characters.
std::string HtmlLink(std::string_view href, std::string_view text);

/// The whole page: plain, light, without scripts or anything from elsewhere.
std::string HtmlPage(std::string_view title, std::string_view body_html);

}  // namespace vog
