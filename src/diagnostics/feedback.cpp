// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/polynomial.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/diagnostics/detail/feedback.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::diagnostics {
namespace {

constexpr Eigen::Index kAhead = 20;

/// Without its mean and of unit size; the size.
double normalise(std::vector<double>& x) {
  const double n = static_cast<double>(x.size());
  const double centre = mean(x);
  double sum = 0.0;
  for (double& v : x) {
    v -= centre;
    sum += v * v;
  }
  const double size = std::sqrt(sum / n);
  if (size > 0.0)
    for (double& v : x) v /= size;
  return size;
}

/// Triangular factor of the columns [1, y(k-1), u(k-1), ..., y(k-p), u(k-p) | y(k) | u(k), ..., u(k+kAhead)].
class AutoregressionFactor {
 public:
  AutoregressionFactor(const std::vector<double>& u, const std::vector<double>& y, Eigen::Index order)
      : past_(1 + 2 * order), factor_(Eigen::MatrixXd::Zero(columns(), columns())) {
    const auto last = static_cast<Eigen::Index>(u.size()) - kAhead;
    constexpr Eigen::Index kBlock = 1024;
    for (Eigen::Index first = order; first < last; first += kBlock) {
      const Eigen::Index count = std::min(kBlock, last - first);
      Eigen::MatrixXd rows(columns() + count, columns());
      rows.topRows(columns()) = factor_;
      auto block = rows.bottomRows(count);
      const auto from = [&](const std::vector<double>& x, Eigen::Index lag) {
        return Eigen::Map<const Eigen::VectorXd>(x.data() + first - lag, count);
      };
      block.col(0).setOnes();
      for (Eigen::Index i = 1; i <= order; ++i) {
        block.col(2 * i - 1) = from(y, i);
        block.col(2 * i) = from(u, i);
      }
      block.col(past_) = from(y, 0);
      for (Eigen::Index j = 0; j <= kAhead; ++j) block.col(past_ + 1 + j) = from(u, -j);
      factor_ = linalg::upper_factor(rows);
    }
    rows_ = static_cast<double>(last - order);
  }

  [[nodiscard]] Eigen::Index past() const { return past_; }
  [[nodiscard]] Eigen::Index columns() const { return past_ + 2 + kAhead; }
  [[nodiscard]] double rows() const { return rows_; }
  [[nodiscard]] const Eigen::MatrixXd& matrix() const { return factor_; }

  /// With y(k) behind all the others.
  [[nodiscard]] Eigen::MatrixXd with_output_last() const {
    Eigen::MatrixXd moved = factor_;
    moved.middleCols(past_, kAhead + 1) = factor_.rightCols(kAhead + 1);
    moved.rightCols(1) = factor_.col(past_);
    return linalg::upper_factor(moved);
  }

 private:
  Eigen::Index past_;
  Eigen::MatrixXd factor_;
  double rows_ = 0.0;
};

/// Coefficients of the regression of column `of` on those before it.
Eigen::VectorXd regression(const Eigen::MatrixXd& factor, Eigen::Index of) {
  return linalg::PivotedQr(factor.topLeftCorner(of, of)).solve(factor.col(of).head(of));
}

}  // namespace

std::complex<double> Feedback::response(double frequency_hz) const {
  const auto z = std::polar(1.0, -kTwoPi * frequency_hz * sample_time_s);
  return z * polynomial(b, z) / (1.0 - z * polynomial(a, z));
}

std::complex<double> Feedback::direct_bias(double frequency_hz) const {
  const auto z = std::polar(1.0, -kTwoPi * frequency_hz * sample_time_s);
  const auto output = 1.0 - z * polynomial(a, z), input = 1.0 - z * polynomial(c, z);
  const auto forward = z * polynomial(b, z), backward = polynomial(d, z);
  // But for the common determinant: u = output w + backward e, y = forward w + input e.
  const double by_e = output_variance * std::norm(backward);
  const double power = input_variance * std::norm(output) + by_e;
  const auto cross =
      input_variance * forward * std::conj(output) + output_variance * input * std::conj(backward);
  return cross / power * output / forward - 1.0;
}

double Feedback::noise_share(double frequency_hz) const {
  const auto z = std::polar(1.0, -kTwoPi * frequency_hz * sample_time_s);
  const double by_e = output_variance * std::norm(polynomial(d, z));
  const double by_w = input_variance * std::norm(1.0 - z * polynomial(a, z));
  return by_e / (by_e + by_w);
}

expected<Feedback, Error> find_feedback(const data::Record& record, double known_delay_s) {
  constexpr std::size_t kMost = 100000, kOrder = 40, kPerCoefficient = 10;
  const double delay = known_delay_s * record.sample_rate_hz;
  const std::size_t order = kOrder + static_cast<std::size_t>(std::max(0.0, std::ceil(delay)));
  const std::size_t n = std::min(kMost, record.samples());
  if (record.input.samples.size() != record.samples())
    return refuse("record", "needs an input of the output's length");
  if (n < kPerCoefficient * (2 * order + 3 + static_cast<std::size_t>(kAhead)))
    return refuse("record", "needs ten samples per coefficient", static_cast<double>(n));
  const auto part = [n](const std::vector<double>& x) {
    return std::vector<double>(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(n));
  };
  auto u = part(record.input.samples), y = part(record.output.samples);
  const double input_size = normalise(u), output_size = normalise(y);
  if (!(input_size > 0.0) || !(output_size > 0.0)) return refuse("record", "input and output must move");
  if (!std::isfinite(input_size) || !std::isfinite(output_size)) return refuse("record", "must be finite");

  const AutoregressionFactor factor(u, y, static_cast<Eigen::Index>(order));
  const Eigen::Index past = factor.past();
  const double freedom = factor.rows() - static_cast<double>(factor.columns());
  Feedback f;
  f.samples = factor.rows();
  f.sample_time_s = record.sample_time_s();
  const double ratio = output_size / input_size;
  const Eigen::VectorXd of_output = regression(factor.matrix(), past);
  const Eigen::VectorXd of_input = regression(factor.matrix(), past + 1);
  f.d.push_back(of_input(past) / ratio);
  for (Eigen::Index i = 1; i < past; i += 2) {
    f.a.push_back(of_output(i));
    f.b.push_back(of_output(i + 1) * ratio);
    f.d.push_back(of_input(i) / ratio);
    f.c.push_back(of_input(i + 1));
  }
  const double left_output = std::abs(factor.matrix()(past, past)) / std::sqrt(factor.rows());
  const double left_input = std::abs(factor.matrix()(past + 1, past + 1)) / std::sqrt(factor.rows());
  f.output_variance = std::pow(left_output * output_size, 2);
  f.input_variance = std::pow(left_input * input_size, 2);
  constexpr double kRounding = 1e-6;
  if (left_output < kRounding) return f;

  const Eigen::MatrixXd later = factor.with_output_last();
  const auto found = later.col(factor.columns() - 1);
  const double variance = std::pow(found(factor.columns() - 1), 2) / freedom;
  const bool opposes = found(past) * later(past, past) < 0.0 || delay >= 1.0;
  const double at_once = opposes ? found(past) * found(past) : 0.0;
  const double explained = at_once + found.segment(past + 1, kAhead).squaredNorm();
  f.probability = chi_square_tail(explained / variance, static_cast<std::size_t>(kAhead) + 1);
  f.seen = explained / (explained + variance * freedom);
  return f;
}

}  // namespace resonid::diagnostics
