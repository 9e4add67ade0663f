#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "procs/viewer/page_server.h"

namespace vog {

/// Just enough of a browser: bytes over TCP, HTTP and WebSocket frames by hand. The server has no
/// thread, so `step` lets it work while the client waits.
class WebClient {
 public:
  WebClient(int port, std::function<void()> step)
      : step_(std::move(step)), socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0)
      throw std::runtime_error("nobody listens");
    ::fcntl(socket_, F_SETFL, O_NONBLOCK);
  }
  ~WebClient() { ::close(socket_); }
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;

  void Send(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent > 0) bytes.remove_prefix(static_cast<std::size_t>(sent));
      if (sent < 0 && errno != EAGAIN) return;  // The server has closed.
      step_();
    }
  }

  /// An HTTP request's answer: head and body as they came.
  std::string Get(const std::string& path, const std::string& headers = "Host: 127.0.0.1\r\n",
                  const std::string& method = "GET") {
    Send(method + " " + path + " HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n");
    while (Receive()) {
    }
    return std::exchange(buffer_, "");
  }

  /// Asks for the WebSocket; true when it is granted.
  bool Upgrade(const std::string& headers = "Host: 127.0.0.1\r\n",
               const std::string& target = "/live") {
    Send("GET " + target + " HTTP/1.1\r\n" + headers +
         "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    std::size_t end;
    while ((end = buffer_.find("\r\n\r\n")) == std::string::npos)
      if (!Receive()) return false;
    head = buffer_.substr(0, end);
    buffer_.erase(0, end + 4);
    return head.starts_with("HTTP/1.1 101");
  }

  /// Sends one frame, masked as clients must.
  void Say(const std::string& text, unsigned char opcode = 1) const {
    std::string frame(1, static_cast<char>(0x80 | opcode));
    if (text.size() < 126) {
      frame += static_cast<char>(0x80 | text.size());
    } else {
      frame += {static_cast<char>(0x80 | 126), static_cast<char>(text.size() >> 8),
                static_cast<char>(text.size() & 0xff)};
    }
    const char mask[4] = {1, 2, 3, 4};
    frame.append(mask, 4);
    for (std::size_t i = 0; i < text.size(); ++i) frame += static_cast<char>(text[i] ^ mask[i % 4]);
    Send(frame);
  }

  /// The next message; nothing when the server closes or has nothing to say.
  std::optional<std::string> Hear() {
    for (;;) {
      if (auto frame = TakeFrame()) {
        if (frame->first == 8) {
          close_code = frame->second.size() >= 2
                           ? static_cast<unsigned char>(frame->second[0]) << 8 |
                                 static_cast<unsigned char>(frame->second[1])
                           : 1005;
          return std::nullopt;
        }
        if (frame->first == 1 || frame->first == 2) return frame->second;
        continue;
      }
      if (!Receive()) return std::nullopt;
    }
  }

  std::string head;
  int close_code = 0;

 private:
  /// Reads some bytes; false at the end, or when none come although the server may work.
  bool Receive() {
    constexpr int kPatience = 200;
    for (int i = 0; i < kPatience; ++i) {
      step_();
      char bytes[1 << 16];
      const ssize_t size = ::recv(socket_, bytes, sizeof(bytes), 0);
      if (size == 0) return false;
      if (size > 0) {
        buffer_.append(bytes, static_cast<std::size_t>(size));
        return true;
      }
      if (errno != EAGAIN) return false;
    }
    return false;
  }

  std::optional<std::pair<int, std::string>> TakeFrame() {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(buffer_[i]); };
    if (buffer_.size() < 2) return std::nullopt;
    std::size_t size = byte(1) & 0x7f, at = 2;
    const std::size_t length_bytes = size == 126 ? 2 : size == 127 ? 8 : 0;
    if (buffer_.size() < at + length_bytes) return std::nullopt;
    if (length_bytes > 0) size = 0;
    for (std::size_t i = 0; i < length_bytes; ++i) size = size << 8 | byte(at++);
    if (buffer_.size() < at + size) return std::nullopt;
    std::pair<int, std::string> frame{byte(0) & 0xf, buffer_.substr(at, size)};
    buffer_.erase(0, at + size);
    return frame;
  }

  std::function<void()> step_;
  int socket_;
  std::string buffer_;
};

}  // namespace vog
