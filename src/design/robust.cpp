// SPDX-License-Identifier: MIT
#include "design/robust.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "design/loop_survey.hpp"
#include "design/normal.hpp"
#include "linalg/parallel.hpp"

namespace resonid::design {
namespace {

class Climber {
 public:
  Climber(const Posterior& posterior, const LinearController& controller, Transfer transfer, double radius)
      : posterior_(posterior),
        transfer_(transfer),
        radius_(radius),
        survey_(controller, first_lines_hz(posterior.nominal(), controller, 0.5, posterior.known_to_hz()),
                posterior.nominal().sample_time_s, posterior.known_to_hz()) {}

  WorstCase run() const {
    const WorstCase nominal = at(Eigen::VectorXd::Zero(posterior_.dimension()));
    const Eigen::VectorXd slope = gradient(nominal, true), steeper = gradient(nominal, false);
    std::vector<Eigen::VectorXd> starts = {slope, -slope};
    if ((steeper - slope).norm() > 1e-6 * slope.norm()) starts.push_back(steeper);
    StandardNormal normal(1);
    constexpr int kRandom = 4;
    for (int i = 0; i < kRandom; ++i) starts.push_back(normal.next(posterior_.dimension()));
    const auto edges = has_edge(nominal) ? whole_samples() : std::vector<Region>{};
    constexpr std::size_t kAlongEdge = 2;
    const std::size_t free = starts.size(), climbs = free + kAlongEdge * edges.size();
    std::vector<WorstCase> found(climbs, nominal);
    linalg::for_each_index(climbs, 0, [&](std::size_t i) {
      if (i >= free) {
        const Region& edge = edges[(i - free) / kAlongEdge];
        const bool up = (i - free) % kAlongEdge == 0;
        found[i] = climb(edge.along(up ? slope : Eigen::VectorXd(-slope)), edge);
      } else if (starts[i].norm() > 0.0) {
        found[i] =
            climb(radius_ * starts[i].normalized(), {Eigen::VectorXd::Zero(slope.size()), {}, radius_});
      }
    });
    found.push_back(nominal);
    return *std::max_element(found.begin(), found.end(), [](const WorstCase& a, const WorstCase& b) {
      return a.peak.value < b.peak.value;
    });
  }

 private:
  /// The ellipsoid, or what a plane leaves of it, which has a normal.
  struct Region {
    Eigen::VectorXd centre, normal;
    double radius = 0.0;

    /// Its point farthest along a direction.
    [[nodiscard]] Eigen::VectorXd along(Eigen::VectorXd direction) const {
      if (normal.size() > 0) direction -= direction.dot(normal) * normal;
      const double size = direction.norm();
      return size > 0.0 ? Eigen::VectorXd(centre + radius / size * direction) : centre;
    }
  };

  /// At half the rate, where |C S| is largest, sizes have an edge over delays of whole samples, and climbs
  /// leave it to either side.
  [[nodiscard]] bool has_edge(const WorstCase& nominal) const {
    constexpr double kNearly = 0.9;
    return transfer_ == Transfer::controller_sensitivity ||
           2.0 * nominal.peak.frequency_hz * posterior_.nominal().sample_time_s >= kNearly;
  }
  /// What planes of whole samples leave of the ellipsoid, the nearest to its middle first: |C S| at half the
  /// rate is largest on every other one.
  [[nodiscard]] std::vector<Region> whole_samples() const {
    const auto delay_at = [&](const Eigen::VectorXd& u) {
      const auto model = posterior_.at(u);
      return (model.known_delay_s + model.delay_s) / model.sample_time_s;
    };
    const Eigen::Index n = posterior_.dimension();
    const double nominal = delay_at(Eigen::VectorXd::Zero(n));
    Eigen::VectorXd normal(n);
    for (Eigen::Index i = 0; i < n; ++i) {  // a delay that would be negative is none
      const Eigen::VectorXd unit = Eigen::VectorXd::Unit(n, i);
      const double up = delay_at(unit) - nominal, down = nominal - delay_at(-unit);
      normal(i) = std::abs(up) >= std::abs(down) ? up : down;
    }
    const double size = normal.norm();
    if (!(size > 0.0)) return {};
    normal /= size;
    constexpr int kMost = 8;
    const double nearest = std::round(nominal), toward = nominal < nearest ? -1.0 : 1.0;
    std::vector<Region> found;
    for (int i = 0; i < kMost; ++i) {  // by turns to both sides of the middle
      const double away = (i % 2 == 0 ? -1.0 : 1.0) * toward * ((i + 1) / 2);
      const double whole = nearest + away, off = (whole - nominal) / size;
      if (!(std::abs(off) < radius_)) break;
      if (whole >= 0.0) found.push_back({off * normal, normal, std::sqrt(radius_ * radius_ - off * off)});
    }
    return found;
  }

  [[nodiscard]] WorstCase at(const Eigen::VectorXd& u) const {
    return {survey_.largest_of(plant_at(u), {transfer_}).front(), u};
  }

  /// At the frequency of the peak alone: there the maximum moves as the function does. It may bend sharply,
  /// as over a delay of whole samples at half the rate: `straight` looks across the bend, to climb along a
  /// ridge; else up the steeper side of a valley.
  [[nodiscard]] Eigen::VectorXd gradient(const WorstCase& here, bool straight) const {
    constexpr double kStep = 0.02;
    Eigen::VectorXd slope(posterior_.dimension());
    for (Eigen::Index i = 0; i < slope.size(); ++i) {
      const auto size = [&](double step) {
        Eigen::VectorXd u = here.u;
        u(i) += step;
        return survey_.size_at(plant_at(u), transfer_, here.peak.frequency_hz);
      };
      const double up = size(kStep) - here.peak.value, down = size(-kStep) - here.peak.value;
      slope(i) = !straight && up > 0.0 && down > 0.0 ? (up >= down ? up : -down) / kStep
                                                     : (up - down) / (2.0 * kStep);
    }
    return slope;
  }

  /// To the edge along the gradient, halved back towards where it was while the value does not grow.
  [[nodiscard]] WorstCase climb(const Eigen::VectorXd& from, const Region& region) const {
    WorstCase here = at(from);
    constexpr int kRounds = 30, kHalvings = 6;
    for (int round = 0; round < kRounds; ++round) {
      const Eigen::VectorXd slope = gradient(here, region.normal.size() > 0);
      if (!(slope.norm() > 0.0)) break;
      Eigen::VectorXd to = region.along(slope);
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

  [[nodiscard]] RationalResponse plant_at(const Eigen::VectorXd& u) const {
    return RationalResponse(fit::sampled_states(posterior_.at(u)));
  }

  const Posterior& posterior_;
  Transfer transfer_;
  double radius_;
  LoopSurvey survey_;
};

}  // namespace

WorstCase worst_case(const Posterior& posterior, const LinearController& controller, Transfer transfer,
                     double radius) {
  return Climber(posterior, controller, transfer, radius).run();
}

MonteCarlo monte_carlo(const Posterior& posterior, const LinearController& controller, const Bounds& bounds,
                       std::size_t draws, std::uint64_t seed, double radius) {
  constexpr double kMet = 1.0 + 1e-8;      // what exact gains leave between lines
  constexpr double kClearly = 1.0 + 2e-3;  // more than an active set leaves
  StandardNormal normal(seed);
  std::vector<Eigen::VectorXd> points;
  for (std::size_t i = 0; i < draws; ++i) points.push_back(normal.next(posterior.dimension()));
  if (radius > 0.0)
    for (auto& u : points) u *= radius / u.norm();
  std::vector<std::array<double, kTransfers.size()>> values(draws);
  std::vector<char> unstable(draws, 0);
  const auto transfers = bounded_transfers(bounds);
  const LoopSurvey survey(controller,
                          first_lines_hz(posterior.nominal(), controller, 0.3, posterior.known_to_hz()),
                          posterior.nominal().sample_time_s, posterior.known_to_hz());
  // Bounds tell stability only of machines that are reached from a stable one.
  const bool told_by_bounds =
      closed_loop(fit::sampled_states(posterior.nominal()), controller.states()).is_stable();
  constexpr std::size_t kBatch = 100;
  linalg::for_each_index((draws + kBatch - 1) / kBatch, 0, [&](std::size_t batch) {
    for (std::size_t i = batch * kBatch; i < std::min(draws, (batch + 1) * kBatch); ++i) {
      const fit::SampledStates drawn = fit::sampled_states(posterior.at(points[i]));
      const auto peaks = survey.largest_of(RationalResponse(drawn), transfers);
      bool exceeds = false;
      for (std::size_t t = 0; t < transfers.size(); ++t) {
        values[i][static_cast<std::size_t>(transfers[t])] = peaks[t].value;
        exceeds = exceeds || peaks[t].value > kMet * *bound_of(bounds, transfers[t]);
      }
      // Within the bounds no pole can have crossed the circle on the way from the nominal machine.
      if (exceeds || !told_by_bounds) unstable[i] = !closed_loop(drawn, controller.states()).is_stable();
    }
  });
  MonteCarlo found;
  found.draws = draws;
  found.exceeding_each.assign(kTransfers.size(), 0);
  found.quantile_95.assign(kTransfers.size(), 0.0);
  found.worst.assign(kTransfers.size(), 0.0);
  std::vector<char> exceeds(draws, 0);
  const auto keep_nearest = [&](const Eigen::VectorXd& u) {
    if (found.nearest_exceeding.size() == 0 || u.norm() < found.nearest_exceeding.norm())
      found.nearest_exceeding = u;
  };
  for (const Transfer transfer : transfers) {
    const auto t = static_cast<std::size_t>(transfer);
    std::vector<double> column(draws);
    for (std::size_t i = 0; i < draws; ++i) {
      column[i] = values[i][t];
      if (column[i] > kMet * *bound_of(bounds, transfer)) {
        exceeds[i] = 1;
        if (column[i] > kClearly * *bound_of(bounds, transfer)) keep_nearest(points[i]);
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
  for (std::size_t i = 0; i < draws; ++i)
    if (unstable[i])
      found.nearest_unstable = std::min(found.nearest_unstable.value_or(points[i].norm()), points[i].norm());
  return found;
}

}  // namespace resonid::design
