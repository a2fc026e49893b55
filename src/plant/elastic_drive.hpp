// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "plant/dry_side.hpp"
#include "plant/elastic_machine.hpp"
#include "plant/few.hpp"
#include "plant/step_table.hpp"
#include "plant/taylor_motion.hpp"

namespace resonid::plant {

/// N masses by exact zero-order hold: without error at any sample time while the machine is
/// linear.
///
/// - A stiffness that varies is taken in the middle of the step.
/// - Load torque and eccentricity are held over a step, at their value in its middle.
/// - Dry friction is held over pieces of a sample no longer than 1/16 of the fastest resonance's period, at
///   the velocity in the middle of the piece; pieces are shorter where Stribeck friction falls (down to 1/64,
///   see DrySide). Both errors, and that of the middle of the step, are of second order.
/// - Each of the two sides slides or sticks. The instant within a piece at which a sliding side comes to a
///   standstill, or at which the other torques on a resting side exceed its breakaway torque, is found to
///   rounding on the Taylor polynomial of the motion, and the motion goes on from there. A side at rest is
///   locked: friction thus never moves a mass, and energy never comes from it.
/// - Of a machine with a time constant below 1/32 of a piece the polynomial would be too long: there the
///   piece is halved up to 12 times to find the standstill, and a side breaks away at the beginning of a
///   step only.
template <int Masses, bool Lags>
class ElasticDrive final : public Drive {
  static constexpr int kStates = 2 * Masses + (Lags ? 1 : 0);
  static constexpr int kInputs = 1 + Masses;
  static constexpr std::size_t kAngle = kStates - 1;
  static constexpr std::size_t kLoad = Masses - 1;
  static constexpr std::size_t kCommand = kStates;  // column of the command, those of the torques behind it
  using State = Few<kStates>;
  using Torques = Few<Masses>;
  using Step = FewColumns<kStates, kStates + kInputs>;

 public:
  ElasticDrive(Machine machine, double sample_time_s, double early_fraction)
      : of_(std::move(machine), Lags, sample_time_s),
        sample_time_s_(sample_time_s),
        driven_(machine_.config().friction.driven, machine_.system(1.0).inertia.front()),
        load_(machine_.config().friction.load, machine_.system(1.0).inertia.back()),
        dry_(machine_.config().friction.driven.any() || machine_.config().friction.load.any()),
        disturbed_(machine_.disturbed()),
        grounded_(machine_.grounded()),
        second_(machine_.config().second_output),
        per_scale_(1.0 / of_.angle_scale()) {
    const auto law = of_.law();
    law_ = {few(law.fixed), few(law.by_factor), few(law.by_root)};
    law_now_ = law_.at(1.0);
    const Step highest = law_.at(machine_.highest_factor());
    // Of a grounded machine with the angle scaled as the twists are.
    const double scale = grounded_ ? of_.angle_scale() : 1.0;
    for (std::size_t i = 0; i < kStates; ++i) {
      double sum = 0.0;
      for (std::size_t j = 0; j < kStates; ++j)
        sum += std::abs(highest(i, j)) * (i == kAngle ? scale : 1.0) / (j == kAngle ? scale : 1.0);
      norm_ = std::max(norm_, sum);
    }
    add_segment((1.0 - early_fraction) * sample_time_s);
    if (early_fraction > 0.0) add_segment(early_fraction * sample_time_s);
  }

  double settle(double velocity, double place) override {
    sample_ = 0;
    factor_ = machine_.factor(0.0, place);
    const int direction = velocity > 0.0 ? 1 : velocity < 0.0 ? -1 : 0;
    for (DrySide* side : {&driven_, &load_}) {
      side->direction = side->friction.any() ? direction : 1;
      side->torque = side->friction.sliding(velocity, direction);
    }
    state_ = {};
    for (std::size_t i = 0; i < Masses; ++i) state_[i] = velocity;
    const double angle = state_[kAngle] = driven_angle_at(place);
    Torques torques = outer_torques(0.0, 0.0);
    add_friction(torques);
    const Eigen::VectorXd state =
        of_.balance(factor_, velocity, angle, Eigen::Map<const Eigen::VectorXd>(torques.data(), Masses));
    std::copy_n(state.data(), kStates, state_.begin());
    state_[kAngle] = driven_angle_at(place);
    if (second_ == data::SecondOutput::load_encoder) second_value_ = state_[kAngle] + twist(kLoad);
    return state(kStates);
  }

  MassMotion advance(double torque) noexcept override {
    const double start = static_cast<double>(sample_) * sample_time_s_;
    advance_segment(0, start, torque);
    const MassMotion read{state_[0], state_[kAngle]};
    if (second_ != data::SecondOutput::none) second_value_ = measured_load(start + segment_s_[0], torque);
    if (segments_ > 1) advance_segment(1, start + segment_s_[0], torque);
    ++sample_;
    return read;
  }

  [[nodiscard]] std::vector<MassMotion> motions() const override {
    std::vector<MassMotion> result{{state_[0], state_[kAngle]}};
    for (std::size_t i = 1; i < Masses; ++i) result.push_back({state_[i], state_[kAngle] + twist(i)});
    return result;
  }
  [[nodiscard]] double second_output() const noexcept override { return second_value_; }
  [[nodiscard]] double place() const noexcept override {
    return machine_.place(state_[kAngle], state_[kAngle] + twist(kLoad));
  }
  [[nodiscard]] double stiffness_factor() const noexcept override { return factor_; }
  [[nodiscard]] bool grounded() const noexcept override { return grounded_; }
  [[nodiscard]] SampledDrive sampled(double factor) const override {
    return of_.sampled(factor, segment_s_[0]);
  }

 private:
  static constexpr double kShortest = 1.0 / 4096.0;  // of a piece, where events crowd
  static constexpr double kShortestHold = 1.0 / 64.0;
  static constexpr double kShortestCourse = 1.0 / 32.0;
  static constexpr std::size_t kLocks = 4;
  static constexpr double kNever = 2.0;

  /// As in ElasticMachine.
  struct Law {
    Step fixed, by_factor, by_root;
    /// The first columns: those of the state; the others do not depend on the factor.
    void put(double factor, std::size_t columns, Step& law) const noexcept {
      const double root = std::sqrt(factor);
      for (std::size_t i = 0; i < kStates * columns; ++i)
        law.entry[i] = fixed.entry[i] + factor * by_factor.entry[i] + root * by_root.entry[i];
    }
    [[nodiscard]] Step at(double factor) const noexcept {
      Step law;
      put(factor, kStates + kInputs, law);
      return law;
    }
  };
  [[nodiscard]] static Step few(const Eigen::MatrixXd& m) {
    Step step;
    std::copy_n(m.data(), step.entry.size(), step.entry.begin());
    return step;
  }
  [[nodiscard]] static Step make_step(const Step& law, bool driven_rests, bool load_rests,
                                      double duration_s) noexcept {
    Step step;
    zoh_step(law.entry.data(), kStates, kInputs, driven_rests ? 0 : -1,
             load_rests ? static_cast<int>(kLoad) : -1, duration_s, step.entry.data());
    return step;
  }

  void add_segment(double duration_s) {
    const unsigned pieces = of_.pieces(duration_s, dry_);
    segment_s_[segments_] = duration_s;
    pieces_[segments_] = pieces;
    const double piece = duration_s / pieces;
    tables_[segments_] =
        StepTable<Step>(machine_.lowest_factor(), machine_.highest_factor(),
                        [&](double factor) { return make_step(law_.at(factor), false, false, piece); });
    for (std::size_t i = 0; i < (dry_ ? kLocks : 1); ++i)
      constant_[segments_ * kLocks + i] =
          make_step(law_.at(machine_.lowest_factor()), (i & 1U) != 0, (i & 2U) != 0, piece);
    ++segments_;
  }

  [[nodiscard]] double twist(std::size_t mass) const noexcept {
    return mass == 0 ? 0.0 : state_[Masses - 1 + mass] * per_scale_;
  }
  [[nodiscard]] double driven_angle_at(double place) const noexcept {
    const double angle = place / machine_.place(1.0, 1.0);
    return machine_.place(0.0, 1.0) == 0.0 ? angle : angle - twist(kLoad);
  }

  void advance_segment(std::size_t segment, double start_s, double command) noexcept {
    const double piece = segment_s_[segment] / pieces_[segment];
    for (unsigned i = 0; i < pieces_[segment]; ++i) {
      const double middle = start_s + (i + 0.5) * piece;
      if (machine_.varies()) factor_ = machine_.factor(middle, place_after(0.5 * piece));
      if (dry_) {
        slide(segment, piece, command, outer_torques(middle, 0.5 * piece));
      } else if (disturbed_) {
        state_ = moved(free_step(segment), command, outer_torques(middle, 0.5 * piece));
      } else {
        state_ = machine_.varies() ? moved(tables_[segment].at(factor_), command)
                                   : moved(constant_[segment * kLocks], command);
      }
    }
  }

  [[nodiscard]] double place_after(double time_s) const noexcept {
    return machine_.place(state_[kAngle] + time_s * state_[0],
                          state_[kAngle] + twist(kLoad) + time_s * state_[kLoad]);
  }
  [[nodiscard]] Step free_step(std::size_t segment) const noexcept {
    return machine_.varies() ? tables_[segment].at(factor_) : constant_[segment * kLocks];
  }
  [[nodiscard]] State moved(const Step& step, double command) const noexcept {
    State next = times(step, state_);
    add(next, step.column(kCommand), command);
    return next;
  }
  [[nodiscard]] State moved(const Step& step, double command, const Torques& torques) const noexcept {
    State next = moved(step, command);
    for (std::size_t i = 0; i < Masses; ++i) add(next, step.column(kCommand + 1 + i), torques[i]);
    return next;
  }

  /// Load torque and eccentricity at `time_s`, which is `ahead_s` from now.
  [[nodiscard]] Torques outer_torques(double time_s, double ahead_s) const noexcept {
    Torques torques{};
    if (!disturbed_) return torques;
    torques[kLoad] += machine_.load_torque(time_s);
    if (Masses > 1 && machine_.config().disturbance.eccentricity != 0.0) {
      const double torque =
          factor_ * of_.first_stiffness() * machine_.stretch(state_[kAngle] + ahead_s * state_[0]);
      torques[0] -= torque;
      torques[Masses > 1 ? 1 : 0] += torque;
    }
    return torques;
  }
  void add_friction(Torques& torques) const noexcept {
    torques[0] -= driven_.direction * driven_.torque;
    torques[kLoad] -= load_.direction * load_.torque;
  }

  void take_law() noexcept {
    if (law_factor_ == factor_) return;
    law_.put(factor_, kStates, law_now_);
    law_factor_ = factor_;
  }
  void take_inputs(double command, const Torques& outer) noexcept {
    input_ = {};
    add(input_, law_now_.column(kCommand), command);
    for (std::size_t i = 0; i < Masses; ++i) add(input_, law_now_.column(kCommand + 1 + i), outer[i]);
  }

  /// One piece of a sample with friction that slides and sticks.
  void slide(std::size_t segment, double piece_s, double command, const Torques& outer) noexcept {
    take_law();
    take_inputs(command, outer);
    const bool stiff = norm_ * kShortestCourse * piece_s > 1.0;
    double left = piece_s;
    double attempt = piece_s;  // of a stiff machine
    int crowded = 0;           // events with hardly any time between them
    bool must_rest = false;    // what rests does so for the shortest step at least: time must go on
    while (left > 0.0) {
      rate_ = times(law_now_, state_);
      add(rate_, input_.data(), 1.0);
      driven_.pull = driven_.inertia * rate_[0];
      load_.pull = load_.inertia * rate_[kLoad];
      for (DrySide* side : {&driven_, &load_})
        if (!must_rest && side->rests()) side->start_if_pulled();
      double duration = std::min(left, std::max(longest_hold(), kShortestHold * piece_s));
      if (must_rest) duration = std::min(duration, kShortest * piece_s);
      if (stiff) {
        duration = std::min(duration, attempt);
        const double taken = leap(duration, command, outer, duration <= kShortest * piece_s);
        attempt = taken > 0.0 ? 2.0 * taken : 0.5 * duration;
        must_rest = taken == 0.0 && duration <= kShortest * piece_s;
        left -= taken;
        continue;
      }
      if (duration == piece_s && leap_at_once(segment, duration, command, outer)) return;
      duration = std::min(duration, 1.0 / norm_);
      const double share = follow(duration, must_rest);
      left -= std::min(share, 1.0) * duration;
      crowded = share * duration < kShortest * piece_s ? crowded + 1 : 0;
      must_rest = share <= 1.0 && crowded > 4;
    }
  }

  /// A whole piece by the step that is at hand; false, and nothing is done, where a side stops or starts in
  /// it.
  [[nodiscard]] bool leap_at_once(std::size_t segment, double duration, double command,
                                  const Torques& outer) noexcept {
    const bool any_rests = driven_.rests() || load_.rests();
    if (machine_.varies() && any_rests) return false;
    if (driven_.stops_soon(state_[0], duration) || load_.stops_soon(state_[kLoad], duration)) return false;
    const std::size_t locks = (driven_.rests() ? 1U : 0U) + (load_.rests() ? 2U : 0U);
    hold(duration);
    Torques torques = outer;
    add_friction(torques);
    const State next = machine_.varies() ? moved(tables_[segment].at(factor_), command, torques)
                                         : moved(constant_[segment * kLocks + locks], command, torques);
    if (!keeps_on(driven_, 0, next, duration) || !keeps_on(load_, kLoad, next, duration)) return false;
    state_ = next;
    return true;
  }

  /// A step of a stiff machine. Returns the time taken: none where a side would stop in it. It stops then if
  /// this is the `last` attempt.
  [[nodiscard]] double leap(double duration, double command, const Torques& outer, bool last) noexcept {
    hold(duration);
    Torques torques = outer;
    add_friction(torques);
    const State next = moved(make_step(law_now_, driven_.rests(), load_.rests(), duration), command, torques);
    const bool driven_on = driven_.rests() || keeps_on(driven_, 0, next, duration);
    const bool load_on = load_.rests() || keeps_on(load_, kLoad, next, duration);
    if (driven_on && load_on) {
      state_ = next;
      return duration;
    }
    if (last && !driven_on) rest(driven_, 0);
    if (last && !load_on) rest(load_, kLoad);
    return 0.0;
  }

  /// Follows the motion up to the first stop or start of a side, at which it leaves it. Returns the share of
  /// `duration` taken; above 1: all of it, and nothing happened.
  [[nodiscard]] double follow(double duration, bool must_rest) noexcept {
    hold(duration);
    State rate = rate_;
    rate[0] -= driven_.direction * driven_.torque * driven_.per_inertia;
    rate[kLoad] -= load_.direction * load_.torque * load_.per_inertia;
    State rows;
    rows.fill(1.0);
    if (driven_.rests()) rows[0] = 0.0;
    if (load_.rests()) rows[kLoad] = 0.0;
    motion_.expand(state_, rate, law_now_.entry.data(), rows, norm_, duration);
    const State& end = motion_.end();
    const double driven_at = event(driven_, 0, end, duration, must_rest);
    const double load_at = event(load_, kLoad, end, duration, must_rest);
    const double first = std::min(driven_at, load_at);
    if (first > 1.0) {
      state_ = end;
      return first;
    }
    state_ = motion_.at(first);
    if (driven_at == first) turn(driven_, 0);
    if (load_at == first) turn(load_, kLoad);
    return first;
  }
  /// When a side stops or starts, as a share of the step.
  [[nodiscard]] double event(const DrySide& side, std::size_t mass, const State& end, double duration,
                             bool must_rest) const noexcept {
    if ((must_rest && side.rests()) || keeps_on(side, mass, end, duration)) return kNever;
    if (side.slides()) return motion_.crossing_of(mass, side.direction, side.direction * end[mass]);
    const double pulled = pull(side, mass, end);
    const double way = pulled > 0.0 ? 1.0 : -1.0;
    const double offset = side.holding(pulled) - way * side.inertia * input_[mass];
    State row;
    for (std::size_t j = 0; j < kStates; ++j) row[j] = law_now_(mass, j) * (-way * side.inertia);
    return motion_.crossing_of(row, offset, side.holding(pulled) - way * pulled);
  }
  /// Surely neither stops nor starts on the way to `next`. A side that pulls more than breakaway in between,
  /// at neither end, rests on.
  [[nodiscard]] bool keeps_on(const DrySide& side, std::size_t mass, const State& next,
                              double duration) const noexcept {
    if (side.rests()) {
      const double pulled = pull(side, mass, next);
      return std::abs(pulled) <= side.holding(pulled);
    }
    if (!side.slides()) return true;
    const double from = side.direction * state_[mass];
    const double to = side.direction * next[mass];
    if (to < 0.0) return false;
    const double early = duration * side.direction * side.acceleration();
    if (early >= 0.0) return true;
    if (from <= 0.0) return false;
    const double late = duration * (side.direction * pull(side, mass, next) - side.torque) * side.per_inertia;
    return !may_dip({from, early}, {to, late});
  }

  [[nodiscard]] double measured_load(double time_s, double command) noexcept {
    if (second_ == data::SecondOutput::load_encoder) return state_[kAngle] + twist(kLoad);
    if (load_.rests()) return 0.0;
    take_law();
    take_inputs(command, outer_torques(time_s, 0.0));
    const double sliding =
        load_.slides() ? load_.direction * load_.friction.sliding(state_[kLoad], load_.direction) : 0.0;
    return (pull(load_, kLoad, state_) - sliding) * load_.per_inertia;
  }

  void turn(DrySide& side, std::size_t mass) noexcept {
    if (side.slides()) {
      rest(side, mass);
    } else {
      side.start(pull(side, mass, state_) > 0.0 ? 1 : -1);
    }
  }
  void rest(DrySide& side, std::size_t mass) noexcept {
    side.direction = 0;
    state_[mass] = 0.0;
  }
  void hold(double duration) noexcept {
    if (driven_.slides()) driven_.hold(state_[0], duration);
    if (load_.slides()) load_.hold(state_[kLoad], duration);
  }
  [[nodiscard]] double longest_hold() const noexcept {
    return std::min(driven_.longest_hold(state_[0]), load_.longest_hold(state_[kLoad]));
  }
  /// Torque on a side without its friction.
  [[nodiscard]] double pull(const DrySide& side, std::size_t mass, const State& state) const noexcept {
    double sum = input_[mass];
    for (std::size_t j = 0; j < kStates; ++j) sum += law_now_(mass, j) * state[j];
    return side.inertia * sum;
  }

  ElasticMachine of_;
  const Machine& machine_ = of_.machine;
  double sample_time_s_;
  DrySide driven_, load_;
  bool dry_;
  bool disturbed_;
  bool grounded_;
  data::SecondOutput second_;
  double second_value_ = 0.0;
  double per_scale_;
  std::size_t segments_ = 0;
  std::array<double, 2> segment_s_{};
  std::array<unsigned, 2> pieces_{};
  std::array<StepTable<Step>, 2> tables_;
  std::array<Step, 2 * kLocks> constant_;  // [segment, which sides rest]
  Law law_;
  double norm_ = 0.0;  // infinity norm of the law, the highest there is (1/s)
  Step law_now_;       // with nothing locked, at the stiffness of now
  double law_factor_ = std::numeric_limits<double>::quiet_NaN();
  State input_{};  // law_now_ times command and outer torques
  State rate_{};   // d state_/dt without friction
  TaylorMotion<kStates> motion_;
  std::size_t sample_ = 0;
  double factor_ = 1.0;
  State state_{};
};

template <int Masses>
[[nodiscard]] std::unique_ptr<Drive> elastic_drive_of(Machine machine, double sample_time_s,
                                                      double early_fraction) {
  if (machine.config().torque_lag_s > 0.0)
    return std::make_unique<ElasticDrive<Masses, true>>(std::move(machine), sample_time_s, early_fraction);
  return std::make_unique<ElasticDrive<Masses, false>>(std::move(machine), sample_time_s, early_fraction);
}

}  // namespace resonid::plant
