#include "procs/viewer/page_session.h"

#include <nlohmann/json.hpp>

namespace vog {
namespace {

constexpr std::uint16_t kPolicyError = 1008;  // RFC 6455, 7.4.1.
constexpr std::uint16_t kWrongToken = 4401;

}  // namespace

std::optional<std::uint16_t> PageSession::OnMessage(const std::string& bytes, bool is_text) {
  const auto message = nlohmann::json::parse(bytes, nullptr, false);
  if (!is_text || !message.is_object()) {
    ++counts_.malformed;
    return kPolicyError;
  }
  if (is_welcome_) {
    for (Frame& frame : handler_(bytes)) answers_.push_back(std::move(frame));
    return std::nullopt;
  }
  const auto token = message.find("token");
  if (!options_.IsToken(token != message.end() && token->is_string() ? token->get<std::string>()
                                                                     : "")) {
    ++counts_.refused;
    return kWrongToken;
  }
  is_welcome_ = true;
  answers_.push_back(
      TextFrame(nlohmann::json({{"k", "welcome"}, {"operators", options_.operators}}).dump()));
  return std::nullopt;
}

std::optional<Frame> PageSession::NextFrame() {
  if (!is_welcome_) return std::nullopt;
  if (!answers_.empty()) {
    const Frame frame = answers_.front();
    answers_.pop_front();
    return frame;
  }
  if (generation_ != board_.generation()) {
    generation_ = board_.generation();
    revision_ = 0;
    return TextFrame(R"({"k":"reset"})");
  }
  const Frame* const frame = board_.After(revision_);
  return frame != nullptr ? std::optional(*frame) : std::nullopt;
}

}  // namespace vog
