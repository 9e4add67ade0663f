#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "procs/viewer/frame.h"

namespace vog {

/// What the server and its clients' sessions count.
struct WebCounts {
  std::int64_t clients = 0, refused = 0, malformed = 0, frames = 0, bytes = 0;
  std::int64_t skipped = 0;  ///< Messages that a slow subscriber did not get.
};

/// The server's side of one client's conversation. It knows no socket: it is told what came, and
/// asked for what goes.
class WebSession {
 public:
  virtual ~WebSession() = default;

  /// Takes in a message; returns the code to close with where that ends the conversation.
  virtual std::optional<std::uint16_t> OnMessage(const std::string& bytes, bool is_text) = 0;
  /// What is to be sent next; nothing when there is nothing now.
  virtual std::optional<Frame> NextFrame() = 0;
  /// Whether answers wait: who asks much and reads little is not listened to meanwhile.
  virtual bool HasAnswers() const = 0;
  /// Whether the client has said what it must say soon.
  virtual bool IsWelcome() const = 0;
};

}  // namespace vog
