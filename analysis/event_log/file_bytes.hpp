// Bytes of a file.
#pragma once

#include <cstddef>
#include <cstring>
#include <memory>
#include <span>
#include <utility>

namespace soda::analysis {

// As a vector of them, but that what is new in it has no value until it is written.
class FileBytes {
 public:
  void resize(std::size_t size) {
    if (size > room_) {
      auto more = std::make_unique_for_overwrite<unsigned char[]>(size);
      if (size_ > 0) std::memcpy(more.get(), bytes_.get(), size_);
      bytes_ = std::move(more);
      room_ = size;
    }
    size_ = size;
  }
  std::size_t size() const { return size_; }
  unsigned char* data() { return bytes_.get(); }
  std::span<const unsigned char> view() const { return {bytes_.get(), size_}; }

 private:
  std::unique_ptr<unsigned char[]> bytes_;
  std::size_t size_ = 0, room_ = 0;
};

}  // namespace soda::analysis
