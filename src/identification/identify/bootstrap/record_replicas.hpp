// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <identification/identify/measure/methods.hpp>
#include <optional>
#include <resonid/data/record.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/identification/result.hpp>

namespace resonid::identification::detail {

/// Repeats the experiment of a model, physical or black box, that was fitted to the record.
class RecordReplicas {
 public:
  /// Keeps a reference to the record. The result has a model and its residual.
  RecordReplicas(const data::Record& record, const Plan& plan, const Options& options, const Result& result);

  /// The model of one repetition in an otherwise empty result; none when its fit did not come out.
  [[nodiscard]] std::optional<Result> fitted(std::uint64_t seed) const;

  /// The record of one repetition.
  [[nodiscard]] data::Record repeated(std::uint64_t seed) const;

 private:
  const data::Record& record_;
  std::vector<double> residual_;
  std::size_t first_;
  data::OutputHold hold_;
  fit::NoiseModel noise_;
  std::optional<fit::OutputErrorConfig> drive_;
  std::optional<fit::BlackBoxConfig> black_box_;  ///< One of the two.
  bool further_delay_ = false;
  data::TransferFunction plant_;
  std::optional<data::TransferFunction> controller_;
};

}  // namespace resonid::identification::detail
