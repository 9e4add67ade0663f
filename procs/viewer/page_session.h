#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "procs/viewer/board.h"
#include "procs/viewer/viewer_options.h"
#include "procs/viewer/web_session.h"

namespace vog {

/// A page that listens. Its first message is {"k":"hello","token":...}; who does not know the token
/// is closed with code 4401. It is then sent {"k":"welcome","operators":...}, all frames of the
/// board, and what changes; {"k":"reset"} says that all before is void.
class PageSession final : public WebSession {
 public:
  /// Handles a client's message and returns what to answer, in order; never called for a client
  /// that did not show the token.
  using MessageHandler = std::function<std::vector<Frame>(const std::string& text)>;

  /// All of them must outlive it.
  PageSession(const ViewerOptions& options, const Board& board, const MessageHandler& handler,
              WebCounts& counts)
      : options_(options), board_(board), handler_(handler), counts_(counts) {}

  std::optional<std::uint16_t> OnMessage(const std::string& bytes, bool is_text) override;
  std::optional<Frame> NextFrame() override;
  bool HasAnswers() const override { return !answers_.empty(); }
  bool IsWelcome() const override { return is_welcome_; }

 private:
  const ViewerOptions& options_;
  const Board& board_;
  const MessageHandler& handler_;
  WebCounts& counts_;
  std::deque<Frame> answers_;                    // To this client alone; before anything else.
  std::int64_t generation_ = -1, revision_ = 0;  // Of the board, as far as it was read.
  bool is_welcome_ = false;
};

}  // namespace vog
