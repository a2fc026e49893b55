// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numeric>
#include <resonid/base/constants.hpp>
#include <resonid/online/excitation/detail/splitmix64.hpp>
#include <resonid/online/excitation/multisine.hpp>
#include <resonid/planning/detail/crest_factor.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::planning {
namespace {

using Complex = std::complex<double>;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kHighestExponent = 256;

/// All signals over one common period of the lines, as functions of the phases.
class Waveforms {
 public:
  Waveforms(const PhaseConfig& c, std::vector<std::size_t> harmonic)
      : config_(c), harmonic_(std::move(harmonic)), amplitude_(c.amplitude) {
    amplitude_.resize(harmonic_.size(), c.amplitude.front());
    signals_ = c.signals;
    if (signals_.empty()) signals_.push_back({std::vector<Complex>(harmonic_.size(), 1.0), 1.0});
    tabulate(kPointsPerPeriod);
  }

  [[nodiscard]] std::size_t lines() const { return harmonic_.size(); }
  [[nodiscard]] std::size_t signals() const { return signals_.size(); }
  [[nodiscard]] Eigen::Index instants() const { return cosine_.rows(); }

  /// Signal s in parts of its limit; with a Jacobian, its derivative by the phases too.
  [[nodiscard]] VectorXd signal(std::size_t s, const VectorXd& phase, MatrixXd* jacobian = nullptr) const {
    const auto n = static_cast<Eigen::Index>(lines());
    VectorXd re(n), im(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const Complex a = amplitude_[i] / signals_[s].limit * signals_[s].gain[i] * std::polar(1.0, phase(k));
      re(k) = a.real();
      im(k) = a.imag();
    }
    if (jacobian != nullptr) *jacobian = -cosine_ * im.asDiagonal() - sine_ * re.asDiagonal();
    return cosine_ * re - sine_ * im;
  }

  [[nodiscard]] double peak(const VectorXd& phase) const {
    double largest = 0.0;
    for (std::size_t s = 0; s < signals(); ++s)
      largest = std::max(largest, signal(s, phase).lpNorm<Eigen::Infinity>());
    return largest;
  }

  /// The multisine itself on a four times finer grid.
  [[nodiscard]] OptimisedPhases measured(const VectorXd& phase) const {
    OptimisedPhases result;
    for (Eigen::Index k = 0; k < phase.size(); ++k)
      result.phase_rad.push_back(phase(k) - kTwoPi * std::floor(phase(k) / kTwoPi));
    double power = 0.0;
    for (const double a : amplitude_) power += 0.5 * a * a;
    std::vector<PeakSignal> own{{std::vector<Complex>(lines(), 1.0), 1.0}};
    result.crest_factor = fine_peak(own, phase) / std::sqrt(power);
    result.peak = fine_peak(signals_, phase);
    return result;
  }

 private:
  static constexpr std::size_t kPointsPerPeriod = 12;

  void tabulate(std::size_t points) {
    const std::size_t instants = std::max<std::size_t>(64, points * harmonic_.back());
    cosine_.resize(static_cast<Eigen::Index>(instants), static_cast<Eigen::Index>(lines()));
    sine_.resizeLike(cosine_);
    for (std::size_t k = 0; k < lines(); ++k)
      for (std::size_t t = 0; t < instants; ++t) {
        const double angle =
            kTwoPi * static_cast<double>(harmonic_[k] * t % instants) / static_cast<double>(instants);
        cosine_(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(k)) = std::cos(angle);
        sine_(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(k)) = std::sin(angle);
      }
  }

  /// The grid's points shifted by quarters of their distance.
  [[nodiscard]] double fine_peak(const std::vector<PeakSignal>& signals, const VectorXd& phase) const {
    constexpr int kQuarters = 4;
    Waveforms own = *this;
    own.signals_ = signals;
    double largest = 0.0;
    for (int q = 0; q < kQuarters; ++q) {
      VectorXd shifted = phase;
      for (Eigen::Index k = 0; k < shifted.size(); ++k)
        shifted(k) += kTwoPi * q / kQuarters * static_cast<double>(harmonic_[static_cast<std::size_t>(k)]) /
                      static_cast<double>(instants());
      largest = std::max(largest, own.peak(shifted));
    }
    return largest;
  }

  PhaseConfig config_;
  std::vector<std::size_t> harmonic_;
  std::vector<double> amplitude_;
  std::vector<PeakSignal> signals_;
  MatrixXd cosine_, sine_;  // [instant, line]
};

/// Levenberg-Marquardt on the sum of (x/peak)^2q over all signals.
class Polish {
 public:
  Polish(const Waveforms& waveforms, int iterations) : waveforms_(waveforms), iterations_(iterations) {}

  /// Goes on as long as the peak may still come below `wanted`; gives the best on the way.
  [[nodiscard]] VectorXd operator()(VectorXd phase, double wanted) const {
    constexpr int kTelling = 16;        // at this exponent the peak is nearly what it will be
    constexpr double kHopeless = 1.08;  // no start has been seen to make up for more
    VectorXd best = phase;
    double least = waveforms_.peak(phase);
    for (int q = 2; q <= kHighestExponent; q *= 2) {
      phase = at_exponent(q, phase);
      if (const double peak = waveforms_.peak(phase); peak < least) {
        least = peak;
        best = phase;
      }
      if (q >= kTelling && least > kHopeless * wanted) break;
    }
    return best;
  }

 private:
  [[nodiscard]] double cost(int q, const VectorXd& phase, double unit) const {
    double sum = 0.0;
    for (std::size_t s = 0; s < waveforms_.signals(); ++s)
      sum += (waveforms_.signal(s, phase) / unit).array().square().pow(q).sum();
    return sum;
  }

  [[nodiscard]] VectorXd at_exponent(int q, VectorXd phase) const {
    const auto n = static_cast<Eigen::Index>(waveforms_.lines());
    double damping = 1e-3;
    for (int i = 0; i < iterations_; ++i) {
      const double unit = waveforms_.peak(phase);
      MatrixXd normal = MatrixXd::Zero(n, n);
      VectorXd gradient = VectorXd::Zero(n);
      double now = 0.0;
      for (std::size_t s = 0; s < waveforms_.signals(); ++s) {
        MatrixXd jacobian;
        const VectorXd x = waveforms_.signal(s, phase, &jacobian) / unit;
        const VectorXd slope = q / unit * x.array().square().pow(0.5 * (q - 1));  // of |x|^q by |x|
        const VectorXd residual = x.array().abs().pow(q);
        now += residual.squaredNorm();
        const VectorXd sign = x.array().sign();
        jacobian = slope.cwiseProduct(sign).asDiagonal() * jacobian;
        normal.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose());
        gradient += jacobian.transpose() * residual;
      }
      double next = now;
      for (int attempt = 0; attempt < 8; ++attempt) {
        MatrixXd damped = normal;
        damped.diagonal().array() += damping * normal.diagonal().maxCoeff();
        const VectorXd trial = phase - linalg::RealLdlt(damped).solve(gradient);
        next = cost(q, trial, unit);
        if (next < now) {
          phase = trial;
          damping = std::max(1e-9, 0.3 * damping);
          break;
        }
        damping *= 6.0;
      }
      if (!(next < now * (1.0 - 1e-5))) break;
    }
    return phase;
  }

  const Waveforms& waveforms_;
  int iterations_;
};

/// What a start may cost, so that many lines take seconds and not minutes.
struct Effort {
  std::size_t starts = 1;
  int iterations = 0;  // per exponent
};
Effort effort_for(const Waveforms& w, std::size_t wanted) {
  constexpr double kOperations = 8e9;
  constexpr double kExponents = 8.0, kIterations = 40.0;
  const double per_iteration = static_cast<double>(w.instants() * static_cast<Eigen::Index>(w.signals())) *
                               static_cast<double>(w.lines() * w.lines());
  const double iterations = kOperations / per_iteration;
  const double starts = std::clamp(iterations / (kExponents * kIterations), 1.0, static_cast<double>(wanted));
  return {static_cast<std::size_t>(starts),
          static_cast<int>(std::clamp(iterations / (kExponents * starts), 0.0, kIterations))};
}

expected<std::vector<std::size_t>, Error> harmonics(const PhaseConfig& c) {
  const online::MultisineConfig multisine{c.sample_rate_hz, c.frequency_hz, c.amplitude,
                                          online::Phases::zero};
  constexpr std::size_t kMostLines = 4096;
  if (const auto ok = online::check(multisine, kMostLines); !ok) return unexpected(ok.error());
  const std::size_t period = online::common_period_samples(c.frequency_hz, c.sample_rate_hz);
  if (period == 0) return refuse("lines_hz", "must have a common period for their phases to be optimised");
  std::vector<std::size_t> harmonic;
  for (const double f : c.frequency_hz)
    harmonic.push_back(
        static_cast<std::size_t>(std::llround(f / c.sample_rate_hz * static_cast<double>(period))));
  std::size_t common = 0;
  for (const auto h : harmonic) common = std::gcd(common, h);
  for (auto& h : harmonic) h /= common;
  constexpr double kMostEntries = 1e7;
  if (12.0 * static_cast<double>(harmonic.back()) * static_cast<double>(harmonic.size()) > kMostEntries)
    return refuse("lines_hz", "must be fewer, or on a coarser grid, for their phases to be optimised",
                  static_cast<double>(harmonic.size()));
  return harmonic;
}

}  // namespace

expected<OptimisedPhases, Error> optimise_phases(const PhaseConfig& config) {
  auto harmonic = harmonics(config);
  if (!harmonic) return unexpected(harmonic.error());
  for (const auto& signal : config.signals)
    if (signal.gain.size() != harmonic->size() || !(signal.limit > 0.0))
      return refuse("signals", "must have a gain per line and a limit > 0", signal.limit);
  const Waveforms waveforms(config, std::move(*harmonic));
  const auto n = static_cast<Eigen::Index>(waveforms.lines());
  const Effort effort = effort_for(waveforms, config.random_starts + 1);
  online::MultisineConfig start{config.sample_rate_hz, config.frequency_hz, config.amplitude};
  const Polish polish(waveforms, effort.iterations);
  VectorXd best(n);
  double least = HUGE_VAL;
  for (std::size_t i = 0; i < effort.starts; ++i) {
    VectorXd phase(n);
    start.phases = i == 0 ? online::Phases::schroeder : online::Phases::random;
    start.seed = config.seed + i;
    online::multisine_phases(start, {phase.data(), waveforms.lines()});
    if (effort.iterations > 0) phase = polish(phase, least);
    if (const double peak = waveforms.peak(phase); peak < least) {
      least = peak;
      best = phase;
    }
  }
  return waveforms.measured(best);
}

}  // namespace resonid::planning
