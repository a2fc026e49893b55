// SPDX-License-Identifier: MIT
#include "identification/tune/loop_figures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>

#include "design/figures.hpp"
#include "design/normal.hpp"
#include "design/same_crossing.hpp"
#include "identification/tune/figure_values.hpp"
#include "identification/tune/worst_figures.hpp"
#include "linalg/parallel.hpp"

namespace resonid::identification {
namespace {

constexpr double kLow = 0.025, kHigh = 0.975;
constexpr double kShareOfLines = 0.3;  // of machines of the posterior: between them peaks are refined

/// What one machine shows.
struct OneMachine {
  std::vector<FigureValue> figures;
  std::vector<design::Crossing> crossings;
  std::vector<std::complex<double>> loop;                ///< [frequency]
  std::vector<double> sensitivity, complementary, load;  ///< [frequency]
  StepResponses steps;
};

/// How long steps are followed: until the slowest pole has let go of all but a thousandth.
std::size_t samples_of(const TunedController& c, double sample_time_s) {
  const double decay = -std::log(std::clamp(c.spectral_radius, 0.1, 1.0 - 1e-6));
  const double least = 0.05 / sample_time_s;
  return static_cast<std::size_t>(std::clamp(std::log(1e3) / decay, std::max(50.0, least), kLongestSteps));
}

/// Whether steps that end there show the loop settled: nothing is left that could leave the band of 2 %, or
/// nothing has moved for half of the time, as where the slow pole has a zero beside it.
bool are_whole(const TunedController& c, const design::Machine& machine, const Law& law,
               std::size_t samples) {
  constexpr double kBand = 0.02, kCalm = 0.002;
  const double left = std::pow(c.spectral_radius, static_cast<double>(samples));
  if (!c.stable || left < kBand) return true;
  const auto steps = step_responses(machine, law, samples);
  const auto& y = steps.load_by_reference;
  return std::all_of(y.begin() + static_cast<std::ptrdiff_t>(y.size() / 2), y.end(),
                     [](double v) { return std::abs(v - 1.0) < kCalm; });
}

class Describer {
 public:
  Describer(const RobustLaw& found, const FigureTask& task)
      : found_(found),
        task_(task),
        posterior_(task.robust.posteriors.front()),
        nominal_(posterior_.nominal(), posterior_.known_to_hz()),
        controller_(found.law.what) {}

  TunedController run() {
    const auto figures = design::figures_of(nominal_, found_.law.linear);
    controller_.stable = figures.stable;
    controller_.spectral_radius = figures.spectral_radius;
    for (const auto& crossing : figures.crossings) controller_.crossings.push_back({crossing});
    controller_.modes = figures.modes;
    controller_.draws = found_.check.draws;
    controller_.exceeding = found_.check.exceeding;
    controller_.unstable = found_.check.unstable;
    controller_.radius = found_.radius;
    choose_lines(figures);
    const OneMachine here = on(nominal_, 1.0);
    const auto drawn = draws();
    put_figures(here, drawn);
    put_crossings(drawn);
    put_worst();
    if (task_.curves) put_curves(here, drawn);
    return std::move(controller_);
  }

 private:
  void choose_lines(const design::LoopFigures& figures) {
    constexpr double kBelow = 30.0;
    double crossover = 0.0;
    for (const auto& crossing : figures.crossings) crossover = std::max(crossover, crossing.frequency_hz);
    const double nyquist = 0.5 / nominal_.sample_time_s();
    const double from = (crossover > 0.0 ? figures.crossings.front().frequency_hz : 0.01 * nyquist) / kBelow;
    for (const double f : design::first_lines_hz(nominal_.model(), found_.law.linear))
      if (f >= from && f < nyquist) lines_hz_.push_back(f);
    samples_ = samples_of(controller_, nominal_.sample_time_s());
    whole_ = are_whole(controller_, nominal_, found_.law, samples_);
  }

  [[nodiscard]] OneMachine on(const design::Machine& machine, double share) const {
    OneMachine one;
    one.steps = step_responses(machine, found_.law, samples_);
    one.steps.whole = whole_;
    auto figures = design::figures_of(machine, found_.law.linear, share);
    one.figures = figure_values(figures, machine, found_.law, one.steps, task_.reference_step);
    one.crossings = std::move(figures.crossings);
    if (!task_.curves) return one;
    for (const auto& v : design::LoopFunctions(machine.response(), found_.law.linear).at(lines_hz_)) {
      one.loop.push_back(v.loop);
      one.sensitivity.push_back(v.size_of(design::Transfer::sensitivity));
      one.complementary.push_back(v.size_of(design::Transfer::complementary));
      one.load.push_back(v.size_of(design::Transfer::load_transfer));
    }
    return one;
  }

  [[nodiscard]] std::vector<OneMachine> draws() const {
    design::StandardNormal normal(task_.robust.seed + 1);
    std::vector<Eigen::VectorXd> points;
    for (std::size_t i = 0; i < task_.draws; ++i) points.push_back(normal.next(posterior_.dimension()));
    std::vector<OneMachine> drawn(points.size());
    linalg::for_each_index(points.size(), 0, [&](std::size_t i) {
      drawn[i] = on(design::Machine(posterior_.at(points[i]), posterior_.known_to_hz()), kShareOfLines);
    });
    return drawn;
  }

  void put_figures(const OneMachine& here, const std::vector<OneMachine>& drawn) {
    for (std::size_t f = 0; f < here.figures.size(); ++f) {
      const auto& value = here.figures[f];
      if (!value.value) continue;
      LoopFigure figure{std::string(figure_name(f)),
                        figure_unit(f, controller_, task_.units),
                        *value.value,
                        value.frequency_hz,
                        {},
                        {},
                        {},
                        {},
                        {}};
      std::vector<double> all;
      for (const auto& one : drawn)
        if (one.figures[f].value) all.push_back(*one.figures[f].value);
      put_interval(std::move(all), figure.low, figure.high);
      controller_.figures.push_back(std::move(figure));
    }
  }

  static void put_interval(std::vector<double> all, std::optional<double>& low, std::optional<double>& high) {
    if (all.size() < 2) return;
    std::sort(all.begin(), all.end());
    low = ordered_quantile(all, kLow);
    high = ordered_quantile(all, kHigh);
  }

  void put_crossings(const std::vector<OneMachine>& drawn) {
    for (auto& crossing : controller_.crossings) {
      std::vector<double> at_hz, margins_deg;
      for (const auto& one : drawn) {
        const auto* same = design::same_crossing(one.crossings, controller_.crossings, crossing);
        if (same == nullptr) continue;
        at_hz.push_back(same->frequency_hz);
        margins_deg.push_back(margin_beside(crossing, *same));
      }
      put_interval(std::move(at_hz), crossing.frequency_low_hz, crossing.frequency_high_hz);
      put_interval(std::move(margins_deg), crossing.phase_margin_low_deg, crossing.phase_margin_high_deg);
    }
  }

  /// Of the same crossing of another machine, on the turn of this one's.
  static double margin_beside(const design::Crossing& crossing, const design::Crossing& same) {
    return crossing.phase_margin_deg +
           std::remainder(same.phase_margin_deg - crossing.phase_margin_deg, 360.0);
  }

  /// Figures that are bounded: where they end over the ellipsoid, and how often they exceed.
  void put_worst() {
    constexpr double kActive = 0.985;
    for (const auto& worst : found_.worst) {
      const auto t = static_cast<std::size_t>(worst.peak.transfer);
      for (auto& figure : controller_.figures) {
        if (figure.name != figure_name(t)) continue;
        figure.worst = worst.peak.value;
        figure.bound = worst.peak.bound;
        if (found_.check.draws > 0)
          figure.probability =
              static_cast<double>(found_.check.exceeding_each[t]) / static_cast<double>(found_.check.draws);
        if (worst.peak.value >= kActive * worst.peak.bound) controller_.limits.push_back(figure.name);
      }
    }
    if (task_.curves && controller_.stable) {
      put_worst_of_unbounded();
      put_worst_of_rest();
    }
  }

  /// Over the same ellipsoids, what nothing bounds.
  void put_worst_of_unbounded() {
    for (const auto transfer : design::kTransfers) {
      const auto name = figure_name(static_cast<std::size_t>(transfer));
      for (auto& figure : controller_.figures)
        if (figure.name == name && !figure.worst) figure.worst = worst_of_all(transfer);
    }
  }

  [[nodiscard]] double worst_of_all(design::Transfer transfer) const {
    double worst = 0.0;
    for (const auto& posterior : task_.robust.posteriors)
      worst = std::max(worst, worst_case(posterior, found_.law.linear, transfer, found_.radius).peak.value);
    return worst;
  }

  /// Over the same ellipsoids, what is no maximum over frequency.
  void put_worst_of_rest() {
    std::vector<std::optional<double>> severity(figure_count() + controller_.crossings.size(),
                                                -std::numeric_limits<double>::infinity());
    for (const auto& posterior : task_.robust.posteriors) {
      const auto here = worst_figures(posterior, found_.radius, [this](const design::Machine& machine) {
        return severities_of_stable(machine);
      });
      for (std::size_t f = 0; f < severity.size(); ++f) {
        const bool known = severity[f] && f < here.size() && here[f];
        severity[f] = known ? std::optional(std::max(*severity[f], *here[f])) : std::nullopt;
      }
    }
    for (std::size_t f = design::kTransfers.size(); f < figure_count(); ++f)
      for (auto& figure : controller_.figures)
        if (figure.name == figure_name(f) && severity[f])
          figure.worst =
              value_of_severity(f, std::max(*severity[f], severity_of(f, figure.value)), figure.value);
    const std::size_t phase = figure_index("phase_margin_deg");
    for (std::size_t i = 0; i < controller_.crossings.size(); ++i) {
      auto& crossing = controller_.crossings[i];
      const double margin = crossing.phase_margin_deg;
      if (const auto& worst = severity[figure_count() + i])
        crossing.phase_margin_worst_deg =
            value_of_severity(phase, std::max(*worst, severity_of(phase, margin)), margin);
    }
  }

  /// By severity_of(): every figure, then the phase margin of each crossing, where a machine crosses there.
  [[nodiscard]] std::optional<std::vector<double>> severities_of_stable(
      const design::Machine& machine) const {
    if (!loop_of(machine, found_.law).is_stable()) return std::nullopt;
    auto steps = step_responses(machine, found_.law, samples_);
    steps.whole = whole_;
    const auto figures = design::figures_of(machine, found_.law.linear, kShareOfLines);
    const auto values = figure_values(figures, machine, found_.law, steps, task_.reference_step);
    std::vector<double> severities;
    for (std::size_t f = 0; f < values.size(); ++f)
      severities.push_back(severity_of(f, values[f].value.value_or(absent_value(f))));
    const std::size_t phase = figure_index("phase_margin_deg");
    for (const auto& crossing : controller_.crossings) {
      const auto* same = design::same_crossing(figures.crossings, controller_.crossings, crossing);
      severities.push_back(severity_of(phase, same ? same->phase_margin_deg : absent_value(phase)));
    }
    return severities;
  }

  template <class Values>
  [[nodiscard]] static Band band_of(const OneMachine& here, const std::vector<OneMachine>& drawn,
                                    std::size_t every, Values&& values_of) {
    Band band;
    const auto& nominal = values_of(here);
    std::vector<double> all(drawn.size());
    for (std::size_t i = 0; i < nominal.size(); i += every) {
      band.value.push_back(nominal[i]);
      if (drawn.empty()) continue;
      for (std::size_t d = 0; d < drawn.size(); ++d) all[d] = values_of(drawn[d])[i];
      std::sort(all.begin(), all.end());
      band.low.push_back(ordered_quantile(all, kLow));
      band.high.push_back(ordered_quantile(all, kHigh));
    }
    return band;
  }

  void put_curves(const OneMachine& here, const std::vector<OneMachine>& drawn) {
    LoopCurves& c = controller_.curves;
    c.frequency_hz = lines_hz_;
    c.loop = here.loop;
    put_loop_bands(here, drawn, c);
    c.sensitivity = band_of(
        here, drawn, 1, [](const OneMachine& m) -> auto& { return m.sensitivity; });
    c.complementary = band_of(
        here, drawn, 1, [](const OneMachine& m) -> auto& { return m.complementary; });
    c.load_transfer = band_of(
        here, drawn, 1, [](const OneMachine& m) -> auto& { return m.load; });
    put_ellipses(here, drawn, c);
    constexpr std::size_t kShown = 400;
    const std::size_t every = std::max<std::size_t>(1, (samples_ + kShown - 1) / kShown);
    for (std::size_t k = 0; k < samples_; k += every)
      c.time_s.push_back(static_cast<double>(k) * nominal_.sample_time_s());
    c.load_by_reference = band_of(
        here, drawn, every, [](const OneMachine& m) -> auto& { return m.steps.load_by_reference; });
    c.torque_by_reference = band_of(
        here, drawn, every, [](const OneMachine& m) -> auto& { return m.steps.torque_by_reference; });
    c.load_by_torque = band_of(
        here, drawn, every, [](const OneMachine& m) -> auto& { return m.steps.load_by_torque; });
    for (auto* band : {&c.load_by_reference, &c.torque_by_reference})
      for (auto* values : {&band->value, &band->low, &band->high})
        for (double& x : *values) x *= task_.reference_step;
  }

  /// Phases of draws are taken on the turn of the identified machine's.
  static void put_loop_bands(const OneMachine& here, const std::vector<OneMachine>& drawn, LoopCurves& c) {
    struct Polar {
      std::vector<double> size, phase;
    };
    const auto polar = [](const OneMachine& m, double first_deg) {
      Polar p{{}, loop_phase_deg(m.loop, first_deg)};
      for (const auto& v : m.loop) p.size.push_back(std::abs(v));
      return p;
    };
    std::vector<Polar> all;
    all.reserve(drawn.size());
    const Polar nominal = polar(here, kUsualPhaseDeg);
    const double first_deg = nominal.phase.empty() ? kUsualPhaseDeg : nominal.phase.front();
    for (const auto& one : drawn) all.push_back(polar(one, first_deg));
    std::vector<double> values(all.size());
    const auto put = [&](std::vector<double> Polar::*part, Band& band) {
      band.value = nominal.*part;
      if (all.empty()) return;
      for (std::size_t i = 0; i < band.value.size(); ++i) {
        for (std::size_t d = 0; d < all.size(); ++d) values[d] = (all[d].*part)[i];
        std::sort(values.begin(), values.end());
        band.low.push_back(ordered_quantile(values, kLow));
        band.high.push_back(ordered_quantile(values, kHigh));
      }
    };
    put(&Polar::size, c.loop_size);
    put(&Polar::phase, c.loop_phase_deg);
  }

  /// Where the loop crosses, and where |S| is largest.
  void put_ellipses(const OneMachine& here, const std::vector<OneMachine>& drawn, LoopCurves& c) const {
    if (drawn.size() < 3) return;
    std::vector<double> keys;
    for (const auto& crossing : controller_.crossings) keys.push_back(crossing.frequency_hz);
    if (const auto* peak = controller_.figure("sensitivity_peak"); peak != nullptr && peak->frequency_hz)
      keys.push_back(*peak->frequency_hz);
    std::sort(keys.begin(), keys.end());
    for (const double key : keys) {
      const auto at = std::lower_bound(lines_hz_.begin(), lines_hz_.end(), key);
      if (at == lines_hz_.end()) continue;
      const auto i = static_cast<std::size_t>(at - lines_hz_.begin());
      LoopCurves::Ellipse ellipse{lines_hz_[i], here.loop[i]};
      if (!c.ellipses.empty() && c.ellipses.back().frequency_hz == ellipse.frequency_hz) continue;
      std::complex<double> mean = 0.0;
      for (const auto& one : drawn) mean += one.loop[i] / static_cast<double>(drawn.size());
      for (const auto& one : drawn) {
        const Eigen::Vector2d d((one.loop[i] - mean).real(), (one.loop[i] - mean).imag());
        ellipse.covariance += d * d.transpose() / static_cast<double>(drawn.size() - 1);
      }
      c.ellipses.push_back(ellipse);
    }
  }

  const RobustLaw& found_;
  const FigureTask& task_;
  const design::Posterior& posterior_;
  design::Machine nominal_;
  TunedController controller_;
  std::vector<double> lines_hz_;
  std::size_t samples_ = 0;
  bool whole_ = true;
};

}  // namespace

std::vector<double> loop_phase_deg(const std::vector<std::complex<double>>& loop, double first_deg) {
  std::vector<double> phase;
  for (const auto& value : loop) {
    const double turn = std::arg(value) * 180.0 / kPi, last = phase.empty() ? first_deg : phase.back();
    phase.push_back(turn - 360.0 * std::round((turn - last) / 360.0));
  }
  return phase;
}

TunedController with_figures(const RobustLaw& found, const FigureTask& task) {
  return Describer(found, task).run();
}

const LoopFigure* TunedController::figure(std::string_view figure_name) const {
  const auto found = std::find_if(figures.begin(), figures.end(),
                                  [&](const LoopFigure& f) { return f.name == figure_name; });
  return found == figures.end() ? nullptr : &*found;
}

}  // namespace resonid::identification
