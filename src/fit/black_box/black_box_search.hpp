// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <fit/black_box/black_box_problem.hpp>
#include <vector>

namespace resonid::fit::detail {

struct BlackBoxSearch {
  BlackBoxState state;
  BlackBoxEvaluation evaluation;
  bool converged = false;
};

struct SearchEffort {
  int iterations = 60;
  double tolerance = 1e-13;  ///< Predicted relative decrease of the cost at which the search ends.
};

/// Levenberg-Marquardt with the linear part solved at every trial. Poles stay inside 1 + a few/samples, so a
/// free integrator is found and a run-away is not.
[[nodiscard]] BlackBoxSearch search(const BlackBoxProblem& problem, BlackBoxState start,
                                    const SearchEffort& effort);

/// The same from poles that may be far off: Steiglitz-McBride iterations first.
[[nodiscard]] BlackBoxSearch search_near(const BlackBoxProblem& problem, BlackBoxState start,
                                         const SearchEffort& effort);

/// Poles of several starts, each brought near by Steiglitz-McBride iterations, the best ones refined by
/// search().
[[nodiscard]] BlackBoxSearch search_from_scratch(const BlackBoxProblem& problem, const SearchEffort& effort);

/// A state at rest with given poles; its weights are found by the first evaluation.
[[nodiscard]] BlackBoxState state_with_poles(const BlackBoxProblem& problem,
                                             const std::vector<std::complex<double>>& poles);

}  // namespace resonid::fit::detail
