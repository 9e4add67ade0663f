#include "lib/vogmap/map_folder.h"

#include <algorithm>
#include <optional>
#include <variant>

#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/base/log.h"
#include "lib/base/parallel.h"
#include "lib/submap/octree_file.h"

namespace vog {
namespace {

constexpr const char* kMapToml = "map.toml";
constexpr const char* kGraph = "graph.g2o";
constexpr const char* kCompact = "compact.bin";

/// Where a new file waits while the map of before needs its name: 000001.ot is 000001-1a2b3c4d.ot
/// until then.
std::string WaitingNameOf(const std::filesystem::path& name, std::uint32_t crc32) {
  return (name.parent_path() / name.stem()).string() + "-" + ToHex(crc32) +
         name.extension().string();
}

void CreateFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw SystemError(folder.string() + ": cannot create: " + error.message());
}

/// Whether a file's name is one of WaitingNameOf(), or that of a file half written.
bool IsLeftover(const std::filesystem::path& file) {
  const std::string stem = file.stem().string(), ending = file.extension().string();
  const bool is_waiting =
      stem.size() > 9 && stem[stem.size() - 9] == '-' &&
      stem.find_first_not_of("0123456789abcdef", stem.size() - 8) == std::string::npos;
  return ending == ".tmp" || ((ending == ".ot" || ending == ".g2o") && is_waiting);
}

// --- Reading ---

/// A file of the folder, or why it cannot be used.
struct FileText {
  std::string bytes, fault;
};

/// Reads the file that has `crc32`: the one in place, or the one that waited for it when the
/// program was killed.
FileText ReadChecked(const std::filesystem::path& folder, const std::string& name,
                     std::uint64_t crc32, const char* otherwise) {
  const auto read = [&](const std::filesystem::path& path) -> FileText {
    try {
      FileText text{ReadFile(path), ""};
      if (Crc32(text.bytes) != crc32) text.fault = path.string() + ": " + otherwise;
      return text;
    } catch (const SystemError& error) {
      return {"", error.what()};
    }
  };
  const std::filesystem::path path = folder / name;
  FileText in_place = read(path);
  if (in_place.fault.empty()) return in_place;
  FileText waiting = read(folder / WaitingNameOf(name, static_cast<std::uint32_t>(crc32)));
  if (waiting.fault.empty()) return waiting;
  return read(path);  // It may have been put in place since we looked there.
}

/// A submap's grid, or why there is none.
using GridOrFault = std::variant<std::string, BrickGrid>;

GridOrFault ReadOctree(const SubmapEntry& entry, const std::filesystem::path& folder) {
  const std::string name = OctreeNameOf(entry.id);
  const FileText text = ReadChecked(folder, name, entry.octree_crc32,
                                    "the check sum does not match, the file is damaged");
  if (!text.fault.empty()) return text.fault;
  auto grid = FromOctreeBytes(text.bytes);
  if (const auto* fault = std::get_if<std::string>(&grid))
    return (folder / name).string() + ": " + *fault;
  return std::move(std::get<BrickGrid>(grid));
}

/// What a folder holds, in the order of map.toml.
struct Content {
  std::string map_toml;
  MapEntries entries;
  std::vector<GridOrFault> grids;
  CompactState compact = CompactState::kMissing;
  std::size_t octrees_read = 0;
};

/// Fills the grids from `compact`, if any, and those that it does not have from their octrees.
void ReadGrids(const std::filesystem::path& folder, const std::optional<CompactFile>& compact,
               Content& content) {
  const std::size_t count = content.entries.submaps.size();
  enum class From : char { kCompact, kOctree, kOctreeForDamage };
  std::vector<From> from(count, From::kOctree);
  content.grids.resize(count);
  ParallelFor(count, [&](std::size_t i) {
    if (compact && compact->IsOf(folder, i)) {
      auto grid = compact->Grid(i);
      from[i] = grid ? From::kCompact : From::kOctreeForDamage;
      if (grid) content.grids[i] = std::move(*grid);
    }
    if (from[i] != From::kCompact)
      content.grids[i] = ReadOctree(content.entries.submaps[i], folder);
  });
  content.octrees_read =
      count - static_cast<std::size_t>(std::count(from.begin(), from.end(), From::kCompact));
  if (std::find(from.begin(), from.end(), From::kOctreeForDamage) != from.end())
    content.compact = CompactState::kDamaged;
}

std::string ReadMapToml(const std::filesystem::path& folder) {
  if (!IsMapFolder(folder))
    throw UsageError(folder.string() + ": no map here: a map is a folder with a map.toml");
  return ReadFile(folder / kMapToml);
}

MapEntries ParseMapToml(const std::string& map_toml, const std::filesystem::path& folder) {
  return FromMapToml(map_toml, (folder / kMapToml).string());
}

Content ReadContent(const std::filesystem::path& folder, CompactUse use) {
  Content content;
  content.map_toml = ReadMapToml(folder);
  std::optional<CompactFile> compact;
  if (use == CompactUse::kAllowed)
    compact = CompactFile::Open(folder / kCompact, content.map_toml, content.compact);
  content.entries = compact ? compact->entries() : ParseMapToml(content.map_toml, folder);
  ReadGrids(folder, compact, content);
  return content;
}

std::vector<const BrickGrid*> PointersTo(const StoredMap& map) {
  std::vector<const BrickGrid*> grids;
  for (const SubmapPtr& submap : map.submaps) grids.push_back(&submap->grid);
  return grids;
}

}  // namespace

MapFolderWriter::MapFolderWriter(std::filesystem::path folder) : folder_(std::move(folder)) {
  CreateFolder(folder_ / "submaps");
}

void MapFolderWriter::AddSubmap(const Submap& submap, const std::string& octree_bytes) {
  const std::uint32_t crc32 = Crc32(octree_bytes);
  Stage(OctreeNameOf(submap.id()), octree_bytes, crc32);
  octrees_[submap.id()] = {crc32, octree_bytes.size()};
}

void MapFolderWriter::Stage(const std::string& name, const std::string& bytes,
                            std::uint32_t crc32) {
  waiting_.erase(name);
  const std::filesystem::path path = folder_ / name;
  if (FileHolds(path, bytes)) return;
  if (!StateOf(path)) {
    WriteFileAtomically(path, bytes);
    return;
  }
  const std::string waiting = WaitingNameOf(name, crc32);
  if (!FileHolds(folder_ / waiting, bytes)) WriteFileAtomically(folder_ / waiting, bytes);
  waiting_[name] = waiting;
}

void MapFolderWriter::Commit(const StoredMap& map) {
  const std::uint32_t graph_crc32 = Crc32(map.graph_g2o);
  MapEntries entries{
      .map = {map.voxel_size_m, map.sensor_model, map.run_id, map.complete, graph_crc32},
      .submaps = {}};
  if (map.end) entries.map.end = EntryOf(*map.end);
  if (map.put_in) entries.map.put_in = EntryOf(*map.put_in);
  for (const SubmapPtr& submap : map.submaps)
    entries.submaps.push_back(
        EntryOf(*submap, map.X_WM.at(submap->id()), octrees_.at(submap->id()).crc32));
  Stage(kGraph, map.graph_g2o, graph_crc32);
  const std::string map_toml = ToMapToml(entries);
  if (!FileHolds(folder_ / kMapToml, map_toml)) WriteFileAtomically(folder_ / kMapToml, map_toml);
  PutInPlace();
  RemoveLeftovers();
  WriteCompact(map, map_toml, entries);
}

void MapFolderWriter::PutInPlace() {
  while (!waiting_.empty()) {
    const auto& [name, waiting] = *waiting_.begin();
    std::error_code error;
    std::filesystem::rename(folder_ / waiting, folder_ / name, error);
    if (error)
      throw SystemError((folder_ / name).string() + ": cannot replace: " + error.message());
    waiting_.erase(waiting_.begin());
  }
}

void MapFolderWriter::RemoveLeftovers() {
  if (is_tidy_) return;
  is_tidy_ = true;
  std::error_code ignored;  // They do no harm.
  for (const auto& folder : {folder_, folder_ / "submaps"}) {
    std::filesystem::directory_iterator files(folder, ignored);
    for (; files != std::filesystem::directory_iterator(); files.increment(ignored))
      if (IsLeftover(files->path())) std::filesystem::remove(files->path(), ignored);
  }
}

void MapFolderWriter::WriteCompact(const StoredMap& map, const std::string& map_toml,
                                   const MapEntries& entries) {
  if (!map.complete) {
    // It would be of a map that will soon be another; one that is there is of an older one.
    std::error_code ignored;
    std::filesystem::remove(folder_ / kCompact, ignored);
    return;
  }
  CompactState state;
  if (CompactFile::Open(folder_ / kCompact, map_toml, state)) return;
  std::vector<std::uint64_t> octree_bytes;
  for (const SubmapPtr& submap : map.submaps)
    octree_bytes.push_back(octrees_.at(submap->id()).bytes);
  try {
    WriteCompactFile(folder_ / kCompact, map_toml, entries, PointersTo(map), octree_bytes);
  } catch (const SystemError& error) {
    LogLine(error.what());  // The map is saved all the same; it opens more slowly.
  }
}

bool IsMapFolder(const std::filesystem::path& folder) {
  return std::filesystem::is_regular_file(folder / kMapToml);
}

std::int64_t RunIdOfMap(const std::filesystem::path& folder) {
  return ParseMapToml(ReadMapToml(folder), folder).map.run_id;
}

VogMap ToVogMap(const StoredMap& stored) {
  VogMap map(stored.voxel_size_m, SensorModel(stored.sensor_model));
  for (const SubmapPtr& submap : stored.submaps) map.Place(submap, stored.X_WM.at(submap->id()));
  return map;
}

LoadedMap LoadMapFolder(const std::filesystem::path& folder, CompactUse use) {
  Content content = ReadContent(folder, use);
  const MapEntry& map = content.entries.map;
  LoadedMap loaded{
      .map = {map.voxel_size_m, map.sensor_model, map.run_id, map.complete, {}, {}, {}},
      .faults = {},
      .compact = content.compact,
      .octrees_read = content.octrees_read};
  if (map.end) loaded.map.end = EndOf(*map.end);
  if (map.put_in) loaded.map.put_in = PutInOf(*map.put_in);
  for (std::size_t i = 0; i < content.grids.size(); ++i) {
    const SubmapEntry& entry = content.entries.submaps[i];
    if (const auto* fault = std::get_if<std::string>(&content.grids[i])) {
      loaded.faults.push_back(*fault);
      continue;
    }
    loaded.map.X_WM.emplace(entry.id, ToPose(entry.X_WM));
    loaded.map.submaps.push_back(SubmapOf(entry, std::move(std::get<BrickGrid>(content.grids[i]))));
  }
  FileText graph = ReadChecked(folder, kGraph, map.graph_crc32,
                               "newer than map.toml or damaged; the poses of map.toml are used");
  if (!graph.fault.empty()) loaded.faults.push_back(graph.fault);
  loaded.map.graph_g2o = std::move(graph.bytes);
  return loaded;
}

void SaveMapFolder(const StoredMap& map, const std::filesystem::path& folder) {
  MapFolderWriter writer(folder);
  for (const SubmapPtr& submap : map.submaps)
    writer.AddSubmap(*submap, ToOctreeBytes(submap->grid));
  writer.Commit(map);
}

void PackMapFolder(const std::filesystem::path& folder) {
  const Content content = ReadContent(folder, CompactUse::kForbidden);
  std::vector<const BrickGrid*> grids;
  std::vector<std::uint64_t> octree_bytes;
  for (std::size_t i = 0; i < content.grids.size(); ++i) {
    if (const auto* fault = std::get_if<std::string>(&content.grids[i])) throw UsageError(*fault);
    grids.push_back(&std::get<BrickGrid>(content.grids[i]));
    const auto octree = StateOf(folder / OctreeNameOf(content.entries.submaps[i].id));
    octree_bytes.push_back(octree ? octree->size : 0);
  }
  WriteCompactFile(folder / kCompact, content.map_toml, content.entries, grids, octree_bytes);
}

}  // namespace vog
