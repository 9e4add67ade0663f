#include "lib/vogmap/vog_map.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <deque>
#include <limits>

#include "lib/geometry/view_walk.h"
#include "lib/vogmap/block_table.h"
#include "lib/vogmap/lane_sum.h"

namespace vog {
namespace {

constexpr int kSlice = kBlockSide * kBlockSide;  // Voxels of a block at one z.

/// In place of an answer: nobody has asked yet.
constexpr LogOddsUnits kNotAnswered = 127;

VoxelKey BlockKeyOf(const VoxelKey& voxel) {
  return {voxel.x >> kBlockBits, voxel.y >> kBlockBits, voxel.z >> kBlockBits};
}

int IndexInBlock(const VoxelKey& voxel) {
  constexpr int kMask = kBlockSide - 1;
  return (voxel.z & kMask) << (2 * kBlockBits) | (voxel.y & kMask) << kBlockBits |
         (voxel.x & kMask);
}

/// The bits of a packed key that tell a voxel's place in its block.
constexpr ViewWalk::PackedKey kPackedInBlock = [] {
  const ViewWalk::PackedKey row = kBlockSide - 1;
  return row | row << ViewWalk::kBits | row << (2 * ViewWalk::kBits);
}();

int IndexInBlock(ViewWalk::PackedKey voxel) {
  constexpr ViewWalk::PackedKey kRow = kBlockSide - 1;
  constexpr int kShift = ViewWalk::kBits - kBlockBits;
  return static_cast<int>((voxel & kRow) | (voxel >> kShift & kRow << kBlockBits) |
                          (voxel >> (2 * kShift) & kRow << (2 * kBlockBits)));
}

VoxelKey VoxelOf(const VoxelKey& block, int index) {
  const VoxelKey offset = OffsetInBlock(index);
  return {block.x * kBlockSide + offset.x, block.y * kBlockSide + offset.y,
          block.z * kBlockSide + offset.z};
}

/// Calls `visit(block, part)` for each block that meets `box`: the part of the box in it, relative
/// to its corner.
template <class Visit>
void ForEachBlockIn(const VoxelBox& box, Visit visit) {
  constexpr VoxelBox kBlock{{0, 0, 0}, {kBlockSide - 1, kBlockSide - 1, kBlockSide - 1}};
  ForEachVoxel(VoxelBox{BlockKeyOf(box.min), BlockKeyOf(box.max)}, [&](const VoxelKey& key) {
    const VoxelKey corner = VoxelOf(key, 0);
    const VoxelBox seen{{box.min.x - corner.x, box.min.y - corner.y, box.min.z - corner.z},
                        {box.max.x - corner.x, box.max.y - corner.y, box.max.z - corner.z}};
    visit(key, Intersection(seen, kBlock));
  });
}

/// The answer for each number of units, unknown's first.
constexpr std::array<float, 256> kAnswers = [] {
  std::array<float, 256> answers{};
  for (int units = -128; units < 128; ++units)
    answers[static_cast<std::size_t>(units + 128)] =
        units == kUnknownUnits ? kUnknownLogOdds : static_cast<float>(units) * kLogOddsPerUnit;
  return answers;
}();

float AnswerOf(LogOddsUnits units) { return kAnswers[static_cast<std::size_t>(units + 128)]; }

/// A bit for each voxel of a block, a word for each z.
class BlockBits {
 public:
  bool Get(int index) const { return words_[Word(index)] >> Bit(index) & 1; }
  void Set(int index, bool value) {
    const std::uint64_t bit = std::uint64_t{1} << Bit(index);
    words_[Word(index)] = value ? words_[Word(index)] | bit : words_[Word(index)] & ~bit;
  }
  void Reset() { words_.fill(0); }
  std::uint64_t Slice(int z) const { return words_[static_cast<std::size_t>(z)]; }
  template <class Visit>
  void ForEach(Visit visit) const {
    for (int z = 0; z < kBlockSide; ++z)
      for (std::uint64_t left = Slice(z); left != 0; left &= left - 1)
        visit(z * kSlice + std::countr_zero(left));
  }

 private:
  static std::size_t Word(int index) { return static_cast<std::size_t>(index / kSlice); }
  static int Bit(int index) { return index % kSlice; }

  std::array<std::uint64_t, kBlockSide> words_{};
};

/// Bits of the voxels of a slice from (x0, y0) to (x1, y1), both included.
std::uint64_t SliceMask(int x0, int x1, int y0, int y1) {
  const std::uint64_t row = (0xffu >> (7 - x1 + x0)) << x0;
  std::uint64_t mask = 0;
  for (int y = y0; y <= y1; ++y) mask |= row << (kBlockSide * y);
  return mask;
}

}  // namespace

/// The remembered answers and what they came from.
class VogMap::Cache {
 public:
  /// How uncertain the content of a block is.
  struct Sigmas {
    std::int64_t revision = -1;
    std::vector<const PlacedSubmap*> near;     // The surest first: it is most often the answer.
    std::array<double, kBlockVoxels> least_m;  // Not a number until it is asked for.
  };

  /// What answers come from.
  struct Sums {
    std::int64_t change = -1;  // They are those after this many changes of closed submaps.
    BlockBits is_summed;
    BlockBits expected;  // Had answers when the sums were forgotten.
    std::array<VoxelSum, kBlockVoxels> sum;
    std::vector<CandidateLanes> candidates;  // Once has_candidates.
    bool has_candidates = false;
    std::unique_ptr<Sigmas> sigmas;  // Once somebody asks.
  };

  /// The answers: small, because the blocks of a view should stay near the processor.
  struct Block {
    alignas(64) std::array<LogOddsUnits, kBlockVoxels> answer;
    BlockBits is_answered, is_free;
    VoxelKey key;
    bool holds_open = false;     // The answers contain the open submap.
    std::int64_t revision = -1;  // Of the map when the block was last looked after.
    std::unique_ptr<Sums> sums;
  };

  Cache(const VoxelGrid& grid, const SensorModel& model) : grid_(grid), model_(model) {}

  // --- Changes ---

  void OnChange(SubmapId id, const PlacedSubmap* before, const PlacedSubmap* after) {
    ++revision_;
    ++changes_;
    journal_.push_back({id, before == nullptr ? PlacedSubmap{} : *before, SlotOf(id)});
    const Slot slot = journal_.back().slot;
    submaps_[slot.group].Set(slot.lane, after, grid_.voxel_size_m());
    if (after == nullptr) {
      slots_.erase(id);
      free_slots_.push_back(slot);
    }
    if (journal_.size() > MaxJournal()) journal_.pop_front();
    last_block_ = nullptr;
    catch_up_.reset();
  }

  void OnOpenChange(const BrickGrid* open, const Pose3& X_MW) {
    ++revision_;
    open_ = open;
    X_open_W_ = X_MW;
    open_bounds_M_ = open == nullptr ? Eigen::AlignedBox3d() : open->BrickBounds();
    last_block_ = nullptr;
  }

  // --- Answers ---

  Block& BlockOf(const VoxelKey& key) {
    if (last_block_ != nullptr && last_block_->key == key) return *last_block_;
    Block* block = blocks_.Find(key);
    if (block == nullptr) {
      block = &blocks_.Add(key);
      block->sums = std::make_unique<Sums>();
    }
    if (block->revision != revision_) Refresh(*block);
    last_block_ = block;
    return *block;
  }

  LogOddsUnits UnitsOf(Block& block, int index) {
    const LogOddsUnits units = block.answer[static_cast<std::size_t>(index)];
    return units == kNotAnswered ? Answer(block, index) : units;
  }

  LogOddsUnits UnitsOf(const VoxelKey& voxel) {
    return UnitsOf(BlockOf(BlockKeyOf(voxel)), IndexInBlock(voxel));
  }

  /// The voxels of a block among `mask` at height z that are not free, as bits.
  std::uint64_t NotFreeIn(Block& block, int z, std::uint64_t mask) {
    for (std::uint64_t left = mask & ~block.is_answered.Slice(z); left != 0; left &= left - 1)
      Answer(block, z * kSlice + std::countr_zero(left));
    return mask & ~block.is_free.Slice(z);
  }

  /// The least sigma of the closed submaps at a voxel, remembered as long as they have `revision`.
  /// `least_of` finds it among those that may know the voxel.
  template <class LeastOf>
  double LeastSigmaOf(const VoxelKey& voxel, std::int64_t revision, LeastOf least_of) {
    Block& block = BlockOf(BlockKeyOf(voxel));
    Sigmas& sigmas = SigmasOf(block, revision);
    double& least_m = sigmas.least_m[static_cast<std::size_t>(IndexInBlock(voxel))];
    if (std::isnan(least_m)) least_m = least_of(sigmas.near);
    return least_m;
  }

  void Clear() {
    blocks_.Clear();
    last_block_ = nullptr;
    held_groups_ = 0;
  }

 private:
  struct Slot {
    std::size_t group;
    int lane;
  };
  struct Change {
    SubmapId id;
    PlacedSubmap before;  // Without a submap if there was none.
    Slot slot;
  };
  /// What has to be taken out of the sums of a block and put into them.
  struct CatchUp {
    void Add(const PlacedSubmap* submap, double voxel_size_m, std::int32_t sign) {
      if (count % kLanes == 0) parts.emplace_back();
      parts.back().Set(count++ % kLanes, submap, voxel_size_m, sign);
    }

    std::int64_t from_change;
    std::deque<PlacedSubmap> before;
    std::vector<SubmapLanes> parts;
    int count = 0;
  };

  // Some 200 MB. Candidates are quick to find again.
  static constexpr std::size_t kMaxHeldGroups = (200u << 20) / sizeof(CandidateLanes);

  // Beyond this many changes, beginning anew is as good.
  std::size_t MaxJournal() const { return std::max<std::size_t>(32, slots_.size() / 4); }

  Slot SlotOf(SubmapId id) {
    const auto found = slots_.find(id);
    if (found != slots_.end()) return found->second;
    if (free_slots_.empty()) {
      for (int lane = kLanes - 1; lane >= 0; --lane) free_slots_.push_back({submaps_.size(), lane});
      submaps_.emplace_back();
    }
    const Slot slot = free_slots_.back();
    free_slots_.pop_back();
    slots_.emplace(id, slot);
    return slot;
  }

  void Refresh(Block& block) {
    const bool keeps_sums = block.sums->change == changes_ || Update(block);
    if (!keeps_sums) {
      block.sums->is_summed.Reset();
      block.sums->expected = block.is_answered;
      ForgetCandidates(block);
      block.sums->change = changes_;
    }
    const bool meets_open = MeetsOpen(block.key);
    if (!keeps_sums || meets_open || block.holds_open) ForgetAnswers(block);
    block.holds_open = meets_open;
    block.revision = revision_;
  }

  void ForgetAnswers(Block& block) {
    block.is_answered.Reset();
    block.is_free.Reset();
    block.answer.fill(kNotAnswered);
  }

  bool MeetsOpen(const VoxelKey& block) const {
    if (open_bounds_M_.isEmpty()) return false;
    const double side_m = kBlockSide * grid_.voxel_size_m();
    const Vec3 middle_M = X_open_W_ * (side_m * Vec3(block.x + 0.5, block.y + 0.5, block.z + 0.5));
    return open_bounds_M_.exteriorDistance(middle_M) <= side_m;
  }

  /// Brings the sums of a block up to date from what has changed since; false if too much has.
  bool Update(Block& block) {
    if (block.sums->change < changes_ - static_cast<std::int64_t>(journal_.size())) return false;
    if (!catch_up_ || catch_up_->from_change != block.sums->change)
      catch_up_ = CatchUpFrom(block.sums->change);
    ExchangeParts(CandidatesOf(catch_up_->parts, grid_, block.key), block);
    block.sums->change = changes_;
    return true;
  }

  std::unique_ptr<CatchUp> CatchUpFrom(std::int64_t change) const {
    auto catch_up = std::make_unique<CatchUp>();
    catch_up->from_change = change;
    // The first change of a submap since then tells what the block has seen of it.
    std::map<SubmapId, const Change*> first;
    const auto since = static_cast<std::ptrdiff_t>(changes_ - change);
    for (auto it = journal_.end() - since; it != journal_.end(); ++it) first.emplace(it->id, &*it);
    for (const auto& [id, entry] : first) {
      if (entry->before.submap != nullptr)
        catch_up->Add(&catch_up->before.emplace_back(entry->before), grid_.voxel_size_m(), -1);
      if (const auto slot = slots_.find(id); slot != slots_.end())
        catch_up->Add(submaps_[slot->second.group].placed(slot->second.lane), grid_.voxel_size_m(),
                      1);
    }
    return catch_up;
  }

  /// Takes the parts of some submaps out of a block's sums and puts those of others in.
  void ExchangeParts(const std::vector<CandidateLanes>& parts, Block& block) {
    if (parts.empty()) return;
    ForgetCandidates(block);
    voxels_.clear();
    block.sums->is_summed.ForEach([this](int index) { voxels_.push_back(index); });
    Sum(parts, block.key);
    for (std::size_t i = 0; i < voxels_.size(); ++i) {
      const VoxelSum& change = sums_[i];
      if (change.units == 0 && change.observers == 0) continue;
      VoxelSum& sum = block.sums->sum[static_cast<std::size_t>(voxels_[i])];
      sum.units += change.units;
      sum.observers += change.observers;
      if (!block.holds_open) Answer(block, voxels_[i]);
    }
  }

  /// `sums_` get those of `voxels_`.
  void Sum(const std::vector<CandidateLanes>& candidates, const VoxelKey& block) {
    sums_.resize(voxels_.size());
    SumCandidates(candidates, grid_, block, voxels_, sums_);
  }

  /// Sums a voxel, and with it those that were asked when the block was last up to date: whoever
  /// comes back after a loop closure asks much the same, and one sum costs little beside another.
  void SumWithExpected(Block& block, int index) {
    Sums& sums = *block.sums;
    voxels_.assign(1, index);
    sums.expected.ForEach([&](int other) {
      if (other != index && !sums.is_summed.Get(other)) voxels_.push_back(other);
    });
    sums.expected.Reset();
    Sum(CandidatesFor(block), block.key);
    for (std::size_t i = 0; i < voxels_.size(); ++i) {
      sums.sum[static_cast<std::size_t>(voxels_[i])] = sums_[i];
      sums.is_summed.Set(voxels_[i], true);
    }
  }

  const std::vector<CandidateLanes>& CandidatesFor(Block& block) {
    if (block.sums->has_candidates) return block.sums->candidates;
    if (held_groups_ > kMaxHeldGroups)
      blocks_.ForEach([this](Block& other) { ForgetCandidates(other); });
    block.sums->candidates = CandidatesOf(submaps_, grid_, block.key);
    block.sums->candidates.shrink_to_fit();
    block.sums->has_candidates = true;
    held_groups_ += block.sums->candidates.size();
    return block.sums->candidates;
  }

  Sigmas& SigmasOf(Block& block, std::int64_t revision) {
    if (block.sums->sigmas == nullptr) block.sums->sigmas = std::make_unique<Sigmas>();
    Sigmas& sigmas = *block.sums->sigmas;
    if (sigmas.revision == revision) return sigmas;
    sigmas.revision = revision;
    sigmas.near.clear();
    for (const CandidateLanes& group : CandidatesFor(block))
      for (const PlacedSubmap* placed : group.placed)
        if (placed != nullptr) sigmas.near.push_back(placed);
    std::stable_sort(sigmas.near.begin(), sigmas.near.end(),
                     [](const auto* a, const auto* b) { return a->sigma_m < b->sigma_m; });
    sigmas.least_m.fill(std::numeric_limits<double>::quiet_NaN());
    return sigmas;
  }

  void ForgetCandidates(Block& block) {
    held_groups_ -= block.sums->candidates.size();
    block.sums->candidates = {};
    block.sums->has_candidates = false;
  }

  [[gnu::noinline]] LogOddsUnits Answer(Block& block, int index) {
    if (!block.sums->is_summed.Get(index)) SumWithExpected(block, index);
    const VoxelSum& sum = block.sums->sum[static_cast<std::size_t>(index)];
    const LogOddsUnits units =
        block.holds_open ? WithOpen(sum, VoxelOf(block.key, index)) : Clamped(sum);
    block.answer[static_cast<std::size_t>(index)] = units;
    block.is_answered.Set(index, true);
    block.is_free.Set(index, units != kUnknownUnits && units < model_.occupied_from);
    return units;
  }

  LogOddsUnits Clamped(const VoxelSum& sum) const {
    return sum.observers == 0 ? kUnknownUnits : static_cast<LogOddsUnits>(model_.Clamp(sum.units));
  }

  LogOddsUnits WithOpen(VoxelSum sum, const VoxelKey& voxel) const {
    const LogOddsUnits units = open_->Get(open_->grid().KeyOf(X_open_W_ * grid_.CenterOf(voxel)));
    if (units != kUnknownUnits) {
      sum.units += units;
      ++sum.observers;
    }
    return Clamped(sum);
  }

  VoxelGrid grid_;
  SensorModel model_;
  std::int64_t revision_ = 0;

  std::map<SubmapId, Slot> slots_;
  std::vector<Slot> free_slots_;
  std::vector<SubmapLanes> submaps_;
  std::int64_t changes_ = 0;
  std::deque<Change> journal_;  // The newest changes, without a gap.
  std::unique_ptr<CatchUp> catch_up_;

  const BrickGrid* open_ = nullptr;
  Pose3 X_open_W_ = Pose3::Identity();
  Eigen::AlignedBox3d open_bounds_M_;

  std::vector<int> voxels_;  // Of a block, at work, and their sums.
  std::vector<VoxelSum> sums_;

  BlockTable<Block> blocks_;
  std::size_t held_groups_ = 0;  // Of candidates, in all blocks.
  Block* last_block_ = nullptr;  // Is up to date.
};

/// A ray of a view on its way.
struct VogMap::Gaze {
  void Begin() {
    block = nullptr;
    last = -1;  // In no block of packed keys.
    is_over = false;
    unknown.clear();
  }

  Cache::Block* block;
  ViewWalk::PackedKey last;
  bool is_over;
  std::vector<VoxelKey> unknown;
};

VogMap::VogMap(double voxel_size_m, const SensorModel& model)
    : SubmapMap(voxel_size_m, model), cache_(std::make_unique<Cache>(grid(), model)) {}

VogMap::~VogMap() = default;
VogMap::VogMap(VogMap&&) noexcept = default;

void VogMap::ReleaseCache() const { cache_->Clear(); }

void VogMap::OnChange(SubmapId id, const PlacedSubmap* before, const PlacedSubmap* after) {
  cache_->OnChange(id, before, after);
}

void VogMap::OnOpenChange() { cache_->OnOpenChange(open(), X_open_W()); }

void VogMap::LogOddsAt(std::span<const Vec3> points_W, std::span<float> log_odds) const {
  for (std::size_t i = 0; i < points_W.size(); ++i) log_odds[i] = DirectLogOddsAt(points_W[i]);
}

void VogMap::LogOddsOf(std::span<const VoxelKey> voxels, std::span<float> log_odds) const {
  ReadVoxels(voxels, log_odds,
             [this](const VoxelKey& voxel) { return AnswerOf(cache_->UnitsOf(voxel)); });
}

void VogMap::LogOddsIn(const VoxelBox& box, std::vector<float>& log_odds) const {
  log_odds.resize(box.count());
  ForEachBlockIn(box, [&](const VoxelKey& key, const VoxelBox& part) {
    Cache::Block& block = cache_->BlockOf(key);
    const VoxelKey corner = VoxelOf(key, 0);
    for (int z = part.min.z; z <= part.max.z; ++z)
      for (int y = part.min.y; y <= part.max.y; ++y) {
        const std::size_t row = box.IndexOf({corner.x + part.min.x, corner.y + y, corner.z + z});
        const int index = IndexInBlock(VoxelKey{part.min.x, y, z});
        for (int x = 0; x < part.size_x(); ++x)
          log_odds[row + static_cast<std::size_t>(x)] = AnswerOf(cache_->UnitsOf(block, index + x));
      }
  });
}

void VogMap::NotFreeIn(const VoxelBox& box, std::vector<VoxelAnswer>& voxels) const {
  voxels.clear();
  ForEachBlockIn(box, [&](const VoxelKey& key, const VoxelBox& part) {
    const std::uint64_t mask = SliceMask(part.min.x, part.max.x, part.min.y, part.max.y);
    Cache::Block& block = cache_->BlockOf(key);
    for (int z = part.min.z; z <= part.max.z; ++z)
      for (std::uint64_t left = cache_->NotFreeIn(block, z, mask); left != 0; left &= left - 1) {
        const int index = z * kSlice + std::countr_zero(left);
        voxels.push_back(
            {VoxelOf(key, index), AnswerOf(block.answer[static_cast<std::size_t>(index)])});
      }
  });
}

template <class Visit>
void VogMap::WalkAnswers(const Vec3& origin_W, const Vec3& direction_W, double range_m,
                         Visit visit) const {
  Cache& cache = *cache_;
  Cache::Block* block = nullptr;
  VoxelKey corner;
  WalkVoxels(grid(), origin_W, direction_W, range_m, [&](const VoxelKey& voxel, double entered_m) {
    const bool is_in = (((voxel.x ^ corner.x) | (voxel.y ^ corner.y) | (voxel.z ^ corner.z)) &
                        ~(kBlockSide - 1)) == 0;
    if (!is_in || block == nullptr) [[unlikely]] {
      block = &cache.BlockOf(BlockKeyOf(voxel));
      corner = VoxelOf(block->key, 0);
    }
    return visit(voxel, entered_m, cache.UnitsOf(*block, IndexInBlock(voxel)));
  });
}

void VogMap::CastRay(const Vec3& origin_W, const Vec3& direction_W, double range_m,
                     std::vector<RayVoxel>& ray) const {
  ray.clear();
  WalkAnswers(origin_W, direction_W, range_m,
              [&](const VoxelKey& voxel, double entered_m, LogOddsUnits units) {
                ray.push_back({voxel, static_cast<float>(entered_m), AnswerOf(units)});
                return units < model().occupied_from;
              });
}

std::optional<RayVoxel> VogMap::FirstHit(const Vec3& origin_W, const Vec3& direction_W,
                                         double range_m) const {
  std::optional<RayVoxel> hit;
  WalkAnswers(origin_W, direction_W, range_m,
              [&](const VoxelKey& voxel, double entered_m, LogOddsUnits units) {
                if (units < model().occupied_from) return true;
                hit = RayVoxel{voxel, static_cast<float>(entered_m), AnswerOf(units)};
                return false;
              });
  return hit;
}

void VogMap::SeeUnknown(const Vec3& origin_W, std::span<const Vec3> directions_W,
                        double min_range_m, double range_m, const EndsRay& ends,
                        std::vector<VoxelKey>& unknown) const {
  constexpr std::size_t kFew = 3;  // Side by side, one ray takes as long as these one by one.
  if (directions_W.size() < kFew || !ViewWalk::Holds(grid(), origin_W, range_m)) {
    SubmapMap::SeeUnknown(origin_W, directions_W, min_range_m, range_m, ends, unknown);
    return;
  }
  unknown.clear();
  ViewWalk walk(grid());
  std::array<Gaze, ViewWalk::kLanes> gazes;
  for (std::size_t begin = 0; begin < directions_W.size(); begin += gazes.size()) {
    const std::size_t rays = std::min(gazes.size(), directions_W.size() - begin);
    walk.Clear();
    for (std::size_t i = 0; i < rays; ++i) {
      walk.Start(static_cast<int>(i), origin_W, directions_W[begin + i], range_m);
      gazes[i].Begin();
    }
    for (std::size_t left = rays; left > 0;) {
      const ViewWalk::Round& round = walk.Next();
      for (std::size_t i = 0; i < rays; ++i)
        if (!gazes[i].is_over && !Follow(round, i, min_range_m, ends, gazes[i])) --left;
    }
    for (std::size_t i = 0; i < rays; ++i)
      unknown.insert(unknown.end(), gazes[i].unknown.begin(), gazes[i].unknown.end());
  }
}

bool VogMap::Follow(const ViewWalk::Round& round, std::size_t lane, double min_range_m,
                    const EndsRay& ends, Gaze& gaze) const {
  Cache::Block* block = gaze.block;
  ViewWalk::PackedKey last = gaze.last;
  for (int step = 0; step < ViewWalk::kRound; ++step) {
    const double entered_m = round.entered_m[step][lane];
    if (std::isnan(entered_m)) return !(gaze.is_over = true);
    const ViewWalk::PackedKey voxel = round.key[step][lane];
    if ((voxel ^ last) & ~kPackedInBlock) [[unlikely]]
      block = &cache_->BlockOf(BlockKeyOf(ViewWalk::Unpack(voxel)));
    last = voxel;
    const int index = IndexInBlock(voxel);
    if (block->is_free.Get(index)) [[likely]]
      continue;
    const LogOddsUnits units = cache_->UnitsOf(*block, index);
    if (units == kUnknownUnits && entered_m >= min_range_m) {
      gaze.unknown.push_back(ViewWalk::Unpack(voxel));
      if (ends && ends(gaze.unknown.back())) return !(gaze.is_over = true);
    }
    if (units >= model().occupied_from) return !(gaze.is_over = true);
  }
  gaze.block = block;
  gaze.last = last;
  return true;
}

void VogMap::SigmaOf(std::span<const VoxelKey> voxels, std::span<float> sigma_m) const {
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const Vec3 center_W = grid().CenterOf(voxels[i]);
    const double least_m = cache_->LeastSigmaOf(voxels[i], sigma_revision(), [&](const auto& near) {
      return LeastSigmaAt(near, center_W);
    });
    sigma_m[i] = static_cast<float>(SigmaAt(center_W, least_m));
  }
}

}  // namespace vog
