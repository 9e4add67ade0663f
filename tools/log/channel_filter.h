#pragma once

#include <map>
#include <regex>
#include <string>

namespace vog {

/// Channels whose whole names match a regular expression.
class ChannelFilter {
 public:
  /// The word "inputs" stands for what the vehicle says. @throws UsageError.
  explicit ChannelFilter(const std::string& regex);
  bool Matches(const std::string& channel);

 private:
  std::regex regex_;
  std::map<std::string, bool> known_;  // Matching is slow.
};

}  // namespace vog
