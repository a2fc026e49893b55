// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <identification/choices.hpp>

namespace resonid::identification::detail {
namespace {

Choice excitation_choice(const data::Record& record, const Options& options, const Plan& plan) {
  const char* signal = record.excitation.present() ? "the excitation" : "the input";
  const bool told = options.excitation_type != ExcitationType::automatic;
  const std::string asked = told ? "asked for" : "";
  switch (plan.excitation) {
    case ExcitationType::chirp:
      if (!plan.sweep) return {"excitation", "chirp", "asked for; its law is not known"};
      return {"excitation", "chirp",
              fmt::format("{} sweeps from {:.4g} to {:.4g} Hz in {:.4g} s{}", signal, plan.sweep->from_hz,
                          plan.sweep->to_hz, plan.sweep->duration_s, options.chirp ? ", as told" : "")};
    case ExcitationType::stepped_sine:
      return {"excitation", "stepped-sine",
              told ? asked : fmt::format("{} is one sine after another", signal)};
    case ExcitationType::prbs:
      if (told) return {"excitation", "prbs", asked};
      return {"excitation", "prbs",
              plan.period_samples != 0
                  ? fmt::format("{} has two levels and repeats every {} samples", signal, plan.period_samples)
                  : fmt::format("{} has two levels and does not repeat within the record", signal)};
    case ExcitationType::multisine:
      if (told) return {"excitation", "multisine", asked};
      return {"excitation", "multisine",
              plan.realisations > 1
                  ? fmt::format("{} repeats every {} samples, and {} times goes on with other phases", signal,
                                plan.period_samples, plan.realisations - 1)
                  : fmt::format("{} repeats every {} samples", signal, plan.period_samples)};
    case ExcitationType::automatic:
    case ExcitationType::other:
      break;
  }
  return {"excitation", "other", told ? asked : fmt::format("{} neither repeats nor sweeps", signal)};
}

std::string reason_of(const data::Record& record, const Plan& plan) {
  const std::size_t periods = plan.period_samples == 0 ? 0 : record.samples() / plan.period_samples;
  switch (plan.method) {
    case Method::periodic:
      if (plan.transient_periods > 0)
        return fmt::format(
            "{} whole periods without the first {}, in which the drive has not settled: no leakage, "
            "and their scatter is the noise",
            periods - plan.transient_periods,
            plan.transient_periods == 1 ? std::string("one") : std::to_string(plan.transient_periods));
      return fmt::format("{} whole periods: no leakage, and their scatter is the noise", periods);
    case Method::best_linear:
      return fmt::format(
          "{} realisations with phases of their own: what they scatter beyond their periods' "
          "noise is non-linear distortion",
          plan.realisations);
    case Method::kalman:
      return "less than two periods: lines are tracked";
    case Method::least_squares:
      return "every sine settles and is fitted by itself";
    case Method::local_cubic:
      return "follows the known sweep, without lag, transient or bias by its speed";
    case Method::local_polynomial:
    case Method::local_rational:
      return "dense excitation that does not repeat: transients are fitted and taken out";
    default:
      return "dense excitation: averaged spectra of overlapping segments";
  }
}

Choice approach_choice(const data::Record& record, const Options& options, const Plan& plan,
                       ExcitationSource source) {
  Choice choice{"approach", name_of(plan.approach), "asked for"};
  if (options.approach) return choice;
  switch (source) {
    case ExcitationSource::recorded:
      choice.because = record.excitation.samples == record.input.samples
                           ? "the excitation is the input: there is no feedback"
                           : "the excitation is recorded: noise that the controller feeds back does no harm";
      break;
    case ExcitationSource::reconstructed:
      choice.because = "the excitation was not recorded, but the known controller gives it: u - C (r - y)";
      break;
    case ExcitationSource::reference:
      choice.because = "no excitation is recorded, the reference excites";
      break;
    case ExcitationSource::none:
      choice.because =
          "no excitation is recorded: right in open loop, biased towards -1/C in a noisy closed one";
      break;
  }
  return choice;
}

Choice method_choice(const data::Record& record, const Options& options, const Plan& plan) {
  const std::string measured = name_of(plan.method);
  switch (options.method) {
    case Method::automatic:
      return {"method", measured, reason_of(record, plan)};
    case Method::model:
    case Method::simulate_and_correct:
      return {"method", name_of(options.method),
              fmt::format("asked for; begins with {}: {}", measured, reason_of(record, plan))};
    default:
      return {"method", measured, "asked for"};
  }
}

}  // namespace

std::vector<Choice> explain(const data::Record& record, const Options& options, const Plan& plan,
                            ExcitationSource source) {
  return {excitation_choice(record, options, plan), method_choice(record, options, plan),
          approach_choice(record, options, plan, source)};
}

}  // namespace resonid::identification::detail
