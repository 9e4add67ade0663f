#include "lib/vogmap/map_folder.h"

#include <toml++/toml.h>

#include <array>
#include <cmath>
#include <optional>
#include <sstream>
#include <variant>

#include "lib/base/config.h"
#include "lib/base/errors.h"
#include "lib/base/files.h"
#include "lib/submap/octree_file.h"

namespace vog {
namespace {

constexpr int kFormat = 2;

std::string FileNameOf(SubmapId id) {
  std::array<char, 32> name;
  std::snprintf(name.data(), name.size(), "submaps/%06d.ot", id);
  return name.data();
}

// --- Writing ---

template <class Numbers>
std::string ToArray(const Numbers& numbers) {
  std::string text = "[";
  for (Eigen::Index i = 0; i < numbers.size(); ++i)
    text += (i > 0 ? ", " : "") + ToText(numbers.data()[i]) +
            (ToText(numbers.data()[i]).find_first_of(".en") == std::string::npos ? ".0" : "");
  return text + "]";
}

/// x, y, z, qx, qy, qz, qw.
std::string ToArray(const Pose3& X) {
  Eigen::Matrix<double, 7, 1> numbers;
  numbers << X.translation(), Eigen::Quaterniond(X.linear()).coeffs();
  return ToArray(numbers);
}

void WriteSubmap(const Submap& submap, const Pose3& X_WM, std::uint32_t checksum,
                 std::ostream& out) {
  const OdometrySample& odometry = submap.base.odometry;
  out << "\n[[submap]]\nid = " << submap.id() << "\nfile = \"" << FileNameOf(submap.id())
      << "\"\ncrc32 = \"" << ToHex(checksum) << "\"\nscans = " << submap.scans
      << "\nfirst_utime_us = " << ToUtime(submap.first_scan)
      << "\nlast_utime_us = " << ToUtime(submap.last_scan) << "\nX_WM = " << ToArray(X_WM)
      << "\norigin = " << odometry.origin << "\nsegment = " << odometry.segment
      << "\nX_OM = " << ToArray(odometry.X_OB)
      << "\ncovariance_OM = " << ToArray(odometry.covariance) << "\nX_ML = " << ToArray(submap.X_ML)
      << "\ndrift = " << ToArray(submap.drift) << "\nedge_X_PM = " << ToArray(submap.base.edge.X_PM)
      << "\nedge_covariance = " << ToArray(submap.base.edge.covariance) << "\n";
}

std::string ToMapToml(const StoredMap& map, const std::map<SubmapId, std::uint32_t>& checksums,
                      std::uint32_t graph_checksum) {
  const SensorModelOptions& model = map.sensor_model;
  std::ostringstream out;
  out << "# A VOG-map. Poses are x, y, z, qx, qy, qz, qw; covariances are symmetric.\nformat = "
      << kFormat << "\nrun_id = " << map.run_id
      << "\ncomplete = " << (map.complete ? "true" : "false")
      << "\nvoxel_size_m = " << ToText(map.voxel_size_m)
      << "\ngraph = \"graph.g2o\"\ngraph_crc32 = \"" << ToHex(graph_checksum)
      << "\"\n\n[sensor_model]\nhit_probability = " << ToText(model.hit_probability)
      << "\nmiss_probability = " << ToText(model.miss_probability)
      << "\nmin_probability = " << ToText(model.min_probability)
      << "\nmax_probability = " << ToText(model.max_probability)
      << "\noccupied_probability = " << ToText(model.occupied_probability) << "\n";
  for (const SubmapPtr& submap : map.submaps)
    WriteSubmap(*submap, map.X_WM.at(submap->id()), checksums.at(submap->id()), out);
  return std::move(out).str();
}

void CreateFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw SystemError(folder.string() + ": cannot create: " + error.message());
}

// --- Reading ---

/// Reads the entries of map.toml; a missing or odd one is the file's fault.
class TomlEntries {
 public:
  TomlEntries(const toml::table& table, std::string file) : table_(table), file_(std::move(file)) {}

  template <class T>
  T Get(const char* key) const {
    const auto value = table_[key].value<T>();
    if (!value) Fail(key);
    return *value;
  }

  double GetWithin(const char* key, Range range) const {
    const auto value = Get<double>(key);
    if (!(value >= range.lo && value <= range.hi)) Fail(key);
    return value;
  }

  SubmapId GetId() const {
    const auto id = Get<int>("id");
    if (id < 0) Fail("id");
    return id;
  }

  template <class Numbers>
  Numbers GetNumbers(const char* key) const {
    Numbers numbers;
    const toml::array* array = table_[key].as_array();
    if (array == nullptr || static_cast<Eigen::Index>(array->size()) != numbers.size()) Fail(key);
    for (Eigen::Index i = 0; i < numbers.size(); ++i) {
      const auto value = array->get(static_cast<std::size_t>(i))->value<double>();
      if (!value || !std::isfinite(*value)) Fail(key);
      numbers.data()[i] = *value;
    }
    return numbers;
  }

  Pose3 GetPose(const char* key) const {
    const auto numbers = GetNumbers<Eigen::Matrix<double, 7, 1>>(key);
    const Eigen::Quaterniond q(numbers[6], numbers[3], numbers[4], numbers[5]);
    if (!(std::abs(q.norm() - 1) < 1e-6)) Fail(key);
    return MakePose(numbers.head<3>(), q);
  }

 private:
  [[noreturn]] void Fail(const char* key) const {
    throw UsageError(file_ + ":" + std::to_string(table_.source().begin.line) + ": " + key +
                     " is missing or makes no sense; is it a map of this program?");
  }

  const toml::table& table_;
  std::string file_;
};

/// The submap of one entry, or why its file cannot be used.
std::variant<SubmapPtr, std::string> ReadSubmap(const TomlEntries& entry,
                                                const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / entry.Get<std::string>("file");
  std::string bytes;
  try {
    bytes = ReadFile(path);
  } catch (const SystemError& error) {
    return error.what();
  }
  if (ToHex(Crc32(bytes)) != entry.Get<std::string>("crc32"))
    return path.string() + ": the check sum does not match, the file is damaged";
  auto grid = FromOctreeBytes(bytes);
  if (const auto* fault = std::get_if<std::string>(&grid)) return path.string() + ": " + *fault;
  auto submap = std::make_shared<Submap>(
      Submap{.base = {},
             .first_scan = FromUtime(entry.Get<std::int64_t>("first_utime_us")),
             .last_scan = FromUtime(entry.Get<std::int64_t>("last_utime_us")),
             .scans = entry.Get<int>("scans"),
             .X_ML = entry.GetPose("X_ML"),
             .drift = entry.GetNumbers<Mat3>("drift"),
             .grid = std::move(std::get<BrickGrid>(grid))});
  submap->base.id = entry.GetId();
  submap->base.odometry.time = submap->first_scan;
  submap->base.odometry.origin = entry.Get<std::int64_t>("origin");
  submap->base.odometry.segment = entry.Get<std::int64_t>("segment");
  submap->base.odometry.X_OB = entry.GetPose("X_OM");
  submap->base.odometry.covariance = entry.GetNumbers<Mat3>("covariance_OM");
  submap->base.edge.X_PM = entry.GetPose("edge_X_PM");
  submap->base.edge.covariance = entry.GetNumbers<Mat6>("edge_covariance");
  return submap;
}

SensorModelOptions ReadSensorModel(const TomlEntries& entry) {
  constexpr Range kProbability = Between(0.001, 0.999);
  return {.hit_probability = entry.GetWithin("hit_probability", kProbability),
          .miss_probability = entry.GetWithin("miss_probability", kProbability),
          .min_probability = entry.GetWithin("min_probability", kProbability),
          .max_probability = entry.GetWithin("max_probability", kProbability),
          .occupied_probability = entry.GetWithin("occupied_probability", kProbability)};
}

void ReadSubmaps(const toml::table& table, const std::filesystem::path& folder,
                 const std::string& file, LoadedMap& loaded) {
  const toml::array* entries = table["submap"].as_array();
  if (entries == nullptr) return;
  for (const toml::node& node : *entries) {
    if (!node.is_table()) throw UsageError(file + ": [[submap]] must be a table");
    const TomlEntries entry(*node.as_table(), file);
    auto submap = ReadSubmap(entry, folder);
    if (const auto* fault = std::get_if<std::string>(&submap)) {
      loaded.faults.push_back(*fault);
      continue;
    }
    const SubmapPtr& read = std::get<SubmapPtr>(submap);
    if (!loaded.map.X_WM.emplace(read->id(), entry.GetPose("X_WM")).second)
      throw UsageError(file + ": submap " + std::to_string(read->id()) + " is there twice");
    loaded.map.submaps.push_back(read);
  }
}

}  // namespace

MapFolderWriter::MapFolderWriter(std::filesystem::path folder) : folder_(std::move(folder)) {
  CreateFolder(folder_ / "submaps");
}

void MapFolderWriter::AddSubmap(const Submap& submap, const std::string& octree_bytes) {
  const std::uint32_t checksum = Crc32(octree_bytes);
  WriteFileAtomically(folder_ / FileNameOf(submap.id()), octree_bytes);
  checksums_[submap.id()] = checksum;
}

void MapFolderWriter::Commit(const StoredMap& map) {
  WriteFileAtomically(folder_ / "graph.g2o", map.graph_g2o);
  WriteFileAtomically(folder_ / "map.toml", ToMapToml(map, checksums_, Crc32(map.graph_g2o)));
}

bool IsMapFolder(const std::filesystem::path& folder) {
  return std::filesystem::is_regular_file(folder / "map.toml");
}

VogMap ToVogMap(const StoredMap& stored) {
  VogMap map(stored.voxel_size_m, SensorModel(stored.sensor_model));
  for (const SubmapPtr& submap : stored.submaps) map.Place(submap, stored.X_WM.at(submap->id()));
  return map;
}

LoadedMap LoadMapFolder(const std::filesystem::path& folder) {
  if (!IsMapFolder(folder))
    throw UsageError(folder.string() + ": no map here: a map is a folder with a map.toml");
  const std::string file = (folder / "map.toml").string();
  toml::table table;
  try {
    table = toml::parse_file(file);
  } catch (const toml::parse_error& error) {
    throw UsageError(file + ":" + std::to_string(error.source().begin.line) + ": " +
                     std::string(error.description()));
  }
  const TomlEntries entries(table, file);
  if (entries.Get<int>("format") != kFormat)
    throw UsageError(file + ": format " + std::to_string(entries.Get<int>("format")) +
                     " is not one that this version reads");
  const toml::table* model = table["sensor_model"].as_table();
  if (model == nullptr) throw UsageError(file + ": [sensor_model] is missing");
  LoadedMap loaded;
  loaded.map.voxel_size_m = entries.GetWithin("voxel_size_m", Between(1e-4, 1e4));
  loaded.map.run_id = entries.Get<std::int64_t>("run_id");
  loaded.map.complete = entries.Get<bool>("complete");
  loaded.map.sensor_model = ReadSensorModel(TomlEntries(*model, file));
  ReadSubmaps(table, folder, file, loaded);
  try {
    loaded.map.graph_g2o = ReadFile(folder / "graph.g2o");
    if (ToHex(Crc32(loaded.map.graph_g2o)) != entries.Get<std::string>("graph_crc32"))
      loaded.faults.push_back((folder / "graph.g2o").string() +
                              ": newer than map.toml or damaged; the poses of map.toml are used");
  } catch (const SystemError& error) {
    loaded.faults.push_back(error.what());
  }
  return loaded;
}

void SaveMapFolder(const StoredMap& map, const std::filesystem::path& folder) {
  MapFolderWriter writer(folder);
  for (const SubmapPtr& submap : map.submaps)
    writer.AddSubmap(*submap, ToOctreeBytes(submap->grid));
  writer.Commit(map);
}

}  // namespace vog
