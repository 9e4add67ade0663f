#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace vog {

/// Paroscientific's Digiquartz pressure gauges over a serial line: lines of text `*DDSS...`, DD the
/// unit that is meant and SS the one that speaks; the host is 00. There is no check sum.

/// The pressure, in the gauge's own unit (PressureOptions), that a reply to unit 00 holds:
/// `*000114.6959494`. Nothing where the line is none.
std::optional<double> ParseParosReply(std::string_view line);
/// The reply of gauge `unit` (1..99), "\r\n" included. @pre pressure >= 0.
std::string FormatParosReply(double pressure, int unit = 1);

/// What the host asks for.
struct ParosCommand {
  enum Kind {
    kSample,      ///< P3: one sample.
    kContinuous,  ///< P4: samples until told otherwise.
    kUnit,        ///< UN: 1 psi, 2 mbar, 8 metres of water.
    kPeriod,      ///< PR: round(1 / (rate_hz * 0.007913)).
  };
  Kind kind = kSample;
  int unit = 1;   ///< The gauge, 1..98; 99 is all of them.
  int value = 0;  ///< Of kUnit and kPeriod.

  bool operator==(const ParosCommand&) const = default;
};

/// Without its end of line. Settings come behind the command that allows them (EW) in one line.
std::optional<ParosCommand> ParseParosCommand(std::string_view line);
/// "\r\n" included.
std::string FormatParosCommand(const ParosCommand& command);

/// The value of kPeriod that comes closest to `rate_hz`. @pre rate_hz > 0.
int ParosPeriod(double rate_hz);

}  // namespace vog
