// SPDX-License-Identifier: MIT
#include <array>
#include <resonid/plant/detail/measurement.hpp>

namespace resonid::plant {

expected<void, Error> check(const MeasurementConfig& c) noexcept {
  if (!(c.delay_s >= 0.0)) return refuse("delay_s", "must be >= 0", c.delay_s);
  if (!(c.noise_rms >= 0.0)) return refuse("noise_rms", "must be >= 0", c.noise_rms);
  if (!(c.noise_bandwidth_hz >= 0.0))
    return refuse("noise_bandwidth_hz", "must be >= 0", c.noise_bandwidth_hz);
  if (!(c.encoder_counts >= 0.0)) return refuse("encoder_counts", "must be >= 0", c.encoder_counts);
  if (!(c.filter_s >= 0.0)) return refuse("filter_s", "must be >= 0", c.filter_s);
  if (!(c.hold_samples >= 1 && c.hold_samples <= 64))
    return refuse("hold_samples", "must be 1 ... 64", static_cast<double>(c.hold_samples));
  if (!(c.second_noise >= 0.0)) return refuse("second_noise", "must be >= 0", c.second_noise);
  return {};
}

VelocityPath velocity_path(const MeasurementConfig& config, double sample_rate_hz,
                           double position_gain) noexcept {
  const double pole = config.filter_s > 0.0 ? std::exp(-1.0 / (config.filter_s * sample_rate_hz)) : 0.0;
  return {config.velocity, pole, static_cast<std::size_t>(config.hold_samples), position_gain};
}

double encoder_velocity_noise(double counts_per_turn, double sample_time_s) noexcept {
  return kTwoPi / counts_per_turn / (std::sqrt(6.0) * sample_time_s);
}

SampleDelay split_delay(double delay_s, double sample_rate_hz) noexcept {
  constexpr double kWhole = 1e-9;
  const double samples = delay_s * sample_rate_hz;
  const double whole = std::floor(samples + kWhole);
  const double fraction = samples - whole;
  return {static_cast<std::size_t>(whole), fraction > kWhole ? fraction : 0.0};
}

MeasurementNoise::MeasurementNoise(const MeasurementConfig& config, double sample_rate_hz,
                                   std::uint64_t seed) noexcept
    : silent_(config.noise_rms == 0.0),
      memory_(config.noise_bandwidth_hz > 0.0 ? std::exp(-kTwoPi * config.noise_bandwidth_hz / sample_rate_hz)
                                              : 0.0),
      white_(seed, config.noise_rms * std::sqrt(1.0 - memory_ * memory_)) {
  // The first value must have the full deviation: that of a long past.
  if (memory_ > 0.0) value_ = WhiteNoise(seed ^ 0x9e3779b97f4a7c15U, config.noise_rms).step();
}

MotionSensor::MotionSensor(SampleDelay delay, VelocitySource source, double count, double sample_time_s)
    : delay_(delay), source_(source), count_(count), rate_hz_(1.0 / sample_time_s), line_(delay.whole + 1) {}

void MotionSensor::settle(const MassMotion& now) noexcept {
  const auto at = [&](double sample) {
    const double late = static_cast<double>(delay_.whole) + delay_.fraction;
    return MassMotion{now.velocity, now.angle + now.velocity * (sample - late) / rate_hz_};
  };
  next_ = 0;
  for (std::size_t i = 0; i < line_.size(); ++i) line_[i] = at(static_cast<double>(i));
  last_position_ = rounded(at(-1.0).angle);
}

}  // namespace resonid::plant
