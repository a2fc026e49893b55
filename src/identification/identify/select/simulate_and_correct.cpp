// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/measure/measure.hpp>
#include <identification/identify/select/record_fit.hpp>
#include <identification/identify/select/simulate_and_correct.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::identification::detail {
namespace {

using Complex = std::complex<double>;

/// The record with the output that the model gives for its input, without noise.
expected<data::Record, Error> simulated_on(const data::Record& record, const ModelResult& model,
                                           double known_delay_s) {
  const auto fit = simulation_by(model, record, known_delay_s);
  if (!fit)
    return tl::unexpected(Error{"method", fmt::format("simulate-and-correct: {} {}", fit.error().field.view(),
                                                      fit.error().requirement.view())});
  // A position that drifts otherwise than its model leaks into every line otherwise, too.
  if (record.output_quantity == data::OutputQuantity::position &&
      fit->fit_percent < kCriteria.correctable_position)
    return tl::unexpected(
        Error{"method",
              fmt::format("simulate-and-correct: the fit of the recorded position is {:.0f} % (NRMSE), which "
                          "drifts by friction or disturbances; required {:.0f} %, or another method",
                          fit->fit_percent, kCriteria.correctable_position)});
  return simulated_record(record, fit->residual);
}

/// Factor that takes the method's bias out, at every line of `measured`.
expected<std::vector<Complex>, Error> factor_of(const data::Record& record,
                                                const data::FrequencyResponse& measured,
                                                const ModelResult& model, double known_delay_s,
                                                const Measure& measure) {
  const auto simulated = simulated_on(record, model, known_delay_s);
  if (!simulated) return tl::unexpected(simulated.error());
  const auto found = measure(*simulated);
  if (!found) return tl::unexpected(found.error());
  const auto known = model.drive.values(measured.frequency_hz, true);
  std::vector<Complex> factor(measured.lines(), 1.0);
  std::size_t k = 0;
  for (std::size_t i = 0; i < measured.lines(); ++i) {
    const double f = measured.frequency_hz[i];
    while (k < found->lines() && found->frequency_hz[k] < f) ++k;
    if (k < found->lines() && found->frequency_hz[k] == f) factor[i] = known[i] / found->value[k];
  }
  return factor;
}

/// Models one standard deviation away along the principal directions of the covariance.
std::vector<fit::DriveModel> neighbours_of(const fit::DriveModel& model) {
  std::vector<fit::DriveModel> neighbours;
  const Eigen::MatrixXd covariance = model.covariance;
  // Scaled: the parameters differ by many powers of ten.
  const Eigen::VectorXd scale = covariance.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::MatrixXd correlation =
      scale.cwiseInverse().asDiagonal() * covariance * scale.cwiseInverse().asDiagonal();
  const auto axes = linalg::symmetric_eigenpairs(correlation);
  for (Eigen::Index k = 0; k < axes.values.size(); ++k) {
    const double size = std::sqrt(std::max(axes.values(k), 0.0));
    if (!(size > 1e-9)) continue;
    fit::DriveModel neighbour = model;
    for (int i = 0; i < fit::kParameterCount; ++i)
      if (model.estimated[static_cast<std::size_t>(i)])
        neighbour = neighbour.moved(i, size * scale(i) * axes.vectors(i, k));
    neighbours.push_back(std::move(neighbour));
  }
  return neighbours;
}

}  // namespace

expected<data::FrequencyResponse, Error> corrected_response(const data::Record& record,
                                                            const data::FrequencyResponse& measured,
                                                            const ModelResult& model, double known_delay_s,
                                                            const Measure& measure, Uncertainty uncertainty) {
  const auto factor = factor_of(record, measured, model, known_delay_s, measure);
  if (!factor) return tl::unexpected(factor.error());
  std::vector<double> variance(measured.lines(), 0.0);  // of the factor
  const auto neighbours =
      uncertainty == Uncertainty::of_model ? neighbours_of(model.drive) : std::vector<fit::DriveModel>();
  for (const auto& neighbour : neighbours) {
    ModelResult beside = model;
    beside.drive = neighbour;
    const auto moved = factor_of(record, measured, beside, known_delay_s, measure);
    if (!moved) return tl::unexpected(moved.error());
    for (std::size_t i = 0; i < variance.size(); ++i) variance[i] += std::norm((*moved)[i] - (*factor)[i]);
  }
  data::FrequencyResponse corrected = measured;
  corrected.smoothing = {};
  for (std::size_t i = 0; i < measured.lines(); ++i) {
    corrected.value[i] *= (*factor)[i];
    if (!corrected.std.empty())
      corrected.std[i] = std::hypot(measured.std[i] * std::abs((*factor)[i]),
                                    std::abs(measured.value[i]) * std::sqrt(variance[i]));
  }
  return corrected;
}

expected<void, Error> simulate_and_correct(const data::Record& record, const Plan& plan,
                                           const Options& options, data::FrequencyResponse& response,
                                           std::optional<Selection>& selection) {
  const auto complain = [](const char* message) { return tl::unexpected(Error{"method", message}); };
  if (options.model == ModelChoice::none)
    return complain("simulate-and-correct needs a model: give .model other than none");
  if (!record.input.present()) return complain("simulate-and-correct needs the recorded input");
  const Measure measure = [&](const data::Record& r) { return measure_response(r, plan, options); };
  const data::FrequencyResponse measured = response;
  constexpr int kRounds = 2;
  for (int round = 0; round < kRounds; ++round) {
    if (!selection)
      return complain("simulate-and-correct needs a model, and none could be fitted to this response");
    auto corrected = corrected_response(record, measured, selection->result, options.delay_s, measure,
                                        Uncertainty::of_model);
    if (!corrected) return tl::unexpected(corrected.error());
    response = std::move(*corrected);
    selection = select_model({&record, 1}, plan, options, response);
  }
  if (!selection) return complain("simulate-and-correct: no model could be fitted to the corrected response");
  return {};
}

}  // namespace resonid::identification::detail
