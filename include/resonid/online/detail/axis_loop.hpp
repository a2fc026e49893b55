// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <complex>
#include <cstddef>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/detail/polynomial.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/axis_config.hpp>
#include <resonid/online/axis_result.hpp>
#include <resonid/online/detail/axis_reading.hpp>
#include <resonid/online/supervision/detail/loop_errors.hpp>
#include <resonid/online/supervision/detail/loop_grid.hpp>
#include <resonid/online/supervision/loop_margins.hpp>
#include <span>

namespace resonid::online::detail {

/// What the gap is to: a model, or a response that is interpolated (linear in real and imaginary part).
template <std::size_t MaxPoints>
class AxisBaseline {
 public:
  using Complex = std::complex<double>;
  static constexpr std::size_t kMaxOrder = 7;

  static expected<AxisBaseline, Error> create(const AxisConfig& c) noexcept {
    AxisBaseline b;
    b.sample_rate_hz_ = c.sample_rate_hz;
    if (c.baseline_a.size() != c.baseline_b.size() || c.baseline_a.size() > kMaxOrder)
      return refuse("baseline_a", "must be as many as baseline_b, up to 7",
                    static_cast<double>(c.baseline_a.size()));
    if (c.baseline_hz.size() != c.baseline_response.size())
      return refuse("baseline_response", "must be as many as baseline_hz",
                    static_cast<double>(c.baseline_response.size()));
    if (c.baseline_hz.size() > MaxPoints)
      return refuse("baseline_hz", "has more lines than this axis was built for",
                    static_cast<double>(c.baseline_hz.size()));
    for (std::size_t i = 1; i < c.baseline_hz.size(); ++i)
      if (!(c.baseline_hz[i] > c.baseline_hz[i - 1]))
        return refuse("baseline_hz", "must ascend", c.baseline_hz[i]);
    b.order_ = c.baseline_a.size();
    std::copy(c.baseline_b.begin(), c.baseline_b.end(), b.b_.begin());
    std::copy(c.baseline_a.begin(), c.baseline_a.end(), b.a_.begin());
    b.points_ = c.baseline_hz.size();
    std::copy(c.baseline_hz.begin(), c.baseline_hz.end(), b.hz_.begin());
    std::copy(c.baseline_response.begin(), c.baseline_response.end(), b.value_.begin());
    return b;
  }

  [[nodiscard]] bool known() const noexcept { return order_ > 0 || points_ > 0; }
  /// Not a number outside the band in which it was measured, model or not.
  [[nodiscard]] Complex at(double hz) const noexcept {
    constexpr double kRounding = 1e-9;
    if (!known() ||
        (points_ > 0 && (hz < hz_[0] * (1.0 - kRounding) || hz > hz_[points_ - 1] * (1.0 + kRounding))))
      return AxisRow::kUnknown;
    return order_ > 0 ? model_at(hz) : interpolated(hz);
  }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return order_ <= kMaxOrder && points_ <= MaxPoints; }

 private:
  [[nodiscard]] Complex model_at(double hz) const noexcept {
    const Complex back = std::polar(1.0, -kTwoPi * hz / sample_rate_hz_);
    const auto sum = [&](const auto& c) { return polynomial(std::span(c).first(order_), back) * back; };
    return sum(b_) / (1.0 + sum(a_));
  }
  [[nodiscard]] Complex interpolated(double hz) const noexcept {
    const auto begin = hz_.begin(), end = begin + static_cast<std::ptrdiff_t>(points_);
    const auto above = static_cast<std::size_t>(std::upper_bound(begin, end, hz) - begin);
    if (above == 0) return value_[0];
    if (above == points_) return value_[points_ - 1];
    const double part = (hz - hz_[above - 1]) / (hz_[above] - hz_[above - 1]);
    return value_[above - 1] + part * (value_[above] - value_[above - 1]);
  }

  double sample_rate_hz_ = 0.0;
  std::size_t order_ = 0, points_ = 0;
  std::array<double, kMaxOrder> b_{}, a_{};
  std::array<double, MaxPoints + 1> hz_{};  // one more: MaxPoints may be 0
  std::array<Complex, MaxPoints + 1> value_{};
};

/// What the plant's response of one instant means for the loop, and how far it is from the baseline's, point
/// by point: the work of a point is bounded.
///
/// L = C G e^{-jwTd} with the controller told and the known delay, or L as measured at the lines; margins as
/// docs/methods/margins.md has them. Gap: the largest chordal distance over frequency between W G and W G0,
/// W = C where it is known, else 1 over the baseline's median gain (docs/methods/gap.md: the distance needs a
/// scale). It is pointwise: no winding numbers. A model is looked at where LoopGrid says.
class AxisLoopFigures {
 public:
  using Complex = std::complex<double>;

  AxisLoopFigures() = default;
  explicit AxisLoopFigures(const AxisConfig& config) noexcept;
  template <class Baseline>
  void scale_by(const Baseline& baseline) noexcept {  // with it, gaps are found
    std::array<double, LoopGrid::kEven> gain{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < LoopGrid::kEven; ++i)
      if (const double g = std::abs(baseline.at(grid_.even_hz(i))); std::isfinite(g)) gain[count++] = g;
    has_gap_ = true;
    if (count == 0) return;
    scale_ = 1.0 / median_in_place(std::span(gain).first(count));
  }

  [[nodiscard]] bool wanted() const noexcept { return has_gap_ || loop_ != AxisLoop::none; }
  [[nodiscard]] AxisLoop loop() const noexcept { return loop_; }
  void set_loop(const AxisController& controller, AxisLoop loop, double known_delay_s) noexcept;

  /// The lines of an estimator that has some, in ascending order.
  void begin_lines() noexcept;
  /// `plant`: without delay, total standard deviation `std`; `loop`: as measured.
  void line(double hz, Complex plant, double std, Complex loop, Complex reference) noexcept;
  /// The model of a reading, at next_hz() again and again until that is not a number.
  void begin_model(const AxisReading& reading) noexcept;
  [[nodiscard]] bool scans_model() const noexcept { return has_gap_ || loop_ == AxisLoop::controller; }
  [[nodiscard]] double next_hz() const noexcept;
  void point(Complex reference) noexcept;
  static constexpr std::size_t kMostPoints = LoopGrid::kMost;

  /// What the model shows, or where there is none what the lines show.
  void conclude(const AxisReading& reading, AxisRow& row) const noexcept;
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return intact_flags(controller_.of_position, has_gap_, scans_model_) &&
           controller_.numerator_size <= AxisController::kMost &&
           controller_.denominator_size <= AxisController::kMost &&
           resonid::intact(loop_, AxisLoop::measured) && line_scan_.intact() && model_scan_.intact() &&
           grid_.intact();
  }

 private:
  [[nodiscard]] Complex delay_at(double hz) const noexcept;
  [[nodiscard]] Complex weight_at(double hz) const noexcept;
  [[nodiscard]] Complex model_loop_at(double hz) const noexcept;
  void take_margins(const LoopMargins<double>& m, AxisRow& row) const noexcept;
  void take_model_deviations(const AxisReading& reading, AxisRow& row) const noexcept;

  AxisController controller_;
  AxisLoop loop_ = AxisLoop::none;
  bool has_gap_ = false;
  double sample_rate_hz_ = 0.0, delay_s_ = 0.0;
  double scale_ = 1.0;
  // of the row in work
  MarginScan<double> line_scan_, model_scan_;
  GapScan line_gap_, model_gap_;
  AxisReading::Model model_;
  LoopGrid grid_;
  bool scans_model_ = false;
};

}  // namespace resonid::online::detail
