// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/track_plan.hpp>
#include <resonid/base/constants.hpp>

namespace resonid::identification::detail {
namespace {

constexpr double kFirstSeconds = 0.5;
constexpr std::size_t kFirstSamples = 200;
constexpr double kPeriodsSeen = 8.0;          // of the resonance
constexpr double kUncertainResonance = 0.01;  // relative standard deviation

data::Record first_part(const data::Record& record, std::size_t samples) {
  data::Record part = record;
  for (auto* channel : {&part.input, &part.output, &part.excitation, &part.reference, &part.position})
    if (channel->present()) channel->samples.resize(samples);
  return part;
}

/// What identify() is told about a part; a chirp is cut where the part ends.
Options options_of_part(const TrackOptions& options, const Plan& plan, double seconds) {
  Options o = options.common;
  o.method = Method::automatic;
  o.lines_hz.clear();
  o.drop_periods = 0;
  o.progress = nullptr;
  if (plan.sweep && plan.sweep->sweep == online::Sweep::linear && seconds < plan.sweep->duration_s)
    o.chirp = online::SweepLaw{plan.sweep->from_hz, plan.sweep->frequency_hz(seconds), seconds};
  return o;
}

/// The model of a part, if it is one to begin with.
std::optional<fit::DriveModel> usable(const Result& result, double seconds) {
  if (!result.model || !result.trusted) return std::nullopt;
  const auto& drive = result.model->drive;
  if (drive.structure != fit::Structure::two_mass) return std::nullopt;
  const auto resonance = drive.resonance();
  const bool known = resonance.std <= kUncertainResonance * resonance.value;
  return known && seconds * resonance.value >= kPeriodsSeen ? std::optional(drive) : std::nullopt;
}

}  // namespace

std::optional<StartModel> find_start(const data::Record& record, const TrackOptions& options,
                                     const Plan& plan) {
  if (options.start) return StartModel{*options.start, "given", 0, false};
  if (options.baseline && options.baseline->model)
    return StartModel{options.baseline->model->drive, "the baseline's model", 0, false};
  const std::size_t all = record.samples();
  std::size_t samples =
      std::max(kFirstSamples, static_cast<std::size_t>(std::ceil(kFirstSeconds * record.sample_rate_hz)));
  for (;; samples *= 2) {
    const bool whole = samples >= all;
    samples = std::min(samples, all);
    const double seconds = static_cast<double>(samples) / record.sample_rate_hz;
    const auto result =
        identify(whole ? record : first_part(record, samples), options_of_part(options, plan, seconds));
    if (result) {
      const std::string source =
          whole ? std::string("the whole record") : fmt::format("the first {:.3g} s of the record", seconds);
      if (auto drive = usable(*result, seconds)) return StartModel{*drive, source, samples, whole};
      if (whole && result->model)
        return StartModel{result->model->drive, source, samples, whole, result->trusted};
    }
    if (whole) return std::nullopt;
  }
}

std::optional<Velocity> velocity_of(const data::Record& record) {
  Velocity velocity{record.output.samples, 0.0};
  switch (record.output_quantity) {
    case data::OutputQuantity::velocity:
      return velocity;
    case data::OutputQuantity::position: {
      auto& v = velocity.samples;
      for (std::size_t k = v.size(); k-- > 1;) v[k] = (v[k] - v[k - 1]) * record.sample_rate_hz;
      if (v.size() > 1) v[0] = v[1];
      velocity.further_delay_samples = 0.5;
      return velocity;
    }
    case data::OutputQuantity::acceleration:
      break;
  }
  return std::nullopt;
}

}  // namespace resonid::identification::detail
