// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <identification/track/follower.hpp>
#include <memory>
#include <monitoring/axis_alarms.hpp>
#include <monitoring/axis_spec.hpp>
#include <monitoring/figure_watch.hpp>
#include <monitoring/row.hpp>
#include <monitoring/scale_check.hpp>
#include <optional>
#include <resonid/base/expected.hpp>
#include <span>
#include <string>
#include <vector>

namespace resonid::monitoring {

/// What an axis is doing.
enum class Phase : std::uint8_t {
  gathering,  ///< A stretch to learn method, excitation and start from.
  learning,   ///< The stretch is complete: learn() is due.
  following,
  resting,  ///< The stretch showed nothing; after a while another one is gathered.
};
inline constexpr EnumName<Phase> kPhaseNames[] = {{Phase::gathering, "gathering"},
                                                  {Phase::learning, "learning"},
                                                  {Phase::following, "following"},
                                                  {Phase::resting, "resting"}};
[[nodiscard]] constexpr std::span<const EnumName<Phase>> enum_names(Phase) noexcept { return kPhaseNames; }

class AxisMonitor;

/// What samples and actions lead to.
struct Output {
  std::vector<Row> rows;
  std::vector<AlarmEvent> events;
  /// Called with each row as it is made, while row() and follower() are those of it; may be empty.
  std::function<void(const AxisMonitor&)> on_row = {};
};

/// Everything that watches one axis: a function (state, samples and actions) -> (state, rows and events). The
/// same samples and actions at the same samples give the same output bit for bit, in whatever batches, and
/// from a snapshot on.
///
/// Learning takes up to seconds and is left to the caller: while phase() is `learning`, add() takes nothing,
/// and learn() may run in another thread. What it comes to depends on the samples alone.
///
/// Scales, signs and controller are checked against the samples first (scale_check.hpp). An axis whose
/// samples contradict what was told is not learned; one that is followed when it shows is no longer trusted.
/// reason() names the key of the configuration, and the alarm `data` is raised.
///
/// A stretch to learn from has few gaps, and short ones, which are interpolated. Where longer ones end one
/// stretch after the other, reason() says so and the alarm `data` is raised.
///
/// An axis that cannot be learned rests, 10 s at first, ten minutes at most, and tries again; one that is
/// excited and yet not trusted for a minute learns anew and keeps what it knows as usual.
class AxisMonitor {
 public:
  /// Refused: a specification that contradicts itself; fields are those of AxisSpec.
  static expected<AxisMonitor, Error> create(AxisSpec spec);

  /// Values of a sample: excitation (if it has one), input, output, position (likewise); as they came.
  [[nodiscard]] std::size_t channels() const noexcept {
    return 2U + (spec_.has_excitation ? 1U : 0U) + (spec_.has_position ? 1U : 0U);
  }
  /// The next samples ([sample][channel]; not a number: missing); returns how many were taken: all, unless
  /// learn() is due.
  std::size_t add(std::span<const double> values, Output& out);
  /// So many samples after those are not known, and nobody will tell them. Not while learn() is due.
  void miss(std::uint64_t count);
  void learn();

  /// An action that counts before the sample next_sample(), which its `sample` must be. One that the state
  /// knows already, by its id, changes nothing.
  [[nodiscard]] expected<void, Error> act(const Action& action, Output& out);

  [[nodiscard]] Phase phase() const noexcept { return phase_; }
  [[nodiscard]] std::uint64_t next_sample() const noexcept { return next_; }
  /// Id of the newest action that was taken; 0: none was.
  [[nodiscard]] std::uint64_t last_action() const noexcept { return last_action_; }
  /// Ids go on after this one: those of a former axis of this name, which this one does not know, change
  /// nothing.
  void count_actions_after(std::uint64_t id) noexcept {
    last_action_ = id > last_action_ ? id : last_action_;
  }
  [[nodiscard]] const AxisSpec& spec() const noexcept { return spec_; }
  [[nodiscard]] const Row& row() const noexcept { return facts_.row; }  ///< The newest one.
  [[nodiscard]] const AlarmFacts& facts() const noexcept { return facts_; }
  [[nodiscard]] const AxisAlarms& alarms() const noexcept { return alarms_; }
  [[nodiscard]] const AxisAlarmRules& alarm_rules() const noexcept { return rules_; }
  /// The engine, while following.
  [[nodiscard]] const identification::detail::Follower* follower() const noexcept { return follower_.get(); }
  /// Sample that the engine's first one was; another one after it was learned anew.
  [[nodiscard]] std::uint64_t learned_from() const noexcept { return follower_first_; }
  /// Whether changes of the figure can be told yet.
  [[nodiscard]] bool watches(Watched w) const noexcept { return watch_ && watch_->ready(w); }
  /// Seconds of trusted rows before changes can be told; 0: nothing is watched yet.
  [[nodiscard]] double baseline_s() const;
  /// Mean time between false alarms of each figure's detector, as they began with; 0: nothing is watched yet.
  [[nodiscard]] double detector_interval_s() const noexcept {
    return watch_ ? watch_->false_alarm_interval_s() : 0.0;
  }
  /// Why nothing was learned, or what of the configuration the samples contradict; empty where there is
  /// nothing to say.
  [[nodiscard]] const std::string& reason() const noexcept { return reason_; }
  /// What the samples contradict.
  [[nodiscard]] const ScaleFinding& contradiction() const noexcept { return contradiction_; }

  /// Samples that learning may go back at most: resume_sample() is no older.
  [[nodiscard]] std::uint64_t longest_stretch() const;
  /// Sample from which on a snapshot taken now needs the samples again.
  [[nodiscard]] std::uint64_t resume_sample() const noexcept {
    const bool gathers = phase_ == Phase::gathering || phase_ == Phase::learning;
    return gathers ? stretch_first_ : next_;
  }
  /// The state as bytes, of one library version and one specification.
  [[nodiscard]] std::vector<std::byte> snapshot() const;
  /// As it was at a snapshot: the samples from next_sample() on are to be added. Refused: bytes that are no
  /// snapshot of this version.
  static expected<AxisMonitor, Error> restore(AxisSpec spec, std::span<const std::byte> snapshot);

 private:
  AxisMonitor(AxisSpec spec, const AxisAlarmRules& rules);
  using Sample = std::span<const double>;

  void gather(Sample sample);
  void put(const online::AxisSample<double>& s, double position);
  void miss_while_gathering(std::uint64_t count);
  void begin_gathering();
  void gather_from(std::uint64_t due, std::uint64_t attempts);
  void rest(std::string reason);
  void refuse(std::string reason);
  void follow(Sample sample, Output& out);
  void take_row(Output& out);
  void step_alarms(Output& out);
  void mark_stale(bool stale, Output& out);
  void tell_alarms(Output& out);
  void find_parameters();
  void begin_watch();
  void heed(const ScaleFinding& finding);
  [[nodiscard]] bool contradicted() const noexcept { return contradiction_.fault != ScaleFault::none; }
  [[nodiscard]] double position_of(Sample sample) const;
  [[nodiscard]] online::AxisSample<double> scaled(Sample sample) const;
  [[nodiscard]] double first_row_s() const;

  AxisSpec spec_;
  AxisAlarmRules rules_;
  identification::TrackOptions options_;
  Phase phase_ = Phase::gathering;
  std::uint64_t next_ = 0;  // sample that comes next

  data::Record stretch_;
  std::uint64_t stretch_first_ = 0;  // its first sample
  std::uint64_t due_ = 0, attempts_ = 0;
  std::uint64_t first_due_ = 0, first_attempts_ = 0;  // when the stretch began
  std::uint64_t gap_ = 0;                             // samples missing after its last one
  std::uint64_t filled_ = 0, broken_stretches_ = 0;   // missing ones in it; those before it that gaps ended
  std::uint64_t rest_until_ = 0, rest_samples_ = 0;
  std::string reason_;

  ScaleCheck scales_;
  ScaleFinding contradiction_;
  bool alarms_due_ = false;  // learn() found something to tell

  std::unique_ptr<identification::detail::Follower> follower_;
  std::uint64_t follower_first_ = 0;               // sample that is its first
  std::array<std::size_t, kWatched> parameter_{};  // of a row, that is the figure; kAxisParameters: none
  std::uint64_t untrusted_rows_ = 0;               // in a row, excited

  std::optional<FigureWatch> watch_;
  std::uint64_t watch_first_ = 0;  // sample of its first row
  std::uint64_t last_row_ = 0;     // sample after the newest row
  std::uint64_t last_action_ = 0;  // its id
  AlarmFacts facts_;
  AxisAlarms alarms_;
};

}  // namespace resonid::monitoring
