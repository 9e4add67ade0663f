#include "lib/submap/open_submap.h"

namespace vog {
namespace {

// More scans than any submap should have: without a map service that closes submaps, the oldest go.
constexpr std::size_t kMaxScans = 2000;

}  // namespace

OpenSubmap::OpenSubmap(double voxel_size_m, const SensorModelOptions& model)
    : voxel_size_m_(voxel_size_m), model_(model) {}

void OpenSubmap::Add(const RegisteredScan& registered) {
  if (!scans_.empty() && registered.odometry.segment != base().segment)
    ForgetUpTo(scans_.back().scan.time);
  if (scans_.size() >= kMaxScans) ForgetUpTo(scans_[kMaxScans / 2].scan.time);
  scans_.push_back(registered);
  Insert(registered);
}

void OpenSubmap::ForgetUpTo(Time time) {
  if (scans_.empty() || scans_.front().scan.time > time) return;
  while (!scans_.empty() && scans_.front().scan.time <= time) scans_.pop_front();
  grid_.reset();
  ++revision_;
  for (const RegisteredScan& registered : scans_) Insert(registered);
}

void OpenSubmap::Insert(const RegisteredScan& registered) {
  ++revision_;
  if (!grid_) {
    grid_.emplace(voxel_size_m_);
    inserter_.emplace(model_, voxel_size_m_);
  }
  inserter_->Insert(registered.scan, Ominus(base().X_OB, registered.odometry.X_OB), *grid_);
}

}  // namespace vog
