// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include <fstream>
#include <memory>

#include "certificate.hpp"
#include "fake_backend.hpp"
#include "monitor/web/server.hpp"
#include "web_client.hpp"

namespace resonid::monitor::web {
namespace {

/// TLS over a client's socket, which waits.
class TlsClient {
 public:
  explicit TlsClient(std::uint16_t port)
      : socket_(port), context_(SSL_CTX_new(TLS_client_method())), tls_(SSL_new(context_)) {
    SSL_set_fd(tls_, socket_.fd());
  }
  ~TlsClient() {
    SSL_free(tls_);
    SSL_CTX_free(context_);
  }
  TlsClient(const TlsClient&) = delete;
  TlsClient& operator=(const TlsClient&) = delete;
  bool shake_hands(int version = 0) {
    if (version != 0) SSL_set_max_proto_version(tls_, version);
    ERR_clear_error();
    return SSL_connect(tls_) == 1;
  }
  void send(const std::string& text) { SSL_write(tls_, text.data(), static_cast<int>(text.size())); }
  /// Until this text has come, or the connection ends.
  std::string receive_until(const std::string& text) {
    while (received_.find(text) == std::string::npos) {
      char bytes[16384];
      const int count = SSL_read(tls_, bytes, sizeof bytes);
      if (count <= 0) break;
      received_.append(bytes, static_cast<std::size_t>(count));
    }
    return received_;
  }

 private:
  test::WebClient socket_;
  SSL_CTX* context_;
  SSL* tls_;
  std::string received_;
};

class WebTls : public testing::Test {
 protected:
  expected<void, Error> start() {
    auto started = WebServer::start(backend, options);
    if (!started) return unexpected<Error>(started.error());
    server = std::move(*started);
    return {};
  }
  WebTls() {
    options.listening.certificate_file = certificate.certificate();
    options.listening.key_file = certificate.key();
  }

  test::Certificate certificate;
  test::FakeBackend backend;
  WebOptions options;
  std::unique_ptr<WebServer> server;
};

TEST_F(WebTls, AnswersAndStreams) {
  ASSERT_TRUE(start());
  EXPECT_EQ(server->url().substr(0, 8), "https://");
  TlsClient client(server->port());
  ASSERT_TRUE(client.shake_hands());
  client.send(test::request_text("GET", "/api/v1/axes"));
  const auto text = client.receive_until("\"axes\"");
  EXPECT_EQ(text.find("HTTP/1.1 200"), 0U);
  EXPECT_NE(text.find("Strict-Transport-Security: max-age"), std::string::npos);
  client.send(test::request_text("GET", "/api/v1/axes/long/raw?from=1&to=2", {}, {{"Connection", "close"}}));
  EXPECT_GT(client.receive_until("no such text").size(), 8'000'000U);

  TlsClient stream(server->port());
  ASSERT_TRUE(stream.shake_hands());
  stream.send(test::request_text("GET", "/api/v1/stream"));
  EXPECT_NE(stream.receive_until("event: frame").find("event: frame"), std::string::npos);
  server->alarm(test::an_alarm(3));
  EXPECT_NE(stream.receive_until("event: alarm").find("event: alarm"), std::string::npos);
}

TEST_F(WebTls, PlainAndOldClientsAndHalfHandshakesEnd) {
  options.limits.idle_s = 0.5;
  ASSERT_TRUE(start());
  test::WebClient plain(server->port()), silent(server->port()), half(server->port());
  plain.send(test::request_text("GET", "/api/v1/axes"));
  half.send("\x16\x03\x01\x02");
  EXPECT_TRUE(plain.closes(3.0));
  EXPECT_TRUE(silent.closes(3.0));
  EXPECT_TRUE(half.closes(3.0));
  TlsClient old(server->port());
  EXPECT_FALSE(old.shake_hands(TLS1_1_VERSION));
  TlsClient client(server->port());
  EXPECT_TRUE(client.shake_hands());
}

TEST_F(WebTls, RefusesFilesThatAreNone) {
  options.listening.key_file = certificate.certificate();
  auto started = start();
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().field, "key_file");
  EXPECT_EQ(started.error().where, certificate.certificate());
  options.listening.certificate_file = "/nowhere/certificate.pem";
  started = start();
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().field, "certificate_file");
  const test::Certificate* const same = &certificate;
  std::ofstream(same->certificate()) << "no certificate";
  options.listening.certificate_file = same->certificate();
  EXPECT_FALSE(start());
}

}  // namespace
}  // namespace resonid::monitor::web
