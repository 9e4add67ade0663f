#include "lib/geometry/trajectory.h"

#include <array>
#include <cmath>
#include <sstream>

#include "lib/base/errors.h"
#include "lib/base/files.h"

namespace vog {
namespace {

/// Seconds with all six digits of a microsecond.
std::string ToSecondsText(Time time) {
  const std::int64_t utime_us = ToUtime(time);
  std::array<char, 40> text;
  std::snprintf(text.data(), text.size(), "%s%lld.%06lld", utime_us < 0 ? "-" : "",
                static_cast<long long>(std::abs(utime_us) / 1'000'000),
                static_cast<long long>(std::abs(utime_us) % 1'000'000));
  return text.data();
}

}  // namespace

void WriteTum(const std::filesystem::path& path, const Trajectory& trajectory) {
  std::string text;
  for (const auto& [time, X_WB] : trajectory) {
    text += ToSecondsText(time);
    for (const double number : X_WB.translation()) text += " " + ToText(number);
    const Eigen::Vector4d q = Eigen::Quaterniond(X_WB.linear()).coeffs();
    for (const double number : q) text += " " + ToText(number);
    text += "\n";
  }
  WriteFileAtomically(path, text);
}

Trajectory ReadTum(const std::filesystem::path& path) {
  std::istringstream lines(ReadFile(path));
  Trajectory trajectory;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.empty() || line[0] == '#') continue;
    std::istringstream values(line);
    double time_s;
    Vec3 p;
    Eigen::Quaterniond q;
    values >> time_s >> p.x() >> p.y() >> p.z() >> q.x() >> q.y() >> q.z() >> q.w();
    constexpr double kMaxTime_s = 9e12;  // What 64 bits of microseconds hold.
    if (!values || !(std::abs(q.norm() - 1) < 1e-3) || std::abs(time_s) > kMaxTime_s)
      throw UsageError(path.string() + ":" + std::to_string(number) +
                       ": not a line `t x y z qx qy qz qw`");
    trajectory.push_back({Time(FromSeconds(time_s)), MakePose(p, q)});
  }
  return trajectory;
}

double PathLength(const Trajectory& trajectory) {
  double length_m = 0;
  for (std::size_t i = 1; i < trajectory.size(); ++i)
    length_m += (trajectory[i].X_WB.translation() - trajectory[i - 1].X_WB.translation()).norm();
  return length_m;
}

}  // namespace vog
