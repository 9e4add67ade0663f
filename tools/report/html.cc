#include "tools/report/html.h"

#include <algorithm>
#include <cstdint>

#include "lib/base/base64.h"

namespace vog {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

constexpr std::string_view kStyle = R"css(
body { margin: 0 auto; max-width: 1120px; padding: 1rem 1.2rem 3rem; color: #222; background: #fff;
  font: 15px/1.45 "Helvetica Neue", Helvetica, Arial, "Liberation Sans", sans-serif; }
h1 { font-size: 1.55rem; margin: .6rem 0 .2rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; padding-bottom: .2rem;
  border-bottom: 1px solid #d8dee4; }
p { margin: .4rem 0; max-width: 60rem; }
.lead, figcaption, .missing { color: #57606a; }
.missing { font-style: italic; }
.row { display: flex; flex-wrap: wrap; gap: .4rem 1.2rem; align-items: flex-start; }
figure { margin: .3rem 0; }
figure img { display: block; max-width: 100%; height: auto; }
figcaption { font-size: .88rem; margin-top: .2rem; max-width: 60rem; }
table { border-collapse: collapse; margin: .3rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .18rem .7rem; text-align: right; border-bottom: 1px solid #e7ebef; }
th:first-child, td:first-child { text-align: left; padding-left: .1rem; }
th { font-weight: 600; color: #24292f; }
thead th { border-bottom: 1px solid #8c959f; vertical-align: bottom; }
tbody th { font-weight: normal; }
.wide { overflow-x: auto; }
.wide td, .wide tbody th { white-space: nowrap; }
pre { background: #f6f8fa; border: 1px solid #e1e5e9; border-radius: 4px; padding: .6rem .8rem;
  overflow-x: auto; font: 13px/1.4 "DejaVu Sans Mono", Consolas, monospace; }
summary { cursor: pointer; color: #1b6ca8; }
.swatch { display: inline-block; width: .85em; height: .85em; border: 1px solid #8c959f;
  vertical-align: -.08em; }
@media print {
  body { max-width: none; padding: 0; font-size: 11pt; }
  figure, tr, pre { break-inside: avoid; }
  h2 { break-after: avoid; }
  .wide { overflow-x: visible; font-size: 8.5pt; }
  pre { white-space: pre-wrap; overflow-wrap: anywhere; }
}
)css";

/// Bytes of the UTF-8 character at the head of `text`, 0 when it is none.
std::size_t Utf8Length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::size_t length = byte(0) < 0x80                      ? 1
                             : byte(0) >= 0xC2 && byte(0) < 0xE0 ? 2
                             : byte(0) >= 0xE0 && byte(0) < 0xF0 ? 3
                             : byte(0) >= 0xF0 && byte(0) < 0xF5 ? 4
                                                                 : 0;
  if (length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  return length;
}

bool IsControl(char c) {
  return (static_cast<std::uint8_t>(c) < 0x20 && c != '\n' && c != '\t') || c == 0x7F;
}

std::string HtmlCell(const char* element, std::string_view scope, const std::string& text_html) {
  std::string html = std::string("<") + element;
  if (!scope.empty()) html += " scope=\"" + std::string(scope) + "\"";
  return html + ">" + text_html + "</" + element + ">";
}

}  // namespace

std::string EscapeHtml(std::string_view text) {
  std::string html;
  while (!text.empty()) {
    const std::size_t length = Utf8Length(text);
    const char c = text[0];
    if (length == 0 || (length == 1 && IsControl(c))) {
      html += kReplacement;
    } else if (c == '&') {
      html += "&amp;";
    } else if (c == '<') {
      html += "&lt;";
    } else if (c == '>') {
      html += "&gt;";
    } else if (c == '"') {
      html += "&quot;";
    } else if (c == '\'') {
      html += "&#39;";
    } else {
      html += text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return html;
}

std::string HtmlFigure(const Picture& picture, std::string_view alt,
                       std::string_view caption_html) {
  const char* type = picture.format == PictureFormat::kSvg ? "image/svg+xml" : "image/png";
  std::string html = "<figure style=\"max-width:" + std::to_string(picture.width_px) +
                     "px\">\n<img width=\"" + std::to_string(picture.width_px) + "\" height=\"" +
                     std::to_string(picture.height_px) + "\" alt=\"" + EscapeHtml(alt) +
                     "\" src=\"data:" + type + ";base64," + ToBase64(picture.bytes) + "\">\n";
  if (!caption_html.empty()) html += "<figcaption>" + std::string(caption_html) + "</figcaption>\n";
  return html + "</figure>\n";
}

std::string HtmlRow(const std::vector<std::string>& figures) {
  std::string html = "<div class=\"row\">\n";
  for (const std::string& figure : figures) html += figure;
  return html + "</div>\n";
}

std::string HtmlSection(std::string_view id, std::string_view title, std::string_view body_html) {
  const std::string name(id);
  return "<section id=\"" + name + "\" aria-labelledby=\"" + name + "-title\">\n<h2 id=\"" + name +
         "-title\">" + EscapeHtml(title) + "</h2>\n" + std::string(body_html) + "</section>\n";
}

std::string HtmlMissing(std::string_view why) {
  return "<p class=\"missing\">" + EscapeHtml(why) + "</p>\n";
}

std::string HtmlTable(const std::vector<std::vector<std::string>>& rows,
                      std::string_view css_class) {
  std::vector<std::vector<std::string>> rows_html = rows;
  for (auto& row : rows_html)
    for (std::string& cell : row) cell = EscapeHtml(cell);
  return HtmlTableOfHtml(rows_html, css_class);
}

std::string HtmlWide(const std::string& table_html) {
  return "<div class=\"wide\">\n" + table_html + "</div>\n";
}

std::string HtmlLink(std::string_view href, std::string_view text) {
  return "<a href=\"" + EscapeHtml(href) + "\">" + EscapeHtml(text) + "</a>";
}

std::string HtmlTableOfHtml(const std::vector<std::vector<std::string>>& rows,
                            std::string_view css_class) {
  std::string html = "<table";
  if (!css_class.empty()) html += " class=\"" + std::string(css_class) + "\"";
  html += ">\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (r == 0) html += "<thead>\n";
    if (r == 1) html += "<tbody>\n";
    html += "<tr>";
    for (std::size_t c = 0; c < rows[r].size(); ++c)
      html += r == 0   ? HtmlCell("th", "col", rows[r][c])
              : c == 0 ? HtmlCell("th", "row", rows[r][c])
                       : HtmlCell("td", "", rows[r][c]);
    html += "</tr>\n";
    if (r == 0) html += "</thead>\n";
  }
  if (rows.size() > 1) html += "</tbody>\n";
  return html + "</table>\n";
}

std::string HtmlPage(std::string_view title, std::string_view body_html) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
         EscapeHtml(title) + "</title>\n<style>" + std::string(kStyle) +
         "</style>\n</head>\n<body>\n<main>\n" + std::string(body_html) +
         "</main>\n</body>\n</html>\n";
}

}  // namespace vog
