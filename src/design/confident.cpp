// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <resonid/base/detail/statistics.hpp>
#include <utility>

#include "design/active_set.hpp"
#include "design/figures.hpp"
#include "design/robust.hpp"

namespace resonid::design {

double ellipsoid_radius(double probability, Eigen::Index dimension) {
  if (dimension == 0) return 0.0;
  double low = 0.0, high = 100.0;
  constexpr int kHalvings = 60;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    const double outside = chi_square_tail(middle * middle, static_cast<std::size_t>(dimension));
    (outside > 1.0 - probability ? low : high) = middle;
  }
  return high;
}

double allowed_share(double probability, std::size_t draws) {
  constexpr double kOneSided = 1.645;  // 95 %
  const double share = 1.0 - probability;
  const double std = std::sqrt(share * probability / static_cast<double>(std::max<std::size_t>(draws, 1)));
  return std::max(share - kOneSided * std, 0.5 * share);
}

namespace {

/// The normal value that is exceeded with a probability.
double normal_value(double probability) {
  constexpr double kLeast = 1e-6;
  const double p = std::clamp(probability, kLeast, 1.0 - kLeast);
  const double size = two_sided_quantile(std::abs(1.0 - 2.0 * p));
  return p < 0.5 ? size : -size;
}

/// Designs for ellipsoids, with filters or without, and what the posterior says of them.
class ConfidentSearch {
 public:
  ConfidentSearch(const Posterior& posterior, const Bounds& bounds, const Confidence& confidence)
      : posterior_(posterior),
        bounds_(bounds),
        confidence_(confidence),
        nominal_(posterior.nominal(), posterior.known_to_hz()),
        active_(posterior, bounds_, 0.0) {}

  /// |CS| needs a bound, or the best filter is a lead near the Nyquist frequency (docs/methods/tune.md 6.3).
  bool bound_controller() {
    if (bounds_.controller_sensitivity) return true;
    Machines alone({nominal_});
    const auto gains = largest_integral_gain(alone, {}, bounds_);
    if (!gains) return false;
    const auto figures = figures_of(nominal_, FilteredPi{gains->kp, gains->ki, {}});
    bounds_.controller_sensitivity = 2.0 * figures.peak(Transfer::controller_sensitivity).value;
    return true;
  }

  bool search_nominal_filters(const FilterSearch& how) {
    Machines alone({nominal_});
    const auto found = search_filters(alone, bounds_, how);
    if (found) biquads_ = found->controller.biquads;
    return found.has_value();
  }

  void set_biquads(std::span<const Biquad> biquads) { biquads_.assign(biquads.begin(), biquads.end()); }

  /// At a radius, with filters searched again on the worst machines so many times.
  std::optional<RobustDesign> design_at(double radius, int searches) {
    active_.scale_to(radius);
    auto best = active_.gains(biquads_);
    // Where the gains collapse, the filter that suited another radius is to blame.
    if (searches == 0 && collapses_ < kMostCollapses && has_collapsed(best)) {
      ++collapses_;
      searches = 1;
    }
    for (int i = 0; i < searches && !biquads_.empty(); ++i) {
      const auto found = search_filters_again(active_.machines(), bounds_, biquads_);
      if (!found) break;
      auto next = active_.gains(found->controller.biquads);
      if (!next || (best && iae_of(*next) >= iae_of(*best))) continue;
      best = std::move(next);
      biquads_ = best->controller.biquads;
    }
    if (best) last_iae_ = iae_of(*best);
    return best;
  }

  /// By the whole ellipsoid. A draw inside that exceeds a bound was missed by the climbs, and joins.
  std::optional<ConfidentDesign> of_ellipsoid(int searches) {
    constexpr int kRounds = 10;
    auto design = design_at(ellipsoid_radius(confidence_.probability, posterior_.dimension()), searches);
    for (int round = 0; design && round < kRounds; ++round) {
      auto check = checked(*design, confidence_.draws);
      const bool missed =
          check.nearest_exceeding.size() > 0 && check.nearest_exceeding.norm() <= design->radius;
      if (!missed && is_stable_inside(*design, check)) return told(*std::move(design), std::move(check));
      if (!missed) return std::nullopt;
      active_.add(check.nearest_exceeding);
      design = active_.gains(biquads_);
    }
    return std::nullopt;
  }

  /// The least radius that gives the probability: few draws bring it near, all of them decide.
  std::optional<ConfidentDesign> of_probability(int searches) {
    constexpr std::size_t kFew = 2000;
    constexpr int kRounds = 12;
    constexpr double kNearly = 3.0;
    const double allowed = allowed_share(confidence_.probability, confidence_.draws);
    double radius = 2.0;
    std::size_t draws = std::min(kFew, confidence_.draws);
    std::optional<ConfidentDesign> best;
    Bracket bracket(allowed);
    for (int round = 0; round < kRounds; ++round) {
      auto design = design_at(radius, round < 2 ? searches : 0);
      if (!design) {
        radius = bracket.below(radius);
        continue;
      }
      auto check = checked(*design, draws);
      const double probability = is_stable_inside(*design, check) ? check.probability() : 1.0;
      if (probability <= kNearly * allowed) least_seen_ = std::min(least_seen_, iae_of(*design));
      const bool enough = probability <= allowed, near = enough && probability >= kLeast * allowed;
      if (draws == confidence_.draws && enough && (!best || iae_of(*design) < best->iae))
        best = told(*std::move(design), std::move(check));
      if (near && draws == confidence_.draws) break;
      if (near || bracket.is_narrow()) {
        if (draws == confidence_.draws) break;
        draws = confidence_.draws;
        bracket = Bracket(allowed);
        continue;
      }
      radius = bracket.next(radius, probability);
      if (round + 4 >= kRounds) draws = confidence_.draws;
    }
    return best;
  }

  /// Whether something much better was near to the probability: the machines that were met on the way leave
  /// none of its kind, and those of another way may.
  [[nodiscard]] bool has_lost(const std::optional<ConfidentDesign>& best) const {
    constexpr double kMuch = 1.3;
    return least_seen_ < std::numeric_limits<double>::infinity() &&
           (!best || best->iae > kMuch * least_seen_);
  }

 private:
  static constexpr double kLeast = 0.87;  ///< Of the allowed probability: no need to come nearer.

  /// Radii that are too small and too large. The normal value of the probability is nearly linear in the
  /// radius, and near to that of 60 % at none.
  class Bracket {
   public:
    explicit Bracket(double allowed) : aim_(normal_value(0.5 * (1.0 + kLeast) * allowed)) {}
    double next(double radius, double probability) {
      const double value = normal_value(probability);
      (value < aim_ ? low_ : high_) = {radius, value};
      if (high_.radius > 0.0) return between();
      const double slope = std::max(0.5, (low_.value - kAtNone) / std::max(radius, 0.1));
      return std::clamp(radius + (aim_ - value) / slope, 1.05 * radius, 2.0 * radius + 1.0);
    }
    double below(double radius) {
      high_ = {radius, high_.value};
      return 0.5 * (low_.radius + high_.radius);
    }
    [[nodiscard]] bool is_narrow() const {
      return high_.radius > 0.0 && high_.radius - low_.radius < 0.005 * high_.radius;
    }

   private:
    static constexpr double kAtNone = -0.25;
    struct End {
      double radius = 0.0, value = 0.0;
    };
    [[nodiscard]] double between() const {
      constexpr double kMargin = 0.2;  // it is not always smooth
      const double width = high_.radius - low_.radius, rise = high_.value - low_.value;
      const double part = rise > 0.0 ? (aim_ - low_.value) / rise : 0.5;
      return low_.radius + width * std::clamp(part, kMargin, 1.0 - kMargin);
    }
    double aim_;
    End low_{0.0, kAtNone}, high_{};
  };

  [[nodiscard]] bool has_collapsed(const std::optional<RobustDesign>& best) const {
    constexpr double kCollapsed = 1.1;
    return !best || iae_of(*best) > kCollapsed * last_iae_;
  }

  [[nodiscard]] double iae_of(const RobustDesign& design) const {
    return load_step_iae(nominal_, design.controller);
  }
  [[nodiscard]] MonteCarlo checked(const RobustDesign& design, std::size_t draws) const {
    return monte_carlo(posterior_, design.controller, bounds_, draws, confidence_.seed);
  }
  static bool is_stable_inside(const RobustDesign& design, const MonteCarlo& check) {
    return !check.nearest_unstable || *check.nearest_unstable > design.radius;
  }
  [[nodiscard]] ConfidentDesign told(RobustDesign design, MonteCarlo check) const {
    const double iae = iae_of(design);
    return {std::move(design), std::move(check), bounds_, iae};
  }

  const Posterior& posterior_;
  Bounds bounds_;
  const Confidence& confidence_;
  Machine nominal_;
  ActiveSet active_;
  std::vector<Biquad> biquads_;
  static constexpr int kMostCollapses = 3;
  int collapses_ = 0;
  double least_seen_ = std::numeric_limits<double>::infinity();  // of what came near to the probability
  double last_iae_ = std::numeric_limits<double>::infinity();
};

}  // namespace

std::optional<ConfidentDesign> confident_gains(const Posterior& posterior, std::span<const Biquad> biquads,
                                               const Bounds& bounds, double confidence, std::size_t draws,
                                               std::uint64_t seed) {
  const Confidence asked{confidence, Guarantee::probability, draws, seed};
  ConfidentSearch search(posterior, bounds, asked);
  search.set_biquads(biquads);
  return search.of_probability(0);
}

std::optional<ConfidentDesign> confident_design(const Posterior& posterior, const FilterSearch& how,
                                                const Bounds& bounds, const Confidence& confidence) {
  // Without a variance there is nothing to adjust.
  const bool whole = confidence.guarantee == Guarantee::ellipsoid || posterior.dimension() == 0;
  const int ways = how.biquads > 0 ? 4 : 1;
  std::optional<ConfidentDesign> best;
  for (int way = 0; way < ways; ++way) {
    ConfidentSearch search(posterior, bounds, confidence);
    FilterSearch from = how;
    from.seed += static_cast<std::uint64_t>(way);
    if (how.biquads > 0 && (!search.bound_controller() || !search.search_nominal_filters(from))) return best;
    auto found = whole ? search.of_ellipsoid(2) : search.of_probability(1);
    const bool lost = search.has_lost(found);
    if (found && (!best || found->iae < best->iae)) best = std::move(found);
    if (!lost) break;
  }
  return best;
}

}  // namespace resonid::design
