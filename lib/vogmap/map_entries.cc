#include "lib/vogmap/map_entries.h"

#include <toml++/toml.h>

#include <charconv>
#include <cmath>
#include <set>
#include <sstream>

#include "lib/base/config.h"
#include "lib/base/errors.h"
#include "lib/base/files.h"

namespace vog {
namespace {

constexpr int kFormat = 2;

StoredPose ToStored(const Pose3& X) {
  const Eigen::Quaterniond q(X.linear());
  const Vec3 p = X.translation();
  return {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()};
}

template <class Matrix>
auto ToStored(const Eigen::MatrixBase<Matrix>& matrix) {
  std::array<double, Matrix::SizeAtCompileTime> numbers;
  Eigen::Map<typename Matrix::PlainObject>(numbers.data()) = matrix;
  return numbers;
}

/// The base that an entry of a submap, or of a flight's beginning, tells of.
template <class Entry>
SubmapBase BaseOf(const Entry& entry, std::int64_t utime_us) {
  SubmapBase base;
  base.id = static_cast<SubmapId>(entry.id);
  base.odometry.time = FromUtime(utime_us);
  base.odometry.origin = entry.origin;
  base.odometry.segment = entry.segment;
  base.odometry.X_OB = ToPose(entry.X_OM);
  base.odometry.covariance = Mat3(entry.covariance_OM.data());
  base.edge = {ToPose(entry.edge_X_PM), Mat6(entry.edge_covariance.data())};
  return base;
}

// --- Writing ---

template <class Numbers>
std::string ToArray(const Numbers& numbers) {
  std::string text = "[";
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::string number = ToText(numbers[i]);
    text += (i > 0 ? ", " : "") + number +
            (number.find_first_of(".en") == std::string::npos ? ".0" : "");
  }
  return text + "]";
}

void WriteSubmap(const SubmapEntry& entry, std::ostream& out) {
  out << "\n[[submap]]\nid = " << entry.id << "\nfile = \"" << OctreeNameOf(entry.id)
      << "\"\ncrc32 = \"" << ToHex(static_cast<std::uint32_t>(entry.octree_crc32))
      << "\"\nscans = " << entry.scans << "\nfirst_utime_us = " << entry.first_utime_us
      << "\nlast_utime_us = " << entry.last_utime_us << "\nX_WM = " << ToArray(entry.X_WM)
      << "\norigin = " << entry.origin << "\nsegment = " << entry.segment
      << "\nX_OM = " << ToArray(entry.X_OM) << "\ncovariance_OM = " << ToArray(entry.covariance_OM)
      << "\nX_ML = " << ToArray(entry.X_ML) << "\ndrift = " << ToArray(entry.drift)
      << "\nedge_X_PM = " << ToArray(entry.edge_X_PM)
      << "\nedge_covariance = " << ToArray(entry.edge_covariance) << "\n";
}

void WriteEnd(const EndEntry& entry, std::ostream& out) {
  out << "\n[end]\nutime_us = " << entry.utime_us << "\nX_ME = " << ToArray(entry.X_ME)
      << "\ncovariance = " << ToArray(entry.covariance) << "\n";
}

void WritePutIn(const PutInEntry& entry, std::ostream& out) {
  out << "\n[put_in]\nid = " << entry.id << "\nutime_us = " << entry.utime_us
      << "\norigin = " << entry.origin << "\nsegment = " << entry.segment
      << "\nX_OM = " << ToArray(entry.X_OM) << "\ncovariance_OM = " << ToArray(entry.covariance_OM)
      << "\nedge_X_PM = " << ToArray(entry.edge_X_PM)
      << "\nedge_covariance = " << ToArray(entry.edge_covariance) << "\n";
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

  /// A damaged one is a sum that no file has: it costs one file, not the map.
  std::uint64_t GetChecksum(const char* key) const {
    const auto text = Get<std::string>(key);
    std::uint32_t value = 0;
    const auto error =
        std::from_chars(text.data(), text.data() + text.size(), value, /*base=*/16).ec;
    return error == std::errc() && ToHex(value) == text ? value : kNoChecksum;
  }

  template <class Numbers>
  Numbers GetNumbers(const char* key) const {
    Numbers numbers;
    const toml::array* array = table_[key].as_array();
    if (array == nullptr || array->size() != numbers.size()) Fail(key);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const auto value = array->get(i)->value<double>();
      if (!value || !std::isfinite(*value)) Fail(key);
      numbers[i] = *value;
    }
    return numbers;
  }

  StoredPose GetPose(const char* key) const {
    const auto numbers = GetNumbers<StoredPose>(key);
    const Eigen::Map<const Eigen::Vector4d> q(numbers.data() + 3);
    if (!(std::abs(q.norm() - 1) < 1e-6)) Fail(key);
    return numbers;
  }

  SensorModelOptions GetSensorModel() const {
    constexpr Range kProbability = Between(0.001, 0.999);
    return {.hit_probability = GetWithin("hit_probability", kProbability),
            .miss_probability = GetWithin("miss_probability", kProbability),
            .min_probability = GetWithin("min_probability", kProbability),
            .max_probability = GetWithin("max_probability", kProbability),
            .occupied_probability = GetWithin("occupied_probability", kProbability)};
  }

  EndEntry GetEnd() const {
    return {.utime_us = Get<std::int64_t>("utime_us"),
            .X_ME = GetPose("X_ME"),
            .covariance = GetNumbers<std::array<double, 9>>("covariance")};
  }

  PutInEntry GetPutIn() const {
    return {.id = GetId(),
            .utime_us = Get<std::int64_t>("utime_us"),
            .origin = Get<std::int64_t>("origin"),
            .segment = Get<std::int64_t>("segment"),
            .X_OM = GetPose("X_OM"),
            .edge_X_PM = GetPose("edge_X_PM"),
            .covariance_OM = GetNumbers<std::array<double, 9>>("covariance_OM"),
            .edge_covariance = GetNumbers<std::array<double, 36>>("edge_covariance")};
  }

  SubmapEntry GetSubmap() const {
    return {.id = GetId(),
            .scans = Get<int>("scans"),
            .first_utime_us = Get<std::int64_t>("first_utime_us"),
            .last_utime_us = Get<std::int64_t>("last_utime_us"),
            .origin = Get<std::int64_t>("origin"),
            .segment = Get<std::int64_t>("segment"),
            .octree_crc32 = GetChecksum("crc32"),
            .X_WM = GetPose("X_WM"),
            .X_OM = GetPose("X_OM"),
            .X_ML = GetPose("X_ML"),
            .edge_X_PM = GetPose("edge_X_PM"),
            .covariance_OM = GetNumbers<std::array<double, 9>>("covariance_OM"),
            .drift = GetNumbers<std::array<double, 9>>("drift"),
            .edge_covariance = GetNumbers<std::array<double, 36>>("edge_covariance")};
  }

 private:
  [[noreturn]] void Fail(const char* key) const {
    throw UsageError(file_ + ":" + std::to_string(table_.source().begin.line) + ": " + key +
                     " is missing or makes no sense; is it a map of this program?");
  }

  const toml::table& table_;
  std::string file_;
};

std::vector<SubmapEntry> ReadSubmaps(const toml::table& table, const std::string& file) {
  std::vector<SubmapEntry> submaps;
  const toml::array* entries = table["submap"].as_array();
  if (entries == nullptr) return submaps;
  std::set<SubmapId> ids;
  for (const toml::node& node : *entries) {
    if (!node.is_table()) throw UsageError(file + ": [[submap]] must be a table");
    submaps.push_back(TomlEntries(*node.as_table(), file).GetSubmap());
    const SubmapId id = submaps.back().id;
    if (!ids.insert(id).second)
      throw UsageError(file + ": submap " + std::to_string(id) + " is there twice");
  }
  return submaps;
}

}  // namespace

SubmapEntry EntryOf(const Submap& submap, const Pose3& X_WM, std::uint32_t octree_crc32) {
  const OdometrySample& odometry = submap.base.odometry;
  return {.id = submap.id(),
          .scans = submap.scans,
          .first_utime_us = ToUtime(submap.first_scan),
          .last_utime_us = ToUtime(submap.last_scan),
          .origin = odometry.origin,
          .segment = odometry.segment,
          .octree_crc32 = octree_crc32,
          .X_WM = ToStored(X_WM),
          .X_OM = ToStored(odometry.X_OB),
          .X_ML = ToStored(submap.X_ML),
          .edge_X_PM = ToStored(submap.base.edge.X_PM),
          .covariance_OM = ToStored(odometry.covariance),
          .drift = ToStored(submap.drift),
          .edge_covariance = ToStored(submap.base.edge.covariance)};
}

SubmapPtr SubmapOf(const SubmapEntry& entry, BrickGrid grid) {
  return std::make_shared<Submap>(Submap{.base = BaseOf(entry, entry.first_utime_us),
                                         .first_scan = FromUtime(entry.first_utime_us),
                                         .last_scan = FromUtime(entry.last_utime_us),
                                         .scans = entry.scans,
                                         .X_ML = ToPose(entry.X_ML),
                                         .drift = Mat3(entry.drift.data()),
                                         .grid = std::move(grid)});
}

EndEntry EntryOf(const PlaceInMap& end) {
  return {.utime_us = ToUtime(end.time),
          .X_ME = ToStored(end.X_ME),
          .covariance = ToStored(end.covariance)};
}

PlaceInMap EndOf(const EndEntry& entry) {
  return {FromUtime(entry.utime_us), ToPose(entry.X_ME), Mat3(entry.covariance.data())};
}

PutInEntry EntryOf(const SubmapBase& put_in) {
  const OdometrySample& odometry = put_in.odometry;
  return {.id = put_in.id,
          .utime_us = ToUtime(odometry.time),
          .origin = odometry.origin,
          .segment = odometry.segment,
          .X_OM = ToStored(odometry.X_OB),
          .edge_X_PM = ToStored(put_in.edge.X_PM),
          .covariance_OM = ToStored(odometry.covariance),
          .edge_covariance = ToStored(put_in.edge.covariance)};
}

SubmapBase PutInOf(const PutInEntry& entry) { return BaseOf(entry, entry.utime_us); }

Pose3 ToPose(const StoredPose& stored) {
  const auto& [x, y, z, qx, qy, qz, qw] = stored;
  return MakePose(Vec3(x, y, z), Eigen::Quaterniond(qw, qx, qy, qz));
}

std::string OctreeNameOf(SubmapId id) {
  std::array<char, 32> name;
  std::snprintf(name.data(), name.size(), "submaps/%06d.ot", id);
  return name.data();
}

std::string ToMapToml(const MapEntries& entries) {
  const MapEntry& map = entries.map;
  const SensorModelOptions& model = map.sensor_model;
  std::ostringstream out;
  out << "# A VOG-map. Poses are x, y, z, qx, qy, qz, qw; covariances are symmetric.\nformat = "
      << kFormat << "\nrun_id = " << map.run_id
      << "\ncomplete = " << (map.complete ? "true" : "false")
      << "\nvoxel_size_m = " << ToText(map.voxel_size_m)
      << "\ngraph = \"graph.g2o\"\ngraph_crc32 = \""
      << ToHex(static_cast<std::uint32_t>(map.graph_crc32))
      << "\"\n\n[sensor_model]\nhit_probability = " << ToText(model.hit_probability)
      << "\nmiss_probability = " << ToText(model.miss_probability)
      << "\nmin_probability = " << ToText(model.min_probability)
      << "\nmax_probability = " << ToText(model.max_probability)
      << "\noccupied_probability = " << ToText(model.occupied_probability) << "\n";
  if (map.end) WriteEnd(*map.end, out);
  if (map.put_in) WritePutIn(*map.put_in, out);
  for (const SubmapEntry& entry : entries.submaps) WriteSubmap(entry, out);
  return std::move(out).str();
}

MapEntries FromMapToml(const std::string& text, const std::string& file) {
  toml::table table;
  try {
    table = toml::parse(text, file);
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
  MapEntries read;
  read.map = {.voxel_size_m = entries.GetWithin("voxel_size_m", Between(1e-4, 1e4)),
              .sensor_model = TomlEntries(*model, file).GetSensorModel(),
              .run_id = entries.Get<std::int64_t>("run_id"),
              .complete = entries.Get<bool>("complete"),
              .graph_crc32 = entries.GetChecksum("graph_crc32")};
  if (const toml::table* end = table["end"].as_table())
    read.map.end = TomlEntries(*end, file).GetEnd();
  if (const toml::table* put_in = table["put_in"].as_table())
    read.map.put_in = TomlEntries(*put_in, file).GetPutIn();
  read.submaps = ReadSubmaps(table, file);
  return read;
}

}  // namespace vog
