// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <resonid/plant/detail/controller.hpp>
#include <utility>

namespace resonid::plant {
namespace {

using Polynomial = std::vector<double>;

double sum(const Polynomial& x) { return std::accumulate(x.begin(), x.end(), 0.0); }

/// The polynomial at z = 1, its rounding taken out where it has a root there.
double gain_at_rest(const Polynomial& x) {
  double magnitude = 0.0;
  for (const double value : x) magnitude += std::abs(value);
  const double gain = sum(x);
  return std::abs(gain) < 1e-9 * magnitude ? 0.0 : gain;
}

Polynomial product(const Polynomial& a, const Polynomial& b) {
  Polynomial c(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) c[i + j] += a[i] * b[j];
  return c;
}

/// Backward Euler: gain ((1 - q)(1 - p q) + Ts/Ti (1 - p q) + Td/(Tf+Ts) (1 - q)^2) / ((1 - q)(1 - p q)),
/// q = z^-1, p = Tf/(Tf+Ts).
data::TransferFunction pid_controller(const ControllerConfig& c, double step_s) {
  const double width = c.derivative_filter_s + step_s;
  const double pole = c.derivative_filter_s / width;
  const double integral = step_s / c.integral_time_s;
  const double derivative = c.derivative_time_s / width;
  return {{c.gain * (1.0 + integral + derivative),
           -c.gain * (1.0 + pole + integral * pole + 2.0 * derivative), c.gain * (pole + derivative)},
          {1.0, -1.0 - pole, pole},
          step_s};
}

/// C of the kinds that act on v* - y.
data::TransferFunction error_law(const ControllerConfig& c, double step_s) {
  switch (c.kind) {
    case ControllerKind::pid:
      return pid_controller(c, step_s);
    case ControllerKind::pi:
    case ControllerKind::cascade:
      return data::pi_controller(c.gain, c.integral_time_s, step_s);
    case ControllerKind::transfer_function:
      return {c.numerator, c.denominator, step_s};
    case ControllerKind::p:
    case ControllerKind::none:
    case ControllerKind::rst:
      break;
  }
  return {{c.gain}, {1.0}, step_s};
}

bool has_good_size(const Polynomial& x) { return !x.empty() && x.size() <= Controller::kMaxOrder + 1; }
bool is_finite(const Polynomial& x) {
  return std::all_of(x.begin(), x.end(), [](double value) { return std::isfinite(value); });
}
bool is_positive(double x) { return x > 0.0 && std::isfinite(x); }
bool is_not_negative(double x) { return x >= 0.0 && std::isfinite(x); }

/// No root outside the unit circle; on it they are where a double one can be computed to 1e-7.
bool is_stable(const Polynomial& denominator) {
  constexpr double kOnCircle = 1e-6;
  Polynomial monic = denominator;
  for (double& value : monic) value /= denominator[0];
  if (!is_finite(monic)) return false;
  const auto poles = data::TransferFunction{{1.0}, monic, 1.0}.poles();
  return std::all_of(poles.begin(), poles.end(), [](auto pole) { return std::abs(pole) <= 1.0 + kOnCircle; });
}

expected<void, Error> check_numerator(std::string_view field, const Polynomial& x) {
  if (!has_good_size(x)) return refuse(field, "must hold 1 ... 17 coefficients");
  if (!is_finite(x)) return refuse(field, "must be finite");
  return {};
}

expected<void, Error> check_denominator(std::string_view field, const Polynomial& x) {
  if (const auto ok = check_numerator(field, x); !ok) return ok;
  if (x[0] == 0.0) return refuse(field, "must not begin with 0", 0.0);
  if (!is_stable(x)) return refuse(field, "must not have a root outside the unit circle");
  return {};
}

expected<void, Error> check_pid(const ControllerConfig& c) {
  if (!is_positive(c.gain)) return refuse("gain", "must be > 0", c.gain);
  if (c.kind != ControllerKind::p && !is_positive(c.integral_time_s))
    return refuse("integral_time_s", "must be > 0", c.integral_time_s);
  if (c.kind == ControllerKind::pid && !is_not_negative(c.derivative_time_s))
    return refuse("derivative_time_s", "must be >= 0", c.derivative_time_s);
  if (c.kind == ControllerKind::pid && !is_not_negative(c.derivative_filter_s))
    return refuse("derivative_filter_s", "must be >= 0", c.derivative_filter_s);
  if (c.kind != ControllerKind::cascade) return {};
  if (!is_positive(c.position_gain)) return refuse("position_gain", "must be > 0", c.position_gain);
  if (!(c.velocity_feedforward >= 0.0 && c.velocity_feedforward <= 1.0))
    return refuse("velocity_feedforward", "must be 0 ... 1", c.velocity_feedforward);
  if (!is_not_negative(c.acceleration_feedforward))
    return refuse("acceleration_feedforward", "must be >= 0", c.acceleration_feedforward);
  if (!is_not_negative(c.viscous_feedforward))
    return refuse("viscous_feedforward", "must be >= 0", c.viscous_feedforward);
  if (!is_not_negative(c.coulomb_feedforward))
    return refuse("coulomb_feedforward", "must be >= 0", c.coulomb_feedforward);
  if (!is_not_negative(c.reference_delay_s))
    return refuse("reference_delay_s", "must be >= 0", c.reference_delay_s);
  return {};
}

expected<void, Error> check_law(const ControllerConfig& c) {
  switch (c.kind) {
    case ControllerKind::none:
      return {};
    case ControllerKind::rst:
      if (const auto ok = check_denominator("r", c.r); !ok) return ok;
      if (const auto ok = check_numerator("s", c.s); !ok) return ok;
      return check_numerator("t", c.t);
    case ControllerKind::transfer_function:
      if (const auto ok = check_numerator("numerator", c.numerator); !ok) return ok;
      return check_denominator("denominator", c.denominator);
    case ControllerKind::p:
    case ControllerKind::pi:
    case ControllerKind::pid:
    case ControllerKind::cascade:
      break;
  }
  return check_pid(c);
}

}  // namespace

expected<void, Error> check(const ControllerConfig& c) {
  if (const auto ok = check_law(c); !ok) return ok;
  if (!is_not_negative(c.velocity_limit)) return refuse("velocity_limit", "must be >= 0", c.velocity_limit);
  if (!is_not_negative(c.torque_limit)) return refuse("torque_limit", "must be >= 0", c.torque_limit);
  return {};
}

expected<Controller, Error> Controller::create(const ControllerConfig& config, double sample_rate_hz) {
  if (const auto ok = check(config); !ok) return unexpected(ok.error());
  if (!is_positive(sample_rate_hz)) return refuse("sample_rate_hz", "must be > 0", sample_rate_hz);
  Controller controller(config, 1.0 / sample_rate_hz);
  if (const auto ok = controller.make_filters(); !ok) return unexpected(ok.error());
  return controller;
}

expected<void, Error> Controller::make_filters() {
  if (!closed()) return {};
  const bool rst = config_.kind == ControllerKind::rst;
  const auto law = rst ? data::TransferFunction{{1.0}, config_.r, step_s_} : error_law(config_, step_s_);
  const auto filter = Filter::create(law.numerator, law.denominator);
  if (!filter) return unexpected(filter.error());
  law_ = *filter;
  torque_gain_ = gain_at_rest(law.denominator);
  reference_gain_ = velocity_gain_ = gain_at_rest(law.numerator);
  if (!rst) return {};
  const auto from_reference = Filter::create(config_.t, Polynomial{1.0});
  const auto from_velocity = Filter::create(config_.s, Polynomial{1.0});
  if (!from_reference) return unexpected(from_reference.error());
  if (!from_velocity) return unexpected(from_velocity.error());
  reference_ = *from_reference;
  feedback_ = *from_velocity;
  reference_gain_ = gain_at_rest(config_.t);
  velocity_gain_ = gain_at_rest(config_.s);
  return {};
}

double Controller::limited_velocity(double velocity) const noexcept {
  return config_.velocity_limit > 0.0 ? std::clamp(velocity, -config_.velocity_limit, config_.velocity_limit)
                                      : velocity;
}

double Controller::velocity_reference(const Setpoint& setpoint, const Measured& measured) const noexcept {
  if (!uses_position()) return limited_velocity(setpoint.velocity);
  return limited_velocity(config_.position_gain * (setpoint.position - measured.position) +
                          config_.velocity_feedforward * setpoint.velocity);
}

double Controller::command(const Setpoint& setpoint, const Measured& measured) noexcept {
  reference_velocity_ = velocity_reference(setpoint, measured);
  measured_velocity_ = measured.velocity;
  input_ = config_.kind == ControllerKind::rst
               ? reference_.output(reference_velocity_) - feedback_.output(measured_velocity_)
               : reference_velocity_ - measured_velocity_;
  return law_.output(input_);
}

double Controller::torque_feedforward(const Setpoint& setpoint) const noexcept {
  if (!uses_position()) return 0.0;
  const double v = setpoint.velocity;
  const double direction = v > 0.0 ? 1.0 : v < 0.0 ? -1.0 : 0.0;
  return config_.acceleration_feedforward * setpoint.acceleration + config_.viscous_feedforward * v +
         config_.coulomb_feedforward * direction;
}

double Controller::limit(double torque) const noexcept {
  return config_.torque_limit > 0.0 ? std::clamp(torque, -config_.torque_limit, config_.torque_limit)
                                    : torque;
}

void Controller::commit(double applied) noexcept {
  law_.commit(input_, applied);
  if (config_.kind != ControllerKind::rst) return;
  reference_.step(reference_velocity_);
  feedback_.step(measured_velocity_);
}

void Controller::settle(const Setpoint& setpoint, const Measured& measured, double torque) noexcept {
  const double reference = velocity_reference(setpoint, measured);
  if (config_.kind != ControllerKind::rst) return law_.settle(reference - measured.velocity, torque);
  reference_.settle(reference, 0.0);  // without poles the output does not matter
  feedback_.settle(measured.velocity, 0.0);
  law_.settle(reference_gain_ * reference - velocity_gain_ * measured.velocity, torque);
}

double Controller::imbalance(double reference_velocity, double velocity, double torque) const noexcept {
  if (!closed()) return 0.0;
  return reference_gain_ * limited_velocity(reference_velocity) - velocity_gain_ * velocity -
         torque_gain_ * torque;
}

double Controller::following_error(double velocity) const noexcept {
  if (!uses_position()) return 0.0;
  return (1.0 - config_.velocity_feedforward) * velocity / config_.position_gain;
}

std::optional<data::TransferFunction> Controller::velocity_feedback() const {
  if (!closed()) return std::nullopt;
  if (config_.kind == ControllerKind::rst) return data::TransferFunction{config_.s, config_.r, step_s_};
  return error_law(config_, step_s_);
}

/// With the filter F = (1-p)/(1 - p q): C (1 + position_gain Ts/(1-q)/F).
std::optional<data::TransferFunction> Controller::feedback(double filter_pole) const {
  const auto law = velocity_feedback();
  if (!law || !uses_position()) return law;
  const double gain = config_.position_gain * step_s_ / (1.0 - filter_pole);
  return data::TransferFunction{product(law->numerator, {1.0 + gain, -1.0 - gain * filter_pole}),
                                product(law->denominator, {1.0, -1.0}), step_s_};
}

}  // namespace resonid::plant
