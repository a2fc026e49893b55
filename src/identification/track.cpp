// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/identify/prepare/units.hpp>
#include <identification/track_plan.hpp>
#include <identification/track_rows.hpp>
#include <identification/track_trust.hpp>
#include <resonid/diagnostics/detail/data_findings.hpp>

namespace resonid::identification {
namespace {

using detail::kUnknown;
using detail::OnlineTracker;

/// So many Nyquist curves show how the loop changed.
constexpr std::size_t kSnapshots = 6;

RecordFacts facts_of(const data::Record& record) {
  return {record.source,         record.samples(),   record.sample_rate_hz,  record.sampling.time_name,
          record.input.name,     record.output.name, record.excitation.name, record.reference.name,
          record.output_quantity};
}

/// A channel between its samples, held at its ends; not a number where it is absent.
double at_sample(const data::Channel& channel, double sample) {
  if (!channel.present()) return kUnknown;
  const auto& x = channel.samples;
  const double place = std::clamp(sample, 0.0, static_cast<double>(x.size() - 1));
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, x.size() - 1);
  return x[below] + (place - static_cast<double>(below)) * (x[above] - x[below]);
}

/// The run over the record.
class Run {
 public:
  Run(const data::Record& record, const TrackOptions& options, const detail::TrackPlan& plan,
      std::vector<double> output, OnlineTracker& tracker, Track& track)
      : record_(record),
        options_(options),
        output_(std::move(output)),
        tracker_(tracker),
        loop_(record, options, plan),
        gates_(record, plan),
        rows_(record, options, tracker.columns(), loop_, row_count(), track),
        track_(track) {
    row_.reported.resize(tracker.columns().size());
    track.baseline_loop = loop_.baseline_loop();
  }

  void run() {
    const std::size_t samples = record_.samples();
    for (std::size_t k = 0; k < samples; ++k) {
      const double ru = record_.excitation.present() ? record_.excitation.samples[k] : 0.0;
      const double u = record_.input.samples[k];
      tracker_.step(ru, u, output_[k]);
      gates_.sample(ru, u, tracker_.ready() ? tracker_.residual() : kUnknown);
      if ((k + 1) % options_.every == 0) add_row(k);
    }
    gates_.inspect(tracker_, track_.findings);
    track_.shares = gates_.shares();
  }

 private:
  [[nodiscard]] std::size_t row_count() const { return record_.samples() / options_.every; }

  void add_row(std::size_t k) {
    const double lag = std::max(0.0, tracker_.lag_samples());
    const double described = static_cast<double>(k) - (options_.raw_time    ? 0.0
                                                       : std::isfinite(lag) ? lag
                                                                            : 0.0);
    row_.lag_s = lag / record_.sample_rate_hz;
    // A lag that grows by more than a sample a sample must not turn time back.
    row_.time_s = std::max(newest_time_s_, record_.start_time_s + described / record_.sample_rate_hz);
    newest_time_s_ = row_.time_s;
    row_.position_m = at_sample(record_.position, described);
    std::fill(row_.reported.begin(), row_.reported.end(), detail::OnlineValue{});
    tracker_.read(row_.reported);
    row_.resonance = tracker_.resonance();
    row_.antiresonance = tracker_.antiresonance();
    loop_.update(tracker_);
    row_.trusted = gates_.judge(tracker_, row_.resonance).all();
    row_.residual = gates_.residual_rms();
    rows_.add(row_, loop_);
    remember_loop(k);
  }

  /// Curves at the ends of equal parts of the record.
  void remember_loop(std::size_t k) {
    const std::size_t due = record_.samples() * (track_.loop.size() + 1) / kSnapshots;
    const bool last = k + options_.every >= record_.samples();
    if (!loop_.known() || (k + 1 < due && !last)) return;
    if (last && !track_.loop.empty() && track_.loop.size() == kSnapshots) return;
    track_.loop.push_back({row_.time_s, loop_.curve()});
  }

  const data::Record& record_;
  const TrackOptions& options_;
  std::vector<double> output_;
  OnlineTracker& tracker_;
  detail::LoopFigures loop_;
  detail::TrustGates gates_;
  detail::Rows rows_;
  Track& track_;
  detail::Row row_;
  double newest_time_s_ = -std::numeric_limits<double>::infinity();
};

/// Samples that are missing shift every later row.
void inspect_gaps(const data::Record& record, Track& track) {
  if (record.sampling.gaps == 0) return;
  track.findings.push_back(
      {"shifted-times", diagnostics::Severity::error, static_cast<double>(record.sampling.gaps), 0.0,
       fmt::format(
           "Samples are missing (the longest gap is {:.3g} s, the first at {:.6g} s): rows after a gap carry "
           "times that are too early by it, and estimators ran on as if nothing were missing. Track "
           "the parts by themselves with .from_s and .to_s.",
           record.sampling.largest_gap_s, record.sampling.first_gap_at_s)});
}

void inspect_start(const detail::TrackPlan& plan, Track& track) {
  if (!plan.start) return;
  const double further = plan.delay_s - track.known_delay_s;
  constexpr double kNoticeable = 0.05;  // samples
  if (std::abs(further) * track.record.sample_rate_hz > kNoticeable)
    track.findings.push_back(
        {"further-delay",
         diagnostics::Severity::info,
         further,
         {},
         fmt::format("The model to begin with has {:.3g} ms of delay where {:.3g} ms were given: "
                     "its own is used, in the margins too.",
                     1e3 * plan.delay_s, 1e3 * track.known_delay_s)});
  track.start = plan.start->source;
  if (!plan.start->trusted)
    track.findings.push_back(
        {"untrusted-start",
         diagnostics::Severity::error,
         {},
         {},
         "The model to begin with is itself not to be trusted (`identify` says why), and what is tracked "
         "from "
         "it has its structure and its delay. Give .start, or input, output and delay as they are."});
  if (plan.start->whole_record)
    track.findings.push_back(
        {"start-from-whole-record",
         diagnostics::Severity::info,
         {},
         {},
         "No shorter part of the record shows a model to begin with: the estimator began with what "
         "the whole record says, which a drive would not have known. Give .start."});
}

std::optional<Error> check(const data::Record& record, const TrackOptions& options) {
  if (options.every == 0) return Error{"every", "must be 1 or more, found 0"};
  if (options.every > record.samples())
    return Error{"every", fmt::format("must not be more than the record's {} samples, found {}",
                                      record.samples(), options.every)};
  if (options.drift_per_s && (!(*options.drift_per_s >= 0.0) || !std::isfinite(*options.drift_per_s)))
    return Error{"drift_per_s", fmt::format("must be 0 1/s or more, found {:g}", *options.drift_per_s)};
  if (!(options.memory_s >= 0.0) || !std::isfinite(options.memory_s))
    return Error{"memory_s", fmt::format("must be above 0 s, found {:g}", options.memory_s)};
  if (options.memory_s > 0.0 && options.memory_s * record.sample_rate_hz < 4.0)
    return Error{"memory_s", fmt::format("must be 4 samples ({:g} s) at least, found {:g} s",
                                         4.0 / record.sample_rate_hz, options.memory_s)};
  return std::nullopt;
}

}  // namespace

const TrackSeries* Track::find(std::string_view name) const {
  for (const auto* group : {&figures, &parameters, &lines})
    for (const auto& series : *group)
      if (series.name == name) return &series;
  return nullptr;
}

namespace {

/// A model of volts cannot begin a record of torques.
std::optional<Error> foreign_units(const Units& ours, const std::optional<Units>& theirs, const char* field) {
  if (!theirs || theirs->response == ours.response) return std::nullopt;
  return Error{field, fmt::format("its response is in {}, the record's in {}; required are the same units "
                                  "(.input_scale, .input_unit, .output_unit)",
                                  theirs->response, ours.response)};
}

}  // namespace

expected<Track, Error> track(const data::Record& record, const TrackOptions& options) {
  const auto progress = [&](std::string_view stage) {
    if (options.common.progress) options.common.progress(stage);
  };
  if (auto refusal = check(record, options)) return tl::unexpected(std::move(*refusal));
  const Units units = detail::units_of(record);
  if (auto refusal = foreign_units(units, options.start_units, "start"))
    return tl::unexpected(std::move(*refusal));
  if (options.baseline)
    if (auto refusal = foreign_units(units, options.baseline->units, "baseline"))
      return tl::unexpected(std::move(*refusal));
  progress("start");
  auto plan = detail::make_track_plan(record, options);
  if (!plan) return tl::unexpected(plan.error());
  const bool lines = plan->method == TrackMethod::kalman || plan->method == TrackMethod::sliding_dft;
  auto velocity = detail::velocity_of(record);
  auto tracker = detail::make_tracker(record, options, *plan);
  if (!tracker) return tl::unexpected(tracker.error());

  Track result;
  result.record = facts_of(record);
  result.units = units;
  result.method = name_of(plan->method);
  result.approach = name_of(plan->approach);
  result.reason = plan->reason;
  result.known_delay_s = options.common.delay_s;
  result.confidence = options.common.confidence;
  auto findings = diagnostics::inspect(record);
  std::move(findings.begin(), findings.end(), std::back_inserter(result.findings));
  inspect_gaps(record, result);
  inspect_start(*plan, result);

  const std::size_t columns = 12 + 2 * (*tracker)->columns().size();
  const std::size_t rows = record.samples() / options.every;
  if (options.kept_rows == 0 && rows > detail::kMostValues / columns)
    return tl::unexpected(
        Error{"every", fmt::format("{} rows of {} values are too many to be kept at once: {} is "
                                   "possible",
                                   rows, columns, record.samples() * columns / detail::kMostValues + 1)});
  progress("tracking");
  Run run(record, options, *plan, lines || !velocity ? record.output.samples : std::move(velocity->samples),
          **tracker, result);
  run.run();
  (*tracker)->inspect(result.findings);
  result.trusted = std::none_of(result.findings.begin(), result.findings.end(),
                                [](const auto& f) { return f.severity == diagnostics::Severity::error; });
  return result;
}

}  // namespace resonid::identification
