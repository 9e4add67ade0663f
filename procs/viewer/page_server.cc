#include "procs/viewer/page_server.h"

#include <algorithm>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <charconv>
#include <set>

#include "procs/viewer/foxglove_session.h"

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

/// A Host header without its port.
std::string HostName(const std::string& host) {
  if (host.starts_with("[")) return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.find(':'));
}

std::string HeaderOf(const Request& request, http::field field) {
  return std::string(request[field]);
}

std::string PathOf(const Request& request) {
  return std::string(request.target().substr(0, request.target().find('?')));
}

/// Text of an address with its %XX turned into what they stand for.
std::string Unescape(std::string_view text) {
  std::string plain;
  while (!text.empty()) {
    unsigned char byte = static_cast<unsigned char>(text[0]);
    std::size_t size = 1;
    if (text[0] == '%' && text.size() >= 3) {
      const char* const end = text.data() + 3;
      if (std::from_chars(text.data() + 1, end, byte, 16).ptr == end) size = 3;
    }
    plain += static_cast<char>(byte);
    text.remove_prefix(size);
  }
  return plain;
}

/// The token in a target's query; empty where there is none.
std::string TokenIn(std::string_view target) {
  constexpr std::string_view kName = "token=";
  std::size_t at = target.find('?');
  while (at != std::string_view::npos) {
    const std::string_view rest = target.substr(at + 1);
    at = target.find('&', at + 1);
    if (rest.starts_with(kName))
      return Unescape(rest.substr(kName.size(), rest.find('&') - kName.size()));
  }
  return "";
}

/// The first of Foxglove's subprotocols that a client offers; empty where it offers none.
std::string FoxgloveSubprotocolOf(const Request& request) {
  for (const auto offered : http::token_list(request[http::field::sec_websocket_protocol])) {
    const auto& known = FoxgloveSession::kSubprotocols;
    if (std::find(known.begin(), known.end(), std::string_view(offered.data(), offered.size())) !=
        known.end())
      return std::string(offered);
  }
  return "";
}

}  // namespace

/// What connections share.
class PageServer::Server {
 public:
  struct Refusal {
    http::status status;
    const char* text;
  };

  Server(const ViewerOptions& options, const Board& board, const FoxgloveFeed& feed,
         std::map<std::string, PageFile> pages, MessageHandler handler)
      : options(options),
        board(board),
        feed(feed),
        pages(std::move(pages)),
        handler(std::move(handler)),
        acceptor(io) {}

  void Listen();
  void Accept();
  void PumpAll();
  bool IsAllowedHost(const Request& request) const;
  bool IsOwnOrigin(const Request& request) const;
  bool ShowsToken(const Request& request) const;
  /// Why a WebSocket is not granted.
  std::optional<Refusal> RefusalOf(const Request& request) const;
  std::unique_ptr<WebSession> MakeSession(const Request& request);
  Response Answer(const Request& request) const;

  const ViewerOptions options;
  const Board& board;
  const FoxgloveFeed& feed;
  const std::map<std::string, PageFile> pages;
  const MessageHandler handler;
  std::size_t connections = 0;
  Counts counts;
  asio::io_context io{1};  // Its end is the end of all connections, which count themselves out.
  tcp::acceptor acceptor;
  std::set<std::shared_ptr<Client>> clients;
};

/// A WebSocket and what is said over it.
class PageServer::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Server& server, beast::tcp_stream stream, std::unique_ptr<WebSession> session)
      : server_(server),
        socket_(std::move(stream)),
        session_(std::move(session)),
        hello_timer_(server_.io) {
    ++server_.connections;
  }
  ~Client() { --server_.connections; }

  void Start(const Request& request) {
    beast::get_lowest_layer(socket_).expires_never();  // The WebSocket has time-outs of its own.
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.set_option(websocket::stream_base::decorator(
        [subprotocol = FoxgloveSubprotocolOf(request)](websocket::response_type& response) {
          if (!subprotocol.empty()) response.set(http::field::sec_websocket_protocol, subprotocol);
        }));
    socket_.read_message_max(kMaxMessage_bytes);
    socket_.auto_fragment(false);  // Into 4 kB, which costs a system call each.
    socket_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (error) return;
      self->server_.clients.insert(self);
      self->server_.counts.clients = static_cast<std::int64_t>(self->server_.clients.size());
      self->hello_timer_.expires_after(kHelloTimeout);
      self->hello_timer_.async_wait([self](error_code cancelled) {
        // A slow page may come again; it has shown no wrong token.
        if (!cancelled && !self->session_->IsWelcome())
          self->Close(websocket::close_code::try_again_later);
      });
      self->Read();
      self->Pump();
    });
  }

  /// Begins to send what is next, unless something is under way.
  void Pump() {
    if (is_writing_ || is_closing_) return;
    if (const auto frame = session_->NextFrame()) Write(*frame);
  }

 private:
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
          if (!self->session_->HasAnswers() && !self->is_reading_) self->Read();
          self->Pump();
        });
  }

  void Read() {
    if (is_closing_) return;
    is_reading_ = true;
    socket_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      self->is_reading_ = false;
      if (error) return self->Leave();
      const std::string bytes = beast::buffers_to_string(self->buffer_.data());
      self->buffer_.consume(self->buffer_.size());
      self->OnMessage(bytes);
    });
  }

  void OnMessage(const std::string& bytes) {
    if (const auto code = session_->OnMessage(bytes, socket_.got_text())) return Close(*code);
    if (session_->IsWelcome()) hello_timer_.cancel();
    Pump();
    if (!session_->HasAnswers()) Read();
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
  std::unique_ptr<WebSession> session_;
  asio::steady_timer hello_timer_;
  beast::flat_buffer buffer_;
  bool is_reading_ = false, is_writing_ = false, is_closing_ = false;
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
    const bool is_upgrade = websocket::is_upgrade(request);
    if (is_upgrade && !server_.RefusalOf(request)) {
      std::make_shared<Client>(server_, std::move(stream_), server_.MakeSession(request))
          ->Start(request);
      return;
    }
    if (is_upgrade || PathOf(request) == "/live") ++server_.counts.refused;
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

bool PageServer::Server::ShowsToken(const Request& request) const {
  return options.IsToken(TokenIn({request.target().data(), request.target().size()}));
}

std::optional<PageServer::Server::Refusal> PageServer::Server::RefusalOf(
    const Request& request) const {
  const std::string path = PathOf(request);
  if (!IsAllowedHost(request))
    return Refusal{http::status::forbidden, "This page is served on loopback alone.\n"};
  if (path == "/live") {
    if (!IsOwnOrigin(request))
      return Refusal{http::status::forbidden, "Not from another server's page.\n"};
    return std::nullopt;
  }
  if (path != "/") return Refusal{http::status::not_found, "Not here.\n"};
  if (FoxgloveSubprotocolOf(request).empty())
    return Refusal{http::status::bad_request,
                   "A WebSocket here speaks foxglove.websocket.v1 or foxglove.sdk.v1.\n"};
  if (!ShowsToken(request))
    return Refusal{http::status::unauthorized, "The address must end in ?token=...\n"};
  if (options.token.empty() && !IsOwnOrigin(request))
    return Refusal{http::status::forbidden,
                   "From another server's page with a token alone: set viewer.token.\n"};
  return std::nullopt;
}

/// @pre it is not refused.
std::unique_ptr<WebSession> PageServer::Server::MakeSession(const Request& request) {
  if (PathOf(request) == "/live")
    return std::make_unique<PageSession>(options, board, handler, counts);
  return std::make_unique<FoxgloveSession>(feed, counts);
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
  const std::string path = PathOf(request);
  const auto page = pages.find(path);
  const auto refuse = [&](http::status status, const char* text) {
    response.result(status);
    response.body() = text;
  };
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    refuse(http::status::method_not_allowed, "Only GET and HEAD.\n");
    response.set(http::field::allow, "GET, HEAD");
  } else if (!IsAllowedHost(request)) {
    refuse(http::status::forbidden, "This page is served on loopback alone.\n");
  } else if (websocket::is_upgrade(request)) {
    const Refusal refusal = RefusalOf(request).value();
    refuse(refusal.status, refusal.text);
  } else if (path == "/live") {
    refuse(http::status::upgrade_required, "A WebSocket.\n");
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

PageServer::PageServer(const ViewerOptions& options, const Board& board, const FoxgloveFeed& feed,
                       std::map<std::string, PageFile> pages, MessageHandler handler) {
  options.Validate();
  server_ = std::make_unique<Server>(options, board, feed, std::move(pages), std::move(handler));
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
