// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <resonid/report/detail/document.hpp>
#include <resonid/report/detail/provenance.hpp>
#include <string>

#include "page_data.hpp"

namespace resonid::report {
namespace {

using nlohmann::json;

Document example() {
  Document d;
  d.title = "Publication X";
  d.command = "resonid reproduce x";
  d.summary = {"It holds within +-2 %."};
  Section s;
  s.title = "Margins";
  s.text = {"- a dash, a | bar and iv_multisine_a"};
  s.tables = {{"Table 1",
               {{"phase margin", "deg", 63.5, 61.6412, 2.9187, 59.9, "reading: +-1 deg"},
                {"ripple", "", std::nullopt, 5.4e-12, std::nullopt, 0.0, ""}}}};
  Chart line{"Figure 1", "time (s)", "speed (rad/s)", false, false, {}, "A caption.", "Hz"};
  line.curves = {{"measured", Curve::Mark::line, {0.0, 1.0, 2.0}, {1.0 / 3.0, std::nan(""), 3.0}, {}}};
  Chart plane{"Figure 2", "re", "im", false, true, {}, "", "Hz"};
  plane.curves = {{"loop", Curve::Mark::points, {1.0, -1.0}, {0.0, 2.0}, {5.0, 6.0}}};
  s.charts = {line, plane};
  d.sections = {s};
  d.discrepancies = {{"Table 2.1", "20.4 Hz", "19.6 Hz", "follows from its own <parameters>"}};
  return d;
}

TEST(DocumentPage, ShowsTextAndTablesWithoutScripts) {
  const std::string html = document_page(example());
  const std::string still = html.substr(0, html.find("<script"));
  for (const char* part :
       {"<title>Publication X</title>", "<h1>Publication X</h1>", "<code>resonid reproduce x</code>",
        "It holds within \u00B12 %.", "<h2>Margins</h2>", "<h3>Table 1</h3>", "phase margin (deg)",
        "<td class=\"n\">63.5</td>", "61.6 \xC2\xB1 2.9</td>", "<td class=\"n\">5.4e-12</td>",
        "<td class=\"n\">0</td>", "<h3>Figure 1</h3>", "<figcaption>A caption.</figcaption>",
        "follows from its own &lt;parameters&gt;", "<td data-name=\"Printed\">20.4 Hz</td>"})
    EXPECT_NE(still.find(part), still.npos) << part;
  EXPECT_EQ(count(still, "<figure data-chart="), 2U);
}

TEST(DocumentPage, CarriesTheChartsWithSevenDigits) {
  const json charts = carried(document_page(example()));
  ASSERT_EQ(charts.size(), 2U);
  EXPECT_EQ(charts[0]["curves"][0]["y"], json::parse("[0.3333333, null, 3.0]"));
  EXPECT_EQ(charts[1]["curves"][0]["at"], json::parse("[5.0, 6.0]"));
  EXPECT_EQ(charts[1]["equal_axes"], true);
  EXPECT_EQ(charts[1]["section"], 0);
}

TEST(Document, CarriesBandsRegionsRangesAndPlainTables) {
  const double inf = std::numeric_limits<double>::infinity();
  Document d = example();
  d.kind = "tracking";
  Section& s = d.sections[0];
  s.charts[0].curves[0].lower = {0.0, std::nan(""), 2.0};
  s.charts[0].curves[0].upper = {1.0, std::nan(""), 4.0};
  s.charts[0].shapes = {{Shape::Kind::rectangle, "not trusted", 0.5, -inf, 0.0, 1.5, inf}};
  s.charts[0].y_range = AxisRange{-1.0, 5.0};
  s.charts[1].shapes = {{Shape::Kind::circle, "unit circle", 0.0, 0.0, 1.0}};
  s.plain_tables = {
      {"Found", {"what", "value", "note"}, {{"resonance", "-15.1 +- 0.2", "a | b"}, {"gap", "", ""}}}};
  const json whole = document_json(d);
  const json& line = whole["sections"][0]["charts"][0];
  EXPECT_EQ(line["curves"][0]["upper"][2], 4.0);
  EXPECT_EQ(line["shapes"][0]["x_end"], 1.5);
  EXPECT_EQ(line["y_range"], json::parse("[-1.0, 5.0]"));
  EXPECT_EQ(whole["sections"][0]["charts"][1]["shapes"][0]["radius"], 1.0);
  EXPECT_EQ(whole["sections"][0]["plain_tables"][0]["rows"][1][0], "gap");
  const std::string html = document_page(d);
  EXPECT_NE(html.find("resonid \xC2\xB7 tracking"), html.npos);
  EXPECT_NE(html.find("<td class=\"n\">\xE2\x88\x92"
                      "15.1 \xC2\xB1 0.2</td>"),
            html.npos);
  EXPECT_EQ(carried(html)[0]["shapes"][0]["y"], nullptr);
  EXPECT_NE(document_markdown(d).find("| resonance | -15.1 \xC2\xB1 0.2 | a \\| b |"), std::string::npos);
  EXPECT_NE(document_text(d).find("  resonance  -15.1 +- 0.2  a | b\n"), std::string::npos);
}

TEST(Document, IsAsBeforeWithoutThem) {
  const json chart = document_json(example())["sections"][0]["charts"][0];
  for (const char* key : {"shapes", "x_range", "y_range"}) EXPECT_FALSE(chart.contains(key)) << key;
  EXPECT_FALSE(chart["curves"][0].contains("lower"));
  EXPECT_FALSE(document_json(example())["sections"][0].contains("plain_tables"));
}

TEST(DocumentPage, HostileTextCannotLeaveItsPlace) {
  const std::string hostile = "</script><!--<script>alert(1)</script>{{data}}{{content}}\xFF&'\"";
  Document d = example();
  const std::string plain = document_page(d);
  d.title = d.command = d.summary[0] = hostile;
  Section& s = d.sections[0];
  s.title = s.text[0] = s.tables[0].title = s.charts[0].title = s.charts[0].caption = hostile;
  s.charts[0].x_label = s.charts[0].y_label = s.charts[0].curves[0].name = s.charts[1].at_unit = hostile;
  s.tables[0].rows[0].quantity = s.tables[0].rows[0].unit = s.tables[0].rows[0].note = hostile;
  d.discrepancies[0] = {hostile, hostile, hostile, hostile};
  const std::string html = document_page(d);
  for (const char* part : {"<script", "</script", "<!--", "<table", "<figure"})
    EXPECT_EQ(count(html, part), count(plain, part)) << part;
  EXPECT_EQ(html.find('\xFF'), html.npos);
  EXPECT_EQ(carried(html)[0]["curves"][0]["name"],
            "</script><!--<script>alert(1)</script>{{data}}{{content}}\xEF\xBF\xBD&'\"");
}

TEST(DocumentPage, LoadsNothingFromAnywhereAndFillsEveryPlace) {
  const std::string html = document_page(example());
  EXPECT_EQ(html.find("http://"), html.npos);
  EXPECT_EQ(html.find("https://"), html.npos);
  const std::string shown = html.substr(0, html.find("<script"));
  for (const char* loader : {"<link", "<img", "<iframe", "<object", "@import", "url("})
    EXPECT_EQ(shown.find(loader), std::string::npos) << loader;
  EXPECT_NE(html.find("default-src 'none'"), html.npos);
  for (const char* place : {"{{title}}", "{{content}}", "{{data}}", "{{style}}", "{{script}}"})
    EXPECT_EQ(html.find(place), html.npos) << place;
  EXPECT_NE(html.find("Copyright (c) 2022 Leon Sorokin"), html.npos);  // uPlot's licence asks for it
}

TEST(DocumentPage, AnEmptyDocumentIsAPage) {
  const std::string html = document_page({});
  EXPECT_NE(html.find("</html>"), html.npos);
  EXPECT_EQ(carried(html), json::array());
}

TEST(DocumentMarkdown, SaysHowItIsMadeAndKeepsTheTables) {
  EXPECT_EQ(document_markdown(example()),
            "# Publication X\n\n"
            "Made by\n\n    resonid reproduce x\n\n"
            "It holds within \xC2\xB1"
            "2 %.\n\n"
            "## Margins\n\n"
            "\\- a dash, a \\| bar and iv_multisine_a\n\n"
            "### Table 1\n\n"
            "| quantity | published | reproduced | true | note |\n"
            "|:--|--:|--:|--:|:--|\n"
            "| phase margin (deg) | 63.5 | 61.6 \xC2\xB1 2.9 | 59.9 | reading: \xC2\xB1"
            "1 deg |\n"
            "| ripple | | 5.4e-12 | 0 | |\n\n"
            "## Where the paper contradicts itself, and what was taken\n\n"
            "| place | printed | taken | why |\n|:--|:--|:--|:--|\n"
            "| Table 2.1 | 20.4 Hz | 19.6 Hz | follows from its own \\<parameters> |\n");
}

TEST(DocumentText, AlignsColumnsAndWrapsAtHundred) {
  Document d = example();
  d.sections[0].tables[0].rows[1].note = std::string(60, 'x') + " " + std::string(60, 'y');
  const std::string text = document_text(d);
  EXPECT_NE(text.find("  quantity            published   reproduced  true\n"
                      "  phase margin (deg)       63.5  61.6 +- 2.9  59.9  reading: +-1 deg\n"),
            text.npos)
      << text;
  EXPECT_NE(text.find("MARGINS\n"), text.npos);
  EXPECT_NE(text.find("    printed  20.4 Hz\n    taken    19.6 Hz\n"), text.npos) << text;
  std::size_t from = 0;
  while (from < text.size()) {
    const std::size_t end = text.find('\n', from);
    EXPECT_LE(end - from, 100U) << text.substr(from, end - from);
    from = end + 1;
  }
}

TEST(DocumentJson, LeavesOutWhatIsAbsent) {
  const json j = document_json(example());
  EXPECT_EQ(j["schema"], "resonid.document/1");
  const json& rows = j["sections"][0]["tables"][0]["rows"];
  EXPECT_EQ(rows[0], json::parse(R"({"quantity": "phase margin", "unit": "deg", "published": 63.5,
    "reproduced": 61.6412, "deviation": 2.9187, "true": 59.9, "note": "reading: +-1 deg"})"));
  EXPECT_EQ(rows[1], json::parse(R"({"quantity": "ripple", "reproduced": 5.4e-12, "true": 0.0})"));
  EXPECT_EQ(j["sections"][0]["charts"][1]["curves"][0]["mark"], "points");
  EXPECT_EQ(j["discrepancies"][0]["reason"], "follows from its own <parameters>");
  EXPECT_NE(j.dump().find("null"), std::string::npos);  // the gap of a curve
}

TEST(Document, TellsOfItsSeedsInEveryForm) {
  Document d = example();
  EXPECT_FALSE(document_json(d).contains("seeds"));
  EXPECT_EQ(document_page(d).find("seeds"), std::string::npos);
  d.seeds = 20;
  EXPECT_EQ(document_json(d).at("seeds"), 20);
  const std::string over = " are mean and standard deviation over 20 seeds of the noise";
  EXPECT_NE(document_markdown(d).find("\n\nFigures with \xC2\xB1" + over), std::string::npos);
  EXPECT_NE(document_text(d).find("\nFigures with +-" + over), std::string::npos);
  EXPECT_NE(document_page(d).find("Figures with \xC2\xB1" + over), std::string::npos);
}

TEST(DocumentMarkdown, ShowsNoDigitsOfRounding) {
  Document d = example();
  d.sections[0].tables[0].rows[1].rounding = 1e-9;
  EXPECT_NE(document_markdown(d).find("| ripple | | \\< 1e-09 | 0 | |"), std::string::npos);
  EXPECT_EQ(document_json(d)["sections"][0]["tables"][0]["rows"][1]["reproduced"], 5.4e-12);
  d.sections[0].tables[0].rows[1].reproduced = 2e-9;
  EXPECT_NE(document_markdown(d).find("| ripple | | 2e-09 | 0 | |"), std::string::npos);
}

/// Value, deviation and what a table says of them.
struct Rounding {
  double value;
  double deviation;
  const char* text;
};

TEST(DocumentMarkdown, EndsAValueWhereItsDeviationDoes) {
  for (const Rounding& r :
       {Rounding{0.311234, 0.00247, "0.3112 \xC2\xB1 0.0025"}, Rounding{12.0, 0.0996, "12.00 \xC2\xB1 0.10"},
        Rounding{1234.0, 120.0, "1234 \xC2\xB1 120"}, Rounding{-0.001, 0.5, "0.00 \xC2\xB1 0.50"},
        Rounding{2.0, 3e-12, "2 \xC2\xB1 3e-12"}, Rounding{2.5, 0.0, "2.5"}}) {
    Document d;
    d.sections = {{"s", {}, {{"t", {{"q", "", {}, r.value, r.deviation, {}, ""}}}}, {}}};
    EXPECT_NE(document_markdown(d).find(std::string("| q | | ") + r.text + " | | |"), std::string::npos)
        << r.text << "\n"
        << document_markdown(d);
  }
}

TEST(DocumentPage, TellsVerdictAndFiguresFirst) {
  Document d = example();
  EXPECT_EQ(document_page(d).find("role=\"status\"><svg"), std::string::npos);  // a script has none in place
  EXPECT_FALSE(document_json(d).contains("badge"));
  EXPECT_FALSE(document_json(d).contains("cards"));
  d.badge = Badge{false, "Rejected <b>", "see the findings"};
  d.cards = {{"Fit", "-12.5", "%", {"+- 0.3 at 95 %"}}, {"Resonance", "none"}};
  const std::string html = document_page(d);
  const std::size_t verdict = html.find("<div class=\"verdict bad\" role=\"status\"><svg");
  ASSERT_NE(verdict, html.npos);
  EXPECT_LT(verdict, html.find("<section"));
  EXPECT_NE(html.find("<b>Rejected &lt;b&gt;</b><span>see the findings</span>"), html.npos);
  EXPECT_NE(html.find("<span>\xE2\x88\x92"
                      "12.5</span> <small>%</small>"),
            html.npos);
  EXPECT_NE(html.find("\xC2\xB1 0.3 at 95 %"), html.npos);
  EXPECT_NE(html.find("<div class=\"value word\"><span>none</span></div>"), html.npos);
  const json j = document_json(d);
  EXPECT_EQ(j["badge"], (json{{"good", false}, {"word", "Rejected <b>"}, {"reason", "see the findings"}}));
  EXPECT_EQ(j["cards"][0]["under"], json::array({"+- 0.3 at 95 %"}));
}

TEST(DocumentPage, ShowsFindingsAsTheIdentificationDoes) {
  Document d = example();
  d.findings = {{{"low-coherence", diagnostics::Severity::warning, 0.4, 0.8, "Falls <b>."},
                 {"misfit", diagnostics::Severity::error, {}, {}, "It is not this drive."}}};
  const std::string html = document_page(d);
  const auto error = html.find("<span class=\"tag error\">Error</span>"),
             warning = html.find("<span class=\"tag warning\">Warning</span>");
  ASSERT_NE(error, html.npos);
  ASSERT_NE(warning, html.npos);
  EXPECT_LT(error, warning);  // what matters most first
  EXPECT_NE(
      html.find(
          "<b>Low coherence</b><p>Falls &lt;b&gt;.</p><p class=\"soft small\">found 0.4, limit 0.8</p>"),
      html.npos);
  EXPECT_LT(html.find("<h2>Findings</h2>"), html.find("id=\"part-1\""));
  EXPECT_EQ(document_json(d)["findings"][1]["severity"], "error");
  d.findings->clear();
  EXPECT_NE(document_page(d).find("Findings: none, every check passed."), html.npos);
}

TEST(DocumentPage, FoldsWideTablesByNamingEachCell) {
  Document d;
  d.sections = {
      {"s", {}, {}, {}, {{"t", {"Record", "verdict", "a, kgm2", "b"}, {{"x.csv", "trusted", "-1", "2"}}}}}};
  const std::string html = document_page(d);
  EXPECT_NE(html.find("<table class=\"plain fold\">"), html.npos);
  EXPECT_NE(html.find("<th scope=\"row\">x.csv</th><td data-name=\"verdict\">trusted</td>"
                      "<td class=\"n\" data-name=\"a, kg m\xC2\xB2\">\xE2\x88\x92"
                      "1</td>"),
            html.npos);
  d.sections[0].plain_tables[0].columns.resize(3);
  EXPECT_EQ(document_page(d).find("<table class=\"plain fold\">"), html.npos);
}

/// They are there to be compared.
TEST(DocumentPage, LeavesTablesOfNumbersTogether) {
  Document d;
  d.sections = {
      {"s",
       {},
       {},
       {},
       {{"t", {"figure", "value", "bound", "worst"}, {{"|S|", "1.3", "1.4", "1.4"}, {"IAE", "2", "", ""}}}}}};
  EXPECT_NE(document_page(d).find("<table class=\"plain fold numbers\">"), std::string::npos);
}

TEST(DocumentPage, DrawsIntervalsOnOneScaleThatDoubtfulRowsDoNotWiden) {
  Document d;
  Section s;
  s.title = "Parameters";
  Intervals list{"stiffness", "Nm/rad", {{"a.csv", 100.0, 2.0}, {"b<.csv", 104.0, 2.0}},
                 102.0,       1.0,      "agrees"};
  s.intervals = {list};
  d.sections = {s};
  const std::string html = document_page(d);
  // The scale is 98 ... 106 with 6 % of room: 97.52 ... 106.48.
  EXPECT_NE(html.find("<i class=\"dot\" style=\"left:27.68%\">"), html.npos);
  EXPECT_NE(html.find("<i class=\"whisker\" style=\"left:5.36%;width:44.64%\">"), html.npos);
  EXPECT_NE(html.find("b&lt;.csv"), html.npos);
  EXPECT_NE(html.find("100.0 \xC2\xB1 2.0"), html.npos);
  d.sections[0].intervals[0].rows.push_back({"broken.csv", 9000.0, 50.0, true});
  const std::string wider = document_page(d);
  EXPECT_NE(wider.find("<i class=\"dot\" style=\"left:27.68%\">"), wider.npos);
  EXPECT_NE(wider.find("<tr class=\"doubtful\">"), wider.npos);
  EXPECT_NE(wider.find("<i class=\"dot\" style=\"left:100.00%\">"), wider.npos);
  EXPECT_EQ(document_json(d)["sections"][0]["intervals"][0]["mean"], 102.0);
}

TEST(DocumentPage, CarriesAHeatMapWithItsGaps) {
  Document d;
  Chart chart;
  chart.title = "waterfall";
  chart.map = HeatMap{{0.0, 1.0}, {2.0, 3.0}, {{-1.23456, 0.0}, {std::nan(""), 4.0}}, "dB"};
  d.sections = {{"s", {}, {}, {chart}}};
  const json shown = carried(document_page(d)).at(0).at("map");
  EXPECT_EQ(shown.at("value"), json::parse("[[-1.235, 0.0], [null, 4.0]]"));
  EXPECT_EQ(shown.at("unit"), "dB");
}

TEST(DocumentPage, EndsWithWhatItWasMadeBy) {
  Document d = example();
  EXPECT_EQ(document_page(d).find("<h2>Provenance</h2>"), std::string::npos);
  d.provenance = Provenance{"0.1.0",
                            "resonid validate 'a <b>.json' c.csv",
                            "2026-03-01T12:00:00Z",
                            {{"c.csv", std::string(64, 'a')}, {"-", ""}}};
  const std::string html = document_page(d);
  for (const char* part :
       {"resonid 0.1.0", "2026-03-01T12:00:00Z", "a &lt;b&gt;.json", "SHA-256 aaaa", "not a file"})
    EXPECT_NE(html.find(part), html.npos) << part;
  EXPECT_EQ(provenance_of(document_json(d))->files[0].sha256, std::string(64, 'a'));
}

TEST(Provenance, StandsBesideAResultAndMayBeAbsent) {
  json result{{"schema", "resonid.track/1"}, {"rows", 3}};
  EXPECT_FALSE(provenance_of(result));
  put_provenance(result, {"0.1.0", "resonid track a.csv", "2026-03-01T12:00:00Z", {{"a.csv", "12"}}});
  EXPECT_EQ(result.at("rows"), 3);
  EXPECT_EQ(result.at("provenance").at("command"), "resonid track a.csv");
  const auto read = provenance_of(result);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->files[0].name, "a.csv");
  result["provenance"] = "somebody";
  EXPECT_FALSE(provenance_of(result));
}

}  // namespace
}  // namespace resonid::report
