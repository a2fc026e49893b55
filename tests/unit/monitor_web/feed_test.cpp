// SPDX-License-Identifier: MIT
#include "monitor/web/feed.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "fake_backend.hpp"
#include "monitor/web/api_json.hpp"
#include "openapi.hpp"

namespace resonid::monitor::web {
namespace {

using nlohmann::json;
using test::an_alarm;
using test::an_axis;

json data_of(const FeedEvent& event) {
  const auto at = event.text->find("data: ");
  return json::parse(event.text->substr(at + 6));
}

struct WebFeed : testing::Test {
  test::FakeBackend backend;
  std::vector<FeedEvent> sent;
  Feed feed{backend, 0xb007, [this](FeedEvent event) { sent.push_back(std::move(event)); }};

  std::vector<FeedEvent> round(const std::set<std::string>& watched = {}) {
    sent.clear();
    feed.round(test::kTime, watched);
    return sent;
  }
};

TEST_F(WebFeed, AFrameHasWhatChanged) {
  auto events = round();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(data_of(events[0]).at("axes").size(), 2U);
  EXPECT_TRUE(round().empty());
  backend.set({an_axis("x", 2.0)});
  events = round();
  ASSERT_EQ(events.size(), 1U);
  const auto frame = data_of(events[0]);
  EXPECT_EQ(frame.at("axes").size(), 1U);
  EXPECT_EQ(frame.at("axes").at("x").at("figures").at("resonance_hz").at("value"), 2.0);
  EXPECT_EQ(frame.at("time_s"), test::kTime);
  EXPECT_EQ(events[0].text->find("id: b007-2\nevent: frame\ndata: {"), 0U);
}

TEST_F(WebFeed, FramesHaveSevenDigits) {
  for (const double value : {1.0 / 3.0, -2e-12 / 3.0, 4e6 / 3.0, 5e-320, 1e300, 0.0}) {
    auto axis = an_axis("x");
    axis.figures[0].now.value = value;
    backend.set({axis});
    const auto frame = data_of(round().at(0));
    const double sent_value = frame.at("axes").at("x").at("figures").at("resonance_hz").at("value");
    EXPECT_NEAR(sent_value, value, 5e-7 * std::abs(value));
    if (std::abs(value) > 1e-15 && std::abs(value) < 1e15) {
      EXPECT_LE(frame.at("axes").at("x").at("figures").at("resonance_hz").at("value").dump().size(), 14U)
          << value;
    }
  }
}

TEST_F(WebFeed, EveryAxisComesAgainUnlessItHasGone) {
  round();
  backend.remove("y");
  std::size_t frames = 0, axes = 0;
  for (std::uint64_t i = 0; i < 2 * Feed::kRefresh; ++i)
    for (const auto& event : round()) {
      ++frames;
      axes += data_of(event).at("axes").size();
    }
  EXPECT_EQ(frames, 2U);
  EXPECT_EQ(axes, 2U);  // x alone
}

TEST_F(WebFeed, ManyAxesTakeTurns) {
  std::vector<AxisStatus> axes;
  for (int i = 0; i < 500; ++i) axes.push_back(an_axis(fmt::format("axis-{}", i), 1.0 / 3.0));
  std::map<std::string, int> seen;
  for (int i = 0; i < 60; ++i) {
    backend.set(axes);
    const auto events = round();
    ASSERT_EQ(events.size(), 1U);
    EXPECT_LT(events[0].text->size(), Feed::kFrameBytes + 2000);
    const auto frame = data_of(events[0]);
    for (const auto& axis : frame.at("axes").items()) ++seen[axis.key()];
  }
  ASSERT_EQ(seen.size(), 502U);
  int least = 60, most = 0;
  for (const auto& [name, count] : seen) {
    if (name == "x" || name == "y") continue;
    least = std::min(least, count);
    most = std::max(most, count);
  }
  EXPECT_LE(most - least, 1);
  EXPECT_GT(least, 1);
}

TEST_F(WebFeed, OneAxisAndItsResponseForThoseWhoWatchIt) {
  std::map<FeedEvent::Kind, int> counts;
  for (int i = 0; i < 20; ++i) {
    backend.set({an_axis("x", i)});
    for (const auto& event : round({"x", "nowhere"})) {
      ++counts[event.kind];
      EXPECT_EQ(event.axis, event.kind == FeedEvent::Kind::frame ? "" : "x");
    }
  }
  EXPECT_EQ(counts[FeedEvent::Kind::frame], 20);
  EXPECT_EQ(counts[FeedEvent::Kind::axis], 20);
  EXPECT_EQ(counts[FeedEvent::Kind::response], 4);
  for (int i = 0; i < 20; ++i)
    for (const auto& event : round({"x"})) EXPECT_EQ(event.kind, FeedEvent::Kind::frame);  // nothing is new
}

TEST_F(WebFeed, EventsAreAsDescribed) {
  const test::OpenApi api;
  auto axis = an_axis("x");
  axis.worst_alarm = AxisStatus::Worst{Severity::medium, "friction rose"};
  const std::map<FeedEvent::Kind, std::string> schemas = {{FeedEvent::Kind::frame, "Frame"},
                                                          {FeedEvent::Kind::axis, "AxisStatus"},
                                                          {FeedEvent::Kind::response, "AxisResponse"}};
  std::set<FeedEvent::Kind> seen;
  for (int i = 0; i < 5; ++i) {
    backend.set({axis});
    for (const auto& event : round({"x"})) {
      seen.insert(event.kind);
      const auto& name = schemas.at(event.kind);
      EXPECT_EQ(api.differs(data_of(event), api.schema(name), name), "");
    }
  }
  EXPECT_EQ(seen.size(), 3U);
  feed.alarm(an_alarm(1));
  EXPECT_EQ(api.differs(data_of(sent.back()), api.schema("Alarm"), "alarm"), "");
  auto notice = nlohmann::json::parse(notice_json(an_alarm(1), backend.events(1)->front()));
  notice["idempotency_key"] = "k";  // as publishers add it
  EXPECT_EQ(api.differs(notice, api.schema("Notice"), "notice"), "");
  EXPECT_EQ(notice["event"]["transition"], "raised");
  FeedEvent hello;
  hello.text = feed.begin("", 1.5).texts.back();
  EXPECT_EQ(api.differs(data_of(hello), api.schema("Hello"), "hello"), "");
}

TEST_F(WebFeed, AlarmsCanBeResumedFrom) {
  for (std::uint64_t i = 1; i <= 5; ++i) feed.alarm(an_alarm(i));
  const auto resumed = [&](const std::string& id) {
    const auto beginning = feed.begin(id, 0.0);
    const bool told = beginning.texts.back()->find(R"("resumed":true)") != std::string::npos;
    return told ? static_cast<int>(beginning.texts.size()) - 1 : -static_cast<int>(beginning.texts.size());
  };
  EXPECT_EQ(resumed("b007-3"), 2);
  EXPECT_EQ(resumed("b007-5"), 0);
  EXPECT_EQ(resumed("b007-0"), 5);
  for (const auto* id : {"", "b007-6", "b008-3", "b007", "b007-", "b007-x", "-3", "b007-3x", "3"})
    EXPECT_EQ(resumed(id), -1) << id;
  EXPECT_NE(feed.begin("b007-3", 0.0).texts[0]->find(R"("id":4)"), std::string::npos);
  for (std::uint64_t i = 6; i <= Feed::kRemembered + 3; ++i) feed.alarm(an_alarm(i));
  EXPECT_EQ(resumed("b007-2"), -1);  // the third of them is forgotten
  EXPECT_EQ(resumed("b007-3"), static_cast<int>(Feed::kRemembered));
}

}  // namespace
}  // namespace resonid::monitor::web
