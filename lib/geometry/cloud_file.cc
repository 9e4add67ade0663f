#include "lib/geometry/cloud_file.h"

#include <cmath>
#include <cstring>
#include <map>
#include <sstream>
#include <string>

#include "lib/base/errors.h"
#include "lib/base/files.h"

// Debian's readers of these formats come with PCL (400 packages) or Open3D; points alone need
// little.

namespace vog {
namespace {

/// One value of a record: where it lies and how it is written.
struct Field {
  std::string name;
  char kind = 'F';  // F float, I signed, U unsigned.
  int bytes = 4;
  int count = 1;
};

struct Layout {
  std::vector<Field> fields;
  std::size_t records = 0;
  bool is_ascii = true;

  std::size_t RecordBytes() const {
    std::size_t bytes = 0;
    for (const Field& field : fields) bytes += std::size_t(field.bytes) * field.count;
    return bytes;
  }
};

[[noreturn]] void Fail(const std::filesystem::path& path, const std::string& fault) {
  throw UsageError(path.string() + ": " + fault);
}

template <class T>
double Load(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return static_cast<double>(value);
}

/// @pre IsPossible(field).
double LoadField(const Field& field, const char* at) {
  if (field.kind == 'F') return field.bytes == 8 ? Load<double>(at) : Load<float>(at);
  const bool is_signed = field.kind == 'I';
  switch (field.bytes) {
    case 1:
      return is_signed ? Load<std::int8_t>(at) : Load<std::uint8_t>(at);
    case 2:
      return is_signed ? Load<std::int16_t>(at) : Load<std::uint16_t>(at);
    case 4:
      return is_signed ? Load<std::int32_t>(at) : Load<std::uint32_t>(at);
    default:
      return is_signed ? Load<std::int64_t>(at) : Load<std::uint64_t>(at);
  }
}

bool IsPossible(const Field& field) {
  const bool is_large = field.bytes == 4 || field.bytes == 8;
  const bool is_small = field.bytes == 1 || field.bytes == 2;
  const bool is_integer = field.kind == 'I' || field.kind == 'U';
  return ((is_integer && (is_large || is_small)) || (field.kind == 'F' && is_large)) &&
         field.count >= 1 && field.count <= 1'000'000;
}

/// Takes x, y, z out of records, whatever else they hold.
class PointCollector {
 public:
  PointCollector(const Layout& layout, const std::filesystem::path& path)
      : layout_(layout), path_(path) {
    for (const char* name : {"x", "y", "z"}) {
      bool found = false;
      for (const Field& field : layout.fields) found |= field.name == name;
      if (!found) Fail(path, std::string("has no field ") + name);
    }
  }

  /// Adds nothing where `values` end before the record does.
  void AddText(std::istream& values) {
    for (const Field& field : layout_.fields)
      for (int i = 0; i < field.count; ++i) {
        std::string text;
        if (!(values >> text)) return;
        char* end = nullptr;
        Set(field, std::strtod(text.c_str(), &end));
        if (*end != '\0') Fail(path_, "\"" + text + "\" is not a number");
      }
    Commit();
  }
  void AddBytes(const char* at) {
    for (const Field& field : layout_.fields) {
      Set(field, LoadField(field, at));
      at += field.bytes * field.count;
    }
    Commit();
  }

  std::vector<Vec3> points;

 private:
  void Set(const Field& field, double value) {
    if (field.name == "x") point_.x() = value;
    if (field.name == "y") point_.y() = value;
    if (field.name == "z") point_.z() = value;
  }
  void Commit() {
    if (point_.allFinite()) points.push_back(point_);
  }

  const Layout& layout_;
  const std::filesystem::path& path_;
  Vec3 point_ = Vec3::Zero();
};

std::vector<Vec3> ReadRecords(const Layout& layout, std::string_view body,
                              const std::filesystem::path& path) {
  PointCollector collector(layout, path);
  if (layout.is_ascii) {
    std::istringstream values{std::string(body)};
    for (std::size_t i = 0; i < layout.records; ++i) {
      collector.AddText(values);
      if (!values)
        Fail(path, "is cut short: " + std::to_string(layout.records) + " points promised");
    }
  } else {
    const std::size_t record_bytes = layout.RecordBytes();
    if (record_bytes == 0 || body.size() / record_bytes < layout.records)
      Fail(path, "is cut short: " + std::to_string(layout.records) + " points promised");
    for (std::size_t i = 0; i < layout.records; ++i)
      collector.AddBytes(body.data() + i * record_bytes);
  }
  return std::move(collector.points);
}

/// The next line of `text` from `at` on, without its end.
std::string_view NextLine(std::string_view text, std::size_t& at) {
  const std::size_t end = std::min(text.find('\n', at), text.size());
  std::string_view line = text.substr(at, end - at);
  at = std::min(end + 1, text.size());
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

CloudFile ReadPcd(const std::filesystem::path& path, const std::string& bytes) {
  CloudFile cloud;
  Layout layout;
  std::size_t at = 0;
  std::string data;
  while (data.empty() && at < bytes.size()) {
    std::istringstream line{std::string(NextLine(bytes, at))};
    std::string key;
    line >> key;
    if (key == "FIELDS") {
      for (std::string name; line >> name;) layout.fields.push_back({.name = name});
    } else if (key == "SIZE") {
      for (Field& field : layout.fields) line >> field.bytes;
    } else if (key == "TYPE") {
      for (Field& field : layout.fields) line >> field.kind;
    } else if (key == "COUNT") {
      for (Field& field : layout.fields) line >> field.count;
    } else if (key == "POINTS") {
      line >> layout.records;
    } else if (key == "VIEWPOINT") {
      Vec3 p;
      Eigen::Quaterniond q;
      line >> p.x() >> p.y() >> p.z() >> q.w() >> q.x() >> q.y() >> q.z();
      if (!line || !(std::abs(q.norm() - 1) < 1e-3)) Fail(path, "VIEWPOINT is not a pose");
      cloud.X_WV = MakePose(p, q);
    } else if (key == "DATA") {
      line >> data;
    }
  }
  if (data != "ascii" && data != "binary")
    Fail(path, data.empty() ? "is not a .pcd file"
                            : "DATA " + data +
                                  " is not read; use ascii or "
                                  "binary");
  for (const Field& field : layout.fields) {
    if (!IsPossible(field))
      Fail(path, "field " + field.name + " has an impossible TYPE, SIZE or COUNT");
  }
  layout.is_ascii = data == "ascii";
  cloud.points_V = ReadRecords(layout, std::string_view(bytes).substr(at), path);
  return cloud;
}

Field PlyField(const std::string& type, const std::string& name) {
  static const std::map<std::string, Field> kTypes = {
      {"char", {"", 'I', 1, 1}},   {"int8", {"", 'I', 1, 1}},    {"uchar", {"", 'U', 1, 1}},
      {"uint8", {"", 'U', 1, 1}},  {"short", {"", 'I', 2, 1}},   {"int16", {"", 'I', 2, 1}},
      {"ushort", {"", 'U', 2, 1}}, {"uint16", {"", 'U', 2, 1}},  {"int", {"", 'I', 4, 1}},
      {"int32", {"", 'I', 4, 1}},  {"uint", {"", 'U', 4, 1}},    {"uint32", {"", 'U', 4, 1}},
      {"float", {"", 'F', 4, 1}},  {"float32", {"", 'F', 4, 1}}, {"double", {"", 'F', 8, 1}},
      {"float64", {"", 'F', 8, 1}}};
  const auto found = kTypes.find(type);
  if (found == kTypes.end()) return {};
  Field field = found->second;
  field.name = name;
  return field;
}

CloudFile ReadPly(const std::filesystem::path& path, const std::string& bytes) {
  Layout layout;
  std::size_t at = 0;
  std::string format, element;
  if (NextLine(bytes, at) != "ply") Fail(path, "is not a .ply file");
  for (std::string key; key != "end_header";) {
    if (at >= bytes.size()) Fail(path, "has no end_header");
    std::istringstream line{std::string(NextLine(bytes, at))};
    line >> key;
    if (key == "format") line >> format;
    if (key == "element") {
      line >> element;
      if (element == "vertex") line >> layout.records;
    } else if (key == "property" && element == "vertex") {
      std::string type, name;
      line >> type >> name;
      layout.fields.push_back(PlyField(type, name));
      if (layout.fields.back().name.empty()) Fail(path, "has vertices with a " + type);
    } else if (key == "property" && layout.fields.empty()) {
      Fail(path, "its first element must be vertex");
    }
  }
  if (format != "ascii" && format != "binary_little_endian")
    Fail(path, "format " + format + " is not read; use ascii or binary_little_endian");
  layout.is_ascii = format == "ascii";
  return {ReadRecords(layout, std::string_view(bytes).substr(at), path), Pose3::Identity()};
}

std::string PlyHeader(std::size_t points) {
  return "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(points) +
         "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
}

std::string PcdHeader(std::size_t points) {
  const std::string count = std::to_string(points);
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\n"
         "TYPE F F F\nCOUNT 1 1 1\nWIDTH " +
         count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA binary\n";
}

}  // namespace

CloudFile ReadCloud(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) Fail(path, "no such file");
  const std::string bytes = ReadFile(path);
  if (path.extension() == ".pcd") return ReadPcd(path, bytes);
  if (path.extension() == ".ply") return ReadPly(path, bytes);
  Fail(path, "a cloud is a .pcd or a .ply file");
}

void WriteCloud(const std::filesystem::path& path, const std::vector<Vec3>& points) {
  const bool is_ply = path.extension() == ".ply";
  if (!is_ply && path.extension() != ".pcd") Fail(path, "a cloud is a .pcd or a .ply file");
  std::string bytes = is_ply ? PlyHeader(points.size()) : PcdHeader(points.size());
  for (const Vec3& point : points) {
    const Eigen::Vector3f p = point.cast<float>();
    bytes.append(reinterpret_cast<const char*>(p.data()), 3 * sizeof(float));
  }
  WriteFileAtomically(path, bytes);
}

}  // namespace vog
