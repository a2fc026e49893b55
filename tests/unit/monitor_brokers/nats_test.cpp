// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "brokers.hpp"
#include "monitor/brokers/nats_source.hpp"

namespace resonid::monitor::test {
namespace {

bool runs(const Source& source) {
  return until([&] { return source.status().state == SourceState::running; });
}

NatsSourceSettings settings_of(const std::string& url) {
  NatsSourceSettings settings;
  settings.servers.servers = {url};
  settings.subjects = {{"machines.*.samples", {SampleFormat::frame}}};
  return settings;
}

TEST(Nats, BringsEverySampleOnceAndFindsTheServerAgain) {
  RESONID_REQUIRE_PROGRAM("nats-server");
  NatsServer server;
  server.stop();
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  const auto source = std::move(make_nats_source(settings_of(server.url()), rings).value());
  source->start();
  ASSERT_TRUE(until([&] { return source->status().state == SourceState::waiting; }));
  EXPECT_NE(source->status().text.find(server.url()), std::string::npos) << source->status().text;
  server.start();
  ASSERT_TRUE(runs(*source));
  for (const std::uint64_t from : {0, 1000}) {
    NatsSender sender(server.url());
    for (std::uint64_t k = from; k < from + 1000; ++k)
      sender.send("machines.x.samples", frame_of("", k * kFrame));
    sender.flush();
    ASSERT_TRUE(until([&] { return rings.ring("x").end() == (from + 1000) * kFrame; }))
        << rings.ring("x").end();
    if (from > 0) break;
    server.stop();
    ASSERT_TRUE(until([&] { return source->status().state == SourceState::waiting; }));
    server.start();
    ASSERT_TRUE(runs(*source));
  }
  source->stop();
  expect_stored(rings.ring("x"), 2000 * kFrame);
  EXPECT_EQ(source->status().lost, 0U);
  EXPECT_EQ(source->status().messages, 2000U);
}

TEST(Nats, CountsWhatDoesNotFitItsQueue) {
  RESONID_REQUIRE_PROGRAM("nats-server");
  const NatsServer server;
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"}, 16'000);
  NatsSourceSettings settings = settings_of(server.url());
  settings.most_messages = 100;
  const auto source = std::move(make_nats_source(settings, rings).value());
  source->start();
  ASSERT_TRUE(runs(*source));
  NatsSender sender(server.url());
  constexpr std::uint64_t kFrames = 2000;
  for (std::uint64_t k = 0; k < kFrames; ++k) sender.send("machines.x.samples", frame_of("", k * kFrame));
  sender.flush();
  ASSERT_TRUE(until([&] { return source->status().lost > 0; }));
  Ring& ring = rings.ring("x");
  EXPECT_NE(source->status().text.find("Slow Consumer"), std::string::npos) << source->status().text;
  EXPECT_TRUE(until([&] {
    ring.set_read(ring.end());
    const SourceStatus status = source->status();
    return status.messages + status.lost == kFrames;
  })) << source->status().messages
      << " and " << source->status().lost;
  sender.send("machines.x.samples", frame_of("", kFrames * kFrame));
  sender.flush();
  EXPECT_TRUE(until([&] { return ring.next_sample() == (kFrames + 1) * kFrame; }));
  EXPECT_EQ(rings.intake("x").counters().missing, source->status().lost * kFrame);
}

TEST(Nats, NamesWhatIsWrongAndGoesOn) {
  RESONID_REQUIRE_PROGRAM("nats-server");
  const NatsServer server;
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  const auto source = std::move(make_nats_source(settings_of(server.url()), rings).value());
  source->start();
  ASSERT_TRUE(runs(*source));
  NatsSender sender(server.url());
  sender.send("machines.x.samples", "garbage");
  sender.send("machines.x.samples", std::string_view(frame_of("", 0)).substr(0, 99));
  sender.send("machines.x.samples", frame_of("", 0, kFrame, 500.0));
  sender.send("machines.q.samples", frame_of("", 0));
  sender.send("machines.x.samples", frame_of("", 0));
  sender.flush();
  ASSERT_TRUE(until([&] { return rings.ring("x").end() == kFrame; }));
  source->stop();
  EXPECT_EQ(rings.intake("x").faults().count(Fault::format), 2U);
  EXPECT_EQ(rings.intake("x").faults().count(Fault::rate), 1U);
  EXPECT_EQ(source->status().unknown, 1U);
}

TEST(Nats, LetsInWhoHasTheRightPassword) {
  RESONID_REQUIRE_PROGRAM("nats-server");
  const NatsServer server("authorization { user: drive, password: secret }");
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  for (const std::string password : {"wrong", "secret"}) {
    NatsSourceSettings settings = settings_of(server.url());
    settings.servers.access.credentials = Credentials{"drive", password};
    const auto source = std::move(make_nats_source(settings, rings).value());
    source->start();
    ASSERT_TRUE(until([&] { return source->status().state != SourceState::starting; }));
    EXPECT_EQ(source->status().state, password == "secret" ? SourceState::running : SourceState::waiting);
    EXPECT_EQ(source->status().text.find("uthori") == std::string::npos, password == "secret")
        << source->status().text;
  }
}

TEST(Nats, LetsInWhoHasTheRightToken) {
  RESONID_REQUIRE_PROGRAM("nats-server");
  const NatsServer server("authorization { token: \"a-secret\" }");
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  for (const bool right : {false, true}) {
    NatsSourceSettings settings = settings_of(server.url());
    settings.servers.token_file = folder.file("token", right ? " a-secret\r\nmore\n" : "another\n");
    const auto source = std::move(make_nats_source(settings, rings).value());
    source->start();
    ASSERT_TRUE(until([&] { return source->status().state != SourceState::starting; }));
    EXPECT_EQ(source->status().state, right ? SourceState::running : SourceState::waiting)
        << source->status().text;
    if (!right) {
      EXPECT_NE(source->status().text.find("uthori"), std::string::npos) << source->status().text;
    }
  }
}

TEST(Nats, TrustsOnlyWhomItKnows) {
  RESONID_REQUIRE_PROGRAM("nats-server");
  RESONID_REQUIRE_PROGRAM("openssl");
  const TemporaryFolder folder;
  const NatsServer server(with_tls(folder));
  Rings rings(folder.path(), {"x"});
  for (const std::string name : {"right", "wrong"}) {
    NatsSourceSettings settings = settings_of(server.url());
    settings.servers.access.tls = Tls{folder / (name + ".pem"), {}, {}};
    const auto source = std::move(make_nats_source(settings, rings).value());
    source->start();
    ASSERT_TRUE(until([&] { return source->status().state != SourceState::starting; }));
    EXPECT_EQ(source->status().state, name == "right" ? SourceState::running : SourceState::waiting)
        << source->status().text;
  }
}

TEST(Nats, RefusesFiltersThatAreNone) {
  const TemporaryFolder folder;
  Rings rings(folder.path(), {"x"});
  for (const std::string filter : {"", "a..b", "a b", ">.a", "."}) {
    NatsSourceSettings settings;
    settings.subjects = {{filter, {SampleFormat::frame}}};
    RESONID_EXPECT_MESSAGE(make_nats_source(settings, rings), "is no filter of subjects");
  }
  RESONID_EXPECT_MESSAGE(make_nats_source({}, rings), "at least one filter");
}

}  // namespace
}  // namespace resonid::monitor::test
