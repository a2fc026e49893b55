// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/measure/methods.hpp>
#include <identification/identify/prepare/plan.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
#include <resonid/response/detail/stepped_sine.hpp>
#include <resonid/response/periodic_averaging.hpp>

namespace resonid::identification::detail {
namespace {

using Refused = tl::unexpected<Error>;

Refused refused(std::string option, std::string message) {
  return Refused(Error{std::move(option), std::move(message)});
}

std::optional<Error> check_ranges(const data::Record& record, const Options& o) {
  const double nyquist = 0.5 * record.sample_rate_hz;
  const auto complain = [](const char* option, std::string message) {
    return Error{option, std::move(message)};
  };
  if (!(o.delay_s >= 0.0))
    return complain("delay_s", fmt::format("must be 0 s or more, found {:g}", o.delay_s));
  if (o.delay_s > 0.1 * record.duration_s())
    return complain("delay_s", fmt::format("must be a small part of the recording ({:g} s), found {:g} s",
                                           record.duration_s(), o.delay_s));
  if (!(o.confidence > 0.0 && o.confidence < 1.0))
    return complain("confidence", fmt::format("must lie between 0 and 1, found {:g}", o.confidence));
  if (o.band_hz) {
    const auto [low, high] = *o.band_hz;
    if (!(low >= 0.0) || !(high > low))
      return complain("band_hz",
                      fmt::format("is empty: {:g}:{:g}; LO:HI with 0 <= LO < HI is required", low, high));
    if (low >= nyquist)
      return complain("band_hz",
                      fmt::format("begins at {:g} Hz, above the Nyquist frequency {:g} Hz", low, nyquist));
  }
  if (o.chirp) {
    const auto& c = *o.chirp;
    if (!(c.from_hz > 0.0 && c.to_hz > 0.0) || c.from_hz == c.to_hz)
      return complain("chirp", fmt::format("needs two different positive frequencies, found {:g} and {:g} Hz",
                                           c.from_hz, c.to_hz));
    if (!(c.duration_s > 0.0))
      return complain("chirp", fmt::format("must last longer than 0 s, found {:g}", c.duration_s));
    if (std::max(c.from_hz, c.to_hz) >= nyquist)
      return complain("chirp",
                      fmt::format("reaches {:g} Hz; the recording, sampled at {:g} Hz, ends at its Nyquist "
                                  "frequency {:g} Hz",
                                  std::max(c.from_hz, c.to_hz), record.sample_rate_hz, nyquist));
  }
  if (!o.lines_hz.empty()) {
    const auto [low, high] = std::minmax_element(o.lines_hz.begin(), o.lines_hz.end());
    if (!(*low > 0.0) || *high >= nyquist)
      return complain(
          "lines_hz",
          fmt::format("must lie between 0 and the Nyquist frequency {:g} Hz, found {:g} ... {:g} Hz", nyquist,
                      *low, *high));
  }
  if (o.period_samples != 0 && (o.period_samples < 4 || o.period_samples > record.samples()))
    return complain("period_samples", fmt::format("must be 4 ... {} (the recording's length), found {}",
                                                  record.samples(), o.period_samples));
  if (o.approach == Approach::indirect && !o.controller)
    return complain("approach", "indirect needs the controller: give .controller");
  if (o.approach && *o.approach != Approach::direct && !record.excitation.present())
    return complain("approach", "indirect and joint need the excitation signal: give .excitation");
  return std::nullopt;
}

/// The chirp that was given, else the one that the record shows when its type leaves that open.
std::optional<online::SweepLaw> sweep_of(const data::Record& record, const Options& options) {
  if (options.chirp) return options.chirp;
  const bool open = options.excitation_type == ExcitationType::automatic && options.period_samples == 0;
  if (!open && options.excitation_type != ExcitationType::chirp) return std::nullopt;
  if (response::two_level(data::exciting(record), kCriteria.recorded_level)) return std::nullopt;
  return response::detect_chirp(record);
}

bool is_stepped_sine(const data::Record& record, const Options& options, const Plan& plan) {
  if (options.excitation_type != ExcitationType::automatic)
    return options.excitation_type == ExcitationType::stepped_sine;
  if (plan.sweep || options.period_samples != 0 ||
      response::two_level(data::exciting(record), kCriteria.recorded_level))
    return false;
  return !response::detect_stepped_sine(record).empty();
}

ExcitationType kind_of(const data::Record& record, const Options& options, const Plan& plan) {
  if (options.excitation_type != ExcitationType::automatic) return options.excitation_type;
  if (plan.sweep) return ExcitationType::chirp;
  if (response::two_level(data::exciting(record), kCriteria.recorded_level)) return ExcitationType::prbs;
  if (plan.period_samples != 0) return ExcitationType::multisine;
  return ExcitationType::other;
}

/// Multiples of 0.1 Hz, of 0.2, 0.4 ... Hz where there were more than 2000: a fit takes no more.
std::vector<double> chirp_grid(double low_hz, double high_hz) {
  constexpr double kMost = 2000.0;
  double per_hz = 10.0;
  while ((high_hz - low_hz) * per_hz > kMost) per_hz *= 0.5;
  std::vector<double> grid;
  const auto first = static_cast<long>(std::ceil(low_hz * per_hz - 1e-9));
  const auto last = static_cast<long>(std::floor(high_hz * per_hz + 1e-9));
  for (long i = std::max(first, 1L); i <= last; ++i) grid.push_back(static_cast<double>(i) / per_hz);
  return grid;
}

/// What is looked at: the chirp's or the lines' band, else the one that is excited; within the one that is
/// given.
std::optional<Error> set_band(const data::Record& record, const Options& options, Plan& plan) {
  const double nyquist = 0.5 * record.sample_rate_hz;
  // Low sines last longest and have most of the power, but every one is a line.
  const auto dwells = plan.excitation == ExcitationType::stepped_sine && plan.grid_hz.empty()
                          ? response::detect_stepped_sine(record)
                          : std::vector<double>();
  if (plan.sweep) {
    plan.low_hz = std::min(plan.sweep->from_hz, plan.sweep->to_hz);
    plan.high_hz = std::max(plan.sweep->from_hz, plan.sweep->to_hz);
  } else if (!plan.grid_hz.empty()) {
    plan.low_hz = plan.grid_hz.front();
    plan.high_hz = plan.grid_hz.back();
  } else if (!dwells.empty()) {
    plan.low_hz = dwells.front();
    plan.high_hz = dwells.back();
  } else {
    // A PRBS excites beyond the zeros of its spectrum; those belong into the picture.
    const double share = plan.excitation == ExcitationType::prbs ? 0.01 : 0.1;
    const auto band = response::excited_band_hz(record, plan.approach, share);
    plan.low_hz = band ? band->first : 0.0;
    plan.high_hz = band ? std::min(band->second, nyquist) : 0.8 * nyquist;
  }
  if (options.band_hz) {
    if (plan.sweep && (options.band_hz->second < plan.low_hz || options.band_hz->first > plan.high_hz))
      return Error{"band_hz",
                   fmt::format("{:g}:{:g} Hz holds nothing of the chirp's {:g} ... {:g} Hz",
                               options.band_hz->first, options.band_hz->second, plan.low_hz, plan.high_hz)};
    plan.low_hz = plan.sweep ? std::max(plan.low_hz, options.band_hz->first) : options.band_hz->first;
    plan.high_hz = std::min(plan.sweep ? plan.high_hz : nyquist, options.band_hz->second);
    std::erase_if(plan.grid_hz, [&](double f) { return f < plan.low_hz || f > plan.high_hz; });
    if (!options.lines_hz.empty() && plan.grid_hz.empty())
      return Error{"band_hz", fmt::format("{:g}:{:g} Hz holds none of the given lines",
                                          options.band_hz->first, options.band_hz->second)};
  }
  if (plan.sweep && options.lines_hz.empty()) plan.grid_hz = chirp_grid(plan.low_hz, plan.high_hz);
  return std::nullopt;
}

}  // namespace

std::size_t period_of(const data::Record& record, const Options& options) {
  if (options.period_samples != 0) return options.period_samples;
  if (options.excitation_type == ExcitationType::other) return 0;
  return response::detect_period(record).value_or(0);
}

std::vector<data::Record> realisations_in(const data::Record& record, std::size_t period_samples) {
  auto parts = response::realisations_of(record, period_samples);
  if (parts.size() < 2 || response::no_realisations(parts, period_samples)) parts.clear();
  return parts;
}

expected<Plan, Error> make_plan(const data::Record& record, const Options& options) {
  if (auto complaint = check_ranges(record, options)) return Refused(std::move(*complaint));
  Plan plan;
  plan.hold = data::output_hold(record.output.samples);
  plan.approach = options.approach.value_or(record.excitation.present() ? Approach::joint : Approach::direct);
  plan.sweep = sweep_of(record, options);
  plan.period_samples = options.period_samples;
  const bool stepped = is_stepped_sine(record, options, plan);
  const bool sweeps = plan.sweep || options.excitation_type == ExcitationType::chirp;
  if (!sweeps && !stepped) plan.period_samples = period_of(record, options);
  if (plan.period_samples != 0) plan.realisations = realisations_in(record, plan.period_samples).size();
  plan.excitation = stepped ? ExcitationType::stepped_sine : kind_of(record, options, plan);
  plan.grid_hz = options.lines_hz;
  std::sort(plan.grid_hz.begin(), plan.grid_hz.end());
  plan.grid_hz.erase(std::unique(plan.grid_hz.begin(), plan.grid_hz.end()), plan.grid_hz.end());

  plan.method = measuring_method(record, plan, options);
  const auto& method = entry_of(plan.method);
  if (auto lacking = method.lacks(record, plan); !lacking.empty())
    return refused("method", fmt::format("{} {}", name_of(plan.method), lacking));
  // A single period does not repeat within the record.
  if (plan.method == Method::welch && record.samples() < 2 * plan.period_samples) plan.period_samples = 0;
  // Nothing repeats over changes of the phases.
  if (plan.realisations > 1 && !method.periods && options.period_samples == 0) plan.period_samples = 0;
  if (plan.method == Method::periodic && options.drop_periods == 0)
    plan.transient_periods = response::transient_periods(record, plan.period_samples);

  if (auto refusal = set_band(record, options, plan)) return Refused(std::move(*refusal));
  return plan;
}

}  // namespace resonid::identification::detail
