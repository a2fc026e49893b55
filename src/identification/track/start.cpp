// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/track/plan.hpp>
#include <resonid/response/detail/excitation_lines.hpp>

namespace resonid::identification::detail {
namespace {

constexpr double kFirstSeconds = 0.5;
constexpr double kFirstSamples = 200.0;
constexpr double kKnownDelays = 20.0;         // a delay is a small part of what is learned from
constexpr double kPeriods = 2.0;              // of a periodic excitation
constexpr double kPeriodsSeen = 8.0;          // of the resonance
constexpr double kUncertainResonance = 0.01;  // relative standard deviation
constexpr double kChangingResonance = 0.05;   // the same with a change within the stretch in it

/// What identify() is told about a stretch; a chirp is cut where the stretch ends.
Options options_of_stretch(const TrackOptions& options, const Plan& plan, double seconds,
                           bool two_masses_alone) {
  Options o = options.common;
  o.method = Method::automatic;
  o.lines_hz.clear();
  o.drop_periods = 0;
  o.progress = nullptr;
  if (two_masses_alone && o.model == ModelChoice::automatic) o.model = ModelChoice::two_mass;
  if (plan.sweep && plan.sweep->sweep == online::Sweep::linear && seconds < plan.sweep->duration_s)
    o.chirp = online::SweepLaw{plan.sweep->from_hz, plan.sweep->frequency_hz(seconds), seconds};
  return o;
}

/// What changes within the stretch is what is tracked from there on.
bool trusted_but_for_changes(const Result& result) {
  return std::none_of(result.findings.begin(), result.findings.end(), [](const diagnostics::Finding& f) {
    return f.severity == diagnostics::Severity::error && f.id != "changes-within-recording";
  });
}

/// The drive model, also where a black box took its place.
const ModelResult* closest_drive(const Result& result) {
  if (result.model) return &*result.model;
  const auto aside = std::find_if(result.structures.begin(), result.structures.end(),
                                  [](const StructureTrial& t) { return t.model.has_value(); });
  return result.black_box && aside != result.structures.end() ? &*aside->model : nullptr;
}

/// Whether a result's model is one to begin with.
bool suffices(const Result& result, double seconds) {
  if (!result.model || !trusted_but_for_changes(result)) return false;
  const auto& drive = result.model->drive;
  if (drive.structure != fit::Structure::two_mass) return false;
  const auto resonance = drive.resonance();
  const double most = result.trusted ? kUncertainResonance : kChangingResonance;
  const bool known = resonance.std <= most * resonance.value;
  return known && seconds * resonance.value >= kPeriodsSeen;
}

}  // namespace

std::size_t first_stretch(const data::Record& head, const TrackOptions& options) {
  const double rate = head.sample_rate_hz;
  const double chosen =
      std::max({kFirstSamples, kFirstSeconds * rate, kKnownDelays * options.common.delay_s * rate,
                kPeriods * static_cast<double>(options.common.period_samples)});
  return static_cast<std::size_t>(std::ceil(options.learn_s ? *options.learn_s * rate : chosen));
}

std::optional<StartModel> find_start(const data::Record& stretch, const TrackOptions& options,
                                     const Plan& plan, bool final) {
  if (options.start) return StartModel{*options.start, "given"};
  if (options.baseline && options.baseline->model)
    return StartModel{options.baseline->model->drive, "the baseline's model"};
  const double seconds = stretch.duration_s();
  const auto learnt = [&](bool two_masses_alone) {
    return identify(stretch, options_of_stretch(options, plan, seconds, two_masses_alone));
  };
  // Until the last stretch two masses alone, which take little time, say whether to ask what all structures
  // do.
  if (!final) {
    const auto two = learnt(true);
    if (!two || !suffices(*two, seconds)) return std::nullopt;
  }
  const auto result = learnt(false);
  if (!result || !(final || suffices(*result, seconds))) return std::nullopt;
  const auto* model = closest_drive(*result);
  if (model == nullptr) return std::nullopt;
  return StartModel{model->drive,
                    options.whole_record ? std::string("the whole recording")
                                         : fmt::format("the first {:.3g} s of the recording", seconds),
                    trusted_but_for_changes(*result)};
}

std::optional<online::SweepLaw> running_sweep(const data::Record& stretch, const online::SweepLaw& found) {
  constexpr double kSame = 0.1;      // cycles
  constexpr double kHighest = 0.49;  // of the sample rate
  constexpr double kLowest = 1e-3;   // of where a falling sweep began
  constexpr double kEnds = 0.99;
  const double seconds = stretch.duration_s();
  if (found.duration_s < kEnds * seconds) return found;  // it is over
  const auto half = response::detect_chirp(data::part_of(stretch, 0, stretch.samples() / 2));
  if (!half || half->sweep != found.sweep) return std::nullopt;
  const auto until = [&](online::SweepLaw law, double to_hz) {
    law.duration_s *= law.sweep == online::Sweep::linear
                          ? (to_hz - law.from_hz) / (law.to_hz - law.from_hz)
                          : std::log(to_hz / law.from_hz) / std::log(law.to_hz / law.from_hz);
    law.to_hz = to_hz;
    return law;
  };
  const double edge_hz =
      found.to_hz > found.from_hz ? kHighest * stretch.sample_rate_hz : kLowest * found.from_hz;
  const auto law = until(found, edge_hz);
  return std::abs(law.cycles(seconds) - until(*half, edge_hz).cycles(seconds)) < kSame ? std::optional(law)
                                                                                       : std::nullopt;
}

}  // namespace resonid::identification::detail
