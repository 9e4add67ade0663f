#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "lib/foxglove/foxglove_messages.h"
#include "lib/foxglove/proto_schema.h"
#include "lib/messages/channels.h"
#include "lib/messages/submap_assembler.h"

namespace vog {

/// A message as others read it.
struct ProtoMessage {
  std::string topic;
  /// A message replaces the one before it of the same topic and key: a frame's or a process' name,
  /// a submap's number.
  std::string key;
  const ProtoSchema* schema = nullptr;  ///< The converter's.
  std::string bytes;
  std::uint64_t log_ns = 0;      ///< When it was heard.
  std::uint64_t publish_ns = 0;  ///< When what it tells was true.
  std::uint32_t sequence = 0;
  bool voids_earlier = false;  ///< All of its topic before it are void.
};

/// Turns what is said on LCM into Protobuf messages by topic: what can be drawn under Foxglove's
/// schemas, everything under those of package vogmap (docs/formats.md). Results depend on what was
/// said alone.
class ProtoConverter {
 public:
  using Sink = std::function<void(const ProtoMessage&)>;

  /// Where the submaps come from whose voxels are drawn.
  enum class SubmapsFrom {
    kChunks,     ///< What is said on SUBMAP.
    kAddSubmap,  ///< The caller, who has put them together already.
  };

  explicit ProtoConverter(Sink sink, SubmapsFrom submaps_from = SubmapsFrom::kChunks);

  /// Hands on all that a message becomes; false for what is no message of its channel's type.
  bool Add(Time heard, const std::string& channel, Bytes bytes);

  /// The voxels of a submap.
  void AddSubmap(Time heard, const Submap& submap);

  /// Takes the voxels of all submaps away; they come again.
  void ForgetSubmaps(Time heard);

  /// From where on a voxel is drawn; each RUN tells it anew.
  void SetOccupiedFrom(LogOddsUnits units) { occupied_from_ = units; }

 private:
  struct Heard {
    std::uint64_t log_ns, publish_ns;
    std::uint32_t sequence;
  };

  template <class Message>
  void On(const Channel<Message>& channel);
  template <class Message>
  bool Convert(Time time, const std::string& channel, Bytes bytes);

  template <class Message>
  auto Draw(const Message& message) const -> decltype(ToFoxglove(message)) {
    return ToFoxglove(message);
  }
  auto Draw(const graph_t& message) const { return ToFoxglove(message, places_); }

  // What else messages tell.
  void Learn(const run_t& run, const Heard& heard);
  void Learn(const nav_t& nav, const Heard& heard);
  void Learn(const pose_estimate_t& pose, const Heard& heard);
  void Learn(const submap_poses_t& places, const Heard& heard);
  void Learn(const chunk_t& chunk, const Heard& heard);

  template <class Message>
  void WriteFrame(const Message& message, const Heard& heard);
  void WriteNoVoxels(const Heard& heard);
  void WriteVoxels(const Submap& submap, const Heard& heard);
  void Write(const std::string& topic, const google::protobuf::Message& message, const Heard& heard,
             const std::string& key = "", bool voids_earlier = false);
  void WriteRaw(const std::string& topic, Time time, const std::string& channel, Bytes bytes);

  using Converter = bool (ProtoConverter::*)(Time time, const std::string& channel, Bytes bytes);

  Sink sink_;
  SubmapsFrom submaps_from_;
  std::map<std::string, Converter> channels_;
  std::map<std::string, ProtoSchema> schemas_;  // By name.
  submap_poses_t places_{};                     // The newest: where the edges of a GRAPH end.
  SubmapAssembler submaps_;
  LogOddsUnits occupied_from_;
};

}  // namespace vog
