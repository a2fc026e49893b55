// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <resonid/report/detail/document.hpp>
#include <string>
#include <vector>

#include "reproduce/ii_iii_tracking.hpp"
#include "reproduce/spread.hpp"

namespace resonid::reproduction::ii_iii {

/// One estimator over all seeds.
struct Figures {
  Method method = Method::arx;
  Spread newest, described, largest;          ///< Error of the resonance, %
  Spread a, b, b_change, a_within, b_within;  ///< As in Errors.
  Spread correlation, correlation_described;  ///< Largest with the simulated output, judged lags.
  Spread noise_share, noise_share_described;  ///< Of the residual.
};

/// Tracks experiments/ii_iii_tooth_prbs over the seeds and validates on other runs; the first run is drawn.
class Study {
 public:
  Study(std::vector<Method> methods, std::size_t seeds, const std::function<void(double)>& progress);

  [[nodiscard]] const Figures& of(Method method) const;
  /// Counterpart of figure 4.4 with its tables, and of the resonance and its error.
  [[nodiscard]] report::Section tracking(std::string title, std::vector<std::string> text) const;
  /// Counterpart of figure 4.5 with its tables.
  [[nodiscard]] report::Section validation(std::string title, std::vector<std::string> text) const;
  [[nodiscard]] report::Section printed() const;

 private:
  [[nodiscard]] report::Chart coefficient_chart(std::size_t i) const;
  [[nodiscard]] report::Chart resonance_chart() const;
  [[nodiscard]] report::Chart error_chart() const;
  [[nodiscard]] report::Chart correlation_chart(Method method) const;

  std::vector<Method> methods_;
  std::vector<Figures> figures_;
  Run first_, first_validation_;
  std::vector<std::vector<Estimate>> drawn_;  // [method], of the first run
};

/// Where a pseudo-linear recursion is locally stable, and what happens at 2 ms where it is not.
[[nodiscard]] report::Section stability(const std::vector<Method>& tracked, std::size_t seeds);

/// The source's errors and gaps that concern both publications.
[[nodiscard]] std::vector<report::Discrepancy> discrepancies();

}  // namespace resonid::reproduction::ii_iii
