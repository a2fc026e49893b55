// SPDX-License-Identifier: MIT
#include "identification/tune/reach.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "design/figures.hpp"
#include "design/largest_gain.hpp"
#include "identification/tune/checks.hpp"
#include "identification/tune/designs.hpp"

namespace resonid::identification {
namespace {

struct Named {
  const char* field;
  const char* symbol;
  std::optional<double> design::Bounds::*bound;
  double loosest;  ///< That is sensible; of |C S| the best PI tells it.
};
constexpr Named kBounds[] = {
    {"largest_sensitivity", "|S|", &design::Bounds::sensitivity, 2.5},
    {"largest_load_transfer", "|T_load|", &design::Bounds::load_transfer, 3.0},
    {"largest_complementary", "|T|", &design::Bounds::complementary, 3.0},
    {"largest_controller_sensitivity", "|C S|", &design::Bounds::controller_sensitivity, 0.0}};

/// Gains of a structure whose loop is looked at in place of the one that was asked for: a P, else a PI.
std::optional<design::FilteredPi> quick_gains(ControllerStructure structure,
                                              const std::vector<design::Machine>& machines,
                                              const design::Bounds& bounds) {
  design::Machines all(machines, 0.5);
  const design::Accuracy quick{40, 4, 0};
  const auto gains = structure == ControllerStructure::p ? largest_proportional_gain(all, bounds, quick)
                                                         : largest_integral_gain(all, {}, bounds, quick);
  if (!gains) return std::nullopt;
  return design::FilteredPi{gains->kp, gains->ki, {}};
}

bool is_met(ControllerStructure structure, const std::vector<design::Machine>& machines,
            const design::Bounds& bounds) {
  return quick_gains(structure, machines, bounds).has_value();
}

/// The least value of one bound that can be met beside the others; nothing where none can.
std::optional<double> least_met(ControllerStructure structure, const std::vector<design::Machine>& machines,
                                design::Bounds bounds, std::optional<double> design::Bounds::*bound) {
  const double asked = *(bounds.*bound);
  double low = asked, high = 8.0 * asked;
  bounds.*bound = high;
  if (!is_met(structure, machines, bounds)) return std::nullopt;
  constexpr int kHalvings = 12;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(low * high);
    bounds.*bound = middle;
    (is_met(structure, machines, bounds) ? high : low) = middle;
  }
  return high;
}

/// From where on every machine was measured.
double highest_low_end_hz(std::span<const Result> results) {
  double low_hz = 0.0;
  for (const Result& r : results) low_hz = std::max(low_hz, measured_band(r).low_hz);
  return low_hz;
}

/// Those gains; nothing where their loop does not cross where the machines were measured.
std::optional<Law> measured_law(ControllerStructure structure, const design::Bounds& bounds,
                                const std::vector<design::Machine>& machines,
                                std::span<const Result> results) {
  const auto gains = quick_gains(structure, machines, bounds);
  if (!gains) return std::nullopt;
  auto law = law_of(*gains, machines.front().sample_time_s());
  if (!check_crossover(law.what, machines, results)) return std::nullopt;
  return law;
}

/// The noise's torque of that loop under a bound on |C S|, of the noisiest machine.
std::optional<double> noise_under(ControllerStructure structure, double controller_sensitivity,
                                  design::Bounds bounds, const std::vector<design::Machine>& machines,
                                  std::span<const Result> results) {
  bounds.controller_sensitivity = controller_sensitivity;
  const auto law = measured_law(structure, bounds, machines, results);
  if (!law) return std::nullopt;
  return noise_torque_of(law->linear, machines, results);
}

/// What a design that suits every machine that may be has less of than that of the identified one.
constexpr double kRobust = 1.1;

/// The least value of a bound, beside the others, under which a PI crosses where the machines were measured;
/// nothing where none up to the loosest that is sensible is enough.
std::optional<double> least_crossing(ControllerStructure structure, const Named& named, design::Bounds bounds,
                                     const std::vector<design::Machine>& machines,
                                     std::span<const Result> results) {
  double low = *(bounds.*named.bound), high = named.loosest;
  if (named.bound == &design::Bounds::controller_sensitivity) {
    bounds.controller_sensitivity.reset();
    design::Machines all(machines);
    high = best_controller_sensitivity(all, bounds, structure).value_or(0.0);
  }
  const auto crosses_under = [&](double value) {
    bounds.*named.bound = value;
    return measured_law(structure, bounds, machines, results).has_value();
  };
  if (!(high > low) || !crosses_under(high)) return std::nullopt;
  constexpr int kHalvings = 12;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(low * high);
    (crosses_under(middle) ? high : low) = middle;
  }
  const double rest = named.bound == &design::Bounds::controller_sensitivity ? 0.0 : 1.0;
  return rest + kRobust * (high - rest);
}

}  // namespace

std::optional<Error> noise_out_of_reach(const TuneOptions& options,
                                        const std::vector<design::Machine>& machines,
                                        std::span<const Result> results) {
  if (!options.largest_noise_torque) return std::nullopt;
  const auto bounds = design_bounds(options);
  design::Machines all(machines);
  const auto best = best_controller_sensitivity(all, bounds, options.structure);
  if (!best) return std::nullopt;
  auto least = noise_under(options.structure, *best, bounds, machines, results);
  if (!least) return std::nullopt;
  double high = *best, low = 1e-6 * high;
  constexpr int kHalvings = 14;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(low * high);
    const auto noise = noise_under(options.structure, middle, bounds, machines, results);
    (noise ? high : low) = middle;
    if (noise) least = noise;
  }
  const double reached = kRobust * *least;
  if (*options.largest_noise_torque >= reached) return std::nullopt;
  return Error{"largest_noise_torque",
               fmt::format("is less than any loop takes that crosses where the machine was measured, from "
                           "{:.3g} Hz on: about {:.2g} {} is reached. Ask for no less, or excite lower "
                           "frequencies too, where a softer loop crosses",
                           highest_low_end_hz(results), reached, results.front().units.torque),
               *options.largest_noise_torque};
}

std::optional<Error> crossing_out_of_reach(const TuneOptions& options,
                                           const std::vector<design::Machine>& machines,
                                           std::span<const Result> results) {
  const auto bounds = design_bounds(options), usual = design_bounds({});
  const bool cascade = options.structure == ControllerStructure::cascade;
  auto loosened = bounds;
  const Named* cause = nullptr;  // where none alone is it, the first that was asked for
  std::string could, beside;
  for (const auto& named : kBounds) {
    const auto& bound = bounds.*named.bound;
    const auto& of_default = usual.*named.bound;
    if (!bound || (of_default && *bound >= *of_default)) continue;
    if (cascade && named.bound == &design::Bounds::load_transfer) continue;  // it has another one
    loosened.*named.bound = of_default;
    beside += fmt::format("{}{} <= {:.4g}", beside.empty() ? "" : ", ", named.symbol, *bound);
    const auto least = least_crossing(options.structure, named, bounds, machines, results);
    if (cause == nullptr || (least && could.empty())) cause = &named;
    if (least) could += fmt::format("{}{} <= {:.3g}", could.empty() ? "" : " or ", named.symbol, *least);
  }
  if (cause == nullptr) return std::nullopt;
  if (could.empty() && !measured_law(options.structure, loosened, machines, results))
    return std::nullopt;  // the band is to blame
  return Error{
      cause->field,
      fmt::format("leaves a loop ({}) that crosses below what was measured, from {:.3g} Hz on, where "
                  "nothing is known; {}, or excite lower frequencies too",
                  beside, highest_low_end_hz(results),
                  could.empty() ? std::string("no single looser bound helps: loosen them together")
                                : "ask for about " + could + " beside the others"),
      *(bounds.*(cause->bound))};
}

Error out_of_reach(const TuneOptions& options, const std::vector<design::Machine>& machines,
                   const std::string& what) {
  const auto bounds = design_bounds(options);
  if (is_met(options.structure, machines, bounds))
    return {
        "confidence",
        fmt::format("is not reached: the identified machine alone would allow the bounds, {} meets them for "
                    "every machine that may be. Identify more closely, or ask for less",
                    what),
        options.confidence};
  std::string together, could, field = "largest_sensitivity";
  for (const auto& named : kBounds) {
    if (!(bounds.*named.bound)) continue;
    together +=
        fmt::format("{}{} <= {:.4g}", together.empty() ? "" : ", ", named.symbol, *(bounds.*named.bound));
    const auto least = least_met(options.structure, machines, bounds, named.bound);
    if (!least) continue;
    could += fmt::format("{}{} <= {:.3g}", could.empty() ? "" : " or ", named.symbol, *least);
    field = named.field;
  }
  return {field, fmt::format("{} meets {} together with the confidence{}", what, together,
                             could.empty() ? std::string("; no single looser bound helps")
                                           : "; beside the others could be met " + could)};
}

Error bandwidth_out_of_reach(const TuneOptions& options, const std::vector<design::Machine>& machines,
                             double reached_hz) {
  struct Looser {
    double sensitivity, transfer;  // the latter of the load's velocity, of a cascade of its position
  };
  constexpr Looser kVelocity[] = {{1.4, 1.5}, {1.6, 1.3}, {1.6, 1.5}, {2.0, 1.5}, {2.0, 2.0}, {2.5, 3.0}};
  constexpr Looser kPosition[] = {{1.4, 1.2}, {1.6, 1.05}, {1.6, 1.2}, {2.0, 1.2}, {2.0, 1.5}, {2.5, 2.0}};
  const bool cascade = options.structure == ControllerStructure::cascade;
  const bool proportional = options.structure == ControllerStructure::p;
  const auto structure = cascade        ? ControllerStructure::cascade
                         : proportional ? ControllerStructure::p
                                        : ControllerStructure::pi;
  const std::string what = cascade ? "cascade" : proportional ? "P" : "PI";
  const double asked = cascade ? options.largest_position_transfer : options.largest_load_transfer;
  const auto least_under = [&](const design::Bounds& bounds) {
    design::Machines all(machines);
    const auto law = design_for(structure, bounds, options.biquads, options.seed)(all);
    if (!law) return 0.0;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& machine : machines)
      least = std::min(least, figures_of(machine, law->linear).load_bandwidth_hz.value_or(0.0));
    return least;
  };
  // What the machines that may be leave of that of the identified ones.
  const double identified_hz = least_under(bounds_for(structure, options, 0.0));
  const double share = identified_hz > 0.0 ? std::min(1.0, reached_hz / identified_hz) : 1.0;
  std::string could = "; no looser bounds reach it with a " + what;
  for (const auto& looser : cascade ? std::span(kPosition) : std::span(kVelocity)) {
    if (looser.sensitivity < options.largest_sensitivity || looser.transfer < asked) continue;
    auto bounds = bounds_for(structure, options, 0.0);
    bounds.sensitivity = looser.sensitivity;
    bounds.load_transfer = looser.transfer;
    const double least = share * least_under(bounds);
    if (least < *options.least_bandwidth_hz) continue;
    could = fmt::format("; with .largest_sensitivity {:g} and .{} {:g} a {} reaches about {:.3g} Hz",
                        looser.sensitivity, cascade ? "largest_position_transfer" : "largest_load_transfer",
                        looser.transfer, what, least);
    break;
  }
  return {"least_bandwidth_hz",
          fmt::format("is not reached under the other bounds: at most {:.3g} Hz{}", reached_hz, could),
          *options.least_bandwidth_hz};
}

}  // namespace resonid::identification
