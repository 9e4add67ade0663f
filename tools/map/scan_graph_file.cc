#include "tools/map/scan_graph_file.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "lib/base/errors.h"
#include "lib/base/files.h"

namespace vog {
namespace {

static_assert(std::endian::native == std::endian::little, "OctoMap writes the machine's own bytes");

/// Takes numbers from the front of bytes.
class Reader {
 public:
  Reader(std::string bytes, std::string name) : bytes_(std::move(bytes)), name_(std::move(name)) {}

  std::uint32_t Count() { return Take<std::uint32_t>(); }

  /// A vector as octomath writes it: its length, then doubles.
  template <std::size_t kSize>
  std::array<double, kSize> Vector() {
    if (Take<std::uint32_t>() != kSize) Reject();
    std::array<double, kSize> values;
    for (double& value : values) {
      value = Take<double>();
      if (!std::isfinite(value)) Reject();
    }
    return values;
  }

  [[noreturn]] void Reject() const {
    throw UsageError(name_ + ": not an OctoMap scan log (.graph), or damaged");
  }

  std::size_t bytes_left() const { return bytes_.size() - at_; }

 private:
  template <class Number>
  Number Take() {
    if (bytes_left() < sizeof(Number)) Reject();
    Number number;
    std::memcpy(&number, bytes_.data() + at_, sizeof(Number));
    at_ += sizeof(Number);
    return number;
  }

  std::string bytes_, name_;
  std::size_t at_ = 0;
};

Vec3 TakePoint(Reader& reader) {
  const auto [x, y, z] = reader.Vector<3>();
  return {x, y, z};
}

Pose3 TakePose(Reader& reader) {
  const Vec3 position = TakePoint(reader);
  const auto [w, x, y, z] = reader.Vector<4>();
  const Eigen::Quaterniond rotation(w, x, y, z);
  if (!(rotation.norm() > 0.5)) reader.Reject();
  return MakePose(position, rotation.normalized());
}

GraphScan TakeScan(Reader& reader) {
  constexpr std::size_t kPointBytes = 28;
  GraphScan scan;
  const std::uint32_t points = reader.Count();
  if (points > reader.bytes_left() / kPointBytes) reader.Reject();
  scan.points_S.reserve(points);
  for (std::uint32_t i = 0; i < points; ++i) scan.points_S.push_back(TakePoint(reader));
  scan.X_WS = TakePose(reader);
  reader.Count();  // The scan's number.
  return scan;
}

}  // namespace

std::vector<GraphScan> ReadScanGraph(const std::filesystem::path& file) {
  Reader reader(ReadFile(file), file.string());
  std::vector<GraphScan> scans;
  for (std::uint32_t left = reader.Count(); left > 0; --left) scans.push_back(TakeScan(reader));
  if (scans.empty()) throw UsageError(file.string() + ": a scan log without scans");
  return scans;
}

}  // namespace vog
