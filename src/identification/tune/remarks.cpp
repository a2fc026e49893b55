// SPDX-License-Identifier: MIT
#include "identification/tune/remarks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <resonid/base/constants.hpp>
#include <utility>
#include <vector>

#include "design/known_band.hpp"
#include "identification/tune/checks.hpp"
#include "identification/tune/figure_values.hpp"
#include "identification/tune/law.hpp"
#include "identification/tune/loop_figures.hpp"

namespace resonid::identification {
namespace {

using diagnostics::Severity;

class Remarks {
 public:
  Remarks(Tuning& tuning, std::span<const Result> results) : t_(tuning), results_(results) {}

  void add() {
    untrusted();
    not_within();
    assumed_delay();
    holding();
    beyond_band();
    promise_ends();
    warned();
    step();
    cut(t_.proposed(), "The");
    if (t_.running) cut(*t_.running, "With the running controller the");
    scheduling();
    sticking();
    bending();
  }

 private:
  void note(const char* id, Severity severity, std::string meaning, std::optional<double> value = {},
            std::optional<double> threshold = {}) {
    t_.findings.push_back({id, severity, value, threshold, std::move(meaning)});
  }

  void untrusted() {
    for (const Result& r : results_)
      if (!r.trusted)
        note("tuned-untrusted", Severity::error,
             fmt::format("The result of {} is not trusted: its machine may be another one, and this "
                         "controller wrong for it. Do not run it without cure of that result's findings.",
                         r.record.file));
  }

  /// Where poles lie that tell how: of the first machine, and of the controller itself.
  [[nodiscard]] std::string unstable_words(const TunedController& c) const {
    constexpr double kNear = 1e-4, kOnCircle = 1e-6;
    const double step = t_.sample_time_s, rate = std::log(c.spectral_radius) / step;
    std::string how = "what it does grows";
    for (const auto& mode : c.modes) {
      const double grows = -kTwoPi * mode.frequency_hz * mode.damping_ratio;
      const double turn = std::sqrt(std::max(0.0, 1.0 - mode.damping_ratio * mode.damping_ratio));
      if (std::abs(grows - rate) < kNear * rate && turn > 0.0)
        how = fmt::format("an oscillation at {:.3g} Hz grows", mode.frequency_hz * turn);
    }
    if (rate * step < kOnCircle)
      return fmt::format(
          "The loop does not come to rest on the identified machine (spectral radius {:.4f}): what disturbs "
          "it stays.",
          c.spectral_radius);
    std::string text = fmt::format(
        "The loop is unstable on the identified machine (spectral radius {:.4f}): {} tenfold in {:.3g} s.",
        c.spectral_radius, how, std::log(10.0) / rate);
    double largest = 0.0;
    for (const auto& pole : c.feedback.poles()) largest = std::max(largest, std::abs(pole));
    if (largest > 1.0 + kOnCircle)
      text += fmt::format(" The controller is unstable by itself: it has a pole at |z| = {:.4g}.", largest);
    return text;
  }

  void not_within() {
    const auto& c = t_.proposed();
    if (!c.stable) return note("design-unstable", Severity::error, unstable_words(c), c.spectral_radius, 1.0);
    if (c.within) return;
    note("bounds-exceeded", Severity::error,
         fmt::format(
             "{:.3g} % of the machines that may be exceed a bound{}; allowed are {:.3g} %.",
             100.0 * c.probability(),
             c.unstable > 0 ? fmt::format(", and in {} of {} the loop is unstable", c.unstable, c.draws) : "",
             100.0 * (1.0 - t_.options.confidence)),
         c.probability(), 1.0 - t_.options.confidence);
  }

  /// The files of the results whose delay has no variance, where others have one.
  [[nodiscard]] std::vector<std::string> without_delay_std() const {
    std::vector<std::string> files;
    if (std::ranges::none_of(results_, has_delay_std)) return files;
    for (std::size_t i = 0; i < results_.size(); ++i)
      if (!has_delay_std(results_[i])) files.push_back(name_of_result(results_, i));
    return files;
  }

  void assumed_delay() {
    if (!t_.delay_std_assumed) return;
    const auto some = without_delay_std();
    const std::string lacking =
        some.empty()
            ? std::string(results_.size() > 1 ? "No result holds a variance of the delay"
                                              : "The result holds no variance of the delay")
            : fmt::format("The result{} of {} hold{} no variance of the delay", some.size() > 1 ? "s" : "",
                          fmt::join(some, ", "), some.size() > 1 ? "" : "s");
    note("delay-uncertainty-assumed", Severity::info,
         fmt::format("{}: a quarter of a sample, {:.3g} ms, is taken as its standard deviation. Identified "
                     "without .delay_s it is estimated, with an error bar that is often far smaller, which "
                     "lets gains be larger; what is known better is told by .delay_std_s.",
                     lacking, 1e3 * t_.delay_std_s),
         t_.delay_std_s);
  }

  void holding() {
    for (const Result& r : results_) {
      const auto n = hold_of(r);
      if (n < 2) continue;
      const double late_s = 0.5 * static_cast<double>(n - 1) * t_.sample_time_s;
      return note("hold-in-loop", Severity::info,
                  fmt::format("The measured velocity is new in every {}th sample only: in the mean it is "
                              "{:.3g} ms later, which the design counts as delay. Measured more often, the "
                              "loop could be stiffer.",
                              n, 1e3 * late_s),
                  late_s);
    }
  }

  struct ReferenceStepOf {
    double overshoot_percent = 0.0, peak_torque = 0.0;
    std::string where;  ///< " on the machine of ..."; empty: where figures are from.
  };
  /// The step of the figures, and of one controller for several machines those of the others.
  [[nodiscard]] std::vector<ReferenceStepOf> steps_from(ReferenceStepOf first) const {
    std::vector<ReferenceStepOf> steps = {std::move(first)};
    const auto& c = t_.proposed();
    if (t_.schedule || c.position_gain || !c.stable) return steps;
    const Law law = law_of(c);
    for (std::size_t i = 1; i < t_.machines.size(); ++i) {
      const auto found = reference_step_of(design::Machine(t_.machines[i]), law);
      steps.push_back({100.0 * found.overshoot, t_.options.reference_step * found.peak_torque,
                       " on " + name_of_machine(results_, i)});
    }
    return steps;
  }

  void step() {
    constexpr double kRounding = 1.001;
    const auto& c = t_.proposed();
    const auto* overshoot = c.figure("reference_overshoot");
    const auto* torque = c.figure("reference_peak_torque");
    if (t_.is_evaluation() || overshoot == nullptr || torque == nullptr) return;
    const auto& o = t_.options;
    const auto steps = steps_from({overshoot->value, torque->value, {}});
    const auto& hardest = *std::ranges::max_element(steps, {}, &ReferenceStepOf::peak_torque);
    const auto& furthest = *std::ranges::max_element(steps, {}, &ReferenceStepOf::overshoot_percent);
    const bool far = is_step_far_beyond(c, t_);
    if (o.torque_limit && (far || hardest.peak_torque > kRounding * *o.torque_limit))
      note("step-not-kept", far ? Severity::error : Severity::warning,
           fmt::format("A reference step of {:g} {} takes {:.3g} {}{}, more than the drive has ({:.3g}): it "
                       "will be cut{}. Ramp the reference.",
                       o.reference_step, c.position_gain ? place_unit(t_.units.velocity) : t_.units.velocity,
                       hardest.peak_torque, torque->unit, hardest.where, *o.torque_limit,
                       far ? ", and nothing that is promised of it will hold" : ""),
           hardest.peak_torque, *o.torque_limit);
    if (furthest.overshoot_percent > kRounding * 100.0 * o.overshoot && !c.position_gain)
      note("step-not-kept", Severity::info,
           fmt::format("After a reference step the load overshoots by {:.3g} %{}, more than {:.3g} %{}.",
                       furthest.overshoot_percent, furthest.where, 100.0 * o.overshoot,
                       integrates(c) ? ", whatever the set-point weight" : ""),
           furthest.overshoot_percent, 100.0 * o.overshoot);
  }

  /// Steps that would have to be followed for too long promise nothing of their end.
  void cut(const TunedController& c, std::string_view the) {
    if (!c.stable || c.figure("load_step_peak") == nullptr || c.figure("reference_overshoot") != nullptr)
      return;
    const double end_s = kLongestSteps * t_.sample_time_s;
    const double settled_s = std::log(1e3) / -std::log(c.spectral_radius) * t_.sample_time_s;
    note("promise-cut", Severity::warning,
         fmt::format("{} loop takes {:.3g} s to settle, and its steps are followed for {:.3g} s: overshoot, "
                     "settling and largest torque of the reference step are not promised.",
                     the, settled_s, end_s),
         settled_s, end_s);
  }

  /// A mode above the band would be met by a loop that is not small there (docs/methods/tune.md 7.10);
  /// designs keep it small.
  void beyond_band() {
    constexpr double kRounding = 1.01;
    const auto& c = t_.proposed().curves;
    for (const Result& r : results_) {
      const double end = measured_band(r).high_hz;
      double largest = 0.0, at = 0.0, size = 0.0;
      for (std::size_t i = 0; i < c.frequency_hz.size(); ++i) {
        const double weighted = design::weight_beyond(c.frequency_hz[i], end) * std::abs(c.loop[i]);
        if (!(weighted > largest)) continue;
        largest = weighted;
        size = std::abs(c.loop[i]);
        at = c.frequency_hz[i];
      }
      if (largest > kRounding)
        return note("loop-beyond-band", Severity::warning,
                    fmt::format("The loop is still {:.2g} at {:.3g} Hz, above the measured band ({:.3g} Hz): "
                                "a further resonance there could make it unstable. Excite up to there.",
                                size, at, end),
                    size, size / largest);
    }
  }

  /// What the bound on |S| is worth above the band, where the response may be another one by the disk of
  /// docs/methods/tune.md 7.10: |1 + L (1 + d)|, |d| <= rho. An octave above and beyond that is the least of
  /// |1 + L| - |L|.
  void promise_ends() {
    constexpr double kRounding = 1.01;
    const auto& c = t_.proposed();
    const auto* figure = c.figure("sensitivity_peak");
    if (!c.stable || figure == nullptr || !figure->bound || c.curves.loop.empty()) return;
    double end = design::kKnownEverywhere;
    for (const Result& r : results_) end = std::min(end, known_to_hz(r));
    double largest = 0.0, at = 0.0, needed = end;
    for (std::size_t i = 0; i < c.curves.frequency_hz.size(); ++i) {
      const double f = c.curves.frequency_hz[i];
      if (f < end) continue;
      const double size = std::abs(c.curves.loop[i]),
                   left = std::abs(1.0 + c.curves.loop[i]) - std::min(1.0, f / end - 1.0) * size;
      const double s = left > 0.0 ? 1.0 / left : std::numeric_limits<double>::infinity();
      if (s > largest) {
        largest = s;
        at = f;
      }
      if (1.0 / std::max(1e-9, 1.0 - 2.0 * size) > *figure->bound) needed = f;  // whatever stands there
    }
    if (largest <= kRounding * *figure->bound) return;
    note("promise-ends-with-band", Severity::warning,
         fmt::format("The bounds are promised up to {:.3g} Hz, where the machine was measured. A mode above, "
                     "which the recording could not show, would leave the loop stable, but may take |S| to "
                     "{:.3g} near {:.3g} Hz (bound {:.3g}). Excite up to {:.3g} Hz.",
                     end, largest, at, *figure->bound, needed),
         end, needed);
  }

  /// What identification warned of or noted, and the design does not already count or tell.
  void warned() {
    constexpr std::array kTold = {"backlash", "stiffening-coupling", "torque-gain", "held-output"};
    constexpr std::array kCounts = {"further-delay", "margins-beyond-band"};  // whatever their severity
    for (std::size_t i = 0; i < results_.size(); ++i) {
      std::vector<std::string> warnings, notes;
      for (const auto& f : results_[i].findings) {
        const bool warns = f.severity == Severity::warning,
                   counts = std::ranges::find(kCounts, f.id) != kCounts.end();
        if (!(warns || counts) || std::ranges::find(kTold, f.id) != kTold.end()) continue;
        auto& ids = f.severity == Severity::info ? notes : warnings;
        if (std::ranges::find(ids, f.id) == ids.end()) ids.push_back(f.id);
      }
      std::string text;
      if (!warnings.empty()) text = fmt::format("warned: {}", fmt::join(warnings, ", "));
      if (!notes.empty())
        text += fmt::format("{}noted: {}", text.empty() ? "" : "; ", fmt::join(notes, ", "));
      if (!text.empty())
        note("result-warned", Severity::info,
             fmt::format("Identification ({}) {}. That stands for this design too.",
                         name_of_result(results_, i), text));
    }
  }

  /// A filter must earn its place, and so must a schedule.
  void scheduling() {
    constexpr double kAsGood = 0.98;
    if (!t_.schedule || !t_.schedule->fixed_iae || !t_.schedule->scheduled_iae || t_.candidates.size() < 2)
      return;
    const double fixed = *t_.schedule->fixed_iae, scheduled = *t_.schedule->scheduled_iae;
    if (!t_.candidates[1].within || scheduled < kAsGood * fixed) return;
    note("schedule-not-needed", Severity::info,
         fmt::format(
             "One PI for all positions does as well: IAE {:.3g} on a run through the stroke, {:.3g} with "
             "the schedule, and it needs no position.",
             fixed, scheduled),
         scheduled, fixed);
  }

  void sticking() {
    for (const Result& r : results_) {
      const auto& friction = r.model->coulomb_friction;
      const bool dry = r.model->has_dry_friction();
      if (!dry || !integrates(t_.proposed())) continue;
      return note(
          "integral-with-dry-friction", Severity::info,
          fmt::format("The machine has dry friction{}: with an integral part a position may hunt around "
                      "its target, and the figures hold while it moves. Simulate it, leave the "
                      "integral part out at rest, or design without one (.structure p).",
                      friction ? fmt::format(" ({:.3g} {})", friction->value, r.units.torque) : ""));
    }
  }

  /// What identification found of a machine that no linear model describes stands for the design too.
  void bending() {
    for (const Result& r : results_)
      for (const auto& f : r.findings)
        if (f.id == "backlash" || f.id == "stiffening-coupling" || f.id == "torque-gain") {
          note("design-of-linear-part", Severity::warning,
               "Identification found that the machine is not linear (" + f.id +
                   "): margins and steps are those of its linear part.");
          return;
        }
  }

  Tuning& t_;
  std::span<const Result> results_;
};

}  // namespace

bool is_step_far_beyond(const TunedController& controller, const Tuning& tuning) {
  constexpr double kFar = 2.0;
  const auto* torque = controller.figure("reference_peak_torque");
  return !tuning.is_evaluation() && !controller.position_gain && tuning.options.torque_limit &&
         torque != nullptr && torque->worst.value_or(torque->value) > kFar * *tuning.options.torque_limit;
}

void add_remarks(Tuning& tuning, std::span<const Result> results) { Remarks(tuning, results).add(); }

}  // namespace resonid::identification
