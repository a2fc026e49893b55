// SPDX-License-Identifier: MIT
#include "report/pages/page_data.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/report/detail/page.hpp>
#include <vector>

namespace resonid::report {
namespace {

using nlohmann::json;

constexpr int kCurveDigits = 7;

double rounded(double value) {
  if (!std::isfinite(value)) return value;
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, kCurveDigits);
  double out = value;
  std::from_chars(text.data(), end.ptr, out);
  return out;
}

void round_numbers(json& node) {
  if (node.is_number_float()) {
    node = rounded(node.get<double>());
  } else if (node.is_structured()) {
    for (auto& child : node) round_numbers(child);
  }
}

/// The object at a path of keys, or nothing.
json* find(json& root, std::initializer_list<const char*> path) {
  json* node = &root;
  for (const char* key : path) {
    if (!node->is_object()) return nullptr;
    const auto it = node->find(key);
    if (it == node->end()) return nullptr;
    node = &*it;
  }
  return node;
}

std::size_t length_of(const json& columns, const char* key) {
  if (!columns.is_object()) return 0;
  const auto it = columns.find(key);
  return it != columns.end() && it->is_array() ? it->size() : 0;
}

/// Keeps the given rows of every column that has `length` rows.
void keep_rows(json& columns, std::size_t length, const std::vector<std::size_t>& rows) {
  for (auto& column : columns) {
    if (!column.is_array() || column.size() != length) continue;
    json kept = json::array();
    for (const std::size_t row : rows) kept.push_back(column[row]);
    column = std::move(kept);
  }
}

/// At most `most` rows, spread evenly over log frequency: what a Bode picture can show.
std::vector<std::size_t> spread(const json& frequency, std::size_t most) {
  std::vector<std::size_t> rows;
  const auto value = [&](std::size_t i) {
    return frequency[i].is_number() ? frequency[i].get<double>() : 0.0;
  };
  double low = 0.0;
  double high = 0.0;
  for (std::size_t i = 0; i < frequency.size(); ++i) {
    const double f = value(i);
    if (f > 0.0 && (low <= 0.0 || f < low)) low = f;
    high = std::max(high, f);
  }
  if (!(high > low) || low <= 0.0) return rows;
  long previous = -1;
  for (std::size_t i = 0; i < frequency.size(); ++i) {
    if (value(i) <= 0.0) continue;
    const long bin = std::lround(
        std::floor(std::log(value(i) / low) / std::log(high / low) * static_cast<double>(most - 1)));
    if (bin != previous) rows.push_back(i);
    previous = bin;
  }
  return rows;
}

/// Fewer lines of a curve over frequency; true when lines were taken out.
bool thin_curve(json* curve, std::size_t most) {
  if (curve == nullptr) return false;
  const std::size_t length = length_of(*curve, "frequency_hz");
  if (length <= most) return false;
  keep_rows(*curve, length, spread(curve->at("frequency_hz"), most));
  return true;
}

/// The least or greatest number of each `wide` neighbouring bins.
void merge_bins(json& column, std::size_t wide, bool greatest) {
  json merged = json::array();
  for (std::size_t i = 0; i < column.size(); i += wide) {
    const json* best = nullptr;
    for (std::size_t k = i; k < std::min(i + wide, column.size()); ++k) {
      const json& x = column[k];
      if (!x.is_number()) continue;
      if (best == nullptr || (greatest ? *best < x : x < *best)) best = &x;
    }
    merged.push_back(best != nullptr ? *best : json(nullptr));
  }
  column = std::move(merged);
}

/// An envelope {min, max} of the bins at time_s, made `wide` times coarser.
void merge_envelope(json& channel, std::size_t length, std::size_t wide) {
  if (!channel.is_object()) return;
  if (length_of(channel, "min") == length && length_of(channel, "max") != length)
    channel["max"] = channel["min"];
  if (length_of(channel, "min") == length) merge_bins(channel["min"], wide, false);
  if (length_of(channel, "max") == length) merge_bins(channel["max"], wide, true);
}

void thin_signals(json* signals, std::size_t most) {
  if (signals == nullptr) return;
  const std::size_t length = length_of(*signals, "time_s");
  if (length <= most) return;
  const std::size_t wide = (length + most - 1) / most;
  const auto channels = signals->find("channels");
  if (channels != signals->end() && channels->is_array()) {
    for (auto& channel : *channels) merge_envelope(channel, length, wide);
  }
  merge_envelope(*signals, length, wide);
  merge_bins((*signals)["time_s"], wide, false);
}

/// Fewer points of every curve of a chart, evenly.
void thin_chart(json* chart, std::size_t most) {
  if (chart == nullptr || !chart->is_object() || !chart->contains("curves")) return;
  for (json& curve : (*chart)["curves"]) {
    const std::size_t length = length_of(curve, "x");
    if (length <= most) continue;
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < most; ++i) rows.push_back(i * (length - 1) / (most - 1));
    keep_rows(curve, length, rows);
  }
}

void thin(json& data, std::size_t most) {
  thin_chart(find(data, {"page", "overlay"}), most);
  thin_chart(find(data, {"page", "sensitivity"}), most);
  if (json* spectra = find(data, {"page", "spectra"}); spectra != nullptr && spectra->is_array())
    for (json& chart : *spectra) thin_chart(&chart, most);
  thin_signals(find(data, {"page", "signals"}), most);
  thin_signals(find(data, {"page", "residual"}), most);
  for (const char* curve : {"model_curve", "load_curve", "loop_curve", "loop_measured"})
    thin_curve(find(data, {"page", curve}), most);
  if (json* load = find(data, {"second_output", "frequency_response"}); thin_curve(load, most))
    round_numbers(*load);
  json* response = find(data, {"frequency_response"});
  const std::size_t total = response == nullptr ? 0 : length_of(*response, "frequency_hz");
  if (!thin_curve(response, most)) return;
  round_numbers(*response);
  json& reduced = data["page"]["reduced"];
  if (!reduced.contains("lines_total")) reduced["lines_total"] = total;
  reduced["lines_shown"] = length_of(*response, "frequency_hz");
}

}  // namespace

std::string page_data(const json& data, std::size_t budget_bytes) {
  json shown = data.is_object() ? data : json::object();
  if (json* page = find(shown, {"page"})) {
    if (page->is_object()) {
      round_numbers(*page);
    } else {
      shown.erase("page");
    }
  }
  std::string text = script_json(shown);
  for (std::size_t most = 8000; text.size() > budget_bytes && most >= 250; most /= 2) {
    thin(shown, most);
    text = script_json(shown);
  }
  return text;
}

}  // namespace resonid::report
