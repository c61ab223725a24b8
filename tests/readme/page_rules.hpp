// Rules about Markdown pages, as functions over text, so that they can be tested.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace soda::readme {

struct Page {
  std::string path;  // relative to the repository root, with '/'
  std::string text;
};

struct Link {
  std::size_t line = 0;  // 1-based
  std::string target;    // what stands in the brackets, without a title
};

// Links and pictures, `[text](target)`. What stands in code is none.
std::vector<Link> links_of(const std::string& text);

struct Source {
  std::size_t line = 0;
  std::string path;
};

// Files and folders of the repository that a page names from the root, as `kernel/api/message.hpp`
// and `examples/queueing`: spans of code, all in small letters. A / at the end is left out.
std::vector<Source> sources_of(const std::string& text);

// What `#anchor` can name on a page: its headings as GitHub writes them, a repeated one with -1.
std::vector<std::string> anchors_of(const std::string& text);

// Whatever stands between blanks and has a letter or digit, code and tables included.
std::size_t words_of(const std::string& text);

// The sentences of paragraphs and of items of lists, in words. No prose are headings, code, tables,
// quoted HTML and items that begin with code (lists of keys). A span of code counts as one word.
std::vector<std::size_t> sentence_lengths(const std::string& text);
double mean_sentence(const std::string& text);  // 0: no sentence

// One line for each relative link of `page` that leads to no file of `files` (paths; folders too),
// or to no heading of one of `pages`.
std::vector<std::string> broken_links(const Page& page, const std::vector<Page>& pages,
                                      const std::vector<std::string>& files);

}  // namespace soda::readme
