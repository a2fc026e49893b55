// SPDX-License-Identifier: MIT
#include <cmath>
#include <resonid/report/detail/truth.hpp>

namespace resonid::report {

SimulatedTruth simulated_truth(plant::Truth truth) {
  SimulatedTruth t{std::move(truth), {}};
  if (!t.truth.controller) return t;
  const auto& loop = t.truth.loop;
  t.margins = diagnostics::loop_margins(loop);
  // At half the sample rate the loop is real: it may end at -180 degrees without crossing them.
  const std::complex<double> end = loop.value.back();
  if (end.real() < 0.0) {
    const double db = -20.0 * std::log10(-end.real());
    if (!t.margins.gain_margin_db || db < *t.margins.gain_margin_db) t.margins.gain_margin_db = db;
  }
  return t;
}

}  // namespace resonid::report
