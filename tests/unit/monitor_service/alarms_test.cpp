// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <mosquitto.h>
#include <signal.h>

#include <algorithm>
#include <monitor/service/install.hpp>
#include <monitor/service/service.hpp>
#include <mutex>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>

#include "../monitor_brokers/brokers.hpp"
#include "drive.hpp"
#include "process.hpp"

namespace resonid::monitor::test {
namespace {

/// Whom an MQTT broker tells of alarms, with a session that the broker keeps.
class AlarmReceiver {
 public:
  explicit AlarmReceiver(std::uint16_t port) : port_(port) { connect(); }
  AlarmReceiver(const AlarmReceiver&) = delete;
  AlarmReceiver& operator=(const AlarmReceiver&) = delete;
  ~AlarmReceiver() { end(); }

  void connect() {
    client_ = mosquitto_new("receiver", false, this);
    mosquitto_subscribe_callback_set(client_, [](mosquitto*, void* self, int, int, const int*) {
      static_cast<AlarmReceiver*>(self)->subscribed_ = true;
    });
    mosquitto_message_callback_set(client_, [](mosquitto*, void* self, const mosquitto_message* message) {
      const auto body = nlohmann::json::parse(std::string_view(static_cast<const char*>(message->payload),
                                                               static_cast<std::size_t>(message->payloadlen)),
                                              nullptr, false);
      static_cast<AlarmReceiver*>(self)->add(body.value("idempotency_key", "none"));
    });
    ASSERT_EQ(mosquitto_connect(client_, "127.0.0.1", port_, 60), MOSQ_ERR_SUCCESS);
    mosquitto_loop_start(client_);
    subscribed_ = false;
    mosquitto_subscribe(client_, nullptr, "alarms/#", 1);
    ASSERT_TRUE(until([this] { return subscribed_.load(); }));
  }
  void end() {
    if (client_ == nullptr) return;
    mosquitto_disconnect(client_);
    mosquitto_loop_stop(client_, false);
    mosquitto_destroy(std::exchange(client_, nullptr));
  }
  /// In their order. A broker may be given a message twice, where its answer was lost: the key tells.
  std::vector<std::string> keys() {
    const std::lock_guard lock(mutex_);
    return keys_;
  }

 private:
  void add(std::string key) {
    const std::lock_guard lock(mutex_);
    if (std::find(keys_.begin(), keys_.end(), key) == keys_.end()) keys_.push_back(std::move(key));
  }

  std::uint16_t port_;
  mosquitto* client_ = nullptr;
  std::atomic<bool> subscribed_{false};
  std::mutex mutex_;
  std::vector<std::string> keys_;
};

/// Of all messages of a stream.
std::vector<std::string> keys_of_stream(const std::string& url, const char* stream) {
  NatsSender reader(url);
  jsCtx* js = nullptr;
  EXPECT_EQ(natsConnection_JetStream(&js, reader.connection(), nullptr), NATS_OK);
  std::vector<std::string> keys;
  natsMsg* message = nullptr;
  while (js_GetMsg(&message, js, stream, keys.size() + 1, nullptr, nullptr) == NATS_OK) {
    const char* key = nullptr;
    EXPECT_EQ(natsMsgHeader_Get(message, "Nats-Msg-Id", &key), NATS_OK);
    keys.emplace_back(key == nullptr ? "none" : key);
    natsMsg_Destroy(message);
  }
  jsCtx_Destroy(js);
  return keys;
}

class Alarms : public ::testing::Test {
 protected:
  void SetUp() override {
    RESONID_REQUIRE_PROGRAM("mosquitto");
    RESONID_REQUIRE_PROGRAM("nats-server");
    ::signal(SIGPIPE, SIG_IGN);
    mosquitto_ = std::make_unique<Mosquitto>();
    nats_ = std::make_unique<NatsServer>();
    NatsSender(nats_->url()).make_stream("ALARMS", "alarms.>");
    receiver_ = std::make_unique<AlarmReceiver>(mosquitto_->port());
  }
  void stop_brokers() {
    receiver_->end();
    mosquitto_->stop();
    nats_->stop();
  }
  void start_brokers() {
    mosquitto_->start();
    nats_->start();
  }
  [[nodiscard]] std::vector<InstalledTarget> targets() const {
    auto configuration = std::make_shared<Configuration>();
    auto& publish = configuration->publish;
    publish.mqtt.connection.address = fmt::format("127.0.0.1:{}", mosquitto_->port());
    publish.mqtt.topic = "alarms/all";
    publish.nats.connection.address = nats_->url().substr(std::string_view("nats://").size());
    publish.nats.subject = "alarms.all";
    publish.nats.stored = true;
    return targets_of(configuration);
  }
  [[nodiscard]] std::vector<std::string> kept_keys() const { return keys_of_stream(nats_->url(), "ALARMS"); }

  TemporaryFolder folder_;
  std::unique_ptr<Mosquitto> mosquitto_;
  std::unique_ptr<NatsServer> nats_;
  std::unique_ptr<AlarmReceiver> receiver_;
};

TEST_F(Alarms, ReachBrokersOnceEachThroughOutagesOfTheirsAndRestartsOfOurs) {
  const auto both = [](const Process& process, std::uint64_t Deliveries::Status::*count,
                       std::uint64_t least) {
    return until([&] { return process.status(0).*count >= least && process.status(1).*count >= least; });
  };
  {
    Process process(folder_.path(), targets());
    for (std::uint64_t sample = 1; sample <= 2; ++sample) process.happens(sample);
    ASSERT_TRUE(both(process, &Deliveries::Status::delivered, 2));
    stop_brokers();
    for (std::uint64_t sample = 3; sample <= 5; ++sample) process.happens(sample);
    ASSERT_TRUE(both(process, &Deliveries::Status::failures, 1));
    process.commit();
  }
  {
    Process process(folder_.path(), targets());
    process.happens(5);  // a replay
    process.happens(6);
    ASSERT_TRUE(both(process, &Deliveries::Status::failures, 1));
    EXPECT_EQ(process.status(0).waiting, 4U);
    start_brokers();
    ASSERT_TRUE(both(process, &Deliveries::Status::delivered, 4)) << process.status(1).fault;
    process.deliveries().stop();
    process.commit();
    EXPECT_EQ(process.waiting_in_store(), 0U);
  }
  receiver_->connect();
  Process process(folder_.path(), targets());
  process.happens(6);
  process.happens(7);
  ASSERT_TRUE(both(process, &Deliveries::Status::delivered, 1));
  ASSERT_TRUE(until([&] { return receiver_->keys().size() >= 7; }));
  const auto keys = receiver_->keys();
  EXPECT_EQ(keys, kept_keys());
  ASSERT_EQ(keys.size(), 7U);
  for (std::size_t i = 0; i < keys.size(); ++i)
    EXPECT_TRUE(keys[i].ends_with(fmt::format(":17:{}:raised", i + 1))) << keys[i];
}

/// Of all transitions that the service has stored, sorted.
std::vector<std::string> keys_of_store(const std::filesystem::path& folder) {
  auto reader = must(Reader::open((folder / "monitor.sqlite").string()));
  const std::string installation = must(reader.installation());
  std::vector<std::string> keys;
  for (const auto& alarm : must(reader.alarms(AlarmFilter::all, std::nullopt, 1000)))
    for (const auto& event : must(reader.events(alarm.id, 1000)))
      keys.push_back(fmt::format("{}:{}:{}:{}", installation, alarm.id, event.sample, event.transition) +
                     (event.action != 0 ? fmt::format(":{}", event.action) : ""));
  std::sort(keys.begin(), keys.end());
  return keys;
}

std::vector<std::string> sorted(std::vector<std::string> all) {
  std::sort(all.begin(), all.end());
  return all;
}

TEST_F(Alarms, OfTheServiceReachBrokersThatWereAwayUntilItsRestart) {
  stop_brokers();
  const std::vector<std::vector<double>> values{drive_samples(110.0, 75.0, 1)};
  Installation all = installation(folder_.path(), values, 0.0);
  all.targets = targets();
  {
    const auto service = Service::start(all);
    ASSERT_TRUE(service) << message_of(service.error());
    ASSERT_TRUE(until([&] { return (*service)->finished(); }, 60.0));
  }
  const auto before = keys_of_store(folder_.path());
  ASSERT_FALSE(before.empty());
  start_brokers();
  receiver_->connect();
  const auto service = Service::start(all);
  ASSERT_TRUE(service) << message_of(service.error());
  web::Backend& backend = (*service)->backend();
  web::Action action;
  action.kind = web::ActionKind::acknowledge;
  action.alarm = backend.alarms({web::AlarmFilter::active, "", 10}).value().at(0).id;
  action.who = "tester";
  action.reason = "seen";
  ASSERT_TRUE(backend.act(action));
  ASSERT_TRUE(until([&] { return keys_of_store(folder_.path()).size() > before.size(); }));
  const auto after = keys_of_store(folder_.path());
  EXPECT_TRUE(until([&] { return sorted(receiver_->keys()) == after; })) << receiver_->keys().size();
  EXPECT_TRUE(until([&] { return sorted(kept_keys()) == after; }));
}

}  // namespace
}  // namespace resonid::monitor::test
