// SPDX-License-Identifier: MIT
#include "design/filter_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <resonid/base/constants.hpp>
#include <utility>

#include "design/figures.hpp"
#include "design/global_search.hpp"

namespace resonid::design {
namespace {

/// Natural logarithms of frequency and both dampings, biquad after biquad.
using Point = GlobalSearch::Point;
using Range = GlobalSearch::Range;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

class FilterSearcher {
 public:
  /// Searches one biquad beside those that are found already, and then all of them together.
  FilterSearcher(Machines& machines, const Bounds& bounds, const FilterSearch& how, std::vector<Biquad> found)
      : machines_(machines),
        coarse_(machines.all, kCoarse),
        bounds_(bounds),
        how_(how),
        found_(std::move(found)) {
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
    const GlobalSearch::Effort effort{how_.population, how_.generations, how_.seed};
    const auto cost_of = [this](const Point& x) { return cost(x); };
    auto points = GlobalSearch(ranges_, cost_of, effort).evolved(first_points(starts));
    together(points);
    const GlobalSearch all(ranges_, cost_of, effort);
    return polished(all, all.descend_all(points), std::array{0.1, 0.03, 0.0});
  }

  /// From filters that suited other machines, and from a small population around them: the minimum that was
  /// the least may not be any more.
  std::optional<FilteredDesign> again() {
    const Point from = point_of(found_);
    const std::vector<Range> one = ranges_;
    for (std::size_t i = 1; i < found_.size(); ++i) ranges_.insert(ranges_.end(), one.begin(), one.end());
    found_.clear();
    constexpr std::size_t kDescents = 2;
    GlobalSearch all(ranges_, [this](const Point& x) { return cost(x); }, {12, 8, how_.seed});
    auto points = all.evolved({from});
    points.resize(std::min(points.size(), kDescents));
    if (std::find(points.begin(), points.end(), from) == points.end()) points.push_back(from);
    return polished(all, all.descend_all(points), std::array{0.1, 0.0});
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
    design.iae = mean_iae(design.controller, false);
    return design;
  }

  /// The exact gains add the lines between which a filter had hidden; then the search goes on with them.
  std::optional<FilteredDesign> polished(const GlobalSearch& search, Point from,
                                         std::span<const double> sizes) {
    std::optional<FilteredDesign> best;
    on_all_lines_ = true;
    for (const double size : sizes) {
      if (auto now = exact(biquads_of(from)); now && (!best || now->iae < best->iae)) best = std::move(now);
      if (size > 0.0) from = search.descend(from, size);
    }
    return best;
  }

  [[nodiscard]] double mean_iae(const FilteredPi& controller, bool rough) const {
    double sum = 0.0;
    for (const Machine& machine : machines_.all)
      sum += rough ? rough_load_step_iae(machine, controller) : load_step_iae(machine, controller);
    return std::isfinite(sum) ? sum / static_cast<double>(machines_.all.size()) : kInfinite;
  }

  [[nodiscard]] double cost(const Point& x) const {
    auto biquads = biquads_of(x);
    biquads.insert(biquads.end(), found_.begin(), found_.end());
    const auto gains = rough_integral_gain(on_all_lines_ ? machines_ : coarse_, biquads, bounds_);
    return gains ? mean_iae({gains->kp, gains->ki, biquads}, true) : kInfinite;
  }

  /// From here on what was found before is searched with the new one.
  void together(std::vector<Point>& points) {
    const Point before = point_of(found_);
    for (Point& x : points) x.insert(x.end(), before.begin(), before.end());
    const std::vector<Range> one = ranges_;
    for (std::size_t i = 0; i < found_.size(); ++i) ranges_.insert(ranges_.end(), one.begin(), one.end());
    found_.clear();
  }

  static Point point_of(const std::vector<Biquad>& biquads) {
    Point x;
    for (const Biquad& b : biquads)
      x.insert(x.end(),
               {std::log(b.frequency_hz), std::log(b.numerator_damping), std::log(b.denominator_damping)});
    return x;
  }

  /// Near the resonance and beyond it, where the least stands often (docs/methods/tune.md 6.2), near the
  /// anti-resonance, and anywhere.
  std::vector<Point> first_points(const std::vector<Biquad>& starts) const {
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
    return points;
  }

  static constexpr double kCoarse = 0.5;
  Machines& machines_;
  Machines coarse_;
  bool on_all_lines_ = false;
  const Bounds& bounds_;
  const FilterSearch& how_;
  std::vector<Biquad> found_;
  std::vector<Range> ranges_;
};

}  // namespace

std::optional<FilteredDesign> search_filters(Machines& machines, const Bounds& bounds,
                                             const FilterSearch& how, const std::vector<Biquad>& starts) {
  std::optional<FilteredDesign> best;
  const auto search_beside = [&](std::vector<Biquad> others) {
    auto found = FilterSearcher(machines, bounds, how, std::move(others)).run(starts);
    if (found && (!best || found->iae < best->iae)) best = std::move(found);
  };
  for (int biquads = 1; biquads <= how.biquads; ++biquads) {
    search_beside(best ? best->controller.biquads : std::vector<Biquad>());
    // What was found first was found alone: each once more beside the others, while that helps.
    constexpr double kHelps = 0.995;
    for (double before = kInfinite; biquads > 1 && best && best->iae < kHelps * before;) {
      before = best->iae;
      for (std::size_t i = 0; i < best->controller.biquads.size(); ++i) {
        auto others = best->controller.biquads;
        others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
        search_beside(std::move(others));
      }
    }
  }
  return best;
}

std::optional<FilteredDesign> search_filters_again(Machines& machines, const Bounds& bounds,
                                                   const std::vector<Biquad>& from) {
  const FilterSearch how;
  return FilterSearcher(machines, bounds, how, from).again();
}

double load_step_iae(const Machine& machine, const FilteredPi& controller) {
  const auto loop = closed_loop(machine.states(), states_of(controller, machine.sample_time_s()));
  const double radius = loop.spectral_radius();
  return radius < kStableRadius ? load_step_of(loop, radius).iae : kInfinite;
}

double rough_load_step_iae(const Machine& machine, const FilteredPi& controller) {
  return rough_load_step_iae(machine, states_of(controller, machine.sample_time_s()), controller.kp);
}

double rough_load_step_iae(const Machine& machine, const ControllerStates& controller, double fast_gain) {
  // A stride of samples that is short beside the fastest swing and the crossover.
  constexpr double kShort = 1.0 / 32.0, kSettled = 1e-5, kMostSteps = 2e5, kRunaway = 1e12;
  const auto modes = machine.model().modes();
  double fastest_hz = fast_gain / (kTwoPi * machine.model().parameters.driven_inertia);
  if (!modes.empty()) fastest_hz = std::max(fastest_hz, modes.back().frequency_hz.value);
  double step = machine.sample_time_s();
  const auto loop = closed_loop(machine.states(), controller);
  const Eigen::Index n = loop.a.rows();
  Eigen::MatrixXd over = Eigen::MatrixXd::Zero(n + 1, n + 1);
  over.topLeftCorner(n, n) = loop.a;
  over.topRightCorner(n, 1) = -loop.load_torque;
  over(n, n) = 1.0;
  for (; 2.0 * step * fastest_hz < kShort; step *= 2.0) over = (over * over).eval();
  Eigen::VectorXd state = Eigen::VectorXd::Zero(n + 1), next(n + 1);
  state(n) = 1.0;
  const double while_quiet = std::ceil(0.1 / step) + 10.0;
  double iae = 0.0, peak = 0.0, quiet = 0.0;
  for (double k = 0.0; k < kMostSteps && quiet < while_quiet; ++k) {
    next.noalias() = over * state;
    state.swap(next);
    const double size = std::abs(loop.load.dot(state.head(n)));
    if (!(size < kRunaway)) return kInfinite;
    iae += step * size;
    peak = std::max(peak, size);
    quiet = size < kSettled * peak ? quiet + 1.0 : 0.0;
  }
  return iae;
}

}  // namespace resonid::design
