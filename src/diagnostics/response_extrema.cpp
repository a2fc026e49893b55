// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <resonid/diagnostics/detail/response_extrema.hpp>

namespace resonid::diagnostics {
namespace {

/// Height of the peak at i above the higher of the two valleys that part it from higher ground (or the band's
/// ends).
double prominence(const std::vector<double>& level, std::size_t i) {
  double left = level[i];
  for (std::size_t k = i; k-- > 0 && level[k] <= level[i];) left = std::min(left, level[k]);
  double right = level[i];
  for (std::size_t k = i + 1; k < level.size() && level[k] <= level[i]; ++k)
    right = std::min(right, level[k]);
  return level[i] - std::max(left, right);
}

double vertex(double x0, double y0, double x1, double y1, double x2, double y2) {
  const double a = (y2 - y1) / (x2 - x1);
  const double b = (y1 - y0) / (x1 - x0);
  const double curvature = (a - b) / (x2 - x0);
  if (curvature == 0.0) return x1;
  return std::clamp(0.5 * (x0 + x1) - 0.5 * b / curvature, x0, x2);
}

}  // namespace

std::vector<ResponseExtremum> response_extrema(const data::FrequencyResponse& g, double least_db) {
  std::vector<ResponseExtremum> found;
  if (g.lines() < 3) return found;
  std::vector<double> x, level;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    x.push_back(std::log(std::max(g.frequency_hz[i], 1e-12)));
    level.push_back(20.0 * std::log10(std::max(std::abs(g.value[i]), 1e-300)));
  }
  for (const bool minimum : {true, false}) {
    std::vector<double> signed_level = level;
    if (minimum)
      for (auto& v : signed_level) v = -v;
    for (std::size_t i = 1; i + 1 < signed_level.size(); ++i) {
      if (signed_level[i] < signed_level[i - 1] || signed_level[i] <= signed_level[i + 1]) continue;
      const double height = prominence(signed_level, i);
      double needed = least_db;
      if (!g.std.empty())
        needed = std::max(needed, 3.0 * 8.69 * g.std[i] / std::max(std::abs(g.value[i]), 1e-300));
      if (height < needed) continue;
      const double at = vertex(x[i - 1], level[i - 1], x[i], level[i], x[i + 1], level[i + 1]);
      found.push_back({std::exp(at), minimum, height});
    }
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.frequency_hz < b.frequency_hz; });
  return found;
}

}  // namespace resonid::diagnostics
