#include "lib/foxglove/proto_converter.h"

#include <google/protobuf/descriptor.h>

#include "lib/foxglove/foxglove_messages.h"
#include "lib/foxglove/utf8.h"
#include "lib/messages/endpoint.h"
#include "vogmap/lcm_message.pb.h"
#include "vogmap/to_proto.h"

namespace vog {
namespace {

constexpr const char* kVoxels = "SUBMAP/voxels";

/// Of a message's LCM type; 0 for bytes that are too few for one.
std::uint64_t FingerprintOf(Bytes bytes) {
  std::uint64_t fingerprint = 0;
  if (bytes.size() < sizeof(fingerprint)) return 0;
  for (std::size_t i = 0; i < sizeof(fingerprint); ++i) fingerprint = fingerprint << 8 | bytes[i];
  return fingerprint;
}

/// What a message says beside its drawing.
template <class Message>
auto FieldsOf(const Message& message) {
  return ToProto(message);
}
vogmap::SonarFrame FieldsOf(sonar_frame_t message) {
  message.samples.clear();  // They are the image.
  return ToProto(message);
}

/// Which of a topic's messages this one replaces: one of the same sender.
template <class Message>
std::string KeyOf(const Message& message) {
  return ToUtf8(message.header.sender);
}
std::string KeyOf(const status_t& status) { return ToUtf8(status.process); }

LogOddsUnits OccupiedFrom(const SensorModelOptions& options) {
  return SensorModel(options).occupied_from;
}

}  // namespace

ProtoConverter::ProtoConverter(Sink sink, SubmapsFrom submaps_from)
    : sink_(std::move(sink)),
      submaps_from_(submaps_from),
      occupied_from_(OccupiedFrom(SensorModelOptions())) {
  ForEachChannel([this](const auto& channel) { On(channel); });
}

template <class Message>
void ProtoConverter::On(const Channel<Message>& channel) {
  channels_[channel.name] = &ProtoConverter::Convert<Message>;
}

bool ProtoConverter::Add(Time heard, const std::string& channel, Bytes bytes) {
  const auto known = channels_.find(channel);
  if (known == channels_.end()) {
    WriteRaw(channel, heard, channel, bytes);
    return true;
  }
  if ((this->*known->second)(heard, channel, bytes)) return true;
  WriteRaw(channel + "/malformed", heard, channel, bytes);
  return false;
}

template <class Message>
bool ProtoConverter::Convert(Time time, const std::string& channel, Bytes bytes) {
  Message message{};
  if (!Decode(bytes, message)) return false;
  const Heard heard{NanosecondsOf(ToUtime(time)), NanosecondsOf(message.header.utime_us),
                    static_cast<std::uint32_t>(message.header.sequence)};
  const std::string key = KeyOf(message);
  if constexpr (requires { Draw(message); }) {
    const auto drawn = Draw(message);
    if (!drawn) return false;
    Write(channel, *drawn, heard, key);
    Write(channel + "/fields", FieldsOf(message), heard, key);
  } else {
    Write(channel, ToProto(message), heard, key);
  }
  if constexpr (requires { Learn(message, heard); }) Learn(message, heard);
  return true;
}

void ProtoConverter::Learn(const run_t& run, const Heard&) {
  try {
    occupied_from_ = OccupiedFrom(
        Config::Parse(run.config_toml, "RUN").Read<SensorModelOptions>("sensor_model"));
  } catch (const UsageError&) {  // Of another version, or damaged: what was known stays.
  }
}

void ProtoConverter::Learn(const nav_t& nav, const Heard& heard) { WriteFrame(nav, heard); }

void ProtoConverter::Learn(const pose_estimate_t& pose, const Heard& heard) {
  WriteFrame(pose, heard);
}

template <class Message>
void ProtoConverter::WriteFrame(const Message& message, const Heard& heard) {
  if (const auto frame = FrameOf(message)) Write("tf", *frame, heard, frame->child_frame_id());
}

void ProtoConverter::Learn(const submap_poses_t& places, const Heard& heard) {
  places_ = places;
  if (const auto frames = FrameOf(places)) Write("tf/submaps", *frames, heard);
}

void ProtoConverter::Learn(const chunk_t& chunk, const Heard& heard) {
  if (submaps_from_ != SubmapsFrom::kChunks) return;
  const SubmapAssembler::Result result = submaps_.Add(chunk);
  if (result.is_of_another_map) WriteNoVoxels(heard);
  if (result.submap) WriteVoxels(*result.submap, heard);
}

void ProtoConverter::AddSubmap(Time time, const Submap& submap) {
  WriteVoxels(submap, {NanosecondsOf(ToUtime(time)), NanosecondsOf(ToUtime(time)), 0});
}

void ProtoConverter::ForgetSubmaps(Time time) {
  submaps_.Clear();
  WriteNoVoxels({NanosecondsOf(ToUtime(time)), NanosecondsOf(ToUtime(time)), 0});
}

void ProtoConverter::WriteNoVoxels(const Heard& heard) {
  Write(kVoxels, NoVoxels(heard.log_ns), heard, "", true);
}

void ProtoConverter::WriteVoxels(const Submap& submap, const Heard& heard) {
  Write(kVoxels, VoxelsOf(submap, occupied_from_), heard, std::to_string(submap.id()));
}

void ProtoConverter::Write(const std::string& topic, const google::protobuf::Message& message,
                           const Heard& heard, const std::string& key, bool voids_earlier) {
  const google::protobuf::Descriptor& type = *message.GetDescriptor();
  auto schema = schemas_.find(type.full_name());
  if (schema == schemas_.end()) schema = schemas_.emplace(type.full_name(), SchemaOf(type)).first;
  sink_({topic, key, &schema->second, message.SerializeAsString(), heard.log_ns, heard.publish_ns,
         heard.sequence, voids_earlier});
}

void ProtoConverter::WriteRaw(const std::string& topic, Time time, const std::string& channel,
                              Bytes bytes) {
  vogmap::LcmMessage message;
  message.set_channel(ToUtf8(channel));
  message.set_fingerprint(FingerprintOf(bytes));
  message.set_bytes(bytes.data(), bytes.size());
  Write(ToUtf8(topic), message, {NanosecondsOf(ToUtime(time)), NanosecondsOf(ToUtime(time)), 0});
}

}  // namespace vog
