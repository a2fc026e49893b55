// SPDX-License-Identifier: MIT
#include "reproduce/spread.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace resonid::reproduction {
namespace {

void append(std::string& note, const std::string& text) {
  if (!note.empty()) note += "; ";
  note += text;
}

}  // namespace

Spread spread(const std::vector<double>& values) {
  Spread s;
  s.values = values.size();
  for (const double x : values) {
    if (std::isfinite(x))
      s.mean += x;
    else
      ++s.missing;
  }
  if (s.missing == s.values) {
    s.mean = std::numeric_limits<double>::quiet_NaN();
    return s;
  }
  const auto count = static_cast<double>(s.values - s.missing);
  s.mean /= count;
  for (const double x : values)
    if (std::isfinite(x)) s.deviation += (x - s.mean) * (x - s.mean);
  s.deviation = count > 1.0 ? std::sqrt(s.deviation / (count - 1.0)) : 0.0;
  if (s.deviation < 1e-12 * std::abs(s.mean)) s.deviation = 0.0;  // rounding of equal values
  return s;
}

report::Comparison row(std::string quantity, std::string unit, double reproduced, std::optional<double> truth,
                       std::optional<double> published, std::string note) {
  report::Comparison r;
  r.quantity = std::move(quantity);
  r.unit = std::move(unit);
  if (std::isfinite(reproduced))
    r.reproduced = reproduced;
  else
    append(note, "no value");
  r.truth = truth;
  r.published = published;
  r.note = std::move(note);
  return r;
}

report::Comparison row(std::string quantity, std::string unit, const Spread& reproduced,
                       std::optional<double> truth, std::optional<double> published, std::string note) {
  if (reproduced.missing > 0 && reproduced.missing < reproduced.values)
    append(note, fmt::format("no value in {} of {}", reproduced.missing, reproduced.values));
  auto r = row(std::move(quantity), std::move(unit), reproduced.mean, truth, published, std::move(note));
  if (r.reproduced) r.deviation = reproduced.deviation;
  return r;
}

}  // namespace resonid::reproduction
