// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <identification/identify/measure/line_methods.hpp>
#include <identification/identify/measure/methods.hpp>

namespace resonid::identification::detail {
namespace {

using data::Record;
using tl::unexpected;
using Found = expected<Measured, Error>;

Found measured(Lines lines) {
  if (!lines) return unexpected(std::move(lines.error()));
  return Measured{std::move(*lines), std::nullopt};
}

// ---- best-linear

std::string best_linear_lacks(const Record& record, const Plan& plan);

Found best_linear(const Record& record, const Plan& plan, const Options& options) {
  auto found = best_linear_lines(record, plan, options);
  if (!found) return unexpected(std::move(found.error()));
  auto lines = found->lines;
  return Measured{std::move(lines), std::move(*found)};
}

// ---- what several methods need

std::string nothing(const Record&, const Plan&) { return {}; }

std::string no_period(const Record& record, const Plan& plan) {
  if (plan.period_samples == 0)
    return "needs an excitation that repeats; no period was found, give .period_samples";
  if (record.samples() < 2 * plan.period_samples)
    return fmt::format("needs two whole periods of {} samples, found {} samples", plan.period_samples,
                       record.samples());
  return {};
}

std::string best_linear_lacks(const Record& record, const Plan& plan) {
  if (plan.period_samples != 0 && plan.realisations < 2)
    return "needs at least two realisations of a random-phase excitation, three periods or more each, found "
           "fewer in this recording (several recordings: join())";
  return no_period(record, plan);
}

std::string periodic_lacks(const Record& record, const Plan& plan) {
  if (plan.period_samples != 0 && plan.realisations > 1)
    return "averages over periods of one excitation, and the phases change within this recording; take "
           "best-linear, or cut one realisation out by .from_s and .to_s";
  return no_period(record, plan);
}

std::string no_chirp(const Record&, const Plan& plan) {
  return plan.sweep ? "" : "follows a chirp; none was found, give .chirp";
}

std::string no_fixed_lines(const Record&, const Plan& plan) {
  if (!plan.sweep || !plan.grid_hz.empty()) return {};
  return "measures fixed lines, found a chirp; required .lines_hz with it, or another method (local-cubic "
         "and kalman follow a chirp)";
}

// ---- what the record is like

bool repeats(const Record& record, const Plan& plan, std::size_t periods) {
  return plan.period_samples != 0 && record.samples() >= periods * plan.period_samples;
}

/// Two periods of lines that were chosen to repeat, three of what only happens to.
bool suits_periodic(const Record& record, const Plan& plan) {
  if (plan.excitation == ExcitationType::multisine) return repeats(record, plan, 2);
  const bool other =
      plan.excitation != ExcitationType::stepped_sine && plan.excitation != ExcitationType::chirp;
  return other && repeats(record, plan, 3);
}

// ---- why

std::string why_periodic(const Record& record, const Plan& plan) {
  const std::size_t periods = plan.period_samples == 0 ? 0 : record.samples() / plan.period_samples;
  if (plan.transient_periods == 0)
    return fmt::format("{} whole periods: no leakage, and their standard deviation is the noise", periods);
  return fmt::format(
      "{} whole periods without the first {}, in which the drive has not settled: no leakage, "
      "and their standard deviation is the noise",
      periods - plan.transient_periods,
      plan.transient_periods == 1 ? std::string("one") : std::to_string(plan.transient_periods));
}

std::string why_local(const Record&, const Plan&) {
  return "dense excitation that does not repeat: transients are fitted and removed";
}

std::string why_spectra(const Record&, const Plan&) {
  return "dense excitation: averaged spectra of overlapping segments";
}

constexpr std::array kMethods = {
    MethodEntry{Method::best_linear, true, [](const Record&, const Plan& p) { return p.realisations > 1; },
                best_linear_lacks, best_linear,
                [](const Record&, const Plan& p) {
                  return fmt::format(
                      "{} realisations with different phases: their standard deviation beyond that "
                      "between periods is non-linear distortion",
                      p.realisations);
                }},
    MethodEntry{
        Method::periodic, true, suits_periodic, periodic_lacks,
        [](const Record& r, const Plan& p, const Options& o) { return measured(periodic_lines(r, p, o)); },
        why_periodic},
    MethodEntry{
        Method::kalman, false,
        [](const Record& r, const Plan& p) {
          return p.excitation == ExcitationType::multisine && (!p.grid_hz.empty() || repeats(r, p, 2));
        },
        nothing,
        [](const Record& r, const Plan& p, const Options& o) {
          return measured(p.sweep ? swept_lines(r, p, o, true)
                                  : tracked_lines(r, p, o, response::LineMethod::kalman));
        },
        [](const Record&, const Plan&) { return std::string("less than two periods: lines are tracked"); }},
    MethodEntry{
        Method::least_squares, false,
        [](const Record&, const Plan& p) { return p.excitation == ExcitationType::stepped_sine; },
        no_fixed_lines,
        [](const Record& r, const Plan& p, const Options& o) {
          return measured(p.excitation == ExcitationType::stepped_sine
                              ? stepped_sine_lines(r, p, o)
                              : tracked_lines(r, p, o, response::LineMethod::least_squares));
        },
        [](const Record&, const Plan&) { return std::string("every sine settles and is fitted by itself"); }},
    MethodEntry{Method::local_cubic, false,
                [](const Record&, const Plan& p) {
                  return p.excitation == ExcitationType::chirp && p.sweep.has_value();
                },
                no_chirp,
                [](const Record& r, const Plan& p, const Options& o) {
                  return measured(swept_lines(r, p, o, false));
                },
                [](const Record&, const Plan&) {
                  return std::string("follows the known sweep without lag, transient or bias from its speed");
                }},
    MethodEntry{
        Method::local_polynomial, false,
        [](const Record&, const Plan& p) { return p.excitation == ExcitationType::chirp; }, nothing,
        [](const Record& r, const Plan& p, const Options&) { return measured(local_polynomial_lines(r, p)); },
        why_local},
    MethodEntry{
        Method::local_rational, false, nullptr, nothing,
        [](const Record& r, const Plan& p, const Options&) { return measured(local_rational_lines(r, p)); },
        why_local},
    MethodEntry{Method::sliding_dft, false, nullptr, no_fixed_lines,
                [](const Record& r, const Plan& p, const Options& o) {
                  return measured(tracked_lines(r, p, o, response::LineMethod::sliding_dft));
                },
                why_spectra},
    MethodEntry{
        Method::welch, false, [](const Record&, const Plan&) { return true; }, nothing,
        [](const Record& r, const Plan& p, const Options& o) { return measured(welch_lines(r, p, o)); },
        why_spectra},
};

/// The field of Options that one of a method's configuration comes from.
const char* field_of(std::string_view field) {
  constexpr std::array<std::pair<std::string_view, const char*>, 9> kPairs = {
      {{"lines", "lines_hz"},
       {"lines_hz", "lines_hz"},
       {"frequencies_hz", "lines_hz"},
       {"period_samples", "period_samples"},
       {"window_samples", "period_samples"},
       {"drop_periods", "period_samples"},
       {"duration_s", "chirp"},
       {"lambda", "lambda"},
       {"pole_radius", "pole_radius"}}};
  for (const auto& [known, origin] : kPairs)
    if (known == field) return origin;
  return "method";
}

Error as_field(const Error& error) {
  std::string message = fmt::format("{} {}", error.field.view(), error.requirement.view());
  if (std::isfinite(error.value)) message += fmt::format(" (found {:.6g})", error.value);
  return {field_of(error.field), std::move(message)};
}

/// Why there is no line.
Error no_lines(const Record& record, const Plan& plan, const response::LineEstimates& lines) {
  if (!lines.unsettled_hz.empty())
    return {"method",
            fmt::format("{}: none of the {} lines settled within the recording's {:g} s; record longer "
                        "or track fewer lines",
                        name_of(plan.method), lines.unsettled_hz.size(), record.duration_s())};
  const auto [low, high] = std::minmax_element(data::exciting(record).begin(), data::exciting(record).end());
  if (*low == *high)
    return {record.excitation.present() ? "excitation" : "input",
            fmt::format("does not move (always {:g}): without excitation there is no response", *low)};
  return {"band_hz", fmt::format("{:.4g} ... {:.4g} Hz holds no line that {} could measure in {} samples",
                                 plan.low_hz, plan.high_hz, name_of(plan.method), record.samples())};
}

}  // namespace

std::span<const MethodEntry> methods() { return kMethods; }

const MethodEntry& entry_of(Method method) {
  return *std::find_if(kMethods.begin(), kMethods.end(),
                       [&](const MethodEntry& entry) { return entry.method == method; });
}

Method measuring_method(const Record& record, const Plan& plan, const Options& options) {
  const bool correct = options.method == Method::simulate_and_correct;
  if (correct && (options.tracker.lambda || options.tracker.pole_radius)) return Method::kalman;
  if (!correct && options.method != Method::automatic && options.method != Method::model)
    return options.method;
  return std::find_if(kMethods.begin(), kMethods.end(),
                      [&](const MethodEntry& e) { return e.suits != nullptr && e.suits(record, plan); })
      ->method;
}

bool averages_realisations(Method method) noexcept {
  return method == Method::best_linear || method == Method::automatic || method == Method::model ||
         method == Method::simulate_and_correct;
}

expected<Measured, Error> measure_lines(const Record& record, const Plan& plan, const Options& options) {
  auto found = entry_of(plan.method).measure(record, plan, options);
  if (!found) return unexpected(as_field(found.error()));
  if (found->lines.lines.empty()) return unexpected(no_lines(record, plan, found->lines));
  return found;
}

}  // namespace resonid::identification::detail
