// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <utility>
#include <vector>

namespace resonid::design {

/// Least of a function that has several minima, in a box: a differential evolution, then simplices from the
/// best that it leaves. Costs are worked out on all cores; the answer depends on the seed alone.
class GlobalSearch {
 public:
  using Point = std::vector<double>;
  using Cost =
      std::function<double(const Point&)>;  ///< Called on several threads at once; infinite: not allowed.
  struct Range {
    double low = 0.0, high = 1.0;
  };
  struct Effort {
    int population = 20;
    int generations = 18;
    std::uint64_t seed = 1;
  };

  GlobalSearch(std::vector<Range> ranges, Cost cost, const Effort& effort);

  /// Begins from `starts` as well; what a start lacks is drawn.
  [[nodiscard]] Point run(std::vector<Point> starts) { return descend_all(evolved(std::move(starts))); }
  /// The best few that the evolution leaves, apart from one another; best first.
  [[nodiscard]] std::vector<Point> evolved(std::vector<Point> starts);
  /// The least to which simplices come down, each a wide one and then a narrower one: there are several
  /// minima, and a simplex grows flat.
  [[nodiscard]] Point descend_all(const std::vector<Point>& starts) const;
  /// Nelder and Mead's simplex, of that size at first.
  [[nodiscard]] Point descend(const Point& from, double size) const;
  /// Infinite outside the box.
  [[nodiscard]] double cost(const Point& x) const;

 private:
  double uniform(double low, double high);
  std::size_t index(std::size_t count);
  void complete(Point& x);
  void evaluate(const std::vector<Point>& points, std::vector<double>& costs) const;
  void evolve(std::vector<Point>& population, std::vector<double>& costs);
  std::vector<Range> ranges_;
  Cost cost_;
  Effort effort_;
  std::mt19937_64 random_;
};

}  // namespace resonid::design
