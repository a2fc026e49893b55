// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/measure/measure.hpp>
#include <identification/identify/select/select_black_box.hpp>
#include <identification/identify/select/select_drive.hpp>

namespace resonid::identification::detail {

/// The model of the record, if one was asked for and came out: a drive or a black box.
struct Fitted {
  std::optional<Selection> drive;
  std::optional<BlackBoxSelection> black_box;
  std::vector<StructureTrial> structures;            ///< All that were tried.
  std::vector<Choice> choices;                       ///< Why this one.
  std::optional<data::FrequencyResponse> corrected;  ///< The response, by simulate_and_correct().

  [[nodiscard]] bool present() const noexcept { return drive || black_box; }
  /// Fitted to the record itself, not to the measured response.
  [[nodiscard]] bool to_record() const noexcept { return black_box || (drive && drive->result.from_record); }
};

/// The third step of identify(): the structure that the options ask for, else the one that the record shows.
/// Refused: what black box and correction refuse, and Method::model without a model.
[[nodiscard]] expected<Fitted, Error> select(const Experiment& experiment, const Measurement& measurement,
                                             const Options& options);

}  // namespace resonid::identification::detail
