#include "procs/viewer/page_server.h"

#include <gtest/gtest.h>

#include <vector>

#include "procs/viewer/web_client_testing.h"

namespace vog {
namespace {

const std::string kToken = "correct horse battery";
constexpr const char* kHello = R"({"k":"hello"})";

class PageServerTest : public testing::Test {
 protected:
  PageServerTest() { options_.port = 0; }

  PageServer& Dut() {
    if (!dut_)
      dut_ = std::make_unique<PageServer>(
          options_, board_, feed_,
          std::map<std::string, PageFile>{{"/", {"text/html", "<p>page</p>"}},
                                          {"/app.js", {"text/javascript", "code"}}},
          [this](const std::string& text) {
            asked_.push_back(text);
            return replies_;
          });
    return *dut_;
  }
  std::unique_ptr<WebClient> Connect() {
    return std::make_unique<WebClient>(Dut().port(),
                                       [this] { Dut().Wait(std::chrono::milliseconds(1)); });
  }
  /// A client that was let in and has heard the welcome and the first reset.
  std::unique_ptr<WebClient> Listen(const std::string& hello = kHello) {
    auto client = Connect();
    EXPECT_TRUE(client->Upgrade());
    client->Say(hello);
    EXPECT_TRUE(client->Hear().value_or("").starts_with(R"({"k":"welcome")"));
    EXPECT_EQ(client->Hear(), R"({"k":"reset"})");
    return client;
  }
  void Post(std::int64_t key, const std::string& text) {
    board_.Post({FrameKind::kSubmap, key}, TextFrame(text));
  }

  ViewerOptions options_;
  Board board_;
  FoxgloveFeed feed_;
  std::vector<std::string> asked_;
  std::vector<Frame> replies_;
  std::unique_ptr<PageServer> dut_;
};

TEST_F(PageServerTest, ServesItsFilesAndNothingElse) {
  const std::string page = Connect()->Get("/?theme=dark");
  EXPECT_TRUE(page.starts_with("HTTP/1.1 200 OK\r\n")) << page;
  EXPECT_NE(page.find("Content-Type: text/html"), std::string::npos);
  EXPECT_NE(page.find("Content-Security-Policy: default-src 'self'"), std::string::npos);
  EXPECT_TRUE(page.ends_with("\r\n\r\n<p>page</p>"));
  EXPECT_TRUE(Connect()->Get("/app.js").ends_with("code"));
  for (const char* path : {"/nosuch", "/../etc/passwd", "//app.js", "/app.js/"})
    EXPECT_TRUE(Connect()->Get(path).starts_with("HTTP/1.1 404")) << path;
  EXPECT_TRUE(Connect()->Get("/live").starts_with("HTTP/1.1 426"));
  EXPECT_TRUE(Connect()
                  ->Get("/", "Host: localhost\r\nContent-Length: 0\r\n", "POST")
                  .starts_with("HTTP/1.1 405"));
  const std::string head = Connect()->Get("/", "Host: [::1]:9\r\n", "HEAD");
  EXPECT_TRUE(head.ends_with("\r\n\r\n")) << head;
  EXPECT_NE(head.find("Content-Length: 11"), std::string::npos);
}

TEST_F(PageServerTest, OnLoopbackOtherNamesAreTurnedAway) {
  // A name of another's that leads to 127.0.0.1 must not open the page to that other's scripts.
  EXPECT_TRUE(Connect()->Get("/", "Host: evil.example\r\n").starts_with("HTTP/1.1 403"));
  EXPECT_TRUE(Connect()->Get("/", "").starts_with("HTTP/1.1 403"));
  EXPECT_FALSE(Connect()->Upgrade("Host: evil.example\r\n"));
  EXPECT_FALSE(Connect()->Upgrade("Host: localhost:7680\r\nOrigin: http://evil.example\r\n"));
  EXPECT_EQ(Dut().counts().refused, 2);
  EXPECT_TRUE(Connect()->Upgrade("Host: localhost:7680\r\nOrigin: http://localhost:7680\r\n"));
}

TEST_F(PageServerTest, ShakesHandsAsTheStandardSays) {
  auto client = Connect();
  ASSERT_TRUE(client->Upgrade());
  // RFC 6455, 1.3: the answer to its sample key.
  EXPECT_NE(client->head.find("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="), std::string::npos);
}

TEST_F(PageServerTest, WhoComesLateIsToldAllAndThenWhatChanges) {
  Post(1, "one");
  Post(2, "two");
  Post(1, "one again");
  auto client = Listen();
  EXPECT_EQ(client->Hear(), "two");
  EXPECT_EQ(client->Hear(), "one again");
  EXPECT_EQ(client->Hear(), std::nullopt);
  Post(3, std::string(100000, 'x'));
  EXPECT_EQ(client->Hear().value_or("").size(), 100000u);
  board_.Clear();
  Post(4, "anew");
  EXPECT_EQ(client->Hear(), R"({"k":"reset"})");
  EXPECT_EQ(client->Hear(), "anew");
}

TEST_F(PageServerTest, ASlowClientSkipsWhatWasReplacedAndGetsTheNewest) {
  auto slow = Listen();
  auto quick = Listen();
  // Far more than sockets hold: without skipping the backlog would be 200 x 1 MB.
  std::string last;
  std::size_t heard_by_quick = 0;
  for (int i = 0; i < 200; ++i) {
    last = std::to_string(i) + std::string(1 << 20, 'x');
    Post(1, last);
    if (quick->Hear()) ++heard_by_quick;
  }
  EXPECT_EQ(heard_by_quick, 200u);
  std::size_t heard = 0;
  std::optional<std::string> message, newest;
  while ((message = slow->Hear())) {
    newest = message;
    ++heard;
  }
  EXPECT_TRUE(newest == last) << "heard last: " << newest.value_or("").substr(0, 10);
  EXPECT_LT(heard, 30u);
}

TEST_F(PageServerTest, WithoutTheTokenNothingIsToldOrDone) {
  options_.token = kToken;
  Post(1, "secret");
  for (const std::string hello : {R"({"k":"hello"})", R"({"k":"hello","token":"correct horse"})",
                                  R"({"k":"hello","token":17})", R"({"k":"command"})"}) {
    auto client = Connect();
    ASSERT_TRUE(client->Upgrade());
    EXPECT_EQ(client->Hear(), std::nullopt) << "before it has said hello";
    client->Say(hello);
    EXPECT_EQ(client->Hear(), std::nullopt) << hello;
    EXPECT_EQ(client->close_code, 4401);
  }
  EXPECT_EQ(Dut().counts().refused, 4);
  EXPECT_TRUE(asked_.empty());
  auto client = Listen(R"({"k":"hello","token":")" + kToken + "\"}");
  EXPECT_EQ(client->Hear(), "secret");
}

TEST_F(PageServerTest, WhoSaysNothingMayComeAgain) {
  options_.token = kToken;
  auto silent = Connect();
  ASSERT_TRUE(silent->Upgrade());
  for (int i = 0; i < 100000 && silent->close_code == 0; ++i)
    EXPECT_EQ(silent->Hear(), std::nullopt);
  EXPECT_EQ(silent->close_code, 1013) << "4401 would keep the page from trying again";
  EXPECT_EQ(Dut().counts().refused, 0);
}

TEST_F(PageServerTest, QuestionsAreAnsweredToWhoAsksBeforeAnythingElse) {
  auto asker = Listen();
  auto other = Listen();
  replies_ = {TextFrame("first"), TextFrame("second")};
  asker->Say(R"({"k":"at","t":1})");
  Post(1, "news");
  EXPECT_EQ(asker->Hear(), "first");
  EXPECT_EQ(asker->Hear(), "second");
  EXPECT_EQ(asker->Hear(), "news");
  EXPECT_EQ(other->Hear(), "news");
  EXPECT_EQ(other->Hear(), std::nullopt);
  EXPECT_EQ(asked_, std::vector<std::string>{R"({"k":"at","t":1})"});
}

TEST_F(PageServerTest, BytesThatMakeNoSenseEndTheirConnectionAlone) {
  auto good = Listen();
  const std::string unmasked("\x81\x02hi", 4), unknown_opcode("\x83\x80\1\2\3\4", 6);
  const std::string huge("\x81\xff\x7f\xff\xff\xff\xff\xff\xff\xff\1\2\3\4", 14);
  for (const std::string& bytes : {unmasked, unknown_opcode, huge}) {
    auto client = Listen();
    client->Send(bytes);
    EXPECT_EQ(client->Hear(), std::nullopt);
  }
  for (const std::string text : {"", "{", "[]", "17", "\"hello\""}) {
    auto client = Listen();
    client->Say(text);
    EXPECT_EQ(client->Hear(), std::nullopt);
    EXPECT_EQ(client->close_code, 1008) << text;
  }
  auto binary = Listen();
  binary->Say(R"({"k":"at","t":1})", 2);
  EXPECT_EQ(binary->Hear(), std::nullopt);
  auto large = Listen();
  large->Say(std::string(20000, ' '));
  EXPECT_EQ(large->Hear(), std::nullopt);
  EXPECT_EQ(Dut().counts().malformed, 6);
  EXPECT_TRUE(asked_.empty());
  for (const std::string request : {"nonsense\r\n\r\n", "GET / HTTP/9.9\r\n\r\n", "\r\n\r\n\r\n",
                                    "GET /live HTTP/1.1\r\nHost: "}) {
    auto client = Connect();
    client->Send(request);
    EXPECT_EQ(client->Hear(), std::nullopt);
  }
  auto long_head = Connect();
  long_head->Send("GET / HTTP/1.1\r\nX: " + std::string(40000, 'x'));
  EXPECT_EQ(long_head->Hear(), std::nullopt);
  Post(1, "still here");
  EXPECT_EQ(good->Hear(), "still here");
}

/// Headers of an upgrade to Foxglove's protocol.
std::string Offering(const std::string& subprotocols, const std::string& more = "") {
  return "Host: 127.0.0.1\r\nSec-WebSocket-Protocol: " + subprotocols + "\r\n" + more;
}

TEST_F(PageServerTest, FoxglovesClientsAreServedAtTheRootUnderBothNames) {
  const ProtoSchema schema{"vogmap.Nav", "descriptor"};
  feed_.Post({.topic = "NAV", .key = "", .schema = &schema, .bytes = "here", .log_ns = 5});
  for (const auto& [offered, chosen] :
       {std::pair("foxglove.websocket.v1", "foxglove.websocket.v1"),
        std::pair("foxglove.sdk.v1", "foxglove.sdk.v1"),
        std::pair("x, foxglove.sdk.v1 , foxglove.websocket.v1", "foxglove.sdk.v1")}) {
    auto client = Connect();
    ASSERT_TRUE(client->Upgrade(Offering(offered), "/")) << client->head;
    EXPECT_NE(client->head.find(std::string("Sec-WebSocket-Protocol: ") + chosen),
              std::string::npos)
        << client->head;
    EXPECT_TRUE(client->Hear().value_or("").starts_with("{")) << "serverInfo, without a hello";
    EXPECT_NE(client->Hear().value_or("").find("NAV"), std::string::npos);
    EXPECT_EQ(client->Hear().value_or("").size(), 9u) << "the time";
    client->Say(R"({"op":"subscribe","subscriptions":[{"id":258,"channelId":1}]})");
    EXPECT_EQ(client->Hear(), std::string("\1\2\1\0\0\5\0\0\0\0\0\0\0here", 17));
    client->Say("{");
    EXPECT_NE(client->Hear().value_or("").find("status"), std::string::npos);
    client->Say(std::string(20000, ' '));  // Longer than anything that is meant.
    EXPECT_EQ(client->Hear(), std::nullopt);
  }
  EXPECT_TRUE(asked_.empty());
}

TEST_F(PageServerTest, FoxglovesClientsMustBeAllowedToo) {
  const std::string foxglove = "foxglove.websocket.v1";
  EXPECT_FALSE(Connect()->Upgrade("Host: 127.0.0.1\r\n", "/")) << "no subprotocol";
  EXPECT_FALSE(Connect()->Upgrade(Offering("mqtt"), "/"));
  EXPECT_FALSE(Connect()->Upgrade(Offering(foxglove), "/elsewhere"));
  EXPECT_FALSE(Connect()->Upgrade(
      "Host: evil.example\r\nSec-WebSocket-Protocol: " + foxglove + "\r\n", "/"));
  EXPECT_FALSE(Connect()->Upgrade(Offering(foxglove, "Origin: http://evil.example\r\n"), "/"));
  EXPECT_FALSE(Connect()->Upgrade(Offering(foxglove, "Origin: null\r\n"), "/?token="));
  EXPECT_EQ(Dut().counts().refused, 6);
  EXPECT_TRUE(
      Connect()->Upgrade(Offering(foxglove, "Origin: http://127.0.0.1\r\n"), "/?token=any"));
}

TEST_F(PageServerTest, FoxglovesClientsShowTheTokenInTheirAddress) {
  options_.token = kToken;
  const std::string offering = Offering("foxglove.sdk.v1");
  for (const char* target :
       {"/", "/?token=", "/?token=correct", "/?nottoken=correct%20horse%20battery",
        "/?token=correct%20horse%20batter%", "/?token=%", "/?%zz", "/?token=correct+horse+battery"})
    EXPECT_FALSE(Connect()->Upgrade(offering, target)) << target;
  EXPECT_EQ(Dut().counts().refused, 8);
  for (const char* target :
       {"/?token=correct%20horse%20battery", "/?a=b&token=correct%20horse%20battery&c"})
    EXPECT_TRUE(Connect()->Upgrade(offering, target)) << target;
  // A web page of another server that knows it, as Lichtblick's is.
  EXPECT_TRUE(
      Connect()->Upgrade(Offering("foxglove.sdk.v1", "Origin: http://lichtblick.example\r\n"),
                         "/?token=correct%20horse%20battery"));
  EXPECT_FALSE(
      Connect()->Upgrade("Host: localhost\r\nOrigin: http://lichtblick.example\r\n", "/live"))
      << "our own page's, which can give orders, stays its own";
}

TEST_F(PageServerTest, ClientsThatLeaveAreForgotten) {
  for (int i = 0; i < 100; ++i) Listen();  // More than may be connected at once.
  for (int i = 0; i < 50; ++i) Dut().Wait(std::chrono::milliseconds(1));
  EXPECT_EQ(Dut().counts().clients, 0);
}

TEST_F(PageServerTest, ThereAreNotMoreConnectionsThanItCanServe) {
  std::vector<std::unique_ptr<WebClient>> clients;
  int accepted = 0;
  for (int i = 0; i < 80; ++i) {
    clients.push_back(Connect());
    accepted += clients.back()->Upgrade();
  }
  EXPECT_GE(accepted, 32);
  EXPECT_LE(accepted, 64);
}

TEST_F(PageServerTest, APortThatIsTakenIsALine) {
  options_.port = Dut().port();
  try {
    const PageServer second(options_, board_, feed_, {}, {});
    FAIL();
  } catch (const SystemError& error) {
    EXPECT_NE(std::string(error.what()).find("viewer.port"), std::string::npos);
  }
}

TEST(ViewerOptionsTest, ThePageIsNotOpenedByMistake) {
  const auto complaint = [](const char* text) -> std::string {
    try {
      Config::Parse(text, "a").Read<ViewerOptions>("viewer").Validate();
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(complaint(""), "");
  EXPECT_EQ(complaint("[viewer]\nbind = '::1'"), "");
  EXPECT_EQ(complaint("[viewer]\nbind = '0.0.0.0'\ntoken = 'correct horse battery'"), "");
  EXPECT_NE(complaint("[viewer]\nbind = '0.0.0.0'").find("viewer.token"), std::string::npos);
  EXPECT_NE(complaint("[viewer]\nbind = '::'").find("viewer.token"), std::string::npos);
  EXPECT_NE(complaint("[viewer]\nbind = 'vehicle'").find("viewer.bind"), std::string::npos);
  EXPECT_NE(complaint("[viewer]\nbind = '127.evil'").find("viewer.bind"), std::string::npos);
  EXPECT_NE(complaint("[viewer]\noperators = true").find("viewer.token"), std::string::npos);
  EXPECT_NE(complaint("[viewer]\ntoken = 'short'").find("characters"), std::string::npos);
}

}  // namespace
}  // namespace vog
