// SPDX-License-Identifier: MIT
#include <Eigen/Eigenvalues>
#include <cmath>
#include <identification/linear_simulation.hpp>
#include <identification/simulate_and_correct.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/gap.hpp>

namespace resonid::identification::detail {
namespace {

using Complex = std::complex<double>;

/// The model from torque to the recorded quantity, its delays in whole samples.
data::TransferFunction recorded_quantity(const fit::DriveModel& model, data::OutputQuantity quantity,
                                         double known_delay_s) {
  auto g = model.transfer_function();
  const double step = g.sample_time_s;
  // Inverse of response::velocity_factor.
  if (quantity == data::OutputQuantity::position)
    g = diagnostics::weighted({{0.5 * step, 0.5 * step}, {1.0, -1.0}, step}, g);
  if (quantity == data::OutputQuantity::acceleration)
    g = diagnostics::weighted({{1.0 / step, -1.0 / step}, {1.0}, step}, g);
  const double samples = std::round((known_delay_s + model.delay_s) / step);
  return delayed(std::move(g), static_cast<std::size_t>(std::max(0.0, samples)));
}

/// Factor that takes the method's bias out, at every line of `measured`.
expected<std::vector<Complex>, Refusal> factor_of(const data::Record& record,
                                                  const data::FrequencyResponse& measured,
                                                  const fit::DriveModel& model, double known_delay_s,
                                                  const Measure& measure) {
  const auto g = recorded_quantity(model, record.output_quantity, known_delay_s);
  data::Record simulated = record;
  simulated.output.samples = simulate_nearest(g, record.input.samples, record.output.samples, true).output;
  const auto found = measure(simulated);
  if (!found) return tl::unexpected(found.error());
  std::vector<Complex> factor(measured.lines(), 1.0);
  std::size_t k = 0;
  for (std::size_t i = 0; i < measured.lines(); ++i) {
    const double f = measured.frequency_hz[i];
    while (k < found->lines() && found->frequency_hz[k] < f) ++k;
    if (k == found->lines() || found->frequency_hz[k] != f) continue;
    const Complex advance = std::polar(1.0, kTwoPi * f * known_delay_s);
    const Complex velocity = response::velocity_factor(record.output_quantity, f, model.sample_time_s);
    factor[i] = g.response(f) * velocity * advance / found->value[k];
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
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(correlation);
  for (Eigen::Index k = 0; k < solver.eigenvalues().size(); ++k) {
    const double size = std::sqrt(std::max(solver.eigenvalues()(k), 0.0));
    if (!(size > 1e-9)) continue;
    fit::DriveModel neighbour = model;
    for (int i = 0; i < fit::kParameterCount; ++i)
      if (model.estimated[static_cast<std::size_t>(i)])
        neighbour = neighbour.moved(i, size * scale(i) * solver.eigenvectors()(i, k));
    neighbours.push_back(std::move(neighbour));
  }
  return neighbours;
}

}  // namespace

expected<data::FrequencyResponse, Refusal> corrected_response(const data::Record& record,
                                                              const data::FrequencyResponse& measured,
                                                              const fit::DriveModel& model,
                                                              double known_delay_s, const Measure& measure) {
  const auto factor = factor_of(record, measured, model, known_delay_s, measure);
  if (!factor) return tl::unexpected(factor.error());
  std::vector<double> variance(measured.lines(), 0.0);  // of the factor
  for (const auto& neighbour : neighbours_of(model)) {
    const auto moved = factor_of(record, measured, neighbour, known_delay_s, measure);
    if (!moved) return tl::unexpected(moved.error());
    for (std::size_t i = 0; i < variance.size(); ++i) variance[i] += std::norm((*moved)[i] - (*factor)[i]);
  }
  data::FrequencyResponse corrected = measured;
  corrected.smoothing = {};
  for (std::size_t i = 0; i < measured.lines(); ++i) {
    corrected.value[i] *= (*factor)[i];
    if (!corrected.standard_deviation.empty())
      corrected.standard_deviation[i] = std::hypot(measured.standard_deviation[i] * std::abs((*factor)[i]),
                                                   std::abs(measured.value[i]) * std::sqrt(variance[i]));
  }
  return corrected;
}

expected<void, Refusal> simulate_and_correct(const data::Record& record, const Plan& plan,
                                             const Options& options, data::FrequencyResponse& response,
                                             std::optional<Selection>& selection) {
  const auto complain = [](const char* message) { return tl::unexpected(Refusal{"method", message}); };
  if (options.model == ModelChoice::none)
    return complain("simulate-and-correct needs a model: give --model other than none");
  if (!record.input.present()) return complain("simulate-and-correct needs the recorded input");
  const Measure measure = [&](const data::Record& r) -> expected<data::FrequencyResponse, Refusal> {
    const auto done = detail::measure(r, plan, options);
    if (!done) return tl::unexpected(done.error());
    auto found = response::plant_response(done->lines, {plan.approach, options.controller, options.delay_s});
    if (!found) return tl::unexpected(Refusal{"approach", std::string(found.error().requirement)});
    return std::move(*found);
  };
  const data::FrequencyResponse measured = response;
  constexpr int kRounds = 2;
  for (int round = 0; round < kRounds; ++round) {
    if (!selection)
      return complain("simulate-and-correct needs a model, and none could be fitted to this response");
    auto corrected = corrected_response(record, measured, selection->result.drive, options.delay_s, measure);
    if (!corrected) return tl::unexpected(corrected.error());
    response = std::move(*corrected);
    selection = select_model(record, plan, options, response);
  }
  if (!selection) return complain("simulate-and-correct: no model could be fitted to the corrected response");
  return {};
}

}  // namespace resonid::identification::detail
