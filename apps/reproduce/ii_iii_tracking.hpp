// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <resonid/diagnostics/residuals.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/plant/experiment.hpp>
#include <vector>

namespace resonid::reproduction::ii_iii {

using Model = online::DiscreteModel<double, 3>;

enum class Method {
  arx,              ///< RLS on measured signals: direct.
  output_error,     ///< RPLR: direct, Publication II.
  closed_loop,      ///< CLOE: indirect, Publication III.
  fixed_filter,     ///< F-CLOE with the filter of the start model.
  damped_filter,    ///< CLOE along the gradient of the current model.
  refined_iv,       ///< Closed-loop instrumental variables.
  physical,         ///< J1, J2, K, D by an extended Kalman filter.
  simulated_truth,  ///< The machine itself, for the validation's own limits.
};
[[nodiscard]] const char* name(Method method);

/// At the driven shaft, in kgm2, Nm/rad, Nms/rad.
struct TwoMass {
  double driven_inertia = 0.0, load_inertia = 0.0, stiffness = 0.0, damping = 0.0;
};
[[nodiscard]] Model sampled(const TwoMass& machine, double sample_rate_hz);
[[nodiscard]] TwoMass machine_at(const plant::DriveConfig& drive, double position_m);

/// Undamped, sqrt(K (1/J1 + 1/J2)).
[[nodiscard]] double resonance_hz(const TwoMass& machine);

/// The source's reference model with its uncertainty: K 5 %, damping 20 %, inertia of the driven side 15 %.
struct Reference {
  std::array<double, 6> value{}, lower{}, upper{};  ///< b1 ... b3, a1 ... a3
};
[[nodiscard]] Reference reference(const TwoMass& machine, double sample_rate_hz);
inline constexpr double kStiffnessBand = 0.05, kDampingBand = 0.20, kInertiaBand = 0.15;

/// An experiment of the tooth belt, and the model that estimators start from: the belt at another position.
struct Run {
  plant::ExperimentConfig experiment;
  plant::Simulation simulation;
  TwoMass start;

  [[nodiscard]] double rate_hz() const { return simulation.record.sample_rate_hz; }
  [[nodiscard]] double position_m(double sample) const;
  [[nodiscard]] double resonance_hz(double sample) const;  ///< Truth.
  [[nodiscard]] TwoMass machine(double sample) const;      ///< Truth.
  [[nodiscard]] bool moves() const;
};
[[nodiscard]] Run run(const plant::ExperimentConfig& experiment, double start_m);

struct Estimate {
  std::size_t sample = 0;
  double described = 0.0;  ///< That less the lag that the estimator reports, in samples.
  Model model;
  double resonance_hz = 0.0;  ///< 0 where the model does not oscillate.
};

/// Every tenth estimate from the first second on; forgetting over 0.4 s, or none. The instrumental variables
/// choose their own memory, the physical tracker forgets by the stiffness that drifts.
[[nodiscard]] std::vector<Estimate> track(const Run& run, Method method, bool forget = true);

/// The estimates against the machine.
struct Errors {
  double newest = 0.0, described = 0.0,
         largest = 0.0;                   ///< Resonance, in %; rms, rms, magnitude of the latter.
  double a = 0.0, b = 0.0;                ///< rms of the coefficients, at the newest sample.
  double b_change = 0.0;                  ///< rms of the change of b within 0.2 s.
  double a_within = 0.0, b_within = 0.0;  ///< % within the reference's band, described time.
};
[[nodiscard]] Errors errors(const Run& run, const std::vector<Estimate>& estimates);

/// Residual of the closed loop as simulated with the models tracked in one run on the signals of another,
/// over `kValidationSamples` at constant velocity.
struct Validation {
  diagnostics::ResidualTest test;
  double noise_share = 0.0;  ///< rms of the residual over that of the measurement noise.
};
inline constexpr std::size_t kValidationSamples = 4500;
[[nodiscard]] Validation validate(const std::vector<Estimate>& estimates, const Run& on, bool described);
/// As estimates: the machine itself.
[[nodiscard]] std::vector<Estimate> truth(const Run& run);

}  // namespace resonid::reproduction::ii_iii
