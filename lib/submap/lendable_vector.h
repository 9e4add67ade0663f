#pragma once

#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace vog {

/// A vector whose elements may lie in memory of somebody else, such as a mapped file, until it is
/// first written to: then it copies them. Reading costs what it costs in a std::vector.
template <class T>
class LendableVector {
 public:
  LendableVector() = default;
  /// `lender` keeps `elements` alive. @pre lender != nullptr.
  LendableVector(std::span<const T> elements, std::shared_ptr<const void> lender)
      : data_(elements.data()), size_(elements.size()), lender_(std::move(lender)) {}

  LendableVector(const LendableVector& other) { *this = other; }
  LendableVector(LendableVector&& other) noexcept { *this = std::move(other); }
  ~LendableVector() = default;
  LendableVector& operator=(const LendableVector& other) {
    if (this == &other) return *this;
    own_ = other.own_;
    Take(other);
    return *this;
  }
  LendableVector& operator=(LendableVector&& other) noexcept {
    if (this == &other) return *this;
    own_ = std::move(other.own_);
    Take(other);
    other = std::vector<T>();
    return *this;
  }
  LendableVector& operator=(std::vector<T> elements) noexcept {
    own_ = std::move(elements);
    lender_.reset();
    Show();
    return *this;
  }

  const T* data() const { return data_; }
  const T* begin() const { return data_; }
  const T* end() const { return data_ + size_; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const T& operator[](std::size_t i) const { return data_[i]; }

  T& operator[](std::size_t i) {
    if (lender_ != nullptr) Own();
    return own_[i];
  }
  T& emplace_back() {
    if (lender_ != nullptr) Own();
    own_.emplace_back();
    Show();
    return own_.back();
  }

  /// Of the own or the borrowed elements, with what is reserved.
  std::size_t capacity() const { return lender_ != nullptr ? size_ : own_.capacity(); }

 private:
  void Own() { *this = std::vector<T>(begin(), end()); }
  void Show() {
    data_ = own_.data();
    size_ = own_.size();
  }
  void Take(const LendableVector& other) {
    lender_ = other.lender_;
    if (lender_ == nullptr) return Show();
    data_ = other.data_;
    size_ = other.size_;
  }

  const T* data_ = nullptr;
  std::size_t size_ = 0;
  std::vector<T> own_;                  // Empty while the elements are borrowed.
  std::shared_ptr<const void> lender_;  // nullptr while they are not.
};

}  // namespace vog
