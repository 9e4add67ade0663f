#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "lib/base/time.h"
#include "procs/viewer/board.h"
#include "procs/viewer/pages.h"
#include "procs/viewer/viewer_options.h"

namespace vog {

/// Serves the page over HTTP and everything on a Board over a WebSocket (path /live), on one port.
/// It has no thread: all happens in Poll() and Wait().
///
/// A client's first message is {"k":"hello","token":...}; who does not know the token is closed
/// with code 4401, who says nothing for 10 s with 1013. It is then sent
/// {"k":"welcome","operators":...}, all frames of the board, and what changes; {"k":"reset"} says
/// that all before is void. Browsers reach it from this server's own page alone (Origin), and under
/// loopback's names alone while it is bound there (Host).
class PageServer {
 public:
  /// Handles a client's message and returns what to answer, in order; never called for a client
  /// that did not show the token.
  using MessageHandler = std::function<std::vector<Frame>(const std::string& text)>;

  struct Counts {
    std::int64_t clients = 0, refused = 0, malformed = 0, frames = 0, bytes = 0;
  };

  /// @throws UsageError for options that do not go together, SystemError when it cannot listen.
  /// `board` must outlive it.
  PageServer(const ViewerOptions& options, const Board& board,
             std::map<std::string, PageFile> pages, MessageHandler handler);
  ~PageServer();

  /// Does what can be done without waiting.
  void Poll();
  /// The same, and waits for something to do, `limit` at most.
  void Wait(Duration limit);

  int port() const;
  /// Of the page.
  std::string url() const;
  const Counts& counts() const;

 private:
  class Server;
  class Http;
  class Client;
  std::unique_ptr<Server> server_;
};

}  // namespace vog
