#include "procs/sonar_reader/hauv_messages.h"

#include <cmath>

#include "hardware/sonar/didson_header.h"

namespace vog {

std::optional<SonarFrame> FromMessage(const hauv::didson_t& message) {
  DidsonFrame frame;
  frame.header.window_start = static_cast<std::uint32_t>(message.m_nWindowStart);
  frame.header.window_length = static_cast<std::uint32_t>(message.m_nWindowLength);
  frame.header.transmit_mode = static_cast<std::uint32_t>(message.m_nTransmitMode);
  frame.header.config_flags = static_cast<std::uint32_t>(message.m_nConfigFlags);
  frame.header.sonar_tilt_deg = message.m_fSonarTilt;
  frame.header.tilt_offset_deg = message.m_fSonarTiltOffset;
  frame.header.vehicle_time_s = message.m_dVehicleTime;
  if (!std::isfinite(message.m_fSonarTilt) || !std::isfinite(message.m_dVehicleTime))
    return std::nullopt;
  const std::size_t size =
      static_cast<std::size_t>(BeamsOf(frame.header)) * static_cast<std::size_t>(kDidsonBins);
  frame.samples.assign(message.m_cData, message.m_cData + size);
  auto sonar_frame = ToSonarFrame(frame, WindowTable::kClassic);
  // Without the vehicle's time, that of the receiving computer.
  if (sonar_frame && message.m_dVehicleTime <= 0)
    sonar_frame->time = FromUtime(message.time_first_packet);
  return sonar_frame;
}

}  // namespace vog
