#include "procs/viewer/page_server.h"

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <nlohmann/json.hpp>
#include <set>

namespace vog {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

using Request = http::request<http::string_body>;
using Response = http::response<http::string_body>;

constexpr std::size_t kMaxMessage_bytes = 16 << 10;
constexpr std::size_t kMaxRequest_bytes = 16 << 10;
constexpr std::size_t kMaxConnections = 64;
constexpr std::chrono::seconds kHttpTimeout(20);
constexpr std::chrono::seconds kHelloTimeout(10);
constexpr std::uint16_t kWrongToken = 4401;

/// Takes as long whatever the first difference is.
bool AreEqual(const std::string& a, const std::string& b) {
  unsigned difference = a.size() != b.size();
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

/// A Host header without its port.
std::string HostName(const std::string& host) {
  if (host.starts_with("[")) return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.find(':'));
}

std::string HeaderOf(const Request& request, http::field field) {
  return std::string(request[field]);
}

}  // namespace

/// What connections share.
class PageServer::Server {
 public:
  Server(const ViewerOptions& options, const Board& board, std::map<std::string, PageFile> pages,
         MessageHandler handler)
      : options(options),
        board(board),
        pages(std::move(pages)),
        handler(std::move(handler)),
        acceptor(io) {}

  void Listen();
  void Accept();
  void PumpAll();
  bool IsAllowedHost(const Request& request) const;
  bool IsOwnOrigin(const Request& request) const;
  Response Answer(const Request& request) const;

  const ViewerOptions options;
  const Board& board;
  const std::map<std::string, PageFile> pages;
  const MessageHandler handler;
  std::size_t connections = 0;
  Counts counts;
  asio::io_context io{1};  // Its end is the end of all connections, which count themselves out.
  tcp::acceptor acceptor;
  std::set<std::shared_ptr<Client>> clients;
};

/// A page that listens.
class PageServer::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Server& server, beast::tcp_stream stream)
      : server_(server), socket_(std::move(stream)), hello_timer_(server_.io) {
    ++server_.connections;
  }
  ~Client() { --server_.connections; }

  void Start(const Request& request) {
    beast::get_lowest_layer(socket_).expires_never();  // The WebSocket has time-outs of its own.
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.read_message_max(kMaxMessage_bytes);
    socket_.auto_fragment(false);  // Into 4 kB, which costs a system call each.
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (error) return;
      self->server_.clients.insert(self);
      self->server_.counts.clients = static_cast<std::int64_t>(self->server_.clients.size());
      self->hello_timer_.expires_after(kHelloTimeout);
      self->hello_timer_.async_wait([self](error_code cancelled) {
        // A slow page may come again; it has shown no wrong token.
        if (!cancelled && !self->is_welcome_) self->Close(websocket::close_code::try_again_later);
      });
      self->Read();
    });
  }

  /// Begins to send what is next, unless something is under way.
  void Pump() {
    if (!is_welcome_ || is_writing_ || is_closing_) return;
    if (const auto frame = NextFrame()) Write(*frame);
  }

 private:
  std::optional<Frame> NextFrame() {
    if (!replies_.empty()) {
      const Frame frame = replies_.front();
      replies_.pop_front();
      return frame;
    }
    if (generation_ != server_.board.generation()) {
      generation_ = server_.board.generation();
      revision_ = 0;
      return TextFrame(R"({"k":"reset"})");
    }
    const Frame* const frame = server_.board.After(revision_);
    return frame != nullptr ? std::optional(*frame) : std::nullopt;
  }

  void Write(const Frame& frame) {
    is_writing_ = true;
    socket_.text(frame.is_text);
    ++server_.counts.frames;
    server_.counts.bytes += static_cast<std::int64_t>(frame.bytes->size());
    socket_.async_write(
        asio::buffer(*frame.bytes),
        [self = shared_from_this(), bytes = frame.bytes](error_code error, std::size_t) {
          self->is_writing_ = false;
          if (error) return self->Leave();
          // Who asks much and reads little is not listened to meanwhile.
          if (self->replies_.empty() && !self->is_reading_) self->Read();
          self->Pump();
        });
  }

  void Read() {
    if (is_closing_) return;
    is_reading_ = true;
    socket_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      self->is_reading_ = false;
      if (error) return self->Leave();
      const std::string text = beast::buffers_to_string(self->buffer_.data());
      self->buffer_.consume(self->buffer_.size());
      self->OnMessage(text);
    });
  }

  void OnMessage(const std::string& text) {
    const auto message = nlohmann::json::parse(text, nullptr, false);
    if (!socket_.got_text() || !message.is_object()) {
      ++server_.counts.malformed;
      return Close(websocket::close_code::policy_error);
    }
    if (!is_welcome_) {
      if (!Welcome(message)) return;
    } else {
      for (Frame& frame : server_.handler(text)) replies_.push_back(std::move(frame));
    }
    Pump();
    if (replies_.empty()) Read();
  }

  bool Welcome(const nlohmann::json& message) {
    const auto token = message.find("token");
    const std::string shown =
        token != message.end() && token->is_string() ? token->get<std::string>() : "";
    if (!server_.options.token.empty() && !AreEqual(shown, server_.options.token)) {
      ++server_.counts.refused;
      Close(kWrongToken);
      return false;
    }
    is_welcome_ = true;
    hello_timer_.cancel();
    replies_.push_back(TextFrame(
        nlohmann::json({{"k", "welcome"}, {"operators", server_.options.operators}}).dump()));
    return true;
  }

  void Close(std::uint16_t code) {
    if (is_closing_) return;
    is_closing_ = true;
    socket_.async_close(websocket::close_reason(code),
                        [self = shared_from_this()](error_code) { self->Leave(); });
  }

  void Leave() {
    is_closing_ = true;
    hello_timer_.cancel();
    server_.clients.erase(shared_from_this());
    server_.counts.clients = static_cast<std::int64_t>(server_.clients.size());
  }

  Server& server_;
  websocket::stream<beast::tcp_stream> socket_;
  asio::steady_timer hello_timer_;
  beast::flat_buffer buffer_;
  std::deque<Frame> replies_;                    // To this client alone; before anything else.
  std::int64_t generation_ = -1, revision_ = 0;  // Of the board, as far as it was read.
  bool is_welcome_ = false, is_reading_ = false, is_writing_ = false, is_closing_ = false;
};

/// A connection before, or without, an upgrade to a WebSocket.
class PageServer::Http : public std::enable_shared_from_this<Http> {
 public:
  Http(Server& server, tcp::socket socket) : server_(server), stream_(std::move(socket)) {
    ++server_.connections;
  }
  ~Http() { --server_.connections; }

  void Read() {
    parser_.emplace();
    parser_->body_limit(kMaxRequest_bytes);
    parser_->header_limit(kMaxRequest_bytes);
    stream_.expires_after(kHttpTimeout);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](error_code error, std::size_t) {
                       if (error == http::error::end_of_stream) return self->Shut();
                       if (error) return;
                       self->OnRequest(self->parser_->release());
                     });
  }

 private:
  void OnRequest(const Request& request) {
    const bool is_live = request.target() == "/live";
    if (websocket::is_upgrade(request) && is_live && server_.IsAllowedHost(request) &&
        server_.IsOwnOrigin(request)) {
      std::make_shared<Client>(server_, std::move(stream_))->Start(request);
      return;
    }
    if (is_live) ++server_.counts.refused;
    response_ = server_.Answer(request);
    http::async_write(stream_, response_,
                      [self = shared_from_this()](error_code error, std::size_t) {
                        if (error) return;
                        if (!self->response_.keep_alive()) return self->Shut();
                        self->Read();
                      });
  }

  void Shut() {
    error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  Server& server_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  Response response_;
};

void PageServer::Server::Listen() {
  const tcp::endpoint endpoint(asio::ip::make_address(options.bind),
                               static_cast<std::uint16_t>(options.port));
  try {
    acceptor.open(endpoint.protocol());
    acceptor.set_option(asio::socket_base::reuse_address(true));
    acceptor.bind(endpoint);
    acceptor.listen();
  } catch (const boost::system::system_error& error) {
    throw SystemError("the page cannot be served on " + options.bind + ":" +
                      std::to_string(options.port) + ": " + error.code().message() +
                      "; viewer.port takes another port");
  }
  Accept();
}

void PageServer::Server::Accept() {
  acceptor.async_accept([this](error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    // Beyond the limit the socket is closed as it goes.
    if (!error && connections < kMaxConnections) {
      error_code ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      std::make_shared<Http>(*this, std::move(socket))->Read();
    }
    Accept();
  });
}

void PageServer::Server::PumpAll() {
  const auto now = clients;  // Pumping may remove some.
  for (const auto& client : now) client->Pump();
}

bool PageServer::Server::IsAllowedHost(const Request& request) const {
  // A name of others that leads here is how pages of others would get in.
  if (!options.IsLoopback()) return true;
  const std::string name = HostName(HeaderOf(request, http::field::host));
  return name == "localhost" || name == "127.0.0.1" || name == "[::1]" || name == options.bind;
}

bool PageServer::Server::IsOwnOrigin(const Request& request) const {
  const std::string origin = HeaderOf(request, http::field::origin);
  const std::string host = HeaderOf(request, http::field::host);
  return origin.empty() || origin == "http://" + host || origin == "https://" + host;
}

Response PageServer::Server::Answer(const Request& request) const {
  Response response(http::status::ok, request.version());
  response.keep_alive(request.keep_alive());
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  response.set(http::field::cache_control, "no-cache");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Content-Security-Policy",
               "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
               "frame-ancestors 'none'");
  const std::string target(request.target().substr(0, request.target().find('?')));
  const auto page = pages.find(target);
  const auto refuse = [&](http::status status, const char* text) {
    response.result(status);
    response.body() = text;
  };
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    refuse(http::status::method_not_allowed, "Only GET and HEAD.\n");
    response.set(http::field::allow, "GET, HEAD");
  } else if (!IsAllowedHost(request)) {
    refuse(http::status::forbidden, "This page is served on loopback alone.\n");
  } else if (target == "/live") {
    if (websocket::is_upgrade(request)) {
      refuse(http::status::forbidden, "Not from another server's page.\n");
    } else {
      refuse(http::status::upgrade_required, "A WebSocket.\n");
    }
  } else if (page == pages.end()) {
    refuse(http::status::not_found, "Not here.\n");
  } else {
    response.set(http::field::content_type, page->second.type);
    response.body() = page->second.content;
  }
  response.prepare_payload();
  if (request.method() == http::verb::head) response.body().clear();
  return response;
}

PageServer::PageServer(const ViewerOptions& options, const Board& board,
                       std::map<std::string, PageFile> pages, MessageHandler handler) {
  options.Validate();
  server_ = std::make_unique<Server>(options, board, std::move(pages), std::move(handler));
  server_->Listen();
}

PageServer::~PageServer() = default;

void PageServer::Poll() {
  server_->PumpAll();
  server_->io.poll();
  server_->PumpAll();
}

void PageServer::Wait(Duration limit) {
  server_->PumpAll();
  server_->io.run_one_for(limit);
  Poll();
}

int PageServer::port() const { return server_->acceptor.local_endpoint().port(); }

std::string PageServer::url() const {
  const bool is_v6 = server_->options.bind.find(':') != std::string::npos;
  const std::string host = is_v6 ? "[" + server_->options.bind + "]" : server_->options.bind;
  return "http://" + host + ":" + std::to_string(port()) + "/";
}

const PageServer::Counts& PageServer::counts() const { return server_->counts; }

}  // namespace vog
