// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <reproduce/reproduction.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/fit/drive_model.hpp>
#include <resonid/plant/experiment.hpp>
#include <string>
#include <vector>

#include "design/cascade.hpp"
#include "design/controller.hpp"
#include "design/rst.hpp"

// The controllers of Publication I: designed by the stage `design` (docs/methods/tune.md 8, 9) from each
// model, and judged on the machine.
namespace resonid::reproduction::i {

/// The simulated machine as a model, its delay inside.
[[nodiscard]] fit::DriveModel machine_of(const plant::Truth& truth, double sample_time_s);

/// The source's reference model: its parameters off by what the source allows them.
[[nodiscard]] fit::DriveModel reference_of(const fit::DriveModel& machine);

/// A black box as a two-mass drive: fitted to its response over the identified band, every line by its size.
/// `delay_s` is the known delay, which is not in the response.
[[nodiscard]] fit::DriveModel read_as_two_masses(data::FrequencyResponse response, double sample_time_s,
                                                 double delay_s);

/// Position over velocity, with |S| <= 1.4 and next to no overshoot of the load's position on that model.
[[nodiscard]] std::optional<design::Cascade> cascade_for(const fit::DriveModel& model);

/// RST of the velocity under the stage's default bounds, with an integrator and without gain at the Nyquist
/// frequency (Landau and Zito's fixed parts).
[[nodiscard]] std::optional<design::Rst> rst_for(const fit::DriveModel& model);

/// A loop on the machine.
struct Sensitivities {
  std::string name;
  std::vector<double> frequency_hz;
  std::vector<double> s, t, sg, cs;  ///< Magnitudes.
};
[[nodiscard]] Sensitivities sensitivities(std::string name, const fit::DriveModel& machine,
                                          const design::LinearController& controller);

/// What each seed identified.
struct Identified {
  std::vector<fit::DriveModel> published, physical;  ///< [seed]; their delay inside.
};
/// Cascades from every model held against the machine's own, and the sensitivities of these loops.
[[nodiscard]] report::Section design_section(const fit::DriveModel& machine, const Identified& identified);

}  // namespace resonid::reproduction::i
