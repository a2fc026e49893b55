// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/transfer_function.hpp>
#include <resonid/design/detail/bounds.hpp>
#include <resonid/fit/drive_model.hpp>
#include <vector>

#include "design/controller.hpp"
#include "design/global_search.hpp"
#include "design/largest_gain.hpp"

// RST by pole placement (docs/methods/tune.md 9; fixed parts after Landau and Zito).
namespace resonid::design {

/// B/A in z^-1 from commanded torque to measured velocity, every delay inside B.
[[nodiscard]] data::TransferFunction sampled_plant(const fit::DriveModel& model);

/// What R and S are to contain, in z^-1.
struct FixedParts {
  std::vector<double> r = {1.0};        ///< {1, 1}: no gain at the Nyquist frequency.
  std::vector<double> s = {1.0, -1.0};  ///< An integrator.
};

/// u = (T r - R y)/S.
struct Rst {
  std::vector<double> r, s;  ///< In z^-1, fixed parts included; s begins with 1.
  double condition = 0.0;    ///< Number of the linear system that gave it, in the 2-norm.
  double residual = 0.0;     ///< Of A S + B R = P, relative to the largest coefficient of P.

  /// R/S, from velocity error to torque: T = R.
  [[nodiscard]] data::TransferFunction controller(double sample_time_s) const {
    return {r, s, sample_time_s};
  }
  /// T that leaves the reference no zero of R: R(1).
  [[nodiscard]] double t() const;
};
/// A S + B R = P. Nothing where the poles are more than S and R can place, or the solution does not hold to
/// 1e-6: the system is singular, or the resonance is too low for the sample rate (below about a hundredth of
/// it: decimate).
[[nodiscard]] std::optional<Rst> place_poles(const data::TransferFunction& plant,
                                             const std::vector<double>& poles, const FixedParts& fixed = {});

/// Where docs/methods/tune.md 9.2 looks for poles.
struct PolePlan {
  double frequency_hz = 0.0, damping = 1.0;  ///< The dominant pair.
  double resonance_factor = 1.0,
         resonance_damping = 0.1;  ///< Each resonance keeps its frequency times the factor.
  double real_hz = 0.0;            ///< Up to four real poles.

  /// P; the rest stands at 0.
  [[nodiscard]] std::vector<double> polynomial(const fit::DriveModel& model, std::size_t degree) const;
};

struct RstDesign {
  PolePlan plan;
  Rst rst;
  double iae = 0.0, exceeded = 0.0;
  GlobalSearch::Point point = {};  ///< Where the next search, for further machines, may go on from.
};
/// By poles for the first of the machines, judged on all of them. `from`: the point of an earlier design,
/// from which alone is gone on.
[[nodiscard]] std::optional<RstDesign> search_rst(Machines& machines, const Bounds& bounds,
                                                  const FixedParts& fixed = {},
                                                  const GlobalSearch::Effort& effort = {40, 40, 1},
                                                  const GlobalSearch::Point& from = {});

}  // namespace resonid::design
