// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <resonid/fit/detail/projected_input.hpp>
#include <span>

#include "linalg/decompositions.hpp"

namespace resonid::fit {
namespace {

using Channels = std::vector<std::span<const double>>;

bool finite(std::span<const double> x) {
  return std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); });
}

bool varies(std::span<const double> x) {
  return std::any_of(x.begin(), x.end(), [&](double v) { return v != x.front(); });
}

/// Columns [1, channels(k), u(k-1), channels(k-1), u(k-2), ...], so that every order is a leading part of the
/// next one and one triangular factor serves them all. The last column is u(k).
class Regression {
 public:
  Regression(std::span<const double> u, const Channels& channels, int order)
      : u_(u), channels_(channels), order_(order) {
    const auto columns = static_cast<Eigen::Index>(parameters(order)) + 1;
    factor_ = Eigen::MatrixXd::Zero(columns, columns);
    constexpr std::size_t kBlock = 1024;
    for (std::size_t k = static_cast<std::size_t>(order); k < u.size(); k += kBlock)
      add(k, std::min(kBlock, u.size() - k));
  }

  [[nodiscard]] std::size_t parameters(int order) const {
    return 1 + channels_.size() + static_cast<std::size_t>(order) * (1 + channels_.size());
  }

  /// Least-squares coefficients of an order, in the order of the columns.
  [[nodiscard]] Eigen::VectorXd solve(int order) const {
    const auto n = static_cast<Eigen::Index>(parameters(order));
    const Eigen::MatrixXd r = factor_.topLeftCorner(n, n);
    Eigen::VectorXd scale = r.colwise().norm().transpose();
    for (double& s : scale)
      if (!(s > 0.0)) s = 1.0;
    const Eigen::MatrixXd scaled = r * scale.cwiseInverse().asDiagonal();
    const Eigen::VectorXd right = factor_.col(factor_.cols() - 1).head(n);
    return scale.cwiseInverse().asDiagonal() * linalg::PivotedQr(scaled).solve(right);
  }

 private:
  void add(std::size_t first, std::size_t count) {
    const auto columns = factor_.cols();
    Eigen::MatrixXd rows(columns + static_cast<Eigen::Index>(count), columns);
    rows.topRows(columns) = factor_;
    for (std::size_t j = 0; j < count; ++j) {
      const std::size_t k = first + j;
      const Eigen::Index row = columns + static_cast<Eigen::Index>(j);
      Eigen::Index column = 0;
      rows(row, column++) = 1.0;
      for (const auto& channel : channels_) rows(row, column++) = channel[k];
      for (int i = 1; i <= order_; ++i) {
        rows(row, column++) = u_[k - static_cast<std::size_t>(i)];
        for (const auto& channel : channels_) rows(row, column++) = channel[k - static_cast<std::size_t>(i)];
      }
      rows(row, column) = u_[k];
    }
    factor_ = linalg::upper_factor(rows);
  }

  std::span<const double> u_;
  const Channels& channels_;
  int order_;
  Eigen::MatrixXd factor_;
};

struct Simulation {
  std::vector<double> input;
  double bic = std::numeric_limits<double>::infinity();
};

Simulation simulate(std::span<const double> u, const Channels& channels, int order,
                    const Eigen::VectorXd& theta) {
  Simulation s{{u.begin(), u.end()}, std::numeric_limits<double>::infinity()};
  double left = 0.0;
  for (auto k = static_cast<std::size_t>(order); k < u.size(); ++k) {
    Eigen::Index column = 0;
    double value = theta(column++);
    for (const auto& channel : channels) value += theta(column++) * channel[k];
    for (int i = 1; i <= order; ++i) {
      value += theta(column++) * s.input[k - static_cast<std::size_t>(i)];
      for (const auto& channel : channels)
        value += theta(column++) * channel[k - static_cast<std::size_t>(i)];
    }
    s.input[k] = value;
    left += (u[k] - value) * (u[k] - value);
    if (!(left < 1e200)) return s;
  }
  const double n = static_cast<double>(u.size() - static_cast<std::size_t>(order));
  s.bic = n * std::log(std::max(left / n, 1e-300)) + static_cast<double>(theta.size()) * std::log(n);
  return s;
}

}  // namespace

expected<std::vector<double>, Error> projected_input(const data::Record& record) {
  const auto& u = record.input.samples;
  if (u.size() < 200) return refuse("record", "needs at least 200 samples", static_cast<double>(u.size()));
  if (!finite(u)) return refuse("record", "input must be finite");
  Channels channels;
  for (const auto* channel : {&record.excitation, &record.reference}) {
    if (!channel->present()) continue;
    if (channel->samples.size() != u.size()) return refuse("record", "channels must be equally long");
    if (!finite(channel->samples)) return refuse("record", "excitation and reference must be finite");
    if (varies(channel->samples)) channels.emplace_back(channel->samples);
  }
  if (channels.empty()) return refuse("record", "needs an excitation or a reference that varies");

  // Long records pay with the order: the cost is samples times columns squared.
  const double n = static_cast<double>(u.size());
  const double columns =
      std::min({60.0 * static_cast<double>(1 + channels.size()), std::sqrt(4e9 / n), n / 10.0});
  const int highest = std::max(1, static_cast<int>(columns / static_cast<double>(1 + channels.size())));
  const Regression regression(u, channels, highest);
  Simulation best;
  double total = 0.0, mean = 0.0;
  for (const double v : u) mean += v / n;
  for (const double v : u) total += (v - mean) * (v - mean);
  // What explains less than the mean does is no model: its order is skipped.
  best.bic = n * std::log(std::max(total / n, 1e-300)) + std::log(n);
  for (int order = 1; order <= highest; order += order < 12 ? 1 : (order < 24 ? 2 : 4))
    if (auto s = simulate(u, channels, order, regression.solve(order)); s.bic < best.bic) best = std::move(s);
  if (best.input.empty())
    return refuse("record", "excitation and reference have no predictive power for the input");
  return std::move(best.input);
}

}  // namespace resonid::fit
