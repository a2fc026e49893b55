// SPDX-License-Identifier: MIT
#include <cmath>
#include <numbers>
#include <resonid/base/constants.hpp>
#include <resonid/online/detail/axis_loop.hpp>
#include <resonid/online/models/detail/model_response.hpp>

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
  std::complex<double> top, bottom;
  for (std::size_t i = numerator_size; i-- > 0;) top = top * back + numerator[i];
  for (std::size_t i = denominator_size; i-- > 0;) bottom = bottom * back + denominator[i];
  const auto c = top / bottom;
  return of_position ? c / std::complex<double>(0.0, kTwoPi * frequency_hz) : c;
}

namespace detail {
namespace {

bool finite(std::complex<double> z) noexcept { return std::isfinite(z.real()) && std::isfinite(z.imag()); }

}  // namespace

AxisLoopFigures::AxisLoopFigures(const AxisConfig& c) noexcept
    : loop_(c.loop), sample_rate_hz_(c.sample_rate_hz), delay_s_(c.known_delay_s) {
  const double nyquist = 0.5 * c.sample_rate_hz;
  const double from = c.loop_from_hz > 0.0 ? std::min(c.loop_from_hz, 0.01 * nyquist) : 0.001 * nyquist;
  from_hz_ = std::max(from, 1e-5 * nyquist);
  to_hz_ = 0.998 * nyquist;
  grid_ratio_ = std::pow(to_hz_ / from_hz_, 1.0 / (kGridPoints - 1));
  near_ratio_ = std::pow(kNearSpan, 2.0 / (kNearPoints - 1));
  const auto controller =
      AxisController::create(c.controller_numerator, c.controller_denominator, c.controller_of_position);
  if (controller) controller_ = *controller;
  if (loop_ == AxisLoop::controller && !controller_.known()) loop_ = AxisLoop::none;
}

void AxisLoopFigures::set_loop(const AxisController& controller, AxisLoop loop,
                               double known_delay_s) noexcept {
  controller_ = controller;
  delay_s_ = known_delay_s;
  loop_ = loop == AxisLoop::controller && !controller.known() ? AxisLoop::none : loop;
}

double AxisLoopFigures::grid_hz(std::size_t i) const noexcept {
  return from_hz_ * std::pow(grid_ratio_, static_cast<double>(i));
}

AxisLoopFigures::Complex AxisLoopFigures::controller_at(double hz) const noexcept {
  return controller_.known() ? controller_.response(hz, sample_rate_hz_) : Complex(scale_);
}

AxisLoopFigures::Complex AxisLoopFigures::delay_at(double hz) const noexcept {
  return std::polar(1.0, -kTwoPi * hz * delay_s_);
}

/// Chordal distance; std to first order along the larger of its two derivatives' directions.
void AxisLoopFigures::Gap::step(double at_hz, Complex weighted, double weighted_std,
                                Complex w_reference) noexcept {
  if (!finite(w_reference) || !finite(weighted)) return;
  const double here = 1.0 + std::norm(weighted), there = 1.0 + std::norm(w_reference);
  const double d = std::abs(weighted - w_reference) / std::sqrt(here * there);
  if (d <= distance) return;
  distance = d;
  hz = at_hz;
  reference = w_reference;
  // k(z, w) on the sphere: its steepest slope by z is sqrt(1 - k^2)/(1 + |z|^2)
  std = std::sqrt(std::max(0.0, 1.0 - d * d)) / here * weighted_std / std::numbers::sqrt2;
}

void AxisLoopFigures::begin_lines() noexcept {
  line_scan_.reset();
  line_gap_ = {};
  last_std_ = phase_margin_std_deg_ = modulus_margin_std_ = 0.0;
}

void AxisLoopFigures::line(double hz, Complex plant, double std, Complex measured,
                           Complex reference) noexcept {
  const double relative = std / std::abs(plant);
  if (has_gap_) {
    const Complex weight = controller_at(hz);
    line_gap_.step(hz, weight * plant, std::abs(weight) * std, weight * reference);
  }
  if (loop_ == AxisLoop::none) return;
  const Complex loop = loop_ == AxisLoop::measured ? measured : controller_at(hz) * plant * delay_at(hz);
  // The error is that of the lines on either side: L is off by the relative error of Gd.
  const double before_hz = line_scan_.margins().modulus_margin_hz;
  const bool first = std::isnan(line_scan_.margins().crossover_hz);
  const double loop_std = relative * std::abs(loop);
  const double larger = std::max(loop_std, last_std_) / std::numbers::sqrt2;  // one of two directions
  if (line_scan_.step(hz, loop) && first) phase_margin_std_deg_ = larger * 180.0 / kPi;
  if (line_scan_.margins().modulus_margin_hz != before_hz) modulus_margin_std_ = larger;
  last_std_ = loop_std;
}

void AxisLoopFigures::begin_model(const AxisReading& reading) noexcept {
  model_scan_.reset();
  model_gap_ = {};
  grid_ = near_ = 0;
  scans_model_ = reading.has_model && scans_model();
  if (!scans_model_) return;
  model_ = reading.model;
  grid_hz_ = from_hz_;
  near_hz_ = reading.resonance_hz.value / kNearSpan;
  if (!(near_hz_ > 0.0)) near_ = kNearPoints;
  for (; near_ < kNearPoints && near_hz_ <= from_hz_; ++near_) near_hz_ *= near_ratio_;
}

double AxisLoopFigures::next_hz() const noexcept {
  if (!scans_model_ || grid_ == kGridPoints) return AxisRow::kUnknown;  // the grid ends last
  return near_ < kNearPoints ? std::min(grid_hz_, near_hz_) : grid_hz_;
}

void AxisLoopFigures::point(Complex reference) noexcept {
  const double hz = next_hz();
  if (near_ < kNearPoints && near_hz_ <= grid_hz_) {
    near_hz_ *= near_ratio_;
    ++near_;
  } else {
    grid_hz_ *= grid_ratio_;
    ++grid_;
  }
  const Complex plant = online::response(model_, hz, sample_rate_hz_);
  const Complex weight = controller_at(hz);
  if (has_gap_) model_gap_.step(hz, weight * plant, AxisRow::kUnknown, weight * reference);
  if (loop_ == AxisLoop::controller) model_scan_.step(hz, weight * plant * delay_at(hz));
}

void AxisLoopFigures::take_margins(const RunningMargins<double>& m, AxisRow& row) const noexcept {
  row.crossover_hz.value = m.crossover_hz;
  row.phase_margin_deg.value = m.phase_margin_deg;
  row.modulus_margin.value = m.modulus_margin;
  row.worst_phase_margin_deg = m.worst_phase_margin_deg;
  row.modulus_margin_hz = m.modulus_margin_hz;
  row.gain_margin_db = m.gain_margin_db;
  row.gain_margin_hz = m.gain_margin_hz;
}

void AxisLoopFigures::conclude(const AxisReading& reading, AxisRow& row) const noexcept {
  if (loop_ == AxisLoop::measured || !scans_model_) {
    if (loop_ != AxisLoop::none) {
      take_margins(line_scan_.margins(), row);
      if (!std::isnan(row.crossover_hz.value)) row.phase_margin_deg.std = phase_margin_std_deg_;
      if (!std::isnan(row.modulus_margin.value)) row.modulus_margin.std = modulus_margin_std_;
    }
  } else if (loop_ == AxisLoop::controller) {
    take_margins(model_scan_.margins(), row);
  }
  const Gap& gap = scans_model_ ? model_gap_ : line_gap_;
  if (has_gap_) row.gap = {gap.distance, gap.std};
  if (scans_model_) model_deviations(reading, row);
}

void AxisLoopFigures::model_deviations(const AxisReading& reading, AxisRow& row) const noexcept {
  static_cast<void>(reading);
  static_cast<void>(row);
}

}  // namespace detail
}  // namespace resonid::online
