// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <resonid/base/discrete_filter.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/plant/drive.hpp>
#include <vector>

namespace resonid::plant {

inline constexpr std::size_t kMaxControllerOrder = 16;

/// A delay as whole samples and the rest.
struct SampleDelay {
  std::size_t whole = 0;
  double fraction = 0.0;  ///< In [0, 1).
};
/// A delay within 1e-9 samples of a whole number counts as whole.
[[nodiscard]] SampleDelay split_delay(double delay_s, double sample_rate_hz) noexcept;

/// A drive under a linear velocity controller with delayed feedback, or alone.
///
///   y(k) = velocity((k - m - e) Ts) + n(k)          first, from torques up to u(k-1)
///   u(k) = C (r - y(k)) + ru(k)                     then; it acts from k Ts to (k+1) Ts
///
/// It starts in the steady state at the reference: the machine turns, the delay line is full, the
/// controller's integrator holds the torque that friction takes. Without an integrator the velocity settles
/// where the controller's gain at 0 Hz leaves it; without a controller the machine turns at `reference`, and
/// u = ru + the holding torque. Source: METHOD 1, 2.5.
class ClosedLoop {
 public:
  struct Sample {
    double input;   ///< u
    double output;  ///< y
  };

  /// `drive` must have been made with delay.fraction as its early_fraction.
  static expected<ClosedLoop, ConfigError> create(std::unique_ptr<Drive> drive,
                                                  const std::optional<data::TransferFunction>& controller,
                                                  SampleDelay delay, double reference);

  Sample step(double excitation, double noise) noexcept;

 private:
  using Controller = DiscreteFilter<double, kMaxControllerOrder>;
  ClosedLoop() = default;

  std::unique_ptr<Drive> drive_;
  std::optional<Controller> controller_;
  std::vector<double> delay_line_;  // ring of m + 1 velocities; next_ is the oldest
  std::size_t next_ = 0;
  double reference_ = 0.0;
  double holding_torque_ = 0.0;  // without a controller only
};

}  // namespace resonid::plant
