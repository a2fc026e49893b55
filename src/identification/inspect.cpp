// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/identify/prepare/prepare.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/diagnostics/detail/feedback.hpp>
#include <resonid/identification/detail/inspect.hpp>

namespace resonid::identification {
namespace {

/// Least distance of two values, where all differ by whole steps of it.
double resolution(std::vector<double> x) {
  constexpr double kFine = 1e-4;  // of the range
  std::sort(x.begin(), x.end());
  const double range = x.back() - x.front();
  double least = range;
  for (std::size_t k = 1; k < x.size(); ++k) {
    const double step = x[k] - x[k - 1];
    if (step > 1e-9 * range) least = std::min(least, step);
  }
  return least > kFine * range ? least : 0.0;
}

SignalFacts facts_of(const char* role, const data::Channel& channel) {
  const auto& x = channel.samples;
  SignalFacts facts;
  facts.role = role;
  facts.name = channel.name;
  facts.unit = channel.unit;
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  facts.least = *low;
  facts.greatest = *high;
  facts.rms = std::sqrt(variance(x));
  facts.step = *high > *low ? resolution(x) : 0.0;
  const std::size_t tenth = std::max<std::size_t>(1, x.size() / 10);
  const std::span<const double> all(x);
  facts.drift = mean(all.last(tenth)) - mean(all.first(tenth));
  return facts;
}

}  // namespace

expected<Inspection, Error> inspect(const data::Record& record, const Options& given) {
  Options options = detail::sampled(given, record);
  options.model = ModelChoice::none;
  const auto experiment = detail::plan_experiment(record, options);
  if (!experiment) return tl::unexpected(experiment.error());
  Inspection result;
  result.record = experiment->facts;
  result.motion = record.motion;
  result.duration_s = record.duration_s();
  result.sampling = record.sampling;
  const std::pair<const char*, const data::Channel*> channels[] = {{"input", &record.input},
                                                                   {"output", &record.output},
                                                                   {"excitation", &record.excitation},
                                                                   {"reference", &record.reference},
                                                                   {"position", &record.position}};
  for (const auto& [role, channel] : channels)
    if (channel->present()) result.signals.push_back(facts_of(role, *channel));
  result.excitation = name_of(experiment->plan.excitation);
  for (const auto& choice : experiment->choices)
    if (choice.what == "excitation") {
      result.excitation = choice.chosen;
      result.excitation_because = choice.because;
    }
  const auto& exciting =
      experiment->record.excitation.present() ? experiment->record.excitation : record.input;
  result.exciting = exciting.name;
  result.strength = std::sqrt(variance(exciting.samples));
  result.low_hz = experiment->plan.low_hz;
  result.high_hz = experiment->plan.high_hz;
  if (const auto feedback = diagnostics::find_feedback(record, options.delay_s)) {
    result.feedback_probability = feedback->probability;
    result.loop = feedback->present() ? LoopState::closed : LoopState::open;
    // Without noise nothing is fed back that could be seen.
    if (!feedback->present() && feedback->probability == 1.0) result.loop = LoopState::unknown;
  }
  result.findings = experiment->findings;
  return result;
}

}  // namespace resonid::identification
