// Every path through a tree of choices.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

namespace soda::kernel {

// Depth-first through the tree of choices: each call of next() is one path, until all are done.
class EveryPath {
 public:
  std::size_t choose(std::size_t count) {
    if (depth_ == path_.size()) path_.push_back({0, count});
    EXPECT_EQ(path_[depth_].count, count) << "the schedule is not a function of the choices";
    return path_[depth_++].choice;
  }
  bool next() {
    depth_ = 0;
    while (!path_.empty() && ++path_.back().choice == path_.back().count) path_.pop_back();
    return !path_.empty();
  }

 private:
  struct Choice {
    std::size_t choice;
    std::size_t count;
  };
  std::vector<Choice> path_;
  std::size_t depth_ = 0;
};

}  // namespace soda::kernel
