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
};
constexpr Named kBounds[] = {
    {"largest_sensitivity", "|S|", &design::Bounds::sensitivity},
    {"largest_load_transfer", "|T_load|", &design::Bounds::load_transfer},
    {"largest_complementary", "|T|", &design::Bounds::complementary},
    {"largest_controller_sensitivity", "|C S|", &design::Bounds::controller_sensitivity}};

bool is_met(const std::vector<design::Machine>& machines, const design::Bounds& bounds) {
  design::Machines all(machines, 0.5);
  const auto gains = largest_integral_gain(all, {}, bounds, design::Accuracy{40, 4, 0});
  return gains && gains->ki > 0.0;
}

/// The least value of one bound that can be met beside the others; nothing where none can.
std::optional<double> least_met(const std::vector<design::Machine>& machines, design::Bounds bounds,
                                std::optional<double> design::Bounds::*bound) {
  const double asked = *(bounds.*bound);
  double low = asked, high = 8.0 * asked;
  bounds.*bound = high;
  if (!is_met(machines, bounds)) return std::nullopt;
  constexpr int kHalvings = 12;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(low * high);
    bounds.*bound = middle;
    (is_met(machines, bounds) ? high : low) = middle;
  }
  return high;
}

/// The noise's torque of the best PI under a bound on |C S|, of the noisiest machine; nothing where it does
/// not cross where the machines were measured.
std::optional<double> noise_under(double controller_sensitivity, design::Bounds bounds,
                                  const std::vector<design::Machine>& machines,
                                  std::span<const Result> results) {
  bounds.controller_sensitivity = controller_sensitivity;
  design::Machines all(machines, 0.5);
  const auto gains = largest_integral_gain(all, {}, bounds, design::Accuracy{40, 4, 0});
  if (!gains) return std::nullopt;
  const auto law = law_of(design::FilteredPi{gains->kp, gains->ki, {}}, machines.front().sample_time_s());
  if (!check_crossover(law.what, machines, results)) return std::nullopt;
  return noise_torque_of(law.linear, machines, results);
}

}  // namespace

std::optional<Error> noise_out_of_reach(const TuneOptions& options,
                                        const std::vector<design::Machine>& machines,
                                        std::span<const Result> results) {
  if (!options.largest_noise_torque) return std::nullopt;
  const auto bounds = design_bounds(options);
  design::Machines all(machines);
  const auto best = best_controller_sensitivity(all, bounds);
  if (!best) return std::nullopt;
  auto least = noise_under(*best, bounds, machines, results);
  if (!least) return std::nullopt;
  double high = *best, low = 1e-6 * high;
  constexpr int kHalvings = 14;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = std::sqrt(low * high);
    const auto noise = noise_under(middle, bounds, machines, results);
    (noise ? high : low) = middle;
    if (noise) least = noise;
  }
  // What a design that suits every machine that may be has less of.
  constexpr double kRobust = 1.1;
  const double reached = kRobust * *least;
  if (*options.largest_noise_torque >= reached) return std::nullopt;
  double low_hz = 0.0;
  for (const Result& r : results) low_hz = std::max(low_hz, measured_band(r).low_hz);
  return Error{"largest_noise_torque",
               fmt::format("is less than any loop takes that crosses where the machine was measured, from "
                           "{:.3g} Hz on: about {:.2g} {} is reached. Ask for no less, or excite lower "
                           "frequencies too, where a softer loop crosses",
                           low_hz, reached, results.front().units.torque),
               *options.largest_noise_torque};
}

Error out_of_reach(const TuneOptions& options, const std::vector<design::Machine>& machines,
                   const std::string& what) {
  const auto bounds = design_bounds(options);
  if (is_met(machines, bounds))
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
    const auto least = least_met(machines, bounds, named.bound);
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
    double sensitivity, load_transfer;
  };
  constexpr Looser kLooser[] = {{1.4, 1.5}, {1.6, 1.3}, {1.6, 1.5}, {2.0, 1.5}, {2.0, 2.0}, {2.5, 3.0}};
  std::string could = "; no looser bounds reach it with a PI";
  for (const auto& looser : kLooser) {
    if (looser.sensitivity < options.largest_sensitivity ||
        looser.load_transfer < options.largest_load_transfer)
      continue;
    auto bounds = design_bounds(options);
    bounds.sensitivity = looser.sensitivity;
    bounds.load_transfer = looser.load_transfer;
    design::Machines all(machines);
    const auto gains = largest_integral_gain(all, {}, bounds);
    if (!gains) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& machine : machines)
      least = std::min(least, design::figures_of(machine, design::FilteredPi{gains->kp, gains->ki, {}})
                                  .load_bandwidth_hz.value_or(0.0));
    if (least < *options.least_bandwidth_hz) continue;
    could =
        fmt::format("; with .largest_sensitivity {:g} and .largest_load_transfer {:g} a PI reaches {:.3g} Hz",
                    looser.sensitivity, looser.load_transfer, least);
    break;
  }
  return {"least_bandwidth_hz",
          fmt::format("is not reached under the other bounds: at most {:.3g} Hz{}", reached_hz, could),
          *options.least_bandwidth_hz};
}

}  // namespace resonid::identification
