// SPDX-License-Identifier: MIT
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/measure/distortion.hpp>
#include <identification/identify/measure/measure.hpp>
#include <resonid/diagnostics/detail/data_findings.hpp>

namespace resonid::identification::detail {
namespace {

expected<data::FrequencyResponse, Error> response_of(const Measured& measured, const Plan& plan,
                                                     const Options& options) {
  auto response =
      response::plant_response(measured.lines, {plan.approach, options.controller, options.delay_s});
  if (!response) return tl::unexpected(Error{"approach", response.error().requirement});
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

expected<Measurement, Error> by_what_shows(const data::Record& record, const Plan& plan,
                                           const Options& options) {
  auto first = by_plan(record, plan, options);
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

expected<Measurement, Error> measure(const Experiment& experiment, const Options& options) {
  const auto& record = experiment.record;
  auto measurement = by_what_shows(record, experiment.plan, options);
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
  m.distortion = find_distortion(record, m.plan, options, m, m.response);
  if (m.distortion)
    for (auto& finding : inspect_distortion(*m.distortion)) m.findings.push_back(std::move(finding));
  m.evidence = loop_evidence(record, m.plan, experiment.source, options, m.response);
  m.plan.loop_controller = predictor_controller(m.evidence.controller, options);
  append(m.findings, inspect_orientation(m.evidence, m.response));
  auto differs = inspect_controller(options, m.evidence, m.response);
  m.controller_differs = differs.has_value();
  append(m.findings, std::move(differs));
  if (experiment.source == ExcitationSource::reference)
    m.lines.has_excitation = false;  // L = Ru/U - 1 needs ru
  return measurement;
}

}  // namespace resonid::identification::detail
