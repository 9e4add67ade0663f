#include "tools/mission/hull_space.h"

#include <numbers>

namespace vog {

HullSpace::HullSpace(const TriangleMesh& scene_W, const Vec3& hull_size_m)
    : scene_(scene_W), clearance_(scene_W, hull_size_m) {}

bool HullSpace::Fits(const Vec3& p_W) const {
  // The box is square, so that a quarter turn repeats.
  constexpr int kHeadings = 4;
  if (scene_.Inside(p_W)) return false;
  for (int i = 0; i < kHeadings; ++i) {
    if (!clearance_.Collides(MakePose(p_W, {0, 0, i * std::numbers::pi / 2 / kHeadings})))
      return true;
  }
  return false;
}

}  // namespace vog
