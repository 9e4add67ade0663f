#pragma once

#include <array>
#include <string_view>

namespace vog {

/// The tables of a mission file. A process reads those that concern it; none may be misspelt.
inline constexpr std::array<std::string_view, 43> kConfigTables = {
    "mission",
    "bus",
    "simulation",
    "scene",
    "scene.propeller",
    "scene.tank",
    "scene.pier",
    "scene.wreck",
    "scene.seafloor",
    "scene.mine",
    "vehicle",
    "current",
    "sonar",
    "sonar_model",
    "drift",
    "navigation",
    "dead_reckoning",
    "navigation_sensors",
    "navigation_faults",
    "range_detector",
    "submap",
    "sensor_model",
    "map",
    "put_in",
    "fuse",
    "registration",
    "loop_closure",
    "pose_graph",
    "slam",
    "exploration",
    "keep_out",
    "planner",
    "controller",
    "evaluation",
    "latency",
    "live",
    "vehicle_link",
    "sonar_link",
    "pressure",
    "doppler",
    "sim_vehicle_link",
    "sim_sonar_link",
    "viewer",
};

}  // namespace vog
