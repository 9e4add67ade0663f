#pragma once

#include <functional>

#include "hardware/nav_payload/bluefin_sentences.h"
#include "hauv/bs_cnv_t.hpp"
#include "hauv/bs_dvl_2_t.hpp"
#include "hauv/bs_imu_t.hpp"
#include "hauv/bs_rdp_t.hpp"
#include "hauv/bs_rnv_2_t.hpp"
#include "lib/messages/endpoint.h"

namespace vog {

/// The messages in which HAUVs log what their front seat says (package hauv of perls): the
/// sentences' fields, angles in radians, times in microseconds. NaN in DVL_2 is no lock.
Sentence FromMessage(const hauv::bs_rnv_2_t& message);
Sentence FromMessage(const hauv::bs_cnv_t& message);
Sentence FromMessage(const hauv::bs_dvl_2_t& message);
Sentence FromMessage(const hauv::bs_imu_t& message);
Sentence FromMessage(const hauv::bs_rdp_t& message);

/// Calls `handle(sentence, time)` with each of them on a bus, `time` when the vehicle said it, and
/// `refuse()` for each that cannot be decoded or is not finite.
void SubscribeToHauv(Bus& bus, std::function<void(const Sentence&, Time)> handle,
                     std::function<void()> refuse);

}  // namespace vog
