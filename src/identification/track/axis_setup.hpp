// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <identification/track/plan.hpp>
#include <memory>
#include <new>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/online/axis.hpp>
#include <string>
#include <vector>

namespace resonid::identification::detail {

/// A plan in the words of the on-line engine.
struct AxisSetup {
  online::AxisConfig config;  ///< Its spans lie in the vectors below.
  std::vector<double> lines_hz, numerator, denominator, start_b, start_a, baseline_hz;
  std::vector<std::complex<double>> baseline;
  double memory_s = 0.0;  ///< Memory of the estimate, roughly: how far apart its values are independent.
  double fractional_delay = 0.0;  ///< Part of the delay beyond whole samples, in samples.
};

/// What the learning stretch showed, as configuration of the engine.
[[nodiscard]] expected<std::unique_ptr<AxisSetup>, Error> axis_setup(const data::Record& stretch,
                                                                     const TrackOptions& options,
                                                                     const TrackPlan& plan);

struct FreeAxis {
  void operator()(online::Axis* axis) const {
    ::operator delete(axis, std::align_val_t(alignof(online::Axis)));
  }
};
using AxisPointer = std::unique_ptr<online::Axis, FreeAxis>;

/// The engine; refused in the words of track's options.
[[nodiscard]] expected<AxisPointer, Error> make_axis(const AxisSetup& setup, const TrackPlan& plan);

}  // namespace resonid::identification::detail
