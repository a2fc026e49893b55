// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/axis_config.hpp>
#include <resonid/online/axis_result.hpp>
#include <resonid/online/detail/axis_lines.hpp>
#include <resonid/online/detail/axis_loop.hpp>
#include <resonid/online/detail/axis_reading.hpp>
#include <resonid/online/lines/sweep_response.hpp>
#include <string_view>

namespace resonid::online::detail {

/// The response along a sweep (SweepResponse): the value at the frequency that the chirp passed, free of the
/// sweep's own error, the curve so far, and the model of third order that fits it.
template <class Real, std::size_t MaxPoints>
class AxisSweepLine {
 public:
  using Scalar = Real;
  using Complex = std::complex<double>;
  static constexpr bool kTakesVelocity = false;

  static bool serves(const AxisConfig& c) noexcept { return c.method == AxisMethod::chirp; }
  static expected<void, Error> create_in(void* where, const AxisConfig& c) noexcept {
    SweepResponseConfig config;
    ChirpTrackerConfig& t = config.chirp;
    t.sample_rate_hz = c.sample_rate_hz;
    t.from_hz = c.sweep.from_hz;
    t.to_hz = c.sweep.to_hz;
    t.duration_s = c.sweep.duration_s;
    t.sweep = c.sweep.sweep;
    t.offset = c.signal_offset;
    if (c.lambda) {
      t.lambda = *c.lambda;
    } else {
      t.gain = GainRule::placed_poles;
      if (c.memory_s > 0.0) t.pole_radius = std::exp(-1.0 / (c.memory_s * c.sample_rate_hz));
      t.pole_radius = c.pole_radius.value_or(t.pole_radius);
    }
    config.known_delay_s = c.known_delay_s;
    config.quantity = c.output == AxisOutput::position       ? SweepQuantity::position
                      : c.output == AxisOutput::acceleration ? SweepQuantity::acceleration
                                                             : SweepQuantity::velocity;
    const auto line = SweepResponse<Real>::create(config);
    if (!line) return unexpected<Error>(line.error());
    ::new (where) AxisSweepLine(*line, c);
    return {};
  }

  void step(Real ru, Real u, Real y) noexcept {
    line_.step(ru, u, y);
    if (line_.settled()) remember();
  }
  void miss(std::uint64_t count) noexcept { line_.miss(count); }
  void reset() noexcept {
    line_.reset();
    shown_ = {};
    points_ = 0;
  }
  [[nodiscard]] Real residual() const noexcept { return std::numeric_limits<Real>::quiet_NaN(); }
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return line_.skipped_samples(); }

  [[nodiscard]] std::size_t lines() const noexcept { return 1; }
  [[nodiscard]] AxisLine line(std::size_t) const noexcept { return shown_; }
  /// The curve so far.
  [[nodiscard]] std::size_t units() const noexcept { return points_; }
  template <class Baseline>
  void read_line(std::size_t i, bool settled, AxisLoopFigures& loop, const Baseline& baseline) noexcept {
    if (i == 0) loop.begin_lines();
    const Point& p = point_[ascending(i)];
    if (settled && loop.wanted()) loop.line(p.hz, p.response, p.std, AxisRow::kUnknown, baseline.at(p.hz));
  }

  void read(AxisReading& r, const AxisCriteria& criteria) noexcept {
    r.ready = line_.settled();
    r.lag_samples = line_.lag_samples();
    shown_ = now();
    r.finds_resonance = false;
    r.uncertainty = shown_.std / std::abs(shown_.response);
    r.most_uncertainty = criteria.line_std;
    if (!line_.ready()) return;
    const auto model = line_.model();
    for (std::size_t i = 0; i < 3; ++i) {
      r.model.b[i] = static_cast<double>(model.b[i]);
      r.model.a[i] = static_cast<double>(model.a[i]);
    }
    r.set_covariance(line_.covariance().template cast<double>());
    find_modes(r, 3, sample_rate_hz_);
    r.has_model = r.physical;
    r.physical = true;  // the line itself is
    const auto take = [](const DiscreteMode& mode, Figure& hz, double& damping) {
      const bool there = mode.frequency_hz > 0.0;
      hz = there ? Figure{mode.frequency_hz, mode.std_hz} : Figure{};
      damping = there ? mode.damping_ratio : AxisRow::kUnknown;
    };
    take(line_.resonance(), r.resonance_hz, r.resonance_damping);
    take(line_.antiresonance(), r.antiresonance_hz, r.antiresonance_damping);
  }
  void watch(AxisStability&) const noexcept {}
  [[nodiscard]] std::string_view parameter_name(std::size_t) const noexcept { return {}; }
  [[nodiscard]] bool white_residual() const noexcept { return false; }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return line_.intact() && resonid::intact(output_, AxisOutput::acceleration) &&
           resonid::intact(shown_.settled) && points_ <= MaxPoints;
  }

 private:
  struct Point {
    double hz = 0.0, std = AxisRow::kUnknown;
    Complex response;
  };

  AxisSweepLine(const SweepResponse<Real>& line, const AxisConfig& c) noexcept
      : line_(line), law_(c.sweep), output_(c.output), sample_rate_hz_(c.sample_rate_hz) {}

  [[nodiscard]] AxisLine now() const noexcept {
    AxisLine line{
        line_.described_hz(), {AxisRow::kUnknown, AxisRow::kUnknown}, AxisRow::kUnknown, line_.settled()};
    if (!line.settled) return line;
    const Complex factor = axis_velocity_factor(output_, line.frequency_hz, sample_rate_hz_);
    line.response = Complex(line_.response()) * factor;
    line.std = static_cast<double>(line_.standard_deviation()) * std::abs(factor);
    return line;
  }
  /// One point for every part of the sweep.
  void remember() noexcept {
    const double width = std::abs(law_.to_hz - law_.from_hz) / static_cast<double>(MaxPoints - 1);
    if (points_ == MaxPoints) return;
    if (points_ > 0) {
      const double hz = line_.described_hz(), last = point_[points_ - 1].hz;
      if ((law_.to_hz > law_.from_hz ? hz - last : last - hz) < width) return;
    }
    const AxisLine line = now();
    if (!std::isfinite(line.response.real()) || !std::isfinite(line.response.imag())) return;
    point_[points_++] = {line.frequency_hz, line.std, line.response};
  }
  [[nodiscard]] std::size_t ascending(std::size_t i) const noexcept {
    return law_.to_hz > law_.from_hz ? i : points_ - 1 - i;
  }

  SweepResponse<Real> line_;
  SweepLaw law_;
  AxisOutput output_;
  double sample_rate_hz_;
  AxisLine shown_{};                      // at the newest row
  std::array<Point, MaxPoints> point_{};  // in the order of time
  std::size_t points_ = 0;
};

}  // namespace resonid::online::detail
