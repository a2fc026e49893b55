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
#include <resonid/base/detail/statistics.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/axis_config.hpp>
#include <resonid/online/axis_result.hpp>
#include <resonid/online/detail/axis_loop.hpp>
#include <resonid/online/detail/axis_reading.hpp>
#include <resonid/online/detail/line_averages.hpp>
#include <resonid/online/detail/one_of.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <resonid/online/models/detail/response_fit.hpp>
#include <resonid/online/models/recursive_response_fit.hpp>
#include <span>
#include <string_view>

namespace resonid::online::detail {

/// Factor from the response of what is measured to that of the velocity; position: bilinear, acceleration:
/// the sample reflects the torque of the interval before it.
[[nodiscard]] std::complex<double> axis_velocity_factor(AxisOutput output, double frequency_hz,
                                                        double sample_rate_hz) noexcept;

/// What a bank of lines is told (KalmanBankConfig), and the window of a sliding DFT.
template <class Tracker>
struct AxisLineTraits;

template <class Real, std::size_t MaxLines>
struct AxisLineTraits<KalmanBank<Real, MaxLines>> {
  static bool serves(AxisMethod m) noexcept { return m == AxisMethod::lines; }
  /// Poles at a radius that keeps neighbouring lines apart, unless a memory or a gain is told.
  static expected<KalmanBank<Real, MaxLines>, Error> create(const AxisConfig& c) noexcept {
    KalmanBankConfig b;
    b.sample_rate_hz = c.sample_rate_hz;
    b.frequency_hz = c.lines_hz;
    b.offset = c.signal_offset;
    if (c.lambda) {
      b.lambda = *c.lambda;
      return KalmanBank<Real, MaxLines>::create(b);
    }
    double distance_hz = c.signal_offset ? c.lines_hz.front() : c.sample_rate_hz;
    for (std::size_t i = 1; i < c.lines_hz.size(); ++i)
      distance_hz = std::min(distance_hz, c.lines_hz[i] - c.lines_hz[i - 1]);
    b.gain = GainRule::placed_poles;
    b.pole_radius = c.pole_radius.value_or(
        c.memory_s > 0.0 ? std::exp(-1.0 / (c.memory_s * c.sample_rate_hz))
                         : std::clamp(1.0 - 1.5 * distance_hz / c.sample_rate_hz, 0.5, 0.9999));
    return KalmanBank<Real, MaxLines>::create(b);
  }
  /// Samples that a line remembers: with a fixed gain it forgets as (1 - K/2)^k.
  static double memory_samples(const AxisConfig& c) noexcept {
    const double states = static_cast<double>(c.lines_hz.size()) + (c.signal_offset ? 1.0 : 0.0);
    if (c.lambda) return 2.0 * (states + *c.lambda);
    if (c.pole_radius) return -1.0 / std::log(*c.pole_radius);
    return c.memory_s * c.sample_rate_hz;
  }
};

template <class Real, std::size_t MaxLines, std::size_t MaxWindow>
struct AxisLineTraits<SlidingDft<Real, MaxLines, MaxWindow>> {
  static bool serves(AxisMethod m) noexcept { return m == AxisMethod::sliding_dft; }
  static std::size_t window(const AxisConfig& c) noexcept {
    if (c.window_samples > 0) return c.window_samples;
    return static_cast<std::size_t>(std::llround(std::clamp(c.memory_s * c.sample_rate_hz, 0.0, 1e9)));
  }
  static expected<SlidingDft<Real, MaxLines, MaxWindow>, Error> create(const AxisConfig& c) noexcept {
    return SlidingDft<Real, MaxLines, MaxWindow>::create({.sample_rate_hz = c.sample_rate_hz,
                                                          .window_samples = window(c),
                                                          .frequency_hz = c.lines_hz,
                                                          .window = c.window});
  }
  static double memory_samples(const AxisConfig& c) noexcept { return static_cast<double>(window(c)); }
};

/// Trackers of fixed lines on ru, u and y, and the rational model of order 3 that fits the lines of each row:
/// all of them at once where a row is worked out at one sample, else one line at a time in turn.
template <class Tracker>
class AxisFixedLines {
 public:
  using Scalar = typename Tracker::Scalar;
  using Complex = std::complex<double>;
  static constexpr std::size_t kMaxLines = Tracker::kMaxLines;
  static constexpr bool kTakesVelocity = false;

  static bool serves(const AxisConfig& c) noexcept { return AxisLineTraits<Tracker>::serves(c.method); }
  static expected<void, Error> create_in(void* where, const AxisConfig& c) noexcept {
    if (c.lines_hz.empty()) return refuse("lines_hz", "needs at least one line", 0.0);
    if (c.lines_hz.size() > kMaxLines)
      return refuse("lines_hz", "has more lines than this axis was built for",
                    static_cast<double>(c.lines_hz.size()));
    for (std::size_t i = 1; i < c.lines_hz.size(); ++i)
      if (!(c.lines_hz[i] > c.lines_hz[i - 1])) return refuse("lines_hz", "must ascend", c.lines_hz[i]);
    const auto tracker = AxisLineTraits<Tracker>::create(c);
    if (!tracker) return unexpected<Error>(tracker.error());
    std::array<Complex, kMaxLines> controller{};
    ResponseTrackerConfig r;
    if (!c.controller_numerator.empty()) {
      // The indirect response is that of the measured quantity, which the controller sees.
      const auto told = AxisController::create(c.controller_numerator, c.controller_denominator);
      if (!told) return unexpected<Error>(told.error());
      for (std::size_t i = 0; i < c.lines_hz.size(); ++i)
        controller[i] = told->response(c.lines_hz[i], c.sample_rate_hz);
      r.controller_at_line = {controller.data(), c.lines_hz.size()};
    }
    const auto lines = ResponseTracker<Tracker>::create(*tracker, r);
    if (!lines) return unexpected<Error>(lines.error());
    (::new (where) AxisFixedLines(*lines, c))->make_fit(c);
    return {};
  }

  void step(Scalar ru, Scalar u, Scalar y) noexcept { lines_.step(ru, u, y); }
  void miss(std::uint64_t count) noexcept { lines_.miss(count); }
  void reset() noexcept {
    lines_.reset();
    fit_.visit([](auto& fit) { fit.reset(); });
    averages_.reset();
    for (std::size_t i = 0; i < kMaxLines; ++i) now_[i] = {};
    coherence_ = largest_ = 0.0;
  }
  [[nodiscard]] Scalar residual() const noexcept { return std::numeric_limits<Scalar>::quiet_NaN(); }
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return lines_.skipped_samples(); }

  /// How many samples of a steady excitation it takes until what went before no longer shows.
  [[nodiscard]] std::uint64_t settling_samples() const noexcept {
    std::uint64_t longest = 0;
    for (std::size_t i = 0; i < lines_.lines(); ++i)
      longest = std::max<std::uint64_t>(longest, lines_.output().settling_samples(i));
    return longest == kNeverSettles ? longest : longest + (averaged_ ? averages_settling_ : 0);
  }
  /// An excitation that is not at every line all the time: a chirp with sweeps of so many samples, or none.
  void average(bool on, double sweep_samples) noexcept {
    averaged_ = on;
    if (!on) return;
    constexpr double kAveragedMemories = 30.0;  // of the trackers, without a steady line
    constexpr double kNarrower = 3.0;           // their second filter, against the trackers
    const double memory = std::max(
        (told_memories_ > 0.0 ? told_memories_ : kAveragedMemories) * memory_samples_, 3.0 * sweep_samples);
    averages_.configure(memory / row_samples_, kNarrower * memory_samples_ / row_samples_,
                        memory_samples_ / row_samples_);
    averages_settling_ = static_cast<std::uint64_t>(std::max(sweep_samples, 0.3 * memory));
  }

  void average_as_told() noexcept { average(told_memories_ > 0.0, 0.0); }
  void set_known_delay(double delay_s) noexcept { delay_s_ = delay_s; }

  [[nodiscard]] std::size_t lines() const noexcept { return lines_.lines(); }
  [[nodiscard]] std::size_t units() const noexcept { return lines_.lines(); }
  [[nodiscard]] AxisLine line(std::size_t i) const noexcept {
    const Now& n = now_[i];
    AxisLine line{lines_.frequency_hz(i), {}, n.std, lines_.settled(i)};
    line.response = line.settled ? n.response : Complex(AxisRow::kUnknown, AxisRow::kUnknown);
    return line;
  }
  /// Reads one line, and hands it on where the excitation is settled.
  template <class Baseline>
  void read_line(std::size_t i, bool settled, AxisLoopFigures& loop, const Baseline& baseline) noexcept {
    if (i == 0) {
      loop.begin_lines();
      coherence_ = largest_ = 0.0;
    }
    Now& now = now_[i];
    const double hz = lines_.frequency_hz(i);
    Complex measured;
    if (averaged_) {
      averages_.step(i, lines_.excitation().amplitude(i), lines_.input().amplitude(i),
                     lines_.output().amplitude(i));
      measured = averages_.loop(i);
      now.response = averages_.response(i);
      now.std = averages_.standard_deviation(i);
    } else {
      const Complex ru = lines_.excitation().phasor(i), u = lines_.input().phasor(i);
      measured = ru / u - 1.0;
      now.response = lines_.response(i, approach_);
      now.std = static_cast<double>(lines_.standard_deviation(i));
    }
    now.response *= factor_[i] * std::polar(1.0, kTwoPi * hz * delay_s_);
    now.std *= std::abs(factor_[i]);
    largest_ = std::max(largest_, static_cast<double>(std::abs(lines_.output().phasor(i))));
    const double relative = now.std / std::abs(now.response);
    coherence_ += std::isfinite(relative) ? 1.0 / (1.0 + relative * relative) : 0.0;
    if (!settled || !lines_.ready()) return;
    if (auto* turn = fit_.template get_if<FitInTurn>(); turn != nullptr && turn->next_line() == i)
      turn->step(std::complex<Scalar>(now.response));
    if (loop.wanted()) loop.line(hz, now.response, now.std, measured, baseline.at(hz));
  }
  /// Newest amplitude of the velocity at any line: for the guard.
  [[nodiscard]] double largest_amplitude() const noexcept { return largest_; }

  void read(AxisReading& r, const AxisCriteria& criteria) noexcept {
    const std::size_t n = lines_.lines();
    r.ready = lines_.ready();
    r.coherence = r.ready ? coherence_ / static_cast<double>(n) : AxisRow::kUnknown;
    r.first_line_hz = lines_.frequency_hz(0);
    r.last_line_hz = lines_.frequency_hz(n - 1);
    double lag = 0.0;
    for (std::size_t i = 0; i < n; ++i) lag += lines_.lag_samples(i);
    r.lag_samples = lag / static_cast<double>(n);
    if (r.ready) fit(r);
    if (!r.has_model) {
      r.finds_resonance = false;
      r.uncertainty = median_uncertainty();
      r.most_uncertainty = criteria.line_std;
      return;
    }
    r.uncertainty = r.resonance_hz.std / r.resonance_hz.value;
    r.most_uncertainty = criteria.resonance_std;
  }
  void watch(AxisStability&) const noexcept {}
  [[nodiscard]] std::string_view parameter_name(std::size_t) const noexcept { return {}; }
  [[nodiscard]] bool white_residual() const noexcept { return false; }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return lines_.intact() && fit_.holds_one() && fit_.intact() && resonid::intact(averaged_) &&
           resonid::intact(approach_, Approach::joint);
  }

 private:
  using WholeFit = ResponseFit<Scalar, 3, kMaxLines>;
  using FitInTurn = RecursiveResponseFit<Scalar, 3, kMaxLines>;
  /// Too few lines.
  struct NoFit {
    void reset() noexcept {}
  };
  using Fit = OneOf<NoFit, WholeFit, FitInTurn>;
  struct Now {
    Complex response{AxisRow::kUnknown, AxisRow::kUnknown};
    double std = AxisRow::kUnknown;
  };

  AxisFixedLines(const ResponseTracker<Tracker>& lines, const AxisConfig& c) noexcept
      : lines_(lines),
        fit_(NoFit{}),
        approach_(c.approach),
        sample_rate_hz_(c.sample_rate_hz),
        delay_s_(c.known_delay_s),
        memory_samples_(AxisLineTraits<Tracker>::memory_samples(c)),
        told_memories_(c.averaged_memories),
        row_samples_(static_cast<double>(c.row_every_samples)) {
    for (std::size_t i = 0; i < lines_.lines(); ++i)
      factor_[i] = axis_velocity_factor(c.output, lines_.frequency_hz(i), c.sample_rate_hz);
    average_as_told();
  }
  void make_fit(const AxisConfig& c) noexcept {
    if (c.spread_samples > 1) {
      const auto n = static_cast<double>(c.lines_hz.size());
      const auto in_turn = FitInTurn::create({.sample_rate_hz = c.sample_rate_hz,
                                              .frequency_hz = c.lines_hz,
                                              .memory_steps = std::max(4.0 * n, memory_samples_),
                                              .correlated_steps = memory_samples_});
      if (in_turn) fit_ = Fit(*in_turn);
    } else {
      const auto whole = WholeFit::create({.sample_rate_hz = c.sample_rate_hz, .frequency_hz = c.lines_hz});
      if (whole) fit_ = Fit(*whole);
    }
  }
  /// A fit without a resonance, or an unstable one, is none.
  void fit(AxisReading& r) noexcept {
    if (auto* whole = fit_.template get_if<WholeFit>()) {
      bool known = true;
      for (std::size_t i = 0; i < lines_.lines(); ++i) {
        value_[i] = std::complex<Scalar>(now_[i].response);
        std_[i] = static_cast<Scalar>(now_[i].std);
        known = known && std::isfinite(std_[i]);
      }
      const std::size_t n = lines_.lines();
      whole->step(std::span(value_).first(n),
                  known ? std::span<const Scalar>(std_).first(n) : std::span<const Scalar>());
      take(*whole, r);
    } else if (auto* turn = fit_.template get_if<FitInTurn>()) {
      take(*turn, r);
    }
  }
  template <class AnyFit>
  void take(const AnyFit& fit, AxisReading& r) noexcept {
    if (!fit.ready()) return;
    const auto model = fit.model();
    for (std::size_t i = 0; i < 3; ++i) {
      r.model.b[i] = static_cast<double>(model.b[i]);
      r.model.a[i] = static_cast<double>(model.a[i]);
    }
    r.set_covariance(fit.covariance().template cast<double>());
    find_modes(r, 3, sample_rate_hz_);
    r.has_model = r.physical && std::isfinite(r.resonance_hz.value);
    if (r.has_model) {
      r.lag_samples += fit.lag_samples();
      return;
    }
    r.physical = true;  // the lines themselves are
    r.resonance_hz = r.antiresonance_hz = {};
    r.resonance_damping = r.antiresonance_damping = AxisRow::kUnknown;
    r.driven_inertia = r.load_inertia = r.stiffness = AxisRow::kUnknown;
  }
  [[nodiscard]] double median_uncertainty() const noexcept {
    std::array<double, kMaxLines> relative{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < lines_.lines(); ++i)
      if (const double x = now_[i].std / std::abs(now_[i].response); !std::isnan(x)) relative[count++] = x;
    if (count == 0) return AxisRow::kUnknown;
    return median_in_place(std::span(relative).first(count));
  }

  ResponseTracker<Tracker> lines_;
  Fit fit_;
  Approach approach_;
  double sample_rate_hz_, delay_s_, memory_samples_, told_memories_, row_samples_;
  std::array<Complex, kMaxLines> factor_{};
  std::array<Now, kMaxLines> now_{};  // [line], at the newest row
  std::array<std::complex<Scalar>, kMaxLines> value_{};
  std::array<Scalar, kMaxLines> std_{};
  LineAverages<kMaxLines> averages_{};
  std::uint64_t averages_settling_ = 0;
  bool averaged_ = false;
  double coherence_ = 0.0, largest_ = 0.0;
};

}  // namespace resonid::online::detail
