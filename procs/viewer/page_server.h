#pragma once

#include <map>
#include <memory>
#include <string>

#include "lib/base/time.h"
#include "procs/viewer/board.h"
#include "procs/viewer/foxglove_feed.h"
#include "procs/viewer/page_session.h"
#include "procs/viewer/pages.h"
#include "procs/viewer/viewer_options.h"

namespace vog {

/// Serves the page over HTTP, everything on a Board over a WebSocket (path /live, PageSession), and
/// a feed over one that offers Foxglove's subprotocols (path /, FoxgloveSession), on one port. It
/// has no thread: all happens in Poll() and Wait().
///
/// A client that says nothing for 10 s is closed with 1013. Browsers reach /live from this server's
/// own page alone (Origin), and all of it under loopback's names alone while it is bound there
/// (Host). A client of Foxglove's protocol shows the token in its address, ?token=...; who shows it
/// may be another server's page.
class PageServer {
 public:
  using MessageHandler = PageSession::MessageHandler;
  using Counts = WebCounts;

  /// @throws UsageError for options that do not go together, SystemError when it cannot listen.
  /// `board` and `feed` must outlive it.
  PageServer(const ViewerOptions& options, const Board& board, const FoxgloveFeed& feed,
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
