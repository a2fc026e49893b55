// SPDX-License-Identifier: MIT
#include "identification/tune/response_only.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <span>
#include <string>

#include "design/between_lines.hpp"
#include "design/ends_of_lines.hpp"
#include "design/line_margins.hpp"
#include "design/response_disks.hpp"
#include "identification/tune/checks.hpp"
#include "identification/tune/designs.hpp"
#include "identification/tune/figure_values.hpp"
#include "identification/tune/law.hpp"
#include "identification/tune/loop_figures.hpp"
#include "identification/tune/named_bounds.hpp"

namespace resonid::identification {
namespace {

/// From the first line whose disk stays clear of 0 to the last, with the delay that was taken out.
data::FrequencyResponse known_lines(const Result& result, double confidence) {
  const auto& g = result.response;
  constexpr double kClear = 0.5;
  const double times = std::sqrt(std::log(static_cast<double>(g.lines()) / (1.0 - confidence)));
  const auto is_known = [&](std::size_t i) {
    return i < g.std.size() && times * g.std[i] < kClear * std::abs(g.value[i]);
  };
  std::size_t first = 0, last = g.lines();
  while (first < last && !is_known(first)) ++first;
  while (last > first && !is_known(last - 1)) --last;
  data::FrequencyResponse known;
  for (std::size_t i = first; i < last; ++i) {
    known.frequency_hz.push_back(g.frequency_hz[i]);
    known.value.push_back(g.value[i] * std::polar(1.0, -kTwoPi * g.frequency_hz[i] * late_by(result)));
    known.std.push_back(g.std[i]);
  }
  return known;
}

/// What lines of a response cannot tell.
expected<void, Error> check_wishes(const TuneOptions& o) {
  const auto needs = [](const char* field) {
    return refuse(field,
                  "needs a drive model, which the result does not hold: lines tell |S|, |T|, |C S| alone");
  };
  if (o.least_bandwidth_hz) return needs("least_bandwidth_hz");
  if (o.torque_limit) return needs("torque_limit");
  if (o.largest_noise_torque) return needs("largest_noise_torque");
  if (o.delay_std_s) return needs("delay_std_s");
  if (o.guarantee == Guarantee::ellipsoid) return needs("guarantee");
  return {};
}

/// The lowest, with its damping where that is known.
std::optional<design::AntiResonance> anti_resonance(const Result& result) {
  constexpr double kLittle = 0.02;
  for (const auto& mode : result.modes)
    if (mode.anti)
      return design::AntiResonance{mode.frequency_hz.value,
                                   mode.damping_ratio.value > 0.0 ? mode.damping_ratio.value : kLittle};
  return std::nullopt;
}

/// A response at its lines, as it was measured, and between them.
struct LinesOfPlant {
  design::FilledLines filled;
  std::vector<double> stds;

  LinesOfPlant(const data::FrequencyResponse& plant, const design::ResponseDisks& disks)
      : filled(design::between_lines(plant.frequency_hz, plant.value, disks.radii, disks.known_delay_s)) {
    const double first = disks.radii.front();
    const double part = first > 0.0 ? plant.std.front() / first : 0.0;  // one of all lines
    for (const double radius : filled.radii) stds.push_back(part * radius);
  }
};

/// What lines tell of a loop, and places between them.
class LineFigures {
 public:
  LineFigures(std::span<const double> frequencies_hz, std::span<const std::complex<double>> plant,
              const data::TransferFunction& controller)
      : frequencies_hz_(frequencies_hz) {
    for (std::size_t i = 0; i < plant.size(); ++i) {
      c_.push_back(controller.response(frequencies_hz[i]));
      loop_.push_back(c_.back() * plant[i]);
    }
  }

  [[nodiscard]] LoopFigure peak(design::Transfer transfer, const Units& units,
                                const TunedController& controller) const {
    LoopFigure figure;
    figure.name = figure_name(static_cast<std::size_t>(transfer));
    figure.unit = figure_unit(static_cast<std::size_t>(transfer), controller, units);
    for (std::size_t i = 0; i < loop_.size(); ++i) {
      const double size = std::abs((transfer == design::Transfer::sensitivity     ? 1.0
                                    : transfer == design::Transfer::complementary ? loop_[i]
                                                                                  : c_[i]) /
                                   (1.0 + loop_[i]));
      if (!(size > figure.value)) continue;
      figure.value = size;
      figure.frequency_hz = frequencies_hz_[i];
    }
    return figure;
  }

  /// With those of the plant's disks.
  [[nodiscard]] design::LineMargins margins(std::span<const double> radii) const {
    std::vector<double> of_loop;
    for (std::size_t i = 0; i < loop_.size(); ++i) of_loop.push_back(std::abs(c_[i]) * radii[i]);
    return design::line_margins(frequencies_hz_, loop_, of_loop);
  }

  void put_curves(std::span<const double> stds, LoopCurves& curves) const {
    curves.frequency_hz.assign(frequencies_hz_.begin(), frequencies_hz_.end());
    curves.loop = loop_;
    const auto phase = loop_phase_deg(loop_);
    for (std::size_t i = 0; i < loop_.size(); ++i) {
      const double bar = 1.96 * std::abs(c_[i]) * stds[i] / std::sqrt(2.0);
      const double size = std::abs(loop_[i]), s = 1.0 / std::abs(1.0 + loop_[i]);
      put(curves.loop_size, size, bar);
      put(curves.loop_phase_deg, phase[i], std::atan2(bar, size) * 180.0 / kPi);
      put(curves.sensitivity, s, bar * s * s);
      put(curves.complementary, size * s, bar * s * s);
    }
  }

 private:
  static void put(Band& band, double value, double bar) {
    band.value.push_back(value);
    band.low.push_back(value - bar);
    band.high.push_back(value + bar);
  }
  std::span<const double> frequencies_hz_;
  std::vector<std::complex<double>> c_, loop_;
};

void put_figures(const LinesOfPlant& plant, const Units& units, TunedController& controller) {
  const LineFigures lines(plant.filled.frequencies_hz, plant.filled.values, controller.feedback);
  for (const auto transfer : {design::Transfer::sensitivity, design::Transfer::complementary,
                              design::Transfer::controller_sensitivity})
    controller.figures.push_back(lines.peak(transfer, units, controller));
  lines.put_curves(plant.stds, controller.curves);
}

/// Margins, worst over the disks, and the crossover, of which the first one is told as everywhere.
void put_margins(const LinesOfPlant& plant, TunedController& controller) {
  const auto& filled = plant.filled;
  const auto margins =
      LineFigures(filled.frequencies_hz, filled.values, controller.feedback).margins(filled.radii);
  for (std::size_t i = 0; i < margins.crossings.size(); ++i) {
    controller.crossings.push_back({margins.crossings[i]});
    controller.crossings.back().phase_margin_worst_deg = margins.worst_deg[i];
  }
  const auto put = [&](const char* name, const char* unit, const std::optional<design::LineMargin>& margin) {
    if (!margin) return;
    LoopFigure figure;
    figure.name = name;
    figure.unit = unit;
    figure.value = margin->value;
    figure.worst = margin->worst;
    controller.figures.push_back(std::move(figure));
  };
  put("phase_margin_deg", "deg", margins.phase_deg);
  put("gain_margin_db", "dB", margins.gain_db);
  put("delay_margin_s", "s", margins.delay_s);
  const auto first = std::ranges::find(margins.crossings, true, &design::Crossing::falling);
  if (first == margins.crossings.end()) return;
  LoopFigure crossover;
  crossover.name = "crossover_hz";
  crossover.unit = "Hz";
  crossover.value = first->frequency_hz;
  controller.figures.push_back(std::move(crossover));
}

/// Why a loop is not known to be stable, and what would tell.
std::string untold_text(const design::ResponseLoop& loop) {
  const auto& stability = loop.stability;
  const double f = stability.frequency_hz;
  switch (stability.tells) {
    case design::LinesTell::wrong_sign:
      return fmt::format(
          "The loop is not known to be stable: at the first line, {:.3g} Hz, the response is {:.0f} deg away "
          "from that of an inertia. Check the signs of torque and velocity, or excite lower frequencies too.",
          f, stability.value);
    case design::LinesTell::turns_far:
      return fmt::format(
          "The loop is not known to be stable: at {:.3g} Hz 1 + L turns by {:.0f} deg from one line to the "
          "next. Record longer, which makes them denser, or lower the gains.",
          f, stability.value);
    case design::LinesTell::passes_zero:
      return fmt::format(
          "The loop is not known to be stable: at {:.3g} Hz L may be -1 within its error bar. Lower the "
          "gains, "
          "or excite more strongly there.",
          f);
    case design::LinesTell::passes_zero_between:
      return fmt::format(
          "The loop is not known to be stable: between the lines, at about {:.3g} Hz, L may be -1, by what "
          "the response turns from one to the next. Record longer, which makes them denser, or lower the "
          "gains.",
          f);
    case design::LinesTell::ends_below_resonance:
    case design::LinesTell::ends_large:
      return "The loop is not known to be stable: " +
             end_of_lines_words(f, stability.value, loop.end, stability.grows) + ".";
    default:
      return "By the turns of 1 + L along the lines the loop is unstable.";
  }
}

/// What a controller that was given may be: unstable, or beyond a bound.
void judge(const design::ResponseLoop& loop, Tuning& tuning) {
  const auto& stability = loop.stability;
  const auto& c = tuning.proposed();
  if (c.within) return;
  std::string beyond;
  for (const auto& figure : c.figures)
    if (figure.worst && figure.bound && *figure.worst > (1.0 + kRoom) * *figure.bound)
      beyond += fmt::format("{}{} up to {:.3g} (bound {:.3g})", beyond.empty() ? "" : ", ",
                            figure_words(figure.name), *figure.worst, *figure.bound);
  const bool ends = stability.tells == design::LinesTell::ends_below_resonance ||
                    stability.tells == design::LinesTell::ends_large;
  const bool is_unstable = stability.tells == design::LinesTell::unstable;
  tuning.findings.push_back(
      {c.stable      ? "bounds-exceeded"
       : is_unstable ? "design-unstable"
                     : "stability-not-told",
       diagnostics::Severity::error,
       ends ? std::optional(stability.value) : std::nullopt,
       {},
       c.stable ? "Responses within the error bars exceed a bound: " + beyond + "." : untold_text(loop)});
}

/// What the bounds are worth above the last line.
void promise_ends(const data::FrequencyResponse& plant, const design::ResponseLoop& loop, Tuning& tuning) {
  const auto& c = tuning.proposed();
  const auto* figure = c.figure("sensitivity_peak");
  if (!c.stable || figure == nullptr || !figure->bound || loop.end.is_whole) return;
  const double size = loop.largest_beyond, left = 1.0 - 2.0 * size;
  if (size <= design::MachineEnd::kBelowResonance && left * *figure->bound >= 1.0) return;
  tuning.findings.push_back(
      {"promise-ends-with-band",
       diagnostics::Severity::warning,
       plant.frequency_hz.back(),
       {},
       fmt::format(
           "The bounds are promised up to {:.3g} Hz, the last line that was measured. Above, what an "
           "inertia does there is taken for granted, up to twice as large: |S| may be {} (bound {:.3g}), "
           "and the loop is stable as long as no resonance lifts the machine's response {:.3g} times. "
           "Excite up to where |L| is small and falls.",
           plant.frequency_hz.back(),
           left > 0.0 ? fmt::format("{:.3g}", std::max(1.0, 1.0 / left)) : std::string("of any size"),
           *figure->bound, 1.0 / size)});
}

/// A bound, tighter than the usual one, that leaves no gain which the lines tell: which one, and what of it
/// does. Nothing where looser ones leave none either. `why`: what the lines of `file` miss.
std::optional<Error> no_gain_by_response(const TuneOptions& options, const design::ResponseDisks& disks,
                                         const std::optional<design::AntiResonance>& load,
                                         const std::string& file, const Error& why) {
  const auto bounds = plain_bounds(options), usual = plain_bounds({});
  const auto succeeds = [&](const design::Bounds& under) {
    return design::largest_integral_gain(disks, {}, under, load).has_value();
  };
  const NamedBound* cause = nullptr;  // where none alone is it, the first that was asked for
  auto loosened = bounds;
  std::string beside, could, together;
  for (const auto& named : kNamedBounds) {
    const auto& bound = bounds.*named.bound;
    const auto& of_default = usual.*named.bound;
    if (!bound || (of_default && *bound >= *of_default)) continue;
    add_to_list(beside, bound_text(named, *bound), ", ");
    loosened.*named.bound = of_default;
    add_to_list(together, of_default ? bound_text(named, *of_default) : fmt::format("no {}", named.symbol),
                ", ");
    auto under = bounds;
    const auto is_enough = [&](double value) {
      under.*named.bound = value;
      return succeeds(under);
    };
    constexpr double kWithin = 0.05, kFar = 1e3;
    const double loosest = named.loosest > 0.0 ? named.loosest : kFar * *bound;
    std::optional<double> least;
    if (loosest > *bound && is_enough(loosest))
      least = told_enough(named, least_enough(named, *bound, loosest, kWithin, is_enough),
                          {1.0, 1.1, 1.5, 2.0}, is_enough);
    if (cause == nullptr || (least && could.empty())) cause = &named;
    if (least) add_to_list(could, bound_text(named, *least), " or ");
  }
  if (cause == nullptr || (could.empty() && !succeeds(loosened))) return std::nullopt;
  const std::string found = std::isnan(why.value) ? "" : fmt::format(", found {:.3g}", why.value);
  return Error{
      cause->field,
      fmt::format("leaves no loop ({}) that the response of {} tells, which {}{}; {}, or excite lower "
                  "frequencies too",
                  beside, file, why.requirement.view(), found,
                  could.empty() ? "no single looser bound helps: ask for about " + together + " together"
                                : "ask for about " + could + " beside the others"),
      *(bounds.*(cause->bound))};
}

}  // namespace

bool is_response_only(const Result& result, const TuneOptions& options) {
  const bool pi =
      options.structure == ControllerStructure::automatic || options.structure == ControllerStructure::pi;
  return !result.model && pi && options.positions.empty() && !options.shaper && result.response.lines() > 2;
}

expected<Tuning, Error> tune_by_response(const Result& result, const TuneOptions& options) {
  const double step = 1.0 / result.record.sample_rate_hz;
  if (auto wishes = check_wishes(options); !wishes) return tl::unexpected(wishes.error());
  const auto plant = known_lines(result, options.confidence);
  auto disks = design::response_disks(plant, options.confidence, step);
  if (disks) disks->known_delay_s = late_by(result);
  const auto refused = [&](const Error& error) {
    return refuse("results",
                  fmt::format("hold no drive model, and the response of {} {}", result.record.file,
                              error.requirement.view()),
                  error.value);
  };
  if (!disks) return refused(disks.error());
  auto bounds = plain_bounds(options);
  const auto load = anti_resonance(result);
  if (!load && bounds.load_transfer)
    return refuse("results",
                  "hold neither a drive model nor an anti-resonance: nothing tells what the load does "
                  "at |S| alone, where it may swing several times as far; identify with a drive model");
  std::optional<Law> given;
  if (options.evaluate) {
    data::TransferFunction sampled = options.evaluate->sampled(step);
    sampled.sample_time_s = step;
    given = law_of(sampled);
    if (!options.evaluate_reference.empty()) set_reference(*given, options.evaluate_reference);
    if (options.evaluate_position_gain)
      return refuse("evaluate",
                    "must be a controller of velocity, to be judged by a response without a drive model");
    if (given->what.structure.empty()) given->what.structure = "given";
  }
  expected<design::ResponseLoop> found;
  auto controller = given ? given->what : TunedController();
  if (given) {
    found = design::judged_by_response(*disks, given->what.feedback, bounds, load);
  } else {
    const auto design = design::largest_integral_gain(*disks, {}, bounds, load);
    if (!design) {
      if (auto bound = no_gain_by_response(options, *disks, load, result.record.file, design.error()))
        return tl::unexpected(*std::move(bound));
      return refused(design.error());
    }
    controller = law_of(design->controller, step).what;
    found = *design;
  }
  if (!found && found.error().field == "controller")
    return refuse("evaluate", found.error().requirement.str(), found.error().value);
  if (!found) return refused(found.error());
  Tuning tuning;
  tuning.files = {result.record.file};
  tuning.units = result.units;
  tuning.sample_time_s = step;
  tuning.options = options;
  tuning.by_response = true;
  controller.stable = found->stability.tells == design::LinesTell::stable;
  controller.within = controller.stable && std::ranges::all_of(found->worst, [](const design::Peak& worst) {
                        return worst.value <= (1.0 + kRoom) * worst.bound;
                      });
  const LinesOfPlant lines(plant, *disks);
  put_figures(lines, result.units, controller);
  constexpr double kActive = 0.985;
  for (const auto& worst : found->worst) {
    const auto name = std::string(figure_name(static_cast<std::size_t>(worst.transfer)));
    auto at = std::find_if(controller.figures.begin(), controller.figures.end(),
                           [&](const LoopFigure& f) { return f.name == name; });
    if (at == controller.figures.end()) {
      LoopFigure figure;
      figure.name = name;
      figure.value = worst.value;
      figure.frequency_hz = worst.frequency_hz;
      at = controller.figures.insert(at, std::move(figure));
    }
    at->worst = worst.value;
    at->bound = worst.bound;
    if (worst.value >= kActive * worst.bound) controller.limits.push_back(name);
  }
  if (controller.stable) put_margins(lines, controller);  // else they mean nothing
  tuning.candidates = {std::move(controller)};
  judge(*found, tuning);
  promise_ends(plant, *found, tuning);
  if (options.running) {
    auto running = law_of(options.running->sampled(step)).what;
    running.structure = "running";
    running.stable = true;  // it was recorded under it
    put_figures(lines, result.units, running);
    put_margins(lines, running);
    tuning.running = std::move(running);
  }
  tuning.findings.push_back(
      {"design-by-response",
       diagnostics::Severity::info,
       {},
       {},
       fmt::format("The result holds no drive model: {} every response within the error bars of all "
                   "{} lines, from {:.3g} to {:.3g} Hz. What lies beyond them, or between two of "
                   "them and shows at neither, is not known, and a drive that integrates its torque below "
                   "them is taken for granted{}.",
                   given ? "the controller is judged on" : "the gains suit", plant.lines(),
                   plant.frequency_hz.front(), plant.frequency_hz.back(),
                   load ? "" : "; without an anti-resonance nothing bounds the load")});
  if (const auto& limits = tuning.proposed().limits;
      !given && std::ranges::find(limits, "beyond_band_peak") != limits.end())
    tuning.findings.push_back(
        {"band-limits-design",
         diagnostics::Severity::info,
         plant.frequency_hz.back(),
         {},
         fmt::format("The response is known up to {:.3g} Hz, where |L| is kept below {:g}{}: that limits the "
                     "gains. Excite further up; plan lays it out within that .band_hz.",
                     plant.frequency_hz.back(), found->end.largest_loop(),
                     found->end.is_below_resonance() ? ", since a resonance stands above" : "")});
  if (!result.trusted)
    tuning.findings.push_back(
        {"tuned-untrusted",
         diagnostics::Severity::error,
         {},
         {},
         "The result of " + result.record.file + " is not trusted, nor is this design."});
  tuning.trusted = result.trusted && tuning.proposed().within;
  return tuning;
}

}  // namespace resonid::identification
