// SPDX-License-Identifier: MIT
#include "identification/tune/designs.hpp"

#include <cmath>
#include <utility>

#include "design/cascade.hpp"
#include "design/figures.hpp"
#include "design/filter_search.hpp"
#include "design/pid.hpp"
#include "design/rst.hpp"
#include "design/state_feedback.hpp"

namespace resonid::identification {
namespace {

/// By what a search with penalties may leave a bound exceeded, relative.
constexpr double kExceeded = 1e-3;

double sample_time_of(const design::Machines& machines) { return machines.all.front().sample_time_s(); }

std::optional<Law> best_pi(design::Machines& machines, const design::Bounds& bounds) {
  const auto gains = largest_integral_gain(machines, {}, bounds);
  if (!gains) return std::nullopt;
  return law_of(design::FilteredPi{gains->kp, gains->ki, {}}, sample_time_of(machines));
}

std::optional<Law> best_p(design::Machines& machines, const design::Bounds& bounds) {
  const auto gain = largest_proportional_gain(machines, bounds);
  if (!gain) return std::nullopt;
  return law_of(design::FilteredPi{gain->kp, 0.0, {}}, sample_time_of(machines));
}

std::optional<Law> best_cascade(design::Machines& machines, const design::Bounds& bounds) {
  const auto found = search_cascade(machines, bounds);
  if (!found) return std::nullopt;
  return law_of(found->cascade, sample_time_of(machines));
}

/// The derivative of one call is where the next begins.
class PidDesigner {
 public:
  PidDesigner(const design::Bounds& bounds, std::uint64_t seed) : bounds_(bounds) { effort_.seed = seed; }
  std::optional<Law> operator()(design::Machines& machines) {
    const auto found = search_pid(machines, bounds_, effort_, last_);
    if (!found) return std::nullopt;
    last_ = found->controller;
    return law_of(found->controller, sample_time_of(machines));
  }

 private:
  design::Bounds bounds_;
  design::GlobalSearch::Effort effort_ = {16, 10, 1};
  std::optional<design::Pid> last_;
};

/// Poles or weights of one call are where the next begins.
class StructureDesigner {
 public:
  StructureDesigner(ControllerStructure structure, const design::Bounds& bounds, std::uint64_t seed)
      : structure_(structure), bounds_(bounds), seed_(seed) {}
  std::optional<Law> operator()(design::Machines& machines) {
    if (structure_ == ControllerStructure::rst) return best_rst(machines);
    const auto found = search_state_feedback(machines, bounds_, {50, 40, seed_}, last_);
    if (!is_met(found)) return std::nullopt;
    return law_of(found->feedback, sample_time_of(machines));
  }

 private:
  /// A PI is an RST too, which need not be among those that the search looks at: two resonances by one factor
  /// and one damping can be more than the bounds allow. Where it is as good from the beginning on, it is not
  /// looked for others again.
  std::optional<Law> best_rst(design::Machines& machines) {
    std::optional<design::RstDesign> found;
    const bool begins = last_.empty();
    auto pi = best_pi(machines, bounds_);
    if (!pi_is_best_ || !pi) found = search_rst(machines, bounds_, {}, {40, 40, seed_}, last_);
    const bool met = is_met(found);
    if (met && !(pi && mean_iae(machines, *pi->what.gains) <= found->iae))
      return law_of(found->rst, sample_time_of(machines));
    if (!pi) return std::nullopt;
    pi_is_best_ = pi_is_best_ || begins;
    pi->what.structure = name_of(ControllerStructure::rst);
    pi->what.name = "RST (that of the PI)";
    return pi;
  }
  static double mean_iae(const design::Machines& machines, const design::FilteredPi& pi) {
    double sum = 0.0;
    for (const auto& machine : machines.all) sum += load_step_iae(machine, pi);
    return sum / static_cast<double>(machines.all.size());
  }
  template <class Design>
  bool is_met(const std::optional<Design>& found) {
    if (!found || found->exceeded > kExceeded) return false;
    last_ = found->point;
    return true;
  }
  ControllerStructure structure_;
  design::Bounds bounds_;
  std::uint64_t seed_;
  bool pi_is_best_ = false;
  design::GlobalSearch::Point last_;
};

/// Filters of one call are where the next begins.
class FilterDesigner {
 public:
  FilterDesigner(const design::Bounds& bounds, std::size_t biquads, std::uint64_t seed) : bounds_(bounds) {
    how_.biquads = static_cast<int>(biquads);
    how_.seed = seed;
  }
  std::optional<Law> operator()(design::Machines& machines) {
    const auto found = search_filters(machines, bounds_, how_, last_);
    if (!found) return std::nullopt;
    last_ = found->controller.biquads;
    return law_of(found->controller, sample_time_of(machines));
  }

 private:
  design::Bounds bounds_;
  design::FilterSearch how_;
  std::vector<design::Biquad> last_;
};

}  // namespace

DesignFor design_for(ControllerStructure structure, const design::Bounds& bounds, std::size_t biquads,
                     std::uint64_t seed) {
  switch (structure) {
    case ControllerStructure::p:
      return [bounds](design::Machines& machines) { return best_p(machines, bounds); };
    case ControllerStructure::cascade:
      return [bounds](design::Machines& machines) { return best_cascade(machines, bounds); };
    case ControllerStructure::pi_biquads:
      return FilterDesigner(bounds, biquads, seed);
    case ControllerStructure::pid:
      return PidDesigner(bounds, seed);
    case ControllerStructure::rst:
    case ControllerStructure::state_feedback:
      return StructureDesigner(structure, bounds, seed);
    default:
      return [bounds](design::Machines& machines) { return best_pi(machines, bounds); };
  }
}

design::Bounds plain_bounds(const TuneOptions& options) {
  design::Bounds bounds;
  bounds.sensitivity = options.largest_sensitivity;
  if (std::isfinite(options.largest_load_transfer)) bounds.load_transfer = options.largest_load_transfer;
  bounds.complementary = options.largest_complementary;
  bounds.controller_sensitivity = options.largest_controller_sensitivity;
  return bounds;
}

design::Bounds design_bounds(const TuneOptions& options) {
  auto bounds = plain_bounds(options);
  bounds.beyond_band = 1.0;
  return bounds;
}

design::Bounds bounds_for(ControllerStructure structure, const TuneOptions& options,
                          double best_controller_sensitivity) {
  design::Bounds bounds = design_bounds(options);
  if (structure == ControllerStructure::cascade) {
    bounds.load_transfer = options.largest_position_transfer;
    return bounds;
  }
  constexpr double kTimes = 2.0;  // docs/methods/tune.md 6.3
  const bool has_filter = structure != ControllerStructure::pi && structure != ControllerStructure::p;
  if (has_filter && !bounds.controller_sensitivity)
    bounds.controller_sensitivity = kTimes * best_controller_sensitivity;
  return bounds;
}

std::optional<double> best_controller_sensitivity(design::Machines& machines, const design::Bounds& bounds,
                                                  ControllerStructure structure) {
  const auto pi = structure == ControllerStructure::p ? best_p(machines, bounds) : best_pi(machines, bounds);
  if (!pi) return std::nullopt;
  double largest = 0.0;
  for (std::size_t m = 0; m < machines.all.size(); ++m)
    largest = std::max(
        largest, design::LoopFunctions(machines.all[m].response(), pi->linear)
                     .largest(design::Transfer::controller_sensitivity, machines.lines[m].frequencies_hz())
                     .value);
  return largest;
}

}  // namespace resonid::identification
