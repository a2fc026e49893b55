// SPDX-License-Identifier: MIT
#include "identification/tune/reach.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "design/figures.hpp"
#include "design/largest_gain.hpp"
#include "identification/tune/checks.hpp"
#include "identification/tune/designs.hpp"
#include "identification/tune/named_bounds.hpp"

namespace resonid::identification {
namespace {

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

/// A cascade has another bound on its load.
bool has_bound(const TuneOptions& options, const NamedBound& named) {
  const bool cascade = options.structure == ControllerStructure::cascade;
  return design_bounds(options).*named.bound && !(cascade && named.bound == &design::Bounds::load_transfer);
}

/// What a design under other options comes to, as far as there are trials.
enum class Attempt { met, missed, none };
Attempt attempted(const Trials& trials, const TuneOptions& options) {
  if (!trials.succeeds || !trials.take_one()) return Attempt::none;
  return trials.succeeds(options) ? Attempt::met : Attempt::missed;
}

/// What helps of one bound beside the others.
struct LooserBound {
  std::optional<double> value = {};  ///< As it is told.
  bool is_tried = false;  ///< Whether a design met it; else it is what the identified machines allow.
  bool is_cut = false;    ///< Without a value: none near to it helps, trials ended before the others.
};

constexpr const char* kNotTried = " (not tried)";

/// Looks for looser bounds under which a PI crosses where the machines were measured.
class Loosening {
 public:
  Loosening(const TuneOptions& options, const std::vector<design::Machine>& machines,
            std::span<const Result> results, const Trials& trials)
      : options_(options), machines_(machines), results_(results), trials_(trials) {}

  /// The least value of a bound beside the others, as it is told; nothing where none up to the loosest that
  /// is sensible is enough.
  [[nodiscard]] LooserBound least(const NamedBound& named) const {
    auto bounds = design_bounds(options_);
    const double asked = *(bounds.*named.bound);
    double loosest = named.loosest;
    if (named.bound == &design::Bounds::controller_sensitivity) {
      bounds.controller_sensitivity.reset();
      design::Machines all(machines_);
      loosest = best_controller_sensitivity(all, bounds, options_.structure).value_or(0.0);
    }
    const auto crosses_under = [&](double value) {
      bounds.*named.bound = value;
      return measured_law(options_.structure, bounds, machines_, results_).has_value();
    };
    if (!(loosest > asked) || !crosses_under(loosest)) return {};
    constexpr double kWithin = 0.01;
    const double enough =
        crosses_under(asked) ? asked : least_enough(named, asked, loosest, kWithin, crosses_under);
    return told_from(named, enough, rounded_up(named, loosest));
  }

  /// "|S| <= 1.01, |T_load| <= 1.01 together": all of them, looser by the same times, which grow faster after
  /// every trial that fails; empty where that never is enough.
  [[nodiscard]] std::string together() const {
    constexpr double kStep = 1.5, kMost = 1e5;
    constexpr int kTrials = 6;
    int trials = 0;
    std::string last;
    double step = kStep;
    for (double times = step; times < kMost; times *= step) {
      auto looser = options_;
      std::string text;
      const auto bounds = design_bounds(options_);
      for (const auto& named : kNamedBounds) {
        if (!has_bound(options_, named)) continue;
        const double asked = *(bounds.*named.bound);
        double value = rounded_up(named, named.rest + times * (asked - named.rest));
        if (named.loosest > 0.0) value = std::max(asked, std::min(value, named.loosest));
        named.ask(looser, value);
        if (value > asked) add_to_list(text, bound_text(named, value), ", ");
      }
      if (text == last) break;  // nothing is left to loosen
      last = text;
      if (!measured_law(options_.structure, design_bounds(looser), machines_, results_)) continue;
      const auto attempt = attempted(trials_, looser);
      if (attempt != Attempt::missed) return text + " together" + (attempt == Attempt::met ? "" : kNotTried);
      if (++trials == kTrials) break;
      step *= kStep;
    }
    return {};
  }

 private:
  /// As a design for every machine that may be usually needs, a tenth more than the identified machine does,
  /// else the loosest and what lies between: some need many times more.
  [[nodiscard]] LooserBound told_from(const NamedBound& named, double enough, double loosest) const {
    const auto attempt = [&](double value) {
      auto looser = options_;
      named.ask(looser, value);
      return attempted(trials_, looser);
    };
    const double usual = std::min(loosest, rounded_up(named, named.rest + kRobust * (enough - named.rest)));
    const auto at_usual = attempt(usual);
    if (at_usual != Attempt::missed) return {usual, at_usual == Attempt::met};
    if (!(usual < loosest)) return {};
    const auto at_loosest = attempt(loosest);
    if (at_loosest != Attempt::met) return {{}, false, at_loosest == Attempt::none};
    constexpr double kWithin = 0.5;
    return {rounded_up(named, least_enough(named, usual, loosest, kWithin,
                                           [&](double value) {
                                             return attempt(rounded_up(named, value)) == Attempt::met;
                                           })),
            true};
  }

  const TuneOptions& options_;
  const std::vector<design::Machine>& machines_;
  std::span<const Result> results_;
  const Trials& trials_;
};

/// What is told of bounds: those that help alone, else all of them together.
class Advice {
 public:
  explicit Advice(const Loosening& loosening) : loosening_(loosening) {}

  void add(const NamedBound& named) {
    const auto looser = loosening_.least(named);
    if (cause_ == nullptr || (looser.value && could_.empty())) cause_ = &named;
    if (looser.value)
      add_to_list(could_, bound_text(named, *looser.value) + (looser.is_tried ? "" : kNotTried), " or ");
    is_cut_ = is_cut_ || looser.is_cut;
  }

  /// Where none alone is it, the first that was looked at.
  [[nodiscard]] const NamedBound* cause() const { return cause_; }
  /// Whether a bound helps alone.
  [[nodiscard]] bool is_single() const { return !could_.empty(); }

  [[nodiscard]] std::string single() const { return "ask for about " + could_ + " beside the others"; }
  [[nodiscard]] std::string no_single() const {
    return is_cut_ ? "no single looser bound near to these helps" : "no single looser bound helps";
  }

 private:
  const Loosening& loosening_;
  const NamedBound* cause_ = nullptr;
  std::string could_;
  bool is_cut_ = false;
};

/// As it is told: never more than what is reached.
double rounded_down(double hz) {
  if (!(hz > 0.0)) return 0.0;
  const double scale = std::pow(10.0, 2.0 - std::floor(std::log10(hz)));
  return std::floor(hz * scale) / scale;
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
                                           std::span<const Result> results, const Trials& trials) {
  const auto bounds = design_bounds(options), usual = design_bounds({});
  const Loosening loosening(options, machines, results, trials);
  Advice advice(loosening);
  auto loosened = bounds;
  std::string beside;
  for (const auto& named : kNamedBounds) {
    if (!has_bound(options, named)) continue;
    const double bound = *(bounds.*named.bound);
    const auto& of_default = usual.*named.bound;
    if (of_default && bound >= *of_default) continue;
    loosened.*named.bound = of_default;
    add_to_list(beside, bound_text(named, bound), ", ");
    advice.add(named);
  }
  if (advice.cause() == nullptr) return std::nullopt;
  if (!advice.is_single() && !measured_law(options.structure, loosened, machines, results))
    return std::nullopt;  // the band is to blame
  std::string words;
  if (advice.is_single()) {
    words = advice.single();
  } else {
    const auto together = loosening.together();
    words = advice.no_single() +
            (together.empty() ? std::string(": loosen them together") : ": ask for about " + together);
  }
  return Error{
      advice.cause()->field,
      fmt::format("leaves a loop ({}) that crosses below what was measured, from {:.3g} Hz on, where "
                  "nothing is known; {}, or excite lower frequencies too",
                  beside, highest_low_end_hz(results), words),
      *(bounds.*(advice.cause()->bound))};
}

Error out_of_reach(const TuneOptions& options, const std::vector<design::Machine>& machines,
                   std::span<const Result> results, const Trials& trials, const std::string& what) {
  const auto bounds = design_bounds(options);
  const bool by_identified = is_met(options.structure, machines, bounds);
  const Loosening loosening(options, machines, results, trials);
  Advice advice(loosening);
  std::string beside;
  for (const auto& named : kNamedBounds) {
    if (!has_bound(options, named)) continue;
    add_to_list(beside, bound_text(named, *(bounds.*named.bound)), ", ");
    advice.add(named);
  }
  std::string words;
  if (advice.is_single()) {
    words = advice.single();
  } else {
    const auto together = loosening.together();
    words = advice.no_single() + (together.empty() ? "" : ": ask for about " + together);
    if (together.empty() && by_identified)
      return {"confidence",
              fmt::format(
                  "is not reached: the identified machine alone would allow the bounds, {} meets them for "
                  "every machine that may be. Identify more closely, or ask for less",
                  what),
              options.confidence};
  }
  return {advice.cause()->field,
          fmt::format(
              "cannot be met: {} meets {} together with the confidence; {}{}", what, beside, words,
              by_identified ? ", or identify more closely: the identified machine alone would allow it" : ""),
          *(bounds.*(advice.cause()->bound))};
}

ControllerStructure simple_structure(ControllerStructure structure) {
  const bool is_simple = structure == ControllerStructure::cascade || structure == ControllerStructure::p;
  return is_simple ? structure : ControllerStructure::pi;
}

Error bandwidth_out_of_reach(const TuneOptions& options, const std::vector<design::Machine>& machines,
                             double reached_hz, const Trials& trials) {
  struct Looser {
    double sensitivity, transfer;  // the latter of the load's velocity, of a cascade of its position
  };
  constexpr Looser kVelocity[] = {{1.4, 1.5}, {1.6, 1.3}, {1.6, 1.5}, {2.0, 1.5},
                                  {2.0, 2.0}, {2.0, 3.0}, {2.5, 3.0}};
  constexpr Looser kPosition[] = {{1.4, 1.2}, {1.6, 1.05}, {1.6, 1.2}, {2.0, 1.2}, {2.0, 1.5}, {2.5, 2.0}};
  const auto structure = simple_structure(options.structure);
  const bool cascade = structure == ControllerStructure::cascade;
  const std::string what = cascade ? "cascade" : structure == ControllerStructure::p ? "P" : "PI";
  const std::string field = cascade ? "largest_position_transfer" : "largest_load_transfer";
  const double asked = cascade ? options.largest_position_transfer : options.largest_load_transfer;
  const auto least_under = [&](const TuneOptions& under) {
    design::Machines all(machines);
    const auto law =
        design_for(structure, bounds_for(structure, under, 0.0), options.biquads, options.seed)(all);
    if (!law) return 0.0;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& machine : machines)
      least = std::min(least, figures_of(machine, law->linear).load_bandwidth_hz.value_or(0.0));
    return least;
  };
  // What the machines that may be leave of that of the identified ones.
  const double identified_hz = least_under(options);
  const double share = identified_hz > 0.0 ? std::min(1.0, reached_hz / identified_hz) : 1.0;
  const auto tried = cascade ? std::span<const Looser>(kPosition) : std::span<const Looser>(kVelocity);
  std::string could;
  bool all_tried = true;
  for (const auto& looser : tried) {
    auto under = options;
    under.largest_sensitivity = std::max(options.largest_sensitivity, looser.sensitivity);
    (cascade ? under.largest_position_transfer : under.largest_load_transfer) =
        std::max(asked, looser.transfer);
    if (under.largest_sensitivity == options.largest_sensitivity && looser.transfer <= asked) continue;
    // What the identified machines do not reach is not reached on all that may be.
    const double of_identified = least_under(under);
    if (of_identified < *options.least_bandwidth_hz) continue;
    const bool is_tried = trials.bandwidth_hz && trials.take_one();
    all_tried = all_tried && is_tried;
    const double least = is_tried ? trials.bandwidth_hz(under) : share * of_identified;
    if (least < *options.least_bandwidth_hz) continue;
    could = fmt::format("; with .largest_sensitivity {:g} and .{} {:g} a {} reaches about {:.3g} Hz{}",
                        under.largest_sensitivity, field, std::max(asked, looser.transfer), what, least,
                        is_tried ? "" : kNotTried);
    break;
  }
  if (could.empty())
    could = fmt::format(
        "; nor with a {} under the looser ones that were {}, up to .largest_sensitivity "
        "{:g} and .{} {:g}",
        what, all_tried ? "tried" : "tried or estimated",
        std::max(options.largest_sensitivity, tried.back().sensitivity), field,
        std::max(asked, tried.back().transfer));
  return {"least_bandwidth_hz",
          fmt::format("is not reached under the other bounds: at most {:g} Hz{}", rounded_down(reached_hz),
                      could),
          *options.least_bandwidth_hz};
}

}  // namespace resonid::identification
