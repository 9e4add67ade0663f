#include "lib/planner/free_places.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

namespace vog {
namespace {

constexpr int kMaxPlaces = 30000;
constexpr double kHeadingStep_rad = 2 * std::numbers::pi / kHeadings;

HeadingSet Turned(HeadingSet set) { return ((set << 1) | (set >> (kHeadings - 1))) & kAllHeadings; }
HeadingSet TurnedBack(HeadingSet set) {
  return ((set >> 1) | (set << (kHeadings - 1))) & kAllHeadings;
}

/// Voxels on each side of the middle one that something of `half_m` touches.
int VoxelsWithin(double half_m, double voxel_size_m) {
  return std::max(0, static_cast<int>(std::ceil(half_m / voxel_size_m + 0.5)) - 1);
}

}  // namespace

double YawOfHeading(int heading) { return WrapAngle(heading * kHeadingStep_rad); }

int HeadingOfYaw(double yaw_rad) {
  const int heading = static_cast<int>(std::lround(yaw_rad / kHeadingStep_rad)) % kHeadings;
  return heading < 0 ? heading + kHeadings : heading;
}

HeadingSet ArcAround(HeadingSet set, int heading) {
  if (set == kAllHeadings) return set;
  HeadingSet arc = set & (1u << heading);
  for (HeadingSet grown = arc;; arc = grown) {
    grown = (arc | Turned(arc) | TurnedBack(arc)) & set;
    if (grown == arc) return arc;
  }
}

int NearestHeading(HeadingSet set, double yaw_rad) {
  int nearest = -1;
  double least_rad = std::numeric_limits<double>::max();
  for (int heading = 0; heading < kHeadings; ++heading) {
    const double turn_rad = std::abs(WrapAngle(YawOfHeading(heading) - yaw_rad));
    if ((set >> heading & 1) == 0 || turn_rad >= least_rad) continue;
    nearest = heading;
    least_rad = turn_rad;
  }
  return nearest;
}

FreePlaces::FreePlaces(const CollisionRules& rules, const Eigen::AlignedBox3d& box_W,
                       double spacing_m)
    : rules_(rules),
      box_W_(box_W),
      wanted_spacing_m_(std::max(spacing_m, std::cbrt(box_W.volume() / kMaxPlaces))) {}

void FreePlaces::Measure(const VoxelGrid& grid) {
  grid_ = grid;
  const double voxel_m = grid.voxel_size_m();
  const double margin_m = std::max(rules_.clearance_m, rules_.unknown_clearance_m);
  const double sideways_m =
      0.5 * rules_.hull_size_m.head<2>().norm() + std::numbers::sqrt2 * margin_m + voxel_m;
  const Vec3 reach(sideways_m, sideways_m, 0.5 * rules_.hull_size_m.z() + margin_m + voxel_m);
  voxels_ = VoxelsOf(grid, {box_W_.min() - reach, box_W_.max() + reach});
  states_.assign(voxels_.count(), kUnknown);

  step_ = std::max(1, static_cast<int>(std::lround(wanted_spacing_m_ / voxel_m)));
  spacing_m_ = step_ * voxel_m;
  // Centres of voxels inside the box.
  const Vec3 inset = (0.5 * box_W_.sizes()).cwiseMin(Vec3::Constant(0.5 * voxel_m));
  const VoxelBox inside = VoxelsOf(grid, {box_W_.min() + inset, box_W_.max() - inset});
  const auto fit = [&](std::int64_t size, std::int32_t min, int& count, std::int32_t& first) {
    count = static_cast<int>((size - 1) / step_) + 1;
    first = min + static_cast<std::int32_t>((size - 1 - std::int64_t{count - 1} * step_) / 2);
  };
  fit(inside.size_x(), inside.min.x, count_[0], first_.x);
  fit(inside.size_y(), inside.min.y, count_[1], first_.y);
  fit(inside.size_z(), inside.min.z, count_[2], first_.z);
  levels_.resize(static_cast<std::size_t>(count_[2]));
}

/// The turned box, cut into the rows of voxels.
FreePlaces::Footprint FreePlaces::FootprintOf(const CollisionRules& rules, double clearance_m,
                                              double yaw_rad) const {
  const double voxel_m = grid_->voxel_size_m();
  const Eigen::Vector2d half =
      0.5 * rules.hull_size_m.head<2>() + Eigen::Vector2d::Constant(clearance_m);
  const Eigen::Rotation2Dd turn(yaw_rad);
  const std::array<Eigen::Vector2d, 4> corners = {
      turn * half, turn * Eigen::Vector2d(-half.x(), half.y()), turn * -half,
      turn * Eigen::Vector2d(half.x(), -half.y())};
  Footprint spans;
  const int rows = VoxelsWithin(half.norm(), voxel_m);
  for (int dy = -rows; dy <= rows; ++dy) {
    const double low_m = (dy - 0.5) * voxel_m, high_m = (dy + 0.5) * voxel_m;
    double x_min_m = std::numeric_limits<double>::max(), x_max_m = -x_min_m;
    const auto take = [&](double x_m) {
      x_min_m = std::min(x_min_m, x_m);
      x_max_m = std::max(x_max_m, x_m);
    };
    for (std::size_t c = 0; c < corners.size(); ++c) {
      const Eigen::Vector2d &a = corners[c], &b = corners[(c + 1) % corners.size()];
      if (a.y() >= low_m && a.y() <= high_m) take(a.x());
      for (const double y_m : {low_m, high_m})
        if ((a.y() - y_m) * (b.y() - y_m) < 0)
          take(a.x() + (y_m - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
    }
    if (x_min_m > x_max_m) continue;
    spans.push_back({dy, static_cast<int>(std::floor(x_min_m / voxel_m - 0.5)) + 1,
                     static_cast<int>(std::ceil(x_max_m / voxel_m + 0.5)) - 1});
  }
  return spans;
}

FreePlaces::Footprint FreePlaces::UnionOf(std::span<const Footprint> footprints) {
  std::map<int, Span> rows;
  for (const Footprint& footprint : footprints)
    for (const Span& span : footprint) {
      Span& row = rows.emplace(span.dy, span).first->second;
      row.dx_min = std::min(row.dx_min, span.dx_min);
      row.dx_max = std::max(row.dx_max, span.dx_max);
    }
  Footprint all;
  for (const auto& [dy, span] : rows) all.push_back(span);
  return all;
}

void FreePlaces::SetRules(const CollisionRules& rules) {
  for (int heading = 0; heading < kHeadings / 2; ++heading) {
    const auto h = static_cast<std::size_t>(heading);
    near_occupied_[h] = FootprintOf(rules, rules.clearance_m, YawOfHeading(heading));
    near_unknown_[h] = FootprintOf(rules, rules.unknown_clearance_m, YawOfHeading(heading));
  }
  turning_near_occupied_ = UnionOf(near_occupied_);
  turning_near_unknown_ = UnionOf(near_unknown_);
  const double half_m = 0.5 * rules.hull_size_m.z(), voxel_m = grid_->voxel_size_m();
  occupied_layers_ = VoxelsWithin(half_m + rules.clearance_m, voxel_m);
  unknown_layers_ = VoxelsWithin(half_m + rules.unknown_clearance_m, voxel_m);
}

void FreePlaces::Update(const OccupancyMap& map, const CollisionChecker& checker) {
  if (!grid_) Measure(map.grid());
  SetRules(checker.rules());
  ReadChanges(map, checker);
  FindOccupied(map, checker.rules());
  MarkNeighbours();
  keep_out_.clear();
  for (const Eigen::AlignedBox3d& box_W : checker.keep_out_W()) {
    const VoxelBox box = Intersection(VoxelsOf(*grid_, box_W), voxels_);
    if (!box.IsEmpty()) keep_out_.push_back(box);
  }
  for (int level = 0; level < count_[2]; ++level) DrawLevel(level);
  headings_.assign(static_cast<std::size_t>(places()), 0);
  has_headings_.assign(static_cast<std::size_t>(places()), false);
}

void FreePlaces::ReadChanges(const OccupancyMap& map, const CollisionChecker& checker) {
  const auto changed = revision_ < 0 ? std::nullopt : map.ChangedSince(revision_);
  revision_ = map.revision();
  const Eigen::AlignedBox3d was_hidden_W = std::exchange(hidden_W_, checker.PresenceBounds());
  const std::vector<FreeBubble> old_bubbles = std::exchange(bubbles_, checker.bubbles());
  std::vector<VoxelBox> boxes;
  std::size_t count = 0;
  const auto add = [&](const Eigen::AlignedBox3d& box_W) {
    if (box_W.isEmpty()) return;
    const VoxelBox box = Intersection(VoxelsOf(*grid_, box_W), voxels_);
    const auto holds_it = [&](const VoxelBox& other) {
      return other.Contains(box.min) && other.Contains(box.max);
    };
    if (count > voxels_.count() || box.IsEmpty() ||
        std::any_of(boxes.begin(), boxes.end(), holds_it))
      return;
    boxes.push_back(box);
    count += box.count();
  };
  if (changed) {
    for (const Eigen::AlignedBox3d& box_W : *changed) add(box_W);
    add(was_hidden_W);
    add(hidden_W_);
    for (std::size_t i = 0; i < std::max(bubbles_.size(), old_bubbles.size()); ++i) {
      const auto bubble_in = [i](const std::vector<FreeBubble>& bubbles) {
        return i < bubbles.size() ? bubbles[i] : FreeBubble();
      };
      const FreeBubble bubble = bubble_in(bubbles_), old_bubble = bubble_in(old_bubbles);
      if (bubble != old_bubble) add(bubble.bounds_W().merged(old_bubble.bounds_W()));
    }
  }
  if (!changed || count > voxels_.count()) boxes = {voxels_};
  for (const VoxelBox& box : boxes) Read(map, checker, box);
}

void FreePlaces::Read(const OccupancyMap& map, const CollisionChecker& checker,
                      const VoxelBox& box) {
  const State unknown = checker.rules().unknown_blocks ? kUnknown : kFree;
  const auto state_of = [&](float answer) {
    return map.IsFree(answer) ? kFree : map.IsOccupied(answer) ? kOccupied : unknown;
  };
  // A slab of a VogMap's blocks at a time, which the processor's caches hold.
  constexpr std::int32_t kSlab = 8;
  VoxelBox slab = box;
  for (; slab.min.z <= box.max.z; slab.min.z = slab.max.z + 1) {
    slab.max.z = std::min(box.max.z, slab.min.z | (kSlab - 1));
    map.LogOddsIn(slab, log_odds_);
    auto row = log_odds_.begin();
    for (std::int32_t z = slab.min.z; z <= slab.max.z; ++z)
      for (std::int32_t y = slab.min.y; y <= slab.max.y; ++y, row += slab.size_x())
        std::transform(row, row + slab.size_x(), &states_[voxels_.IndexOf({slab.min.x, y, z})],
                       state_of);
  }
  FreeWhatTheCheckerFrees(checker, checker.PresenceBounds(), box);
  for (const FreeBubble& bubble : checker.bubbles())
    FreeWhatTheCheckerFrees(checker, bubble.bounds_W(), box);
}

void FreePlaces::FreeWhatTheCheckerFrees(const CollisionChecker& checker,
                                         const Eigen::AlignedBox3d& bounds_W, const VoxelBox& box) {
  if (bounds_W.isEmpty()) return;
  ForEachVoxel(Intersection(VoxelsOf(*grid_, bounds_W), box), [&](const VoxelKey& key) {
    State& state = states_[voxels_.IndexOf(key)];
    if (state != kFree && checker.TakesForFree(state == kOccupied, grid_->CenterOf(key)))
      state = kFree;
  });
}

void FreePlaces::FindOccupied(const OccupancyMap& map, const CollisionRules& rules) {
  std::vector<VoxelKey> keys;
  const State* const end = states_.data() + states_.size();
  const auto next = [&](const State* from) {
    return static_cast<const State*>(
        std::memchr(from, kOccupied, static_cast<std::size_t>(end - from)));
  };
  for (const State* at = next(states_.data()); at != nullptr; at = next(at + 1))
    keys.push_back(voxels_.KeyOf(static_cast<std::size_t>(at - states_.data())));
  std::vector<float> sigma_m(keys.size(), 0);
  if (rules.uncertainty_sigmas * map.max_sigma_m() > 0) map.SigmaOf(keys, sigma_m);
  occupied_.clear();
  for (std::size_t k = 0; k < keys.size(); ++k)
    occupied_.push_back(
        {keys[k], static_cast<float>(rules.GrowthFor(sigma_m[k]) / grid_->voxel_size_m())});
}

void FreePlaces::MarkNeighbours() {
  is_next_to_occupied_.assign(voxels_.count(), 0);
  for (const Occupied& voxel : occupied_) {
    const VoxelKey& key = voxel.key;
    const VoxelBox around = {{key.x - 1, key.y - 1, key.z - 1}, {key.x + 1, key.y + 1, key.z + 1}};
    ForEachVoxel(Intersection(around, voxels_),
                 [this](const VoxelKey& near) { is_next_to_occupied_[voxels_.IndexOf(near)] = 1; });
  }
}

void FreePlaces::DrawLevel(int level) {
  const auto width = static_cast<std::size_t>(voxels_.size_x());
  const auto rows = static_cast<std::size_t>(voxels_.size_y());
  const std::int32_t z = first_.z + level * step_;
  std::vector<std::uint8_t> occupied(width * rows, 0), unknown(width * rows, 0);
  for (std::int32_t layer = z - unknown_layers_; layer <= z + unknown_layers_; ++layer) {
    const State* states = &states_[voxels_.IndexOf({voxels_.min.x, voxels_.min.y, layer})];
    for (std::size_t i = 0; i < unknown.size(); ++i) unknown[i] |= states[i] == kUnknown;
  }
  for (const VoxelBox& box : keep_out_) {
    if (z + unknown_layers_ < box.min.z || z - unknown_layers_ > box.max.z) continue;
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y) {
      const std::size_t row = static_cast<std::size_t>(y - voxels_.min.y) * width;
      std::fill_n(unknown.begin() + static_cast<std::ptrdiff_t>(
                                        row + static_cast<std::size_t>(box.min.x - voxels_.min.x)),
                  box.size_x(), std::uint8_t{1});
    }
  }
  const auto by_height = [](const Occupied& a, std::int32_t height) { return a.key.z < height; };
  const auto begin =
      std::lower_bound(occupied_.begin(), occupied_.end(), z - occupied_layers_, by_height);
  const auto end = std::lower_bound(begin, occupied_.end(), z + occupied_layers_ + 1, by_height);
  for (auto voxel = begin; voxel != end; ++voxel) {
    const int x = voxel->key.x - voxels_.min.x, y = voxel->key.y - voxels_.min.y;
    const int reach = static_cast<int>(voxel->reach_voxels);
    const float reach_squared = voxel->reach_voxels * voxel->reach_voxels;
    for (int dy = -reach; dy <= reach; ++dy)
      for (int dx = -reach; dx <= reach; ++dx) {
        if (static_cast<float>(dx * dx + dy * dy) > reach_squared || x + dx < 0 || y + dy < 0 ||
            x + dx >= static_cast<int>(width) || y + dy >= static_cast<int>(rows))
          continue;
        occupied[static_cast<std::size_t>(y + dy) * width + static_cast<std::size_t>(x + dx)] = 1;
      }
  }
  const auto sum = [&](const std::vector<std::uint8_t>& is_there,
                       std::vector<std::uint16_t>& before) {
    before.resize((width + 1) * rows);
    for (std::size_t row = 0; row < rows; ++row) {
      std::uint16_t count = 0;
      for (std::size_t x = 0; x < width; ++x) {
        before[row * (width + 1) + x] = count;
        count = static_cast<std::uint16_t>(count + is_there[row * width + x]);
      }
      before[row * (width + 1) + width] = count;
    }
  };
  Level& drawn = levels_[static_cast<std::size_t>(level)];
  sum(occupied, drawn.occupied_before);
  sum(unknown, drawn.unknown_before);
}

bool FreePlaces::IsClear(const Footprint& footprint, const std::vector<std::uint16_t>& before,
                         int x, int y) const {
  const auto stride = static_cast<std::ptrdiff_t>(voxels_.size_x() + 1);
  return std::all_of(footprint.begin(), footprint.end(), [&](const Span& span) {
    const std::uint16_t* row = before.data() + (y + span.dy) * stride;
    return row[x + span.dx_max + 1] == row[x + span.dx_min];
  });
}

VoxelKey FreePlaces::VoxelOf(int place) const {
  const int x = place % count_[0], y = place / count_[0] % count_[1];
  const int z = place / (count_[0] * count_[1]);
  return {first_.x + x * step_, first_.y + y * step_, first_.z + z * step_};
}

Vec3 FreePlaces::PositionOf(int place) const { return grid_->CenterOf(VoxelOf(place)); }

std::vector<int> FreePlaces::PlacesAround(const Vec3& p_W, double radius_m) const {
  const Vec3 first_W = grid_->CenterOf(first_);
  std::array<int, 3> low, high;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const double offset_m = p_W[axis] - first_W[axis];
    low[a] = std::max(0, static_cast<int>(std::ceil((offset_m - radius_m) / spacing_m_)));
    high[a] =
        std::min(count_[a] - 1, static_cast<int>(std::floor((offset_m + radius_m) / spacing_m_)));
  }
  std::vector<int> places;
  for (int z = low[2]; z <= high[2]; ++z)
    for (int y = low[1]; y <= high[1]; ++y)
      for (int x = low[0]; x <= high[0]; ++x) places.push_back((z * count_[1] + y) * count_[0] + x);
  return places;
}

void FreePlaces::NeighboursOf(int place, std::vector<int>& neighbours) const {
  neighbours.clear();
  const int x = place % count_[0], y = place / count_[0] % count_[1];
  const int z = place / (count_[0] * count_[1]);
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const int axes = std::abs(dx) + std::abs(dy) + std::abs(dz);
        if (axes == 0 || axes == 3) continue;
        const int nx = x + dx, ny = y + dy, nz = z + dz;
        if (nx < 0 || ny < 0 || nz < 0 || nx >= count_[0] || ny >= count_[1] || nz >= count_[2])
          continue;
        neighbours.push_back((nz * count_[1] + ny) * count_[0] + nx);
      }
}

HeadingSet FreePlaces::HeadingsAt(int place) const {
  const auto p = static_cast<std::size_t>(place);
  if (has_headings_[p]) return headings_[p];
  const VoxelKey key = VoxelOf(place);
  const int x = key.x - voxels_.min.x, y = key.y - voxels_.min.y;
  const Level& level = levels_[static_cast<std::size_t>(place / (count_[0] * count_[1]))];
  HeadingSet set = 0;
  if (IsClear(turning_near_occupied_, level.occupied_before, x, y) &&
      IsClear(turning_near_unknown_, level.unknown_before, x, y))
    set = kAllHeadings;
  for (int heading = 0; set != kAllHeadings && heading < kHeadings / 2; ++heading) {
    const auto h = static_cast<std::size_t>(heading);
    // The box looks the same from behind.
    if (IsClear(near_occupied_[h], level.occupied_before, x, y) &&
        IsClear(near_unknown_[h], level.unknown_before, x, y))
      set |= 1u << heading | 1u << (heading + kHeadings / 2);
  }
  has_headings_[p] = true;
  return headings_[p] = set;
}

}  // namespace vog
