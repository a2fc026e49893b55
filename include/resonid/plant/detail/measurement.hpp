// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/constants.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
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

}  // namespace resonid::plant
