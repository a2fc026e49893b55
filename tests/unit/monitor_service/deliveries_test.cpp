// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <monitor/service/install.hpp>
#include <nlohmann/json.hpp>

#include "folder.hpp"
#include "process.hpp"
#include "targets.hpp"
#include "webhook.hpp"

namespace resonid::monitor {
namespace {

using namespace std::chrono_literals;

TEST(Deliveries, EachTargetIsToldOnceAndInOrderAlthoughItFailsAndTheProcessIsKilled) {
  const Folder folder;
  FakeReceiver first, second;
  first.fails = 1'000'000;
  {
    Process process(folder.path(), {first.target("mqtt"), second.target("nats")});
    for (std::uint64_t sample = 1; sample <= 5; ++sample) process.happens(sample);
    ASSERT_TRUE(
        eventually([&] { return process.status(1).delivered == 5 && process.status(0).failures >= 2; }));
    EXPECT_EQ(process.status(0).fault, "no answer");
    EXPECT_EQ(process.status(0).waiting, 5U);
    process.commit();  // killed: what comes now is not written
  }
  EXPECT_TRUE(first.keys().empty());
  {
    Process process(folder.path(), {first.target("mqtt"), second.target("nats")});
    EXPECT_EQ(process.status(0).fault, "no answer");
    first.fails = 3;
    for (std::uint64_t sample = 4; sample <= 6; ++sample) process.happens(sample);  // 4 and 5 again
    ASSERT_TRUE(eventually([&] { return first.keys().size() == 6 && second.keys().size() == 6; }));
    EXPECT_TRUE(
        eventually([&] { return process.status(0).delivered == 6 && process.status(0).fault.empty(); }));
    process.deliveries().stop();
    process.commit();
    EXPECT_EQ(process.waiting_in_store(), 0U);
  }
  EXPECT_EQ(first.keys(), second.keys());
  const auto keys = first.keys();
  for (std::size_t i = 0; i < keys.size(); ++i)
    EXPECT_TRUE(keys[i].ends_with(fmt::format(":17:{}:raised", i + 1))) << keys[i];
  const auto body = nlohmann::json::parse(first.bodies().front());
  EXPECT_EQ(body["event"]["transition"], "raised");
  EXPECT_EQ(body["event"]["state"], "active");
  EXPECT_EQ(body["alarm"]["axis"], "x");
  EXPECT_EQ(body["alarm"]["id"], 17);

  Process process(folder.path(), {first.target("mqtt"), second.target("nats")});
  process.happens(6);
  process.happens(7);
  ASSERT_TRUE(eventually([&] { return first.keys().size() == 7 && second.keys().size() == 7; }));
}

TEST(Deliveries, AreMadeWhileNothingCanBeWrittenAndMarkedLater) {
  const Folder folder;
  FakeReceiver receiver;
  Process process(folder.path(), {receiver.target("webhook")});
  process.happens(1, false);
  ASSERT_TRUE(eventually([&] { return process.status().delivered == 1; }));
  process.commit();
  EXPECT_EQ(process.waiting_in_store(), 0U);
  process.happens(1);  // a replay
  process.happens(2);
  ASSERT_TRUE(eventually([&] { return process.status().delivered == 2; }));
  EXPECT_EQ(receiver.keys().size(), 2U);
}

TEST(Deliveries, ATargetThatHangsDelaysNeitherOthersNorTheEnd) {
  const Folder folder;
  FakeReceiver hanging, other;
  hanging.hangs = true;
  Process process(folder.path(), {hanging.target("mqtt"), other.target("nats")});
  process.happens(1);
  process.happens(2);
  ASSERT_TRUE(eventually([&] { return other.keys().size() == 2; }));
  const auto begin = std::chrono::steady_clock::now();
  process.deliveries().stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 2s);
  process.commit();
  EXPECT_EQ(process.waiting_in_store(), 2U);
}

TEST(Deliveries, GiveUpWhatIsRefusedForWhatItIsAndTheOldestOfTooMany) {
  const Folder folder;
  FakeReceiver receiver;
  receiver.fails = 1;
  receiver.field = "message";
  Deliveries::Options options{0.005, 0.02};
  options.refused_s = 0.0;
  options.most_waiting = 3;
  Process process(folder.path(), {receiver.target("webhook")}, options);
  process.happens(1);
  process.happens(2);
  ASSERT_TRUE(eventually([&] { return receiver.keys().size() == 1; }));
  EXPECT_TRUE(receiver.keys().front().ends_with(":2:raised"));
  EXPECT_EQ(process.status().given_up, 1U);
  receiver.field = "publisher";
  receiver.fails = 1'000'000;
  for (std::uint64_t sample = 3; sample <= 7; ++sample) process.happens(sample);
  EXPECT_EQ(process.status().given_up, 3U);
  receiver.fails = 0;
  ASSERT_TRUE(eventually([&] { return receiver.keys().size() == 4; }));
  EXPECT_TRUE(receiver.keys()[1].ends_with(":3:raised"));  // it was being sent
  EXPECT_TRUE(receiver.keys()[3].ends_with(":7:raised"));
  process.deliveries().stop();
  process.commit();
  EXPECT_EQ(process.waiting_in_store(), 0U);
}

TEST(Deliveries, MessagesOfTargetsThatAreNoLongerThereAreGivenUp) {
  const Folder folder;
  FakeReceiver receiver;
  receiver.fails = 1'000'000;
  {
    Process process(folder.path(), {receiver.target("mqtt")});
    process.happens(1);
  }
  Process process(folder.path(), {});
  EXPECT_EQ(process.waiting_in_store(), 1U);
  process.commit();
  EXPECT_EQ(process.waiting_in_store(), 0U);
}

TEST(Deliveries, WhatWaitsForTargetsThatAreNoLongerThereDelaysNoOther) {
  const Folder folder;
  FakeReceiver removed, kept;
  removed.fails = kept.fails = 1'000'000;
  {
    Process process(folder.path(), {removed.target("mqtt")});
    for (std::uint64_t sample = 1; sample <= 5; ++sample) process.happens(sample);
  }
  {
    Process process(folder.path(), {removed.target("mqtt"), kept.target("nats")});
    for (std::uint64_t sample = 6; sample <= 8; ++sample) process.happens(sample);
  }
  kept.fails = 0;
  Deliveries::Options options{0.005, 0.02};
  options.most_waiting = 5;
  Process process(folder.path(), {kept.target("nats")}, options);
  EXPECT_TRUE(eventually([&] { return kept.keys().size() == 3; }));
  process.deliveries().stop();
  process.commit();
  EXPECT_EQ(process.waiting_in_store(), 0U);
}

TEST(Deliveries, TheOldestIsGivenUpWhereAFormerProcessLeftTooMany) {
  const Folder folder;
  FakeReceiver receiver;
  receiver.hangs = true;
  {
    Process process(folder.path(), {receiver.target("nats")});
    for (std::uint64_t sample = 1; sample <= 6; ++sample) process.happens(sample);
  }
  receiver.hangs = false;
  Deliveries::Options options{0.005, 0.02};
  options.most_waiting = 4;
  Process process(folder.path(), {receiver.target("nats")}, options);
  EXPECT_TRUE(eventually([&] { return receiver.keys().size() == 4; }));
  EXPECT_TRUE(receiver.keys().back().ends_with(":6:raised"));
  process.deliveries().stop();
  process.commit();
  EXPECT_EQ(process.waiting_in_store(), 0U);
}

TEST(Deliveries, AWebhookGetsEachAlarmOnceAndOneThatHangsDoesNotDelayTheEnd) {
  Webhook webhook;
  webhook.fails = 2;
  auto configuration = std::make_shared<Configuration>();
  configuration->publish.webhook_url = webhook.url();
  const Folder folder;
  Process process(folder.path(), targets_of(configuration));
  process.happens(1);
  ASSERT_TRUE(eventually([&] { return process.status().delivered == 1; }));
  EXPECT_EQ(process.status().failures, 2U);
  ASSERT_EQ(webhook.requests().size(), 1U);
  const auto request = webhook.requests().front();
  const auto body = nlohmann::json::parse(request.body);
  EXPECT_EQ(body["event"]["transition"], "raised");
  EXPECT_EQ(body["idempotency_key"], request.get_header_value("Idempotency-Key"));
  EXPECT_EQ(request.get_header_value("Resonid-Topic"), "alarms");

  webhook.hangs = true;
  process.happens(2);
  ASSERT_TRUE(eventually([&] { return webhook.requests().size() == 2; }));
  const auto begin = std::chrono::steady_clock::now();
  process.deliveries().stop();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 2s);
  process.commit();
  EXPECT_EQ(process.waiting_in_store(), 1U);
}

}  // namespace
}  // namespace resonid::monitor
