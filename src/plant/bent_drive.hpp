// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "plant/dry_side.hpp"
#include "plant/elastic_machine.hpp"
#include "plant/few.hpp"
#include "plant/taylor_motion.hpp"

namespace resonid::plant {

/// Two masses whose coupling has play, stiffens, or both: its torque is K d (1 + (d/d0)^2) + D dd/dt with d
/// the twist beyond half of the play; within the play it gives none.
///
/// The motion is followed on its Taylor polynomial, which holds the cubic term by the recursion of its
/// coefficients: right to rounding. The instants at which a side of the play is reached or left are found on
/// it to rounding, as those at which a side stops or starts under dry friction (ElasticDrive, whose rules for
/// friction, load torque and a stiffness that varies hold here too).
template <bool Lags>
class BentDrive final : public Drive {
  static constexpr int kStates = 4 + (Lags ? 1 : 0);
  static constexpr std::size_t kTwist = 2;  // load less driven side, times the angle scale
  static constexpr std::size_t kAngle = kStates - 1;
  static constexpr std::size_t kCommand = kStates;
  using State = Few<kStates>;
  using Law = FewColumns<kStates, kStates + 3>;
  using Torques = std::array<double, 2>;

 public:
  BentDrive(Machine machine, double sample_time_s, double early_fraction)
      : of_(std::move(machine), Lags, sample_time_s),
        sample_time_s_(sample_time_s),
        segment_s_{(1.0 - early_fraction) * sample_time_s, early_fraction * sample_time_s},
        driven_(machine_.config().friction.driven, machine_.system(1.0).inertia.front()),
        load_(machine_.config().friction.load, machine_.system(1.0).inertia.back()),
        scale_(of_.angle_scale()),
        half_play_(0.5 * bent_coupling(machine_.config().drive).play),
        per_square_(per_square(bent_coupling(machine_.config().drive).stiffening_twist)),
        open_law_(few(of_.open_law())) {
    effect_[0] = driven_.per_inertia;
    effect_[1] = -load_.per_inertia;
    const bool dry = driven_.friction.any() || load_.friction.any();
    for (std::size_t i = 0; i < 2; ++i) pieces_[i] = of_.pieces(segment_s_[i], dry);
    const Eigen::MatrixXd highest = of_.law().at(machine_.highest_factor());
    const double angle = machine_.grounded() ? scale_ : 1.0;
    for (Eigen::Index i = 0; i < kStates; ++i) {
      double sum = 0.0;
      for (Eigen::Index j = 0; j < kStates; ++j)
        sum += std::abs(highest(i, j)) * (i + 1 == kStates ? angle : 1.0) / (j + 1 == kStates ? angle : 1.0);
      norm_ = std::max(norm_, sum);
    }
    const auto law = of_.law();
    fixed_ = few(law.fixed);
    by_factor_ = few(law.by_factor);
  }

  double settle(double velocity, double place) override {
    sample_ = 0;
    factor_ = machine_.factor(0.0, place);
    const int direction = velocity > 0.0 ? 1 : velocity < 0.0 ? -1 : 0;
    for (DrySide* side : {&driven_, &load_}) {
      side->direction = side->friction.any() ? direction : 1;
      side->torque = side->friction.sliding(velocity, direction);
    }
    Eigen::Vector2d torques(-driven_.direction * driven_.torque,
                            machine_.load_torque(0.0) - load_.direction * load_.torque);
    const Eigen::VectorXd state = of_.balance(factor_, velocity, place, torques);
    std::copy_n(state.data(), kStates, state_.begin());
    const double straight = state_[kTwist] / scale_;  // of a linear coupling that gives the same torque
    side_ = straight > 0.0 ? 1 : straight < 0.0 ? -1 : half_play_ > 0.0 ? 0 : 1;
    state_[kTwist] = side_ * scale_ * (half_play_ + bent(std::abs(straight)));
    if (side_ == 0) state_[kTwist] = 0.0;
    if (kind() == data::SecondOutput::load_encoder) second_ = load_angle();
    return state(kStates);
  }

  MassMotion advance(double torque) noexcept override {
    const double start = static_cast<double>(sample_) * sample_time_s_;
    advance_segment(0, start, torque);
    const MassMotion read{state_[0], state_[kAngle]};
    if (kind() != data::SecondOutput::none) second_ = measured_load(start + segment_s_[0], torque);
    if (segment_s_[1] > 0.0) advance_segment(1, start + segment_s_[0], torque);
    ++sample_;
    return read;
  }

  [[nodiscard]] std::vector<MassMotion> motions() const override {
    return {{state_[0], state_[kAngle]}, {state_[1], load_angle()}};
  }
  [[nodiscard]] double place() const noexcept override { return state_[kAngle]; }
  [[nodiscard]] double second_output() const noexcept override { return second_; }
  [[nodiscard]] double stiffness_factor() const noexcept override { return factor_; }
  [[nodiscard]] bool grounded() const noexcept override { return machine_.grounded(); }
  [[nodiscard]] SampledDrive sampled(double factor) const override {
    return of_.sampled(factor, segment_s_[0]);
  }

 private:
  static constexpr double kShortest = 1.0 / 4096.0;  // of a piece, where events crowd
  static constexpr double kShortestHold = 1.0 / 64.0;
  static constexpr double kNever = 2.0;

  [[nodiscard]] static double per_square(double twist) noexcept {
    return twist > 0.0 ? 1.0 / (twist * twist) : 0.0;
  }
  [[nodiscard]] static Law few(const Eigen::MatrixXd& m) {
    Law law;
    std::copy_n(m.data(), law.entry.size(), law.entry.begin());
    return law;
  }
  /// d of d (1 + (d/d0)^2) = straight >= 0, by Newton's method from above, where the left side is convex.
  [[nodiscard]] double bent(double straight) const noexcept {
    double d = straight;
    for (int i = 0; i < 60 && per_square_ > 0.0; ++i) {
      const double square = per_square_ * d * d;
      const double step = (d * (1.0 + square) - straight) / (1.0 + 3.0 * square);
      d -= step;
      if (std::abs(step) <= 1e-16 * d) break;
    }
    return d;
  }
  [[nodiscard]] data::SecondOutput kind() const noexcept { return machine_.config().second_output; }
  [[nodiscard]] double load_angle() const noexcept { return state_[kAngle] + state_[kTwist] / scale_; }
  [[nodiscard]] double stiffness() const noexcept { return factor_ * of_.first_stiffness(); }
  [[nodiscard]] const Law& law() const noexcept { return side_ == 0 ? open_law_ : law_now_; }
  /// By the cube of the twist beyond the play (Nm/rad^3).
  [[nodiscard]] double cubic() const noexcept { return side_ == 0 ? 0.0 : stiffness() * per_square_; }
  [[nodiscard]] double beyond(const State& state) const noexcept {
    return state[kTwist] / scale_ - side_ * half_play_;
  }

  void advance_segment(std::size_t segment, double start_s, double command) noexcept {
    const double piece = segment_s_[segment] / pieces_[segment];
    for (unsigned i = 0; i < pieces_[segment]; ++i) {
      const double middle = start_s + (i + 0.5) * piece;
      if (machine_.varies()) factor_ = machine_.factor(middle, state_[kAngle]);
      advance_piece(piece, command, machine_.load_torque(middle));
    }
  }

  void advance_piece(double piece_s, double command, double load_torque) noexcept {
    double left = piece_s;
    double attempt = piece_s;
    int crowded = 0;         // events with hardly any time between them
    bool must_stay = false;  // nothing stops, starts, touches or parts for the shortest step: time must go on
    while (left > 0.0) {
      take_law(command, load_torque);
      for (DrySide* side : {&driven_, &load_})
        if (!must_stay && side->rests()) side->start_if_pulled();
      const double twist = beyond(state_);
      const double norm = norm_ * (1.0 + 3.0 * per_square_ * twist * twist);
      const double longest = std::min(driven_.longest_hold(state_[0]), load_.longest_hold(state_[1]));
      double duration = std::min({left, attempt, 1.0 / norm, std::max(longest, kShortestHold * piece_s)});
      if (must_stay) duration = std::min(duration, kShortest * piece_s);
      const double share = follow(duration, must_stay);
      if (share == 0.0 && !expanded_) {
        attempt = 0.5 * duration;
        continue;
      }
      attempt = 2.0 * duration;
      left -= std::min(share, 1.0) * duration;
      crowded = share * duration < kShortest * piece_s ? crowded + 1 : 0;
      must_stay = share <= 1.0 && crowded > 4;
    }
  }

  /// What acts now: the law, its constant part and the torques on both sides without friction.
  void take_law(double command, double load_torque) noexcept {
    if (!(law_factor_ == factor_)) {
      for (std::size_t i = 0; i < law_now_.entry.size(); ++i)
        law_now_.entry[i] = fixed_.entry[i] + factor_ * by_factor_.entry[i];
      law_factor_ = factor_;
    }
    input_ = {};
    add(input_, law().column(kCommand), command);
    add(input_, law().column(kCommand + 2), load_torque);
    add(input_, effect_.data(), -side_ * half_play_ * stiffness());
    rate_ = times(law(), state_);
    add(rate_, input_.data(), 1.0);
    add(rate_, effect_.data(), cubic() * std::pow(beyond(state_), 3.0));
    driven_.pull = driven_.inertia * rate_[0];
    load_.pull = load_.inertia * rate_[1];
  }

  /// Follows the motion up to the first event, at which it leaves it. Returns the share of `duration` taken;
  /// above 1: all of it, and nothing happened. 0 and `expanded_` false: the duration is too long.
  [[nodiscard]] double follow(double duration, bool must_stay) noexcept {
    if (driven_.slides()) driven_.hold(state_[0], duration);
    if (load_.slides()) load_.hold(state_[1], duration);
    State rate = rate_;
    rate[0] -= driven_.direction * driven_.torque * driven_.per_inertia;
    rate[1] -= load_.direction * load_.torque * load_.per_inertia;
    State rows;
    rows.fill(1.0);
    if (driven_.rests()) rows[0] = 0.0;
    if (load_.rests()) rows[1] = 0.0;
    State effect{};
    add(effect, effect_.data(), cubic());
    expanded_ = motion_.expand_cubic(state_, rate, law().entry.data(), rows, duration,
                                     {kTwist, 1.0 / scale_, side_ * half_play_, effect});
    if (!expanded_) return 0.0;
    const State& end = motion_.end();
    const double driven_at = must_stay ? kNever : event(driven_, 0, end);
    const double load_at = must_stay ? kNever : event(load_, 1, end);
    int next_side = 0;
    const double side_at = must_stay ? kNever : side_event(end, next_side);
    const double first = std::min({driven_at, load_at, side_at});
    if (first > 1.0) {
      state_ = end;
      return first;
    }
    state_ = motion_.at(first);
    const double driven_pull = pull(0, driven_, state_);
    const double load_pull = pull(1, load_, state_);
    if (driven_at == first) turn(driven_, 0, driven_pull);
    if (load_at == first) turn(load_, 1, load_pull);
    if (side_at == first) side_ = next_side;
    return first;
  }

  /// When a side stops or starts, as a share of the step.
  [[nodiscard]] double event(const DrySide& side, std::size_t mass, const State& end) const noexcept {
    if (side.slides()) return motion_.crossing_of(mass, side.direction, side.direction * end[mass]);
    if (!side.rests()) return kNever;
    const double pulled = pull(mass, side, end);
    if (std::abs(pulled) <= side.holding(pulled)) return kNever;
    const double per = (pulled > 0.0 ? -1.0 : 1.0) * side.inertia;
    State row;
    for (std::size_t j = 0; j < kStates; ++j) row[j] = law()(mass, j) * per;
    return motion_.crossing_of(row, side.holding(pulled) + per * input_[mass], per * effect_[mass] * cubic(),
                               side.holding(pulled) - std::abs(pulled));
  }
  /// When the coupling touches a side of its play or parts from it, and where it is then.
  [[nodiscard]] double side_event(const State& end, int& next_side) const noexcept {
    if (half_play_ == 0.0) return kNever;
    const double reach = scale_ * half_play_;
    State row{};
    if (side_ != 0) {
      row[kTwist] = side_;
      next_side = 0;
      return motion_.crossing_of(row, -reach, 0.0, side_ * end[kTwist] - reach);
    }
    row[kTwist] = -1.0;
    const double above = motion_.crossing_of(row, reach, 0.0, reach - end[kTwist]);
    row[kTwist] = 1.0;
    const double below = motion_.crossing_of(row, reach, 0.0, reach + end[kTwist]);
    next_side = above <= below ? 1 : -1;
    return std::min(above, below);
  }
  void turn(DrySide& side, std::size_t mass, double pulled) noexcept {
    if (side.rests()) return side.start(pulled > 0.0 ? 1 : -1);
    side.direction = 0;
    state_[mass] = 0.0;
  }
  /// Torque on a side without its friction.
  [[nodiscard]] double pull(std::size_t mass, const DrySide& side, const State& state) const noexcept {
    double sum = input_[mass] + effect_[mass] * cubic() * std::pow(beyond(state), 3.0);
    for (std::size_t j = 0; j < kStates; ++j) sum += law()(mass, j) * state[j];
    return side.inertia * sum;
  }
  [[nodiscard]] double measured_load(double time_s, double command) noexcept {
    if (kind() == data::SecondOutput::load_encoder) return load_angle();
    if (load_.rests()) return 0.0;
    take_law(command, machine_.load_torque(time_s));
    const double sliding =
        load_.slides() ? load_.direction * load_.friction.sliding(state_[1], load_.direction) : 0.0;
    return (load_.pull - sliding) * load_.per_inertia;
  }

  ElasticMachine of_;
  const Machine& machine_ = of_.machine;
  double sample_time_s_;
  std::array<double, 2> segment_s_;
  std::array<unsigned, 2> pieces_{};
  DrySide driven_, load_;
  double scale_;
  double half_play_;   // rad
  double per_square_;  // of the twist at which the torque doubles; 0: linear (1/rad^2)
  Law open_law_, fixed_, by_factor_;
  Law law_now_;  // with the coupling in contact, at the stiffness of now
  double law_factor_ = std::nan("");
  double norm_ = 0.0;  // infinity norm of the linear law, the highest there is (1/s)
  State effect_{};     // of a torque from the load to the driven side, on the rates
  State input_{};      // the law's constant part
  State rate_{};       // d state_/dt without friction
  bool expanded_ = true;
  TaylorMotion<kStates> motion_;
  std::size_t sample_ = 0;
  double factor_ = 1.0;
  int side_ = 1;  // of the play that the coupling touches; 0: none, it is within
  double second_ = 0.0;
  State state_{};
};

}  // namespace resonid::plant
