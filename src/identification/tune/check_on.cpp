// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/identification/compare.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/identification/tune.hpp>

#include "design/normal.hpp"
#include "identification/tune/checks.hpp"
#include "identification/tune/common_change.hpp"
#include "identification/tune/law.hpp"
#include "identification/tune/loop_figures.hpp"

namespace resonid::identification {
namespace {

using diagnostics::Severity;

constexpr double kSure = 0.001;    // probability by chance below which a difference counts
constexpr double kMatters = 0.05;  // of the distance to -1, of the gain, and as far turned at the crossover
/// Gain and delay that a recording must be able to show, docs/methods/tune.md 17, step 8.
constexpr double kSeenGain = 0.1, kSeenDelay_samples = 0.25;

/// L of one machine at lines.
std::vector<std::complex<double>> loop_at(const fit::DriveModel& model, const Law& law,
                                          std::span<const double> lines_hz) {
  const fit::SampledResponse plant(model);
  std::vector<std::complex<double>> loop;
  for (const auto& v : design::LoopFunctions(plant, law.linear).at(lines_hz)) loop.push_back(v.loop);
  return loop;
}

/// Whether lines are estimated with their neighbours.
bool smooths(const Result& measured) {
  constexpr std::array kOfNeighbours = {Method::local_polynomial, Method::local_cubic, Method::local_rational,
                                        Method::welch};
  return std::any_of(kOfNeighbours.begin(), kOfNeighbours.end(),
                     [&](Method method) { return measured.method == name_of(method); });
}

/// What identification found of another controller than the one it was told; null: nothing.
const diagnostics::Finding* other_controller(const Result& measured) {
  const auto found = std::ranges::find_if(measured.findings, [](const diagnostics::Finding& f) {
    return f.id == "controller-differs" && f.severity == Severity::error;
  });
  return found == measured.findings.end() ? nullptr : &*found;
}

/// L at the lines, by the controller that was told.
data::FrequencyResponse told_loop(const Result& measured, const data::TransferFunction& controller) {
  data::FrequencyResponse loop = measured.response;
  for (std::size_t i = 0; i < loop.lines(); ++i) {
    const double f = loop.frequency_hz[i];
    const auto c = controller.response(f) * std::polar(1.0, -kTwoPi * f * late_by(measured));
    loop.value[i] *= c;
    if (i < loop.std.size()) loop.std[i] *= std::abs(c);
  }
  return loop;
}

/// L at the lines: Ru/U - 1 where lines are estimated by themselves; estimates that look at neighbouring
/// lines smooth U/Ru where it rises from nothing, so that of those L is the controller times the response,
/// unless another controller ran.
data::FrequencyResponse measured_loop(const Result& measured, const data::TransferFunction& controller) {
  if (!smooths(measured) || other_controller(measured) != nullptr) return *measured.measured_loop;
  return told_loop(measured, controller);
}

class Checker {
 public:
  /// `promised`: the proposed controller with its figures on the machine of `designed_for`.
  Checker(Tuning& tuning, const TunedController& promised, const Result& designed_for, const Result& measured)
      : t_(tuning),
        promised_(promised),
        designed_for_(designed_for),
        measured_(measured),
        law_(law_of(tuning.proposed().feedback)) {}

  void run() {
    check_.record = measured_.record.file;
    compare_lines();
    compare_margins();
    judge();
    for (std::size_t i = 0; i < check_.predicted.size(); ++i)
      if (const double variance = std::norm(check_.predicted_std[i]) + std::norm(check_.measured_std[i]);
          is_near_margins(i) && variance > 0.0)
        misfit_ += std::norm(check_.measured[i] - check_.predicted[i]) / variance;
    t_.check = std::move(check_);
  }

  /// Of lines near the margins: squares of their differences over their variances.
  [[nodiscard]] double misfit() const { return misfit_; }

 private:
  void compare_lines() {
    const auto loop = measured_loop(measured_, t_.proposed().feedback);
    const auto posteriors = posteriors_of({&designed_for_, 1}, t_.options);
    const auto nominal = loop_at(machine_of(designed_for_), law_, loop.frequency_hz);
    constexpr std::size_t kDraws = 200;
    design::StandardNormal normal(t_.options.seed + 2);
    std::vector<double> variance(nominal.size(), 0.0);
    std::vector<std::vector<std::complex<double>>> draws;
    for (std::size_t d = 0; d < kDraws; ++d) {
      auto drawn = loop_at(posteriors.front().at(normal.next(posteriors.front().dimension())), law_,
                           loop.frequency_hz);
      for (std::size_t i = 0; i < drawn.size(); ++i)
        variance[i] += std::norm(drawn[i] - nominal[i]) / static_cast<double>(kDraws);
      draws.push_back(std::move(drawn));
    }
    for (std::size_t i = 0; i < nominal.size(); ++i) {
      const double noise = i < loop.std.size() ? loop.std[i] : 0.0;
      check_.frequency_hz.push_back(loop.frequency_hz[i]);
      check_.predicted.push_back(nominal[i]);
      check_.predicted_std.push_back(std::sqrt(variance[i]));
      check_.measured.push_back(loop.value[i]);
      check_.measured_std.push_back(noise);
    }
    for (std::size_t i = 0; i < nominal.size(); ++i)
      judge_line(i, variance[i] + std::norm(check_.measured_std[i]));
    judge_together(draws);
  }

  /// The judged ones of all lines.
  [[nodiscard]] std::vector<std::complex<double>> judged(
      const std::vector<std::complex<double>>& loop) const {
    std::vector<std::complex<double>> near;
    for (std::size_t i = 0; i < loop.size(); ++i)
      if (is_near_margins(i)) near.push_back(loop[i]);
    return near;
  }

  /// Gain and delay by all lines at once, which see what no line sees alone, and what they could have seen.
  void judge_together(const std::vector<std::vector<std::complex<double>>>& draws) {
    CommonChange common;
    for (std::size_t i = 0; i < check_.predicted.size(); ++i)
      if (is_near_margins(i))
        common.add(check_.frequency_hz[i], check_.predicted[i], check_.measured_std[i] * times_noise());
    constexpr std::size_t kFewest = 3;
    const auto* crossover = promised_.figure("crossover_hz");
    if (common.lines() < kFewest || crossover == nullptr) return;
    double gain_variance = 0.0, delay_variance = 0.0;
    for (const auto& loop : draws) {
      const auto change = common.of(judged(loop));
      gain_variance += change.gain * change.gain / static_cast<double>(draws.size());
      delay_variance += change.delay_s * change.delay_s / static_cast<double>(draws.size());
    }
    const auto change = common.of(judged(check_.measured)), noise = common.noise();
    check_.gain_change = {change.gain, std::hypot(noise.gain, std::sqrt(gain_variance))};
    check_.delay_change_s = {change.delay_s, std::hypot(noise.delay_s, std::sqrt(delay_variance))};
    const double turn_s = 1.0 / (kTwoPi * crossover->value);  // by which the loop turns a radian there
    constexpr double kStandard = 3.29;  // deviations, beyond which a normal error is by kSure
    gain_ = {kStandard, kMatters};
    delay_ = {kStandard, kMatters * turn_s};
    check_.detectable_gain = gain_.detectable(noise.gain);
    check_.detectable_delay_s = delay_.detectable(noise.delay_s);
    most_delay_s_ = std::max(kSeenDelay_samples * t_.sample_time_s, kSeenGain * turn_s);
  }

  /// Estimates that look at neighbouring lines share their noise: as many lines tell less.
  [[nodiscard]] double times_noise() const { return smooths(measured_) ? std::sqrt(3.0) : 1.0; }

  [[nodiscard]] static bool exceeds(const std::optional<data::Estimate>& change, const Criterion& criterion) {
    return change && std::abs(change->value) > criterion.threshold(change->std);
  }

  /// Lines far above 0 dB are as good as their leakage, and what is far below it moves nothing; the ends of a
  /// sweep are where it begins and stops.
  [[nodiscard]] bool is_near_margins(std::size_t i) const {
    constexpr double kLarge = 10.0, kSmall = 0.05;
    const double size = std::abs(check_.predicted[i]);
    return i > 0 && i + 1 < check_.predicted.size() && size <= kLarge && size >= kSmall;
  }

  /// Where the margins lie, by a part of the distance to -1 that matters.
  void judge_line(std::size_t i, double variance) {
    const auto predicted = check_.predicted[i];
    if (!is_near_margins(i)) return;
    ++check_.judged_lines;
    const double difference = std::abs(check_.measured[i] - predicted);
    if (difference - 2.0 * std::sqrt(variance) < kMatters * std::abs(1.0 + predicted)) return;
    // E|error|^2 = variance of a complex normal number: its square exceeds d times that with e^-d.
    const double distance = variance > 0.0 ? difference * difference / variance : HUGE_VAL;
    const double probability =
        std::min(1.0, std::exp(-distance) * static_cast<double>(check_.predicted.size()));
    if (probability < check_.probability) {
      check_.probability = probability;
      check_.worst_line_hz = check_.frequency_hz[i];
    }
  }

  void compare_margins() {
    if (!measured_.loop) return;
    const auto& l = *measured_.loop;
    const auto put = [&](const char* name, std::optional<double> value, std::optional<double> std) {
      const auto* promised = promised_.figure(name);
      if (promised == nullptr || !value) return;
      CheckedFigure figure{name, promised->unit, {promised->value, 0.0}, {*value, std.value_or(0.0)}, {}};
      constexpr double kWidth = 2.0 * 1.96;
      if (promised->low && promised->high) figure.predicted.std = (*promised->high - *promised->low) / kWidth;
      const double both = std::hypot(figure.predicted.std, figure.measured.std);
      if (both > 0.0 && std)
        figure.probability = std::erfc(std::abs(*value - promised->value) / both / std::sqrt(2.0));
      check_.figures.push_back(std::move(figure));
    };
    put("crossover_hz", l.margins.crossover_hz(), l.crossover_std_hz);
    put("phase_margin_deg", l.margins.phase_margin_deg(), l.phase_margin_std_deg);
    put("gain_margin_db", l.margins.gain_margin_db, l.gain_margin_std_db);
    if (l.margins.modulus_margin > 0.0) {
      const double ms = 1.0 / l.margins.modulus_margin;
      std::optional<double> std;
      if (l.modulus_margin_std) std = *l.modulus_margin_std * ms * ms;
      put("sensitivity_peak", ms, std);
    }
  }

  void judge() {
    const bool figure_differs = std::any_of(check_.figures.begin(), check_.figures.end(), [&](const auto& f) {
      return f.probability && *f.probability * static_cast<double>(check_.figures.size()) < kSure;
    });
    const bool together = exceeds(check_.gain_change, gain_) || exceeds(check_.delay_change_s, delay_);
    check_.agrees = !figure_differs && !together && check_.probability >= kSure;
    // No fault of the recording, which is not trusted for it, but just what a check is for.
    if (other_controller(measured_) != nullptr) return fails();
    if (!measured_.trusted || (check_.judged_lines == 0 && check_.figures.empty())) {
      return undecided("the recording itself tells too little",
                       "The recording under this controller is itself not reliable (see what 'identify' says "
                       "of it): whether the loop is as promised cannot be told from it.");
    }
    if (check_.agrees && !is_decisive()) return undecided("the recording is too noisy to tell", too_noisy());
    if (!check_.agrees) fails();
  }

  void fails() {
    check_.agrees = false;
    if (check_.worst_line_hz == 0.0) check_.probability = least_probability();
    check_.cause = cause();
    t_.findings.push_back(
        {"prediction-fails", Severity::error, check_.probability, kSure,
         fmt::format(
             "Under this controller the loop is another one than was promised, by more than both error "
             "bars{}. Likely cause: {}.",
             check_.worst_line_hz > 0.0 ? fmt::format(" (furthest at {:.3g} Hz)", check_.worst_line_hz) : "",
             check_.cause)});
    t_.trusted = false;
  }

  void undecided(const char* cause, std::string meaning) {
    check_.agrees = check_.decided = false;
    check_.cause = cause;
    t_.findings.push_back({"check-undecided", Severity::warning, check_.detectable_gain,
                           check_.detectable_gain ? std::optional(kSeenGain) : std::nullopt,
                           std::move(meaning)});
  }

  /// Whether it would have shown a difference that matters.
  [[nodiscard]] bool is_decisive() const {
    return check_.detectable_gain && *check_.detectable_gain <= kSeenGain && check_.detectable_delay_s &&
           *check_.detectable_delay_s <= most_delay_s_;
  }

  [[nodiscard]] std::string too_noisy() const {
    if (!check_.detectable_gain)
      return "The recording under this controller has too few lines near the crossover to tell whether the "
             "loop is as promised: excite that band.";
    return fmt::format(
        "Nothing differs, but the recording would show a gain only from {:.2g} %, a delay from {:.2g} ms on: "
        "too noisy to tell whether the loop is as promised, for which {:.2g} % and {:.2g} ms must be seen. "
        "Excite more strongly, or for longer.",
        100.0 * *check_.detectable_gain, 1e3 * *check_.detectable_delay_s, 100.0 * kSeenGain,
        1e3 * most_delay_s_);
  }

  [[nodiscard]] std::string cause() const {
    if (const auto* other = other_controller(measured_)) return other_words(*other);
    const auto changes = compare(designed_for_, measured_);
    if (!changes) return "not found out";
    if (!measured_.model) return "the new recording shows no drive model: see its findings";
    if (measured_.model->drive.structure != designed_for_.model->drive.structure)
      return "another mode: the new recording shows a " +
             std::string(name_of(measured_.model->drive.structure)) + " machine";
    return cause_of(*changes);
  }

  [[nodiscard]] std::string other_words(const diagnostics::Finding& other) const {
    constexpr double kGain = 0.02;  // below which it differs by something else
    if (const auto factor = factor_of_controller(); factor && std::abs(*factor - 1.0) > kGain)
      return fmt::format("the drive runs another controller: gain {:.0f} % too {}",
                         100.0 * std::abs(*factor - 1.0), *factor > 1.0 ? "large" : "small");
    return fmt::format("the drive runs another controller: typically {:.0f} % off",
                       100.0 * other.value.value_or(0.0));
  }

  /// Ru/U - 1 over controller and response: by how much the controller that ran is larger than the one told,
  /// at the typical line near the margins.
  [[nodiscard]] std::optional<double> factor_of_controller() const {
    const auto& shown = *measured_.measured_loop;
    const auto told = told_loop(measured_, t_.proposed().feedback);
    if (told.lines() != shown.lines()) return std::nullopt;
    std::vector<double> factors;
    for (std::size_t i = 0; i < told.lines(); ++i)
      if (is_near_margins(i) && std::abs(told.value[i]) > 0.0)
        factors.push_back(std::abs(shown.value[i]) / std::abs(told.value[i]));
    if (factors.empty()) return std::nullopt;
    return median(std::move(factors));
  }

  [[nodiscard]] double least_probability() const {
    double least = 1.0;
    for (const auto& f : check_.figures) least = std::min(least, f.probability.value_or(1.0));
    for (const auto& change : {check_.gain_change, check_.delay_change_s})
      if (change && change->std > 0.0)
        least = std::min(least, std::erfc(std::abs(change->value) / change->std / std::sqrt(2.0)));
    return least;
  }

  /// How surely something differs, in standard deviations.
  struct Suspect {
    std::string words;
    double distance = 0.0;
  };

  /// What both delays come to, known and fitted.
  [[nodiscard]] Suspect delay_suspect() const {
    const auto &a = designed_for_.model->drive, &b = measured_.model->drive;
    const double change = b.known_delay_s + b.delay_s - a.known_delay_s - a.delay_s;
    const double std = std::hypot(a.estimate(fit::kDelay).std, b.estimate(fit::kDelay).std);
    return {fmt::format("the delay ({:+.3g} ms)", 1e3 * change), std > 0.0 ? std::abs(change) / std : 0.0};
  }

  /// The parameter that differs most surely; all of them by one factor are the gain.
  [[nodiscard]] std::string cause_of(const Changes& changes) const {
    struct Name {
      std::string_view name;
      const char* words;
    };
    constexpr std::array kNames = {Name{"driven_inertia", "driven side's inertia"},
                                   Name{"load_inertia", "load's inertia"}, Name{"stiffness", "stiffness"}};
    constexpr double kSurely = 3.3;
    std::vector<Suspect> suspects = {delay_suspect()};
    double least = HUGE_VAL, most = -HUGE_VAL;
    std::size_t sure = 0;
    for (const auto& d : changes.parameters)
      for (const auto& known : kNames) {
        if (d.name != known.name || !d.std || !(*d.std > 0.0) || !d.relative) continue;
        suspects.push_back({fmt::format("the {} ({:+.3g} %)", known.words, 100.0 * *d.relative),
                            std::abs(d.change) / *d.std});
        least = std::min(least, *d.relative);
        most = std::max(most, *d.relative);
        if (suspects.back().distance > kSurely) ++sure;
      }
    constexpr double kAlike = 0.2;  // of the change
    if (sure == kNames.size() && most - least < kAlike * std::max(std::abs(least), std::abs(most)))
      return fmt::format(
          "the gain: inertias and stiffness all differ by {:+.3g} %, as a torque constant or a "
          "scale makes it",
          50.0 * (least + most));
    const auto& first = *std::max_element(suspects.begin(), suspects.end(), [](const auto& a, const auto& b) {
      return a.distance < b.distance;
    });
    if (first.distance > kSurely) return first.words;
    return "no parameter differs for sure: another mode or a non-linear part";
  }

  Tuning& t_;
  const TunedController& promised_;
  const Result& designed_for_;
  const Result& measured_;
  Law law_;
  TuningCheck check_;
  Criterion gain_, delay_;
  double most_delay_s_ = 0.0;  ///< That must be seen.
  double misfit_ = 0.0;
};

/// The proposed controller with its figures on the machine of another result than the first.
TunedController promised_on(const Tuning& tuning, const Result& designed_for) {
  const auto& o = tuning.options;
  const auto posteriors = posteriors_of({&designed_for, 1}, o);
  const RobustTask robust{posteriors, {}, o.confidence, o.guarantee, o.draws, o.seed};
  const RobustLaw law{law_of(tuning.proposed()), tuning.proposed().radius, {}, {}};
  constexpr std::size_t kIntervalDraws = 200;
  return with_figures(law, {robust, tuning.units, o.reference_step, kIntervalDraws, false});
}

expected<void, Error> check_promised(const Tuning& tuning, std::span<const Result> designed_for) {
  const auto has_model = [](const Result& r) { return r.model.has_value(); };
  if (tuning.machines.empty() || !std::ranges::all_of(designed_for, has_model))
    return refuse("check", "needs a design from a drive model: this one rests on a response");
  if (tuning.schedule)
    return refuse("check", "needs the controller of one place, found a schedule; give .evaluate");
  return {};
}

expected<void, Error> check_comparable(const Tuning& tuning, const Result& measured) {
  if (!measured.measured_loop || measured.measured_loop->frequency_hz.empty())
    return refuse("check",
                  "must be recorded with an excitation added to the controller's output, in closed "
                  "loop: the loop is measured by L = Ru/U - 1");
  const double rate = measured.record.sample_rate_hz;
  if (std::abs(rate * tuning.sample_time_s - 1.0) > 0.01)
    return refuse("check", fmt::format("was sampled at {:g} Hz, the controller runs at {:g} Hz", rate,
                                       1.0 / tuning.sample_time_s));
  if (measured.units.response != tuning.units.response)
    return refuse("check",
                  fmt::format("is in {}, the design in {}", measured.units.response, tuning.units.response));
  return {};
}

/// What a recording shows beside one of several machines.
struct Comparison {
  TuningCheck check;
  std::vector<diagnostics::Finding> findings;
  bool trusted = false;
  double misfit = 0.0;
  std::size_t machine = 0;

  /// Whether it explains the recording better: agreement, then doubt, then the likelier.
  [[nodiscard]] bool is_better_than(const Comparison& other) const {
    const auto rank = [](const TuningCheck& c) { return c.agrees ? 2 : c.decided ? 0 : 1; };
    if (rank(check) != rank(other.check)) return rank(check) > rank(other.check);
    if (check.probability != other.check.probability) return check.probability > other.check.probability;
    return misfit < other.misfit;
  }
};

std::string file_of_machine(const Tuning& tuning, std::span<const Result> results, std::size_t i) {
  return tuning.results.size() == results.size() ? tuning.results[i] : name_of_result(results, i);
}

}  // namespace

expected<void, Error> check_on(Tuning& tuning, const Result& designed_for, const Result& measured) {
  if (auto checked = check_promised(tuning, {&designed_for, 1}); !checked) return checked;
  if (auto checked = check_comparable(tuning, measured); !checked) return checked;
  const TunedController promised = tuning.proposed();
  Checker(tuning, promised, designed_for, measured).run();
  return {};
}

expected<void, Error> check_on(Tuning& tuning, std::span<const Result> designed_for,
                               std::span<const Result> measured) {
  if (designed_for.size() == 1 && measured.size() == 1)
    return check_on(tuning, designed_for.front(), measured.front());
  if (measured.empty() || measured.size() != designed_for.size())
    return refuse("check", fmt::format("was identified {} times, required once for each of {} results",
                                       measured.size(), designed_for.size()));
  if (auto checked = check_promised(tuning, designed_for); !checked) return checked;
  for (const Result& r : measured)
    if (auto checked = check_comparable(tuning, r); !checked) return checked;
  const auto findings = tuning.findings;
  const bool trusted = tuning.trusted;
  std::optional<Comparison> best;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    tuning.findings = findings;
    tuning.trusted = trusted;
    const auto promised = i == 0 ? tuning.proposed() : promised_on(tuning, designed_for[i]);
    Checker checker(tuning, promised, designed_for[i], measured[i]);
    checker.run();
    Comparison here{*tuning.check, tuning.findings, tuning.trusted, checker.misfit(), i};
    if (!best || here.is_better_than(*best)) best = std::move(here);
  }
  tuning.check = std::move(best->check);
  tuning.findings = std::move(best->findings);
  tuning.trusted = best->trusted;
  tuning.findings.push_back(
      {"checked-machine",
       Severity::info,
       {},
       {},
       fmt::format("Of the {} machines that of {} explains the recording best: it is compared with that.",
                   designed_for.size(), file_of_machine(tuning, designed_for, best->machine))});
  return {};
}

}  // namespace resonid::identification
