#include "tools/log/mcap_export.h"

#include <bit>
#include <filesystem>
#include <map>
#include <type_traits>

#include "lib/bus/lcm_log.h"
#include "lib/messages/channels.h"
#include "lib/messages/endpoint.h"
#include "tools/log/foxglove_messages.h"
#include "tools/log/log_files.h"
#include "tools/log/mcap_topics.h"
#include "tools/log/mcap_writer.h"
#include "vogmap/lcm_message.pb.h"
#include "vogmap/to_proto.h"

namespace vog {
namespace {

constexpr const char* kFrames = "tf";

/// Of a message's LCM type; 0 for bytes that are too few for one.
std::uint64_t FingerprintOf(Bytes bytes) {
  std::uint64_t fingerprint = 0;
  if (bytes.size() < sizeof(fingerprint)) return 0;
  for (std::size_t i = 0; i < sizeof(fingerprint); ++i) fingerprint = fingerprint << 8 | bytes[i];
  return fingerprint;
}

/// Turns the events of a log into messages of an MCAP file.
class Exporter {
 public:
  explicit Exporter(McapWriter& writer);

  /// False for what is no message of its channel's type.
  bool Add(const LogEvent& event);

 private:
  template <class Message>
  void On(const Channel<Message>& channel);
  template <class Message>
  bool Convert(const LogEvent& event);

  template <class Message>
  auto Draw(const Message& message) const -> decltype(ToFoxglove(message)) {
    return ToFoxglove(message);
  }
  auto Draw(const graph_t& message) const { return ToFoxglove(message, places_); }

  /// What a message says beside its drawing.
  template <class Message>
  static auto FieldsOf(const Message& message) {
    return ToProto(message);
  }
  static vogmap::SonarFrame FieldsOf(sonar_frame_t message) {
    message.samples.clear();  // They are the image.
    return ToProto(message);
  }

  void AddRaw(const std::string& topic, const LogEvent& event);

  McapTopics topics_;
  std::map<std::string, bool (Exporter::*)(const LogEvent&)> channels_;
  submap_poses_t places_{};  // The newest: where the edges of a GRAPH end.
};

Exporter::Exporter(McapWriter& writer) : topics_(writer) {
  On(inputs::kRun);
  On(inputs::kVehicleNav);
  On(inputs::kDvl);
  On(inputs::kImu);
  On(inputs::kDepth);
  On(inputs::kSonarReturns);
  On(inputs::kSonarFrame);
  On(inputs::kTruth);
  On(outputs::kNav);
  On(outputs::kScan);
  On(outputs::kSubmap);
  On(outputs::kSubmapPoses);
  On(outputs::kGraph);
  On(outputs::kPose);
  On(outputs::kPlan);
  On(outputs::kMissionStatus);
  On(outputs::kOperator);
  On(outputs::kControl);
  On(outputs::kVehicleCommand);
  On(outputs::kMapStatus);
  On(outputs::kMapRequest);
  On(outputs::kMapReply);
  On(outputs::kStatus);
}

template <class Message>
void Exporter::On(const Channel<Message>& channel) {
  channels_[channel.name] = &Exporter::Convert<Message>;
}

bool Exporter::Add(const LogEvent& event) {
  const auto known = channels_.find(event.channel);
  if (known == channels_.end()) {
    AddRaw(event.channel, event);
    return true;
  }
  if ((this->*known->second)(event)) return true;
  AddRaw(event.channel + "/malformed", event);
  return false;
}

template <class Message>
bool Exporter::Convert(const LogEvent& event) {
  Message message{};
  if (!Decode(event.bytes, message)) return false;
  const MessageTimes times{NanosecondsOf(ToUtime(event.time)),
                           NanosecondsOf(message.header.utime_us)};
  const auto sequence = static_cast<std::uint32_t>(message.header.sequence);
  if constexpr (std::is_same_v<Message, submap_poses_t>) places_ = message;
  if constexpr (requires { Draw(message); }) {
    const auto drawn = Draw(message);
    if (!drawn) return false;
    topics_.Write(event.channel, *drawn, times, sequence);
    topics_.Write(event.channel + "/fields", FieldsOf(message), times, sequence);
  } else {
    topics_.Write(event.channel, ToProto(message), times, sequence);
  }
  if constexpr (requires { FrameOf(message); }) {
    if (const auto frame = FrameOf(message)) topics_.Write(kFrames, *frame, times, sequence);
  }
  return true;
}

void Exporter::AddRaw(const std::string& topic, const LogEvent& event) {
  vogmap::LcmMessage message;
  message.set_channel(ToUtf8(event.channel));
  message.set_fingerprint(FingerprintOf(event.bytes));
  message.set_bytes(event.bytes.data(), event.bytes.size());
  const std::uint64_t time_ns = NanosecondsOf(ToUtime(event.time));
  topics_.Write(ToUtf8(topic), message, {time_ns, time_ns}, 0);
}

/// Of an event in a log.
std::uintmax_t SizeOf(const LogEvent& event) {
  constexpr std::size_t kHead_bytes = 28;
  return kHead_bytes + event.channel.size() + event.bytes.size();
}

}  // namespace

McapExport ExportToMcap(const std::string& log, const std::string& out,
                        const std::function<void(double share)>& on_progress) {
  LcmLogReader reader(log);
  RefuseSame(log, out);
  const auto size_bytes = static_cast<double>(std::filesystem::file_size(log));
  McapWriter writer(out);
  Exporter exporter(writer);
  McapExport done;
  std::uintmax_t read_bytes = 0;
  while (const auto event = reader.Next()) {
    if (!exporter.Add(*event)) ++done.malformed;
    ++done.messages;
    read_bytes += SizeOf(*event);
    on_progress(static_cast<double>(read_bytes) / size_bytes);
  }
  writer.Finish();
  return done;
}

}  // namespace vog
