#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "lib/geometry/voxel_grid.h"

namespace vog {

/// Blocks by their key: an open-addressed hash table whose blocks stay where they are, side by side
/// in large pieces of memory.
template <class Block>
class BlockTable {
 public:
  /// nullptr if there is none yet.
  Block* Find(const VoxelKey& key) const {
    if (slots_.empty()) return nullptr;
    for (std::size_t i = std::hash<VoxelKey>{}(key)&mask();; i = (i + 1) & mask()) {
      if (slots_[i].block == nullptr || slots_[i].key == key) return slots_[i].block;
    }
  }

  /// @pre there is none with this key.
  Block& Add(const VoxelKey& key) {
    if (2 * (count_ + 1) > slots_.size()) Grow();
    if (count_ % kPiece == 0) pieces_.push_back(std::make_unique<std::array<Block, kPiece>>());
    Block& block = (*pieces_.back())[count_++ % kPiece];
    Insert({key, &block});
    return block;
  }

  template <class Visit>
  void ForEach(Visit visit) {
    for (std::size_t i = 0; i < count_; ++i) visit((*pieces_[i / kPiece])[i % kPiece]);
  }

  void Clear() {
    slots_.clear();
    pieces_.clear();
    count_ = 0;
  }

 private:
  static constexpr std::size_t kPiece = 64;

  struct Slot {
    VoxelKey key;
    Block* block = nullptr;
  };

  std::size_t mask() const { return slots_.size() - 1; }

  void Insert(const Slot& slot) {
    std::size_t i = std::hash<VoxelKey>{}(slot.key) & mask();
    while (slots_[i].block != nullptr) i = (i + 1) & mask();
    slots_[i] = slot;
  }

  void Grow() {
    constexpr std::size_t kFirst = 256;
    const std::vector<Slot> before =
        std::exchange(slots_, std::vector<Slot>(std::max(kFirst, 2 * slots_.size())));
    for (const Slot& slot : before)
      if (slot.block != nullptr) Insert(slot);
  }

  std::vector<Slot> slots_;
  std::vector<std::unique_ptr<std::array<Block, kPiece>>> pieces_;
  std::size_t count_ = 0;
};

}  // namespace vog
