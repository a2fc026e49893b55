// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/measure/distortion.hpp>
#include <identification/identify/measure/measure.hpp>
#include <identification/identify/measure/resolution.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/data/detail/second_output.hpp>
#include <resonid/diagnostics/detail/data_findings.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
#include <tuple>

namespace resonid::identification::detail {
namespace {

/// A held output's response without the hold, where no image of higher frequencies lies near.
void take_out(const data::OutputHold& hold, double sample_time_s, data::FrequencyResponse& response) {
  response =
      response.band(0.0, kCriteria.held_band * 0.5 / (sample_time_s * static_cast<double>(hold.samples)));
  for (std::size_t i = 0; i < response.lines(); ++i) {
    const auto by = hold.response(response.frequency_hz[i], sample_time_s);
    response.value[i] /= by;
    if (i < response.std.size()) response.std[i] /= std::abs(by);
  }
}

expected<data::FrequencyResponse, Error> response_of(const Measured& measured, const Plan& plan,
                                                     const Options& options) {
  auto response =
      response::plant_response(measured.lines, {plan.approach, options.controller, options.delay_s});
  if (!response) return tl::unexpected(Error{"approach", response.error().requirement});
  if (plan.hold.samples > 1) take_out(plan.hold, measured.lines.sample_time_s, *response);
  return std::move(*response);
}

expected<Measurement, Error> by_plan(const data::Record& record, const Plan& plan, const Options& options) {
  auto measured = measure_lines(record, plan, options);
  if (!measured) return tl::unexpected(std::move(measured.error()));
  auto response = response_of(*measured, plan, options);
  if (!response) return tl::unexpected(std::move(response.error()));
  Measurement m;
  static_cast<Measured&>(m) = std::move(*measured);
  m.plan = plan;
  m.response = std::move(*response);
  return m;
}

/// Share of the lines that are known better than by half.
double usable(const data::FrequencyResponse& g) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < g.lines(); ++i)
    count += g.std[i] < kCriteria.usable_line * std::abs(g.value[i]) ? 1 : 0;
  return static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(1, g.lines()));
}

/// Only the lines of a band.
void cut(double low_hz, double high_hz, Measurement& m) {
  std::erase_if(m.lines.lines,
                [&](const auto& l) { return l.frequency_hz < low_hz || l.frequency_hz > high_hz; });
  m.response = m.response.band(low_hz, high_hz);
  m.plan.low_hz = low_hz;
  m.plan.high_hz = high_hz;
}

/// Where to look for coherence. What a controller feeds back is coherent, too, and no response of the drive:
/// in a closed loop without a known excitation only where the input has some power.
std::pair<double, double> searched_band(const data::Record& record, const Plan& plan,
                                        const Options& options) {
  const std::pair everywhere{0.0, 0.5 * record.sample_rate_hz};
  if (options.band_hz) return {plan.low_hz, plan.high_hz};
  if (plan.approach != Approach::direct) return everywhere;
  const auto feedback = diagnostics::find_feedback(record, options.delay_s);
  if (!feedback || !feedback->present()) return everywhere;
  return response::excited_band_hz(record, plan.approach, kCriteria.fed_back_power).value_or(everywhere);
}

Choice resolution_choice(const Measurement& m, double rate_hz) {
  return {
      "resolution", fmt::format("{:.3g} Hz", rate_hz / static_cast<double>(m.plan.segment_samples)),
      "the finest by which most of the coherent band is known; shorter segments average more but leak more"};
}

/// Local rational fits at the resolution of the whole record, where segments are too short for what shows.
std::optional<Measurement> finer(const data::Record& record, const Plan& plan, const Options& options,
                                 const Resolved& averaged) {
  Plan local = plan;
  local.method = Method::local_rational;
  local.segment_samples = 0;
  local.grid_hz = fine_grid(record, averaged.low_hz, averaged.high_hz);
  if (local.grid_hz.size() < kCriteria.fewest_lines) return std::nullopt;
  auto m = by_plan(record, local, options);
  if (!m ||
      !(coherent_gain(m->lines, averaged.lines, averaged.low_hz, averaged.high_hz) >
        kCriteria.lost_coherence) ||
      coherent_share(m->lines, averaged.low_hz, averaged.high_hz) < averaged.share - kCriteria.same_coherence)
    return std::nullopt;
  m->method = {"method", std::string(name_of(local.method)),
               "segments of the recording are too short for its resonances; its own length resolves them"};
  return std::move(*m);
}

/// Averaged spectra at their best resolution, in the band in which they are coherent.
expected<Measurement, Error> by_resolution(const data::Record& record, const Plan& plan,
                                           const Options& options) {
  Plan wide = plan;
  std::tie(wide.low_hz, wide.high_hz) = searched_band(record, plan, options);
  auto averaged = resolved_welch_lines(record, wide, options);
  if (!averaged) return tl::unexpected(Error{"method", averaged.error().requirement});
  const double low_hz = averaged->low_hz, high_hz = averaged->high_hz;
  const bool coherent = high_hz > low_hz;
  wide.segment_samples = averaged->segment_samples;
  std::optional<Measurement> best;
  if (averaged->too_coarse && options.method == Method::automatic)
    best = finer(record, plan, options, *averaged);
  if (!best) {
    Measured measured{std::move(averaged->lines), std::nullopt};
    auto response = response_of(measured, wide, options);
    if (!response) return tl::unexpected(std::move(response.error()));
    best.emplace();
    static_cast<Measured&>(*best) = std::move(measured);
    best->plan = wide;
    best->response = std::move(*response);
    best->resolution = resolution_choice(*best, record.sample_rate_hz);
  }
  if (options.band_hz) return std::move(*best);
  if (coherent) {
    cut(low_hz, high_hz, *best);
  } else {
    const auto excited = best->response.band(plan.low_hz, plan.high_hz);
    if (excited.lines() >= kCriteria.fewest_lines) cut(plan.low_hz, plan.high_hz, *best);
  }
  return std::move(*best);
}

bool averages_segments(const Plan& plan) {
  return plan.method == Method::welch && plan.period_samples == 0 && plan.segment_samples == 0;
}

expected<Measurement, Error> by_method(const data::Record& record, const Plan& plan, const Options& options) {
  return averages_segments(plan) ? by_resolution(record, plan, options) : by_plan(record, plan, options);
}

/// What a method of its own choice cannot read, averaged spectra do.
expected<Measurement, Error> by_chosen(const data::Record& record, const Plan& plan, const Options& options) {
  auto first = by_method(record, plan, options);
  if (options.method != Method::automatic || averages_segments(plan) || !plan.grid_hz.empty()) return first;
  if (first && first->response.lines() >= kCriteria.fewest_lines) return first;
  Plan other = plan;
  other.method = Method::welch;
  other.period_samples = 0;
  auto second = by_method(record, other, options);
  if (!second || (first && second->response.lines() <= first->response.lines())) return first;
  if (!second->method)
    second->method = {"method", std::string(name_of(other.method)),
                      fmt::format("{} finds hardly a line: the excitation is none of the kind that it suits",
                                  name_of(plan.method))};
  return second;
}

expected<Measurement, Error> by_what_shows(const data::Record& record, const Plan& plan,
                                           const Options& options) {
  auto first = by_chosen(record, plan, options);
  const bool averages = plan.method == Method::periodic || plan.method == Method::welch;
  if (!first || !averages || options.method != Method::automatic) return first;
  const double before = usable(first->response);
  if (before > kCriteria.hardly_any_lines) return first;
  auto other = plan;
  other.method = Method::local_polynomial;
  auto second = by_plan(record, other, options);
  if (!second || usable(second->response) < kCriteria.clearly_more_lines * before) return first;
  second->method = {"method", std::string(name_of(other.method)),
                    "averaging leaves hardly any usable line: the machine moves periodically by itself; "
                    "local polynomials remove that"};
  return second;
}

/// From sample to sample: a position that drifts leaks into every line, its steps do not. As many as before.
void difference(std::vector<double>& x) {
  for (std::size_t k = x.size(); k-- > 1;) x[k] -= x[k - 1];
  if (x.size() > 1) x[0] = x[1];
}

void append(std::vector<diagnostics::Finding>& to, std::optional<diagnostics::Finding> finding) {
  if (finding) to.push_back(std::move(*finding));
}

}  // namespace

expected<data::FrequencyResponse, Error> measure_response(const data::Record& record, const Plan& plan,
                                                          const Options& options) {
  auto measured = measure_lines(record, plan, options);
  if (!measured) return tl::unexpected(std::move(measured.error()));
  return response_of(*measured, plan, options);
}

expected<data::FrequencyResponse, Error> load_response(const data::Record& record,
                                                       std::vector<double> samples,
                                                       std::size_t segment_samples, const Measurement& m,
                                                       const Options& options) {
  const auto kind = record.second_output_kind;
  auto second = data::with_second_output(record);
  Plan plan = m.plan;
  if (plan.approach == Approach::indirect) plan.approach = Approach::joint;
  const bool local = plan.method == Method::local_rational || plan.method == Method::local_polynomial;
  if (segment_samples > 0 && local) {
    plan.method = Method::welch;
    plan.period_samples = 0;
    plan.segment_samples = segment_samples;
  }
  plan.hold = data::output_hold(second.output.samples);
  second.output.samples = std::move(samples);
  // Averages take a position's drift out themselves; what follows a sweep does not.
  const bool by_steps = kind == data::SecondOutput::load_encoder && plan.sweep &&
                        (plan.method == Method::local_cubic || plan.method == Method::kalman);
  if (by_steps) {
    difference(second.output.samples);
    second.output_quantity = data::OutputQuantity::velocity;
  }
  auto measured = measure_lines(second, plan, options);
  if (!measured) return tl::unexpected(std::move(measured.error()));
  measured->lines.output_quantity = data::OutputQuantity::velocity;  // turned into one below
  auto response = response_of(*measured, plan, options);
  if (!response) return response;
  for (std::size_t i = 0; i < response->lines(); ++i) {
    const double f = response->frequency_hz[i], step = record.sample_time_s();
    auto factor = data::load_velocity_factor(kind, f, step);
    if (by_steps) factor /= 1.0 - std::polar(1.0, -kTwoPi * f * step);
    response->value[i] *= factor;
    response->std[i] *= std::abs(factor);
  }
  return response->band(m.response.frequency_hz.front(), m.response.frequency_hz.back());
}

expected<Measurement, Error> measure(const Experiment& experiment, const Options& options) {
  const auto& record = experiment.record;
  auto measurement = by_what_shows(record, experiment.plan, options);
  if (!measurement && experiment.motion && !options.band_hz && options.lines_hz.empty()) {
    // A motion's own band may be too narrow for a line; its model does not come from the response.
    auto whole = experiment.plan;
    whole.low_hz = 0.0;
    whole.high_hz = 0.4 * record.sample_rate_hz;
    measurement = by_what_shows(record, whole, options);
  }
  if (!measurement) return measurement;
  auto& m = *measurement;
  if (m.response.lines() == 0)
    return tl::unexpected(Error{"input",
                                "gives no finite response: the input does not move, or its numbers are too "
                                "large to be squared"});
  if (m.plan.low_hz <= 0.0 || entry_of(m.plan.method).periods) {
    m.plan.low_hz = m.response.frequency_hz.front();
    m.plan.high_hz = m.response.frequency_hz.back();
  }
  m.findings = diagnostics::inspect(m.response);
  if (record.second_output.present()) {
    auto second = load_response(record, record.second_output.samples, 0, m, options);
    if (!second) return tl::unexpected(Error{"second_output", second.error().requirement});
    if (second->lines() == 0)
      return tl::unexpected(Error{"second_output", "gives no finite response: it does not move"});
    m.second_response = std::move(*second);
  }
  m.distortion = find_distortion(record, m.plan, options, m, m.response);
  if (m.distortion)
    for (auto& finding : inspect_distortion(*m.distortion)) m.findings.push_back(std::move(finding));
  m.evidence = loop_evidence(record, m.plan, experiment.source, options, m.response);
  m.plan.loop_controller = predictor_controller(m.evidence.controller, options);
  append(m.findings, inspect_quantity(record, m.response));
  append(m.findings, inspect_orientation(m.evidence, m.response));
  auto differs = inspect_controller(options, m.evidence, m.response);
  m.controller_differs = differs.has_value();
  append(m.findings, std::move(differs));
  if (experiment.source == ExcitationSource::reference)
    m.lines.has_excitation = false;  // L = Ru/U - 1 needs ru
  return measurement;
}

}  // namespace resonid::identification::detail
