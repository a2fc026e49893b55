// SPDX-License-Identifier: MIT
#include "fit/modes/extremum_candidates.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace resonid::fit {
namespace {

/// ln |G| with its standard deviation.
struct Level {
  double x = 0.0;  ///< ln f
  double value = 0.0;
  double std = 0.0;  ///< Of the complex value, relative.
};

/// A line that noise drowns is no lower than the noise, and says little.
std::vector<Level> levels_of(const data::FrequencyResponse& g) {
  std::vector<Level> levels;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const double size = std::hypot(std::abs(g.value[i]), g.std[i]);
    levels.push_back({std::log(g.frequency_hz[i]), std::log(size), g.std[i] / size});
  }
  return levels;
}

/// What chance makes of a level: by noise alone |G| is so far off with a probability of exp(-12).
double by_chance(const Level& level, bool minimum) {
  constexpr double kDeviations = 3.5;
  const double off = kDeviations * level.std;
  if (minimum) return std::log1p(off);
  return off < 1.0 ? -std::log1p(-off) : std::numeric_limits<double>::infinity();
}

/// Means over the lines within `reach` of ln f, weighted by what each knows.
std::vector<Level> averaged(const std::vector<Level>& levels, double reach) {
  if (reach == 0.0) return levels;
  std::vector<Level> means;
  std::size_t first = 0, last = 0;
  double weights = 0.0, sum = 0.0;
  const auto weight = [&](std::size_t i) { return 1.0 / (levels[i].std * levels[i].std + 1e-8); };
  for (const auto& centre : levels) {
    for (; last < levels.size() && levels[last].x <= centre.x + reach; ++last) {
      weights += weight(last);
      sum += weight(last) * levels[last].value;
    }
    for (; levels[first].x < centre.x - reach; ++first) {
      weights -= weight(first);
      sum -= weight(first) * levels[first].value;
    }
    means.push_back({centre.x, sum / weights, 1.0 / std::sqrt(weights)});
  }
  return means;
}

}  // namespace

double prominence(const std::vector<double>& level, std::size_t i) {
  double left = level[i], right = level[i];
  for (std::size_t k = i; k-- > 0 && level[k] <= level[i];) left = std::min(left, level[k]);
  for (std::size_t k = i + 1; k < level.size() && level[k] <= level[i]; ++k)
    right = std::min(right, level[k]);
  return level[i] - std::max(left, right);
}

std::vector<ExtremumCandidate> extremum_candidates(const data::FrequencyResponse& g) {
  constexpr double kLeast = 0.05;  // of ln |G|: less is no mode that anyone would look for
  constexpr std::size_t kMost = 12;
  std::vector<ExtremumCandidate> found;
  const auto lines = levels_of(g);
  for (const double reach : {0.0, 0.01, 0.02, 0.04, 0.08, 0.16}) {
    const auto means = averaged(lines, reach);
    for (const bool minimum : {true, false}) {
      std::vector<double> level;
      for (const auto& m : means) level.push_back(minimum ? -m.value : m.value);
      for (std::size_t i = 1; i + 1 < level.size(); ++i) {
        if (level[i] < level[i - 1] || level[i] <= level[i + 1]) continue;
        const double height = prominence(level, i);
        if (!(height > std::max(kLeast, by_chance(means[i], minimum)))) continue;
        const double f = std::exp(means[i].x);
        const bool known = std::any_of(found.begin(), found.end(), [&](const auto& c) {
          return c.minimum == minimum && std::abs(std::log(c.frequency_hz / f)) <= 1.5 * reach;
        });
        if (!known) found.push_back({minimum, f, height / std::max(means[i].std, 1e-4)});
      }
    }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.strength > b.strength; });
  if (found.size() > kMost) found.resize(kMost);
  return found;
}

}  // namespace resonid::fit
