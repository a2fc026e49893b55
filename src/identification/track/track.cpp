// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <identification/identify/prepare/units.hpp>
#include <identification/track/axis_setup.hpp>
#include <identification/track/findings.hpp>
#include <identification/track/follower.hpp>
#include <identification/track/loop_curves.hpp>
#include <identification/track/rows.hpp>
#include <resonid/diagnostics/detail/data_findings.hpp>

namespace resonid::identification {
namespace {

using detail::kUnknown;
constexpr double kFewestLearned = 4.0;  // samples

RecordFacts facts_of(const data::Record& record, std::size_t samples) {
  return {record.source,          samples,
          record.sample_rate_hz,  record.sampling.time_name,
          record.input.name,      record.output.name,
          record.excitation.name, record.reference.name,
          record.output_quantity, record.reading};
}

constexpr std::array kChannels = {&data::Record::input, &data::Record::output, &data::Record::excitation,
                                  &data::Record::reference, &data::Record::position};

void append(data::Record& to, const data::Record& from, std::size_t first, std::size_t count) {
  for (const auto channel : kChannels) {
    const auto& x = (from.*channel).samples;
    if (x.empty()) continue;
    const auto begin = x.begin() + static_cast<std::ptrdiff_t>(first);
    (to.*channel)
        .samples.insert((to.*channel).samples.end(), begin, begin + static_cast<std::ptrdiff_t>(count));
  }
}

/// The follower with all that looks at its rows.
class Run {
 public:
  Run(const data::Record& stretch, const TrackOptions& options, std::unique_ptr<detail::Follower> follower,
      Track& track)
      : options_(options),
        follower_(std::move(follower)),
        curves_(options, follower_->plan(), follower_->setup()),
        rows_(stretch, options, follower_->setup(), follower_->axis(), track),
        track_(track) {
    track.baseline_loop = curves_.baseline();
  }

  /// Samples `first` to `last` (not included) of a record; `speaks`: they make rows.
  std::optional<Error> step(const data::Record& samples, std::size_t first, std::size_t last, bool speaks) {
    for (std::size_t k = first; k < last; ++k) {
      const double ru = samples.excitation.present() ? samples.excitation.samples[k] : 0.0;
      const double position = samples.position.present() ? samples.position.samples[k] : kUnknown;
      if (!follower_->step({ru, samples.input.samples[k], samples.output.samples[k]}, position, speaks))
        continue;
      if (options_.kept_rows == 0 && (track_.rows + 1) * rows_.values_per_row() > detail::kMostValues)
        return Error{"every", fmt::format("more than {} rows of {} values are too many to be kept at once",
                                          track_.rows, rows_.values_per_row())};
      controller_.add(follower_->axis().row());
      rows_.add(follower_->axis(), follower_->place());
      curves_.add(follower_->axis(), follower_->place().time_s);
    }
    return std::nullopt;
  }

  void finish() {
    const auto& axis = follower_->axis();
    const auto counts = follower_->counts();
    auto findings = detail::run_findings(axis, counts, controller_, follower_->plan(), follower_->setup(),
                                         follower_->start_time_s());
    std::move(findings.begin(), findings.end(), std::back_inserter(track_.findings));
    track_.shares = detail::shares_of(counts);
    if (rows_.doubtful()) track_.shares.all = 0.0;
    track_.loop = curves_.take(axis);
    if (axis.result().changed) track_.change = axis.result().change;
  }

 private:
  const TrackOptions& options_;
  std::unique_ptr<detail::Follower> follower_;
  detail::ControllerRows controller_;
  detail::LoopCurves curves_;
  detail::Rows rows_;
  Track& track_;
};

std::optional<Error> check(const data::Record& head, const TrackOptions& options) {
  const double rate_hz = head.sample_rate_hz;
  if (options.every == 0) return Error{"every", "must be 1 or more, found 0"};
  if (options.learn_s && options.whole_record)
    return Error{"learn_s",
                 "names a stretch of the recording, and .whole_record takes all of it: leave one out"};
  if (options.learn_s && !(*options.learn_s * rate_hz >= kFewestLearned && std::isfinite(*options.learn_s)))
    return Error{"learn_s", fmt::format("must be {:g} samples ({:g} s) at least, found {:g} s",
                                        kFewestLearned, kFewestLearned / rate_hz, *options.learn_s)};
  if (options.drift_per_s && (!(*options.drift_per_s >= 0.0) || !std::isfinite(*options.drift_per_s)))
    return Error{"drift_per_s", fmt::format("must be 0 1/s or more, found {:g}", *options.drift_per_s)};
  if (!(options.memory_s >= 0.0) || !std::isfinite(options.memory_s))
    return Error{"memory_s", fmt::format("must be above 0 s, found {:g}", options.memory_s)};
  if (options.memory_s > 0.0 && options.memory_s * rate_hz < 4.0)
    return Error{"memory_s", fmt::format("must be 4 samples ({:g} s) at least, found {:g} s", 4.0 / rate_hz,
                                         options.memory_s)};
  return std::nullopt;
}

/// A model of volts cannot begin a record of torques.
std::optional<Error> foreign_units(const Units& ours, const std::optional<Units>& theirs,
                                   const char* option) {
  if (!theirs || theirs->response == ours.response) return std::nullopt;
  return Error{option,
               fmt::format("its response is in {}, the recording's in {}; required are the same units "
                           "(.input_scale, .input_unit, .output_unit)",
                           theirs->response, ours.response)};
}

}  // namespace

const TrackSeries* Track::find(std::string_view name) const {
  for (const auto* group : {&figures, &parameters, &lines})
    for (const auto& series : *group)
      if (series.name == name) return &series;
  return nullptr;
}

/// Learns, then runs.
class Tracking::Impl {
 public:
  explicit Impl(TrackOptions options) : options_(std::move(options)) {}

  expected<void, Error> add(const data::Record& batch) {
    if (batch.samples() == 0) return {};
    if (!begun_)
      if (auto refusal = begin(batch)) return tl::unexpected(std::move(*refusal));
    std::size_t taken = 0;
    while (!run_ && taken < batch.samples() && !options_.whole_record) {
      const std::size_t part = std::min(batch.samples() - taken, due_ - stretch_.samples());
      append(stretch_, batch, taken, part);
      taken += part;
      if (stretch_.samples() < due_) break;
      if (auto refusal = learn(options_.learn_s || ++stretches_ >= kStretches))
        return tl::unexpected(std::move(*refusal));
      due_ *= 2;
    }
    if (options_.whole_record) append(stretch_, batch, 0, batch.samples());
    if (run_)
      if (auto refusal = run_->step(batch, taken, batch.samples(), true))
        return tl::unexpected(std::move(*refusal));
    samples_ += batch.samples();
    return {};
  }

  expected<Track, Error> finish() {
    if (!begun_) return tl::unexpected(Error{"input", "holds no samples"});
    if (!run_)
      if (auto refusal = learn(true)) return tl::unexpected(std::move(*refusal));
    if (!run_ || (track_.rows == 0 && samples_ == stretch_.samples())) return tl::unexpected(not_learned());
    track_.record = facts_of(stretch_, samples_);
    run_->finish();
    track_.trusted = std::none_of(track_.findings.begin(), track_.findings.end(),
                                  [](const auto& f) { return f.severity == diagnostics::Severity::error; });
    return std::move(track_);
  }

 private:
  static constexpr std::size_t kStretches = 5;  // from then on they are taken for what they show

  std::optional<Error> begin(const data::Record& head) {
    if (auto refusal = check(head, options_)) return refusal;
    stretch_ = data::part_of(head, 0, 0);
    track_.units = detail::units_of(head);
    if (auto refusal = foreign_units(track_.units, options_.start_units, "start")) return refusal;
    if (options_.baseline)
      if (auto refusal = foreign_units(track_.units, options_.baseline->units, "baseline")) return refusal;
    due_ = detail::first_stretch(head, options_);
    begun_ = true;
    return std::nullopt;
  }

  /// Begins the run, if the stretch suffices.
  std::optional<Error> learn(bool final) {
    tell("learning from the start of the recording");
    auto follower = detail::learn(stretch_, options_, final);
    if (!follower) return std::move(follower.error());
    if (!*follower) return std::nullopt;
    const auto& plan = (*follower)->plan();
    track_.method = name_of(plan.method);
    track_.approach = name_of(plan.approach);
    track_.reason = plan.reason;
    track_.known_delay_s = options_.common.delay_s;
    track_.confidence = options_.common.confidence;
    track_.learned_s = stretch_.duration_s();
    track_.causal = !options_.whole_record;
    if (plan.start) track_.start = plan.start->source;
    track_.findings = detail::learning_findings(options_, plan, (*follower)->setup());
    tell("tracking");
    run_.emplace(stretch_, options_, std::move(*follower), track_);
    return run_->step(stretch_, 0, stretch_.samples(), options_.whole_record);
  }

  [[nodiscard]] Error not_learned() const {
    const auto method = options_.method;
    if (!run_ && method == TrackMethod::automatic)
      return {"method",
              fmt::format("auto found nothing to track in these {} samples: no model shows in them, "
                          "and the excitation has no period; give .start, .lines_hz, or a longer "
                          "record",
                          samples_)};
    if (!run_ && detail::is_lines(method))
      return {"lines_hz", "must be given: the excitation shows no period"};
    if (!run_)
      return {"method", fmt::format("{} needs an initial model, and the recording shows none: give .start",
                                    name_of(method))};
    const double seconds = static_cast<double>(samples_) / stretch_.sample_rate_hz;
    return {
        "learn_s",
        fmt::format("the recording ends after {:.3g} s, too early to start from what it shows: give .start, "
                    "a shorter .learn_s, a longer recording, or .whole_record (rows then use later samples)",
                    seconds)};
  }

  void tell(std::string_view stage) const {
    if (options_.common.progress) options_.common.progress(stage);
  }

  TrackOptions options_;
  Track track_;
  data::Record stretch_;  // as learned from
  std::size_t samples_ = 0, due_ = 0, stretches_ = 0;
  bool begun_ = false;
  std::optional<Run> run_;
};

Tracking::Tracking(TrackOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Tracking::Tracking(Tracking&&) noexcept = default;
Tracking& Tracking::operator=(Tracking&&) noexcept = default;
Tracking::~Tracking() = default;
expected<void, Error> Tracking::add(const data::Record& batch) { return impl_->add(batch); }
expected<Track, Error> Tracking::finish() { return impl_->finish(); }

expected<Track, Error> track(const data::Record& record, const TrackOptions& options) {
  if (options.every > record.samples())
    return tl::unexpected(
        Error{"every", fmt::format("must not be more than the recording's {} samples, found {}",
                                   record.samples(), options.every)});
  Tracking tracking(options);
  if (auto added = tracking.add(record); !added) return tl::unexpected(std::move(added.error()));
  auto result = tracking.finish();
  if (!result) return result;
  auto findings = diagnostics::inspect(record);
  auto gaps = detail::gap_findings(record);
  findings.insert(findings.end(), gaps.begin(), gaps.end());
  result->findings.insert(result->findings.begin(), findings.begin(), findings.end());
  result->trusted = std::none_of(result->findings.begin(), result->findings.end(),
                                 [](const auto& f) { return f.severity == diagnostics::Severity::error; });
  return result;
}

}  // namespace resonid::identification
