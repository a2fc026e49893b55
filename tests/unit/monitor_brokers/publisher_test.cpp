// SPDX-License-Identifier: MIT
#include "monitor/brokers/publisher.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <mosquitto.h>
#include <sys/socket.h>

#include <nlohmann/json.hpp>

#include "brokers.hpp"
#include "monitor/sources/descriptor.hpp"

namespace resonid::monitor::test {
namespace {

constexpr std::string_view kKey = "x/resonance/17";
constexpr std::string_view kBody = R"({"axis":"x","text":"fell by 5 %"})";

/// Empty: it succeeded.
std::string why_not(const expected<void, Error>& published) {
  return published ? std::string() : message_of(published.error());
}

void expect_body(const std::string& text) {
  const auto body = nlohmann::json::parse(text, nullptr, false);
  EXPECT_EQ(body,
            nlohmann::json::parse(R"({"axis":"x","text":"fell by 5 %","idempotency_key":"x/resonance/17"})"))
      << text;
}

/// A subscriber of MQTT 5, by the library itself.
class Subscriber {
 public:
  explicit Subscriber(std::uint16_t port) : client_(mosquitto_new(nullptr, true, this)) {
    mosquitto_int_option(client_, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
    mosquitto_subscribe_callback_set(client_, [](mosquitto*, void* self, int, int, const int*) {
      static_cast<Subscriber*>(self)->subscribed_ = true;
    });
    mosquitto_message_v5_callback_set(client_, [](mosquitto*, void* self, const mosquitto_message* message,
                                                  const mosquitto_property* properties) {
      auto& subscriber = *static_cast<Subscriber*>(self);
      char *name = nullptr, *value = nullptr;
      mosquitto_property_read_string_pair(properties, 38, &name, &value, false);
      const std::lock_guard lock(subscriber.mutex_);
      if (name != nullptr) subscriber.property_ = std::string(name) + "=" + value;
      std::free(name);
      std::free(value);
      subscriber.bodies_.emplace_back(static_cast<const char*>(message->payload),
                                      static_cast<std::size_t>(message->payloadlen));
    });
    mosquitto_connect(client_, "127.0.0.1", port, 60);
    mosquitto_loop_start(client_);
    EXPECT_TRUE(until([&] {
      return mosquitto_subscribe(client_, nullptr, "alarms/#", 1) == MOSQ_ERR_SUCCESS && subscribed_;
    }));
  }
  Subscriber(const Subscriber&) = delete;
  Subscriber& operator=(const Subscriber&) = delete;
  ~Subscriber() {
    mosquitto_disconnect(client_);
    mosquitto_loop_stop(client_, false);
    mosquitto_destroy(client_);
  }
  std::vector<std::string> bodies() {
    const std::lock_guard lock(mutex_);
    return bodies_;
  }
  std::string property() {
    const std::lock_guard lock(mutex_);
    return property_;
  }

 private:
  mosquitto* client_;
  std::atomic<bool> subscribed_{false};
  std::mutex mutex_;
  std::vector<std::string> bodies_;
  std::string property_;
};

TEST(Publisher, RefusesKeysAndBodiesThatAreNone) {
  RESONID_EXPECT_MESSAGE(with_key("{}", ""), "1 ... 200 letters");
  RESONID_EXPECT_MESSAGE(with_key("{}", "a b"), "'a b' is none");
  RESONID_EXPECT_MESSAGE(with_key("{}", "a\r\nX: y"), "is none");
  RESONID_EXPECT_MESSAGE(with_key("{}", std::string(201, 'a')), "is none");
  RESONID_EXPECT_MESSAGE(with_key("[1]", "k"), "a JSON object is required");
  RESONID_EXPECT_MESSAGE(with_key("{", "k"), "a JSON object is required");
  EXPECT_EQ(with_key(R"({"b":1,"a":2})", "k").value(), R"({"b":1,"a":2,"idempotency_key":"k"})");
}

TEST(Publisher, MqttSucceedsWhenTheBrokerHasIt) {
  RESONID_REQUIRE_PROGRAM("mosquitto");
  Mosquitto broker;
  MqttSettings settings;
  settings.host = "127.0.0.1";
  settings.port = broker.port();
  settings.version = MqttVersion::v5;
  const auto publisher = std::move(make_mqtt_publisher(settings).value());
  {
    Subscriber subscriber(broker.port());
    EXPECT_EQ(why_not(publisher->publish(kKey, "alarms/x", kBody)), "") << "it waits for its connection";
    EXPECT_TRUE(until([&] { return !subscriber.bodies().empty(); }));
    ASSERT_EQ(subscriber.bodies().size(), 1U);
    expect_body(subscriber.bodies().front());
    EXPECT_EQ(subscriber.property(), "Idempotency-Key=x/resonance/17");
    EXPECT_NE(why_not(publisher->publish(kKey, "alarms/#", kBody)).find("is no topic"), std::string::npos);
  }
  broker.stop();
  EXPECT_TRUE(until([&] {
    const auto published = publisher->publish(kKey, "alarms/x", kBody);
    return !published && published.error().requirement.str().find("refused") != std::string::npos;
  }));
  broker.start();
  Subscriber subscriber(broker.port());
  EXPECT_TRUE(until([&] { return publisher->publish(kKey, "alarms/x", kBody).has_value(); }));
  EXPECT_TRUE(until([&] { return !subscriber.bodies().empty(); }));
}

TEST(Publisher, MqttTellsThatTheBrokerRefuses) {
  RESONID_REQUIRE_PROGRAM("mosquitto");
  const TemporaryFolder folder;
  const auto rights = folder.file("rights", "topic read #\ntopic write open/#\n");
  const Mosquitto broker("allow_anonymous true\nacl_file " + rights.string());
  MqttSettings settings;
  settings.host = "127.0.0.1";
  settings.port = broker.port();
  settings.version = MqttVersion::v5;
  const auto publisher = std::move(make_mqtt_publisher(settings).value());
  EXPECT_TRUE(until([&] { return publisher->publish(kKey, "open/x", kBody).has_value(); }));
  EXPECT_NE(why_not(publisher->publish(kKey, "alarms/x", kBody)).find("the broker refuses 'alarms/x'"),
            std::string::npos);
}

TEST(Publisher, NatsSucceedsWhenTheServerHasIt) {
  RESONID_REQUIRE_PROGRAM("nats-server");
  NatsServer server(
      "authorization { default_permissions: { publish: { deny: \"closed.>\" } }, users: [{ user: a, "
      "password: b }] }");
  const std::string url = server.url().substr(0, 7) + "a:b@" + server.url().substr(7);
  NatsSender other(url);
  other.make_stream("ALARMS", "alarms.>");
  natsSubscription* subscription = nullptr;
  ASSERT_EQ(natsConnection_SubscribeSync(&subscription, other.connection(), "alarms.x"), NATS_OK);
  other.flush();
  NatsSettings settings;
  settings.servers = {url};
  for (const bool stored : {false, true}) {
    const auto publisher = make_nats_publisher(settings, stored);
    for (int k = 0; k < 2; ++k) ASSERT_TRUE(publisher->publish(kKey, "alarms.x", kBody).has_value());
    natsMsg* message = nullptr;
    ASSERT_EQ(natsSubscription_NextMsg(&message, subscription, 2000), NATS_OK);
    expect_body({natsMsg_GetData(message), static_cast<std::size_t>(natsMsg_GetDataLength(message))});
    natsMsg_Destroy(message);
    EXPECT_NE(why_not(publisher->publish(kKey, "alarms.*", kBody)).find("is no subject"), std::string::npos);
    EXPECT_NE(why_not(publisher->publish(kKey, "closed.x", kBody)).find("closed.x"), std::string::npos);
  }
  // All four have one key: the stream has them once.
  jsCtx* js = nullptr;
  jsStreamInfo* info = nullptr;
  ASSERT_EQ(natsConnection_JetStream(&js, other.connection(), nullptr), NATS_OK);
  ASSERT_EQ(js_GetStreamInfo(&info, js, "ALARMS", nullptr, nullptr), NATS_OK);
  EXPECT_EQ(info->State.Msgs, 1U);
  jsStreamInfo_Destroy(info);
  jsCtx_Destroy(js);
  natsSubscription_Destroy(subscription);
  server.stop();
  const auto publisher = make_nats_publisher(settings, false);
  EXPECT_FALSE(publisher->publish(kKey, "alarms.x", kBody).has_value());
  server.start();
  EXPECT_TRUE(publisher->publish(kKey, "alarms.x", kBody).has_value());
}

/// What comes of a message that is interrupted once `waits` returns, and after how many seconds the publisher
/// is gone.
double seconds_to_end(std::unique_ptr<Publisher> publisher, const std::function<bool()>& waits) {
  std::thread publishing([&] {
    EXPECT_NE(why_not(publisher->publish(kKey, "alarms.x", kBody)).find("interrupted"), std::string::npos);
  });
  EXPECT_TRUE(waits());
  const auto begin = std::chrono::steady_clock::now();
  publisher->interrupt();
  publishing.join();
  EXPECT_FALSE(publisher->publish(kKey, "alarms.x", kBody).has_value());
  publisher.reset();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

TEST(Publisher, NatsThatConnectsIsInterrupted) {
  const Descriptor silent(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));  // takes calls and says nothing
  sockaddr_in address{};
  socklen_t size = sizeof address;
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::bind(silent.get(), reinterpret_cast<sockaddr*>(&address), size), 0);
  const timeval patience{10, 0};
  ASSERT_EQ(::setsockopt(silent.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience), 0);
  ASSERT_EQ(::listen(silent.get(), 1), 0);
  ASSERT_EQ(::getsockname(silent.get(), reinterpret_cast<sockaddr*>(&address), &size), 0);
  NatsSettings settings;
  settings.servers = {"nats://127.0.0.1:" + std::to_string(ntohs(address.sin_port))};
  Descriptor caller;
  EXPECT_LT(seconds_to_end(make_nats_publisher(settings, true),
                           [&] {
                             caller = Descriptor(::accept(silent.get(), nullptr, nullptr));
                             return static_cast<bool>(caller);
                           }),
            1.0);
}

TEST(Publisher, NatsThatWaitsForAStreamIsInterrupted) {
  RESONID_REQUIRE_PROGRAM("nats-server");
  const NatsServer server;
  NatsSender other(server.url());
  natsSubscription* silent = nullptr;  // no stream, but one who listens and does not answer
  ASSERT_EQ(natsConnection_SubscribeSync(&silent, other.connection(), "alarms.x"), NATS_OK);
  other.flush();
  NatsSettings settings;
  settings.servers = {server.url()};
  EXPECT_LT(seconds_to_end(make_nats_publisher(settings, true),
                           [&] {
                             natsMsg* message = nullptr;
                             const natsStatus status = natsSubscription_NextMsg(&message, silent, 10'000);
                             natsMsg_Destroy(message);
                             return status == NATS_OK;
                           }),
            1.0);
  natsSubscription_Destroy(silent);
}

/// A receiver of webhooks on a free port.
class Receiver {
 public:
  Receiver() {
    server_.Post("/hook", [this](const httplib::Request& request, httplib::Response& response) {
      {
        const std::lock_guard lock(mutex_);
        requests_.push_back(request);
      }
      response.status = answer_;
      while (slow_) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    });
    port_ = server_.bind_to_any_port("127.0.0.1");
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    EXPECT_TRUE(until([this] { return server_.is_running(); }));
  }
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;
  ~Receiver() {
    slow_ = false;
    server_.stop();
    thread_.join();
  }
  [[nodiscard]] std::string url() const {
    return "http://127.0.0.1:" + std::to_string(port_) + "/hook?key=1";
  }

  httplib::Server server_;
  int port_ = 0;
  std::atomic<int> answer_{200};
  std::atomic<bool> slow_{false};
  std::mutex mutex_;
  std::vector<httplib::Request> requests_;
  std::thread thread_;
};

TEST(Publisher, WebhookSucceedsWhenTheReceiverSaysSo) {
  Receiver receiver;
  WebhookSettings settings;
  settings.url = receiver.url();
  settings.bearer = "token";
  settings.timeout_s = 0.3;
  const auto publisher = std::move(make_webhook_publisher(settings).value());
  ASSERT_TRUE(publisher->publish(kKey, "alarms/x", kBody).has_value());
  receiver.answer_ = 503;
  EXPECT_NE(why_not(publisher->publish(kKey, "alarms/x", kBody)).find("publisher: answer 503"),
            std::string::npos);
  receiver.answer_ = 201;
  ASSERT_TRUE(publisher->publish(kKey, "alarms/x", kBody).has_value());
  receiver.slow_ = true;
  EXPECT_FALSE(publisher->publish(kKey, "alarms/x", kBody).has_value());
  EXPECT_NE(why_not(publisher->publish(kKey, "a\r\nX: y", kBody)).find("printable ASCII"), std::string::npos);
  EXPECT_TRUE(until([&] {
    const std::lock_guard lock(receiver.mutex_);
    return receiver.requests_.size() == 4;
  }));
  for (const auto& request : receiver.requests_) {
    expect_body(request.body);
    EXPECT_EQ(request.get_header_value("Idempotency-Key"), kKey);
    EXPECT_EQ(request.get_header_value("Resonid-Topic"), "alarms/x");
    EXPECT_EQ(request.get_header_value("Authorization"), "Bearer token");
    EXPECT_EQ(request.get_header_value("Content-Type"), "application/json");
    EXPECT_EQ(request.get_param_value("key"), "1");
  }
}

TEST(Publisher, WebhookTellsARefusedMessageFromAFault) {
  Receiver receiver;
  WebhookSettings settings;
  settings.url = receiver.url();
  const auto publisher = std::move(make_webhook_publisher(settings).value());
  for (const auto& [answer, field] : {std::pair(422, "message"), std::pair(503, "publisher")}) {
    receiver.answer_ = answer;
    const auto published = publisher->publish(kKey, "alarms", kBody);
    ASSERT_FALSE(published);
    EXPECT_EQ(published.error().field.view(), field);
  }
}

TEST(Publisher, WebhookThatWaitsIsInterrupted) {
  Receiver receiver;
  receiver.slow_ = true;
  WebhookSettings settings;
  settings.url = receiver.url();
  const auto publisher = std::move(make_webhook_publisher(settings).value());
  std::thread publishing([&] { EXPECT_FALSE(publisher->publish(kKey, "alarms", kBody).has_value()); });
  EXPECT_TRUE(until([&] {
    const std::lock_guard lock(receiver.mutex_);
    return receiver.requests_.size() == 1;
  }));
  publisher->interrupt();
  publishing.join();
  EXPECT_FALSE(publisher->publish(kKey, "alarms", kBody).has_value());
  EXPECT_EQ(receiver.requests_.size(), 1U);
}

TEST(Publisher, WebhookTrustsOnlyWhomItKnows) {
  RESONID_REQUIRE_PROGRAM("openssl");
  const TemporaryFolder folder;
  for (const char* name : {"right", "wrong"}) make_certificate(folder, name);
  httplib::SSLServer server((folder / "right.pem").c_str(), (folder / "right.key").c_str());
  std::atomic<int> calls{0};
  server.Post("/", [&](const httplib::Request&, httplib::Response&) { ++calls; });
  const int port = server.bind_to_any_port("127.0.0.1");
  std::thread thread([&] { server.listen_after_bind(); });
  for (const std::string name : {"right", "wrong", ""}) {
    WebhookSettings settings;
    settings.url = "https://localhost:" + std::to_string(port);
    if (!name.empty()) settings.tls = Tls{folder / (name + ".pem"), {}, {}};
    const auto publisher = std::move(make_webhook_publisher(settings).value());
    EXPECT_EQ(publisher->publish(kKey, "alarms", kBody).has_value(), name == "right") << name;
  }
  EXPECT_EQ(calls, 1);
  server.stop();
  thread.join();
}

TEST(Publisher, WebhookRefusesWhatIsNoUrl) {
  for (const std::string url : {"", "ftp://a/b", "http://", "http:///x", "http://a b/", "http://a/\r\n"}) {
    WebhookSettings settings;
    settings.url = url;
    RESONID_EXPECT_MESSAGE(make_webhook_publisher(settings), "is required");
  }
  WebhookSettings settings;
  settings.url = "http://127.0.0.1:" + std::to_string(free_port());
  settings.timeout_s = std::numeric_limits<double>::quiet_NaN();
  RESONID_EXPECT_MESSAGE(make_webhook_publisher(settings), "0.1 ... 60 s");
  settings.timeout_s = 1.0;
  EXPECT_FALSE(std::move(make_webhook_publisher(settings).value())->publish(kKey, "t", kBody).has_value());
}

}  // namespace
}  // namespace resonid::monitor::test
