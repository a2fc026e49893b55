// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/estimate.hpp>
#include <resonid/data/record.hpp>
#include <vector>

namespace resonid::fit {

/// Columns of the regression, in the order of its covariance.
enum InverseDynamicsTerm : int {
  kInertiaTerm,
  kViscousTerm,
  kCoulombTerm,
  kOffsetTerm,      ///< Torque added to the input, as in OutputErrorFit.
  kDelayTerm,       ///< In s, on top of the known one.
  kComplianceTerm,  ///< Torque per second derivative of the acceleration, J2^2/K of two masses.
  kStribeckTerm,    ///< Breakaway less sliding friction.
  kInverseDynamicsTerms
};

struct InverseDynamicsConfig {
  double known_delay_s = 0.0;  ///< In the measured output, >= 0.
  bool viscous_friction = true;
  bool coulomb_friction = true;
};

/// A drive below its first resonance, from motion: what torque the measured motion took.
struct InverseDynamics {
  data::Estimate inertia;  ///< All that moves along.
  data::Estimate viscous_friction;
  /// Mean of both directions; their half difference is part of the offset: while moving, nothing tells an
  /// asymmetric friction from a constant torque. Absent where the motion never reverses.
  std::optional<data::Estimate> coulomb_friction;
  data::Estimate offset;
  data::Estimate further_delay_s;  ///< On top of the known one.
  /// Where friction is larger near standstill, about the velocity over which it falls; else 0.
  double stribeck_velocity = 0.0;
  /// First effect of an elastic coupling, -J2^2/K; only where the motion shows it.
  std::optional<data::Estimate> compliance;
  Eigen::Matrix<double, kInverseDynamicsTerms, kInverseDynamicsTerms> covariance;
  double bandwidth_hz = 0.0;  ///< -3 dB of the low-pass that torque and motion went through.
  double explained = 0.0;     ///< Share of the filtered torque's variance, 0 ... 1.
  double share =
      0.0;  ///< Part of the moving input's variance that it explains, at up to ten times that cut-off.
  bool rigid = true;    ///< All cut-offs agree, without a compliance.
  double moving = 0.0;  ///< Share of the samples that are used.
  /// [sample] Dry friction along the measured motion, to be taken from the input; all of the input and the
  /// offset at rest.
  std::vector<double> friction_torque;
};

/// Least squares of the filtered inverse dynamics
///
///   F m u = F m (J a + B v + Fc sign v [+ (Fb - Fc) sign v exp(-(v/vs)^2)] - offset)
///
/// between neighbouring samples, where a held torque makes it exact; F is one zero-phase low-pass for both
/// sides, m leaves out what is near standstill, a further delay is estimated along. The cut-off is the one of
/// least variance among those from the lowest on that agree (Lepski 1991): the first that a resonance, a lag
/// or noise moves ends them. Covariance: Newey and West 1987, their kernel's bias corrected (Kiefer and
/// Vogelsang 2005), plus what the next cut-offs and a higher threshold of velocity disagree by, plus the
/// range that noise of the acceleration may have moved the inertia by. Needs neither a start nor the sign of
/// a simulated velocity, and a position may drift. Uses the first 300 000 samples. Errors: fewer than 100
/// samples, an acceleration, no motion.
[[nodiscard]] expected<InverseDynamics, Error> fit_inverse_dynamics(const data::Record& record,
                                                                    const InverseDynamicsConfig& config);

}  // namespace resonid::fit
