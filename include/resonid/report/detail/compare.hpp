// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/transfer_function.hpp>
#include <resonid/identification/compare.hpp>
#include <resonid/report/detail/document.hpp>
#include <resonid/report/json.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// What changed in plain sentences, what is significant first.
[[nodiscard]] std::vector<std::string> sentences(const identification::Changes& comparison);

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string summary_text(const identification::Changes& comparison);

/// The results themselves, for the pictures of their models and loops.
struct ComparedResults {
  const identification::Result& first;
  const identification::Result& second;
  std::optional<data::TransferFunction> controller = {};  ///< Controller of the loop that both are judged in.
};

/// The page of `compare --report`: verdict, what changed, both responses; with the results their models too,
/// and with the controller the loop before and after.
[[nodiscard]] Document document(const identification::Changes& comparison);
[[nodiscard]] Document document(const identification::Changes& comparison, const ComparedResults& results);

}  // namespace resonid::report
