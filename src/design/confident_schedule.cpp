// SPDX-License-Identifier: MIT
#include "design/confident_schedule.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "design/figures.hpp"

namespace resonid::design {
namespace {

class ScheduleSearch {
 public:
  ScheduleSearch(const PosteriorAt& posterior_at, const Stroke& stroke,
                 const ConfidentScheduleOptions& options)
      : posterior_at_(posterior_at), stroke_(stroke), options_(options) {
    draws_ = std::min(kFewDraws, options.confidence.draws);
    std::vector<double> positions = options.further;
    for (std::size_t i = 0; i < options.count; ++i) positions.push_back(stroke.even(i, options.count));
    std::sort(positions.begin(), positions.end());
    for (const double position : positions)
      if (position >= stroke.from && position <= stroke.to &&
          (places_.empty() || position > places_.back().looked.position))
        places_.push_back({{position, 0.0, {}, {}, 0.0}, true});
  }

  expected<ConfidentSchedule> run() {
    for (std::size_t i = 0; i < options_.first_nodes; ++i) {
      auto node = node_at(stroke_.even(i, options_.first_nodes));
      if (!node) return tl::unexpected(node.error());
      nodes_.push_back(*std::move(node));
    }
    constexpr int kRounds = 120;
    double worst_position = stroke_.from;
    for (int round = 0; round < kRounds; ++round) {
      look();
      const auto worst = std::max_element(places_.begin(), places_.end(), [&](const auto& a, const auto& b) {
        return excess_of(a.looked) < excess_of(b.looked);
      });
      worst_position = worst->looked.position;
      if (excess_of(worst->looked) > 0.0) {
        if (auto done = improve(worst->looked); !done) return tl::unexpected(done.error());
      } else if (draws_ < options_.confidence.draws) {
        draws_ = options_.confidence.draws;
        for (Place& place : places_) place.stale = true;
      } else {
        return found();
      }
    }
    return refuse("confidence", "must be lower for the bounds to be met between nodes, too", worst_position);
  }

 private:
  static constexpr std::size_t kFewDraws = 2000;

  struct Node {
    ScheduleNode gains;
    double radius = 0.0;
    Bounds bounds;  ///< Those of the options, and what of |C S| the noise leaves.
  };
  struct Place {
    FrozenCheck looked;
    bool stale;
  };

  [[nodiscard]] bool of_ellipsoid() const { return options_.confidence.guarantee == Guarantee::ellipsoid; }
  [[nodiscard]] double allowed() const {
    return allowed_share(options_.confidence.probability, options_.confidence.draws);
  }

  static tl::unexpected<Error> no_gain_at(double position) {
    return refuse("bounds", "must be met by some gain at every position", position);
  }

  /// Few draws will do: what they miss is found with all of them.
  expected<Node> node_at(double position) const {
    const Posterior posterior = posterior_at_(position);
    Confidence confidence = options_.confidence;
    confidence.draws = std::min(kFewDraws, confidence.draws);
    Node node{{position, 0.0, 0.0}, 0.0, options_.bounds};
    constexpr int kRounds = 8;
    for (int round = 0; round < kRounds; ++round) {
      const auto found = confident_design(posterior, {.biquads = 0}, node.bounds, confidence);
      if (!found) break;
      put(node, found->design);
      if (noise_is_met(noise_gain_of(posterior, node))) return node;
      quieten(posterior, node);
    }
    return no_gain_at(position);
  }

  static void put(Node& node, const RobustDesign& design) {
    node.gains.kp = design.controller.kp;
    node.gains.ki = design.controller.ki;
    node.radius = design.radius;
  }

  [[nodiscard]] bool noise_is_met(double noise_gain) const {
    return !options_.most_noise_gain || noise_gain <= *options_.most_noise_gain;
  }
  [[nodiscard]] double noise_gain_of(const Posterior& posterior, const Node& node) const {
    return options_.most_noise_gain ? figures_of(Machine(posterior.nominal()), pi_of(node.gains)).noise_gain
                                    : 0.0;
  }
  static FilteredPi pi_of(const ScheduleNode& gains) { return {gains.kp, gains.ki, {}}; }

  /// Less |C S| than there is, in the measure of the noise that is too much.
  void quieten(const Posterior& posterior, Node& node) const {
    const auto figures = figures_of(Machine(posterior.nominal()), pi_of(node.gains));
    const double size = figures.peak(Transfer::controller_sensitivity).value;
    const double bound = std::min(size, node.bounds.controller_sensitivity.value_or(size));
    constexpr double kAtMost = 0.97;
    node.bounds.controller_sensitivity =
        bound * std::min(kAtMost, *options_.most_noise_gain / figures.noise_gain);
  }

  /// The same radius, or another one.
  expected<void> redesign(Node& node, double radius) const {
    const auto design = robust_gains(posterior_at_(node.gains.position), {}, node.bounds, radius);
    if (!design) return no_gain_at(node.gains.position);
    put(node, *design);
    return {};
  }

  /// Nodes around a position: the one before, and the share of the way to the next.
  [[nodiscard]] std::pair<std::size_t, double> between(double position) const {
    std::size_t i = 0;
    while (i + 2 < nodes_.size() && nodes_[i + 1].gains.position <= position) ++i;
    const double from = nodes_[i].gains.position, to = nodes_[i + 1].gains.position;
    return {i, std::clamp((position - from) / (to - from), 0.0, 1.0)};
  }

  [[nodiscard]] GainSchedule schedule() const {
    std::vector<ScheduleNode> gains;
    for (const Node& node : nodes_) gains.push_back(node.gains);
    return GainSchedule(std::move(gains));
  }

  void look() {
    const GainSchedule gains = schedule();
    for (Place& place : places_) {
      if (!std::exchange(place.stale, false)) continue;
      FrozenCheck& here = place.looked;
      const Posterior posterior = posterior_at_(here.position);
      const FilteredPi controller = gains.at(here.position);
      const auto at = between(here.position);
      here.radius = of_ellipsoid() ? ellipsoid_radius(options_.confidence.probability, posterior.dimension())
                                   : nodes_[at.first].radius +
                                         at.second * (nodes_[at.first + 1].radius - nodes_[at.first].radius);
      here.check = monte_carlo(posterior, controller, options_.bounds, draws_, options_.confidence.seed);
      if (of_ellipsoid()) put_worst(posterior, controller, here);
      if (options_.most_noise_gain)
        here.noise_gain = figures_of(Machine(posterior.nominal()), controller).noise_gain;
    }
  }

  void put_worst(const Posterior& posterior, const FilteredPi& controller, FrozenCheck& here) const {
    here.worst.clear();
    for (const Transfer transfer : bounded_transfers(options_.bounds)) {
      here.worst.push_back(worst_case(posterior, controller, transfer, here.radius));
      here.worst.back().peak.bound = *bound_of(options_.bounds, transfer);
    }
  }

  /// By what a position is beyond what is allowed, relative; <= 0: it is within.
  [[nodiscard]] double excess_of(const FrozenCheck& here) const {
    constexpr double kRoom = 2e-3;  // an active set leaves half of that
    if (here.check.unstable > 0) return std::numeric_limits<double>::infinity();
    double excess = here.check.probability() / allowed() - 1.0;
    for (const WorstCase& worst : here.worst)
      excess = std::max(excess, worst.peak.value / ((1.0 + kRoom) * worst.peak.bound) - 1.0);
    if (options_.most_noise_gain)
      excess = std::max(excess, here.noise_gain / *options_.most_noise_gain - 1.0);
    return excess;
  }

  /// Far beyond: one more node. Little beyond, or nodes as dense as what is looked at: softer neighbours.
  expected<void> improve(const FrozenCheck& worst) {
    const auto [before, share] = between(worst.position);
    const double gap = nodes_[before + 1].gains.position - nodes_[before].gains.position;
    const double least_gap = 2.0 * (stroke_.to - stroke_.from) / static_cast<double>(options_.count - 1);
    const double much = of_ellipsoid() ? 0.01 : 0.3;
    if (share > 0.0 && share < 1.0 && excess_of(worst) > much && gap > least_gap &&
        nodes_.size() < options_.most_nodes) {
      auto node = node_at(nodes_[before].gains.position + 0.5 * gap);
      if (!node) return tl::unexpected(node.error());
      nodes_.insert(nodes_.begin() + static_cast<std::ptrdiff_t>(before) + 1, *std::move(node));
      return touched(before, before + 2);
    }
    const std::size_t first = share < 1.0 ? before : before + 1, last = share > 0.0 ? before + 1 : before;
    for (std::size_t i = first; i <= last; ++i)
      if (auto done = soften(nodes_[i], worst); !done) return done;
    return touched(first == 0 ? 0 : first - 1, std::min(last + 1, nodes_.size() - 1));
  }

  expected<void> soften(Node& node, const FrozenCheck& worst) const {
    if (!noise_is_met(worst.noise_gain)) {
      const Posterior posterior = posterior_at_(node.gains.position);
      quieten(posterior, node);
      return redesign(node, node.radius);
    }
    // A few per cent of the radius take a fifth off the probability.
    constexpr double kLeast = 1.02, kMost = 1.15;
    const double excess = std::min(1.0, excess_of(worst));
    return redesign(node, std::max(0.1, node.radius) * std::clamp(1.0 + 0.15 * excess, kLeast, kMost));
  }

  /// What lies between two nodes is to be looked at again.
  expected<void> touched(std::size_t first, std::size_t last) {
    const double from = nodes_[first].gains.position, to = nodes_[last].gains.position;
    for (Place& place : places_)
      place.stale = place.stale || (place.looked.position >= from && place.looked.position <= to);
    return {};
  }

  ConfidentSchedule found() {
    ConfidentSchedule design{schedule(), {}, {}};
    for (const Node& node : nodes_) design.radii.push_back(node.radius);
    for (Place& place : places_) {
      if (place.looked.worst.empty())
        put_worst(posterior_at_(place.looked.position), design.schedule.at(place.looked.position),
                  place.looked);
      design.checks.push_back(std::move(place.looked));
    }
    return design;
  }

  const PosteriorAt& posterior_at_;
  const Stroke& stroke_;
  const ConfidentScheduleOptions& options_;
  std::size_t draws_ = 0;
  std::vector<Node> nodes_;
  std::vector<Place> places_;
};

}  // namespace

const FrozenCheck& ConfidentSchedule::worst() const {
  return *std::max_element(checks.begin(), checks.end(), [](const auto& a, const auto& b) {
    return a.check.exceeding < b.check.exceeding;
  });
}

expected<ConfidentSchedule> confident_schedule(const PosteriorAt& posterior_at, const Stroke& stroke,
                                               const ConfidentScheduleOptions& options) {
  if (const auto valid =
          check_nodes(stroke, options.bounds, options.first_nodes, options.most_nodes, options.count);
      !valid)
    return tl::unexpected(valid.error());
  return ScheduleSearch(posterior_at, stroke, options).run();
}

}  // namespace resonid::design
