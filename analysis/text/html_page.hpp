// A page that a command writes: one HTML file without scripts or anything from elsewhere, for light
// and dark, wide and narrow screens.
#pragma once

#include <string>
#include <vector>

namespace soda::analysis {

// An element around what is HTML already; `kind` is its class.
std::string html_tag(const std::string& name, const std::string& inside,
                     const std::string& kind = "");

// One for each line of a plain text.
std::string html_paragraphs(const std::string& lines);

// A row of a table, of plain texts: `cell` is "td" or "th".
std::string html_row(const char* cell, const std::vector<std::string>& texts);

// Of all rows; what is wider than the screen scrolls by itself.
std::string html_table(const std::string& rows);

// Figures or tables beside each other, as many as there is room for.
std::string html_side_by_side(const std::string& inside);

// How a page came to be: what was asked for, and where it was measured. Plain texts.
struct MadeBy {
  std::string command, machine;
};

// Title and command are plain text, `body` is HTML. Classes with a style: bound (a row), missed and
// reached (cells, paragraphs), left (small print).
std::string html_page(const std::string& title, const MadeBy& made_by, const std::string& body);

}  // namespace soda::analysis
