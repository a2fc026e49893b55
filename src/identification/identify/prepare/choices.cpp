// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <identification/identify/measure/methods.hpp>
#include <identification/identify/prepare/choices.hpp>

namespace resonid::identification::detail {
namespace {

Choice excitation_choice(const data::Record& record, const Options& options, const Plan& plan) {
  const char* signal = record.excitation.present() ? "the excitation" : "the input";
  const bool told = options.excitation_type != ExcitationType::automatic;
  const std::string asked = told ? "as specified" : "";
  switch (plan.excitation) {
    case ExcitationType::chirp:
      if (!plan.sweep) return {"excitation", "chirp", "as specified; its law is not known"};
      return {"excitation", "chirp",
              fmt::format("{} sweeps from {:.4g} to {:.4g} Hz in {:.4g} s{}", signal, plan.sweep->from_hz,
                          plan.sweep->to_hz, plan.sweep->duration_s, options.chirp ? ", as specified" : "")};
    case ExcitationType::stepped_sine:
      return {"excitation", "stepped-sine",
              told ? asked : fmt::format("{} is one sine after another", signal)};
    case ExcitationType::prbs:
      if (told) return {"excitation", "prbs", asked};
      return {"excitation", "prbs",
              plan.period_samples != 0
                  ? fmt::format("{} has two levels and repeats every {} samples", signal, plan.period_samples)
                  : fmt::format("{} has two levels and does not repeat within the recording", signal)};
    case ExcitationType::multisine:
      if (told) return {"excitation", "multisine", asked};
      if (plan.period_samples == 0) return {"excitation", "multisine", "a single period, as specified"};
      return {"excitation", "multisine",
              plan.realisations > 1
                  ? fmt::format("{} repeats every {} samples and changes its phases {} times", signal,
                                plan.period_samples, plan.realisations - 1)
                  : fmt::format("{} repeats every {} samples", signal, plan.period_samples)};
    case ExcitationType::automatic:
    case ExcitationType::other:
      break;
  }
  return {"excitation", "other", told ? asked : fmt::format("{} neither repeats nor sweeps", signal)};
}

Choice approach_choice(const data::Record& record, const Options& options, const Plan& plan,
                       ExcitationSource source) {
  Choice choice{"approach", std::string(name_of(plan.approach)), "as specified"};
  if (options.approach) return choice;
  switch (source) {
    case ExcitationSource::recorded:
      choice.because =
          record.excitation.samples == record.input.samples
              ? "the excitation is the input: there is no feedback"
              : "the excitation is recorded: noise that the controller feeds back causes no bias";
      break;
    case ExcitationSource::reconstructed:
      choice.because = "the excitation was not recorded, but the known controller gives it: u - C (r - y)";
      break;
    case ExcitationSource::reference:
      choice.because = "no excitation is recorded; the reference excites the loop";
      break;
    case ExcitationSource::none:
      choice.because =
          "no excitation is recorded: unbiased in open loop, biased towards -1/C in a closed loop with noise";
      break;
  }
  return choice;
}

Choice method_choice(const data::Record& record, const Options& options, const Plan& plan) {
  const std::string measured(name_of(plan.method));
  const std::string why = entry_of(plan.method).reason(record, plan);
  if (options.method == Method::automatic) return {"method", measured, why};
  if (options.method == plan.method) return {"method", measured, "as specified"};
  return {"method", std::string(name_of(options.method)),
          fmt::format("as specified; begins with {}: {}", measured, why)};
}

}  // namespace

std::vector<Choice> explain(const data::Record& record, const Options& options, const Plan& plan,
                            ExcitationSource source) {
  return {excitation_choice(record, options, plan), method_choice(record, options, plan),
          approach_choice(record, options, plan, source)};
}

}  // namespace resonid::identification::detail
