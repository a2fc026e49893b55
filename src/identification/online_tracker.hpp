// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <complex>
#include <limits>
#include <memory>
#include <optional>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/fit/drive_model.hpp>
#include <resonid/identification/track.hpp>
#include <span>
#include <string>
#include <vector>

namespace resonid::identification::detail {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// What an estimator reports besides the figures that all have.
struct OnlineColumn {
  std::string name;
  std::string unit;
  bool deviation = false;  ///< Followed by its standard deviation, NAME_std.
  bool line = false;       ///< Of a line's response; otherwise a parameter.
};

/// A value that may be unknown yet.
struct OnlineValue {
  double value = kUnknown;
  double deviation = kUnknown;
};

/// One estimator over a record, in the words that the rows are written in. Queries are of the newest sample.
class OnlineTracker {
 public:
  OnlineTracker() = default;
  OnlineTracker(const OnlineTracker&) = delete;
  OnlineTracker& operator=(const OnlineTracker&) = delete;
  virtual ~OnlineTracker() = default;

  virtual void step(double ru, double u, double y) noexcept = 0;
  [[nodiscard]] virtual std::vector<OnlineColumn> columns() const = 0;
  /// One value for each column.
  virtual void read(std::span<OnlineValue> values) = 0;
  [[nodiscard]] virtual bool ready() const = 0;
  [[nodiscard]] virtual double lag_samples() const = 0;
  /// Newest output minus its prediction; not a number where there is none.
  [[nodiscard]] virtual double residual() const { return kUnknown; }
  /// Whether a right model leaves a white residual.
  [[nodiscard]] virtual bool white_residual() const { return false; }
  [[nodiscard]] virtual OnlineValue resonance() { return {}; }
  [[nodiscard]] virtual OnlineValue antiresonance() { return {}; }
  /// Relative uncertainty of what is mainly reported, and what it must be below to count as converged: that
  /// of the resonance, unless a tracker has something else.
  [[nodiscard]] virtual bool finds_resonance() const { return true; }
  [[nodiscard]] virtual double uncertainty() { return resonance().deviation / resonance().value; }
  [[nodiscard]] virtual double most_uncertainty() const { return 0.02; }
  /// Whether the estimate could be a machine: stable, signs of inertia, stiffness and damping.
  [[nodiscard]] virtual bool physical() { return true; }
  /// Whether the estimator itself saw enough excitation lately.
  [[nodiscard]] virtual bool excited() const { return true; }
  /// Whether response() answers at any frequency, or at own_frequencies_hz() only.
  [[nodiscard]] virtual bool answers_anywhere() const { return true; }
  [[nodiscard]] virtual std::span<const double> own_frequencies_hz() const { return {}; }
  /// The plant's response without the known delay; not a number where it is not known.
  virtual void response(std::span<const double> frequency_hz, std::span<std::complex<double>> values) = 0;
  /// What the estimator itself has to say about the whole run.
  virtual void inspect(std::vector<diagnostics::Finding>&) const {}
};

using TrackerMade = expected<std::unique_ptr<OnlineTracker>, Error>;

}  // namespace resonid::identification::detail
