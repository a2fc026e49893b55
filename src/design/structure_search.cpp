// SPDX-License-Identifier: MIT
#include "design/structure_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "design/closed_loop.hpp"
#include "design/figures.hpp"
#include "design/filter_search.hpp"

namespace resonid::design {
namespace {

constexpr double kUnusable = std::numeric_limits<double>::infinity();

class StructureSearcher {
 public:
  StructureSearcher(Machines& machines, const Bounds& bounds, const MakeController& make)
      : machines_(machines), bounds_(bounds), make_(make) {}

  std::optional<StructureDesign> run(std::vector<GlobalSearch::Range> ranges,
                                     const GlobalSearch::Effort& effort,
                                     std::vector<GlobalSearch::Point> starts,
                                     const GlobalSearch::Point& from) {
    GlobalSearch search(
        std::move(ranges), [this](const auto& x) { return cost(x); }, effort);
    StructureDesign best{from.empty() ? search.run(std::move(starts)) : search.descend_all({from}), 0.0, 0.0};
    if (!std::isfinite(search.cost(best.point))) return std::nullopt;
    // With the lines that were missing, from where it stands, until a narrow simplex finds nothing better.
    constexpr int kRounds = 12;
    double before = kUnusable;
    for (int round = 0; round < kRounds; ++round) {
      const bool met = exchange(best.point) < kMet;
      const double now = search.cost(best.point);
      if (met && now > (1.0 - 1e-4) * before) break;
      before = now;
      best.point = search.descend(best.point, round % 2 == 0 ? 0.1 : 0.03);
    }
    best.exceeded = exchange(best.point);
    best.iae = mean_iae(*make_(best.point));
    return best;
  }

 private:
  static constexpr double kMet = 1e-4;

  [[nodiscard]] double mean_iae(const LinearController& controller) const {
    double sum = 0.0;
    for (const Machine& machine : machines_.all) {
      const ClosedLoop loop = closed_loop(machine.states(), controller.states());
      const double radius = loop.spectral_radius();
      if (!(radius < kSlowest)) return kUnusable;
      sum += load_step_of(loop, radius).iae;
    }
    return sum / static_cast<double>(machines_.all.size());
  }
  /// The same to a few thousandths where a bound tells how fast a loop may be.
  [[nodiscard]] double quick_iae(const LinearController& controller) const {
    if (!bounds_.controller_sensitivity) return mean_iae(controller);
    double sum = 0.0;
    for (const Machine& machine : machines_.all) {
      if (!(closed_loop(machine.states(), controller.states()).spectral_radius() < kSlowest))
        return kUnusable;
      sum += rough_load_step_iae(machine, controller.states(), *bounds_.controller_sensitivity);
    }
    return sum / static_cast<double>(machines_.all.size());
  }
  /// A pole nearer to the circle makes a simulation that does not end.
  static constexpr double kSlowest = 1.0 - 1e-5;

  [[nodiscard]] double excess(const LinearController& controller) const {
    double sum = 0.0;
    for (std::size_t m = 0; m < machines_.all.size(); ++m) {
      const auto& lines = machines_.lines[m].lines();
      const auto c = controller.at(machines_.lines[m].frequencies_hz());
      for (const Transfer transfer : kTransfers) {
        const auto bound = bound_of(bounds_, transfer);
        if (!bound) continue;
        double largest = 0.0;
        for (std::size_t i = 0; i < lines.size(); ++i) {
          const LoopFunctions::Values v{c[i] * lines[i].plant.measured, c[i], lines[i].plant.load, c[i],
                                        lines[i].beyond};
          largest = std::max(largest, v.size_of(transfer));
        }
        sum += std::max(0.0, largest / *bound - 1.0);
      }
    }
    return sum;
  }

  /// Steep enough for the least to stand at the bounds rather than beyond them.
  [[nodiscard]] double cost(const GlobalSearch::Point& x) const {
    constexpr double kSteep = 30.0;
    const auto controller = make_(x);
    if (!controller) return kUnusable;
    const double iae = quick_iae(*controller);
    return std::isfinite(iae) ? iae * (1.0 + kSteep * excess(*controller)) : kUnusable;
  }

  /// Adds the frequencies between lines at which a bound is nearly reached. By how much one is exceeded.
  double exchange(const GlobalSearch::Point& x) {
    constexpr double kNearly = 0.95;
    const LinearController controller = *make_(x);
    double worst = 0.0;
    for (std::size_t m = 0; m < machines_.all.size(); ++m) {
      const LoopFunctions loop(machines_.all[m].response(), controller, machines_.all[m].known_to_hz());
      std::vector<double> added;
      for (const auto& peak : loop.peaks(machines_.lines[m].frequencies_hz(), bounds_, kNearly)) {
        worst = std::max(worst, peak.value / peak.bound - 1.0);
        added.push_back(peak.frequency_hz);
      }
      machines_.lines[m].add(machines_.all[m], added);
    }
    return worst;
  }

  Machines& machines_;
  const Bounds& bounds_;
  const MakeController& make_;
};

}  // namespace

std::optional<StructureDesign> search_structure(Machines& machines, const Bounds& bounds,
                                                const MakeController& make,
                                                std::vector<GlobalSearch::Range> ranges,
                                                const GlobalSearch::Effort& effort,
                                                std::vector<GlobalSearch::Point> starts,
                                                const GlobalSearch::Point& from) {
  return StructureSearcher(machines, bounds, make).run(std::move(ranges), effort, std::move(starts), from);
}

}  // namespace resonid::design
