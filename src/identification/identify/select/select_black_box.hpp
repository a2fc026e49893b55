// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/identify.hpp>

namespace resonid::identification::detail {

/// A black-box model of the record and how it was come by.
struct BlackBoxSelection {
  BlackBoxResult result;
  std::vector<double> residual;  ///< Of the simulation, from residual_start on; empty at another rate.
  std::size_t residual_start = 0;
  std::vector<StructureTrial> structures;  ///< One for each order that was tried.
  std::vector<Choice> choices;             ///< Order, integrator, delay.
};

/// How the record is fitted with the known delay: predictor, controller, delay. A fraction of a sample takes
/// one coefficient more.
[[nodiscard]] fit::BlackBoxConfig black_box_config(const data::Record& record, const Options& options);

/// The same with the structure of a model of that record, which is also the start.
[[nodiscard]] fit::BlackBoxConfig black_box_config(const data::Record& record, const Options& options,
                                                   const fit::BlackBoxModel& model);

/// Of such a model, the known delay included.
[[nodiscard]] data::Estimate delay_of(const fit::BlackBoxModel& model);

/// Where the box is to hold, and at which rate it is fitted.
struct BlackBoxBand {
  std::optional<std::pair<double, double>> hz;  ///< Absent: up to half the sample rate.
  bool alone = false;                           ///< What lies below it has no say either.
};

/// Output error of the order asked for, else of the order that the hold-out data prefer; whether
/// a pole is fixed as an integrator and whether there is a further delay is found from the record. An
/// approach that was asked for decides on the predictor too; else the recorded input drives it and the noise
/// is modelled, which is right in open and in closed loop. In a band the record is fitted at the rate that
/// the band needs (record_in_band()), unless the approach is indirect or the bootstrap repeats the record.
[[nodiscard]] expected<BlackBoxSelection, Error> select_black_box(const data::Record& record,
                                                                  const Options& options,
                                                                  const BlackBoxBand& band = {});

}  // namespace resonid::identification::detail
