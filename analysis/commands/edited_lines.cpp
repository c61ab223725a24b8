// The module soda_lines.so: lines that are edited with libedit.
#include <histedit.h>

#include <algorithm>
#include <iostream>
#include <utility>

#include "analysis/commands/line_editor.hpp"

namespace soda::analysis {
namespace {

std::string common_beginning(const std::vector<std::string>& words) {
  std::string common = words.front();
  for (const std::string& word : words)
    common.resize(
        static_cast<std::size_t>(std::ranges::mismatch(common, word).in1 - common.begin()));
  return common;
}

class EditedLines final : public LineEditor {
 public:
  EditedLines(std::string prompt, Completions completions)
      : prompt_(std::move(prompt)),
        completions_(std::move(completions)),
        editor_(el_init("soda", stdin, stdout, stderr), &el_end),
        history_(history_init(), &history_end) {
    HistEvent event;
    history(history_.get(), &event, H_SETSIZE, 1000);
    history(history_.get(), &event, H_SETUNIQUE, 1);
    EditLine* const editor = editor_.get();
    el_set(editor, EL_CLIENTDATA, this);
    el_set(editor, EL_PROMPT, &EditedLines::prompt_of);
    el_set(editor, EL_EDITOR, "emacs");
    el_set(editor, EL_SIGNAL, 1);
    el_set(editor, EL_HIST, &history, history_.get());
    el_set(editor, EL_ADDFN, "complete-word", "completes a word", &EditedLines::complete);
    el_set(editor, EL_BIND, "^I", "complete-word", nullptr);
  }

  std::optional<std::string> next() override {
    int count = 0;
    const char* const text = el_gets(editor_.get(), &count);
    if (text == nullptr || count <= 0) return std::nullopt;
    std::string line(text, static_cast<std::size_t>(count));
    HistEvent event;
    if (line != "\n") history(history_.get(), &event, H_ENTER, line.c_str());
    if (line.back() == '\n') line.pop_back();
    return line;
  }
  bool is_on_terminal() const override { return true; }

 private:
  static EditedLines& of(EditLine* editor) {
    void* self = nullptr;
    el_get(editor, EL_CLIENTDATA, &self);
    return *static_cast<EditedLines*>(self);
  }
  static char* prompt_of(EditLine* editor) { return of(editor).prompt_.data(); }

  // As far as all agree; what they do not agree on is listed.
  static unsigned char complete(EditLine* editor, int) {
    const LineInfo* const info = el_line(editor);
    const std::string line(info->buffer, info->cursor);
    const std::string word = line.substr(line.find_last_of(' ') + 1);
    std::vector<std::string> fitting = of(editor).completions_(line);
    std::erase_if(fitting, [&word](const std::string& name) { return !name.starts_with(word); });
    if (fitting.empty()) return CC_ERROR;
    std::string more = common_beginning(fitting).substr(word.size());
    if (fitting.size() == 1 && !fitting.front().ends_with(':')) more += ' ';
    if (!more.empty()) return el_insertstr(editor, more.c_str()) == 0 ? CC_REFRESH : CC_ERROR;
    std::string list = "\n";
    for (const std::string& name : fitting) list += name + "  ";
    std::cout << list << "\n" << std::flush;
    return CC_REDISPLAY;
  }

  std::string prompt_;
  const Completions completions_;
  const std::unique_ptr<EditLine, decltype(&el_end)> editor_;
  const std::unique_ptr<History, decltype(&history_end)> history_;
};

}  // namespace
}  // namespace soda::analysis

extern "C" soda::analysis::LineEditor* soda_edit_lines(const std::string& prompt,
                                                       soda::analysis::Completions completions) {
  return new soda::analysis::EditedLines(prompt, std::move(completions));
}
