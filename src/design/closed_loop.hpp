// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <complex>
#include <resonid/design/detail/loop_figures.hpp>
#include <resonid/fit/detail/sampled_states.hpp>
#include <span>
#include <vector>

#include "design/controller.hpp"
#include "design/known_band.hpp"

namespace resonid::design {

/// A pole on the circle, as of a controller without a gain at standstill, comes out on either side of it.
inline constexpr double kStableRadius = 1.0 - 1e-10;

/// Drive and controller: u = C (r - y).
struct ClosedLoop {
  Eigen::MatrixXd a;
  Eigen::VectorXd reference, load_torque;
  Eigen::RowVectorXd measured, load, torque;  ///< The torque's part by the reference comes on top.
  double torque_by_reference = 0.0;
  double sample_time_s = 0.0;

  [[nodiscard]] double spectral_radius() const;
  [[nodiscard]] bool is_stable() const { return spectral_radius() < kStableRadius; }
};
[[nodiscard]] ClosedLoop closed_loop(const fit::SampledStates& drive, const ControllerStates& controller);

/// The exact loop of a machine at any frequency.
class LoopFunctions {
 public:
  /// Keeps a reference to the plant, which is known up to a frequency.
  LoopFunctions(const fit::SampledResponse& plant, LinearController controller,
                double known_to_hz = kKnownEverywhere);
  LoopFunctions(const fit::SampledResponse& plant, const FilteredPi& controller, double sample_time_s,
                double known_to_hz = kKnownEverywhere)
      : LoopFunctions(plant, LinearController(controller, sample_time_s), known_to_hz) {}

  struct Values {
    std::complex<double> loop, controller, load;
    std::complex<double> reference;  ///< Reference to torque before any feedback; C but for a cascade.
    double beyond = 0.0;             ///< weight_beyond()
    [[nodiscard]] double size_of(Transfer transfer) const;
  };
  [[nodiscard]] std::vector<Values> at(std::span<const double> frequencies_hz) const;

  /// Local maxima from `least` of their bound on, each refined between the lines.
  [[nodiscard]] std::vector<Peak> peaks(const std::vector<double>& lines_hz, const Bounds& bounds,
                                        double least) const;
  /// The largest over all frequencies.
  [[nodiscard]] Peak largest(Transfer transfer, const std::vector<double>& lines_hz) const;
  /// [transfer]
  [[nodiscard]] std::vector<Peak> largest_of(const std::vector<Transfer>& transfers,
                                             const std::vector<double>& lines_hz) const;

 private:
  /// Sizes at frequencies, as the search for maxima between lines asks for them.
  [[nodiscard]] auto sizes_of(Transfer transfer) const {
    return [this, transfer](std::span<const double> frequencies_hz, std::span<double> sizes) {
      const auto values = at(frequencies_hz);
      for (std::size_t i = 0; i < values.size(); ++i) sizes[i] = values[i].size_of(transfer);
    };
  }
  const fit::SampledResponse& plant_;
  LinearController controller_;
  double known_to_hz_;
};

}  // namespace resonid::design
