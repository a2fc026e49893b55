// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <resonid/identification/tune.hpp>
#include <string>
#include <utility>

#include "design/figures.hpp"
#include "design/filter_search.hpp"
#include "identification/tune/checks.hpp"
#include "identification/tune/designs.hpp"
#include "identification/tune/figure_values.hpp"
#include "identification/tune/loop_figures.hpp"
#include "identification/tune/reach.hpp"
#include "identification/tune/remarks.hpp"
#include "identification/tune/response_only.hpp"
#include "identification/tune/scheduled.hpp"
#include "identification/tune/usable.hpp"
#include "identification/tune/value.hpp"

namespace resonid::identification {
namespace {

using Structure = ControllerStructure;

class Tuner {
 public:
  Tuner(std::span<const Result> results, const TuneOptions& options)
      : results_(results), options_(options), posteriors_(posteriors_of(results, options)) {
    sample_time_s_ = results.front().model->drive.sample_time_s;
    for (const auto& posterior : posteriors_)
      nominal_.emplace_back(posterior.nominal(), posterior.known_to_hz());
  }

  expected<Tuning, Error> run() {
    describe_task();
    if (auto done = options_.evaluate ? evaluate() : design(); !done) return tl::unexpected(done.error());
    if (options_.positions.empty()) add_worst_machines(tuning_, posteriors_, results_);
    if (auto done = add_running(); !done) return tl::unexpected(done.error());
    if (!options_.evaluate && options_.positions.empty()) {
      progress("what bounds and accuracy cost");
      const DesignedUnder bounds{bounds_of("pi"), bounds_of(tuning_.proposed().structure)};
      add_value(tuning_, nominal_, posteriors_, bounds);
      add_value_of_band(tuning_, nominal_, results_, bounds.pi);
    }
    if (options_.shaper) {
      progress("input shapers");
      add_shapers(tuning_, posteriors_);
    }
    return finished();
  }

 private:
  void progress(std::string_view stage) const {
    if (options_.progress) options_.progress(stage);
  }

  void describe_task() {
    for (const Result& r : results_) {
      tuning_.files.push_back(r.record.file);
      tuning_.machines.push_back(machine_of(r));
    }
    tuning_.units = results_.front().units;
    tuning_.sample_time_s = sample_time_s_;
    tuning_.options = options_;
    tuning_.delay_std_assumed = !options_.delay_std_s && !std::ranges::all_of(results_, has_delay_std);
    tuning_.delay_std_s = options_.delay_std_s.value_or(largest_delay_std());
  }

  /// One that is assumed, where there is such a result.
  [[nodiscard]] double largest_delay_std() const {
    if (tuning_.delay_std_assumed) return assumed_delay_std(results_.front());  // of one sample time all
    double largest = 0.0;
    for (const Result& r : results_) largest = std::max(largest, r.model->drive.estimate(fit::kDelay).std);
    return largest;
  }

  [[nodiscard]] RobustTask task(const design::Bounds& bounds) const {
    return {posteriors_, bounds, options_.confidence, options_.guarantee, options_.draws, options_.seed};
  }

  [[nodiscard]] TunedController described(const RobustLaw& found, const design::Bounds& bounds,
                                          bool curves) const {
    const RobustTask robust = task(bounds);
    FigureTask figures{robust, results_.front().units, options_.reference_step, 200, curves};
    auto controller = with_figures(found, figures);
    const Units& units = results_.front().units;
    for (auto& state : controller.states)
      state.unit = state.unit == "Nm"    ? units.torque
                   : state.unit == "rad" ? place_unit(units.velocity)
                                         : units.velocity;
    controller.stable = is_stable(found.law);
    for (const auto& machine : nominal_)
      controller.spectral_radius =
          std::max(controller.spectral_radius, loop_of(machine, found.law).spectral_radius());
    controller.within = controller.stable && controller.unstable == 0 &&
                        found.check.probability() <= 1.0 - options_.confidence;
    if (options_.guarantee == Guarantee::ellipsoid)
      for (const auto& worst : found.worst)
        controller.within = controller.within && worst.peak.value <= (1.0 + kRoom) * worst.peak.bound;
    return controller;
  }

  /// On the identified machine of every result.
  [[nodiscard]] bool is_stable(const Law& law) const {
    return std::all_of(nominal_.begin(), nominal_.end(),
                       [&](const design::Machine& machine) { return loop_of(machine, law).is_stable(); });
  }

  /// A controller as it is: its worst cases at the radius of a first design, or of the ellipsoid that is to
  /// be kept.
  [[nodiscard]] TunedController judged(Law law, const design::Bounds& bounds, bool curves) const {
    double radius = 2.0;
    if (options_.guarantee == Guarantee::ellipsoid) {
      radius = 0.0;
      for (const auto& posterior : posteriors_)
        radius = std::max(radius, design::ellipsoid_radius(options_.confidence, posterior.dimension()));
    }
    const RobustTask robust = task(bounds);
    RobustLaw found{std::move(law), radius, {}, {}};
    if (is_stable(found.law)) found.worst = worst_cases(robust, found.law, radius);
    found.check = drawn(robust, found.law);
    return described(found, bounds, curves);
  }

  /// As a cascade where it has a position gain, by whose bounds it is judged then. `beyond_band`: how large
  /// it may be above the band in which the machine is known.
  [[nodiscard]] expected<TunedController, Error> judged_given(const char* field,
                                                              const data::Controller& controller,
                                                              const std::vector<double>& reference,
                                                              std::optional<double> position_gain,
                                                              std::optional<double> beyond_band) const {
    const auto sampled = controller.sampled(sample_time_s_);
    if (std::ranges::all_of(sampled.numerator, [](double term) { return term == 0.0; }))
      return refuse(field, "must have a gain: its numerator is 0, so that it does nothing");
    if (position_gain) {
      auto cascade = law_of(sampled, *position_gain);
      if (!cascade)
        return refuse(field, "must be a PI under its position gain, C (1 + kv q), to be judged as a cascade");
      auto bounds = bounds_for(Structure::cascade, options_, 0.0);
      bounds.beyond_band = beyond_band;
      return judged(*std::move(cascade), bounds, true);
    }
    Law law = law_of(sampled);
    if (!reference.empty()) set_reference(law, reference);
    auto bounds = plain_bounds(options_);
    bounds.beyond_band = beyond_band;
    return judged(std::move(law), bounds, true);
  }

  expected<void, Error> evaluate() {
    progress("judging the controller");
    auto given = judged_given("evaluate", *options_.evaluate, options_.evaluate_reference,
                              options_.evaluate_position_gain, design_bounds(options_).beyond_band);
    if (!given) return tl::unexpected(given.error());
    auto judgement = *std::move(given);
    if (judgement.structure.empty()) judgement.structure = "given";
    tuning_.candidates = {std::move(judgement)};
    if (const auto crossing = check_crossover(tuning_.proposed(), nominal_, results_); !crossing)
      tuning_.findings.push_back({"crossover-not-measured",
                                  diagnostics::Severity::error,
                                  {},
                                  {},
                                  "The margins are not known: " + crossing.error().requirement.str() + "."});
    return {};
  }

  expected<void, Error> add_running() {
    if (!options_.running) return {};
    progress("judging the controller that ran");
    // It ran: what a mode above the band would do to it is known.
    auto given = judged_given("controller", *options_.running, options_.running_reference,
                              options_.running_position_gain, {});
    if (!given)  // of another kind of cascade its loop alone
      given = judged_given("controller", *options_.running, {}, {}, {});
    if (!given) return tl::unexpected(given.error());
    auto running = *std::move(given);
    running.structure = "running";
    if (!running.stable && !options_.force)
      return refuse(
          "results",
          "contradict the controller that ran: on the identified machine its loop is unstable; give "
          "the .controller that ran, or .force");
    tuning_.running = std::move(running);
    return {};
  }

  [[nodiscard]] bool is_rigid() const {
    return std::all_of(nominal_.begin(), nominal_.end(), [](const design::Machine& machine) {
      return machine.model().structure == fit::Structure::rigid;
    });
  }

  [[nodiscard]] std::vector<Structure> structures() const {
    if (!options_.positions.empty()) return {Structure::pi};
    switch (options_.structure) {
      case Structure::automatic:
        // A filter that is made for a rigid model shapes what the model does not know.
        if (is_rigid()) return {Structure::pi};
        return {Structure::pi, Structure::pi_biquads};
      case Structure::pi:
      case Structure::p:
      case Structure::cascade:
        return {options_.structure};
      default:
        return {Structure::pi, options_.structure};
    }
  }

  expected<void, Error> design() {
    if (options_.positions.empty()) return design_one();
    progress("gains over position");
    auto scheduled = schedule_gains(tuning_, results_, posteriors_);
    if (!scheduled) return tl::unexpected(scheduled.error());
    const Tuner first(results_.first(1), options_);
    auto controller = first.described(*scheduled, design_bounds(options_), true);
    controller.within = tuning_.schedule->within;
    // What is left where the drive does not know its position; there need not be one.
    if (!design_one()) tuning_.candidates.clear();
    if (!tuning_.candidates.empty()) {
      tuning_.candidates.front().remark = "one for all positions";
      add_one_for_all(tuning_, *tuning_.candidates.front().gains);
    }
    tuning_.nominal.reset();
    tuning_.candidates.insert(tuning_.candidates.begin(), std::move(controller));
    return {};
  }

  expected<void, Error> design_one() {
    design::Machines machines(nominal_);
    auto bounds = design_bounds(options_);
    auto sensitivity = best_controller_sensitivity(machines, bounds, options_.structure);
    if (!sensitivity) return tl::unexpected(out_of_reach(options_, nominal_, results_, trials(), "no gain"));
    // By the best PI; a P is limited below, by its own noise.
    if (options_.structure == Structure::p) {
      if (auto noise = noise_out_of_reach(options_, nominal_, results_)) return tl::unexpected(*noise);
    } else if (auto limited = limit_noise(machines, bounds, *sensitivity); !limited) {
      return tl::unexpected(limited.error());
    }
    for (const Structure structure : structures()) {
      progress("designing: " + std::string(name_of(structure)));
      auto own = bounds_for(structure, options_, *sensitivity);
      if (bounds.controller_sensitivity) own.controller_sensitivity = bounds.controller_sensitivity;
      auto found = quiet_for(structure, own);
      if (!found) continue;
      // Before the figures of a loop that takes for ever are worked out.
      if (structure == options_.structure)
        if (auto crossing = crosses_inside(found->law.what); !crossing) return crossing;
      choose_weight(found->law);
      if (structure == Structure::cascade) {
        const auto& friction = results_.front().model->coulomb_friction;
        found->law.what.feed_forward =
            feed_forward_of(tuning_.machines.front(), friction ? std::max(0.0, friction->value) : 0.0);
      }
      tuning_.candidates.push_back(described(*found, own, true));
      designed_under_.insert_or_assign(tuning_.candidates.back().structure, own);
      if (structure == chosen_structure()) add_nominal(structure, own);
    }
    return choose();
  }

  /// With |C S| bounded until the torque that measurement noise makes is within its limit on every machine.
  [[nodiscard]] std::optional<RobustLaw> quiet_for(Structure structure, design::Bounds& bounds) const {
    auto found = found_for(structure, bounds);
    if (!options_.largest_noise_torque) return found;
    const double most = *options_.largest_noise_torque;
    constexpr int kRounds = 8;
    for (int round = 0; found; ++round) {
      const double noise = noise_torque_of(found->law.linear, nominal_, results_);
      double size = 0.0;
      for (const auto& machine : nominal_)
        size = std::max(
            size,
            figures_of(machine, found->law.linear).peak(design::Transfer::controller_sensitivity).value);
      if (noise <= most) return found;
      if (round == kRounds) return std::nullopt;
      const double bound = std::min(size, bounds.controller_sensitivity.value_or(size));
      bounds.controller_sensitivity = bound * std::min(0.95, most / noise);
      found = found_for(structure, bounds);
    }
    return found;
  }

  /// PI with or without filters for one machine has a way of its own, which is faster.
  [[nodiscard]] std::optional<RobustLaw> found_for(Structure structure, const design::Bounds& bounds) const {
    const bool of_filters = structure == Structure::pi || structure == Structure::pi_biquads;
    if (posteriors_.size() > 1 || !of_filters)
      return robust_law(task(bounds), design_for(structure, design::tightened(bounds, kRoom),
                                                 options_.biquads, options_.seed));
    design::FilterSearch how;
    how.biquads = structure == Structure::pi ? 0 : static_cast<int>(options_.biquads);
    how.seed = options_.seed;
    auto found = confident_design(posteriors_.front(), how, bounds,
                                  {options_.confidence, options_.guarantee, options_.draws, options_.seed});
    if (!found) return std::nullopt;
    return RobustLaw{law_of(found->design.controller, sample_time_s_), found->design.radius,
                     std::move(found->design.worst), std::move(found->check)};
  }

  /// Under which a structure was designed; of one that was not, those that hold for all.
  [[nodiscard]] design::Bounds bounds_of(const std::string& structure) const {
    const auto found = designed_under_.find(structure);
    return found == designed_under_.end() ? design_bounds(options_) : found->second;
  }

  [[nodiscard]] Structure chosen_structure() const {
    return options_.structure == Structure::automatic ? structures().back() : options_.structure;
  }

  /// A bound of |C S| that keeps the torque of measurement noise below its limit on every machine.
  expected<void, Error> limit_noise(design::Machines& machines, design::Bounds& bounds, double sensitivity) {
    if (!options_.largest_noise_torque) return {};
    const double most = *options_.largest_noise_torque;
    double bound = bounds.controller_sensitivity.value_or(2.0 * sensitivity);
    constexpr int kRounds = 12;
    for (int round = 0; round < kRounds; ++round) {
      bounds.controller_sensitivity = bound;
      const auto gains = largest_integral_gain(machines, {}, bounds);
      if (!gains) break;
      const Law law = law_of(design::FilteredPi{gains->kp, gains->ki, {}}, sample_time_s_);
      const double noise = noise_torque_of(law.linear, nominal_, results_);
      if (noise <= most) return {};
      bound = std::min(bound, sensitivity) * 0.98 * most / noise;
      sensitivity = bound;
    }
    return tl::unexpected(no_such_noise());
  }

  /// Where no gain was found under the limit of the noise's torque, or none whose loop is known.
  [[nodiscard]] Error no_such_noise() const {
    if (auto out = noise_out_of_reach(options_, nominal_, results_)) return *std::move(out);
    return {"largest_noise_torque", "is met by no gain that meets the other bounds too",
            *options_.largest_noise_torque};
  }

  /// The largest that keeps overshoot and torque of the reference step on every machine; where none keeps
  /// the torque, of an RST or state feedback a lag that does.
  void choose_weight(Law& law) const {
    if (law.what.position_gain) return;
    if (!integrates(law.what)) return;  // it would but take the load further off its reference
    double weight = 1.0;
    for (const auto& machine : nominal_) weight = largest_weight(machine, law, options_, weight);
    set_weight(law, weight);
    if (!law.what.gains && options_.torque_limit)
      limit_reference_torque(law, nominal_, *options_.torque_limit / options_.reference_step);
  }

  void add_nominal(Structure structure, const design::Bounds& bounds) {
    design::Machines machines(nominal_);
    auto law = design_for(structure, bounds, options_.biquads, options_.seed)(machines);
    if (!law) return;
    choose_weight(*law);
    // By what was asked for: that filters are limited in |C S| is a rule of their search.
    auto asked = plain_bounds(options_);
    if (structure == Structure::cascade) asked.load_transfer = bounds.load_transfer;
    tuning_.nominal = judged(*std::move(law), asked, false);
    tuning_.nominal->remark = "without regard to what is not known of the machine";
  }

  /// What of a figure counts where it is to be at least so much.
  [[nodiscard]] static double reached_of(const LoopFigure* figure) {
    return figure == nullptr ? 0.0 : figure->worst.value_or(figure->low.value_or(figure->value));
  }

  /// The design of simple_structure(), where it is stable and crosses where the machines were measured.
  [[nodiscard]] std::optional<RobustLaw> simple_law(design::Bounds& bounds) const {
    auto found = quiet_for(simple_structure(options_.structure), bounds);
    if (found && !(is_stable(found->law) && check_crossover(found->law.what, nominal_, results_)))
      return std::nullopt;
    return found;
  }
  [[nodiscard]] design::Bounds simple_bounds() const {
    return bounds_for(simple_structure(options_.structure), options_, 0.0);
  }

  /// None of one design for all positions, of which no refusal is told.
  [[nodiscard]] Trials trials() const {
    if (!options_.positions.empty()) return {};
    constexpr int kQuick = 30, kSearched = 2;
    const bool is_quick = simple_structure(options_.structure) != Structure::cascade;
    return {[this](const TuneOptions& under) {
              const Tuner other(results_, under);
              auto bounds = other.simple_bounds();
              return other.simple_law(bounds).has_value();
            },
            [this](const TuneOptions& under) {
              const Tuner other(results_, under);
              auto bounds = other.simple_bounds();
              const auto found = other.simple_law(bounds);
              if (!found) return 0.0;
              return reached_of(other.described(*found, bounds, false).figure("load_bandwidth_hz"));
            },
            std::make_shared<int>(is_quick ? kQuick : kSearched)};
  }

  /// Else what keeps it from crossing where the machines were measured.
  [[nodiscard]] expected<void, Error> crosses_inside(const TunedController& controller) const {
    auto crossing = check_crossover(controller, nominal_, results_);
    if (crossing) return {};
    if (auto noise = noise_out_of_reach(options_, nominal_, results_)) return tl::unexpected(*noise);
    if (auto bound = crossing_out_of_reach(options_, nominal_, results_, trials()))
      return tl::unexpected(*bound);
    return crossing;
  }

  expected<void, Error> choose() {
    auto& all = tuning_.candidates;
    std::erase_if(all, [](const TunedController& c) { return !c.stable; });
    if (all.empty()) {
      if (auto noise = noise_out_of_reach(options_, nominal_, results_)) return tl::unexpected(*noise);
      return tl::unexpected(out_of_reach(options_, nominal_, results_, trials(), "no controller"));
    }
    const auto iae = [this](const TunedController& c) {
      if (nominal_.size() > 1 && c.gains && c.gains->ki > 0.0 && !c.derivative_gain && !c.position_gain) {
        double sum = 0.0;
        for (const auto& machine : nominal_) sum += load_step_iae(machine, *c.gains);
        return sum;
      }
      const auto* figure = c.figure("load_step_iae");
      return figure == nullptr ? std::numeric_limits<double>::infinity() : figure->value;
    };
    const std::string_view wanted = name_of(chosen_structure());
    std::stable_sort(all.begin(), all.end(), [&](const TunedController& a, const TunedController& b) {
      if (options_.structure != Structure::automatic) return a.structure == wanted && b.structure != wanted;
      if (a.within != b.within) return a.within;
      return iae(a) < iae(b);
    });
    if (options_.structure != Structure::automatic && all.front().structure != wanted)
      return refuse("structure",
                    fmt::format("{}: none was found that meets the bounds with the confidence; a {} does",
                                wanted, all.front().structure));
    // A filter must earn its place.
    constexpr double kWorthIt = 0.95;
    if (options_.structure == Structure::automatic && all.size() > 1 && all[0].structure != "pi" &&
        all[1].within && iae(all[0]) > kWorthIt * iae(all[1])) {
      std::swap(all[0], all[1]);
      all[1].remark = "less than 5 % better: not worth its filter";
    }
    if (auto crossing = crosses_inside(all.front()); !crossing) return crossing;
    if (options_.least_bandwidth_hz) {
      const auto* bandwidth = all.front().figure("load_bandwidth_hz");
      const double reached = reached_of(bandwidth);
      if (reached < *options_.least_bandwidth_hz)
        return tl::unexpected(bandwidth_out_of_reach(options_, nominal_, reached, trials()));
    }
    return {};
  }

  Tuning finished() {
    const bool trusted =
        std::all_of(results_.begin(), results_.end(), [](const Result& r) { return r.trusted; });
    const bool crosses_inside = std::ranges::find(tuning_.findings, "crossover-not-measured",
                                                  &diagnostics::Finding::id) == tuning_.findings.end();
    tuning_.trusted = trusted && crosses_inside && tuning_.proposed().within &&
                      !is_step_far_beyond(tuning_.proposed(), tuning_);
    add_remarks(tuning_, results_);
    return std::move(tuning_);
  }

  std::span<const Result> results_;
  const TuneOptions& options_;
  std::vector<design::Posterior> posteriors_;
  std::vector<design::Machine> nominal_;
  double sample_time_s_ = 0.0;
  std::map<std::string, design::Bounds> designed_under_;  ///< [structure]
  Tuning tuning_;
};

}  // namespace

expected<Tuning, Error> tune(std::span<const Result> results, const TuneOptions& options) {
  if (auto usable = check_usable(results, options); !usable) return tl::unexpected(usable.error());
  if (auto checked = check(results, options); !checked) return tl::unexpected(checked.error());
  if (!results.front().model) return tune_by_response(results.front(), options);
  return Tuner(results, options).run();
}

expected<Tuning, Error> tune(const Result& result, const TuneOptions& options) {
  return tune(std::span(&result, 1), options);
}

}  // namespace resonid::identification
