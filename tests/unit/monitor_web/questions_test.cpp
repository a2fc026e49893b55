// SPDX-License-Identifier: MIT
#include "monitor/web/questions.hpp"

#include <gtest/gtest.h>

#include "monitor/web/api_json.hpp"
#include "monitor/web/framing.hpp"

namespace resonid::monitor::web {
namespace {

TEST(WebQuestions, NamesOfAxes) {
  for (const auto* good : {"x", "line-1.axis_2", "A", "..x", "0"}) EXPECT_TRUE(is_axis_name(good)) << good;
  for (const auto* bad : {"", ".", "..", "a b", "a/b", "\xc3\xa4", "a\n"})
    EXPECT_FALSE(is_axis_name(bad)) << bad;
  EXPECT_TRUE(is_axis_name(std::string(64, 'a')));
  EXPECT_FALSE(is_axis_name(std::string(65, 'a')));
  EXPECT_FALSE(is_axis_name(std::string_view("a\0b", 3)));
}

TEST(WebQuestions, EveryFigureHasAKeyOfItsOwn) {
  for (const auto& [figure, name] : monitoring::kWatchedNames)
    EXPECT_EQ(figure_of(key_of(figure)), figure) << name;
  EXPECT_FALSE(figure_of("driven-inertia"));
}

TEST(WebQuestions, AHistoryIsTheLastHourUnlessToldOtherwise) {
  const auto question = history_question({}, 10'000.0);
  ASSERT_TRUE(question);
  EXPECT_EQ(question->from_s, 6400.0);
  EXPECT_EQ(question->to_s, 10'000.0);
  EXPECT_EQ(question->points, 1000U);
}

TEST(WebQuestions, TimesAreWhatNanosecondsCanTell) {
  EXPECT_TRUE(history_question({{"to", "9000000000"}}, 10'000.0));
  const auto later = history_question({{"to", "32503680000"}}, 10'000.0);
  ASSERT_FALSE(later);
  EXPECT_EQ(later.error().kind, Problem::Kind::invalid);
}

TEST(WebQuestions, AlarmsAndAuditAreOfAllTimeUnlessToldOtherwise) {
  const auto all = alarm_question({});
  ASSERT_TRUE(all);
  EXPECT_EQ(all->from_s, 0.0);
  EXPECT_EQ(all->to_s, kLastTime_s);
  const auto some = alarm_question({{"from", "10"}, {"to", "20"}});
  ASSERT_TRUE(some);
  EXPECT_EQ(some->from_s, 10.0);
  EXPECT_EQ(some->to_s, 20.0);
  const auto audit = audit_question({{"to", "20"}, {"limit", "7"}});
  ASSERT_TRUE(audit);
  EXPECT_EQ(audit->limit, 7U);
  EXPECT_EQ(audit->to_s, 20.0);
  EXPECT_FALSE(audit_question({{"axis", "x"}}));
  EXPECT_FALSE(alarm_question({{"from", "20"}, {"to", "20"}}));
}

TEST(WebQuestions, AnEndIsATimeOrADuration) {
  const auto until = [](const char* body) {
    const auto action = action_of(ActionKind::shelve, body, 1000.0);
    return action ? action->until_time_s : -1.0;
  };
  EXPECT_EQ(until(R"({"who":"a","reason":"b","seconds":60})"), 1060.0);
  EXPECT_EQ(until(R"({"who":"a","reason":"b","until_time_s":1500})"), 1500.0);
  EXPECT_EQ(until(R"({"who":"a","reason":"b","until_time_s":999})"), -1.0);
  for (const bool seconds : {true, false}) {
    const auto* const end = seconds ? R"({"who":"a","reason":"b","seconds":60})"
                                    : R"({"who":"a","reason":"b","until_time_s":1500})";
    EXPECT_EQ(action_of(ActionKind::shelve, end, 1000.0)->in_seconds, seconds);
  }
}

TEST(WebQuestions, TextsAreAsLongAsTheirCharacters) {
  std::string name;
  const auto taken = [&] {
    return action_of(ActionKind::acknowledge, R"({"who":")" + name + R"("})", 1000.0).has_value();
  };
  for (int i = 0; i < 200; ++i) name += "\xc3\xbc";
  EXPECT_TRUE(taken());
  name += "a";
  EXPECT_FALSE(taken());
}

TEST(WebQuestions, WhereARequestEnds) {
  const WebLimits limits{.head_bytes = 200, .body_bytes = 100};
  const auto size = [&](const std::string& text) { return request_size(text, limits); };
  EXPECT_EQ(size("GET / HTTP/1.1\r\nHost: a\r\n").head, 0U);
  EXPECT_EQ(size("GET / HTTP/1.1\r\nHost: a\r\n").refusal, 0);
  const std::string get = "GET / HTTP/1.1\r\nHost: a\r\n\r\n";
  EXPECT_EQ(size(get + "GET").head, get.size());
  EXPECT_EQ(size(get + "GET").body, 0U);
  EXPECT_EQ(size("POST / HTTP/1.1\r\ncontent-LENGTH:\t7 \r\n\r\n").body, 7U);
  EXPECT_EQ(size("GET / HTTP/1.1\r\n\r\n").head, 18U);
  const auto refusal = [&](const std::string& header) {
    return size("POST / HTTP/1.1\r\n" + header + "\r\n\r\n").refusal;
  };
  EXPECT_EQ(refusal("Content-Length: 100"), 0);
  EXPECT_EQ(refusal("Content-Length: 101"), 413);
  EXPECT_EQ(refusal("Content-Length: 99999999999999999999999"), 413);
  for (const auto* bad : {"Content-Length: -1", "Content-Length: 0x10",
                          "Content-Length:", "Content-Length: 1\r\nContent-Length: 1", "Content-Length: 1, 1",
                          "Content-Length : 1", " folded", "no colon", ": no name", "a\nb: c"})
    EXPECT_EQ(refusal(bad), 400) << bad;
  EXPECT_EQ(size(std::string("GET / HTTP/1.1\r\nA: \0\r\n\r\n", 25)).refusal, 400);
  EXPECT_EQ(refusal("Transfer-Encoding: chunked"), 411);
  EXPECT_EQ(size(std::string(201, 'a')).refusal, 431);
  EXPECT_EQ(size("GET / HTTP/1.1\r\nA: " + std::string(200, 'a') + "\r\n\r\n").refusal, 431);
}

}  // namespace
}  // namespace resonid::monitor::web
