// SPDX-License-Identifier: MIT
#include "design/global_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "linalg/parallel.hpp"

namespace resonid::design {

GlobalSearch::GlobalSearch(std::vector<Range> ranges, Cost cost, const Effort& effort)
    : ranges_(std::move(ranges)), cost_(std::move(cost)), effort_(effort), random_(effort.seed) {}

std::vector<GlobalSearch::Point> GlobalSearch::evolved(std::vector<Point> starts) {
  std::vector<Point> population = std::move(starts);
  for (Point& x : population) complete(x);
  while (population.size() < static_cast<std::size_t>(effort_.population)) {
    Point x;
    complete(x);
    population.push_back(std::move(x));
  }
  std::vector<double> costs(population.size());
  evaluate(population, costs);
  for (int generation = 0; generation < effort_.generations; ++generation) evolve(population, costs);
  constexpr std::size_t kMost = 6;
  constexpr double kApart = 0.3;
  std::vector<std::size_t> order(population.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return costs[a] < costs[b]; });
  std::vector<Point> best;
  for (const std::size_t i : order) {
    const auto near = [&](const Point& other) {
      double most = 0.0;
      for (std::size_t k = 0; k < other.size(); ++k)
        most = std::max(most, std::abs(other[k] - population[i][k]));
      return most < kApart;
    };
    if (best.size() < kMost && std::none_of(best.begin(), best.end(), near)) best.push_back(population[i]);
  }
  return best;
}

double GlobalSearch::cost(const Point& x) const {
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!(x[i] >= ranges_[i].low && x[i] <= ranges_[i].high)) return std::numeric_limits<double>::infinity();
  return cost_(x);
}

void GlobalSearch::evaluate(const std::vector<Point>& points, std::vector<double>& costs) const {
  linalg::for_each_index(points.size(), 0, [&](std::size_t i) { costs[i] = cost(points[i]); });
}

double GlobalSearch::uniform(double low, double high) {
  constexpr double kSteps = 9007199254740992.0;  // 2^53
  return low + (high - low) * static_cast<double>(random_() >> 11) / kSteps;
}

std::size_t GlobalSearch::index(std::size_t count) {
  return std::min(count - 1, static_cast<std::size_t>(uniform(0.0, static_cast<double>(count))));
}

void GlobalSearch::complete(Point& x) {
  x.resize(std::min(x.size(), ranges_.size()));
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::clamp(x[i], ranges_[i].low, ranges_[i].high);
  while (x.size() < ranges_.size()) x.push_back(uniform(ranges_[x.size()].low, ranges_[x.size()].high));
}

/// One generation of a differential evolution, rand/1/bin and now and then best/1/bin.
void GlobalSearch::evolve(std::vector<Point>& population, std::vector<double>& costs) {
  constexpr double kGreedy = 0.1, kCrossover = 0.8;
  const auto best = static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
  std::vector<Point> trials = population;
  for (Point& trial : trials) {
    const Point& base = uniform(0.0, 1.0) < kGreedy ? population[best] : population[index(population.size())];
    const Point &a = population[index(population.size())], &b = population[index(population.size())];
    const std::size_t always = index(trial.size());
    const double mutation = uniform(0.4, 0.9);
    for (std::size_t i = 0; i < trial.size(); ++i)
      if (i == always || uniform(0.0, 1.0) < kCrossover)
        trial[i] = std::clamp(base[i] + mutation * (a[i] - b[i]), ranges_[i].low, ranges_[i].high);
  }
  std::vector<double> found(trials.size());
  evaluate(trials, found);
  for (std::size_t i = 0; i < trials.size(); ++i)
    if (found[i] <= costs[i]) {
      costs[i] = found[i];
      population[i] = trials[i];
    }
}

GlobalSearch::Point GlobalSearch::descend_all(const std::vector<Point>& starts) const {
  std::vector<Point> found(starts.size());
  std::vector<double> reached(starts.size());
  linalg::for_each_index(starts.size(), 0, [&](std::size_t i) {
    found[i] = descend(descend(starts[i], 0.4), 0.15);
    reached[i] = cost(found[i]);
  });
  return found[static_cast<std::size_t>(std::min_element(reached.begin(), reached.end()) - reached.begin())];
}

GlobalSearch::Point GlobalSearch::descend(const Point& from, double size) const {
  const std::size_t n = from.size();
  std::vector<std::pair<double, Point>> simplex = {{cost(from), from}};
  for (std::size_t i = 0; i < n; ++i) {
    Point x = from;
    x[i] += x[i] + size < ranges_[i].high ? size : -size;
    const double c = cost(x);
    simplex.emplace_back(c, std::move(x));
  }
  const int most = static_cast<int>((n > 3 ? 100 : 30) * n);
  for (int step = 0; step < most; ++step) {
    std::sort(simplex.begin(), simplex.end());
    if (simplex.back().first - simplex.front().first < 1e-5 * simplex.front().first) break;
    Point centre(n, 0.0);
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t i = 0; i < n; ++i) centre[i] += simplex[k].second[i] / static_cast<double>(n);
    const auto along = [&](double t) {
      Point x(n);
      for (std::size_t i = 0; i < n; ++i) x[i] = centre[i] + t * (simplex.back().second[i] - centre[i]);
      return std::pair(cost(x), x);
    };
    auto reflected = along(-1.0);
    if (reflected.first < simplex.front().first) {
      auto expanded = along(-2.0);
      simplex.back() = expanded.first < reflected.first ? std::move(expanded) : std::move(reflected);
    } else if (reflected.first < simplex[n - 1].first) {
      simplex.back() = std::move(reflected);
    } else if (auto contracted = along(reflected.first < simplex.back().first ? -0.5 : 0.5);
               contracted.first < std::min(reflected.first, simplex.back().first)) {
      simplex.back() = std::move(contracted);
    } else {
      for (std::size_t k = 1; k <= n; ++k) {
        for (std::size_t i = 0; i < n; ++i)
          simplex[k].second[i] = 0.5 * (simplex[k].second[i] + simplex.front().second[i]);
        simplex[k].first = cost(simplex[k].second);
      }
    }
  }
  return std::min_element(simplex.begin(), simplex.end())->second;
}

}  // namespace resonid::design
