// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstdlib>
#include <identification/track/plan.hpp>
#include <memory>
#include <new>
#include <resonid/base/detail/byte_archive.hpp>
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

  void save(ByteWriter& to) const;
  /// What save() wrote; nothing where the bytes are none of it.
  [[nodiscard]] static std::unique_ptr<AxisSetup> restored(ByteReader& from);
  /// Lets the configuration's spans point to the vectors.
  void point();
};

/// What the learning stretch showed, as configuration of the engine.
[[nodiscard]] expected<std::unique_ptr<AxisSetup>, Error> axis_setup(const data::Record& stretch,
                                                                     const TrackOptions& options,
                                                                     const TrackPlan& plan);

/// Blocks in which changes of a figure are looked for: twice the memory, so that their means hardly depend on
/// one another. What an exponential memory leaves of a block in the next, the detector learns: half of it.
[[nodiscard]] double change_block_s(const TrackOptions& options, const AxisSetup& setup);

/// An axis lies in memory that was zero: what its estimator does not use of it takes none.
struct FreeAxis {
  void* block = nullptr;
  void operator()(online::Axis* /*axis*/) const { std::free(block); }
};
using AxisPointer = std::unique_ptr<online::Axis, FreeAxis>;
/// Zeros, suitably aligned. Throws std::bad_alloc.
[[nodiscard]] AxisPointer axis_memory();

/// The engine; refused in the words of track's options.
[[nodiscard]] expected<AxisPointer, Error> make_axis(const AxisSetup& setup, const TrackPlan& plan);

}  // namespace resonid::identification::detail
