#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "lib/geometry/voxel_grid.h"

namespace vog {

/// Blocks by their key: an open-addressed hash table whose blocks stay where they are.
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
    if (2 * (blocks_.size() + 1) > slots_.size()) Grow();
    blocks_.push_back(std::make_unique<Block>());
    Insert({key, blocks_.back().get()});
    return *blocks_.back();
  }

  template <class Visit>
  void ForEach(Visit visit) {
    for (const auto& block : blocks_) visit(*block);
  }

  void Clear() {
    slots_.clear();
    blocks_.clear();
  }

 private:
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
  std::vector<std::unique_ptr<Block>> blocks_;
};

}  // namespace vog
