// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <resonid/report/detail/page.hpp>
#include <string>

#include "page_data.hpp"

namespace resonid::report {
namespace {

using nlohmann::json;

json column(std::size_t n, double from, double step) {
  json out = json::array();
  for (std::size_t i = 0; i < n; ++i) out.push_back(from + step * static_cast<double>(i) + 1.0 / 3.0);
  return out;
}

json full_result() {
  return json::parse(R"({"record": {"file": "a.csv", "samples": 10},
    "resonances": [{"kind": "resonance", "frequency_hz": 15.086123, "std_hz": 0.0212}],
    "loop": {"phase_margin_deg": 63.5}, "trusted": false,
    "model": {"parameters": {"stiffness": {"value": 143.75, "std": 0.4, "unit": "Nm/rad"}}},
    "page": {"title": "bench", "summary": ["It resonates."]}})");
}

TEST(Page, HostileTextCannotLeaveItsPlace) {
  const std::string hostile = "</script><!--<script>alert(1)</script>{{data}}{{title}}\xE2\x80\xA8&'\"";
  const std::string plain = page(full_result());
  json data = full_result();
  data["record"]["file"] = hostile;
  data["page"]["title"] = hostile;
  data["page"]["summary"] = {hostile};
  data["resonances"][0]["kind"] = hostile;
  data["model"]["parameters"] = {{hostile, {{"value", 1.0}, {"unit", hostile}}}};
  data["findings"] = {{{"id", hostile}, {"meaning", hostile}}};
  const std::string html = page(data);
  for (const char* part : {"<script", "</script", "<!--", "<table"})
    EXPECT_EQ(count(html, part), count(plain, part)) << part;
  EXPECT_EQ(count(html, "alert(1)"), count(html, "alert(1)&lt;") + count(html, "alert(1)\\u003c"));
  EXPECT_EQ(carried(html), data);  // and nothing of it is lost
}

TEST(Page, BytesThatAreNotUtf8AreReplaced) {
  json data;
  data["page"]["title"] = "a\xFFz";
  data["page"]["summary"] = {"b\xC3"};
  data["record"]["file"] = "\xFE.csv";
  const std::string html = page(data);
  EXPECT_NE(html.find("<title>a\xEF\xBF\xBDz</title>"), html.npos);
  EXPECT_EQ(carried(html)["record"]["file"], "\xEF\xBF\xBD.csv");
  EXPECT_EQ(html.find('\xFF'), html.npos);
  EXPECT_EQ(html.find('\xFE'), html.npos);
}

TEST(Page, LoadsNothingFromAnywhere) {
  const std::string html = page(full_result());
  EXPECT_EQ(html.find("http://"), html.npos);
  EXPECT_EQ(html.find("https://"), html.npos);
  EXPECT_FALSE(std::regex_search(html.substr(0, html.find(kOpen)),
                                 std::regex("<(link|img|iframe|object)[ >]|@import|url\\(")));
  EXPECT_EQ(html.find("<script src"), html.npos);
  EXPECT_NE(html.find("default-src 'none'"), html.npos);
}

TEST(Page, FillsEveryPlaceOfTheTemplate) {
  const std::string html = page(full_result());
  for (const char* place : {"{{title}}", "{{content}}", "{{data}}", "{{style}}", "{{script}}"}) {
    EXPECT_EQ(html.find(place), html.npos) << place;
  }
  EXPECT_NE(html.find("<title>bench</title>"), html.npos);
  EXPECT_NE(html.find("Copyright (c) 2022 Leon Sorokin"), html.npos);  // uPlot's licence asks for it
}

TEST(Page, TellsTheFiguresWithoutScripts) {
  const std::string html = page(full_result());
  const std::size_t from = html.find("<noscript>");
  const std::string still = html.substr(from, html.find("</noscript>") - from);
  EXPECT_NE(still.find("<td>not trusted</td>"), still.npos);
  EXPECT_NE(still.find("15.086 (standard deviation 0.0212) Hz"), still.npos);
  EXPECT_NE(still.find("63.5 degrees"), still.npos);
  EXPECT_NE(still.find("143.75 (standard deviation 0.4) Nm/rad"), still.npos);
  EXPECT_NE(still.find("<p>It resonates.</p>"), still.npos);
}

TEST(Page, EveryKeyIsOptionalAndOfAnyType) {
  EXPECT_EQ(carried(page(json())), json::object());
  EXPECT_EQ(carried(page(json::array({1, 2}))), json::object());
  const json odd =
      json::parse(R"({"resonances": 3, "loop": [], "model": null, "trusted": "yes", "frequency_response":
    {"frequency_hz": [1, null], "real": 2}, "page": {"title": 5, "summary": [1], "signals": [], "units": null}})");
  EXPECT_EQ(carried(page(odd)), odd);
  EXPECT_EQ(carried(page(json{{"page", 7}})), json::object());
}

TEST(Page, KeepsResultsExactAndCurvesToSevenDigits) {
  json data;
  data["frequency_response"]["real"] = {0.123456789012345};
  data["page"]["model_curve"]["real"] = {0.123456789012345, -1.0e-9 / 3.0, nullptr};
  const json shown = carried(page(data));
  EXPECT_EQ(shown["frequency_response"]["real"][0], 0.123456789012345);
  EXPECT_EQ(shown["page"]["model_curve"]["real"], json::parse("[0.1234568, -3.333333e-10, null]"));
}

TEST(Page, StaysBelowItsLimitAndSaysWhatItLeftOut) {
  constexpr std::size_t kLines = 65535;
  constexpr std::size_t kBins = 50000;
  json data;
  auto& response = data["frequency_response"];
  for (const char* key : {"real", "imag", "std", "coherence"}) response[key] = column(kLines, 0.1, 1.0 / 7.0);
  response["frequency_hz"] = column(kLines, 0.0, 0.01);
  response["unsettled_hz"] = {0.5};
  auto& signals = data["page"]["signals"];
  signals["time_s"] = column(kBins, 0.0, 0.001);
  signals["channels"] = {{{"min", column(kBins, -1.0, 1e-5)}, {"max", column(kBins, 1.0, 1e-5)}}};
  data["page"]["residual"] = {{"time_s", column(kBins, 0.0, 0.001)}, {"min", column(kBins, -2.0, 0.0)}};

  const std::string html = page(data);
  EXPECT_LT(html.size(), kPageBytes);
  const json shown = carried(html);
  const json& lines = shown["frequency_response"]["frequency_hz"];
  EXPECT_EQ(shown["page"]["reduced"]["lines_total"], kLines);
  EXPECT_EQ(shown["page"]["reduced"]["lines_shown"], lines.size());
  EXPECT_GT(lines.size(), 500U);
  EXPECT_EQ(shown["frequency_response"]["std"].size(), lines.size());
  EXPECT_EQ(shown["frequency_response"]["unsettled_hz"], response["unsettled_hz"]);
  // An envelope stays an envelope: its extremes survive the merging.
  const json& channel = shown["page"]["signals"]["channels"][0];
  EXPECT_EQ(channel["min"].size(), shown["page"]["signals"]["time_s"].size());
  EXPECT_NEAR(channel["min"].front().get<double>(), -1.0 + 1.0 / 3.0, 1e-6);
  EXPECT_NEAR(channel["max"].back().get<double>(), 1.0 + 1e-5 * (kBins - 1) + 1.0 / 3.0, 1e-6);
  EXPECT_EQ(shown["page"]["residual"]["max"].size(), shown["page"]["residual"]["time_s"].size());
}

TEST(EscapeHtml, CoversTextAndAttributes) {
  EXPECT_EQ(escape_html("<a href=\"x\" title='y'>&amp;</a>"),
            "&lt;a href=&quot;x&quot; title=&#39;y&#39;&gt;&amp;amp;&lt;/a&gt;");
}

}  // namespace
}  // namespace resonid::report
