// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/online/excitation/guarded_excitation.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/models/recursive_response_fit.hpp>
#include <resonid/online/supervision/running_margins.hpp>
#include <type_traits>

#include "core.h"
#include "generator.hpp"
#include "line_averages.hpp"

namespace resonid::linuxcnc {

inline constexpr std::size_t kMaxLines = RESONID_MAX_LINES;

/// One axis of a machine in its servo thread: guarded excitation, response at the lines, resonance,
/// anti-resonance and margins of the loop, with bounded work per period.
///
///   Gd = Y/U (joint: (Y/Ru)/(U/Ru))      L = Ru/U - 1, or C Gd with the gains of a pid
///
/// L is measured: whatever the controller does with the velocity is in it. It holds as long as the reference
/// has nothing at the lines. Every period takes one sample and works on one line in turn; after the last one
/// come the modes and then the verdict, so that a turn takes lines + 2 periods. Trivially copyable, no heap.
class Axis {
 public:
  static expected<Axis, Error> create(const resonid_axis_shape& shape);

  [[nodiscard]] double excite(const resonid_axis_settings& settings,
                              const resonid_axis_sample& sample) noexcept;
  void identify(const resonid_axis_settings& settings, const resonid_axis_sample& sample) noexcept;
  [[nodiscard]] const resonid_axis_results& results() const noexcept { return results_; }

 private:
  using Complex = std::complex<double>;
  using Tracker = online::ResponseTracker<online::KalmanBank<double, kMaxLines>>;
  using Guard = online::GuardedExcitation<double>;
  using Fit = online::RecursiveResponseFit<double, 3, kMaxLines>;
  struct Line {
    Complex response, loop;  // response: delay included
    double std = std::numeric_limits<double>::infinity();
  };

  Axis(const resonid_axis_shape& shape, const Tracker& tracker, const Fit& fit,
       const Generator& generator) noexcept;

  [[nodiscard]] bool active() const noexcept;
  void start(const resonid_axis_settings& settings) noexcept;
  void take_line(const resonid_axis_settings& settings, std::size_t line) noexcept;
  void take_margins(double frequency_hz, Complex loop, double std) noexcept;
  void take_modes() noexcept;
  void take_masses() noexcept;
  void conclude(const resonid_axis_settings& settings) noexcept;
  [[nodiscard]] Line measure(std::size_t line) noexcept;
  [[nodiscard]] Complex pid(const resonid_axis_settings& settings, double frequency_hz) const noexcept;
  [[nodiscard]] resonid_trust verdict(const resonid_axis_settings& settings) const noexcept;
  void forget() noexcept;

  resonid_axis_shape shape_;
  Tracker tracker_;
  Fit fit_;
  Generator generator_;
  std::optional<Guard> guard_{};  // none before the first start
  LineAverages<kMaxLines> averages_{};
  std::size_t settling_samples_ = 0;

  resonid_axis_results results_{};
  online::MarginScan<double> scan_{};
  double last_std_ = 0.0, phase_margin_std_ = 0.0, modulus_margin_std_ = 0.0;
  double coherence_sum_ = 0.0;
  double excitation_ = 0.0;
  double largest_line_velocity_ = 0.0;  // of this turn
  double missing_ = 0.0;                // share of missing samples, fading with the trackers' memory
  std::uint64_t steady_samples_ = 0, steady_after_ = 0;
  std::size_t slot_ = 0;  // of the turn
  int kind_ = RESONID_MULTISINE;
  bool was_enabled_ = false, was_reset_ = false;
};

static_assert(std::is_trivially_copyable_v<Axis>);

}  // namespace resonid::linuxcnc
