// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/diagnostics/finding.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/identification/result.hpp>
#include <string>
#include <vector>

namespace resonid::identification {

/// What a signal looks like.
struct SignalFacts {
  std::string role;  ///< "input", "output", "excitation", "reference", "position".
  std::string name, unit;
  double least = 0.0, greatest = 0.0;
  double rms = 0.0;    ///< About its mean.
  double step = 0.0;   ///< Resolution: the least distance of two values; 0: finer than 1/10 000 of the range.
  double drift = 0.0;  ///< Mean of the last tenth less that of the first.
};

/// Whether a controller returns the output's noise through the input.
enum class LoopState { open, closed, unknown };
inline constexpr EnumName<LoopState> kLoopStateNames[] = {
    {LoopState::open, "open"}, {LoopState::closed, "closed"}, {LoopState::unknown, "unknown"}};
[[nodiscard]] constexpr std::span<const EnumName<LoopState>> enum_names(LoopState) noexcept {
  return kLoopStateNames;
}

/// What a record holds, before anything is fitted to it.
struct Inspection {
  RecordFacts record;
  data::Motion motion = data::Motion::rotary;
  double duration_s = 0.0;
  data::Sampling sampling;
  std::vector<SignalFacts> signals;    ///< Those that are there.
  std::string excitation;              ///< "chirp", "multisine", "prbs", "stepped-sine", "other".
  std::string excitation_because;      ///< In a few words.
  std::string exciting;                ///< Name of the signal that tells.
  double low_hz = 0.0, high_hz = 0.0;  ///< Excited band.
  double strength = 0.0;               ///< Rms of the exciting signal about its mean, in the input's unit.
  LoopState loop = LoopState::unknown;
  /// Probability of so much feedback by chance; absent where it could not be told.
  std::optional<double> feedback_probability;
  std::vector<diagnostics::Finding> findings;  ///< What to know of the record.
};

/// Looks at a record as identify() would, without measuring or fitting. Errors: what identify() refuses of a
/// record (fewer than 128 samples, a constant input, an output that is a copy of the input).
[[nodiscard]] expected<Inspection, Error> inspect(const data::Record& record, const Options& options = {});

}  // namespace resonid::identification
