// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/online/detail/control_config.hpp>

namespace resonid::online {
namespace {

/// 1 % (docs/methods/tune.md 16.4).
constexpr double kLargestFloatError = 0.01;

/// q0 + q1 z^-1 + q2 z^-2 on the unit circle, where the cosine of the angle is c.
struct Quadratic {
  double q0, q1, q2;

  [[nodiscard]] std::complex<double> at(double c) const noexcept {
    const double s = std::sqrt(std::max(0.0, 1.0 - c * c));
    return {q0 + q1 * c + q2 * (2.0 * c * c - 1.0), -s * (q1 + 2.0 * q2 * c)};
  }
  /// Where its absolute value is smallest: |q|^2 = 4 q0 q2 c^2 + 2 q1 (q0 + q2) c + const.
  [[nodiscard]] double cosine_of_least() const noexcept {
    const double square = 4.0 * q0 * q2, linear = q1 * (q0 + q2);
    if (!(square > 0.0)) return linear > 0.0 ? -1.0 : 1.0;
    return std::clamp(-linear / square, -1.0, 1.0);
  }
  [[nodiscard]] Quadratic rounded() const noexcept {
    const auto round = [](double x) { return static_cast<double>(static_cast<float>(x)); };
    return {round(q0), round(q1), round(q2)};
  }
};

bool is_gain(double x) noexcept { return x >= 0.0 && std::isfinite(x); }

}  // namespace

BiquadCoefficients coefficients_of(const Biquad& biquad, double sample_rate_hz) noexcept {
  const double t = std::tan(kPi * biquad.frequency_hz / sample_rate_hz), square = t * t;
  const double upper = 2.0 * biquad.numerator_damping * t, lower = 2.0 * biquad.denominator_damping * t;
  const double first = 1.0 + lower + square, middle = 2.0 * (square - 1.0) / first;
  return {(1.0 + upper + square) / first, middle, (1.0 - upper + square) / first, middle,
          (1.0 - lower + square) / first};
}

double float_error(const BiquadCoefficients& c) noexcept {
  const Quadratic b{c.b0, c.b1, c.b2}, a{1.0, c.a1, c.a2}, rounded_b = b.rounded(), rounded_a = a.rounded();
  constexpr double kDeepest = 1e-3;  // beyond, a notch is as deep as any
  double worst = 0.0;
  for (const double cosine : {1.0, -1.0, a.cosine_of_least(), b.cosine_of_least()}) {
    const auto exact = b.at(cosine) / a.at(cosine), rounded = rounded_b.at(cosine) / rounded_a.at(cosine);
    const double error = std::abs(rounded - exact) / std::max(std::abs(exact), kDeepest);
    if (!(error <= worst)) worst = error;  // not a number is the worst
  }
  return worst;
}

expected<void> check_biquads(std::span<const Biquad> biquads, std::size_t most, double sample_rate_hz,
                             bool in_float) noexcept {
  if (biquads.size() > most)
    return refuse("biquads", "must be no more than there is room for", static_cast<double>(biquads.size()));
  for (const Biquad& biquad : biquads) {
    if (!(biquad.frequency_hz > 0.0 && biquad.frequency_hz < 0.5 * sample_rate_hz))
      return refuse("biquads", "must have frequencies > 0 and below half the sample rate",
                    biquad.frequency_hz);
    if (!is_gain(biquad.numerator_damping))
      return refuse("biquads", "must have numerators with a damping >= 0", biquad.numerator_damping);
    if (!positive(biquad.denominator_damping))
      return refuse("biquads", "must have denominators with a damping > 0", biquad.denominator_damping);
    if (in_float && !(float_error(coefficients_of(biquad, sample_rate_hz)) <= kLargestFloatError))
      return refuse("biquads", "must be computed in double: so far below the sample rate floats lose them",
                    biquad.frequency_hz);
  }
  return {};
}

expected<void> check_nodes(std::span<const GainNode> nodes, std::size_t most) noexcept {
  if (nodes.size() > most)
    return refuse("schedule", "must have no more nodes than there is room for",
                  static_cast<double>(nodes.size()));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!std::isfinite(nodes[i].position) || (i > 0 && !(nodes[i].position > nodes[i - 1].position)))
      return refuse("schedule", "must ascend in position", nodes[i].position);
    if (!is_gain(nodes[i].kp)) return refuse("schedule", "must have a kp >= 0", nodes[i].kp);
    if (!is_gain(nodes[i].ki)) return refuse("schedule", "must have a ki >= 0", nodes[i].ki);
  }
  return {};
}

expected<void> check_gains(double kp, double ki) noexcept {
  if (!is_gain(kp)) return refuse("kp", "must be >= 0", kp);
  if (!is_gain(ki)) return refuse("ki", "must be >= 0", ki);
  return {};
}

expected<void> check(const DriveControlConfig& c, std::size_t most_biquads, std::size_t most_nodes,
                     bool in_float) noexcept {
  if (!positive(c.sample_rate_hz)) return refuse("sample_rate_hz", "must be > 0", c.sample_rate_hz);
  if (const auto gains = check_gains(c.kp, c.ki); !gains) return gains;
  if (!c.schedule.empty() && c.kp != 0.0)
    return refuse("kp", "must be 0 where a schedule gives the gains", c.kp);
  if (!c.schedule.empty() && c.ki != 0.0)
    return refuse("ki", "must be 0 where a schedule gives the gains", c.ki);
  if (!(c.set_point_weight >= 0.0 && c.set_point_weight <= 1.0))
    return refuse("set_point_weight", "must be from 0 to 1", c.set_point_weight);
  if (!(c.torque_limit > 0.0)) return refuse("torque_limit", "must be > 0", c.torque_limit);
  if (!is_gain(c.kv)) return refuse("kv", "must be >= 0", c.kv);
  if (c.kv > 0.0 && c.set_point_weight != 1.0)
    return refuse("set_point_weight", "must be 1 under a position loop, which it would weigh too",
                  c.set_point_weight);
  if (const auto nodes = check_nodes(c.schedule, most_nodes); !nodes) return nodes;
  return check_biquads(c.biquads, most_biquads, c.sample_rate_hz, in_float);
}

}  // namespace resonid::online
