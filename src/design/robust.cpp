// SPDX-License-Identifier: MIT
#include "design/robust.hpp"

#include <algorithm>
#include <cmath>

#include "design/normal.hpp"
#include "linalg/parallel.hpp"

namespace resonid::design {
namespace {

class Climber {
 public:
  Climber(const Posterior& posterior, const LinearController& controller, Transfer transfer, double radius)
      : posterior_(posterior),
        controller_(controller),
        transfer_(transfer),
        radius_(radius),
        lines_hz_(first_lines_hz(posterior.nominal(), 0.5)) {}

  WorstCase run() const {
    const WorstCase nominal = at(Eigen::VectorXd::Zero(posterior_.dimension()));
    const Eigen::VectorXd slope = gradient(nominal);
    std::vector<Eigen::VectorXd> starts = {slope, -slope};
    StandardNormal normal(1);
    constexpr int kRandom = 4;
    for (int i = 0; i < kRandom; ++i) starts.push_back(normal.next(posterior_.dimension()));
    std::vector<WorstCase> found(starts.size(), nominal);
    linalg::for_each_index(starts.size(), 0, [&](std::size_t i) {
      if (starts[i].norm() > 0.0) found[i] = climb(radius_ * starts[i].normalized());
    });
    found.push_back(nominal);
    return *std::max_element(found.begin(), found.end(), [](const WorstCase& a, const WorstCase& b) {
      return a.peak.value < b.peak.value;
    });
  }

 private:
  [[nodiscard]] WorstCase at(const Eigen::VectorXd& u) const {
    const fit::SampledResponse plant(posterior_.at(u));
    return {loop_around(plant).largest(transfer_, lines_hz_), u};
  }

  /// At the frequency of the peak alone: there the maximum moves as the function does.
  [[nodiscard]] Eigen::VectorXd gradient(const WorstCase& here) const {
    constexpr double kStep = 0.02;
    Eigen::VectorXd slope(posterior_.dimension());
    for (Eigen::Index i = 0; i < slope.size(); ++i) {
      const auto size = [&](double step) {
        Eigen::VectorXd u = here.u;
        u(i) += step;
        const fit::SampledResponse plant(posterior_.at(u));
        return loop_around(plant).at(std::array{here.peak.frequency_hz}).front().size_of(transfer_);
      };
      slope(i) = (size(kStep) - size(-kStep)) / (2.0 * kStep);
    }
    return slope;
  }

  /// To the edge along the gradient, halved back towards where it was while the value does not grow.
  [[nodiscard]] WorstCase climb(const Eigen::VectorXd& from) const {
    WorstCase here = at(from);
    constexpr int kRounds = 30, kHalvings = 6;
    for (int round = 0; round < kRounds; ++round) {
      const Eigen::VectorXd slope = gradient(here);
      if (!(slope.norm() > 0.0)) break;
      Eigen::VectorXd to = radius_ * slope.normalized();
      bool grew = false;
      double gained = 0.0;
      for (int i = 0; i < kHalvings && !grew; ++i) {
        WorstCase next = at(to);
        if (next.peak.value > here.peak.value) {
          gained = next.peak.value / here.peak.value - 1.0;
          here = std::move(next);
          grew = true;
        }
        to = 0.5 * (to + here.u);
      }
      if (!grew || gained < 1e-7) break;
    }
    return here;
  }

  [[nodiscard]] LoopFunctions loop_around(const fit::SampledResponse& plant) const {
    return {plant, controller_};
  }

  const Posterior& posterior_;
  const LinearController& controller_;
  Transfer transfer_;
  double radius_;
  std::vector<double> lines_hz_;  ///< Peaks are refined between them.
};

std::vector<Transfer> bounded(const Bounds& bounds) {
  std::vector<Transfer> transfers;
  for (const Transfer transfer : kTransfers)
    if (bound_of(bounds, transfer)) transfers.push_back(transfer);
  return transfers;
}

}  // namespace

WorstCase worst_case(const Posterior& posterior, const LinearController& controller, Transfer transfer,
                     double radius) {
  return Climber(posterior, controller, transfer, radius).run();
}

MonteCarlo monte_carlo(const Posterior& posterior, const LinearController& controller, const Bounds& bounds,
                       std::size_t draws, std::uint64_t seed, double radius) {
  StandardNormal normal(seed);
  std::vector<Eigen::VectorXd> points;
  for (std::size_t i = 0; i < draws; ++i) points.push_back(normal.next(posterior.dimension()));
  if (radius > 0.0)
    for (auto& u : points) u *= radius / u.norm();
  std::vector<std::array<double, kTransfers.size()>> values(draws);
  std::vector<char> unstable(draws, 0);
  const auto transfers = bounded(bounds);
  const auto lines_hz = first_lines_hz(posterior.nominal(), 0.3);
  constexpr std::size_t kBatch = 100;
  linalg::for_each_index((draws + kBatch - 1) / kBatch, 0, [&](std::size_t batch) {
    for (std::size_t i = batch * kBatch; i < std::min(draws, (batch + 1) * kBatch); ++i) {
      const fit::DriveModel drawn = posterior.at(points[i]);
      const fit::SampledResponse plant(drawn);
      const auto peaks = LoopFunctions(plant, controller).largest_of(transfers, lines_hz);
      bool exceeds = false;
      for (std::size_t t = 0; t < transfers.size(); ++t) {
        values[i][static_cast<std::size_t>(transfers[t])] = peaks[t].value;
        exceeds = exceeds || peaks[t].value > *bound_of(bounds, transfers[t]);
      }
      // Within the bounds no pole can have crossed the circle on the way from the nominal machine.
      if (exceeds) unstable[i] = !closed_loop(fit::sampled_states(drawn), controller.states()).is_stable();
    }
  });
  MonteCarlo found;
  found.draws = draws;
  found.exceeding_each.assign(kTransfers.size(), 0);
  found.quantile_95.assign(kTransfers.size(), 0.0);
  found.worst.assign(kTransfers.size(), 0.0);
  std::vector<char> exceeds(draws, 0);
  for (const Transfer transfer : transfers) {
    const auto t = static_cast<std::size_t>(transfer);
    std::vector<double> column(draws);
    for (std::size_t i = 0; i < draws; ++i) {
      column[i] = values[i][t];
      if (column[i] > *bound_of(bounds, transfer)) {
        exceeds[i] = 1;
        ++found.exceeding_each[t];
      }
    }
    std::sort(column.begin(), column.end());
    if (draws == 0) continue;
    found.quantile_95[t] =
        column[std::min(draws - 1, static_cast<std::size_t>(0.95 * static_cast<double>(draws)))];
    found.worst[t] = column.back();
  }
  found.exceeding = static_cast<std::size_t>(std::count(exceeds.begin(), exceeds.end(), 1));
  found.unstable = static_cast<std::size_t>(std::count(unstable.begin(), unstable.end(), 1));
  return found;
}

std::optional<RobustDesign> robust_gains(const Posterior& posterior, std::span<const Biquad> biquads,
                                         const Bounds& bounds, double radius) {
  constexpr double kMet = 1e-3;
  constexpr int kRounds = 12;
  std::vector<Machine> machines = {Machine(posterior.nominal())};
  RobustDesign design;
  design.radius = radius;
  for (int round = 0; round < kRounds; ++round) {
    Machines all(machines);
    const auto gains = largest_integral_gain(all, biquads, bounds);
    if (!gains) return std::nullopt;
    design.controller = {gains->kp, gains->ki, {biquads.begin(), biquads.end()}};
    design.machines = machines.size();
    design.worst.clear();
    bool met = true;
    for (const Transfer transfer : bounded(bounds)) {
      auto worst = worst_case(posterior, design.controller, transfer, radius);
      worst.peak.bound = *bound_of(bounds, transfer);
      if (worst.peak.value > (1.0 + kMet) * worst.peak.bound) {
        met = false;
        machines.emplace_back(posterior.at(worst.u));
      }
      design.worst.push_back(std::move(worst));
    }
    if (met) return design;
  }
  return std::nullopt;
}

std::optional<ConfidentDesign> confident_gains(const Posterior& posterior, std::span<const Biquad> biquads,
                                               const Bounds& bounds, double confidence, std::size_t draws,
                                               std::uint64_t seed) {
  constexpr int kRounds = 8;
  constexpr double kLeast = 0.8;  // of the allowed probability: no need to come nearer
  const double allowed = 1.0 - confidence;
  std::optional<ConfidentDesign> best;
  double low = 0.0, high = 0.0, radius = 2.0;
  for (int round = 0; round < kRounds; ++round) {
    auto design = robust_gains(posterior, biquads, bounds, radius);
    if (!design) {
      high = radius;
      radius = 0.5 * (low + high);
      continue;
    }
    auto check = monte_carlo(posterior, design->controller, bounds, draws, seed);
    const double probability = check.probability();
    if (probability <= allowed && (!best || radius < best->design.radius)) best = {*std::move(design), check};
    if (probability <= allowed && probability >= kLeast * allowed) break;
    (probability > allowed ? low : high) = radius;
    radius = high > 0.0 ? 0.5 * (low + high) : 1.25 * radius;
  }
  return best;
}

}  // namespace resonid::design
