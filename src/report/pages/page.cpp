// SPDX-License-Identifier: MIT
#include <cstdio>
#include <nlohmann/json.hpp>
#include <resonid/report/detail/page.hpp>
#include <string>

#include "report/pages/page_data.hpp"
#include "report/pages/page_template.hpp"

namespace resonid::report {
namespace {

using nlohmann::json;

/// The value at a key, or null: every key of a result is optional.
const json& at(const json& object, const char* key) {
  static const json nothing;
  if (!object.is_object()) return nothing;
  const auto it = object.find(key);
  return it == object.end() ? nothing : *it;
}

std::string text_of(const json& value) {
  return value.is_string() ? value.get<std::string>() : std::string();
}

std::string number(const json& value) {
  char text[40] = "";
  std::snprintf(text, sizeof text, "%.5g", value.get<double>());
  return text;
}

void row(std::string& out, std::string_view name, std::string_view value) {
  out.append("<tr><th>")
      .append(escape_html(name))
      .append("</th><td>")
      .append(escape_html(value))
      .append("</td></tr>\n");
}

/// Rows of texts and numbers of the listed keys, in the order of the list.
void list_rows(std::string& out, const json& list, std::string_view title,
               std::initializer_list<const char*> keys) {
  if (!list.is_array()) return;
  for (const json& entry : list) {
    std::string text;
    for (const char* key : keys) {
      const json& value = at(entry, key);
      const std::string part = value.is_number()    ? number(value)
                               : value.is_boolean() ? (value.get<bool>() ? "chosen" : "")
                                                    : text_of(value);
      if (!part.empty()) text += (text.empty() ? "" : ", ") + part;
    }
    row(out, title, text);
  }
}

void measured_row(std::string& out, std::string_view name, const json& value, const json& std,
                  const std::string& unit) {
  if (!value.is_number()) return;
  std::string text = number(value);
  if (std.is_number()) text += " (standard deviation " + number(std) + ")";
  row(out, name, unit.empty() ? text : text + " " + unit);
}

/// What remains readable where no script runs.
std::string still(const json& data, const std::string& title) {
  std::string out = "<noscript>\n<h1>" + escape_html(title) +
                    "</h1>\n<p>The pictures of this report need JavaScript. The figures:</p>\n<table>\n";
  const json& trusted = at(data, "trusted");
  if (trusted.is_boolean()) row(out, "verdict", trusted.get<bool>() ? "trusted" : "not trusted");
  const json& resonances = at(data, "resonances");
  if (resonances.is_array()) {
    for (const json& r : resonances) {
      measured_row(out, text_of(at(r, "kind")), at(r, "frequency_hz"), at(r, "std_hz"), "Hz");
    }
  }
  const json& loop = at(data, "loop");
  measured_row(out, "crossover", at(loop, "crossover_hz"), at(loop, "crossover_std_hz"), "Hz");
  measured_row(out, "phase margin", at(loop, "phase_margin_deg"), at(loop, "phase_margin_std_deg"),
               "degrees");
  measured_row(out, "modulus margin", at(loop, "modulus_margin"), at(loop, "modulus_margin_std"), "");
  measured_row(out, "gain margin", at(loop, "gain_margin_db"), at(loop, "gain_margin_std_db"), "dB");
  const json& parameters = at(at(data, "model"), "parameters");
  if (parameters.is_object()) {
    for (const auto& [name, p] : parameters.items()) {
      measured_row(out, name, at(p, "value"), at(p, "std"), text_of(at(p, "unit")));
    }
  }
  list_rows(out, at(data, "poles"), "pole, real and imaginary part in 1/s", {"real", "imag"});
  list_rows(out, at(data, "zeros"), "zero, real and imaginary part in 1/s", {"real", "imag"});
  list_rows(out, at(at(data, "bootstrap"), "intervals"), "bootstrap interval",
            {"name", "low", "high", "unit"});
  list_rows(out, at(data, "structures"), "structure tried", {"name", "chosen", "remark"});
  list_rows(out, at(data, "choices"), "chosen", {"what", "chosen", "because"});
  const json& made = at(data, "provenance");
  for (const char* key : {"version", "date", "command"})
    if (const auto text = text_of(at(made, key)); !text.empty()) row(out, key, text);
  list_rows(out, at(made, "files"), "made from", {"name", "sha256"});
  out += "</table>\n";
  const json& summary = at(at(data, "page"), "summary");
  if (summary.is_array()) {
    for (const json& sentence : summary) out += "<p>" + escape_html(text_of(sentence)) + "</p>\n";
  }
  return out + "</noscript>";
}

std::string title_of(const json& data) {
  const std::string title = text_of(at(at(data, "page"), "title"));
  return title.empty() ? "Identification" : title;
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string script_json(const nlohmann::json& data) {
  const std::string plain = data.dump(-1, ' ', true, json::error_handler_t::replace);
  std::string out;
  out.reserve(plain.size());
  // These three stand in strings only, where an escape means the same and cannot end the element or open a
  // comment.
  for (const char c : plain) {
    switch (c) {
      case '<':
        out += "\\u003c";
        break;
      case '>':
        out += "\\u003e";
        break;
      case '&':
        out += "\\u0026";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string page(const nlohmann::json& data) {
  const std::string_view source = page_template();
  const std::string title = escape_html(repaired(title_of(data)));
  const std::string content = repaired(still(data, title_of(data)));
  const std::size_t used = source.size() + title.size() + content.size();
  const std::string carried = page_data(data, kPageBytes > used ? kPageBytes - used : 0);
  return fill(source, {{"title", title}, {"content", content}, {"data", carried}});
}

}  // namespace resonid::report
