// SPDX-License-Identifier: MIT
#include "identification/tune/value.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "design/figures.hpp"
#include "design/filter_search.hpp"
#include "design/largest_gain.hpp"
#include "design/trade_off.hpp"
#include "identification/tune/checks.hpp"
#include "identification/tune/designs.hpp"
#include "identification/tune/figure_values.hpp"

namespace resonid::identification {
namespace {

/// The best PI of the identified machines.
struct BestPi {
  design::FilteredPi controller;
  double crossover_hz = 0.0;  ///< The highest of all.
  double iae = 0.0;           ///< Of the load after a load step, the mean.
};
std::optional<BestPi> best_pi_of(const std::vector<design::Machine>& machines, const design::Bounds& bounds) {
  design::Machines all(machines);
  const auto gains = largest_integral_gain(all, {}, bounds);
  if (!gains) return std::nullopt;
  BestPi best{{gains->kp, gains->ki, {}}};
  for (const auto& machine : machines) {
    for (const auto& crossing : figures_of(machine, best.controller).crossings)
      best.crossover_hz = std::max(best.crossover_hz, crossing.frequency_hz);
    best.iae += load_step_iae(machine, best.controller) / static_cast<double>(machines.size());
  }
  return best;
}

/// design::value_of_experiment() for one controller that suits several machines, each known better.
std::vector<design::ExperimentValue> value_for_several(const std::vector<design::Posterior>& posteriors,
                                                       const design::FilteredPi& proposed,
                                                       const design::Bounds& bounds, double radius) {
  const bool told = std::ranges::any_of(posteriors, &design::Posterior::delay_is_told);
  const auto tight = design::tightened(bounds, kRoom);
  const DesignFor design = [&](design::Machines& machines) -> std::optional<Law> {
    const auto gains = largest_integral_gain(machines, proposed.biquads, tight);
    if (!gains) return std::nullopt;
    return law_of(design::FilteredPi{gains->kp, gains->ki, proposed.biquads},
                  machines.all.front().sample_time_s());
  };
  const auto value_of = [&](const design::FilteredPi& controller) {
    design::ExperimentValue value{1.0, controller.ki, 0.0, 1.0};
    for (const auto& posterior : posteriors)
      value.iae += load_step_iae(design::Machine(posterior.nominal()), controller) /
                   static_cast<double>(posteriors.size());
    return value;
  };
  const design::ValueAt value_at =
      [&](const design::VarianceFactors& factors) -> std::optional<design::ExperimentValue> {
    std::vector<design::Posterior> scaled;
    for (const auto& posterior : posteriors) scaled.push_back(posterior.scaled(factors.all, factors.delay));
    const auto found = law_over_ellipsoids({scaled, bounds}, design, radius);
    if (!found) return std::nullopt;
    return value_of(*found->law.what.gains);
  };
  return design::values_of_experiments(told, value_at, value_of(proposed));
}

/// Structures that are searched are not searched again for less uncertainty: what there is without any is
/// known.
std::vector<design::ExperimentValue> value_by_nominal(const Tuning& tuning) {
  if (!tuning.nominal || !tuning.nominal->stable) return {};
  const auto* now = tuning.proposed().figure("load_step_iae");
  const auto* without = tuning.nominal->figure("load_step_iae");
  if (now == nullptr || without == nullptr) return {};
  return {{0.0, 0.0, without->value, 0.0}, {1.0, 0.0, now->value, 1.0}};
}

/// Up to where the machines must be known for this controller to be small enough above, at most to the
/// Nyquist frequency.
double needed_band_hz(const std::vector<design::Machine>& machines, const BestPi& pi) {
  constexpr double kStep = 1.05;
  double high_hz = pi.crossover_hz;
  for (const auto& machine : machines) {
    const double nyquist_hz = 0.5 / machine.sample_time_s();
    for (; high_hz < nyquist_hz; high_hz *= kStep) {
      const design::LoopFunctions loop(machine.response(), pi.controller, machine.sample_time_s(), high_hz);
      const auto lines = design::first_lines_hz(machine.model(), 1.0, high_hz);
      if (loop.largest(design::Transfer::beyond_band, lines).value <= 1.0 + kRoom) break;
    }
    high_hz = std::min(high_hz, nyquist_hz);
  }
  return high_hz;
}

constexpr std::pair<design::Transfer, std::string_view> kBoundedTransfers[] = {
    {design::Transfer::sensitivity, "|S|"},
    {design::Transfer::complementary, "|T|"},
    {design::Transfer::load_transfer, "|T_load|"},
    {design::Transfer::controller_sensitivity, "|C S|"},
    {design::Transfer::beyond_band, "|L| above the band"}};

}  // namespace

void add_value(Tuning& tuning, const std::vector<design::Machine>& machines,
               const std::vector<design::Posterior>& posteriors, const DesignedUnder& bounds) {
  const auto& proposed = tuning.proposed();
  const bool is_filtered_pi =
      proposed.gains && proposed.gains->ki > 0.0 && !proposed.position_gain && !proposed.derivative_gain;
  const auto curves = design::trade_offs(machines, {}, bounds.pi);
  tuning.over_sensitivity = curves.over_sensitivity;
  tuning.over_load_transfer = curves.over_load_transfer;
  if (!is_filtered_pi) {
    tuning.experiment = value_by_nominal(tuning);
    return;
  }
  if (posteriors.size() > 1) {
    tuning.experiment = value_for_several(posteriors, *proposed.gains, bounds.proposed, proposed.radius);
    return;
  }
  const auto& posterior = posteriors.front();
  tuning.experiment = design::value_of_experiment(posterior, proposed.gains->biquads, bounds.proposed,
                                                  proposed.radius, &*proposed.gains);
}

void add_value_of_band(Tuning& tuning, const std::vector<design::Machine>& machines,
                       std::span<const Result> results, const design::Bounds& bounds) {
  const auto& limits = tuning.proposed().limits;
  if (std::ranges::find(limits, "beyond_band_peak") == limits.end()) return;
  auto without_band = bounds;
  without_band.beyond_band.reset();
  const auto within = best_pi_of(machines, bounds), free = best_pi_of(machines, without_band);
  if (!within || !free || !(within->iae > 0.0)) return;
  const double less = 1.0 - free->iae / within->iae;
  constexpr double kWorthwhile = 0.03;  // of the load's error
  if (less < kWorthwhile) return;
  const auto limiting = static_cast<std::size_t>(
      std::ranges::min_element(machines, {}, &design::Machine::known_to_hz) - machines.begin());
  const double band_hz = measured_band(results[limiting]).high_hz,
               known_hz = machines[limiting].known_to_hz();
  const bool is_rigid = known_hz < band_hz;
  const double needed_hz = needed_band_hz(machines, *free) * (is_rigid ? kCalmBelowCompliance : 1.0);
  const std::string why =
      is_rigid ? fmt::format(
                     "showed no compliance; one that begins above would let the load swing, so that "
                     "the loop is kept small from {:.3g} Hz on",
                     known_hz)
               : "the loop is kept small above";
  const double nyquist_hz = 0.5 / tuning.sample_time_s;
  tuning.findings.push_back(
      {"band-limits-design", diagnostics::Severity::info, band_hz, std::min(needed_hz, nyquist_hz),
       fmt::format("The machine was measured up to {:.3g} Hz, and {}, which limits the gains. Known up to "
                   "{:.3g} Hz, it would let the best PI cross at {:.3g} Hz in place of {:.3g} Hz, and the "
                   "load step's IAE be {:.0f} % smaller. Excite up to there; plan lays it out within that "
                   ".band_hz.",
                   band_hz, why, std::min(needed_hz, nyquist_hz), free->crossover_hz, within->crossover_hz,
                   100.0 * less)});
}

void add_worst_machines(Tuning& tuning, const std::vector<design::Posterior>& posteriors,
                        std::span<const Result> results) {
  const auto& proposed = tuning.proposed();
  if (posteriors.size() < 2 || !proposed.stable) return;
  const Law law = law_of(proposed);
  std::string text;
  for (const auto& [transfer, symbol] : kBoundedTransfers) {
    const auto* figure = proposed.figure(figure_name(static_cast<std::size_t>(transfer)));
    if (figure == nullptr || !figure->bound) continue;
    const bool of_position = proposed.position_gain && transfer == design::Transfer::load_transfer;
    std::size_t worst = 0;
    double most = 0.0;
    for (std::size_t i = 0; i < posteriors.size(); ++i) {
      const double here = worst_case(posteriors[i], law.linear, transfer, proposed.radius).peak.value;
      if (!(here > most)) continue;
      worst = i;
      most = here;
    }
    text += fmt::format("{}{} is largest on {} ({:.3g}, bound {:.3g})", text.empty() ? "" : ", ",
                        of_position ? "|T_position|" : symbol, name_of_machine(results, worst), most,
                        *figure->bound);
  }
  if (text.empty()) return;
  tuning.findings.push_back(
      {"worst-machines",
       diagnostics::Severity::info,
       {},
       {},
       fmt::format("Of the {} machines within their error bars: {}.", posteriors.size(), text)});
}

}  // namespace resonid::identification
