// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/track/findings.hpp>
#include <identification/track/plan.hpp>
#include <limits>
#include <monitoring/axis_monitor.hpp>
#include <resonid/base/detail/byte_archive.hpp>
#include <resonid/base/error_text.hpp>
#include <utility>

namespace resonid::monitoring {
namespace {

using identification::detail::Follower;
using online::AxisRow;

constexpr std::size_t kStretches = 5;  // each twice as long as the one before; then what there is must do
constexpr double kFirstRest_s = 10.0, kLongestRest_s = 600.0;
constexpr double kUntrusted_s = 60.0;
constexpr std::uint64_t kLongestGap = 4;                    // that is interpolated, samples
constexpr double kMostMissing = 0.01;                       // of a stretch
constexpr std::uint64_t kMostBroken = 3;                    // stretches in a row
constexpr std::uint64_t kSnapshot = 0x3430'4e4f'4d44'5352;  // "RSDMON04"
/// What a snapshot holds as it lies in memory; room for a FigureWatch that may be there.
constexpr std::size_t kPlain = sizeof(AlarmFacts) + sizeof(AxisAlarms) + sizeof(ScaleCheck) +
                               sizeof(ScaleFinding) + 2 + sizeof(FigureWatch);

std::optional<Error> fault_of(const AxisSpec& spec) {
  const auto bad = [](const char* field, const char* requirement, double found) {
    return Error{field, requirement, found};
  };
  const double rate = spec.sample_rate_hz;
  if (!(rate > 0.0) || !std::isfinite(rate)) return bad("sample_rate_hz", "must be > 0 Hz", rate);
  if (!(spec.row_every_s > 0.0) || !std::isfinite(spec.row_every_s))
    return bad("row_every_s", "must be > 0 s", spec.row_every_s);
  const std::pair<const char*, double> scales[] = {{"input_scale", spec.input_scale},
                                                   {"excitation_scale", spec.excitation_scale},
                                                   {"output_scale", spec.output_scale},
                                                   {"position_scale", spec.position_scale}};
  for (const auto& [field, value] : scales)
    if (!std::isfinite(value) || value == 0.0) return bad(field, "must be finite and not 0", value);
  if (!(spec.baseline_s >= 0.0) || !std::isfinite(spec.baseline_s))
    return bad("baseline_s", "must be >= 0 s", spec.baseline_s);
  if (!(spec.false_alarm_interval_s > 0.0) || !std::isfinite(spec.false_alarm_interval_s))
    return bad("false_alarm_interval_s", "must be > 0 s", spec.false_alarm_interval_s);
  return std::nullopt;
}

std::uint64_t samples_in(double seconds, double rate_hz) {
  return static_cast<std::uint64_t>(std::llround(std::max(0.0, seconds * rate_hz)));
}

/// An empty record of the axis, as the stretch is gathered in.
data::Record empty_record(const AxisSpec& spec) {
  data::Record r;
  r.source = spec.name;
  r.sample_rate_hz = spec.sample_rate_hz;
  r.motion = spec.motion;
  r.output_quantity = spec.output_quantity;
  r.input.name = "input";
  r.output.name = "output";
  r.excitation.name = "excitation";
  r.position.name = "position";
  auto units = sample_units(spec);
  r.input.unit = r.excitation.unit = std::move(units.input);
  r.output.unit = std::move(units.output);
  return r;
}

/// What of the row is a parameter's: by the parameter's name.
constexpr std::pair<Watched, std::string_view> kParameters[] = {
    {Watched::driven_inertia, "driven_inertia"}, {Watched::load_inertia, "load_inertia"},
    {Watched::stiffness, "stiffness"},           {Watched::damping, "damping"},
    {Watched::load_torque, "torque_offset"},     {Watched::coulomb_friction, "coulomb_friction"}};

}  // namespace

AxisMonitor::AxisMonitor(AxisSpec spec, const AxisAlarmRules& rules)
    : spec_(std::move(spec)), rules_(rules), options_(spec_.track) {
  options_.long_term = true;
  options_.every = std::max<std::size_t>(
      1, static_cast<std::size_t>(std::llround(spec_.row_every_s * spec_.sample_rate_hz)));
  if (options_.common.controller)
    options_.common.controller = options_.common.controller->sampled(1.0 / spec_.sample_rate_hz);
  parameter_.fill(online::kAxisParameters);
  rest_samples_ = samples_in(kFirstRest_s, spec_.sample_rate_hz);
  scales_ = ScaleCheck(spec_, options_.common.controller ? &*options_.common.controller : nullptr);
  begin_gathering();
}

expected<AxisMonitor, Error> AxisMonitor::create(AxisSpec spec) {
  if (auto fault = fault_of(spec)) return tl::unexpected(std::move(*fault));
  auto rules = AxisAlarmRules::create(spec.alarms, spec.sample_rate_hz);
  if (!rules) return tl::unexpected(std::move(rules.error()));
  return AxisMonitor(std::move(spec), *rules);
}

std::size_t AxisMonitor::add(std::span<const double> values, Output& out) {
  const std::size_t width = channels(), count = values.size() / width;
  std::size_t taken = 0;
  for (; taken < count && phase_ != Phase::learning; ++taken) {
    const Sample sample = values.subspan(taken * width, width);
    ++next_;
    switch (phase_) {
      case Phase::following:
        follow(sample, out);
        break;
      case Phase::gathering:
        gather(sample);
        if (alarms_due_) tell_alarms(out);
        break;
      default:
        if (alarms_due_) tell_alarms(out);
        if (next_ >= rest_until_) begin_gathering();
    }
  }
  return taken;
}

void AxisMonitor::miss(std::uint64_t count) {
  if (count == 0) return;
  next_ += count;
  if (phase_ == Phase::gathering) miss_while_gathering(count);
  if (phase_ == Phase::following) {
    follower_->miss(count);
    scales_.miss(count);
  }
  if (phase_ == Phase::resting && next_ >= rest_until_) begin_gathering();
  facts_.row.trusted = false;
}

double AxisMonitor::position_of(Sample sample) const {
  return spec_.has_position ? sample.back() * spec_.position_scale : AxisRow::kUnknown;
}

online::AxisSample<double> AxisMonitor::scaled(Sample sample) const {
  const std::size_t input = spec_.has_excitation ? 1 : 0;
  return {spec_.has_excitation ? sample[0] * spec_.input_scale * spec_.excitation_scale : 0.0,
          sample[input] * spec_.input_scale, sample[input + 1] * spec_.output_scale};
}

std::uint64_t AxisMonitor::longest_stretch() const {
  const auto first = identification::detail::first_stretch(empty_record(spec_), options_);
  return static_cast<std::uint64_t>(first) << (kStretches - 1);
}

void AxisMonitor::begin_gathering() {
  phase_ = Phase::gathering;
  stretch_ = empty_record(spec_);
  stretch_.start_time_s = static_cast<double>(next_) / spec_.sample_rate_hz;
  stretch_first_ = next_;
  gap_ = filled_ = 0;
  scales_.reset();
  gather_from(identification::detail::first_stretch(stretch_, options_), 0);
}

void AxisMonitor::gather_from(std::uint64_t due, std::uint64_t attempts) {
  due_ = first_due_ = due;
  attempts_ = first_attempts_ = attempts;
}

void AxisMonitor::gather(Sample sample) {
  const auto s = scaled(sample);
  const double position = position_of(sample);
  if (!std::isfinite(s.excitation + s.torque + s.output) || (spec_.has_position && !std::isfinite(position)))
    return miss_while_gathering(1);
  if (gap_ > 0) {
    const auto between = [this](const std::vector<double>& before, double after, std::uint64_t k) {
      return before.empty() ? 0.0  // a channel that there is none of
                            : before.back() + (after - before.back()) / static_cast<double>(gap_ + 1 - k);
    };
    for (std::uint64_t k = 0; k < gap_; ++k)
      put({between(stretch_.excitation.samples, s.excitation, k),
           between(stretch_.input.samples, s.torque, k), between(stretch_.output.samples, s.output, k)},
          between(stretch_.position.samples, position, k));
    scales_.miss(gap_);
    filled_ += gap_;
    gap_ = 0;
  }
  put(s, position);
  scales_.step(s, position);
  if (stretch_.samples() >= due_) phase_ = Phase::learning;
}

void AxisMonitor::put(const online::AxisSample<double>& s, double position) {
  if (spec_.has_excitation) stretch_.excitation.samples.push_back(s.excitation);
  stretch_.input.samples.push_back(s.torque);
  stretch_.output.samples.push_back(s.output);
  if (spec_.has_position) stretch_.position.samples.push_back(position);
}

void AxisMonitor::miss_while_gathering(std::uint64_t count) {
  if (stretch_.samples() == 0) return begin_gathering();
  gap_ += count;
  if (gap_ <= kLongestGap && static_cast<double>(filled_ + gap_) <= kMostMissing * static_cast<double>(due_))
    return;
  begin_gathering();
  if (++broken_stretches_ != kMostBroken) return;
  reason_ = fmt::format(
      "samples are missing so often that nothing is learned: {} and more in a row, or more than "
      "{:g} % of them",
      kLongestGap + 1, 100.0 * kMostMissing);
  alarms_due_ = true;
}

void AxisMonitor::rest(std::string reason) {
  phase_ = Phase::resting;
  alarms_due_ = alarms_due_ || broken_stretches_ >= kMostBroken;
  broken_stretches_ = 0;
  reason_ = std::move(reason);
  rest_until_ = next_ + rest_samples_;
  rest_samples_ = std::min(2 * rest_samples_, samples_in(kLongestRest_s, spec_.sample_rate_hz));
  stretch_ = empty_record(spec_);
}

/// What is there could not be learned.
void AxisMonitor::refuse(std::string reason) {
  const auto& ru = stretch_.excitation.samples;
  const bool excited =
      std::adjacent_find(ru.begin(), ru.end(), [](double a, double b) { return a != b; }) != ru.end();
  facts_.refused = excited;
  alarms_due_ = alarms_due_ || excited;
  rest(std::move(reason));
}

void AxisMonitor::learn() {
  if (phase_ != Phase::learning) return;
  scales_.look();
  heed(scales_.finding());
  if (scales_.finding().fault != ScaleFault::none) {
    alarms_due_ = true;
    return rest(reason_);
  }
  const bool final = ++attempts_ >= kStretches;
  auto made = identification::detail::learn(stretch_, options_, final);
  if (!made) return refuse(message_of(made.error()));
  if (!*made) {
    if (final) return refuse("nothing to follow shows in the samples: no model, no periodic excitation");
    due_ *= 2;
    phase_ = Phase::gathering;
    return;
  }
  const auto findings =
      identification::detail::learning_findings(options_, (*made)->plan(), (*made)->setup());
  const auto error = std::find_if(findings.begin(), findings.end(),
                                  [](const auto& f) { return f.severity == diagnostics::Severity::error; });
  if (error != findings.end()) return refuse(error->meaning);
  follower_ = std::move(*made);
  follower_first_ = stretch_first_;
  const bool position = spec_.has_position, excitation = spec_.has_excitation;
  for (std::size_t k = 0; k < stretch_.samples(); ++k)
    static_cast<void>(follower_->step({excitation ? stretch_.excitation.samples[k] : 0.0,
                                       stretch_.input.samples[k], stretch_.output.samples[k]},
                                      position ? stretch_.position.samples[k] : AxisRow::kUnknown, false));
  stretch_ = empty_record(spec_);
  phase_ = Phase::following;
  facts_.refused = false;
  broken_stretches_ = 0;
  if (!contradicted()) reason_.clear();
  rest_samples_ = samples_in(kFirstRest_s, spec_.sample_rate_hz);
  untrusted_rows_ = 0;
  find_parameters();
  if (!watch_) begin_watch();
}

/// What is now is usual, from here on.
void AxisMonitor::begin_watch() {
  const double row_s = static_cast<double>(options_.every) / spec_.sample_rate_hz;
  const double block_s = identification::detail::change_block_s(options_, follower_->setup());
  const double interval_s = std::max(spec_.false_alarm_interval_s, 50.0 * block_s);
  if (auto watch = FigureWatch::create(row_s, block_s, spec_.baseline_s, interval_s)) {
    watch_ = *watch;
    watch_first_ = next_;
    last_row_ = next_;
  }
}

double AxisMonitor::baseline_s() const {
  if (!watch_ || !follower_) return 0.0;
  return FigureWatch::learning_s(identification::detail::change_block_s(options_, follower_->setup()),
                                 spec_.baseline_s);
}

/// A contradiction lasts until the samples show the opposite.
void AxisMonitor::heed(const ScaleFinding& finding) {
  const bool found = finding.fault != ScaleFault::none;
  if (finding.fault == contradiction_.fault || (!found && !scales_.verified())) return;
  contradiction_ = finding;
  reason_ = found ? fmt::format("axis {}: {}", spec_.name, scale_text(finding)) : std::string();
}

void AxisMonitor::find_parameters() {
  parameter_.fill(online::kAxisParameters);
  const auto& axis = follower_->axis();
  for (std::size_t i = 0; i < online::kAxisParameters && !axis.parameter_name(i).empty(); ++i)
    for (const auto& [figure, name] : kParameters)
      if (axis.parameter_name(i) == name) parameter_[static_cast<std::size_t>(figure)] = i;
  if (!follower_->setup().config.coulomb_friction)
    parameter_[static_cast<std::size_t>(Watched::coulomb_friction)] = online::kAxisParameters;
}

void AxisMonitor::follow(Sample sample, Output& out) {
  const auto s = scaled(sample);
  const double position = position_of(sample);
  scales_.step(s, position);
  if (follower_->step(s, position)) take_row(out);
}

void AxisMonitor::take_row(Output& out) {
  const AxisRow& of = follower_->axis().row();
  Row row;
  row.sample = follower_first_ + of.sample;
  row.lag_samples = of.lag_samples;
  row[Watched::resonance] = of.resonance_hz;
  row[Watched::antiresonance] = of.antiresonance_hz;
  row[Watched::stiffness] = {of.stiffness, AxisRow::kUnknown};
  row[Watched::driven_inertia] = {of.driven_inertia, AxisRow::kUnknown};
  row[Watched::load_inertia] = {of.load_inertia, AxisRow::kUnknown};
  row[Watched::modulus_margin] = of.modulus_margin;
  row[Watched::phase_margin] = of.phase_margin_deg;
  row[Watched::gap] = of.gap;
  for (std::size_t i = 0; i < kWatched; ++i)
    if (parameter_[i] < online::kAxisParameters) row.figures[i] = of.parameter[parameter_[i]];
  row.coherence = of.coherence;
  row.residual_rms = of.residual_rms;
  row.gates = of.gates;
  row.verdict = of.verdict;
  heed(scales_.finding());
  row.trusted = of.trusted && !contradicted();
  // Rows that were not made are missed, so that the detectors' times stay right.
  if (row.sample + 1 > last_row_ + options_.every)
    watch_->miss((row.sample + 1 - last_row_) / options_.every - 1);
  last_row_ = row.sample + 1;
  facts_.row = row;
  facts_.sample = row.sample;
  facts_.controller_known = std::isfinite(of.controller_difference);
  facts_.controller_differs = of.controller_differs;
  watch_->step(row, spec_.alarms);
  out.rows.push_back(row);
  if (out.on_row) out.on_row(*this);
  step_alarms(out);
  // What is excited and yet not trusted for so long is not the machine that was learned.
  untrusted_rows_ = row.gates.excited && !row.trusted ? untrusted_rows_ + 1 : 0;
  // The alarm `estimate` comes before it is learned anew.
  const double longest_s = std::max(kUntrusted_s, spec_.alarms.estimate.on_delay_s + 2.0 * spec_.row_every_s);
  if (untrusted_rows_ * options_.every <= samples_in(longest_s, spec_.sample_rate_hz)) return;
  if (!contradicted())
    reason_ = fmt::format("not trusted for {:.0f} s ({}): learned anew", longest_s, name_of(row.verdict));
  begin_gathering();
}

double AxisMonitor::first_row_s() const { return static_cast<double>(watch_first_) / spec_.sample_rate_hz; }

void AxisMonitor::step_alarms(Output& out) {
  facts_.learning = phase_ != Phase::following;
  facts_.data_fault = contradicted() || broken_stretches_ >= kMostBroken ||
                      (!facts_.learning && facts_.row.verdict != online::AxisVerdict::not_measured &&
                       !facts_.row.gates.complete);
  facts_.contradiction = contradiction_;
  if (watch_) facts_.changes = watch_->changes(first_row_s());
  alarms_.step(rules_, facts_, out.events);
  if (watch_) watch_->growth_is_told();
}

expected<void, Error> AxisMonitor::act(const Action& action, Output& out) {
  if (action.sample != next_)
    return tl::unexpected(Error{
        "sample", fmt::format("must be {}, the sample that comes next, found {}", next_, action.sample)});
  if (action.id <= last_action_) return {};
  if ((phase_ == Phase::learning) != (action.kind == ActionKind::gather))
    return tl::unexpected(Error{"sample", "the axis is just learning; try again in a moment"});
  last_action_ = action.id;
  if (action.kind == ActionKind::gather) {  // as long a stretch as that which has waited
    const std::uint64_t due = due_, attempts = attempts_;
    begin_gathering();
    gather_from(due, attempts);
    return {};
  }
  if (action.kind == ActionKind::stop || action.kind == ActionKind::resume) {
    mark_stale(action.kind == ActionKind::stop, out);
    return {};
  }
  if (auto done = alarms_.act(rules_, action, out.events); !done) return done;
  if (action.kind == ActionKind::set_baseline || action.kind == ActionKind::relearn) {
    watch_.reset();
    facts_.changes = {};
    if (phase_ == Phase::following) begin_watch();
  }
  if (action.kind == ActionKind::relearn) begin_gathering();
  return {};
}

void AxisMonitor::mark_stale(bool stale, Output& out) {
  if (facts_.stale == stale) return;
  facts_.stale = stale;
  tell_alarms(out);
}

/// Between rows.
void AxisMonitor::tell_alarms(Output& out) {
  alarms_due_ = false;
  facts_.sample = next_;
  step_alarms(out);
}

std::vector<std::byte> AxisMonitor::snapshot() const {
  ByteWriter to;
  to.put(kSnapshot);
  to.put(std::string(RESONID_VERSION));
  to.put(static_cast<std::uint64_t>(kPlain));
  to.put(phase_);
  to.put(resume_sample());  // a stretch is gathered again from its samples
  to.put(rest_until_);
  to.put(rest_samples_);
  to.put(reason_);
  to.put(follower_first_);
  to.put(untrusted_rows_);
  to.put(watch_first_);
  to.put(last_row_);
  to.put(last_action_);
  to.put(broken_stretches_);
  to.put(first_due_);
  to.put(first_attempts_);
  ByteWriter plain;
  plain.put(facts_);
  plain.put(alarms_);
  plain.put(scales_);
  plain.put(contradiction_);
  plain.put(static_cast<std::uint8_t>(alarms_due_ ? 1 : 0));
  plain.put(watch_.has_value());
  if (watch_) plain.put(*watch_);
  to.put_sparse(plain.bytes());
  if (phase_ == Phase::following) follower_->save(to);
  return to.take();
}

expected<AxisMonitor, Error> AxisMonitor::restore(AxisSpec spec, std::span<const std::byte> snapshot) {
  const auto refused = [](const char* why) { return tl::unexpected(Error{"snapshot", why}); };
  auto made = create(std::move(spec));
  if (!made) return made;
  AxisMonitor& m = *made;
  ByteReader from(snapshot);
  std::uint64_t magic = 0, sizes = 0;
  std::string version;
  from.get(magic);
  from.get(version);
  from.get(sizes);
  if (!from.ok() || magic != kSnapshot) return refused("must be a snapshot of an axis");
  if (version != RESONID_VERSION || sizes != kPlain) return refused("must be of this library version");
  from.get(m.phase_);
  from.get(m.next_);
  from.get(m.rest_until_);
  from.get(m.rest_samples_);
  from.get(m.reason_);
  from.get(m.follower_first_);
  from.get(m.untrusted_rows_);
  from.get(m.watch_first_);
  from.get(m.last_row_);
  from.get(m.last_action_);
  from.get(m.broken_stretches_);
  std::uint64_t first_due = 0, first_attempts = 0;
  from.get(first_due);
  from.get(first_attempts);
  const auto any = FigureWatch::create(1.0, 1.0, 16.0, 50.0);
  std::vector<std::byte> plain;
  from.get_sparse_sized(plain, kPlain);
  ByteReader inner(plain);
  inner.get(m.facts_);
  inner.get(m.alarms_);
  inner.get(m.scales_);
  inner.get(m.contradiction_);
  std::uint8_t watched = 0, due = 0;
  inner.get(due);
  inner.get(watched);
  if (watched == 1) {
    m.watch_ = *any;
    inner.get(*m.watch_);
  }
  if (!from.ok() || !inner.at_end() || watched > 1 || due > 1 || m.phase_ > Phase::resting ||
      !m.alarms_.intact() || !m.scales_.intact() || m.contradiction_.fault > ScaleFault::position ||
      (m.watch_ && !m.watch_->intact()))
    return refused("is damaged");
  m.alarms_due_ = due == 1;
  if (m.phase_ == Phase::following) {
    m.follower_ = Follower::restored(from);
    if (!m.follower_ || !m.watch_) return refused("is damaged");
    m.find_parameters();
  }
  if (!from.at_end()) return refused("is damaged");
  const std::string reason = m.reason_;
  if (m.phase_ == Phase::gathering || m.phase_ == Phase::learning) {
    m.begin_gathering();
    if (first_due < m.due_ || first_due > m.longest_stretch() || first_attempts >= kStretches)
      return refused("is damaged");
    m.gather_from(first_due, first_attempts);
  }
  m.reason_ = reason;
  return made;
}

}  // namespace resonid::monitoring
