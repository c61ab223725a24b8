// Rules about the text of the repository, as functions over text, so that they can be tested.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace soda::tidy {

struct SourceFile {
  std::string path;  // relative to the repository root, with '/'
  std::string text;
};

struct Finding {
  std::string path;
  std::size_t line = 0;  // 1-based; 0: the file as a whole
  std::string what;      // what is wrong and what to do instead
};

// Includes must follow analysis -> scenarios -> models -> {kernel, physics}, and no product file
// includes a test.
std::vector<Finding> check_layers(const SourceFile& file);

// Inside a layer every file is in a room, and includes those of its room and of lower ones.
// Scenarios is flat.
std::vector<Finding> check_rooms(const SourceFile& file);

// FCL headers in shape geometry and narrowphase only; nlohmann in one .cpp a layer, CLI11 in six;
// never in headers. Over all product files together.
std::vector<Finding> check_heavy_headers(const std::vector<SourceFile>& files);

// Words and calls with a better replacement, in the layers where they matter.
std::vector<Finding> check_banned_words(const SourceFile& file);

// Lines of at most 100 characters, no trailing space, no tab, a line break at the end.
std::vector<Finding> check_lines(const SourceFile& file);

// Files of at most 400 lines.
std::vector<Finding> check_file_length(const SourceFile& file);

struct FunctionSize {
  std::string path;
  std::size_t line = 0;   // where the body opens
  std::size_t lines = 0;  // from there to its end
  std::size_t parameters = 0;
};

// Function bodies of clang-formatted C++: a block opened by a line that does not open a namespace,
// type or initialiser, in namespace or class scope.
std::vector<FunctionSize> function_sizes(const SourceFile& file);

// Functions longer than `limit` lines.
std::vector<Finding> check_function_length(const SourceFile& file, std::size_t limit);

// Functions of more than `limit` parameters.
std::vector<Finding> check_parameters(const SourceFile& file, std::size_t limit);

// Work marked as left over.
std::vector<Finding> check_leftovers(const SourceFile& file);

// Every header of the folder stands in its README.
std::vector<Finding> check_readme(const SourceFile& readme,
                                  const std::vector<std::string>& headers);

// Code without comments and literals, same line structure: what rules about code look at.
std::string without_comments_and_literals(const std::string& text);

}  // namespace soda::tidy
