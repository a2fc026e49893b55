// SPDX-License-Identifier: MIT
#include "design/filter_search.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "design/figures.hpp"
#include "linalg/parallel.hpp"

namespace resonid::design {
namespace {

/// Natural logarithms of frequency and both dampings, biquad after biquad.
using Point = std::vector<double>;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

struct Range {
  double low, high;
};

class FilterSearcher {
 public:
  /// Searches one biquad beside those that are found already, and then all of them together.
  FilterSearcher(Machines& machines, const Bounds& bounds, const FilterSearch& how, std::vector<Biquad> found)
      : machines_(machines), bounds_(bounds), how_(how), random_(how.seed), found_(std::move(found)) {
    double lowest_hz = kInfinite, highest_hz = 0.0;
    for (const Machine& machine : machines.all) {
      const double nyquist_hz = 0.5 / machine.sample_time_s();
      const auto modes = machine.model().modes();
      lowest_hz =
          std::min(lowest_hz, modes.empty() ? 0.01 * nyquist_hz : 0.3 * modes.front().frequency_hz.value);
      highest_hz = std::max(highest_hz, 0.8 * nyquist_hz);
    }
    const std::array one = {Range{std::log(lowest_hz), std::log(highest_hz)},
                            Range{std::log(0.02), std::log(3.0)}, Range{std::log(0.05), std::log(3.0)}};
    ranges_.assign(one.begin(), one.end());
  }

  std::optional<FilteredDesign> run(const std::vector<Biquad>& starts) {
    std::vector<Point> population = first_points(starts);
    std::vector<double> costs(population.size());
    evaluate(population, costs);
    for (int generation = 0; generation < how_.generations; ++generation) evolve(population, costs);
    together(population);
    Point found = descend_from_best(population, costs);
    if (!(cost(found) < kInfinite)) return std::nullopt;
    // The exact gains add the lines between which a filter had hidden; then the search goes on with them.
    std::optional<FilteredDesign> best;
    for (const double size : {0.1, 0.03, 0.0}) {
      if (auto now = exact(biquads_of(found)); now && (!best || now->iae < best->iae)) best = std::move(now);
      if (size > 0.0) found = descend(found, size);
    }
    return best;
  }

 private:
  static std::vector<Biquad> biquads_of(const Point& x) {
    std::vector<Biquad> biquads;
    for (std::size_t i = 0; i + 2 < x.size(); i += 3)
      biquads.push_back({std::exp(x[i]), std::exp(x[i + 1]), std::exp(x[i + 2])});
    return biquads;
  }

  [[nodiscard]] std::optional<FilteredDesign> exact(std::vector<Biquad> biquads) const {
    const auto gains = largest_integral_gain(machines_, biquads, bounds_);
    if (!gains) return std::nullopt;
    FilteredDesign design{{gains->kp, gains->ki, std::move(biquads)}, 0.0};
    design.iae = mean_iae(design.controller);
    return design;
  }

  [[nodiscard]] double mean_iae(const FilteredPi& controller) const {
    double sum = 0.0;
    for (const Machine& machine : machines_.all) sum += load_step_iae(machine, controller);
    return sum / static_cast<double>(machines_.all.size());
  }

  [[nodiscard]] double cost(const Point& x) const {
    for (std::size_t i = 0; i < x.size(); ++i)
      if (!(x[i] >= range(i).low && x[i] <= range(i).high)) return kInfinite;
    auto biquads = biquads_of(x);
    biquads.insert(biquads.end(), found_.begin(), found_.end());
    Machines machines = machines_;
    const auto gains = largest_integral_gain(machines, biquads, bounds_, kRough);
    return gains ? mean_iae({gains->kp, gains->ki, biquads}) : kInfinite;
  }

  [[nodiscard]] const Range& range(std::size_t i) const { return ranges_[i % ranges_.size()]; }

  /// From here on what was found before is searched with the new one.
  void together(std::vector<Point>& population) {
    const Point before = point_of(found_);
    for (Point& x : population) {
      x.insert(x.end(), before.begin(), before.end());
      for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::clamp(x[i], range(i).low, range(i).high);
    }
    found_.clear();
  }

  static Point point_of(const std::vector<Biquad>& biquads) {
    Point x;
    for (const Biquad& b : biquads)
      x.insert(x.end(),
               {std::log(b.frequency_hz), std::log(b.numerator_damping), std::log(b.denominator_damping)});
    return x;
  }

  void evaluate(const std::vector<Point>& points, std::vector<double>& costs) const {
    linalg::for_each_index(points.size(), 0, [&](std::size_t i) { costs[i] = cost(points[i]); });
  }

  double uniform(double low, double high) {
    constexpr double kSteps = 9007199254740992.0;  // 2^53
    return low + (high - low) * static_cast<double>(random_() >> 11) / kSteps;
  }
  std::size_t index(std::size_t count) {
    return std::min(count - 1, static_cast<std::size_t>(uniform(0.0, static_cast<double>(count))));
  }

  /// Near the resonance and beyond it, where the least stands often (docs/methods/tune.md 6.2), near the
  /// anti-resonance, and anywhere.
  std::vector<Point> first_points(const std::vector<Biquad>& starts) {
    std::vector<Biquad> likely = starts;
    const auto modes = machines_.all.front().model().modes();
    if (!modes.empty()) {
      const double low_hz = modes.front().frequency_hz.value, high_hz = modes.back().frequency_hz.value;
      likely.insert(
          likely.end(),
          {{high_hz, 0.2, 0.5}, {1.5 * high_hz, 0.4, 0.7}, {10.0 * high_hz, 1.5, 0.5}, {low_hz, 0.6, 0.5}});
    }
    std::vector<Point> points;
    for (const auto& biquad : likely) points.push_back(point_of({biquad}));
    while (points.size() < static_cast<std::size_t>(how_.population)) {
      Point x;
      for (const Range& range : ranges_) x.push_back(uniform(range.low, range.high));
      points.push_back(std::move(x));
    }
    for (Point& x : points)
      for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::clamp(x[i], range(i).low, range(i).high);
    return points;
  }

  /// One generation of a differential evolution, rand/1/bin and now and then best/1/bin.
  void evolve(std::vector<Point>& population, std::vector<double>& costs) {
    constexpr double kGreedy = 0.1, kCrossover = 0.8;
    const auto best = static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
    std::vector<Point> trials = population;
    for (Point& trial : trials) {
      const Point& base =
          uniform(0.0, 1.0) < kGreedy ? population[best] : population[index(population.size())];
      const Point &a = population[index(population.size())], &b = population[index(population.size())];
      const std::size_t always = index(trial.size());
      const double mutation = uniform(0.4, 0.9);
      for (std::size_t i = 0; i < trial.size(); ++i)
        if (i == always || uniform(0.0, 1.0) < kCrossover)
          trial[i] = std::clamp(base[i] + mutation * (a[i] - b[i]), range(i).low, range(i).high);
    }
    std::vector<double> found(trials.size());
    evaluate(trials, found);
    for (std::size_t i = 0; i < trials.size(); ++i)
      if (found[i] <= costs[i]) {
        costs[i] = found[i];
        population[i] = trials[i];
      }
  }

  /// From the best few that the evolution left, each with a wide simplex and then a narrower one: there are
  /// several minima, and a simplex grows flat.
  [[nodiscard]] Point descend_from_best(const std::vector<Point>& population,
                                        const std::vector<double>& costs) const {
    constexpr std::size_t kStarts = 6;
    constexpr double kApart = 0.3;
    std::vector<std::size_t> order(population.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return costs[a] < costs[b]; });
    std::vector<Point> found;
    for (const std::size_t i : order) {
      const auto near = [&](const Point& other) {
        double most = 0.0;
        for (std::size_t k = 0; k < ranges_.size(); ++k)
          most = std::max(most, std::abs(other[k] - population[i][k]));
        return most < kApart;
      };
      if (found.size() < kStarts && std::none_of(found.begin(), found.end(), near))
        found.push_back(population[i]);
    }
    std::vector<double> reached(found.size());
    linalg::for_each_index(found.size(), 0, [&](std::size_t i) {
      found[i] = descend(descend(found[i], 0.4), 0.15);
      reached[i] = cost(found[i]);
    });
    return found[static_cast<std::size_t>(std::min_element(reached.begin(), reached.end()) -
                                          reached.begin())];
  }

  /// Nelder and Mead's simplex.
  [[nodiscard]] Point descend(const Point& from, double size) const {
    const std::size_t n = from.size();
    std::vector<std::pair<double, Point>> simplex = {{cost(from), from}};
    for (std::size_t i = 0; i < n; ++i) {
      Point x = from;
      x[i] += x[i] + size < range(i).high ? size : -size;
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

  Machines& machines_;
  const Bounds& bounds_;
  const FilterSearch& how_;
  std::mt19937_64 random_;
  std::vector<Biquad> found_;
  std::vector<Range> ranges_;  ///< of one biquad
};

}  // namespace

std::optional<FilteredDesign> search_filters(Machines& machines, const Bounds& bounds,
                                             const FilterSearch& how, const std::vector<Biquad>& starts) {
  std::optional<FilteredDesign> best;
  for (int biquads = 1; biquads <= how.biquads; ++biquads) {
    auto found =
        FilterSearcher(machines, bounds, how, best ? best->controller.biquads : std::vector<Biquad>())
            .run(starts);
    if (found && (!best || found->iae < best->iae)) best = std::move(found);
  }
  return best;
}

double load_step_iae(const Machine& machine, const FilteredPi& controller) {
  const auto loop = closed_loop(machine.states(), states_of(controller, machine.sample_time_s()));
  const double radius = loop.spectral_radius();
  return radius < 1.0 ? load_step_of(loop, radius).iae : kInfinite;
}

}  // namespace resonid::design
