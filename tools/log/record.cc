#include "tools/log/record.h"

#include "lib/bus/process.h"
#include "tools/log/channel_filter.h"

namespace vog {

std::int64_t Record(const RecordOptions& options) {
  ChannelFilter filter(options.channels);
  BusOptions bus_options;
  bus_options.url = options.url;
  bus_options.clock = options.clock;
  LcmBus bus(bus_options);
  LogRecorder recorder(options.recorder);
  bus.SubscribeAll([&](Time now, const std::string& channel, Bytes bytes) {
    if (filter.Matches(channel)) recorder.Write(now, channel, bytes);
  });
  bus.Every(std::chrono::seconds(1), [&](Time) { recorder.Tick(); });
  bus.Run(StopSignal());
  return recorder.written();
}

}  // namespace vog
