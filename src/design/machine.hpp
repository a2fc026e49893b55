// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <resonid/fit/detail/sampled_states.hpp>
#include <resonid/fit/drive_model.hpp>
#include <span>
#include <vector>

#include "design/controller.hpp"
#include "design/known_band.hpp"

namespace resonid::design {

/// One machine that a controller is to suit, with what a design asks of it.
class Machine {
 public:
  /// Known up to that frequency.
  explicit Machine(const fit::DriveModel& model, double known_to_hz = kKnownEverywhere)
      : model_(model), response_(model), states_(fit::sampled_states(model)), known_to_hz_(known_to_hz) {}

  [[nodiscard]] const fit::SampledResponse& response() const { return response_; }
  [[nodiscard]] const fit::SampledStates& states() const { return states_; }
  [[nodiscard]] const fit::DriveModel& model() const { return model_; }
  [[nodiscard]] double sample_time_s() const { return model_.sample_time_s; }
  [[nodiscard]] double known_to_hz() const { return known_to_hz_; }

 private:
  fit::DriveModel model_;
  fit::SampledResponse response_;
  fit::SampledStates states_;
  double known_to_hz_;
};

/// Where bounds are looked at first: 400 logarithmic lines up to the Nyquist frequency, 60 evenly over its
/// upper 70 %, and 37 around each mode, at distances of its width (docs/methods/tune.md 4.4a); `share` of
/// them. Ascending. Where the machine is known up to a frequency only, also at the corners of
/// weight_beyond().
[[nodiscard]] std::vector<double> first_lines_hz(const fit::DriveModel& model, double share = 1.0,
                                                 double known_to_hz = kKnownEverywhere);
/// And around what resonates in the controller, which a given one may do anywhere.
[[nodiscard]] std::vector<double> first_lines_hz(const fit::DriveModel& model,
                                                 const LinearController& controller, double share = 1.0,
                                                 double known_to_hz = kKnownEverywhere);

/// A machine's responses at the frequencies at which bounds are looked at.
class MachineLines {
 public:
  /// On first_lines_hz.
  explicit MachineLines(const Machine& machine, double share = 1.0);

  struct Line {
    double frequency_hz = 0.0;
    fit::SampledResponse::Value plant;
    std::complex<double> inverse_z, integrator;  ///< 1/z; Ts z/(z - 1)
    double beyond = 0.0;                         ///< weight_beyond()
  };
  [[nodiscard]] const std::vector<Line>& lines() const { return lines_; }
  [[nodiscard]] std::vector<double> frequencies_hz() const;
  void add(const Machine& machine, std::span<const double> frequencies_hz);

 private:
  std::vector<Line> lines_;  ///< Ascending.
};

}  // namespace resonid::design
