#include "lib/vogmap/compact_file.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <type_traits>

#include "lib/base/parallel.h"

namespace vog {
namespace {

static_assert(std::endian::native == std::endian::little, "compact files are little-endian");

// The parts of the file, in order: Header, MapRecord, a SubmapRecord each, all tables, zeros up to
// a multiple of a brick's bytes, all bricks. The first check sum guards all but the bricks.

constexpr std::array<char, 8> kMagic = {'V', 'O', 'G', '-', 'm', 'a', 'p', '\n'};
constexpr std::uint64_t kVersion = 2;
constexpr std::size_t kBrickBytes = BrickGrid::kBrickVoxels;

struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint64_t version = kVersion;
  std::uint64_t index_checksum = 0;  // Of all from here to the bricks.
  std::uint64_t file_bytes = 0;
  std::uint64_t index_bytes = 0;  // Where the bricks begin.
  std::uint64_t submaps = 0;
  std::uint64_t map_toml_bytes = 0, map_toml_crc32 = 0;
};
constexpr std::size_t kUnchecked = offsetof(Header, file_bytes);

struct MapRecord {
  double voxel_size_m = 0;
  std::array<double, 5> probabilities{};
  std::int64_t run_id = 0;
  std::uint64_t complete = 0, graph_crc32 = 0;
  std::uint64_t has_end = 0, has_put_in = 0;
  EndEntry end;
  PutInEntry put_in;
};

struct SubmapRecord {
  SubmapEntry entry;
  double voxel_size_m = 0;  // As its octree says.
  std::uint64_t octree_bytes = 0;
  std::array<std::int32_t, 3> origin{};
  std::array<std::uint32_t, 3> size{};
  std::uint64_t table_at = 0;  // In the file, like the next.
  std::uint64_t bricks_at = 0, bricks = 0, bricks_checksum = 0;
};

// A gap would be bytes of chance.
static_assert(sizeof(Header) == 8 * 8);
static_assert(sizeof(EndEntry) == (1 + 7 + 9) * 8);
static_assert(sizeof(PutInEntry) == (4 + 2 * 7 + 9 + 36) * 8);
static_assert(sizeof(MapRecord) == 11 * 8 + sizeof(EndEntry) + sizeof(PutInEntry));
static_assert(sizeof(SubmapEntry) == (1 + 5 + 4 * 7 + 2 * 9 + 36) * 8);
static_assert(sizeof(SubmapRecord) == sizeof(SubmapEntry) + 9 * 8);
static_assert(std::is_trivially_copyable_v<SubmapRecord>);

template <class Record>
std::string_view BytesOf(const Record& record) {
  return {reinterpret_cast<const char*>(&record), sizeof(Record)};
}

/// @pre it lies within `bytes`.
template <class Record>
Record RecordAt(std::string_view bytes, std::size_t at) {
  Record record;
  std::memcpy(&record, bytes.data() + at, sizeof(Record));
  return record;
}

// --- Writing ---

/// How a grid is laid out in the file: a table over the box of its bricks, and the numbers that
/// these have in the grid, in the order of the table. Bricks without a known voxel are left out,
/// as an octree would: the layout depends on the grid's content alone.
struct Layout {
  SubmapRecord record;
  std::vector<std::uint16_t> table, numbers;
};

const LogOddsUnits* BrickOf(const BrickGrid& grid, std::uint16_t number) {
  return grid.values() + std::size_t{number} * kBrickBytes;
}

bool IsKnown(const BrickGrid& grid, std::uint16_t number) {
  const LogOddsUnits* brick = BrickOf(grid, number);
  return std::any_of(brick, brick + kBrickBytes,
                     [](LogOddsUnits units) { return units != kUnknownUnits; });
}

/// Calls `visit(x, y, z, number)` for each brick with a known voxel, in the order of the table.
template <class Visit>
void ForEachKnownBrick(const BrickGrid& grid, Visit visit) {
  const std::uint16_t* entry = grid.table();
  const auto size = grid.table_size();
  for (std::uint32_t z = 0; z < size[2]; ++z)
    for (std::uint32_t y = 0; y < size[1]; ++y)
      for (std::uint32_t x = 0; x < size[0]; ++x, ++entry)
        if (*entry != BrickGrid::kNoBrick && IsKnown(grid, *entry)) visit(x, y, z, *entry);
}

std::string BricksOf(const BrickGrid& grid, const Layout& layout) {
  std::string bytes;
  bytes.reserve(layout.numbers.size() * kBrickBytes);
  for (const std::uint16_t number : layout.numbers)
    bytes.append(reinterpret_cast<const char*>(BrickOf(grid, number)), kBrickBytes);
  return bytes;
}

Layout LayoutOf(const BrickGrid& grid) {
  std::array<std::uint32_t, 3> min, max;
  min.fill(std::numeric_limits<std::uint32_t>::max());
  max.fill(0);  // One past the last.
  ForEachKnownBrick(grid, [&](std::uint32_t x, std::uint32_t y, std::uint32_t z, std::uint16_t) {
    min = {std::min(min[0], x), std::min(min[1], y), std::min(min[2], z)};
    max = {std::max(max[0], x + 1), std::max(max[1], y + 1), std::max(max[2], z + 1)};
  });
  Layout layout;
  SubmapRecord& record = layout.record;
  record.voxel_size_m = grid.grid().voxel_size_m();
  record.bricks_checksum = Checksum64("");
  if (max[0] == 0) return layout;
  const VoxelKey origin = grid.table_origin();
  record.origin = {origin.x + static_cast<std::int32_t>(min[0]),
                   origin.y + static_cast<std::int32_t>(min[1]),
                   origin.z + static_cast<std::int32_t>(min[2])};
  record.size = {max[0] - min[0], max[1] - min[1], max[2] - min[2]};
  layout.table.assign(std::size_t{record.size[0]} * record.size[1] * record.size[2],
                      BrickGrid::kNoBrick);
  ForEachKnownBrick(
      grid, [&](std::uint32_t x, std::uint32_t y, std::uint32_t z, std::uint16_t number) {
        layout.table[((z - min[2]) * record.size[1] + y - min[1]) * record.size[0] + x - min[0]] =
            static_cast<std::uint16_t>(layout.numbers.size());
        layout.numbers.push_back(number);
      });
  record.bricks = layout.numbers.size();
  record.bricks_checksum = Checksum64(BricksOf(grid, layout));
  return layout;
}

MapRecord RecordOf(const MapEntry& map) {
  const SensorModelOptions& model = map.sensor_model;
  return {.voxel_size_m = map.voxel_size_m,
          .probabilities = {model.hit_probability, model.miss_probability, model.min_probability,
                            model.max_probability, model.occupied_probability},
          .run_id = map.run_id,
          .complete = map.complete,
          .graph_crc32 = map.graph_crc32,
          .has_end = map.end.has_value(),
          .has_put_in = map.put_in.has_value(),
          .end = map.end.value_or(EndEntry{}),
          .put_in = map.put_in.value_or(PutInEntry{})};
}

/// Gives each layout its places in the file. Returns where the bricks begin and end.
std::pair<std::uint64_t, std::uint64_t> Place(std::vector<Layout>& layouts) {
  std::uint64_t at = sizeof(Header) + sizeof(MapRecord) + layouts.size() * sizeof(SubmapRecord);
  for (Layout& layout : layouts) {
    layout.record.table_at = at;
    at += layout.table.size() * sizeof(std::uint16_t);
  }
  at = (at + kBrickBytes - 1) / kBrickBytes * kBrickBytes;
  const std::uint64_t begin = at;
  for (Layout& layout : layouts) {
    layout.record.bricks_at = at;
    at += layout.record.bricks * kBrickBytes;
  }
  return {begin, at};
}

/// All but the bricks.
std::string IndexOf(const MapEntry& map, const std::vector<Layout>& layouts, Header header) {
  std::string index(BytesOf(header));
  index.reserve(header.index_bytes);
  index += BytesOf(RecordOf(map));
  for (const Layout& layout : layouts) index += BytesOf(layout.record);
  for (const Layout& layout : layouts)
    index.append(reinterpret_cast<const char*>(layout.table.data()),
                 layout.table.size() * sizeof(std::uint16_t));
  index.resize(header.index_bytes);
  header.index_checksum = Checksum64(std::string_view(index).substr(kUnchecked));
  std::memcpy(index.data(), &header, sizeof(header));
  return index;
}

// --- Reading ---

bool IsWhole(std::string_view bytes, const Header& header) {
  constexpr std::uint64_t kLeast = sizeof(Header) + sizeof(MapRecord);
  return header.file_bytes == bytes.size() && header.index_bytes >= kLeast &&
         header.index_bytes <= bytes.size() &&
         header.submaps <= (header.index_bytes - kLeast) / sizeof(SubmapRecord) &&
         Checksum64(bytes.substr(kUnchecked, header.index_bytes - kUnchecked)) ==
             header.index_checksum;
}

MapEntry EntryOf(const MapRecord& record) {
  const auto& p = record.probabilities;
  return {.voxel_size_m = record.voxel_size_m,
          .sensor_model = {p[0], p[1], p[2], p[3], p[4]},
          .run_id = record.run_id,
          .complete = record.complete != 0,
          .graph_crc32 = record.graph_crc32,
          .end = record.has_end != 0 ? std::optional(record.end) : std::nullopt,
          .put_in = record.has_put_in != 0 ? std::optional(record.put_in) : std::nullopt};
}

std::size_t PlaceOf(std::size_t submap) {
  return sizeof(Header) + sizeof(MapRecord) + submap * sizeof(SubmapRecord);
}

/// `count` elements at `at`; nothing where the file has no room for them or they are not aligned.
template <class T>
std::optional<std::span<const T>> SpanAt(std::string_view bytes, std::uint64_t at,
                                         std::uint64_t count) {
  if (at > bytes.size() || at % alignof(T) != 0 || count > (bytes.size() - at) / sizeof(T))
    return std::nullopt;
  return std::span(reinterpret_cast<const T*>(bytes.data() + at), count);
}

}  // namespace

void WriteCompactFile(const std::filesystem::path& path, const std::string& map_toml,
                      const MapEntries& entries, std::span<const BrickGrid* const> grids,
                      std::span<const std::uint64_t> octree_bytes) {
  std::vector<Layout> layouts(grids.size());
  ParallelFor(grids.size(), [&](std::size_t i) {
    layouts[i] = LayoutOf(*grids[i]);
    layouts[i].record.entry = entries.submaps[i];
    layouts[i].record.octree_bytes = octree_bytes[i];
  });
  const auto [begin, end] = Place(layouts);
  AtomicFileWriter file(path);
  file.Write(IndexOf(entries.map, layouts,
                     {.file_bytes = end,
                      .index_bytes = begin,
                      .submaps = layouts.size(),
                      .map_toml_bytes = map_toml.size(),
                      .map_toml_crc32 = Crc32(map_toml)}));
  for (std::size_t i = 0; i < layouts.size(); ++i) file.Write(BricksOf(*grids[i], layouts[i]));
  file.Commit();
}

std::optional<CompactFile> CompactFile::Open(const std::filesystem::path& path,
                                             const std::string& map_toml, CompactState& state) {
  CompactFile opened;
  opened.file_ = MappedFile::Open(path);
  state = StateOf(path) ? CompactState::kDamaged : CompactState::kMissing;
  if (opened.file_ == nullptr) return std::nullopt;
  const std::string_view bytes = opened.file_->bytes();
  if (bytes.size() < sizeof(Header)) return std::nullopt;
  const auto header = RecordAt<Header>(bytes, 0);
  if (header.magic != kMagic) return std::nullopt;
  state = CompactState::kStale;
  if (header.version != kVersion || header.map_toml_bytes != map_toml.size() ||
      header.map_toml_crc32 != Crc32(map_toml))
    return std::nullopt;
  state = CompactState::kDamaged;
  if (!IsWhole(bytes, header)) return std::nullopt;
  state = CompactState::kValid;
  opened.entries_.map = EntryOf(RecordAt<MapRecord>(bytes, sizeof(Header)));
  opened.entries_.submaps.reserve(header.submaps);
  for (std::size_t i = 0; i < header.submaps; ++i)
    opened.entries_.submaps.push_back(RecordAt<SubmapRecord>(bytes, PlaceOf(i)).entry);
  return opened;
}

bool CompactFile::IsOf(const std::filesystem::path& folder, std::size_t i) const {
  const auto record = RecordAt<SubmapRecord>(file_->bytes(), PlaceOf(i));
  const auto octree = StateOf(folder / OctreeNameOf(record.entry.id));
  // One of the same moment may have been written after the file.
  return octree && octree->size == record.octree_bytes &&
         octree->modified_ns < file_->state().modified_ns;
}

std::optional<BrickGrid> CompactFile::Grid(std::size_t i) const {
  const std::string_view bytes = file_->bytes();
  const auto record = RecordAt<SubmapRecord>(bytes, PlaceOf(i));
  const auto& size = record.size;
  const double entries = double{1} * size[0] * size[1] * size[2];
  if (entries > static_cast<double>(bytes.size())) return std::nullopt;
  const auto table =
      SpanAt<std::uint16_t>(bytes, record.table_at, static_cast<std::uint64_t>(entries));
  if (!table || record.bricks > bytes.size() / kBrickBytes) return std::nullopt;
  const auto values = SpanAt<LogOddsUnits>(bytes, record.bricks_at, record.bricks * kBrickBytes);
  if (!values ||
      Checksum64(bytes.substr(record.bricks_at, values->size())) != record.bricks_checksum)
    return std::nullopt;
  const auto& [x, y, z] = record.origin;
  return BrickGrid::Borrow(record.voxel_size_m, {{x, y, z}, size, *table, *values}, file_);
}

}  // namespace vog
