// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <limits>

#include "plant/step_table.hpp"

namespace resonid::plant {

/// N masses by exact zero-order hold (METHOD 2.5): without error at any sample time while the machine is
/// linear.
///
/// - A stiffness that varies is taken in the middle of the step.
/// - Load torque and eccentricity are held over a step, at their value in its middle.
/// - Dry friction is held over pieces of a sample no longer than 1/16 of the fastest resonance's period. Each
///   of the two sides slides or sticks. Where a sliding side would reverse, if only within the piece, the
///   piece is halved up to 12 times, and the side rests from there on: its mass is locked until the other
///   torques on it exceed the breakaway torque. Friction thus never moves a mass, and energy never comes from
///   it.
template <int Masses, bool Lags>
class ElasticDrive final : public Drive {
  static constexpr int kStates = 2 * Masses + (Lags ? 1 : 0);
  static constexpr int kAngle = kStates - 1;
  static constexpr int kLoad = Masses - 1;
  using State = Eigen::Matrix<double, kStates, 1>;
  using Torques = Eigen::Matrix<double, Masses, 1>;
  using Step = Eigen::Matrix<double, kStates, kStates + 1 + Masses>;

 public:
  ElasticDrive(Machine machine, double sample_time_s, double early_fraction)
      : machine_(std::move(machine)),
        sample_time_s_(sample_time_s),
        driven_{machine_.config().friction.driven, 0},
        load_{machine_.config().friction.load, 0},
        dry_(machine_.config().friction.driven.any() || machine_.config().friction.load.any()),
        disturbed_(machine_.disturbed()) {
    scale_ = continuous(machine_.highest_factor(), {}).angle_scale;
    const MassSystem system = machine_.system(1.0);
    for (int i = 0; i < Masses; ++i) inertia_(i) = system.inertia[static_cast<std::size_t>(i)];
    if constexpr (Masses > 1) first_stiffness_ = system.couplings.front().stiffness;
    for (std::size_t i = 0; i < kLocks; ++i) laws_[i] = make_law({(i & 1U) != 0, (i & 2U) != 0});
    add_segment((1.0 - early_fraction) * sample_time_s);
    if (early_fraction > 0.0) add_segment(early_fraction * sample_time_s);
    if (dry_) cache_.resize(kLocks * (kLevels + 1) * segments_);
  }

  double settle(double velocity, double place) override {
    sample_ = 0;
    factor_ = machine_.factor(0.0, place);
    const ContinuousDrive drive = continuous(factor_, {});
    const int direction = velocity > 0.0 ? 1 : velocity < 0.0 ? -1 : 0;
    for (Side* side : {&driven_, &load_}) side->direction = side->friction.any() ? direction : 1;
    state_.setZero();
    state_.template head<Masses>().setConstant(velocity);
    // Torques balance on every mass: the twists and the torque that holds are unknown.
    state_(kAngle) = driven_angle_at(place);
    const Torques held = friction_torques() + outer_torques(0.0, 0.0);
    const Torques balance = drive.a.topLeftCorner(Masses, kStates) * state_ +
                            drive.b.template topRightCorner<Masses, Masses>() * held;
    Eigen::Matrix<double, Masses, Masses> unknown;
    unknown.template leftCols<Masses - 1>() = drive.a.template block<Masses, Masses - 1>(0, Masses);
    if constexpr (Lags)
      unknown.col(Masses - 1) = drive.a.template block<Masses, 1>(0, kAngle - 1);
    else
      unknown.col(Masses - 1) = drive.b.template topLeftCorner<Masses, 1>();
    const Torques solution = unknown.fullPivLu().solve(-balance);
    state_.template segment<Masses - 1>(Masses) = solution.template head<Masses - 1>();
    if constexpr (Lags) state_(kAngle - 1) = solution(Masses - 1);
    state_(kAngle) = driven_angle_at(place);
    return solution(Masses - 1);
  }

  MassMotion advance(double torque) noexcept override {
    const double start = static_cast<double>(sample_) * sample_time_s_;
    advance_segment(0, start, torque);
    const MassMotion read{state_(0), state_(kAngle)};
    if (segments_ > 1) advance_segment(1, start + segment_s_[0], torque);
    ++sample_;
    return read;
  }

  [[nodiscard]] std::vector<MassMotion> motions() const override {
    std::vector<MassMotion> result{{state_(0), state_(kAngle)}};
    for (int i = 1; i < Masses; ++i) result.push_back({state_(i), state_(kAngle) + twist(i)});
    return result;
  }
  [[nodiscard]] double place() const noexcept override {
    return machine_.place(state_(kAngle), state_(kAngle) + twist(kLoad));
  }
  [[nodiscard]] double stiffness_factor() const noexcept override { return factor_; }

  [[nodiscard]] SampledDrive sampled(double factor) const override {
    const ContinuousDrive drive = continuous(factor, {});
    const Eigen::MatrixXd whole = zero_order_hold_step(drive, sample_time_s_);
    const Eigen::MatrixXd early = zero_order_hold_step(drive, segment_s_[0]);
    SampledDrive sampled;
    sampled.a = whole.leftCols(kStates);
    sampled.b = whole.col(kStates);
    sampled.velocity = Eigen::RowVectorXd::Unit(kStates, 0);
    sampled.early_velocity = early.row(0).head(kStates);
    sampled.early_angle = early.row(kAngle).head(kStates);
    sampled.early_velocity_command = early(0, kStates);
    sampled.early_angle_command = early(kAngle, kStates);
    sampled.sample_time_s = sample_time_s_;
    return sampled;
  }

 private:
  static constexpr int kLevels = 12;  // a piece is halved that often to find where a side comes to rest
  static constexpr unsigned kUnits = 1U << kLevels;
  static constexpr std::size_t kLocks = 4;

  struct Side {
    DryFriction friction;
    int direction = 0;  // of sliding; 0: at rest
  };
  /// dx/dt = law [state; command; torques] = (fixed + factor by_factor + sqrt(factor) by_root) [...]: a
  /// spring is proportional to the stiffness, the damping of a tooth belt to its root.
  struct Law {
    Step fixed, by_factor, by_root;
    [[nodiscard]] Step at(double factor) const noexcept {
      return fixed + factor * by_factor + std::sqrt(factor) * by_root;
    }
  };
  struct Cached {
    double factor = std::numeric_limits<double>::quiet_NaN();
    Step step;
  };

  [[nodiscard]] ContinuousDrive continuous(double factor, Locks locks) const {
    return continuous_drive(machine_.system(factor), Lags ? machine_.config().torque_lag_s : 0.0, locks,
                            scale_);
  }
  /// From three factors, exactly: all of them and their roots are powers of 2.
  [[nodiscard]] Law make_law(Locks locks) const {
    const auto at = [&](double factor) {
      const ContinuousDrive drive = continuous(factor, locks);
      Step law;
      law << drive.a, drive.b;
      return law;
    };
    const Step one = at(1.0);
    const Step four = at(4.0);
    const Step sixteen = at(16.0);
    Law law;  // four - one = 3 by_factor + by_root, sixteen - four = 12 by_factor + 2 by_root
    law.by_factor = (sixteen - four - 2.0 * (four - one)) / 6.0;
    law.by_root = four - one - 3.0 * law.by_factor;
    law.fixed = one - law.by_factor - law.by_root;
    return law;
  }
  [[nodiscard]] Step make_step(double factor, std::size_t locks, double duration_s) const noexcept {
    constexpr int kSize = kStates + 1 + Masses;
    Eigen::Matrix<double, kSize, kSize> extended = Eigen::Matrix<double, kSize, kSize>::Zero();
    extended.template topRows<kStates>() = duration_s * laws_[locks].at(factor);
    const double norm = extended.cwiseAbs().rowwise().sum().maxCoeff();
    return matrix_exponential<double, kSize>(extended, norm).template topRows<kStates>();
  }

  void add_segment(double duration_s) {
    unsigned pieces = 1;
    if (dry_ && Masses > 1) {
      const auto modes = resonances(machine_.system(machine_.highest_factor()));
      while (pieces < 64 && 16.0 * modes.back().frequency_hz * duration_s > pieces) pieces *= 2;
    }
    segment_s_[segments_] = duration_s;
    pieces_[segments_] = pieces;
    const double piece = duration_s / pieces;
    tables_[segments_] = StepTable<Step>(machine_.lowest_factor(), machine_.highest_factor(),
                                         [&](double factor) { return make_step(factor, 0, piece); });
    constant_[segments_] = make_step(machine_.lowest_factor(), 0, piece);
    ++segments_;
  }

  [[nodiscard]] double twist(int mass) const noexcept {
    return mass == 0 ? 0.0 : state_(Masses - 1 + mass) / scale_;
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
        slide(segment, command, outer_torques(middle, 0.5 * piece));
      } else if (disturbed_) {
        state_ = moved(free_step(segment), command, outer_torques(middle, 0.5 * piece));
      } else {
        state_ = machine_.varies() ? moved(tables_[segment].at(factor_), command)
                                   : moved(constant_[segment], command);
      }
    }
  }

  [[nodiscard]] double place_after(double time_s) const noexcept {
    return machine_.place(state_(kAngle) + time_s * state_(0),
                          state_(kAngle) + twist(kLoad) + time_s * state_(kLoad));
  }
  [[nodiscard]] Step free_step(std::size_t segment) const noexcept {
    return machine_.varies() ? tables_[segment].at(factor_) : constant_[segment];
  }
  [[nodiscard]] State moved(const Step& step, double command) const noexcept {
    return step.template leftCols<kStates>() * state_ + step.col(kStates) * command;
  }
  [[nodiscard]] State moved(const Step& step, double command, const Torques& torques) const noexcept {
    return step.template leftCols<kStates>() * state_ + step.col(kStates) * command +
           step.template rightCols<Masses>() * torques;
  }

  /// Load torque and eccentricity at `time_s`, which is `ahead_s` from now.
  [[nodiscard]] Torques outer_torques(double time_s, double ahead_s) const noexcept {
    Torques torques = Torques::Zero();
    if (!disturbed_) return torques;
    torques(kLoad) += machine_.load_torque(time_s);
    if (machine_.config().disturbance.eccentricity != 0.0 && Masses > 1) {
      const double torque =
          factor_ * first_stiffness_ * machine_.stretch(state_(kAngle) + ahead_s * state_(0));
      torques(0) -= torque;
      torques(1) += torque;
    }
    return torques;
  }

  [[nodiscard]] Torques friction_torques() const noexcept {
    Torques torques = Torques::Zero();
    torques(0) -= driven_.direction * driven_.friction.sliding(state_(0));
    torques(kLoad) -= load_.direction * load_.friction.sliding(state_(kLoad));
    return torques;
  }

  /// One piece of a sample with friction that slides and sticks.
  void slide(std::size_t segment, double command, const Torques& outer) noexcept {
    unsigned left = kUnits;
    int level = 0;
    bool resting = false;  // for the smallest step at least, so that time goes on
    while (left > 0) {
      const unsigned units = kUnits >> level;
      if (units > left) {
        ++level;
        continue;
      }
      if (!resting) break_away(command, outer);
      const Torques torques = outer + friction_torques();
      const State next = moved(locked_step(segment, level), command, torques);
      const bool driven_turns = reverses(driven_, next(0));
      const bool load_turns = reverses(load_, next(kLoad));
      const bool turns_within =
          Masses > 1 && level < kLevels && !driven_turns && !load_turns &&
          turns_twice(next, command, torques, segment_s_[segment] / pieces_[segment] / (1U << level));
      if (!driven_turns && !load_turns && !turns_within) {
        state_ = next;
        left -= units;
        resting = false;
        if (level > 0 && left % (2 * units) == 0) --level;
      } else if (level < kLevels) {
        ++level;
      } else {
        resting = true;
        if (driven_turns) rest(driven_, 0);
        if (load_turns) rest(load_, kLoad);
      }
    }
  }

  /// Whether a side slides backwards for a while between two states in which it goes forwards.
  [[nodiscard]] bool turns_twice(const State& next, double command, const Torques& torques,
                                 double duration_s) noexcept {
    return turns_twice(driven_, 0, next, command, torques, duration_s) ||
           turns_twice(load_, kLoad, next, command, torques, duration_s);
  }
  /// By the cubic through velocities and accelerations at both ends.
  [[nodiscard]] bool turns_twice(const Side& side, int mass, const State& next, double command,
                                 const Torques& torques, double duration_s) noexcept {
    if (!side.friction.any() || side.direction == 0) return false;
    const double early = duration_s * side.direction * acceleration(mass, state_, command, torques);
    if (early >= 0.0) return false;
    const double late = duration_s * side.direction * acceleration(mass, next, command, torques);
    if (late <= 0.0) return false;
    const double from = side.direction * state_(mass);
    const double rise = side.direction * next(mass) - from;
    // v(s) = from + early s + b s^2 + a s^3, 0 < s < 1; its least value where early + 2 b s + 3 a s^2 = 0
    const double b = 3.0 * rise - 2.0 * early - late;
    const double a = early + late - 2.0 * rise;
    const double s = -early / (b + std::sqrt(std::max(0.0, b * b - 3.0 * a * early)));
    return from + s * (early + s * (b + s * a)) < 0.0;
  }
  [[nodiscard]] double acceleration(int mass, const State& state, double command,
                                    const Torques& torques) noexcept {
    const auto& row = law_now().row(mass);
    return row.template head<kStates>().dot(state) + row(kStates) * command +
           row.template tail<Masses>().dot(torques);
  }

  void rest(Side& side, int mass) noexcept {
    side.direction = 0;
    state_(mass) = 0.0;
  }
  [[nodiscard]] static bool reverses(const Side& side, double velocity) noexcept {
    return side.friction.any() && side.direction != 0 && velocity * side.direction < 0.0;
  }

  /// Starts a side that rests when the other torques on it exceed what friction can hold.
  void break_away(double command, const Torques& outer) noexcept {
    const bool driven_rests = driven_.direction == 0;
    const bool load_rests = load_.direction == 0;
    if (!driven_rests && !load_rests) return;
    const Torques others = torques_on_masses(command, outer);
    if (driven_rests) start(driven_, others(0));
    if (load_rests) start(load_, others(kLoad));
  }
  static void start(Side& side, double torque) noexcept {
    if (std::abs(torque) > side.friction.at_rest()) side.direction = torque > 0.0 ? 1 : -1;
  }

  [[nodiscard]] Torques torques_on_masses(double command, const Torques& outer) noexcept {
    const Step& law = law_now();
    const Torques accelerations = law.template topLeftCorner<Masses, kStates>() * state_ +
                                  law.template block<Masses, 1>(0, kStates) * command +
                                  law.template topRightCorner<Masses, Masses>() * outer;
    return inertia_.cwiseProduct(accelerations);
  }
  /// Of the machine with nothing locked, at the stiffness of now.
  [[nodiscard]] const Step& law_now() noexcept {
    if (!(law_factor_ == factor_)) {
      law_now_ = laws_[0].at(factor_);
      law_factor_ = factor_;
    }
    return law_now_;
  }

  /// Step of a piece halved `level` times with the sides that rest locked.
  [[nodiscard]] const Step& locked_step(std::size_t segment, int level) noexcept {
    const std::size_t which =
        (driven_.friction.any() && driven_.direction == 0 ? std::size_t{1} : std::size_t{0}) +
        (load_.friction.any() && load_.direction == 0 ? std::size_t{2} : std::size_t{0});
    Cached& cached = cache_[(segment * kLocks + which) * (kLevels + 1) + static_cast<std::size_t>(level)];
    if (!(cached.factor == factor_)) {
      const double duration = segment_s_[segment] / pieces_[segment] / static_cast<double>(1U << level);
      cached.step = which == 0 && level == 0 ? free_step(segment) : make_step(factor_, which, duration);
      cached.factor = factor_;
    }
    return cached.step;
  }

  Machine machine_;
  double sample_time_s_;
  Side driven_, load_;
  bool dry_;
  bool disturbed_;
  double scale_ = 0.0;
  double first_stiffness_ = 0.0;
  std::size_t segments_ = 0;
  std::array<double, 2> segment_s_{};
  std::array<unsigned, 2> pieces_{};
  std::array<StepTable<Step>, 2> tables_;
  std::array<Step, 2> constant_;
  std::vector<Cached> cache_;
  std::array<Law, kLocks> laws_;
  Torques inertia_;
  Step law_now_;
  double law_factor_ = std::numeric_limits<double>::quiet_NaN();
  std::size_t sample_ = 0;
  double factor_ = 1.0;
  State state_ = State::Zero();
};

template <int Masses>
[[nodiscard]] std::unique_ptr<Drive> make_elastic(Machine machine, double sample_time_s,
                                                  double early_fraction) {
  if (machine.config().torque_lag_s > 0.0)
    return std::make_unique<ElasticDrive<Masses, true>>(std::move(machine), sample_time_s, early_fraction);
  return std::make_unique<ElasticDrive<Masses, false>>(std::move(machine), sample_time_s, early_fraction);
}

}  // namespace resonid::plant
