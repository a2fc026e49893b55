// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/detail/biquad_chain.hpp>
#include <resonid/online/detail/control_config.hpp>
#include <resonid/online/detail/gain_table.hpp>
#include <span>
#include <type_traits>

namespace resonid::online {

/// What a controller is told at a sample. What its configuration does not use is not looked at.
template <class Real>
struct ControlInputs {
  Real reference = Real(0);              ///< Velocity (rad/s), or position (rad) with kv.
  Real velocity = Real(0);               ///< Measured, rad/s.
  Real position = Real(0);               ///< Measured; for kv and for a schedule, unless it is summed.
  Real velocity_feed_forward = Real(0);  ///< rad/s, with kv only.
  Real torque_feed_forward = Real(0);    ///< Nm
};

/// A controller that `design` has designed, in the drive: PI behind biquads, with a limit of the torque,
/// gains over position and a position loop around it.
///
///   r = reference, or kv (reference - x) + velocity feed-forward        e = r - y
///   i = i + ki Ts e                                                     x = x + Ts y, where it is summed
///   torque = F (kp (b r - y) + i) + torque feed-forward, within +-torque_limit
///
/// - Where the torque is cut and e drives it further out, i stays as it was. F goes on, on what it is given.
/// - ki stands inside the sum, so that another one makes no jump; for another kp the sum takes
///   i - (kp' - kp)(b r - y) of the last step. A schedule does so from sample to sample, but not behind a
///   torque that was cut.
/// - Other biquads run beside the old ones before they take over (BiquadChain).
///
/// A sample of which a value in use is not finite is missing: the torque stays, and so do all states, for up
/// to longest_gap_samples in a row; a summed position goes on at the last velocity. After that the controller
/// is at rest with torque 0, in_gap() says so, and the next good sample begins anew. A torque that is not
/// finite is never given. It keeps the exported texts' meaning (docs/methods/tune.md 16.1). Trivially
/// copyable, no heap. docs/methods/control.md
template <class Real, std::size_t MaxBiquads = 4, std::size_t MaxNodes = 17>
class DriveControl {
 public:
  using Scalar = Real;
  using Inputs = ControlInputs<Real>;

  static expected<DriveControl, Error> create(const DriveControlConfig& config) noexcept {
    if (const auto good = check(config, MaxBiquads, MaxNodes, kSingle); !good)
      return unexpected<Error>(good.error());
    return DriveControl(config);
  }

  /// Torque of this sample, Nm.
  Real step(const Inputs& now) noexcept {
    if (!usable(now)) {
      miss(1);
      return torque_;
    }
    ++samples_;
    gap_ = 0;
    const Real position = measured_position(now);
    if (!table_.empty()) take(table_.at(position), !limited_);
    const Real reference =
        cascaded_ ? kv_ * ((now.reference - position) - position_rest_) + now.velocity_feed_forward
                  : now.reference;
    const Real error = reference - now.velocity, sum = sum_ + gains_.ki_ts * error;
    deviation_ = weight_ * reference - now.velocity;
    const Real torque = filter_.step(gains_.kp * deviation_ + sum) + now.torque_feed_forward;
    if (!std::isfinite(torque)) {
      ++skipped_;
      rest();
      in_gap_ = true;
      return torque_;
    }
    velocity_reference_ = reference;
    return within_limit(torque, error, sum);
  }
  /// `count` samples went by without step(): as many missing ones.
  void miss(std::uint64_t count) noexcept {
    samples_ += count;
    skipped_ += count;
    const std::uint64_t room = longest_gap_ - gap_;
    if (sums_velocity_) add_way(static_cast<Real>(std::min(count, room)) * way_);
    gap_ += std::min(count, room);
    if (count <= room) return;
    position_certain_ = position_certain_ && !sums_velocity_;
    rest();
    in_gap_ = true;
  }
  /// At rest, as create() with the present gains, schedule and biquads would give it; an exchange of biquads
  /// is over.
  void reset() noexcept {
    rest();
    position_ = position_rest_ = way_ = Real(0);
    position_certain_ = true;
    samples_ = skipped_ = gap_ = 0;
    if (!table_.empty()) gains_ = table_.at(position_);
  }

  /// Other gains, in place of a schedule too, without a jump of the torque.
  expected<void> set_gains(double kp, double ki) noexcept {
    if (const auto good = check_gains(kp, ki); !good) return good;
    table_ = Table({}, sample_rate_hz_);
    take({static_cast<Real>(kp), static_cast<Real>(ki / sample_rate_hz_)}, true);
    return {};
  }
  /// Another schedule, in place of gains too, without a jump of the torque where the position stays.
  expected<void> set_schedule(std::span<const GainNode> nodes) noexcept {
    if (nodes.empty()) return refuse("schedule", "must have nodes");
    if (const auto good = check_nodes(nodes, MaxNodes); !good) return good;
    table_ = Table(nodes, sample_rate_hz_);
    take(table_.at(position_), true);
    return {};
  }
  /// Goes over to other biquads, which run along for `warm_up_samples` and then take over linearly within
  /// `fade_samples`, >= 1. Refused while exchanging(). A tangent for each biquad.
  expected<void> exchange_filters(std::span<const Biquad> biquads, std::uint32_t warm_up_samples,
                                  std::uint32_t fade_samples) noexcept {
    if (fade_samples == 0) return refuse("fade_samples", "must be >= 1", 0.0);
    if (exchanging()) return refuse("biquads", "must wait until the exchange before it is over");
    if (const auto good = check_biquads(biquads, MaxBiquads, sample_rate_hz_, kSingle); !good) return good;
    filter_.exchange(biquads, sample_rate_hz_, warm_up_samples, fade_samples);
    return {};
  }
  /// Homing of a summed position: what it is at the newest sample. The caller's reference has to move along.
  void set_position(Real position) noexcept {
    position_ = position;
    position_rest_ = Real(0);
    position_certain_ = true;
  }

  [[nodiscard]] Real torque() const noexcept { return torque_; }    ///< Nm, of the newest sample.
  [[nodiscard]] bool limited() const noexcept { return limited_; }  ///< That torque was cut.
  [[nodiscard]] Real integral() const noexcept { return sum_; }     ///< i, Nm.
  [[nodiscard]] Real kp() const noexcept { return gains_.kp; }
  [[nodiscard]] Real ki() const noexcept { return gains_.ki_ts * static_cast<Real>(sample_rate_hz_); }
  [[nodiscard]] Real position() const noexcept { return position_; }  ///< Measured or summed.
  [[nodiscard]] Real velocity_reference() const noexcept { return velocity_reference_; }
  [[nodiscard]] bool exchanging() const noexcept { return filter_.exchanging(); }
  /// Too many samples in a row are missing, or the torque was not finite: the controller is at rest.
  [[nodiscard]] bool in_gap() const noexcept { return in_gap_; }
  /// A summed position has lost its way in a gap; set_position() makes it certain.
  [[nodiscard]] bool position_certain() const noexcept { return position_certain_; }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return intact_flags(cascaded_, sums_velocity_, limited_, in_gap_, position_certain_) &&
           filter_.intact() && table_.intact() && gap_ <= longest_gap_ && positive(sample_rate_hz_);
  }

 private:
  using Table = GainTable<Real, MaxNodes>;
  static constexpr bool kSingle = std::is_same_v<Real, float>;

  explicit DriveControl(const DriveControlConfig& c) noexcept
      : sample_rate_hz_(c.sample_rate_hz),
        filter_(c.biquads, c.sample_rate_hz),
        table_(c.schedule, c.sample_rate_hz),
        gains_{static_cast<Real>(c.kp), static_cast<Real>(c.ki / c.sample_rate_hz)},
        step_(static_cast<Real>(1.0 / c.sample_rate_hz)),
        weight_(static_cast<Real>(c.set_point_weight)),
        limit_(static_cast<Real>(c.torque_limit)),
        kv_(static_cast<Real>(c.kv)),
        longest_gap_(c.longest_gap_samples),
        cascaded_(c.kv > 0.0),
        sums_velocity_(c.sums_velocity) {
    if (!table_.empty()) gains_ = table_.at(position_);
  }

  [[nodiscard]] bool usable(const Inputs& now) const noexcept {
    const bool needs_position = !sums_velocity_ && (cascaded_ || !table_.empty());
    return std::isfinite(now.reference) && std::isfinite(now.velocity) &&
           std::isfinite(now.torque_feed_forward) && (!needs_position || std::isfinite(now.position)) &&
           (!cascaded_ || std::isfinite(now.velocity_feed_forward));
  }
  /// position_ + position_rest_ is the sum: what rounding cuts off is kept, or a float would stand still far
  /// from 0 (Kahan's summation).
  void add_way(Real way) noexcept {
    const Real added = way + position_rest_, next = position_ + added;
    position_rest_ = added - (next - position_);
    position_ = next;
  }
  Real measured_position(const Inputs& now) noexcept {
    if (sums_velocity_) {
      way_ = step_ * now.velocity;
      add_way(way_);
    } else if (cascaded_ || !table_.empty()) {
      position_ = now.position;
    }
    return position_;
  }
  void take(const StepGains<Real>& gains, bool bumpless) noexcept {
    if (bumpless) sum_ -= (gains.kp - gains_.kp) * deviation_;
    gains_ = gains;
  }
  Real within_limit(Real torque, Real error, Real sum) noexcept {
    const bool above = torque > limit_, below = torque < -limit_;
    if (!(above && error >= Real(0)) && !(below && error <= Real(0))) sum_ = sum;
    limited_ = above || below;
    in_gap_ = false;
    torque_ = above ? limit_ : below ? -limit_ : torque;
    return torque_;
  }
  /// No torque, and nothing remembered but the position.
  void rest() noexcept {
    filter_.rest();
    sum_ = deviation_ = torque_ = velocity_reference_ = Real(0);
    limited_ = in_gap_ = false;
  }

  double sample_rate_hz_;
  BiquadChain<Real, MaxBiquads> filter_;
  Table table_;
  StepGains<Real> gains_;
  Real step_, weight_, limit_, kv_;
  Real sum_ = Real(0), deviation_ = Real(0);  // i, and b r - y of the last step
  Real position_ = Real(0), position_rest_ = Real(0), way_ = Real(0);
  Real torque_ = Real(0), velocity_reference_ = Real(0);
  std::uint64_t samples_ = 0, skipped_ = 0;
  std::uint64_t gap_ = 0, longest_gap_;
  bool cascaded_, sums_velocity_, limited_ = false, in_gap_ = false, position_certain_ = true;
};

static_assert(std::is_trivially_copyable_v<DriveControl<double>>);
static_assert(std::is_trivially_copyable_v<DriveControl<float>>);

}  // namespace resonid::online
