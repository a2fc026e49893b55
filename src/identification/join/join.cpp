// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/bootstrap/bootstrap.hpp>
#include <identification/identify/judge/loop.hpp>
#include <identification/identify/judge/modes.hpp>
#include <identification/identify/judge/shown_modes.hpp>
#include <identification/identify/judge/trust.hpp>
#include <identification/identify/measure/distortion.hpp>
#include <identification/identify/measure/loop_evidence.hpp>
#include <identification/identify/prepare/prepare.hpp>
#include <identification/join/joint_model.hpp>
#include <identification/join/pooled_realisations.hpp>
#include <numeric>
#include <resonid/fit/detail/controller_estimate.hpp>
#include <resonid/identification/join.hpp>
#include <string_view>

namespace resonid::identification {
namespace {

using diagnostics::Severity;

std::optional<Error> mismatch(std::span<const data::Record> records, std::span<const Result> results) {
  if (records.size() < 2 || records.size() != results.size())
    return Error{"records", fmt::format("found {} recording{}, required at least 2", records.size(),
                                        records.size() == 1 ? "" : "s")};
  for (std::size_t i = 1; i < records.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (records[i].output.samples == records[k].output.samples)
        return Error{"records", fmt::format("{} and {} contain the same samples, which add nothing; required "
                                            "repetitions of the experiment",
                                            records[k].source, records[i].source)};
  const auto& first = records.front();
  for (std::size_t i = 1; i < records.size(); ++i) {
    const auto& other = records[i];
    const auto told = [&](const char* what, const std::string& a, const std::string& b) {
      return Error{"records",
                   fmt::format("{} and {} differ in {}: {} and {}; recordings of one experiment are "
                               "required to be alike in it",
                               first.source, other.source, what, a, b)};
    };
    if (std::abs(other.sample_rate_hz - first.sample_rate_hz) >
        detail::kCriteria.same_rate * first.sample_rate_hz)
      return told("sample rate", fmt::format("{:g} Hz", first.sample_rate_hz),
                  fmt::format("{:g} Hz", other.sample_rate_hz));
    if (other.output_quantity != first.output_quantity) {
      return told("what the output is", std::string(name_of(first.output_quantity)),
                  std::string(name_of(other.output_quantity)));
    }
    if (results[i].units.response != results[0].units.response)
      return told("units", results[0].units.response, results[i].units.response);
  }
  return std::nullopt;
}

struct Line {
  double frequency_hz = 0.0;
  std::complex<double> value;
  double std = 0.0;
  std::size_t record = 0;
};

/// All lines of all records in ascending frequency.
std::vector<Line> pooled(std::span<const data::FrequencyResponse* const> responses) {
  std::vector<Line> lines;
  for (std::size_t r = 0; r < responses.size(); ++r) {
    const auto& g = *responses[r];
    if (g.std.size() != g.lines()) continue;
    for (std::size_t i = 0; i < g.lines(); ++i)
      if (g.std[i] > 0.0 && std::isfinite(g.std[i]))
        lines.push_back({g.frequency_hz[i], g.value[i], g.std[i], r});
  }
  std::stable_sort(lines.begin(), lines.end(),
                   [](const Line& a, const Line& b) { return a.frequency_hz < b.frequency_hz; });
  return lines;
}

struct Average {
  data::FrequencyResponse response;
  std::vector<double> chi_square;  ///< [record]
  std::vector<double> degrees;     ///< [record]
  double total = 0.0;
  std::size_t total_degrees = 0;
};

/// The mean of lines of one frequency, and what each record's contributes to chi-square: of a complex line,
/// 2 |G - mean|^2/std^2 with two degrees of freedom.
void average_line(std::span<const Line> same, Average& a) {
  double weight = 0.0;
  std::complex<double> sum = 0.0;
  for (const auto& l : same) {
    weight += 1.0 / (l.std * l.std);
    sum += l.value / (l.std * l.std);
  }
  const auto mean = sum / weight;
  for (const auto& l : same) {
    const double distance = 2.0 * std::norm(l.value - mean) / (l.std * l.std);
    a.chi_square[l.record] += distance;
    a.degrees[l.record] += 2.0 * (1.0 - 1.0 / (l.std * l.std * weight));
    a.total += distance;
  }
  a.total_degrees += 2 * (same.size() - 1);
  a.response.frequency_hz.push_back(same.front().frequency_hz);
  a.response.value.push_back(mean);
  a.response.std.push_back(1.0 / std::sqrt(weight));
}

Average average(std::span<const data::FrequencyResponse* const> responses) {
  constexpr double kSameLine = 1e-6;
  const auto lines = pooled(responses);
  Average a;
  a.chi_square.resize(responses.size());
  a.degrees.resize(responses.size());
  for (std::size_t i = 0; i < lines.size();) {
    std::size_t end = i + 1;
    while (end < lines.size() &&
           lines[end].frequency_hz - lines[i].frequency_hz <= kSameLine * lines[i].frequency_hz)
      ++end;
    average_line(std::span(lines).subspan(i, end - i), a);
    i = end;
  }
  // Where the records scatter more than their error bars say, the scatter is the error bar (Birge 1932).
  const double ratio = a.total_degrees > 0 ? a.total / static_cast<double>(a.total_degrees) : 1.0;
  for (std::size_t i = 0; i < a.response.lines(); ++i) {
    double& std = a.response.std[i];
    std *= std::sqrt(std::max(1.0, ratio));
    const double relative = std / std::max(std::abs(a.response.value[i]), 1e-300);
    a.response.coherence.push_back(1.0 / (1.0 + relative * relative));
  }
  return a;
}

Average average_of(std::span<const Result> results, bool loops) {
  std::vector<const data::FrequencyResponse*> list;
  static const data::FrequencyResponse none;
  for (const auto& r : results)
    list.push_back(!loops ? &r.response : r.measured_loop ? &*r.measured_loop : &none);
  return average(list);
}

Result frame(std::span<const data::Record> records, std::span<const Result> results, const Options& options) {
  Result joint;
  joint.record = results.front().record;
  joint.record.file = fmt::format("{} recordings joined", records.size());
  joint.record.samples = std::accumulate(results.begin(), results.end(), std::size_t{0},
                                         [](std::size_t n, const Result& r) { return n + r.record.samples; });
  joint.units = results.front().units;
  joint.method = results.front().method;
  joint.approach = results.front().approach;
  joint.confidence = options.confidence;
  joint.known_delay_s = options.delay_s;
  joint.radius_m = options.radius_m;
  return joint;
}

/// The records as identify works on them, at one sample rate: clocks that were read from time columns differ
/// by rounding.
expected<std::vector<detail::Prepared>, Error> prepared(std::span<const data::Record> records,
                                                        const Options& options) {
  std::vector<detail::Prepared> list;
  for (const auto& record : records) {
    auto one = detail::prepare(record, options);
    if (!one)
      return tl::unexpected(Error{one.error().field, record.source + ": " + one.error().requirement.str()});
    one->record.sample_rate_hz = records.front().sample_rate_hz;
    list.push_back(std::move(*one));
  }
  return list;
}

/// Band of the joined response, and the output's hold, which is that of the first record; nothing else of a
/// plan holds for several records.
detail::Plan plan_of(const data::FrequencyResponse& response, const data::Record& first) {
  detail::Plan plan;
  plan.hold = data::output_hold(first.output.samples);
  plan.low_hz = response.frequency_hz.front();
  plan.high_hz = response.frequency_hz.back();
  return plan;
}

void take_model(detail::JointModel model, const detail::Plan& plan, const Options& options, Result& result) {
  result.model = std::move(model.model);
  result.choices = std::move(model.choices);
  result.structures = std::move(model.structures);
  result.findings = std::move(model.findings);
  result.modes = result.model->drive.modes();
  result.roots = detail::roots_of(result.model->drive);
  if (result.model->from_record)
    result.validation = Validation{model.fit_percent, true, {}, {}, model.residual_rms};
  detail::Selection selection;
  selection.result = *result.model;
  detail::inspect_model(plan, options, selection, result);
}

std::optional<LoopResult> loop_with_controller(const Options& options, const detail::Plan& plan,
                                               const Result& result, const detail::PlantModel& model) {
  response::LineEstimates lines;
  lines.sample_time_s = 1.0 / result.record.sample_rate_hz;
  lines.output_quantity = result.record.output_quantity;
  return detail::loop_of(plan, options, lines, result.response, model);
}

void find_loop(const Options& options, const detail::Plan& plan, Result& result) {
  if (options.controller)
    result.loop = loop_with_controller(options, plan, result, detail::plant_model(result));
  else if (result.measured_loop)
    result.loop = LoopResult{
        diagnostics::loop_margins(*result.measured_loop), *result.measured_loop, "response", {}, {}, {}, {}};
}

/// Intervals by repeating all experiments, where one likelihood over all of them gave the model.
void repeat(std::span<const data::Record> records, const detail::Plan& plan, const Options& options,
            bool one_likelihood, Result& result) {
  const auto repetition =
      one_likelihood ? detail::repetition_of(records, plan, options, *result.model) : detail::Repetition{};
  if (!repetition) {
    result.findings.push_back({"no-joint-bootstrap",
                               Severity::info,
                               {},
                               {},
                               "The joint figures have no bootstrap intervals: the recordings' own estimates "
                               "were combined, so there "
                               "is no single fit to repeat. Their error bars come from the covariance; the "
                               "recordings' own results have bootstrap intervals."});
    return;
  }
  const detail::LoopOfModel loop_of_model =
      [&](const detail::PlantModel& model) -> std::optional<LoopResult> {
    if (!options.controller) return std::nullopt;
    return loop_with_controller(options, plan, result, model);
  };
  result.bootstrap =
      detail::bootstrap(repetition, options, result, loop_of_model, {plan.low_hz, plan.high_hz});
}

void note(Joint& joint, std::span<const Result> results) {
  auto& findings = joint.result.findings;
  std::string apart, untrusted;
  double worst = 1.0;
  for (const auto& r : joint.records) {
    if (r.agrees) continue;
    apart += (apart.empty() ? "" : ", ") + r.file;
    worst = std::min(worst, r.probability.value_or(0.0));
  }
  if (!apart.empty())
    findings.push_back(
        {"records-disagree", Severity::error, worst,
         (1.0 - joint.result.confidence) / static_cast<double>(joint.records.size()),
         fmt::format("The parameters of {} differ from those of the other recordings by more than noise "
                     "explains: the recordings are not repetitions of one experiment on an unchanged "
                     "machine. Leave them out, or compare "
                     "them.",
                     apart)});
  const double scatter = joint.response_chi_square.value_or(0.0);
  if (scatter > detail::kCriteria.scattering_lines)
    findings.push_back(
        {"responses-scatter", Severity::warning, scatter, detail::kCriteria.scattering_lines,
         fmt::format("The standard deviation of the lines between the recordings is {:.1f} times that of "
                     "their error bars; the error bars of the averaged response include that. Check that "
                     "nothing changed between "
                     "the recordings.",
                     std::sqrt(scatter))});
  const auto bent = [](const diagnostics::Finding& f) {
    constexpr std::array<std::string_view, 4> kBent = {"backlash", "stiffening-coupling", "torque-gain",
                                                       "dry-friction"};
    return f.severity == Severity::error && std::find(kBent.begin(), kBent.end(), f.id) != kBent.end();
  };
  bool any_bent = false;
  for (const auto& r : results) {
    if (!r.trusted) untrusted += (untrusted.empty() ? "" : ", ") + r.record.file;
    any_bent = any_bent || std::any_of(r.findings.begin(), r.findings.end(), bent);
  }
  std::string weak;
  for (const auto& r : joint.records)
    if (joint.result.model && !r.own_estimate) weak += (weak.empty() ? "" : ", ") + r.file;
  if (!weak.empty())
    findings.push_back({"undetermined-record",
                        Severity::info,
                        {},
                        {},
                        fmt::format("Too weak to determine any parameter: {}. It cannot be compared with the "
                                    "other recordings: leave it out, or excite more strongly.",
                                    weak)});
  if (!untrusted.empty())
    findings.push_back(
        {"untrusted-record",
         any_bent ? Severity::error : Severity::warning,
         {},
         {},
         fmt::format("Not reliable by themselves, see their own findings: {}.{}", untrusted,
                     any_bent ? " Several recordings of a machine that no linear model describes "
                                "agree in what is wrong."
                              : "")});
  if (!joint.result.model)
    findings.push_back(
        {"no-joint-model",
         Severity::warning,
         {},
         {},
         "Neither all recordings together nor two of them determine a model: only the responses "
         "are joined. Excite more strongly."});
  joint.result.trusted = std::none_of(findings.begin(), findings.end(), [](const diagnostics::Finding& f) {
    return f.severity == Severity::error;
  });
}

}  // namespace

expected<void, Error> check_join(const Options& options) {
  if (options.model != ModelChoice::black_box) return {};
  return tl::unexpected(Error{"records",
                              "black boxes of several recordings cannot be joined; required a drive model "
                              "(.model auto, rigid, two-mass or three-mass) or .model none"});
}

expected<Joint, Error> join(std::span<const data::Record> records, std::span<const Result> results,
                            const Options& given) {
  const Options options = records.empty() ? given : detail::sampled(given, records.front());
  if (auto joinable = check_join(options); !joinable) return tl::unexpected(std::move(joinable.error()));
  if (auto refusal = mismatch(records, results)) return tl::unexpected(std::move(*refusal));
  auto same = prepared(records, options);
  if (!same) return tl::unexpected(std::move(same.error()));
  Joint joint;
  joint.result = frame(records, results, options);
  for (const auto& r : results) joint.records.push_back({r.record.file, {}, 0, {}, {}, {}, false, true});
  auto lines = average_of(results, false);
  if (lines.response.lines() == 0)
    return tl::unexpected(
        Error{"records", "no recording's response has error bars; required for an average"});
  joint.result.response = std::move(lines.response);
  joint.response_degrees = lines.total_degrees;
  if (lines.total_degrees > 0)
    joint.response_chi_square = lines.total / static_cast<double>(lines.total_degrees);
  for (std::size_t i = 0; i < records.size(); ++i)
    if (lines.degrees[i] > 0.0) joint.records[i].response_chi_square = lines.chi_square[i] / lines.degrees[i];
  if (options.method == Method::best_linear) {
    auto pooled = detail::pooled_response(records, options);
    if (!pooled) return tl::unexpected(pooled.error());
    joint.result.method = "best-linear";
    joint.result.response = std::move(pooled->response);
    joint.result.distortion = std::move(pooled->distortion);
    joint.result.findings = detail::inspect_distortion(*joint.result.distortion);
    joint.response_chi_square.reset();  // the scatter is in the error bars, and told as distortion
  }
  if (auto loops = average_of(results, true); loops.response.lines() > 1)
    joint.result.measured_loop = std::move(loops.response);
  auto plan = plan_of(joint.result.response, same->front().record);
  const bool recorded = same->front().source == detail::ExcitationSource::recorded;
  std::vector<data::Record> list;
  for (auto& one : *same) list.push_back(std::move(one.record));
  const auto shown = recorded && list.front().output_quantity == data::OutputQuantity::velocity
                         ? fit::estimate_controller(std::span<const data::Record>(list))
                         : std::nullopt;
  plan.loop_controller = detail::predictor_controller(shown, options);
  bool one_likelihood = false;
  if (options.model != ModelChoice::none)
    if (auto model =
            detail::joint_model(list, results, plan, options, joint.result.response, joint.records)) {
      one_likelihood = model->one_likelihood;
      take_model(std::move(*model), plan, options, joint.result);
    }
  detail::hold_against_response(joint.result.response, fit::response_modes(joint.result.response),
                                joint.result);
  Options in_loop = options;
  if (!in_loop.controller && shown) in_loop.controller = shown->controller;
  find_loop(in_loop, plan, joint.result);
  const bool identified = shown && !options.controller;
  if (joint.result.loop && joint.result.model)
    if (auto finding = detail::keep_to_band(plan, identified, *joint.result.loop))
      joint.result.findings.push_back(std::move(*finding));
  if (identified && joint.result.loop && joint.result.model) {
    const auto loop_with = [&, plant = detail::plain(detail::plant_model(joint.result))](
                               const data::TransferFunction& controller) {
      Options other = in_loop;
      other.controller = controller;
      return loop_with_controller(other, plan, joint.result, plant);
    };
    detail::include_controller(*shown, loop_with, *joint.result.loop);
  }
  if (options.bootstrap > 0 && joint.result.model) repeat(list, plan, in_loop, one_likelihood, joint.result);
  note(joint, results);
  return joint;
}

}  // namespace resonid::identification
