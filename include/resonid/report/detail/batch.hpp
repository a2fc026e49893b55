// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/identification/batch.hpp>
#include <resonid/identification/join.hpp>
#include <resonid/report/detail/document.hpp>
#include <resonid/report/json.hpp>
#include <string>

namespace resonid::report {

/// Many records, and what they come to together.
struct BatchResult {
  identification::Batch batch;
  std::optional<identification::Joint> joint;
  std::string join_error;  ///< Why there is no joint estimate although one was asked for.
};

/// The tables for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string summary_text(const BatchResult& result, Characters characters = Characters::ascii);

/// One page: table first, spread over the records, joint estimate, all responses and loops in one picture
/// each, then every record folded.
[[nodiscard]] Document document(const BatchResult& result);

/// "chirp: what was found", or the message of a file.
[[nodiscard]] std::string error_text(const Error& error);
/// The same after the file's name, which many messages begin with already.
[[nodiscard]] std::string error_line(const identification::BatchEntry& entry);

}  // namespace resonid::report
