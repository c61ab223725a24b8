#include "analysis/text/html_page.hpp"

#include <sstream>

#include "analysis/text/svg_plot.hpp"
#include "analysis/text/version.hpp"

namespace soda::analysis {
namespace {

// Pictures are drawn for light screens, and inverted on dark ones but for their hues.
constexpr const char* kPageStyle =
    "<style>\n"
    ":root{color-scheme:light dark}\n"
    "body{font:16px/1.5 system-ui,sans-serif;max-width:78rem;margin:1rem auto;padding:0 1rem;"
    "color:#222;background:#fff}\n"
    "table{border-collapse:collapse;margin:.6em 0;font-size:.85em}\n"
    "th,td{padding:.15em .7em;text-align:right;white-space:nowrap;border-bottom:1px solid #ddd}\n"
    "th:first-child,td:first-child{text-align:left}\n"
    "tr.bound td{color:#555;font-style:italic}\n"
    ".missed{color:#b00000}\n"
    ".reached{color:#006b3c}\n"
    ".left,footer,figcaption{color:#555;font-size:.85em;margin:.2em 0}\n"
    ".wide{overflow-x:auto}\n"
    ".side{display:flex;flex-wrap:wrap;gap:.5rem 2rem;align-items:flex-start}\n"
    ".side>*{min-width:0;max-width:100%}\n"
    "figure{margin:0 0 1rem}\n"
    ".side>figure{flex:0 1 600px}\n"
    "svg{max-width:100%;height:auto}\n"
    "pre{overflow-x:auto;font-size:13px;line-height:1.35}\n"
    "@media(prefers-color-scheme:dark){\n"
    "body{color:#ddd;background:#161616}\n"
    "th,td{border-color:#444}\n"
    "a{color:#8ab4f8}\n"
    ".missed{color:#ff8a80}\n"
    ".reached{color:#69d2a0}\n"
    ".left,footer,figcaption,tr.bound td{color:#aaa}\n"
    "svg{filter:invert(.91) hue-rotate(180deg)}\n"
    "}\n"
    "</style>\n";

}  // namespace

std::string html_tag(const std::string& name, const std::string& inside, const std::string& kind) {
  const std::string attribute = kind.empty() ? "" : " class=\"" + kind + "\"";
  return "<" + name + attribute + ">" + inside + "</" + name + ">";
}

std::string html_paragraphs(const std::string& lines) {
  std::string paragraphs, line;
  for (std::istringstream in(lines); std::getline(in, line);)
    paragraphs += html_tag("p", escaped_xml(line)) + "\n";
  return paragraphs;
}

std::string html_row(const char* cell, const std::vector<std::string>& texts) {
  std::string cells;
  for (const std::string& text : texts) cells += html_tag(cell, escaped_xml(text));
  return html_tag("tr", cells) + "\n";
}

std::string html_table(const std::string& rows) {
  return html_tag("div", html_tag("table", "\n" + rows), "wide") + "\n";
}

std::string html_side_by_side(const std::string& inside) {
  return html_tag("div", "\n" + inside, "side") + "\n";
}

std::string html_page(const std::string& title, const MadeBy& made_by, const std::string& body) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n" +
         html_tag("title", escaped_xml(title)) + "\n" + kPageStyle + "</head>\n<body>\n" +
         html_tag("h1", escaped_xml(title)) + "\n" + body +
         html_tag("footer", "Made by " + html_tag("code", escaped_xml(made_by.command)) +
                                ", soda " + kVersion + ", on " + escaped_xml(made_by.machine) +
                                ".") +
         "\n</body>\n</html>\n";
}

}  // namespace soda::analysis
