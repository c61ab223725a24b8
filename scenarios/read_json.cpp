#include "scenarios/read_json.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>
#include <vector>

#include "scenarios/syntax_fault.hpp"

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
    after_key_ = true;
    return true;
  }

  bool parse_error(std::size_t position, const std::string& last_token,
                   const nlohmann::detail::exception& error) override;

 private:
  JsonValue* append(JsonKind kind) {
    const TextPlace place = cursor_.skip_to_token();
    if (tree_.values.size() >= kMaxValues) {
      stop(place, pointer_here(),
           {"more than " + std::to_string(kMaxValues) + " values",
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
      after_key_ = false;
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
      stop(value->place, pointer_to(*value),
           {"arrays and objects nested deeper than " + std::to_string(kMaxDepth),
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

  // Of the value that is being read.
  std::string pointer_here() const {
    if (open_.empty()) return "";
    JsonValue next;
    next.parent = open_.back();
    next.index = open_.back()->children;
    next.key = key_;
    const bool between = open_.back()->kind == JsonKind::kObject && !after_key_;
    return pointer_to(between ? *open_.back() : next);
  }

  void stop(TextPlace place, std::string pointer, FaultText text) {
    faults_.push_back({.line = place.line,
                       .column = place.column,
                       .pointer = std::move(pointer),
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
  bool after_key_ = false;
};

bool TreeBuilder::parse_error(std::size_t position, const std::string& last_token,
                              const nlohmann::detail::exception& error) {
  if (dynamic_cast<const nlohmann::detail::out_of_range*>(&error)) {
    stop(cursor_.skip_to_token(), pointer_here(),
         {"the number " + printable(last_token), "a number of size at most 1.8e308", ""});
    return false;
  }
  // `position` counts the bytes read, those of the offending token included: of a string or number
  // in the wrong place all are read, of a bad token those up to the fault. Of words, the start is
  // found by going back.
  const std::string message = error.what();
  const auto says = [&](const char* words) { return message.find(words) != std::string::npos; };
  const bool whole_token = says("- unexpected string") || says("- unexpected number");
  const std::size_t back = whole_token ? last_token.size() : 1;
  const std::size_t failed_at =
      says("- unexpected end of input") ? text_.size() : position - std::min(position, back);
  SyntaxFault fault = explain_syntax_fault(text_, failed_at, message);
  // The place may lie before the cursor: count from the start.
  stop(TokenCursor(text_).place_at(fault.offset), pointer_here(), std::move(fault.text));
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
