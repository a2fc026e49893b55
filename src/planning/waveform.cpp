// SPDX-License-Identifier: MIT
#include "planning/waveform.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <resonid/base/constants.hpp>
#include <resonid/online/excitation/detail/splitmix64.hpp>

namespace resonid::planning::detail {
namespace {

using Complex = std::complex<double>;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kHighestExponent = 64;

/// Cost and gradient; the variables are real and imaginary parts of all lines' phasors.
class Cost {
 public:
  explicit Cost(const WaveformProblem& problem) : problem_(problem) {
    const auto lines = static_cast<Eigen::Index>(problem.harmonic.size());
    const auto instants = static_cast<Eigen::Index>(kInstantsPerLine * problem.harmonic.back());
    cosine_.resize(instants, lines);
    sine_.resize(instants, lines);
    for (Eigen::Index k = 0; k < lines; ++k)
      for (Eigen::Index t = 0; t < instants; ++t) {
        const auto h = static_cast<Eigen::Index>(problem.harmonic[static_cast<std::size_t>(k)]);
        const double angle = kTwoPi * static_cast<double>(h * t % instants) / static_cast<double>(instants);
        cosine_(t, k) = std::cos(angle);
        sine_(t, k) = std::sin(angle);
      }
  }

  [[nodiscard]] Eigen::Index lines() const { return cosine_.cols(); }

  [[nodiscard]] VectorXd power(const VectorXd& x) const {
    const auto n = lines();
    return 0.5 * (x.head(n).cwiseAbs2() + x.tail(n).cwiseAbs2());
  }

  /// Largest use of a limit, of peaks and rms.
  [[nodiscard]] double use(const VectorXd& x) const { return use_of(signals(x)); }

  double operator()(int q, const VectorXd& x, VectorXd& gradient) const {
    const auto n = lines();
    const auto c = criterial(*problem_.design, power(x));
    gradient.resize(2 * n);
    gradient.head(n) = c.slope.cwiseProduct(x.head(n));
    gradient.tail(n) = c.slope.cwiseProduct(x.tail(n));
    MatrixXd all = signals(x);
    const double unit = use_of(all);
    all /= unit;
    MatrixXd square = all.cwiseAbs2(), high = MatrixXd::Ones(all.rows(), all.cols());
    for (int e = q; e > 1; e /= 2) {  // square^(q - 1), q being a power of two
      high.array() *= square.array();
      square = square.cwiseAbs2();
    }
    const double sum = (high.array() * all.array().square()).sum();
    gradient += 2.0 / sum * slope(high.cwiseProduct(all) / unit);  // 1/q of the derivative of log sum
    // Of powers per instant, so that the values of different exponents compare.
    return c.log_value + 2.0 * std::log(unit) + std::log(sum / static_cast<double>(cosine_.rows())) / q;
  }

 private:
  [[nodiscard]] Eigen::Index periodic() const { return static_cast<Eigen::Index>(problem_.signals.size()); }

  [[nodiscard]] Complex gain(Eigen::Index s, Eigen::Index k) const {
    const auto& signal = problem_.signals[static_cast<std::size_t>(s)];
    return signal.gain[static_cast<std::size_t>(k)] / signal.limit;
  }

  /// [instant, signal] in parts of their limits: the periodic ones, then those of the start.
  [[nodiscard]] MatrixXd signals(const VectorXd& x) const {
    const auto n = lines();
    MatrixXd re(n, periodic()), im(n, periodic());
    for (Eigen::Index s = 0; s < periodic(); ++s)
      for (Eigen::Index k = 0; k < n; ++k) {
        const Complex a = gain(s, k) * Complex(x(k), x(n + k));
        re(k, s) = a.real();
        im(k, s) = a.imag();
      }
    MatrixXd all(cosine_.rows(), periodic() + static_cast<Eigen::Index>(problem_.starts.size()));
    all.leftCols(periodic()).noalias() = cosine_ * re;
    all.leftCols(periodic()).noalias() -= sine_ * im;
    Eigen::Index to = periodic();
    for (const auto& start : problem_.starts)
      all.col(to++) = all.col(start.signal) + start.shape * (start.weight * x);
    return all;
  }

  [[nodiscard]] double use_of(const MatrixXd& all) const {
    double largest = all.cwiseAbs().maxCoeff();
    for (Eigen::Index s = 0; s < periodic(); ++s) {
      const auto at = static_cast<std::size_t>(s);
      const double rms = all.col(s).norm() / std::sqrt(static_cast<double>(all.rows()));
      largest = std::max(largest, rms * problem_.signals[at].limit / problem_.rms_limit[at]);
    }
    return largest;
  }

  /// Derivative by the phasors from that by the signals.
  [[nodiscard]] VectorXd slope(const MatrixXd& by_signal) const {
    const auto n = lines();
    VectorXd sum = VectorXd::Zero(2 * n);
    MatrixXd own = by_signal.leftCols(periodic());
    Eigen::Index from = periodic();
    for (const auto& start : problem_.starts) {
      own.col(start.signal) += by_signal.col(from);
      sum += start.weight.transpose() * (start.shape.transpose() * by_signal.col(from++));
    }
    const MatrixXd re = cosine_.transpose() * own, im = -(sine_.transpose() * own);
    for (Eigen::Index s = 0; s < periodic(); ++s)
      for (Eigen::Index k = 0; k < n; ++k) {
        const Complex a = std::conj(gain(s, k)) * Complex(re(k, s), im(k, s));
        sum(k) += a.real();
        sum(n + k) += a.imag();
      }
    return sum;
  }

  const WaveformProblem& problem_;
  MatrixXd cosine_, sine_;  // [instant, line]
};

/// Limited-memory BFGS with backtracking.
class Descent {
 public:
  Descent(const Cost& cost, int iterations) : cost_(cost), iterations_(iterations) {}

  void operator()(int q, VectorXd& x) const {
    std::deque<std::pair<VectorXd, VectorXd>> memory;  // steps and changes of the gradient
    VectorXd gradient, next_gradient;
    double value = cost_(q, x, gradient);
    for (int i = 0; i < iterations_; ++i) {
      VectorXd step = -direction(gradient, memory);
      double slope = step.dot(gradient);
      if (!(slope < 0.0)) {
        memory.clear();
        step = -gradient;
        slope = -gradient.squaredNorm();
      }
      double length = memory.empty() ? 0.05 * x.norm() / (step.norm() + 1e-300) : 1.0;
      double next = HUGE_VAL;
      VectorXd trial;
      for (int attempt = 0; attempt < 20; ++attempt, length *= 0.4) {
        trial = x + length * step;
        next = cost_(q, trial, next_gradient);
        if (next < value + 1e-4 * length * slope) break;
        next = HUGE_VAL;
      }
      if (!std::isfinite(next)) break;
      const VectorXd s = trial - x, y = next_gradient - gradient;
      if (s.dot(y) > 1e-12 * s.norm() * y.norm()) memory.emplace_back(s, y);
      if (memory.size() > 12) memory.pop_front();
      const double gained = value - next;
      x = trial;
      gradient = next_gradient;
      value = next;
      if (gained < 1e-6) break;
    }
  }

 private:
  static VectorXd direction(const VectorXd& gradient,
                            const std::deque<std::pair<VectorXd, VectorXd>>& memory) {
    VectorXd d = gradient;
    std::vector<double> alpha(memory.size());
    for (std::size_t i = memory.size(); i-- > 0;) {
      alpha[i] = memory[i].first.dot(d) / memory[i].first.dot(memory[i].second);
      d -= alpha[i] * memory[i].second;
    }
    if (!memory.empty())
      d *= memory.back().first.dot(memory.back().second) / memory.back().second.squaredNorm();
    for (std::size_t i = 0; i < memory.size(); ++i) {
      const double beta = memory[i].second.dot(d) / memory[i].first.dot(memory[i].second);
      d += (alpha[i] - beta) * memory[i].first;
    }
    return d;
  }

  const Cost& cost_;
  int iterations_;
};

}  // namespace

Waveform optimise_waveform(const WaveformProblem& problem, const VectorXd& power) {
  const Cost cost(problem);
  const auto n = cost.lines();
  constexpr Eigen::Index kMany = 150;
  const Descent descent(cost, n <= kMany ? 120 : 50);
  online::SplitMix64 random(problem.seed);
  Waveform best;
  best.value = HUGE_VAL;
  for (std::size_t start = 0; start <= problem.random_starts; ++start) {
    VectorXd x(2 * n);
    const double some = 0.02 * power.sum() / static_cast<double>(n);  // a little of every line to begin with
    for (Eigen::Index k = 0; k < n; ++k) {
      const Complex a = std::polar(std::sqrt(2.0 * (power(k) + some)), kTwoPi * random.uniform());
      x(k) = a.real();
      x(n + k) = a.imag();
    }
    for (int q = 4; q <= kHighestExponent; q *= 2) {
      x /= cost.use(x);
      descent(q, x);
    }
    x /= cost.use(x);
    const double value = criterial(*problem.design, cost.power(x)).log_value;
    if (value < best.value) {
      best.value = value;
      best.amplitude.clear();
      for (Eigen::Index k = 0; k < n; ++k) best.amplitude.emplace_back(x(k), x(n + k));
    }
  }
  return best;
}

}  // namespace resonid::planning::detail
