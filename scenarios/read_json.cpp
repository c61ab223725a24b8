#include "scenarios/read_json.hpp"

#include <algorithm>
#include <cctype>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>
#include <vector>

namespace soda::scenarios {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

// Follows the parser through the text. The library reports values without their places; but when
// it reports one, everything up to its end is known to be well-formed, so the place is found by
// skipping white space and separators from the end of the value before.
class TokenCursor {
 public:
  explicit TokenCursor(std::string_view text) : text_(text) {
    if (text_.substr(0, kByteOrderMark.size()) == kByteOrderMark) at_ = kByteOrderMark.size();
  }

  // Moves to the start of the next value, key or closing bracket, and says where it is.
  TextPlace skip_to_token() {
    while (at_ < text_.size() && std::string_view(" \t\r\n,:").find(text_[at_]) != text_.npos)
      step();
    return place_;
  }

  std::string_view take_bracket() { return take(1); }

  std::string_view take_string() {
    std::size_t length = 1;
    while (at_ + length < text_.size() && text_[at_ + length] != '"') {
      length += text_[at_ + length] == '\\' ? 2 : 1;
    }
    return take(length + 1);
  }

  std::string_view take_number_or_literal() {
    std::size_t end = text_.find_first_of(" \t\r\n,:]}", at_);
    return take(std::min(end, text_.size()) - at_);
  }

  // Where byte `offset` (not before the cursor) is.
  TextPlace place_at(std::size_t offset) {
    while (at_ < std::min(offset, text_.size())) step();
    return place_;
  }

 private:
  void step() {
    if (text_[at_] == '\n') {
      ++place_.line;
      place_.column = 1;
    } else if (at_ + 1 == text_.size() ||
               (static_cast<unsigned char>(text_[at_ + 1]) & 0xC0) != 0x80) {
      ++place_.column;
    }
    ++at_;
  }

  std::string_view take(std::size_t length) {
    const std::string_view token = text_.substr(at_, length);
    const std::size_t end = at_ + token.size();
    while (at_ < end) step();
    return token;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  TextPlace place_{1, 1};
};

// Builds the tree from the parser's events; every handler returns whether to go on.
class TreeBuilder : public nlohmann::json_sax<nlohmann::json> {
 public:
  TreeBuilder(std::string_view text, JsonTree& tree, FaultList& faults)
      : text_(text), cursor_(text), tree_(tree), faults_(faults) {}

  bool null() override { return scalar(JsonKind::kNull); }
  bool boolean(bool value) override {
    if (!scalar(JsonKind::kBoolean)) return false;
    tree_.values.back().boolean = value;
    return true;
  }
  bool number_integer(number_integer_t value) override {
    if (!scalar(JsonKind::kInteger)) return false;
    tree_.values.back().integer = value;
    tree_.values.back().number = static_cast<double>(value);
    return true;
  }
  bool number_unsigned(number_unsigned_t value) override {
    if (!scalar(JsonKind::kInteger)) return false;
    constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
    tree_.values.back().integer =
        value > static_cast<number_unsigned_t>(kMost) ? kMost : static_cast<std::int64_t>(value);
    tree_.values.back().number = static_cast<double>(value);
    return true;
  }
  bool number_float(number_float_t value, const string_t&) override {
    if (!scalar(JsonKind::kNumber)) return false;
    tree_.values.back().number = value;
    return true;
  }
  bool string(string_t& value) override {
    if (!scalar(JsonKind::kString)) return false;
    tree_.values.back().text = tree_.strings.emplace_back(std::move(value));
    return true;
  }
  bool binary(binary_t&) override { return false; }  // does not occur in text

  bool start_object(std::size_t) override { return open(JsonKind::kObject); }
  bool start_array(std::size_t) override { return open(JsonKind::kArray); }
  bool end_object() override {
    report_duplicate_keys(*open_.back());
    return close();
  }
  bool end_array() override { return close(); }

  bool key(string_t& value) override {
    key_place_ = cursor_.skip_to_token();
    cursor_.take_string();
    key_ = *tree_.keys.insert(std::move(value)).first;
    return true;
  }

  bool parse_error(std::size_t position, const std::string& last_token,
                   const nlohmann::detail::exception& error) override;

 private:
  JsonValue* append(JsonKind kind) {
    const TextPlace place = cursor_.skip_to_token();
    if (tree_.values.size() >= kMaxValues) {
      stop(place, {"more than " + std::to_string(kMaxValues) + " values",
                   "at most " + std::to_string(kMaxValues) + " values in a file",
                   "generators describe many bodies in few values"});
      return nullptr;
    }
    JsonValue& value = tree_.values.emplace_back();
    value.kind = kind;
    value.place = place;
    if (open_.empty()) return &value;
    JsonValue& parent = *open_.back();
    value.parent = &parent;
    value.index = parent.children++;
    if (parent.kind == JsonKind::kObject) {
      value.key = key_;
      value.key_place = key_place_;
    }
    (last_child_.back() ? last_child_.back()->next_sibling : parent.first_child) = &value;
    last_child_.back() = &value;
    return &value;
  }

  bool scalar(JsonKind kind) {
    JsonValue* value = append(kind);
    if (!value) return false;
    value->token =
        kind == JsonKind::kString ? cursor_.take_string() : cursor_.take_number_or_literal();
    return true;
  }

  bool open(JsonKind kind) {
    JsonValue* value = append(kind);
    if (!value) return false;
    if (open_.size() >= kMaxDepth) {
      stop(value->place, {"arrays and objects nested deeper than " + std::to_string(kMaxDepth),
                          "at most " + std::to_string(kMaxDepth) + " levels", ""});
      return false;
    }
    cursor_.take_bracket();
    open_.push_back(value);
    last_child_.push_back(nullptr);
    return true;
  }

  bool close() {
    cursor_.skip_to_token();
    cursor_.take_bracket();
    open_.pop_back();
    last_child_.pop_back();
    return true;
  }

  void stop(TextPlace place, FaultText text) {
    faults_.push_back({.line = place.line,
                       .column = place.column,
                       .pointer = open_.empty() ? "" : pointer_to(*open_.back()),
                       .found = std::move(text.found),
                       .allowed = std::move(text.allowed),
                       .hint = std::move(text.hint)});
  }

  void report_duplicate_keys(const JsonValue& object) {
    std::vector<const JsonValue*> members;
    for (const JsonValue* m = object.first_child; m; m = m->next_sibling) members.push_back(m);
    std::sort(members.begin(), members.end(), [](const JsonValue* a, const JsonValue* b) {
      return std::tie(a->key, a->index) < std::tie(b->key, b->index);
    });
    for (std::size_t i = 1, first = 0; i < members.size(); ++i) {
      if (members[i]->key != members[first]->key) {
        first = i;
        continue;
      }
      const TextPlace place = members[first]->key_place;
      add_fault_at_key(
          faults_, *members[i],
          {"the key " + json_quoted(printable(members[i]->key)) + " again", "each key once",
           "first at " + std::to_string(place.line) + ":" + std::to_string(place.column)});
    }
  }

  std::string_view text_;
  TokenCursor cursor_;
  JsonTree& tree_;
  FaultList& faults_;
  std::vector<JsonValue*> open_;
  std::vector<JsonValue*> last_child_;  // of each open value
  std::string_view key_;
  TextPlace key_place_;
};

// The part of the library's message that says what the grammar wanted.
std::string expected_in(const std::string& message) {
  const std::string_view mark = "; expected ";
  const std::size_t at = message.rfind(mark);
  return at == std::string::npos ? "JSON" : printable(message.substr(at + mark.size()));
}

std::string hint_for(std::string_view text, std::size_t offset) {
  const std::string_view rest = text.substr(offset);
  const auto starts = [&](std::string_view word) { return rest.substr(0, word.size()) == word; };
  if (starts("NaN") || starts("nan") || starts("Inf") || starts("inf") || starts("-I") ||
      starts("-i")) {
    return "JSON has no NaN and no infinity";
  }
  if (starts("//") || starts("/*") || starts("#")) return "JSON has no comments";
  if (starts("'")) return "strings stand in double quotes";
  if (starts("]") || starts("}")) return "no comma after the last one";
  if (starts("True") || starts("False")) return "true and false are in lower case";
  return "";
}

bool TreeBuilder::parse_error(std::size_t position, const std::string& last_token,
                              const nlohmann::detail::exception& error) {
  if (dynamic_cast<const nlohmann::detail::out_of_range*>(&error)) {
    stop(cursor_.skip_to_token(),
         {"the number " + printable(last_token), "a number of size at most 1.8e308", ""});
    return false;
  }
  // `position` counts the characters read, the offending one included.
  std::size_t offset = std::min(position > 0 ? position - 1 : 0, text_.size());
  // A wrong word fails at the letter that differs: go back to its start, for the reader's sake.
  const auto in_word = [&](std::size_t i) {
    return std::isalnum(static_cast<unsigned char>(text_[i])) != 0 || text_[i] == '-';
  };
  const std::size_t first = offset;
  while (offset > 0 && first < text_.size() && in_word(first) && in_word(offset - 1)) --offset;
  const bool at_end = offset >= text_.size();
  const std::string message = error.what();
  std::string found = "end of file";
  if (!at_end) {
    const std::size_t end = std::min(text_.find_first_of(" \t\r\n,:]}", offset + 1), text_.size());
    found = printable(text_.substr(offset, end - offset));
    const std::string_view causes[] = {"invalid UTF-8", "control character", "forbidden"};
    for (const std::string_view cause : causes) {
      if (message.find(cause) != std::string::npos) {
        found = "a badly written string at " + printable(text_.substr(first, 1));
      }
    }
  }
  // The place may lie before the cursor: count from the start.
  stop(TokenCursor(text_).place_at(offset),
       {found, expected_in(message), at_end ? "the file is cut off" : hint_for(text_, offset)});
  return false;
}

}  // namespace

JsonTree parse_json(std::string_view text, FaultList& faults) {
  JsonTree tree;
  TreeBuilder builder(text, tree, faults);
  const bool complete = nlohmann::json::sax_parse(text.begin(), text.end(), &builder);
  if (!complete) tree.values.clear();
  return tree;
}

}  // namespace soda::scenarios
