// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/drive/response_cost.hpp>
#include <fit/drive/response_lines.hpp>
#include <fit/least_squares.hpp>
#include <memory>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/detail/second_output.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit {
namespace {

using Complex = std::complex<double>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::size_t kFewestLines = 4;
constexpr double kShown = 0.5;         // std over |G| of a line that shows the response
constexpr double kLargestLead = 10.0;  // samples by which a second output may come before the output

/// What the output says of the parameters, as rows of a least-squares problem: rows (x - x1).
struct Information {
  Eigen::MatrixXd rows;  ///< [row, coordinate]
  std::array<double, kParameterCount> at{};
};

/// Of the inverse of the covariance, by its eigenvectors once every parameter is scaled to its deviation;
/// what the covariance does not hold to rounding counts as known so well.
Information information_of(const DriveModel& first, const detail::Coordinates& coordinates) {
  Information known{{}, coordinates.from(first)};
  const auto unit = coordinates.jacobian(first);
  std::vector<int> active;
  for (int i = 0; i < kParameterCount; ++i)
    if (first.estimated[static_cast<std::size_t>(i)] && first.covariance(i, i) > 0.0) active.push_back(i);
  const auto n = static_cast<Eigen::Index>(active.size());
  known.rows = Eigen::MatrixXd::Zero(n, kParameterCount);
  if (n == 0) return known;
  const auto of = [&](Eigen::Index i) { return active[static_cast<std::size_t>(i)]; };
  Eigen::VectorXd scale(n);
  for (Eigen::Index i = 0; i < n; ++i) scale(i) = std::sqrt(first.covariance(of(i), of(i)));
  Eigen::MatrixXd correlation(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      correlation(i, j) = first.covariance(of(i), of(j)) / (scale(i) * scale(j));
  const auto axes = linalg::symmetric_eigenpairs(correlation);
  constexpr double kRounding = 1e-12;
  for (Eigen::Index k = 0; k < n; ++k)
    for (Eigen::Index i = 0; i < n; ++i)
      known.rows(k, of(i)) = axes.vectors(i, k) / std::sqrt(std::max(axes.values(k), kRounding)) *
                             unit[static_cast<std::size_t>(of(i))] / scale(i);
  return known;
}

data::FrequencyResponse without_values(data::FrequencyResponse g) {
  std::fill(g.value.begin(), g.value.end(), Complex());
  return g;
}

/// The lines of the second output, then what the output says. Coordinates of the drive, gain, delay in
/// samples.
template <int Masses>
class SecondOutputCost : public ceres::CostFunction {
 public:
  static constexpr int kDrive = detail::Sizes<Masses>::kParameters;
  static constexpr int kGain = kDrive, kOwnDelay = kDrive + 1, kAll = kDrive + 2;

  SecondOutputCost(const data::FrequencyResponse& lines, std::vector<double> weights,
                   const Information& known, double known_delay_s, const detail::Coordinates& coordinates,
                   const detail::ResponseSetting& setting, std::vector<int> active)
      : lines_(lines),
        model_lines_(without_values(lines)),
        known_(known),
        model_(model_lines_, std::move(weights), detail::points_of(lines, known_delay_s), coordinates,
               detail::SearchRange(known.at), setting, std::move(active)) {
    mutable_parameter_block_sizes()->push_back(kAll);
    set_num_residuals(static_cast<int>(2 * lines.lines()) + static_cast<int>(known.rows.rows()));
  }

  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override {
    const double* const x = blocks[0];
    std::array<double, kDrive> drive;
    std::copy_n(x, kDrive, drive.begin());
    drive[kDelay] += x[kOwnDelay];
    const double gain = x[kGain];
    const auto rows = static_cast<Eigen::Index>(2 * lines_.lines()), told = known_.rows.rows();
    RowMajor slopes(rows, kDrive);
    const double* block = drive.data();
    double* by_drive = slopes.data();
    const bool differentiate = jacobians != nullptr && jacobians[0] != nullptr;
    if (!model_.Evaluate(&block, residual, differentiate ? &by_drive : nullptr)) return false;
    Eigen::Map<Eigen::VectorXd> all(residual, rows + told);
    const Eigen::VectorXd expected = all.head(rows);
    for (std::size_t i = 0; i < lines_.lines(); ++i) {
      const auto at = static_cast<Eigen::Index>(2 * i);
      all(at) = gain * expected(at) - model_.weight(i) * lines_.value[i].real();
      all(at + 1) = gain * expected(at + 1) - model_.weight(i) * lines_.value[i].imag();
    }
    const Eigen::MatrixXd information = known_.rows.leftCols(kDrive);
    all.tail(told) = information * (Eigen::Map<const Eigen::VectorXd>(x, kDrive) -
                                    Eigen::Map<const Eigen::VectorXd>(known_.at.data(), kDrive));
    if (!differentiate) return true;
    Eigen::Map<RowMajor> by(jacobians[0], rows + told, kAll);
    by.setZero();
    by.topLeftCorner(rows, kDrive) = gain * slopes;
    by.col(kGain).head(rows) = expected;
    by.col(kOwnDelay).head(rows) = gain * slopes.col(kDelay);
    by.bottomLeftCorner(told, kDrive) = information;
    return true;
  }

 private:
  const data::FrequencyResponse& lines_;
  const data::FrequencyResponse model_lines_;
  const Information& known_;
  const detail::ResponseCost<Masses> model_;
};

/// Factor of the whole that the model lacks: by the middle of the magnitudes, the sign by the phases.
double scale_of(const data::FrequencyResponse& g, const std::vector<Complex>& expected) {
  std::vector<double> ratios;
  double direction = 0.0;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const double size = std::abs(expected[i]), measured = std::abs(g.value[i]);
    if (!(size > 0.0) || !(g.std[i] < 0.5 * measured)) continue;
    ratios.push_back(measured / size);
    direction += (g.value[i] / expected[i]).real() / ratios.back();
  }
  return ratios.empty() ? 1.0 : std::copysign(median(std::move(ratios)), direction);
}

struct Fitter {
  const DriveModel& first;
  const data::FrequencyResponse& lines;
  const SecondOutputConfig& config;
  detail::Coordinates coordinates;
  Information known;

  Fitter(const DriveModel& of_output, const data::FrequencyResponse& second, const SecondOutputConfig& with)
      : first(of_output), lines(second), config(with), coordinates(coordinates_of(of_output, second)) {
    known = information_of(first, coordinates);
  }

  static detail::Coordinates coordinates_of(const DriveModel& model, const data::FrequencyResponse& g) {
    const double omega = kTwoPi * g.frequency_hz.front();
    return {model.parameters.driven_inertia * omega, model.sample_time_s,
            model.parameters.driven_inertia * omega * omega};
  }

  [[nodiscard]] std::vector<Complex> expected_by(const SecondOutputFit& fit) const {
    DriveModel model = fit.model;
    model.delay_s += fit.delay_s.value;
    auto values = detail::as_measured(lines, model, config.kind);
    for (auto& v : values) v *= fit.gain.value;
    return values;
  }

  /// By the lines that show the expected response at all: an error of noise is not one of the model.
  [[nodiscard]] double error_of(const SecondOutputFit& fit) const {
    const auto expected = expected_by(fit);
    data::FrequencyResponse shown;
    std::vector<Complex> of_shown;
    for (std::size_t i = 0; i < lines.lines(); ++i) {
      if (!(lines.std[i] < kShown * std::abs(expected[i]))) continue;
      shown.frequency_hz.push_back(lines.frequency_hz[i]);
      shown.value.push_back(lines.value[i]);
      shown.std.push_back(lines.std[i]);
      of_shown.push_back(expected[i]);
    }
    if (shown.lines() == 0) return 0.0;
    return detail::explaining_error(shown, of_shown, 1.0,
                                    static_cast<double>(shown.lines()) / detail::known_repetition(lines));
  }

  /// Lines that repeat one another are weighted as the fewer that they are worth.
  [[nodiscard]] SecondOutputFit run(const SecondOutputFit& start, double error, double repeated) const {
    SecondOutputFit fit = start;
    fit.model_error = error;
    const double step = first.sample_time_s;
    const auto& estimated = first.estimated;
    const detail::ResponseSetting setting{
        step,
        first.known_delay_s / step,
        estimated[kTorqueLag] || first.torque_lag_s > 0.0 ? detail::Lag::first_order : detail::Lag::none,
        first.grounded() || estimated[kMotorGroundStiffness] || estimated[kLoadGroundStiffness],
        first.velocity,
        config.kind};
    auto weight = detail::weights(lines, Weighting::model_error, error);
    for (double& w : weight) w /= std::sqrt(repeated);
    detail::with_masses(first.structure, [&](auto masses) {
      using Cost = SecondOutputCost<masses>;
      std::array<double, Cost::kAll> x{};
      std::array<bool, Cost::kAll> active{};
      std::vector<int> slopes = {kDelay};
      const auto from = coordinates.from(start.model);
      std::copy_n(from.begin(), Cost::kDrive, x.begin());
      for (int i = 0; i < Cost::kDrive; ++i) {
        active[static_cast<std::size_t>(i)] = estimated[static_cast<std::size_t>(i)];
        if (active[static_cast<std::size_t>(i)] && i != kDelay) slopes.push_back(i);
      }
      x[Cost::kGain] = start.gain.value;
      x[Cost::kOwnDelay] = start.delay_s.value / step;
      active[Cost::kGain] = config.gain;
      active[Cost::kOwnDelay] = config.delay;
      std::vector<detail::Bound> bounds;
      if (estimated[kDelay])
        bounds.push_back({kDelay, detail::kMinimumDelaySamples, detail::kMaximumDelaySamples});
      if (estimated[kTorqueLag]) bounds.push_back({kTorqueLag, 0.0, detail::kMaximumLagSamples});
      if (estimated[kOutputFilter]) bounds.push_back({kOutputFilter, 0.0, detail::kMaximumFilterPole});
      if (config.delay) bounds.push_back({Cost::kOwnDelay, -kLargestLead, detail::kMaximumDelaySamples});
      const auto solution = detail::minimise(
          std::make_unique<Cost>(lines, weight, known, first.known_delay_s, coordinates, setting, slopes), x,
          active, bounds);
      fit.converged = solution.converged;
      std::array<double, kParameterCount> drive = known.at;
      std::copy_n(x.begin(), Cost::kDrive, drive.begin());
      coordinates.store(drive.data(), fit.model);
      const Eigen::MatrixXd covariance = detail::covariance(solution, Cost::kAll);
      const auto unit = coordinates.jacobian(fit.model);
      fit.model.covariance.setZero();
      for (int i = 0; i < Cost::kDrive; ++i)
        for (int j = 0; j < Cost::kDrive; ++j)
          fit.model.covariance(i, j) =
              covariance(i, j) * unit[static_cast<std::size_t>(i)] * unit[static_cast<std::size_t>(j)];
      fit.gain = {x[Cost::kGain], std::sqrt(std::max(0.0, covariance(Cost::kGain, Cost::kGain)))};
      fit.delay_s = {x[Cost::kOwnDelay] * step,
                     step * std::sqrt(std::max(0.0, covariance(Cost::kOwnDelay, Cost::kOwnDelay)))};
      const Eigen::VectorXd moved = Eigen::Map<const Eigen::VectorXd>(drive.data(), kParameterCount) -
                                    Eigen::Map<const Eigen::VectorXd>(known.at.data(), kParameterCount);
      // The part of the first output's covariance, in its own units, that the second one takes away.
      const auto own = known.rows.leftCols(Cost::kDrive);
      const Eigen::MatrixXd both =
          own * covariance.topLeftCorner(Cost::kDrive, Cost::kDrive) * own.transpose();
      const auto parts =
          linalg::symmetric_eigenpairs(Eigen::MatrixXd::Identity(both.rows(), both.cols()) - both);
      const Eigen::VectorXd along = parts.vectors.transpose() * (known.rows * moved);
      constexpr double kSomething = 0.1;
      fit.contradiction = 0.0;
      fit.directions = 0;
      for (Eigen::Index i = 0; i < along.size(); ++i) {
        const double taken = parts.values(i);
        if (!(taken > kSomething)) continue;
        fit.contradiction += along(i) * along(i) / taken;
        ++fit.directions;
      }
    });
    return fit;
  }

  /// From a soft weighting towards the lines' own: what is far off must not pull at what the output says.
  [[nodiscard]] SecondOutputFit settle() const {
    SecondOutputFit fit;
    fit.model = first;
    if (config.gain) fit.gain.value = scale_of(lines, expected_by(fit));
    const double repeated = detail::known_repetition(lines);
    double error = error_of(fit), most = repeated;
    for (int round = 0; round < 12; ++round) {
      fit = run(fit, error, most);
      const double next = error_of(fit);
      const double repeats = std::max(repeated, detail::repetition(lines, next, expected_by(fit)));
      const bool settled =
          std::abs(next - error) <= 1e-3 * error + 1e-9 && std::abs(repeats - most) <= 0.1 * most;
      error = next;
      most = repeats;
      if (settled) break;
    }
    return fit;
  }
};

}  // namespace

std::vector<Complex> load_values(const DriveModel& model, data::SecondOutput kind,
                                 std::span<const double> frequencies_hz) {
  const double step = model.sample_time_s;
  return detail::with_masses(model.structure, [&](auto masses) {
    const detail::MeasuredResponse<masses> measured(
        model.parameters, model.delay_s / step, model.torque_lag_s / step, 0.0,
        {step, model.known_delay_s / step,
         model.torque_lag_s > 0.0 ? detail::Lag::first_order : detail::Lag::none, model.grounded(),
         model.velocity, kind});
    return measured.values(frequencies_hz);
  });
}

expected<SecondOutputFit, Error> fit_second_output(const DriveModel& first,
                                                   const data::FrequencyResponse& second,
                                                   const SecondOutputConfig& config) {
  if (config.kind == data::SecondOutput::none) return refuse("kind", "must say what the output is");
  if (second.lines() < kFewestLines || second.std.size() != second.lines())
    return refuse("second", "needs standard deviations and at least 4 lines",
                  static_cast<double>(second.lines()));
  const Fitter fitter(first, second, config);
  if (fitter.known.rows.rows() == 0) return refuse("first", "needs estimated parameters with a covariance");
  return fitter.settle();
}

}  // namespace resonid::fit
