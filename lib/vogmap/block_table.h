#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "lib/geometry/voxel_grid.h"

namespace vog {

/// Blocks by their key: an open-addressed hash table whose blocks stay where they are, side by side
/// in large pieces of memory. Before it stands a table of those found last, one for each place
/// modulo 32 x 32 x 16 blocks: near each other no two blocks meet there, so that no look-up has to
/// guess.
///
/// @tparam Block has a member `key`.
template <class Block>
class BlockTable {
 public:
  /// nullptr if there is none yet.
  Block* Find(const VoxelKey& key) {
    Block*& recent = recent_[RecentPlace(key)];
    if (recent == nullptr || recent->key != key) [[unlikely]] {
      Block* found = Search(key);
      if (found == nullptr) return nullptr;
      recent = found;
    }
    return recent;
  }

  /// @pre there is none with this key.
  Block& Add(const VoxelKey& key) {
    if (2 * (count_ + 1) > slots_.size()) Grow();
    if (count_ % kPiece == 0) pieces_.push_back(std::make_unique<std::array<Block, kPiece>>());
    Block& block = (*pieces_.back())[count_++ % kPiece];
    block.key = key;
    Insert({key, &block});
    return block;
  }

  template <class Visit>
  void ForEach(Visit visit) {
    for (std::size_t i = 0; i < count_; ++i) visit((*pieces_[i / kPiece])[i % kPiece]);
  }

  void Clear() {
    recent_.fill(nullptr);
    slots_.clear();
    pieces_.clear();
    count_ = 0;
  }

 private:
  static constexpr std::size_t kPiece = 64;
  static constexpr int kRecentBits = 5, kRecentBitsZ = 4;

  struct Slot {
    VoxelKey key;
    Block* block = nullptr;
  };

  static std::size_t RecentPlace(const VoxelKey& key) {
    constexpr std::int32_t kMask = (1 << kRecentBits) - 1, kMaskZ = (1 << kRecentBitsZ) - 1;
    return static_cast<std::size_t>((key.z & kMaskZ) << (2 * kRecentBits) |
                                    (key.y & kMask) << kRecentBits | (key.x & kMask));
  }

  Block* Search(const VoxelKey& key) const {
    if (slots_.empty()) return nullptr;
    for (std::size_t i = std::hash<VoxelKey>{}(key)&mask();; i = (i + 1) & mask()) {
      if (slots_[i].block == nullptr || slots_[i].key == key) return slots_[i].block;
    }
  }

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

  std::array<Block*, 1 << (2 * kRecentBits + kRecentBitsZ)> recent_{};
  std::vector<Slot> slots_;
  std::vector<std::unique_ptr<std::array<Block, kPiece>>> pieces_;
  std::size_t count_ = 0;
};

}  // namespace vog
