// SPDX-License-Identifier: MIT
#include "report/pages/html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <resonid/diagnostics/detail/finding_catalogue.hpp>
#include <resonid/report/detail/page.hpp>
#include <utility>

#include "report/document/document_cells.hpp"
#include "report/document/words.hpp"

namespace resonid::report {
namespace {

constexpr std::string_view kMinus = "\xE2\x88\x92";
/// A table of more columns is folded on a phone: its rows' cells stand below each other, unless all of them
/// are numbers, which are there to be compared.
constexpr std::size_t kMostColumns = 3;

/// Names, and nothing but numbers beside them.
bool is_of_numbers(const Table& table) {
  if (numeric(table, 0)) return false;
  for (std::size_t k = 1; k < table.columns.size(); ++k) {
    const bool is_empty = std::all_of(table.rows.begin(), table.rows.end(),
                                      [&](const auto& row) { return k >= row.size() || row[k].empty(); });
    if (!is_empty && !numeric(table, k)) return false;
  }
  return true;
}

/// Where a value lies between the ends of a scale, in percent.
struct Scale {
  double low = 0.0, high = 1.0;

  [[nodiscard]] double at(double value) const {
    return std::clamp(100.0 * (value - low) / (high - low), 0.0, 100.0);
  }
};

/// What the rows that count reach for, with a margin; doubtful ones do not widen it.
Scale scale_of(const Intervals& list) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto reach = [&](double value, double half) {
    low = std::min(low, value - half);
    high = std::max(high, value + half);
  };
  const bool all = std::all_of(list.rows.begin(), list.rows.end(), [](const auto& r) { return r.marked; });
  for (const auto& row : list.rows)
    if (all || !row.marked) reach(row.value, row.half_width);
  if (list.mean) reach(*list.mean, list.mean_half_width);
  if (!(high >= low)) return {};
  const double room = std::max(0.06 * (high - low), 1e-3 * std::max(std::abs(low), std::abs(high)));
  return {low - room, high + (room > 0.0 ? room : 1.0)};
}

std::string stretch(const char* kind, const Scale& scale, double value, double half) {
  const double from = scale.at(value - half), to = scale.at(value + half);
  return fmt::format("<i class=\"{}\" style=\"left:{:.2f}%;width:{:.2f}%\"></i>", kind, from, to - from);
}

std::string row_of_bars(const Intervals& list, const Intervals::Row& row, const Scale& scale) {
  std::string bar = "<div class=\"track\" aria-hidden=\"true\">";
  if (list.mean) bar += stretch("mean", scale, *list.mean, list.mean_half_width);
  if (row.half_width > 0.0) bar += stretch("whisker", scale, row.value, row.half_width);
  bar += fmt::format("<i class=\"dot\" style=\"left:{:.2f}%\"></i></div>", scale.at(row.value));
  return fmt::format(
      "<tr{}><th scope=\"row\" title=\"{}\">{}</th><td class=\"bar\">{}</td>"
      "<td class=\"n\">{}</td></tr>\n",
      row.marked ? " class=\"doubtful\"" : "", escape_html(row.name), escape_html(row.name), bar,
      with_sign(figure(with_error(row.value, row.half_width)), kPlusMinus));
}

int rank(diagnostics::Severity severity) {
  switch (severity) {
    case diagnostics::Severity::error:
      return 0;
    case diagnostics::Severity::warning:
      return 1;
    case diagnostics::Severity::info:
      return 2;
  }
  return 2;
}

std::string as_title(std::string text) {
  std::replace(text.begin(), text.end(), '-', ' ');
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

std::string finding_item(const diagnostics::Finding& f) {
  std::string figures;
  if (f.value && std::isfinite(*f.value)) figures = fmt::format("found {:.3g}", *f.value);
  if (f.threshold && std::isfinite(*f.threshold))
    figures += fmt::format("{}limit {:.3g}", figures.empty() ? "" : ", ", *f.threshold);
  return fmt::format("<li><span class=\"tag {}\">{}</span><div><b>{}</b>{}{}</div></li>\n",
                     name_of(f.severity), as_title(std::string(word_of(f.severity))),
                     escape_html(diagnostics::finding_title(f.id)),
                     f.meaning.empty() ? "" : element("<p>", html(f.meaning), "p"),
                     figures.empty() ? "" : element("<p class=\"soft small\">", figures, "p"));
}

}  // namespace

std::string html(const std::string& text) { return escape_html(typeset(text)); }

std::string figure(const std::string& text) {
  const std::string escaped = escape_html(text);
  return !escaped.empty() && escaped.front() == '-' ? std::string(kMinus) + escaped.substr(1) : escaped;
}

std::string element(std::string_view open, const std::string& content, std::string_view tag) {
  return std::string(open).append(content).append("</").append(tag).append(">");
}

std::string plain_table(const Table& table) {
  const bool fold = table.columns.size() > kMostColumns;
  std::string out = table.title.empty() ? "" : element("<h3>", html(table.title), "h3") + "\n";
  out += std::string("<div class=\"scroll\"><table class=\"plain") + (fold ? " fold" : "") +
         (fold && is_of_numbers(table) ? " numbers" : "") + "\">\n<thead><tr>";
  const auto class_of = [&](std::size_t i) { return numeric(table, i) ? " class=\"n\"" : ""; };
  for (std::size_t i = 0; i < table.columns.size(); ++i)
    out += fmt::format("<th scope=\"col\"{}>{}</th>", class_of(i), html(table.columns[i]));
  out += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (std::size_t i = 0; i < std::min(row.size(), table.columns.size()); ++i) {
      const std::string name = fold && i > 0 ? fmt::format(" data-name=\"{}\"", html(table.columns[i])) : "";
      const std::string cell = numeric(table, i) ? with_sign(figure(row[i]), kPlusMinus) : html(row[i]);
      out += i == 0 ? fmt::format("<th scope=\"row\"{}>{}</th>", class_of(i), cell)
                    : fmt::format("<td{}{}>{}</td>", class_of(i), name, cell);
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string interval_table(const Intervals& list) {
  const Scale scale = scale_of(list);
  std::string out =
      "<figure class=\"intervals\">\n<h3>" + html(list.title) +
      (list.unit.empty() ? "" : " <small>in " + html(list.unit) + "</small>") +
      (list.verdict.empty() ? "" : " <span class=\"soft\">\xC2\xB7 " + html(list.verdict) + "</span>") +
      "</h3>\n<table class=\"bars\"><thead class=\"unseen\"><tr><th scope=\"col\">Recording</th>"
      "<th scope=\"col\">Interval</th><th scope=\"col\">Value</th></tr></thead>\n<tbody>\n";
  for (const auto& row : list.rows) out += row_of_bars(list, row, scale);
  if (list.mean)
    out += fmt::format(
        "<tr class=\"foot\"><th scope=\"row\">mean</th><td class=\"bar ends\"><span>{}</span>"
        "<span>{}</span></td><td class=\"n\">{}</td></tr>\n",
        figure(fmt::format("{:.4g}", scale.low)), figure(fmt::format("{:.4g}", scale.high)),
        with_sign(figure(with_error(*list.mean, list.mean_half_width)), kPlusMinus));
  return out + "</tbody></table></figure>\n";
}

std::string findings_box(const std::vector<diagnostics::Finding>& findings) {
  std::string out = "<section class=\"sheet\"><h2>Findings</h2>\n";
  if (findings.empty()) return out + "<p class=\"explain\">None: every check passed.</p></section>\n";
  auto sorted = findings;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return rank(a.severity) < rank(b.severity); });
  out += std::string("<ul class=\"findings") + (sorted.size() > 3 ? " many" : "") + "\">\n";
  for (const auto& f : sorted) out += finding_item(f);
  return out + "</ul></section>\n";
}

std::string provenance_box(const Provenance& provenance) {
  std::string out =
      "<section class=\"provenance sheet\"><h2>Provenance</h2>\n<div class=\"scroll\"><table><tbody>\n";
  const auto row = [&](const std::string& name, const std::string& value) {
    if (!value.empty())
      out += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escape_html(name), value);
  };
  row("Program", provenance.version.empty() ? "" : "resonid " + escape_html(provenance.version));
  row("Date", escape_html(provenance.date));
  row("Command", provenance.command.empty() ? "" : "<code>" + escape_html(provenance.command) + "</code>");
  for (const auto& file : provenance.files)
    row(file.name, file.sha256.empty() ? "not a file" : "SHA-256 " + escape_html(file.sha256));
  out += "</tbody></table></div>\n<div class=\"sign-off print-only\">";
  for (const char* line : {"Machine, axis", "Done by", "Date", "Signature"})
    out += element("<span>", line, "span");
  return out + "</div></section>\n";
}

}  // namespace resonid::report
