// How far is it from a place to the structure? Casts rays all around through a saved map.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <numbers>

#include "lib/vogmap/map_folder.h"
#include "lib/vogmap/vog_map.h"

namespace {

constexpr double kRange_m = 10;
constexpr int kRays = 2000;

/// The i-th of kRays directions spread evenly over the sphere.
vog::Vec3 Direction(int i) {
  const double z = 1 - (2 * i + 1.0) / kRays;
  const double turn = i * std::numbers::pi * (3 - std::sqrt(5.0));
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: clearance MAP X Y Z\n");
    return 2;
  }
  try {
    const vog::LoadedMap loaded = vog::LoadMapFolder(argv[1]);
    const vog::VogMap map = vog::ToVogMap(loaded.map);
    const vog::Vec3 place_W(std::atof(argv[2]), std::atof(argv[3]), std::atof(argv[4]));
    double least_m = kRange_m;
    vog::Vec3 nearest = vog::Vec3::Zero();
    int hits = 0;
    for (int i = 0; i < kRays; ++i) {
      const auto hit = map.FirstHit(place_W, Direction(i), kRange_m);
      if (!hit) continue;
      ++hits;
      if (hit->entered_m >= least_m) continue;
      least_m = hit->entered_m;
      nearest = Direction(i);
    }
    std::printf("%zu submaps, %d of %d rays hit, nearest %.4f m towards %.17g %.17g %.17g\n",
                loaded.map.submaps.size(), hits, kRays, least_m, nearest.x(), nearest.y(),
                nearest.z());
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "clearance: %s\n", error.what());
    return 2;
  }
}
