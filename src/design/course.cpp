// SPDX-License-Identifier: MIT
#include "design/course.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/decompositions.hpp"

namespace resonid::design {
namespace {

constexpr std::size_t kFine = 20'000;  // samples that are looked at one by one
constexpr double kTimeConstants = 40.0, kMostSamples = 2e6;

/// Samples that may be taken at once after kFine of them: a small part of the time constant and of the period
/// of every mode that is left.
std::size_t stride_of(const Eigen::MatrixXd& a) {
  constexpr double kGone = 1e-12, kPartOfTime = 1e-3, kTurn = 0.01, kLongest = 1e9;
  double longest = kLongest;
  for (const auto& pole : linalg::eigenvalues(a)) {
    const double decay = -std::log(std::abs(pole));
    if (decay * static_cast<double>(kFine) > -std::log(kGone)) continue;
    longest = std::min({longest, kPartOfTime / std::max(decay, 1e-12), kTurn / std::abs(std::arg(pole))});
  }
  std::size_t stride = 1;
  while (2.0 * static_cast<double>(stride) <= longest) stride *= 2;
  return stride;
}

/// One sample with the constant as its last state.
Eigen::MatrixXd with_constant(const Eigen::MatrixXd& a, const Eigen::VectorXd& input) {
  const Eigen::Index n = a.rows();
  Eigen::MatrixXd step = Eigen::MatrixXd::Identity(n + 1, n + 1);
  step.topLeftCorner(n, n) = a;
  step.topRightCorner(n, 1) = input;
  return step;
}

/// Rows that tell y 1, 2, 4, ... samples ahead of [state; 1], up to so many.
Eigen::MatrixXd rows_ahead(const Eigen::MatrixXd& a, const Eigen::VectorXd& input,
                           const Eigen::RowVectorXd& output, double samples) {
  const Eigen::Index n = a.rows();
  const auto count = static_cast<Eigen::Index>(std::ceil(std::log2(std::max(2.0, samples))));
  Eigen::MatrixXd rows(count, n + 1), step = with_constant(a, input);
  for (Eigen::Index i = 0; i < count; ++i) {
    rows.row(i).noalias() = output * step.topRows(n);
    if (i + 1 < count) step = (step * step).eval();
  }
  return rows;
}

/// x' = step x with the constant as its last state; y summed up over a step.
struct Strides {
  Eigen::MatrixXd step, sum;

  Strides(const Eigen::MatrixXd& a, const Eigen::VectorXd& input, std::size_t stride) {
    step = with_constant(a, input);
    sum = Eigen::MatrixXd::Identity(step.rows(), step.cols());
    for (std::size_t taken = 1; taken < stride; taken *= 2) {
      sum += (step * sum).eval();
      step = (step * step).eval();
    }
  }
};

}  // namespace

std::size_t most_samples(double spectral_radius) {
  const double decay = -std::log(std::min(spectral_radius, 1.0 - 1e-7));
  return static_cast<std::size_t>(std::clamp(kTimeConstants / decay, 100.0, kMostSamples));
}

Course course_of(const Eigen::MatrixXd& a, const Eigen::VectorXd& input, const Eigen::RowVectorXd& output,
                 double spectral_radius, double settled, std::size_t quiet) {
  const Eigen::Index n = a.rows();
  const std::size_t most = most_samples(spectral_radius);
  const double decay = -std::log(std::min(spectral_radius, 1.0 - 1e-12));
  Course course;
  Eigen::VectorXd whole(n + 1), after(n + 1);
  Eigen::VectorXd state = Eigen::VectorXd::Zero(n), next(n);
  Eigen::MatrixXd ahead;
  std::size_t still = 0, k = 0;
  const auto is_small = [&](double y) {
    return std::abs(y) < settled * std::max(course.highest, -course.lowest);
  };
  const auto take = [&](double y, double sum, std::size_t samples) {
    course.absolute += std::abs(sum);
    course.sum += sum;
    course.highest = std::max(course.highest, y);
    course.lowest = std::min(course.lowest, y);
    still = k > 10 && is_small(y) ? still + samples : 0;
  };
  // Where a slow tail changes its sign, y is small for a while, and large again later. Over a time constant
  // no tail hides so.
  const auto is_over = [&] {
    if (still < quiet) return false;
    if (static_cast<double>(quiet) * decay >= 1.0) return true;
    if (ahead.size() == 0) ahead = rows_ahead(a, input, output, kTimeConstants / decay);
    if (is_small((ahead * whole).cwiseAbs().maxCoeff())) return true;
    still = 0;
    return false;
  };
  const auto is_over_at = [&](const Eigen::VectorXd& now) {
    if (still >= quiet) whole << now, 1.0;
    return is_over();
  };
  for (; k < std::min(most, kFine) && !is_over_at(state); ++k) {
    const double y = output * state;
    take(y, y, 1);
    next.noalias() = a * state;
    next += input;
    state.swap(next);
  }
  if (k >= most || is_over_at(state)) return course;
  const std::size_t stride = stride_of(a);
  // As many strides as there may be samples.
  const auto end =
      static_cast<std::size_t>(std::min(kTimeConstants / decay, kMostSamples * static_cast<double>(stride)));
  const Strides strides(a, input, stride);
  const Eigen::RowVectorXd summed = output * strides.sum.topRows(n);
  whole << state, 1.0;
  for (; k < end && !is_over(); k += stride) {
    take(output * whole.head(n), summed * whole, stride);
    after.noalias() = strides.step * whole;
    whole.swap(after);
  }
  return course;
}

double impulse_energy(Eigen::MatrixXd a, const Eigen::VectorXd& start, const Eigen::RowVectorXd& output) {
  constexpr int kDoublings = 40;
  constexpr double kNothing = 1e-18;
  Eigen::MatrixXd states = start * start.transpose();
  for (int i = 0; i < kDoublings; ++i) {
    const Eigen::MatrixXd more = a * states * a.transpose();
    states += more;
    if (more.trace() <= kNothing * states.trace()) break;
    a = (a * a).eval();
  }
  return output * states * output.transpose();
}

}  // namespace resonid::design
