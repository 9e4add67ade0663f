#include "lib/loopclosure/region.h"

#include "lib/geometry/odometry.h"

namespace vog {

SubmapRegion::SubmapRegion(const SubmapShape& alone)
    : members{{&alone}},
      cloud(std::shared_ptr<void>(), &alone.cloud),  // Not owned.
      content_drift(alone.content_drift) {}

SubmapRegion::SubmapRegion(std::vector<Member> joined, const SubmapShape& source, const Pose3& X_ik)
    : members(std::move(joined)), content_drift(Mat3::Zero()) {
  const Pose3 X_ki = X_ik.inverse();
  std::vector<Vec3> points_i;
  std::vector<LocalPlane> planes_i;
  for (const Member& member : members) {
    const RegistrationCloud& cloud_m = member.shape->cloud;
    const std::size_t before = points_i.size();
    for (std::size_t p = 0; p < cloud_m.size(); ++p) {
      const Vec3 p_i = member.X_im * cloud_m.points()[p];
      if (!source.HasNear(X_ki * p_i)) continue;
      points_i.push_back(p_i);
      planes_i.push_back(cloud_m.planes()[p]);
      planes_i.back().normal = member.X_im.linear() * planes_i.back().normal;
    }
    const Mat3 Ad_im = PlanarAdjointOf(member.X_im);
    content_drift += static_cast<double>(points_i.size() - before) *
                     (member.covariance + Ad_im * member.shape->content_drift * Ad_im.transpose());
  }
  if (!points_i.empty()) content_drift /= static_cast<double>(points_i.size());
  cloud = std::make_shared<RegistrationCloud>(std::move(points_i), std::move(planes_i));
}

}  // namespace vog
