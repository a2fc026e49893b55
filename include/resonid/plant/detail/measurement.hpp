// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/constants.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/plant/detail/drive.hpp>
#include <resonid/plant/detail/white_noise.hpp>
#include <span>
#include <string_view>
#include <vector>

namespace resonid::plant {

/// Where the measured velocity comes from.
enum class VelocitySource { sensor, encoder };
inline constexpr EnumName<VelocitySource> kVelocitySourceNames[] = {{VelocitySource::sensor, "sensor"},
                                                                    {VelocitySource::encoder, "encoder"}};
[[nodiscard]] constexpr std::span<const EnumName<VelocitySource>> enum_names(VelocitySource) noexcept {
  return kVelocitySourceNames;
}

struct MeasurementConfig {
  double delay_s = 0.0;
  double noise_rms = 0.0;
  double noise_bandwidth_hz = 0.0;
  VelocitySource velocity = VelocitySource::sensor;
  double encoder_counts = 0.0;
  double filter_s = 0.0;
  std::uint64_t hold_samples = 1;
  data::SecondOutput second_output = data::SecondOutput::none;
  double second_noise = 0.0;
};
template <class Visitor>
void describe(Visitor&& v, MeasurementConfig& c) {
  v("delay_s", c.delay_s, "delay of the measured velocity and position, whole samples or not, >= 0 (s)");
  v("noise_rms", c.noise_rms, "standard deviation of noise on the measured velocity, >= 0 (rad/s)");
  v("noise_bandwidth_hz", c.noise_bandwidth_hz,
    "corner of a first-order low-pass that colours the noise, its standard deviation kept; 0: white (Hz)");
  v("velocity", c.velocity,
    "sensor (of velocity), or encoder: difference of two positions one sample apart over the sample time");
  v("encoder_counts", c.encoder_counts,
    "counts of the position encoder per turn (per m when linear), all edges; 0: not quantised");
  v("filter_s", c.filter_s,
    "time constant T of the drive's filter of the measured velocity, noise included, as controller and "
    "record "
    "see it: f(k) = p f(k-1) + (1-p) v(k), p = exp(-Ts/T); 0: none (s)");
  v("hold_samples", c.hold_samples,
    "the measured velocity, filtered, is renewed in every n-th sample only, n = 1 ... 64");
  v("second_output", c.second_output,
    "none, load-encoder (column load_position, rad) or load-accelerometer (column load_acceleration, "
    "rad/s2): "
    "motion of the load at the driven shaft, as late as the velocity; unfiltered");
  v("second_noise", c.second_noise,
    "standard deviation of white noise on the second output, >= 0 (its unit)");
}

[[nodiscard]] expected<void, Error> check(const MeasurementConfig& config) noexcept;

/// Standard deviation of the velocity that an encoder's rounding adds while the machine moves over many
/// counts per sample: two independent errors, uniform over one count q, make q/(sqrt(6) Ts).
[[nodiscard]] double encoder_velocity_noise(double counts_per_turn, double sample_time_s) noexcept;

/// A delay as whole samples and the rest.
struct SampleDelay {
  std::size_t whole = 0;
  double fraction = 0.0;  ///< In [0, 1).
};
/// A delay within 1e-9 samples of a whole number counts as whole.
[[nodiscard]] SampleDelay split_delay(double delay_s, double sample_rate_hz) noexcept;

/// Noise of a given standard deviation, white or coloured by a first-order low-pass.
class MeasurementNoise {
 public:
  MeasurementNoise(const MeasurementConfig& config, double sample_rate_hz, std::uint64_t seed) noexcept;
  double step() noexcept {
    if (silent_) return 0.0;
    value_ = memory_ * value_ + white_.step();
    return value_;
  }

 private:
  bool silent_;
  double memory_;
  WhiteNoise white_;
  double value_ = 0.0;
};

/// Velocity and position as a drive sees them: delayed, of the encoder's resolution. Allocates at creation
/// only.
class MotionSensor {
 public:
  /// `count` is the encoder's step (rad, m), 0: not quantised.
  MotionSensor(SampleDelay delay, VelocitySource source, double count, double sample_time_s);

  /// As if the machine had always moved as `now` says.
  void settle(const MassMotion& now) noexcept;

  /// What is measured at this sample.
  [[nodiscard]] MassMotion read() noexcept {
    const MassMotion& now = line_[next_];
    const double position = rounded(now.angle);
    const double velocity =
        source_ == VelocitySource::sensor ? now.velocity : (position - last_position_) * rate_hz_;
    last_position_ = position;
    return {velocity, position};
  }
  /// Takes what the machine has come to, `fraction` of a sample before the next sample.
  void push(const MassMotion& motion) noexcept {
    line_[next_] = motion;
    next_ = next_ + 1 == line_.size() ? 0 : next_ + 1;
  }

 private:
  [[nodiscard]] double rounded(double angle) const noexcept {
    return count_ > 0.0 ? count_ * std::floor(angle / count_ + 0.5) : angle;
  }

  SampleDelay delay_;
  VelocitySource source_;
  double count_;
  double rate_hz_;
  std::vector<MassMotion> line_;  // ring of whole + 1 motions; next_ is the oldest
  std::size_t next_ = 0;
  double last_position_ = 0.0;
};

/// How the velocity that is read becomes the measured one, and how a cascade sees the position.
struct VelocityPath {
  VelocitySource source = VelocitySource::sensor;
  double filter_pole = 0.0;    ///< exp(-Ts/T) of the drive's filter, 0: none.
  std::size_t hold = 1;        ///< Samples over which a value stays.
  double position_gain = 0.0;  ///< Position loop of a cascade: its position is neither filtered nor held.
};
[[nodiscard]] VelocityPath velocity_path(const MeasurementConfig& config, double sample_rate_hz,
                                         double position_gain) noexcept;

/// What a drive makes of the velocity that it reads: filtered, then held.
class VelocityFilter {
 public:
  explicit VelocityFilter(const VelocityPath& path) noexcept
      : pole_(path.filter_pole), hold_(path.hold), passes_(path.filter_pole == 0.0 && path.hold <= 1) {}
  void settle(double velocity) noexcept {
    filtered_ = kept_ = velocity;
    age_ = 0;
  }
  double step(double velocity) noexcept {
    if (passes_) return velocity;
    filtered_ = pole_ * filtered_ + (1.0 - pole_) * velocity;
    if (age_ == 0) kept_ = filtered_;
    age_ = age_ + 1 >= hold_ ? 0 : age_ + 1;
    return kept_;
  }

 private:
  double pole_;
  std::size_t hold_;
  bool passes_;
  double filtered_ = 0.0;
  double kept_ = 0.0;
  std::size_t age_ = 0;  // samples since the value was renewed
};

}  // namespace resonid::plant
