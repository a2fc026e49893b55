// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <identification/online_tracker.hpp>
#include <resonid/base/expected.hpp>
#include <vector>

namespace resonid::identification::detail {

struct TrackPlan;

/// What a row has to pass before it is trusted (docs/methods/track.md).
struct Gates {
  bool ready = false;      ///< The start no longer matters.
  bool excited = false;    ///< Rms of the excitation in the band against the strongest so far.
  bool converged = false;  ///< Resonance known, and at rest over the last stretch.
  bool physical = false;   ///< Signs and stability.
  bool residual = false;   ///< The residual is as strong as it was.
  [[nodiscard]] bool all() const { return ready && excited && converged && physical && residual; }
};

/// Mean that fades with a time constant in samples; a plain mean until then.
class FadingLevel {
 public:
  explicit FadingLevel(double samples = 1.0) : samples_(std::max(1.0, samples)) {}
  /// `x` stands for so many samples.
  void add(double x, double count = 1.0) {
    count_ += count;
    value_ += count / std::min(count_, std::max(samples_, count)) * (x - value_);
  }
  [[nodiscard]] double value() const { return value_; }
  [[nodiscard]] bool filled() const { return count_ >= samples_; }

 private:
  double samples_;
  double value_ = 0.0;
  double count_ = 0.0;
};

/// Follows excitation and residual through the record and judges every row.
class TrustGates {
 public:
  TrustGates(const data::Record& record, const TrackPlan& plan);

  void sample(double ru, double u, double residual);
  [[nodiscard]] Gates judge(OnlineTracker& tracker, OnlineValue resonance);
  [[nodiscard]] double residual_rms() const;
  /// Excitation: of the rows from the first one that was ready; the others: of those of them with excitation.
  [[nodiscard]] TrustShares shares() const;
  /// Findings about the run as a whole, from the rows that were judged.
  void inspect(const OnlineTracker& tracker, std::vector<diagnostics::Finding>& findings) const;

 private:
  [[nodiscard]] bool excited() const;
  [[nodiscard]] bool converged(OnlineTracker& tracker, OnlineValue resonance);
  [[nodiscard]] bool residual_holds(bool known);
  double banded(double x);

  bool has_excitation_;
  bool sweep_;
  double high_pass_, low_pass_;       // of the band, per sample
  double slow_ = 0.0, smooth_ = 0.0;  // their states
  FadingLevel excitation_, residual_, usual_residual_, correlation_, lagged_power_;
  FadingLevel resonance_;
  double strongest_ = 0.0;
  double last_residual_ = kUnknown;
  double worst_growth_ = 0.0, uncertainty_ = kUnknown, most_uncertainty_ = kUnknown, weakest_ = 1.0;
  std::size_t rows_ = 0, ready_ = 0, lost_ = 0, excited_rows_ = 0, converged_ = 0, physical_ = 0,
              residual_rows_ = 0, all_ = 0;
  std::size_t start_samples_ = 0, samples_ = 0, judged_samples_ = 0;
};

}  // namespace resonid::identification::detail
