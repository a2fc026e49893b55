// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/prepare/plan.hpp>
#include <resonid/response/best_linear_approximation.hpp>
#include <resonid/response/line_estimates.hpp>
#include <span>
#include <string>

namespace resonid::identification::detail {

/// Ru, U and Y at the lines.
struct Measured {
  response::LineEstimates lines;
  std::optional<response::BestLinearApproximation> best_linear;  ///< Of Method::best_linear.
};

/// One way to measure a response: all that the library knows of it.
struct MethodEntry {
  Method method;
  /// Whether it averages over whole periods; such a method reports the lines that are excited.
  bool periods;
  /// What it is for: whether `auto` takes it for such a record. Nothing: on request only.
  bool (*suits)(const data::Record& record, const Plan& plan);
  /// What it needs and the record or the options do not have, after its name; empty: nothing.
  std::string (*lacks)(const data::Record& record, const Plan& plan);
  /// How it measures.
  expected<Measured, Error> (*measure)(const data::Record& record, const Plan& plan, const Options& options);
  /// Why it was taken, as a sentence.
  std::string (*reason)(const data::Record& record, const Plan& plan);
};

/// In the order in which `auto` asks them; the last one suits every record.
[[nodiscard]] std::span<const MethodEntry> methods();

/// Of a method that measures: not automatic, model or simulate_and_correct.
[[nodiscard]] const MethodEntry& entry_of(Method method);

/// The method that measures: the one asked for, else the first that suits.
[[nodiscard]] Method measuring_method(const data::Record& record, const Plan& plan, const Options& options);

/// Whether it may come to averages over realisations: asked for, or chosen by the record.
[[nodiscard]] bool averages_realisations(Method method) noexcept;

/// By the plan's method. Refused: what the method refuses, and records in which it finds no line.
[[nodiscard]] expected<Measured, Error> measure_lines(const data::Record& record, const Plan& plan,
                                                      const Options& options);

}  // namespace resonid::identification::detail
