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
constexpr double kMatters = 0.05;  // of the distance to -1, and of the gain
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
    if (const auto delay = delay_beyond_bound()) check_.detectable_delay_s = delay;
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
    if (common.lines() < kFewest || promised_.figure("crossover_hz") == nullptr) return;
    double gain_variance = 0.0, delay_variance = 0.0;
    for (const auto& loop : draws) {
      const auto change = common.of(judged(loop));
      gain_variance += change.gain * change.gain / static_cast<double>(draws.size());
      delay_variance += change.delay_s * change.delay_s / static_cast<double>(draws.size());
    }
    const auto change = common.of(judged(check_.measured)), noise = common.noise();
    check_.gain_change = {change.gain, std::hypot(noise.gain, std::sqrt(gain_variance))};
    check_.delay_change_s = {change.delay_s, std::hypot(noise.delay_s, std::sqrt(delay_variance))};
    const double whole_s = delay_of_whole_distance_s();
    constexpr double kStandard = 3.29;  // deviations, beyond which a normal error is by kSure
    gain_ = {kStandard, kMatters};
    delay_ = {kStandard, kMatters * whole_s};
    check_.detectable_gain = gain_.detectable(check_.gain_change->std);
    check_.detectable_delay_s = delay_.detectable(check_.delay_change_s->std);
    shown_ = {gain_.detectable(noise.gain), delay_.detectable(noise.delay_s)};
    most_delay_s_ = std::max(kSeenDelay_samples * t_.sample_time_s, kSeenGain * whole_s);
  }

  /// A delay dt moves L by w dt |L|, w dt |T| of the distance to -1: where that is largest, often at a
  /// crossing far above the first, the delay that would move it by all of that distance.
  [[nodiscard]] double delay_of_whole_distance_s() const {
    double fastest = 0.0;
    for (std::size_t i = 0; i < check_.predicted.size(); ++i)
      if (const auto& loop = check_.predicted[i]; is_near_margins(i))
        fastest = std::max(fastest, kTwoPi * check_.frequency_hz[i] * std::abs(loop / (1.0 + loop)));
    return 1.0 / fastest;
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

  /// Half of the promised interval on the side of what is measured: intervals of margins are lopsided. Where
  /// next to nothing lies on that side, as for a figure that is least on the identified machine, half of
  /// the mean of both.
  [[nodiscard]] static double std_towards(const LoopFigure& promised, double measured) {
    if (!promised.low || !promised.high) return 0.0;
    const double side =
        measured > promised.value ? *promised.high - promised.value : promised.value - *promised.low;
    const double both = *promised.high - *promised.low;
    constexpr double kHalfOf95 = 1.96;  // standard deviations
    return std::max(side, 0.25 * both) / kHalfOf95;
  }

  void compare_margins() {
    if (!measured_.loop) return;
    const auto& l = *measured_.loop;
    const auto put = [&](const char* name, std::optional<double> value, std::optional<double> std) {
      const auto* promised = promised_.figure(name);
      if (promised == nullptr || !value) return;
      CheckedFigure figure{name,
                           promised->unit,
                           {promised->value, std_towards(*promised, *value)},
                           {*value, std.value_or(0.0)},
                           {}};
      constexpr double kOfDraws = 1.1;  // 200 machines tell the end of an interval to a tenth
      const double both = std::hypot(kOfDraws * figure.predicted.std, figure.measured.std);
      if (both > 0.0 && std)
        figure.probability = std::erfc(std::abs(*value - promised->value) / both / std::sqrt(2.0));
      check_.figures.push_back(std::move(figure));
    };
    put("crossover_hz", l.margins.crossover_hz(), l.crossover_std_hz);
    put_phase_margin(put);
    put("gain_margin_db", l.margins.gain_margin_db, l.gain_margin_std_db);
    if (l.margins.modulus_margin > 0.0) {
      const double ms = 1.0 / l.margins.modulus_margin;
      std::optional<double> std;
      if (l.modulus_margin_std) std = *l.modulus_margin_std * ms * ms;
      put("sensitivity_peak", ms, std);
    }
  }

  /// Promised is the least of all crossings; the error bar is that of the first crossover.
  template <class Put>
  void put_phase_margin(const Put& put) const {
    const auto& l = *measured_.loop;
    const auto first = l.margins.phase_margin_deg(), least = l.margins.worst_phase_margin_deg;
    if (!least || (first && std::abs(*first) <= std::abs(*least)))
      return put("phase_margin_deg", first, l.phase_margin_std_deg);
    put("phase_margin_deg", least, std::nullopt);
  }

  /// Figures that are compared with an error bar: so many chances there are that one differs by noise.
  [[nodiscard]] double compared_figures() const {
    return static_cast<double>(
        std::ranges::count_if(check_.figures, [](const auto& f) { return f.probability.has_value(); }));
  }

  /// How far a figure may be measured beyond its bound by its own error bar, at the confidence for all of
  /// them.
  [[nodiscard]] double room_of(const CheckedFigure& figure) const {
    const double chances = std::max(1.0, compared_figures());
    return two_sided_quantile(1.0 - (1.0 - t_.options.confidence) / chances) * figure.measured.std;
  }

  [[nodiscard]] std::optional<double> bound_of(const CheckedFigure& figure) const {
    const auto* promised = t_.proposed().figure(figure.name);
    return promised == nullptr ? std::nullopt : promised->bound;
  }

  /// What is measured beyond a bound is so, whatever was promised of it and however well both agree.
  void judge_bounds() {
    constexpr double kRounding = 1.005;  // what lies closer is within what a fitted model leaves out
    for (const auto& figure : check_.figures) {
      const auto bound = bound_of(figure);
      if (!bound || !(figure.measured.std > 0.0)) continue;
      const double room = room_of(figure);
      if (figure.measured.value - room <= kRounding * *bound) continue;
      t_.findings.push_back(
          {"measured-beyond-bound", Severity::error, figure.measured.value, *bound,
           fmt::format(
               "Under this controller {} measures {:.4g} +- {:.1g}, beyond its bound of {:.3g} by more "
               "than its error bar; promised was {:.4g}.",
               words_of(figure), figure.measured.value, room, *bound, figure.predicted.value)});
      t_.trusted = false;
    }
  }

  /// Margins at and beyond the edge of the band have no error bar.
  [[nodiscard]] const CheckedFigure* beyond_without_bar() const {
    const auto found = std::ranges::find_if(check_.figures, [&](const auto& figure) {
      const auto bound = bound_of(figure);
      return bound && !(figure.measured.std > 0.0) && figure.measured.value > *bound;
    });
    return found == check_.figures.end() ? nullptr : &*found;
  }

  /// The largest |S| along the lines of what was promised, later by so much.
  [[nodiscard]] double largest_sensitivity(double delay_s) const {
    double least = HUGE_VAL;
    for (std::size_t i = 0; i < check_.predicted.size(); ++i)
      least = std::min(
          least,
          std::abs(1.0 + check_.predicted[i] * std::polar(1.0, -kTwoPi * check_.frequency_hz[i] * delay_s)));
    return 1.0 / least;
  }

  /// The delay with which |S| would be measured beyond its bound 90 % of the time, where that is less than
  /// what all lines together show.
  [[nodiscard]] std::optional<double> delay_beyond_bound() const {
    const auto s = std::ranges::find(check_.figures, "sensitivity_peak", &CheckedFigure::name);
    if (!check_.detectable_delay_s || s == check_.figures.end() || !(s->measured.std > 0.0))
      return std::nullopt;
    const auto bound = bound_of(*s);
    if (!bound) return std::nullopt;
    constexpr double kNinety = 1.2816;  // 90 % quantile of the normal distribution
    const double limit = *bound + room_of(*s) + kNinety * std::hypot(s->predicted.std, s->measured.std);
    double low = 0.0, high = *check_.detectable_delay_s;
    if (largest_sensitivity(low) > limit || largest_sensitivity(high) <= limit) return std::nullopt;
    constexpr int kHalvings = 30;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (low + high);
      (largest_sensitivity(middle) > limit ? high : low) = middle;
    }
    return high;
  }

  [[nodiscard]] bool differs(const CheckedFigure& figure) const {
    return figure.probability && *figure.probability * compared_figures() < kSure;
  }

  void judge() {
    const bool figure_differs =
        std::ranges::any_of(check_.figures, [&](const auto& figure) { return differs(figure); });
    const bool together = exceeds(check_.gain_change, gain_) || exceeds(check_.delay_change_s, delay_);
    check_.agrees = !figure_differs && !together && check_.probability >= kSure;
    // No fault of the recording, which is not trusted for it, but just what a check is for.
    if (other_controller(measured_) != nullptr) return fails();
    if (!measured_.trusted || (check_.judged_lines == 0 && check_.figures.empty())) {
      return undecided("the recording itself tells too little",
                       "The recording under this controller is itself not reliable (see what 'identify' says "
                       "of it): whether the loop is as promised cannot be told from it.");
    }
    judge_bounds();
    if (const auto* figure = beyond_without_bar(); check_.agrees && figure != nullptr)
      return undecided(
          "a figure lies beyond its bound, and the recording does not tell how well it is known",
          fmt::format(
              "Nothing differs, but {} measures {:.3g}, beyond its bound of {:.3g}, and the recording "
              "does not tell how well that is known: excite around the crossover, and beyond it.",
              words_of(*figure), figure->measured.value, *bound_of(*figure)));
    if (check_.agrees && !is_decisive()) return undecided("the recording is too noisy to tell", too_noisy());
    if (!check_.agrees) fails();
  }

  [[nodiscard]] static std::string words_of(const CheckedFigure& figure) {
    if (figure.name == "crossover_hz") return "the crossover";
    if (figure.name == "phase_margin_deg") return "the phase margin";
    if (figure.name == "gain_margin_db") return "the gain margin";
    return "|S|";
  }

  /// "furthest at 12 Hz", and the figures that differ by themselves.
  [[nodiscard]] std::string where_words() const {
    std::vector<std::string> words;
    if (check_.worst_line_hz > 0.0)
      words.push_back(fmt::format("furthest at {:.3g} Hz", check_.worst_line_hz));
    for (const auto& figure : check_.figures)
      if (differs(figure))
        words.push_back(fmt::format("{} {:.3g}{}, promised {:.3g}", words_of(figure), figure.measured.value,
                                    figure.unit.empty() ? "" : " " + figure.unit, figure.predicted.value));
    return words.empty() ? std::string() : fmt::format(" ({})", fmt::join(words, "; "));
  }

  void fails() {
    check_.agrees = false;
    if (check_.probability >= kSure) check_.probability = least_probability();
    check_.cause = cause();
    t_.findings.push_back(
        {"prediction-fails", Severity::error, check_.probability, kSure,
         fmt::format(
             "Under this controller the loop is another one than was promised, by more than both error "
             "bars{}. Likely cause: {}.",
             where_words(), check_.cause)});
    t_.trusted = false;
  }

  void undecided(const char* cause, std::string meaning) {
    check_.agrees = check_.decided = false;
    check_.cause = cause;
    t_.findings.push_back({"check-undecided", Severity::warning,
                           shown_ ? std::optional(shown_->gain) : std::nullopt,
                           shown_ ? std::optional(kSeenGain) : std::nullopt, std::move(meaning)});
  }

  /// Whether its noise would let a difference show that matters, were the promise exact.
  [[nodiscard]] bool is_decisive() const {
    return shown_ && shown_->gain <= kSeenGain && shown_->delay_s <= most_delay_s_;
  }

  [[nodiscard]] std::string too_noisy() const {
    if (!shown_)
      return "The recording under this controller has too few lines near the crossover to tell whether the "
             "loop is as promised: excite that band.";
    return fmt::format(
        "Nothing differs, but the recording would show a gain only from {:.2g} %, a delay from {:.2g} ms on: "
        "too noisy to tell whether the loop is as promised, for which {:.2g} % and {:.2g} ms must be seen. "
        "Excite more strongly, or for longer.",
        100.0 * shown_->gain, 1e3 * shown_->delay_s, 100.0 * kSeenGain, 1e3 * most_delay_s_);
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
    double least = check_.probability;
    for (const auto& f : check_.figures)
      if (f.probability) least = std::min(least, compared_figures() * *f.probability);
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
  std::optional<CommonChange::Change>
      shown_;                  ///< Least changes that show for the noise of the recording alone.
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
