#include "tools/status/rate_meter.h"

namespace vog {
namespace {

constexpr std::size_t kMostSamples = 6;

}  // namespace

void RateMeter::Sample(Time now) {
  samples_.push_back({now, count_});
  if (samples_.size() > kMostSamples) samples_.pop_front();
}

double RateMeter::rate_hz() const {
  const double elapsed_s = ToSeconds(samples_.back().time - samples_.front().time);
  if (elapsed_s <= 0) return 0;
  return static_cast<double>(samples_.back().count - samples_.front().count) / elapsed_s;
}

}  // namespace vog
