// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "response/signals.hpp"

namespace resonid::response {

/// One transform of a whole record, for methods that fit around each frequency.
struct LocalSpectra {
  Eigen::MatrixX3cd spectra;  ///< [bin, excitation input output]; 0 for a signal that plays no part
  Eigen::Index reference = 0;
  double spacing_hz = 0.0;
  double first_excited = 0.0;  ///< Bins between which the reference signal has power.
  double last_excited = 0.0;
  std::pair<double, double> band_hz;  ///< The same, further out, in Hz.
};

[[nodiscard]] expected<LocalSpectra, Error> local_spectra(const data::Record& record, const Signals& signals,
                                                          Approach approach);

/// First and last bin of the window around a centre. Bins without excitation tell nothing about the response:
/// what the window has of them at an end of the excited band, it grows by at its other side.
[[nodiscard]] std::pair<Eigen::Index, Eigen::Index> local_window(const LocalSpectra& spectra, double centre,
                                                                 double half_width);

struct LocalGrid {
  std::vector<double> frequencies_hz;
  double band_low_hz = 0.0;
  double band_high_hz = 0.0;
};

/// The wanted frequencies in ascending order, or at most 400 bins of the wanted or the excited band.
[[nodiscard]] expected<std::vector<double>, Error> local_grid(const data::Record& record,
                                                              const LocalSpectra& spectra,
                                                              const LocalGrid& wanted);

}  // namespace resonid::response
