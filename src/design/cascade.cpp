// SPDX-License-Identifier: MIT
#include "design/cascade.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "design/closed_loop.hpp"
#include "design/course.hpp"
#include "linalg/parallel.hpp"

namespace resonid::design {
namespace {

constexpr double kNoError = std::numeric_limits<double>::infinity();

/// Rows in [1, kv, 0].
QuadraticRows rows_in_kv(const Machines& machines, const FilteredPi& velocity, const Bounds& bounds) {
  QuadraticRows rows;
  const std::complex<double> one(1.0), none(0.0);
  for (std::size_t m = 0; m < machines.all.size(); ++m) {
    const auto& lines = machines.lines[m].lines();
    const auto controller =
        LinearController(velocity, machines.all[m].sample_time_s()).at(machines.lines[m].frequencies_hz());
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const auto c = controller[i], qc = c * lines[i].integrator;
      const auto measured = lines[i].plant.measured, load = lines[i].plant.load;
      const std::array loop = {one + c * measured, qc * measured, none};
      if (bounds.sensitivity) rows.add(loop, {one, none, none}, *bounds.sensitivity);
      if (bounds.complementary) rows.add(loop, {c * measured, qc * measured, none}, *bounds.complementary);
      if (bounds.load_transfer) rows.add(loop, {none, qc * load, none}, *bounds.load_transfer);
      if (bounds.controller_sensitivity) rows.add(loop, {c, qc, none}, *bounds.controller_sensitivity);
      if (bounds.disk) rows.add(loop, {one - c * measured, -qc * measured, none}, *bounds.disk);
      if (bounds.beyond_band && lines[i].beyond > 0.0)
        rows.add({one, none, none}, {lines[i].beyond * c * measured, lines[i].beyond * qc * measured, none},
                 *bounds.beyond_band);
    }
  }
  return rows;
}

bool is_stable(const Machines& machines, const Cascade& cascade) {
  return std::all_of(machines.all.begin(), machines.all.end(), [&](const Machine& machine) {
    const double step = machine.sample_time_s();
    return closed_loop(machine.states(), linear_controller(cascade, step).states()).is_stable();
  });
}

/// On the lines as they stand; poles at half of it, as they are for every gain up to it
/// (docs/methods/tune.md 4.3).
std::optional<double> kv_on_lines(const Machines& machines, const FilteredPi& velocity,
                                  const Bounds& bounds) {
  const double kv = rows_in_kv(machines, velocity, bounds).largest_proportional();
  if (!(kv > 0.0) || !std::isfinite(kv) || !is_stable(machines, {velocity, 0.5 * kv})) return std::nullopt;
  return kv;
}

/// Adds the frequencies between lines at which a bound is nearly reached. By how much one is exceeded.
double exchange_lines(Machines& machines, const Cascade& cascade, const Bounds& bounds) {
  constexpr double kNearly = 0.9;
  double worst = 0.0;
  for (std::size_t m = 0; m < machines.all.size(); ++m) {
    const Machine& machine = machines.all[m];
    const LoopFunctions loop(machine.response(), linear_controller(cascade, machine.sample_time_s()),
                             machine.known_to_hz());
    std::vector<double> added;
    for (const auto& peak : loop.peaks(machines.lines[m].frequencies_hz(), bounds, kNearly)) {
      worst = std::max(worst, peak.value / peak.bound - 1.0);
      added.push_back(peak.frequency_hz);
    }
    machines.lines[m].add(machine, added);
  }
  return worst;
}

/// Gains of the velocity loop as shares, 0 ... 1, of the largest that meet the bounds with kv = 0.
class CascadeSearch {
 public:
  CascadeSearch(Machines& machines, const Bounds& bounds, const std::vector<Biquad>& biquads)
      : machines_(machines), bounds_(bounds), biquads_(biquads) {
    Bounds inner = bounds;
    inner.load_transfer.reset();
    for (std::size_t m = 0; m < machines.all.size(); ++m) {
      const auto& lines = machines.lines[m].lines();
      const auto filter =
          filter_values(biquads, machines.lines[m].frequencies_hz(), machines.all[m].sample_time_s());
      for (std::size_t i = 0; i < lines.size(); ++i) inner_.add(lines[i], filter[i], inner);
    }
    largest_kp_ = inner_.largest_proportional();
  }

  std::optional<CascadeDesign> run() {
    if (!std::isfinite(largest_kp_)) return std::nullopt;
    Best best = zoomed();
    if (!std::isfinite(best.iae)) return std::nullopt;
    constexpr double kMet = 1e-9;
    constexpr int kRounds = 6;
    for (int round = 0; round < kRounds; ++round) {
      if (exchange_lines(machines_, best.cascade, bounds_) <= kMet) break;
      best = around(best.x, best.y, 1e-3, 2);  // the new lines take something off near the best
      if (!std::isfinite(best.iae)) return std::nullopt;
    }
    const auto kv = largest_kv(machines_, best.cascade.velocity, bounds_);
    if (!kv) return std::nullopt;
    best.cascade.kv = *kv;
    return CascadeDesign{best.cascade, mean_iae(best.cascade)};
  }

 private:
  struct Best {
    double x = 0.0, y = 0.0;
    Cascade cascade;
    double iae = kNoError;
  };

  [[nodiscard]] double mean_iae(const Cascade& cascade) const {
    double sum = 0.0;
    for (const Machine& machine : machines_.all) sum += position_step_of(machine, cascade).iae;
    return sum / static_cast<double>(machines_.all.size());
  }

  [[nodiscard]] Best at(double x, double y, double least) const {
    Best found{x, y, {{x * largest_kp_, 0.0, biquads_}, 0.0}, kNoError};
    const double largest_ki = inner_.largest_integral(found.cascade.velocity.kp);
    if (!(x > 0.0 && x < 1.0 && y > 0.0 && y < 1.0 && largest_ki > 0.0 && std::isfinite(largest_ki)))
      return found;
    found.cascade.velocity.ki = y * largest_ki;
    const auto kv = kv_on_lines(machines_, found.cascade.velocity, bounds_);
    // The integrated error is 1/(ki kv), and the absolute one is no smaller: most need no simulation.
    if (!kv || 1.0 / (found.cascade.velocity.ki * *kv) >= least) return found;
    found.cascade.kv = *kv;
    found.iae = mean_iae(found.cascade);
    return found;
  }

  /// The best of 2 half + 1 values of either share.
  [[nodiscard]] Best around(double x, double y, double distance, int half) const {
    const int side = 2 * half + 1;
    std::vector<Best> found(static_cast<std::size_t>(side));
    linalg::for_each_index(found.size(), 0, [&](std::size_t i) {
      for (int j = 0; j < side; ++j) {
        Best one = at(x + distance * (static_cast<int>(i) - half), y + distance * (j - half), found[i].iae);
        if (one.iae < found[i].iae) found[i] = std::move(one);
      }
    });
    return *std::min_element(found.begin(), found.end(),
                             [](const Best& a, const Best& b) { return a.iae < b.iae; });
  }

  /// The least lies in a narrow bent valley: nearer only when no neighbour is better.
  [[nodiscard]] Best zoomed() const {
    constexpr int kHalf = 16, kMost = 200;
    double distance = 0.5 / (kHalf + 0.5);
    Best best = around(0.5, 0.5, distance, kHalf);
    for (int round = 0; round < kMost && distance > 2e-5 && std::isfinite(best.iae); ++round) {
      Best nearer = around(best.x, best.y, 0.5 * distance, 2);
      if (nearer.iae < best.iae * (1.0 - 1e-6))
        best = std::move(nearer);
      else
        distance *= 0.5;
    }
    return best;
  }

  Machines& machines_;
  const Bounds& bounds_;
  const std::vector<Biquad>& biquads_;
  QuadraticRows inner_;
  double largest_kp_ = 0.0;
};

}  // namespace

LinearController linear_controller(const Cascade& cascade, double sample_time_s) {
  const double kv = cascade.kv;
  const LinearController velocity(cascade.velocity, sample_time_s);
  ControllerStates sum{Eigen::MatrixXd::Ones(1, 1), Eigen::VectorXd::Constant(1, sample_time_s),
                       Eigen::RowVectorXd::Constant(1, kv), 1.0 + kv * sample_time_s};
  const auto times = [=](double through) {
    return [=](std::span<const double> frequencies_hz) {
      auto values = velocity.at(frequencies_hz);
      for (std::size_t i = 0; i < values.size(); ++i)
        values[i] *= through + kv * integrator_at(frequencies_hz[i], sample_time_s);
      return values;
    };
  };
  LinearController both(in_series(sum, velocity.states()), times(1.0));
  both.set_reference_response(times(0.0));
  return both;
}

Bounds default_cascade_bounds() {
  Bounds bounds;
  bounds.sensitivity = 1.4;
  bounds.load_transfer = 1.05;
  return bounds;
}

PositionStep position_step_of(const Machine& machine, const Cascade& cascade) {
  const double step = machine.sample_time_s();
  const ClosedLoop loop = closed_loop(machine.states(), linear_controller(cascade, step).states());
  const double radius = loop.spectral_radius();
  if (!(radius < kStableRadius)) return {kNoError, kNoError, kNoError};
  // The position is the sum of the velocities, this sample's with them.
  const Eigen::Index n = loop.a.rows();
  Eigen::RowVectorXd output(n + 1);
  output << step * loop.measured, 1.0;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n + 1, n + 1);
  a.topLeftCorner(n, n) = loop.a;
  a.bottomRows(1) = output;
  Eigen::VectorXd input = Eigen::VectorXd::Zero(n + 1);
  input.head(n) = -loop.load_torque;
  constexpr double kSettled = 1e-9;
  const auto while_quiet = static_cast<std::size_t>(std::ceil(0.1 / step)) + 100;
  const auto course = course_of(a, input, output, radius, kSettled, while_quiet);
  PositionStep found;
  found.iae = step * course.absolute;
  found.ie = -step * course.sum;
  found.peak = std::max(course.highest, -course.lowest);
  return found;
}

std::optional<double> largest_kv(Machines& machines, const FilteredPi& velocity, const Bounds& bounds) {
  constexpr double kMet = 1e-9;
  constexpr int kRounds = 12;
  std::optional<double> kv;
  for (int round = 0; round < kRounds; ++round) {
    kv = kv_on_lines(machines, velocity, bounds);
    if (!kv || exchange_lines(machines, {velocity, *kv}, bounds) <= kMet) break;
  }
  return kv;
}

std::optional<CascadeDesign> search_cascade(Machines& machines, const Bounds& bounds,
                                            const std::vector<Biquad>& biquads) {
  return CascadeSearch(machines, bounds, biquads).run();
}

}  // namespace resonid::design
