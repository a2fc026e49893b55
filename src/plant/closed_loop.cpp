// SPDX-License-Identifier: MIT
#include <cmath>
#include <numeric>
#include <resonid/plant/closed_loop.hpp>

namespace resonid::plant {
namespace {

double sum(const std::vector<double>& x) { return std::accumulate(x.begin(), x.end(), 0.0); }

bool integrates(const data::TransferFunction& controller) {
  double magnitude = 0.0;
  for (const double a : controller.denominator) magnitude += std::abs(a);
  return std::abs(sum(controller.denominator)) < 1e-9 * magnitude;
}

}  // namespace

SampleDelay split_delay(double delay_s, double sample_rate_hz) noexcept {
  constexpr double kWhole = 1e-9;
  const double samples = delay_s * sample_rate_hz;
  const double whole = std::floor(samples + kWhole);
  const double fraction = samples - whole;
  return {static_cast<std::size_t>(whole), fraction > kWhole ? fraction : 0.0};
}

expected<ClosedLoop, ConfigError> ClosedLoop::create(std::unique_ptr<Drive> drive,
                                                     const std::optional<data::TransferFunction>& controller,
                                                     SampleDelay delay, double reference) {
  ClosedLoop loop;
  loop.reference_ = reference;
  double velocity = reference;
  if (controller) {
    auto filter = Controller::create(controller->numerator, controller->denominator);
    if (!filter) return unexpected(filter.error());
    if (!integrates(*controller)) {  // gain (r - v) = friction v
      const double gain = sum(controller->numerator) / sum(controller->denominator);
      const double friction = drive->settle(1.0);
      if (gain + friction != 0.0) velocity = gain * reference / (gain + friction);
    }
    loop.controller_ = *filter;
  }
  const double torque = drive->settle(velocity);
  if (loop.controller_)
    loop.controller_->settle(reference - velocity, torque);
  else
    loop.holding_torque_ = torque;
  loop.drive_ = std::move(drive);
  loop.delay_line_.assign(delay.whole + 1, velocity);
  return loop;
}

ClosedLoop::Sample ClosedLoop::step(double excitation, double noise) noexcept {
  Sample s{};
  s.output = delay_line_[next_] + noise;
  s.input = (controller_ ? controller_->step(reference_ - s.output) : holding_torque_) + excitation;
  delay_line_[next_] = drive_->advance(s.input);
  next_ = next_ + 1 == delay_line_.size() ? 0 : next_ + 1;
  return s;
}

}  // namespace resonid::plant
