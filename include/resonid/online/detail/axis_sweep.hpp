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
#include <resonid/base/expected.hpp>
#include <resonid/online/axis_config.hpp>
#include <resonid/online/axis_result.hpp>
#include <resonid/online/detail/axis_lines.hpp>
#include <resonid/online/detail/axis_loop.hpp>
#include <resonid/online/detail/axis_reading.hpp>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <span>
#include <string_view>

namespace resonid::online::detail {

/// First minimum and first maximum of a response at ascending frequencies, as far as they stand out of their
/// surroundings; not a number where there is none.
struct AxisExtrema {
  double minimum_hz = AxisRow::kUnknown, maximum_hz = AxisRow::kUnknown;
};
[[nodiscard]] AxisExtrema axis_extrema(std::span<const double> frequency_hz, std::span<const double> level_db,
                                       std::span<const double> relative_std) noexcept;

/// The response along a sweep: the value at the frequency that the chirp passed, and the curve so far.
template <class Real, std::size_t MaxPoints>
class AxisSweepLine {
 public:
  using Scalar = Real;
  using Complex = std::complex<double>;
  using Tracker = ChirpTracker<Real>;
  static constexpr bool kTakesVelocity = false;

  static bool serves(const AxisConfig& c) noexcept { return c.method == AxisMethod::chirp; }
  static expected<void, Error> create_in(void* where, const AxisConfig& c) noexcept {
    ChirpTrackerConfig t;
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
    const auto tracker = Tracker::create(t);
    if (!tracker) return unexpected<Error>(tracker.error());
    ResponseTrackerConfig r;
    r.known_delay_s = c.known_delay_s;
    r.controller_numerator = c.controller_numerator;
    r.controller_denominator = c.controller_denominator;
    const auto line = ResponseTracker<Tracker>::create(*tracker, r);
    if (!line) return unexpected<Error>(line.error());
    ::new (where) AxisSweepLine(*line, c);
    return {};
  }

  void step(Real ru, Real u, Real y) noexcept {
    line_.step(ru, u, y);
    if (line_.settled(0)) remember();
  }
  void miss(std::uint64_t count) noexcept { line_.miss(count); }
  void reset() noexcept {
    line_.reset();
    points_ = 0;
    stale_ = false;
    extrema_ = {};
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
    r.ready = line_.settled(0);
    r.finds_resonance = false;
    r.lag_samples = line_.lag_samples(0);
    shown_ = now();
    if (stale_) find_extrema();
    r.antiresonance_hz.value = extrema_.minimum_hz;
    r.resonance_hz.value = extrema_.maximum_hz;
    r.uncertainty = shown_.std / std::abs(shown_.response);
    r.most_uncertainty = criteria.line_std;
  }
  void watch(AxisStability&) const noexcept {}
  [[nodiscard]] std::string_view parameter_name(std::size_t) const noexcept { return {}; }
  [[nodiscard]] bool white_residual() const noexcept { return false; }

 private:
  struct Point {
    double hz = 0.0, std = AxisRow::kUnknown;
    Complex response;
  };

  AxisSweepLine(const ResponseTracker<Tracker>& line, const AxisConfig& c) noexcept
      : line_(line),
        law_(c.sweep),
        approach_(c.approach),
        output_(c.output),
        sample_rate_hz_(c.sample_rate_hz),
        delay_s_(c.known_delay_s) {}

  /// The frequency that the estimate belongs to is that of the time that it describes.
  [[nodiscard]] double described_hz() const noexcept {
    const double newest = static_cast<double>(line_.samples()) - 1.0;
    return law_.frequency_hz(std::max(0.0, newest - line_.lag_samples(0)) / sample_rate_hz_);
  }
  [[nodiscard]] AxisLine now() const noexcept {
    AxisLine line{
        described_hz(), {AxisRow::kUnknown, AxisRow::kUnknown}, AxisRow::kUnknown, line_.settled(0)};
    if (!line.settled) return line;
    const Complex factor = axis_velocity_factor(output_, line.frequency_hz, sample_rate_hz_);
    // The tracker takes the delay out at its newest frequency.
    const double turn = kTwoPi * delay_s_ * (line.frequency_hz - line_.frequency_hz(0));
    line.response = Complex(line_.response(0, approach_)) * std::polar(1.0, turn) * factor;
    line.std = static_cast<double>(line_.standard_deviation(0)) * std::abs(factor);
    return line;
  }
  /// One point for every part of the sweep.
  void remember() noexcept {
    const double width = std::abs(law_.to_hz - law_.from_hz) / static_cast<double>(MaxPoints - 1);
    const double hz = described_hz();
    if (points_ == MaxPoints) return;
    if (points_ > 0) {
      const double past =
          law_.to_hz > law_.from_hz ? hz - point_[points_ - 1].hz : point_[points_ - 1].hz - hz;
      if (past < width) return;
    }
    const AxisLine line = now();
    if (!std::isfinite(line.response.real()) || !std::isfinite(line.response.imag())) return;
    point_[points_++] = {line.frequency_hz, line.std, line.response};
    stale_ = true;
  }
  [[nodiscard]] std::size_t ascending(std::size_t i) const noexcept {
    return law_.to_hz > law_.from_hz ? i : points_ - 1 - i;
  }
  void find_extrema() noexcept {
    std::array<double, MaxPoints> hz, level, relative;
    for (std::size_t i = 0; i < points_; ++i) {
      const Point& p = point_[ascending(i)];
      const double size = std::max(std::abs(p.response), 1e-300);
      hz[i] = p.hz;
      level[i] = 20.0 * std::log10(size);
      relative[i] = p.std / size;
    }
    extrema_ = axis_extrema(std::span(hz).first(points_), std::span(level).first(points_),
                            std::span(relative).first(points_));
    stale_ = false;
  }

  ResponseTracker<Tracker> line_;
  SweepLaw law_;
  Approach approach_;
  AxisOutput output_;
  double sample_rate_hz_, delay_s_;
  AxisLine shown_{};                      // at the newest row
  std::array<Point, MaxPoints> point_{};  // in the order of time
  std::size_t points_ = 0;
  AxisExtrema extrema_{};
  bool stale_ = false;
};

}  // namespace resonid::online::detail
