// SPDX-License-Identifier: MIT
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/polynomial.hpp>
#include <resonid/online/detail/axis_loop.hpp>
#include <resonid/online/models/detail/model_response.hpp>
#include <span>

namespace resonid::online {

expected<AxisController, Error> AxisController::create(std::span<const double> numerator,
                                                       std::span<const double> denominator,
                                                       bool of_position) {
  AxisController c;
  if (numerator.empty() != denominator.empty())
    return refuse("controller_denominator", "numerator and denominator must both be given or both be empty");
  if (numerator.size() > kMost)
    return refuse("controller_numerator", "must not have more than 32 coefficients",
                  static_cast<double>(numerator.size()));
  if (denominator.size() > kMost)
    return refuse("controller_denominator", "must not have more than 32 coefficients",
                  static_cast<double>(denominator.size()));
  if (!denominator.empty() && denominator[0] == 0.0)
    return refuse("controller_denominator", "must not begin with 0", 0.0);
  std::copy(numerator.begin(), numerator.end(), c.numerator.begin());
  std::copy(denominator.begin(), denominator.end(), c.denominator.begin());
  c.numerator_size = numerator.size();
  c.denominator_size = denominator.size();
  c.of_position = of_position;
  return c;
}

std::complex<double> AxisController::response(double frequency_hz, double sample_rate_hz) const noexcept {
  const auto back = std::polar(1.0, -kTwoPi * frequency_hz / sample_rate_hz);
  const auto c = polynomial(std::span(numerator).first(numerator_size), back) /
                 polynomial(std::span(denominator).first(denominator_size), back);
  return of_position ? c / std::complex<double>(0.0, kTwoPi * frequency_hz) : c;
}

namespace detail {
AxisLoopFigures::AxisLoopFigures(const AxisConfig& c) noexcept
    : loop_(c.loop),
      sample_rate_hz_(c.sample_rate_hz),
      delay_s_(c.known_delay_s),
      grid_(c.sample_rate_hz, c.loop_from_hz) {
  const auto controller =
      AxisController::create(c.controller_numerator, c.controller_denominator, c.controller_of_position);
  if (controller) controller_ = *controller;
  set_loop(controller_, loop_, delay_s_);
}

void AxisLoopFigures::set_loop(const AxisController& controller, AxisLoop loop,
                               double known_delay_s) noexcept {
  controller_ = controller;
  delay_s_ = known_delay_s;
  loop_ = loop != AxisLoop::measured && !controller.known() ? AxisLoop::none : loop;
}

AxisLoopFigures::Complex AxisLoopFigures::weight_at(double hz) const noexcept {
  return controller_.known() ? controller_.response(hz, sample_rate_hz_) : Complex(scale_);
}

AxisLoopFigures::Complex AxisLoopFigures::delay_at(double hz) const noexcept {
  return std::polar(1.0, -kTwoPi * hz * delay_s_);
}

AxisLoopFigures::Complex AxisLoopFigures::model_loop_at(double hz) const noexcept {
  return weight_at(hz) * online::response(model_, hz, sample_rate_hz_) * delay_at(hz);
}

void AxisLoopFigures::begin_lines() noexcept {
  line_scan_.reset();
  line_gap_.reset();
}

void AxisLoopFigures::line(double hz, Complex plant, double std, Complex measured,
                           Complex reference) noexcept {
  if (has_gap_) {
    const Complex weight = weight_at(hz);
    line_gap_.step(hz, weight * plant, weight * reference, std::abs(weight) * std);
  }
  if (loop_ == AxisLoop::none) return;
  // The error is that of the lines on either side: L is off by the relative error of Gd.
  const Complex loop = loop_ == AxisLoop::measured ? measured : weight_at(hz) * plant * delay_at(hz);
  line_scan_.step(hz, loop, std / std::abs(plant) * std::abs(loop));
}

void AxisLoopFigures::begin_model(const AxisReading& reading) noexcept {
  model_scan_.reset();
  model_gap_.reset();
  scans_model_ = reading.has_model && scans_model();
  if (!scans_model_) return;
  model_ = reading.model;
  grid_.begin(reading.resonance_hz.value);
}

double AxisLoopFigures::next_hz() const noexcept {
  return scans_model_ && !grid_.done() ? grid_.hz() : AxisRow::kUnknown;
}

void AxisLoopFigures::point(Complex reference) noexcept {
  const double hz = grid_.hz();
  grid_.advance();
  const Complex plant = online::response(model_, hz, sample_rate_hz_);
  const Complex weight = weight_at(hz);
  if (has_gap_) model_gap_.step(hz, weight * plant, weight * reference);
  if (loop_ == AxisLoop::controller) model_scan_.step(hz, weight * plant * delay_at(hz));
}

void AxisLoopFigures::take_margins(const LoopMargins<double>& m, AxisRow& row) const noexcept {
  row.crossover_hz = {m.crossover_hz, m.crossover_std_hz};
  row.phase_margin_deg = {m.phase_margin_deg, m.phase_margin_std_deg};
  row.modulus_margin = {m.modulus_margin, m.modulus_margin_std};
  row.worst_phase_margin_deg = m.worst_phase_margin_deg;
  row.modulus_margin_hz = m.modulus_margin_hz;
  row.gain_margin_db = m.gain_margin_db;
  row.gain_margin_hz = m.gain_margin_hz;
}

void AxisLoopFigures::conclude(const AxisReading& reading, AxisRow& row) const noexcept {
  const bool of_model = scans_model_ && loop_ == AxisLoop::controller;
  if (loop_ != AxisLoop::none) take_margins(of_model ? model_scan_.margins() : line_scan_.margins(), row);
  if (has_gap_ && !scans_model_) row.gap = {line_gap_.gap(), line_gap_.gap_std()};
  if (has_gap_ && scans_model_) row.gap.value = model_gap_.gap();
  if (scans_model_ && reading.covariance_known()) take_model_deviations(reading, row);
}

void AxisLoopFigures::take_model_deviations(const AxisReading& reading, AxisRow& row) const noexcept {
  const auto covariance = reading.covariance();
  const auto error_at = [&](double hz) { return relative_error(model_, covariance, hz, sample_rate_hz_); };
  if (loop_ == AxisLoop::controller) {
    const MarginStds std =
        margin_stds(model_scan_.margins(), error_at, [this](double hz) { return model_loop_at(hz); });
    row.crossover_hz.std = std.crossover_hz;
    row.phase_margin_deg.std = std.phase_margin_deg;
    row.modulus_margin.std = std.modulus_margin;
  }
  if (has_gap_ && model_gap_.gap_hz() > 0.0)
    row.gap.std = gap_std(model_gap_.value(), model_gap_.reference(), error_at(model_gap_.gap_hz()));
}

}  // namespace detail
}  // namespace resonid::online
