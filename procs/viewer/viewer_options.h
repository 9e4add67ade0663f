#pragma once

#include <string>

#include "lib/base/config.h"

namespace vog {

/// Table [viewer].
struct ViewerOptions {
  std::string bind = "127.0.0.1";
  int port = 7680;
  std::string token;
  bool operators = false;
  int history_mb = 256;

  void Visit(OptionsVisitor& v) {
    v("bind", bind, "address that the page is served on; another than loopback needs a token");
    v("port", port, Between(0, 65535), "of the page and its WebSocket; 0 takes a free one");
    v("token", token, "what a page must know before it is shown anything; empty asks for none");
    v("operators", operators,
      "whether pages that know the token may pause, resume, send home and abort");
    v("history_mb", history_mb, Between(1, 100000),
      "memory for the past; when it is full, old times become coarser");
  }
  /// @throws UsageError where a page would be open to the network, or commands to anybody.
  void Validate() const;
  bool IsLoopback() const;
  /// Whether `shown` is the token; anything is where there is none.
  bool IsToken(const std::string& shown) const;
};

}  // namespace vog
