// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/response/detail/distortion_level.hpp>
#include <resonid/response/line_estimates.hpp>
#include <span>

namespace resonid::response {

struct DetectionLinesConfig {
  std::size_t period_samples = 0;  ///< Period of the excitation, >= 4; 0: detect_period().
  std::size_t drop_periods = 0;    ///< Periods left out at the start, while transients last.
};

struct DetectionLines {
  DistortionLevel even;  ///< Even multiples: offsets, asymmetric friction, backlash, saturation on one side.
  DistortionLevel odd;   ///< Odd multiples left out of an odd excitation: friction, saturation, stiffening.
  double base_hz = 0.0;  ///< Frequency of which the lines are multiples.
};

/// Non-linear distortion at lines that a periodic excitation leaves out (fast method, Pintelon and
/// Schoukens 2012, 4.3.2). A linear drive answers only where it is excited. Between the lowest and the
/// highest excited line, the lines k/period with k even or odd are found by themselves from the spectrum of
/// the reference signal (Ru, else U); at each
///
///   D = Y - G U,   G: between the excited neighbours
///
/// since under feedback U answers there too. Level: rms of D over rms of Y at the excited lines; noise from
/// the scatter of the periods. Odd lines count only when the excitation has no even ones. Refused when the
/// reference leaves out no line of the band. Limits: a level is that of the detection lines, not of the
/// excited ones; odd distortion weighs on the response, even distortion acts like noise.
[[nodiscard]] expected<DetectionLines, Error> detection_lines(const data::Record& record,
                                                              const DetectionLinesConfig& config);

/// The same of several realisations with one amplitude spectrum: powers are averaged over them, the test has
/// their degrees of freedom together.
[[nodiscard]] expected<DetectionLines, Error> detection_lines(std::span<const data::Record> records,
                                                              const DetectionLinesConfig& config);

}  // namespace resonid::response
