// SPDX-License-Identifier: MIT
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <identification/joint_model.hpp>
#include <numeric>
#include <resonid/fit/chi_square.hpp>
#include <resonid/fit/output_error.hpp>

namespace resonid::identification::detail {
namespace {

using fit::DriveModel;

/// Estimated parameters in coordinates in which they are nearly Gaussian, with their covariance: logarithms
/// of the positive ones.
struct Coordinates {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;
};

bool logarithmic(int parameter) { return parameter != fit::kViscousFriction && parameter != fit::kDelay; }

std::vector<int> estimated(const DriveModel& model) {
  std::vector<int> list;
  for (int i = 0; i < fit::kParameterCount; ++i)
    if (model.estimated[static_cast<std::size_t>(i)]) list.push_back(i);
  return list;
}

std::optional<Coordinates> coordinates(const DriveModel& model, const std::vector<int>& parameters) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  Coordinates c{Eigen::VectorXd(n), Eigen::MatrixXd(n, n)};
  Eigen::VectorXd scale(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int p = parameters[static_cast<std::size_t>(i)];
    const double value = model.value(static_cast<fit::Parameter>(p));
    c.x(i) = logarithmic(p) ? std::log(value) : value;
    scale(i) = logarithmic(p) ? 1.0 / value : 1.0;
  }
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index k = 0; k < n; ++k)
      c.covariance(i, k) =
          scale(i) * scale(k) *
          model.covariance(parameters[static_cast<std::size_t>(i)], parameters[static_cast<std::size_t>(k)]);
  if (!c.x.allFinite() || !c.covariance.allFinite() || c.covariance.llt().info() != Eigen::Success)
    return std::nullopt;
  return c;
}

/// (sum C_i^-1)^-1 sum C_i^-1 x_i over all but one.
Coordinates combined(const std::vector<Coordinates>& all, std::size_t but) {
  const auto n = all.front().x.size();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(n);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i == but) continue;
    const Eigen::MatrixXd inverse = all[i].covariance.inverse();
    information += inverse;
    sum += inverse * all[i].x;
  }
  const Eigen::MatrixXd covariance = information.inverse();
  return {covariance * sum, covariance};
}

void store(const Coordinates& c, const std::vector<int>& parameters, DriveModel& model) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  model.covariance.setZero();
  Eigen::VectorXd scale(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int p = parameters[static_cast<std::size_t>(i)];
    const double value = logarithmic(p) ? std::exp(c.x(i)) : c.x(i);
    model = model.moved(p, value - model.value(static_cast<fit::Parameter>(p)));
    scale(i) = logarithmic(p) ? value : 1.0;
  }
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index k = 0; k < n; ++k)
      model.covariance(parameters[static_cast<std::size_t>(i)], parameters[static_cast<std::size_t>(k)]) =
          scale(i) * scale(k) * c.covariance(i, k);
}

/// The model that most records show: structure, friction and delay alike. The more richly parametrised one
/// of two that are equally frequent.
std::optional<std::size_t> typical(std::span<const Result> results) {
  std::optional<std::size_t> best;
  std::size_t best_count = 0;
  const auto same = [&](const Result& a, const Result& b) {
    return a.model && b.model && a.model->drive.structure == b.model->drive.structure &&
           a.model->drive.estimated == b.model->drive.estimated;
  };
  const auto size = [&](std::size_t i) { return estimated(results[i].model->drive).size(); };
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (!results[i].model) continue;
    const auto count = static_cast<std::size_t>(
        std::count_if(results.begin(), results.end(), [&](const Result& r) { return same(r, results[i]); }));
    if (!best || count > best_count || (count == best_count && size(i) > size(*best))) {
      best = i;
      best_count = count;
    }
  }
  return best;
}

fit::OutputErrorConfig config_of(const ModelResult& model, const Options& options) {
  fit::OutputErrorConfig config;
  config.initial = model.drive;
  config.viscous_friction = model.drive.estimated[fit::kViscousFriction];
  config.delay = model.drive.estimated[fit::kDelay];
  config.coulomb_friction = model.coulomb_friction.has_value();
  config.known_delay_s = options.delay_s;
  return config;
}

/// The record's own model when it is of the common kind, else a fit of that kind to the record.
std::optional<DriveModel> of_the_kind(const data::Record& record, const Result& result,
                                      const ModelResult& kind, const Options& options) {
  if (result.model && result.model->drive.structure == kind.drive.structure &&
      result.model->drive.estimated == kind.drive.estimated)
    return result.model->drive;
  auto fit = fit::fit_output_error(record, config_of(kind, options));
  if (!fit || !fit->converged) return std::nullopt;
  return fit->model;
}

void compare(const std::vector<Coordinates>& all, const std::vector<std::size_t>& record, double confidence,
             std::vector<JoinedRecord>& told) {
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto others = combined(all, i);
    const Eigen::VectorXd d = all[i].x - others.x;
    const Eigen::MatrixXd covariance = all[i].covariance + others.covariance;
    auto& r = told[record[i]];
    r.degrees = static_cast<std::size_t>(d.size());
    r.chi_square = d.dot(covariance.ldlt().solve(d));
    r.probability = fit::chi_square_tail(*r.chi_square, r.degrees);
    r.agrees = *r.probability > (1.0 - confidence) / static_cast<double>(all.size());
  }
}

/// Simulates the joint model on every record.
double simulated_fit(std::span<const data::Record> records, const ModelResult& model, const Options& options,
                     std::vector<JoinedRecord>& told) {
  double left = 0.0, total = 0.0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    auto config = config_of(model, options);
    config.fixed_model = true;
    config.noise_model = false;
    const auto simulation = fit::fit_output_error(records[i], config);
    if (!simulation) continue;
    told[i].fit_percent = simulation->fit_percent;
    const double power = std::inner_product(simulation->residual.begin(), simulation->residual.end(),
                                            simulation->residual.begin(), 0.0);
    left += power;
    const double ratio = 1.0 - 0.01 * simulation->fit_percent;
    if (ratio > 0.0) total += power / (ratio * ratio);
  }
  return total > 0.0 ? 100.0 * (1.0 - std::sqrt(left / total)) : 0.0;
}

}  // namespace

std::optional<JointModel> joint_model(std::span<const data::Record> records, std::span<const Result> results,
                                      const Options& options, std::vector<JoinedRecord>& told) {
  const auto example = typical(results);
  if (!example) return std::nullopt;
  const ModelResult& kind = *results[*example].model;
  const auto parameters = estimated(kind.drive);
  std::vector<Coordinates> all;
  std::vector<std::size_t> record;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const auto model = of_the_kind(records[i], results[i], kind, options);
    const auto c = model ? coordinates(*model, parameters) : std::nullopt;
    if (!c) {
      told[i].agrees = false;
      continue;
    }
    all.push_back(*c);
    record.push_back(i);
  }
  if (all.size() < 2) return std::nullopt;
  compare(all, record, options.confidence, told);
  JointModel joint{kind, 0.0};
  joint.model.offset.reset();  // each record has its own
  store(combined(all, all.size()), parameters, joint.model.drive);
  if (kind.from_record) joint.fit_percent = simulated_fit(records, joint.model, options, told);
  return joint;
}

}  // namespace resonid::identification::detail
