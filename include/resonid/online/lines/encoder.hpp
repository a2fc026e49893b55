// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <type_traits>

namespace resonid::online {

enum class EncoderKind {
  counter,  ///< Register of `bits` bits that a quadrature decoder counts in; where it starts says nothing.
  absolute_turn,  ///< 0 ... counts_per_turn - 1 within one turn, right from the first sample on.
};

struct EncoderConfig {
  double sample_rate_hz = 0.0;  ///< Rate at which step() is called, > 0.
  EncoderKind kind = EncoderKind::counter;
  unsigned bits = 32;                 ///< Width of the raw value, 8 ... 64; higher bits of it are ignored.
  std::uint64_t counts_per_turn = 0;  ///< All four edges of a quadrature line count; > 0, below 2^63.
  double travel_per_turn = kTwoPi;    ///< 2π rad; of a linear scale the metres that these counts stand for.
  bool reversed = false;              ///< Rising counts are backward motion.
  double largest_velocity = 0.0;      ///< That the machine can have, > 0 (rad/s, m/s); see EncoderVelocity.
};

/// Position and velocity from the raw counter of an encoder, wrap-around in either direction included.
///
///   d(k) = raw(k) - raw(k-1), wrapped to the half range on either side     position(k) = position(k-1) +
///   d(k) velocity(k) = d(k) travel_per_turn / counts_per_turn * sample_rate / n
///
/// The position is a whole number of 64 bits, so nothing adds up however long it runs. n is 1, and one more
/// for every sample that was missing before: a mean over the gap. A difference larger than n samples at
/// largest_velocity allow is implausible (a bit error on the line): it is counted, and the sample is missing.
/// As long as it lasts what is allowed grows, so a counter that was set anew is followed at last.
///
/// Missing samples: tell by miss(), for the raw value has no NaN. A gap in which the machine may have passed
/// half the counter's range leaves the position uncertain by whole ranges: certain() turns false. The
/// velocity of differences has half a sample of delay and noise of a count per sample; the trackers want just
/// that. Trivially copyable, no heap. docs/methods/encoder.md
template <class Real>
class EncoderVelocity {
 public:
  using Scalar = Real;

  static expected<EncoderVelocity, Error> create(const EncoderConfig& config) noexcept {
    const auto positive = [](double x) { return x > 0.0 && std::isfinite(x); };
    if (!positive(config.sample_rate_hz))
      return refuse("sample_rate_hz", "must be > 0", config.sample_rate_hz);
    if (config.bits < 8 || config.bits > 64)
      return refuse("bits", "must be from 8 to 64", static_cast<double>(config.bits));
    const std::uint64_t mask = ~std::uint64_t{0} >> (64U - config.bits);
    const bool absolute = config.kind == EncoderKind::absolute_turn;
    if (config.counts_per_turn == 0 || config.counts_per_turn >= kHalf)
      return refuse("counts_per_turn", "must be > 0 and below 2^63",
                    static_cast<double>(config.counts_per_turn));
    if (absolute && (config.counts_per_turn < 2 || config.counts_per_turn - 1 > mask))
      return refuse("counts_per_turn", "must be at least 2 and fit into the bits",
                    static_cast<double>(config.counts_per_turn));
    if (!positive(config.travel_per_turn))
      return refuse("travel_per_turn", "must be > 0", config.travel_per_turn);
    if (!positive(config.largest_velocity))
      return refuse("largest_velocity", "must be > 0", config.largest_velocity);
    EncoderVelocity encoder;
    encoder.mask_ = mask;
    encoder.range_ = absolute ? config.counts_per_turn : mask + 1;  // 0 stands for 2^64
    encoder.absolute_ = absolute;
    encoder.reversed_ = config.reversed;
    encoder.counts_per_turn_ = static_cast<std::int64_t>(config.counts_per_turn);
    const double per_count = config.travel_per_turn / static_cast<double>(config.counts_per_turn);
    // One count more than the velocity makes: where within a count the sample falls is not known.
    const double most = std::floor(config.largest_velocity / config.sample_rate_hz / per_count) + 1.0;
    if (!(most < static_cast<double>(encoder.half_range())))
      return refuse("largest_velocity", "must make less than half the counter's range in a sample",
                    config.largest_velocity);
    encoder.most_per_sample_ = static_cast<std::uint64_t>(most);
    encoder.travel_ = static_cast<Real>(per_count);
    encoder.turn_ = static_cast<Real>(config.travel_per_turn);
    encoder.rate_ = static_cast<Real>(per_count * config.sample_rate_hz);
    return encoder;
  }

  /// The newest raw value. False when it is implausible, and so counts as missing.
  bool step(std::uint64_t raw) noexcept {
    ++samples_;
    raw &= mask_;
    velocity_ = kUnknown;
    if (absolute_ && raw >= range_) return reject();
    if (!started_) {
      start(raw);
      return true;
    }
    const std::uint64_t up = wrapped(raw - last_);  // modulo the range
    const bool backward = up > half_range();
    const std::uint64_t size = backward ? wrapped(last_ - raw) : up;
    const std::uint64_t most = most_over(missed_);
    if (size > most) return reject();
    if (most >= half_range()) certain_ = false;
    position_ += backward != reversed_ ? std::uint64_t{0} - size : size;
    const Real counts = static_cast<Real>(size) / (static_cast<Real>(missed_) + Real(1));
    velocity_ = last_velocity_ = (backward != reversed_ ? -counts : counts) * rate_;
    last_ = raw;
    missed_ = 0;
    return true;
  }
  /// `count` samples were lost; the next difference is spread over them.
  void miss(std::uint64_t count) noexcept {
    if (count == 0) return;
    samples_ += count;
    skipped_ += count;
    missed_ = missed_ > ~count ? ~std::uint64_t{0} : missed_ + count;
    velocity_ = kUnknown;
  }
  /// Before the first sample again; of a counter the position is then 0.
  void reset() noexcept {
    position_ = last_ = missed_ = samples_ = skipped_ = implausible_ = 0;
    last_velocity_ = Real(0);
    velocity_ = kUnknown;
    started_ = false;
    certain_ = true;
  }
  /// Homing: what the position of the newest accepted sample is from now on; certain again.
  void set_position_counts(std::int64_t counts) noexcept {
    position_ = static_cast<std::uint64_t>(counts);
    certain_ = true;
  }

  /// Unwrapped, of the newest accepted sample; 0 before the first.
  [[nodiscard]] std::int64_t position_counts() const noexcept { return static_cast<std::int64_t>(position_); }
  /// The same in rad (m). Whole turns and the rest are scaled apart, so that float keeps what it can.
  [[nodiscard]] Real position() const noexcept {
    return static_cast<Real>(position_counts() / counts_per_turn_) * turn_ +
           static_cast<Real>(position_counts() % counts_per_turn_) * travel_;
  }
  /// Velocity of the newest sample (rad/s, m/s); NaN where it is missing, implausible or the first, which is
  /// what trackers take for missing.
  [[nodiscard]] Real velocity() const noexcept { return velocity_; }
  /// The last one there was, for a controller; 0 before.
  [[nodiscard]] Real last_velocity() const noexcept { return last_velocity_; }
  /// Velocity of one count per sample.
  [[nodiscard]] Real resolution() const noexcept { return rate_; }

  /// False once the machine may have passed half the range unseen.
  [[nodiscard]] bool certain() const noexcept { return certain_; }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }  ///< Missing ones included.
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept {
    return skipped_;
  }  ///< And implausible ones.
  [[nodiscard]] std::uint64_t implausible_samples() const noexcept { return implausible_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return intact_flags(absolute_, reversed_, started_, certain_) && counts_per_turn_ > 0 &&
           most_per_sample_ > 0 && (range_ > 1 || !absolute_);
  }

 private:
  static constexpr std::uint64_t kHalf = std::uint64_t{1} << 63U;
  static constexpr Real kUnknown = std::numeric_limits<Real>::quiet_NaN();

  EncoderVelocity() = default;

  /// Largest difference that is not taken for one the other way; the tie of an even range is forward.
  [[nodiscard]] std::uint64_t half_range() const noexcept { return range_ == 0 ? kHalf : range_ / 2; }
  /// A difference of two values below the range, modulo it.
  [[nodiscard]] std::uint64_t wrapped(std::uint64_t difference) const noexcept {
    if (!absolute_) return difference & mask_;
    return difference < range_ ? difference : difference + range_;  // below 0: wrapped at 2^64
  }
  [[nodiscard]] std::uint64_t most_over(std::uint64_t missed) const noexcept {
    const std::uint64_t most = half_range();
    return missed >= most / most_per_sample_ ? most : most_per_sample_ * (missed + 1);
  }
  void start(std::uint64_t raw) noexcept {
    started_ = true;
    last_ = raw;
    missed_ = 0;
    if (absolute_) position_ = reversed_ ? std::uint64_t{0} - raw : raw;
  }
  bool reject() noexcept {
    ++skipped_;
    ++implausible_;
    if (missed_ != ~std::uint64_t{0}) ++missed_;
    return false;
  }

  std::uint64_t mask_ = 0, range_ = 0, most_per_sample_ = 1;
  std::int64_t counts_per_turn_ = 1;
  std::uint64_t position_ = 0, last_ = 0, missed_ = 0;  // position in two's complement
  std::uint64_t samples_ = 0, skipped_ = 0, implausible_ = 0;
  Real travel_{}, turn_{}, rate_{}, last_velocity_{}, velocity_ = kUnknown;
  bool absolute_ = false, reversed_ = false, started_ = false, certain_ = true;
};

static_assert(std::is_trivially_copyable_v<EncoderVelocity<double>>);
static_assert(std::is_trivially_copyable_v<EncoderVelocity<float>>);

}  // namespace resonid::online
