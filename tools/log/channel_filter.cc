#include "tools/log/channel_filter.h"

#include "lib/base/errors.h"
#include "lib/messages/channels.h"

namespace vog {

ChannelFilter::ChannelFilter(const std::string& regex) {
  try {
    regex_ = regex == "inputs" ? kInputsRegex : regex;
  } catch (const std::regex_error&) {
    throw UsageError("--channels " + regex + ": not a regular expression");
  }
}

bool ChannelFilter::Matches(const std::string& channel) {
  const auto [found, is_new] = known_.try_emplace(channel, false);
  if (is_new) found->second = std::regex_match(channel, regex_);
  return found->second;
}

}  // namespace vog
