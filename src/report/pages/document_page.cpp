// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <resonid/report/detail/document.hpp>
#include <resonid/report/detail/page.hpp>

#include "report/document/document_cells.hpp"
#include "report/pages/html.hpp"
#include "report/pages/page_template.hpp"

namespace resonid::report {
namespace {

using nlohmann::json;

constexpr std::string_view kTitleOfDiscrepancies = "Where the paper contradicts itself, and what was taken";

std::string heading_row(std::initializer_list<std::pair<std::string_view, bool>> names) {
  std::string out = "<thead><tr>";
  for (const auto& [name, numeric] : names)
    out.append(numeric ? "<th scope=\"col\" class=\"n\">" : "<th scope=\"col\">")
        .append(name)
        .append("</th>");
  return out + "</tr></thead>\n";
}

std::string comparison_table(const ComparisonTable& table) {
  const auto rows = cells_of(table, kPlusMinus);
  std::string out =
      element("<h3>", html(table.title), "h3") + "\n<div class=\"scroll\"><table class=\"comparison\">\n";
  out += heading_row(
      {{"Quantity", false}, {"Published", true}, {"Reproduced", true}, {"True", true}, {"Note", false}});
  out += "<tbody>\n";
  const auto number = [](const std::string& text) {
    return element("<td class=\"n\">",
                   text.empty() ? "<span class=\"soft\">\xE2\x80\x93</span>" : figure(text), "td");
  };
  for (const Cells& c : rows) {
    out += "<tr>" + element("<th scope=\"row\">", escape_html(c.quantity), "th") + number(c.published) +
           number(c.reproduced) + number(c.truth) +
           element("<td class=\"note\">", escape_html(c.note), "td") + "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string discrepancy_table(const std::vector<Discrepancy>& list) {
  std::string out = "<div class=\"scroll\"><table class=\"discrepancies\">\n";
  out += heading_row({{"Place", false}, {"Printed", false}, {"Taken", false}, {"Why", false}}) + "<tbody>\n";
  // On a phone a row's cells stand below each other; each then shows its column's name.
  for (const auto& d : list)
    out += "<tr>" + element("<th scope=\"row\">", html(d.place), "th") +
           element("<td data-name=\"Printed\">", html(d.printed), "td") +
           element("<td data-name=\"Taken\">", html(d.taken), "td") +
           element("<td data-name=\"Why\">", html(d.reason), "td") + "</tr>\n";
  return out + "</tbody></table></div>\n";
}

/// A chart's place; the script draws into it.
std::string chart_place(const Chart& chart, std::size_t number) {
  return "<figure data-chart=\"" + std::to_string(number) + "\">\n" +
         element("<h3>", html(chart.title), "h3") +
         "\n<noscript><p class=\"soft\">The chart needs JavaScript.</p></noscript>\n" +
         (chart.caption.empty() ? "" : element("<figcaption>", html(chart.caption), "figcaption") + "\n") +
         "</figure>\n";
}

std::string contents(const Document& document) {
  std::string out = "<nav class=\"contents\" aria-label=\"Contents\"><ol>\n";
  for (std::size_t i = 0; i < document.sections.size(); ++i)
    out += "<li><a href=\"#part-" + std::to_string(i + 1) + "\">" + html(document.sections[i].title) +
           "</a></li>\n";
  if (!document.discrepancies.empty())
    out.append("<li><a href=\"#discrepancies\">").append(kTitleOfDiscrepancies).append("</a></li>\n");
  return out + "</ol></nav>\n";
}

std::string badge(const Badge& b) {
  const std::string kind = b.good ? "good" : b.warning ? "warning" : "bad";
  return "<div class=\"verdict " + kind + "\" role=\"status\"><svg aria-hidden=\"true\"><use href=\"#sign-" +
         (b.good ? "good" : "bad") + "\"/></svg><div><b>" + html(b.word) + "</b><span>" + html(b.reason) +
         "</span></div></div>\n";
}

std::string cards(const std::vector<Card>& list) {
  std::string out = "<dl class=\"figures\" style=\"--count:" + std::to_string(list.size()) + "\">\n";
  for (const Card& c : list) {
    const bool word = !c.value.empty() && c.value.find_first_of("0123456789") == std::string::npos;
    out += "<div class=\"figure\" style=\"--accent:var(--model)\">" + element("<dt>", html(c.name), "dt");
    out += std::string("<dd><div class=\"value") + (word ? " word" : "") + "\"><span>" +
           with_sign(figure(c.value), kPlusMinus) + "</span>" +
           (c.unit.empty() ? "" : " <small>" + html(c.unit) + "</small>") + "</div>";
    for (const auto& line : c.under) out += element("<div class=\"under\">", html(line), "div");
    out += "</dd></div>\n";
  }
  return out + "</dl>\n";
}

std::string head(const Document& document) {
  std::string out = "<header class=\"head\">\n<div><div class=\"brand\">resonid \xC2\xB7 " +
                    html(document.kind) + "</div>\n";
  out += element("<h1>", html(document.title), "h1") + "\n";
  std::string facts;
  for (const auto& fact : document.facts) facts += (facts.empty() ? "" : " \xC2\xB7 ") + html(fact);
  if (!facts.empty()) out += element("<p class=\"meta\">", facts, "p") + "\n";
  if (!document.command.empty())
    out += "<p class=\"soft small\">Made by <code>" + escape_html(document.command) + "</code></p>\n";
  if (document.seeds > 0) out += element("<p class=\"soft small\">", html(legend_of(document)), "p") + "\n";
  return out + "</div>\n" + (document.badge ? badge(*document.badge) : "") + "</header>\n";
}

/// Beside each other where both are short: what it comes to, and what to know of it.
std::string summary_and_findings(const Document& document) {
  if (!document.findings) {
    if (document.summary.empty()) return "";
    const bool plain = document.cards.empty();
    std::string out = plain ? "<section class=\"summary-box\">\n"
                            : "<section class=\"sheet\"><h2>Summary</h2>\n<ul class=\"summary\">\n";
    for (const auto& text : document.summary)
      out += plain ? element("<p>", html(text), "p") + "\n" : element("<li>", html(text), "li") + "\n";
    return out + (plain ? "</section>\n" : "</ul></section>\n");
  }
  const bool none = document.findings->empty();
  const bool both = !document.summary.empty() && !none && document.findings->size() <= 3;
  std::string out = std::string("<div class=\"split") + (both ? " two" : "") + "\">\n";
  if (!document.summary.empty()) {
    out += "<section class=\"sheet\"><h2>Summary</h2>\n<ul class=\"summary\">\n";
    for (const auto& text : document.summary) out += element("<li>", html(text), "li") + "\n";
    out += "</ul>";
    if (none) out += "<p class=\"explain none\">Findings: none, every check passed.</p>";
    out += "</section>\n";
    if (none) return out + "</div>\n";
  }
  return out + findings_box(*document.findings) + "</div>\n";
}

std::string section_html(const Section& s, std::size_t number, std::size_t& charts) {
  std::string out =
      "<section id=\"part-" + std::to_string(number) + "\"" + (s.sheet ? " class=\"sheet\"" : "") + ">\n";
  out += s.folded ? "<details><summary>" + html(s.title) + "</summary>\n"
                  : element("<h2>", html(s.title), "h2") + "\n";
  for (const auto& text : s.text) out += element("<p class=\"explain\">", html(text), "p") + "\n";
  if (s.side_by_side) out += "<div class=\"pair\">\n";
  for (const auto& chart : s.charts) out += chart_place(chart, charts++);
  for (const auto& list : s.intervals) out += interval_table(list);
  if (s.side_by_side) out += "</div>\n";
  for (const auto& table : s.tables) out += comparison_table(table);
  for (const auto& table : s.plain_tables) out += plain_table(table);
  return out + (s.folded ? "</details></section>\n" : "</section>\n");
}

std::string body(const Document& document) {
  std::string out = head(document);
  if (!document.cards.empty()) out += cards(document.cards);
  out += summary_and_findings(document);
  if (document.cards.empty() && document.sections.size() > 1) out += contents(document);
  std::size_t charts = 0;
  for (std::size_t i = 0; i < document.sections.size(); ++i)
    out += section_html(document.sections[i], i + 1, charts);
  if (!document.discrepancies.empty())
    out += "<section id=\"discrepancies\">\n" + element("<h2>", std::string(kTitleOfDiscrepancies), "h2") +
           "\n" + discrepancy_table(document.discrepancies) + "</section>\n";
  if (document.provenance) out += provenance_box(*document.provenance);
  return out;
}

/// Seven digits are more than any picture shows.
void shorten(json& values, int digits = 7) {
  for (json& v : values) {
    if (!v.is_number_float() || !std::isfinite(v.get<double>())) continue;
    char text[40];
    std::snprintf(text, sizeof text, "%.*g", digits, v.get<double>());
    v = std::strtod(text, nullptr);
  }
}

/// The charts of all sections in the order of their places, each with the number of its section.
json charts_json(const Document& document) {
  const json whole = document_json(document);
  json charts = json::array();
  std::size_t number = 0;
  for (const json& section : whole["sections"]) {
    for (json chart : section["charts"]) {
      for (json& curve : chart["curves"])
        for (const char* key : {"x", "y", "at", "lower", "upper"})
          if (curve.contains(key)) shorten(curve[key]);
      if (chart.contains("map"))
        for (json& line : chart["map"]["value"]) shorten(line, 4);
      chart["section"] = number;
      charts.push_back(std::move(chart));
    }
    ++number;
  }
  return charts;
}

}  // namespace

std::string document_page(const Document& document) {
  const std::string title = repaired(html(document.title));
  const std::string content = repaired(body(document));
  const std::string data = script_json(charts_json(document));
  return fill(page_template(), {{"title", title}, {"content", content}, {"data", data}});
}

}  // namespace resonid::report
