// SPDX-License-Identifier: MIT
// One update of each recursive estimator, against plain and textbook recursive least squares in the same run.
// The figure to read is time per item, one item being one sample, as a ratio to rls<double>/constant.
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <resonid/online/models/arx.hpp>
#include <resonid/online/models/closed_loop_output_error.hpp>
#include <resonid/online/models/detail/symmetric_covariance.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/models/output_error.hpp>
#include <resonid/online/models/rls.hpp>
#include <vector>

namespace resonid::online {
namespace {

constexpr std::size_t kSamples = 4096;
constexpr std::array<double, 3> kB{1.117, -0.646, 1.005}, kA{-0.835, 0.682, -0.847};
constexpr std::array<double, 3> kNumerator{0.124848, -0.2448, 0.12}, kDenominator{1.0, -2.0, 1.0};

double uniform(std::uint64_t& state) {
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return static_cast<double>(state >> 11) * 0x1p-53 - 0.5;
}

/// The tooth belt under its controller with a random binary excitation.
struct Signals {
  std::vector<double> ru, u, y;
  Signals() : ru(kSamples), u(kSamples), y(kSamples) {
    std::uint64_t state = 88172645463325252ULL;
    auto controller = DiscreteFilter<double, 2>::create(kNumerator, kDenominator).value();
    Regression<double, 3> machine(1, false);
    Regression<double, 3>::Vector f;
    for (std::size_t k = 0; k < kSamples; ++k) {
      machine.fill(f);
      double velocity = 0.0;
      for (std::size_t i = 0; i < 3; ++i) velocity += kB[i] * f[i] + kA[i] * f[3 + i];
      y[k] = velocity + 0.1 * uniform(state);
      ru[k] = uniform(state) > 0.0 ? 1.0 : -1.0;
      u[k] = ru[k] - controller.step(y[k]);
      machine.push(u[k], velocity);
    }
  }
};

ModelEstimatorConfig common() {
  ModelEstimatorConfig c;
  c.sample_rate_hz = 250.0;
  c.delay_samples = 1;
  c.start_b = kB;
  c.start_a = kA;
  c.adaptation.start_variance = 0.01;
  return c;
}

template <class Estimator>
void run(benchmark::State& state, Estimator estimator) {
  using Scalar = typename Estimator::Scalar;
  const Signals s;
  for (auto _ : state) {
    for (std::size_t k = 0; k < kSamples; ++k)
      estimator.step(static_cast<Scalar>(s.ru[k]), static_cast<Scalar>(s.u[k]), static_cast<Scalar>(s.y[k]));
    benchmark::DoNotOptimize(estimator);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kSamples));
}

/// The regressors of ARX, ready made.
std::vector<std::array<double, 6>> regressors(const Signals& s) {
  std::vector<std::array<double, 6>> list(kSamples);
  for (std::size_t k = 4; k < kSamples; ++k)
    list[k] = {s.u[k - 2], s.u[k - 3], s.u[k - 4], -s.y[k - 1], -s.y[k - 2], -s.y[k - 3]};
  return list;
}

template <class Scalar, template <class, std::size_t> class Factors = UdFactors>
void rls(benchmark::State& state) {
  const Signals s;
  const auto list = regressors(s);
  std::vector<std::array<Scalar, 6>> narrow(kSamples);
  for (std::size_t k = 0; k < kSamples; ++k)
    for (std::size_t i = 0; i < 6; ++i) narrow[k][i] = static_cast<Scalar>(list[k][i]);
  using Rls = RecursiveLeastSquares<Scalar, 6, Factors<Scalar, 6>>;
  auto estimator = Rls::create({.forgetting = static_cast<Forgetting>(state.range(0))}).value();
  for (auto _ : state) {
    for (std::size_t k = 0; k < kSamples; ++k) estimator.step(narrow[k], static_cast<Scalar>(s.y[k]));
    benchmark::DoNotOptimize(estimator);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kSamples));
}
BENCHMARK(rls<double>)->ArgName("forgetting")->DenseRange(0, 3);
BENCHMARK(rls<float>)->ArgName("forgetting")->Arg(1);
BENCHMARK(rls<double, SymmetricCovariance>)->ArgName("forgetting")->DenseRange(0, 3);
BENCHMARK(rls<float, SymmetricCovariance>)->ArgName("forgetting")->Arg(1);

/// Peer: the covariance form, kept symmetric by writing both halves.
void plain_symmetric_rls(benchmark::State& state) {
  const Signals s;
  const auto list = regressors(s);
  std::array<std::array<double, 6>, 6> p{};
  std::array<double, 6> theta{};
  for (std::size_t i = 0; i < 6; ++i) p[i][i] = 1.0;
  for (auto _ : state) {
    for (std::size_t k = 0; k < kSamples; ++k) {
      const auto& f = list[k];
      std::array<double, 6> pf{};
      for (std::size_t j = 0; j < 6; ++j)
        for (std::size_t i = 0; i < 6; ++i) pf[i] += p[j][i] * f[j];
      double spread = 0.99, error = s.y[k];
      for (std::size_t i = 0; i < 6; ++i) {
        spread += f[i] * pf[i];
        error -= f[i] * theta[i];
      }
      const double gain = 1.0 / spread;
      for (std::size_t i = 0; i < 6; ++i) theta[i] += pf[i] * (gain * error);
      for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t j = 0; j <= i; ++j)
          p[i][j] = p[j][i] = (p[i][j] - gain * pf[i] * pf[j]) * (1.0 / 0.99);
    }
    benchmark::DoNotOptimize(theta);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kSamples));
}
BENCHMARK(plain_symmetric_rls);

/// Peer: as in a textbook, with a matrix library.
void textbook_rls(benchmark::State& state) {
  using Vector = Eigen::Matrix<double, 6, 1>;
  const Signals s;
  const auto list = regressors(s);
  Eigen::Matrix<double, 6, 6> p = Eigen::Matrix<double, 6, 6>::Identity();
  Vector theta = Vector::Zero();
  for (auto _ : state) {
    p.setIdentity();  // it diverges after some 18 000 updates
    for (std::size_t k = 0; k < kSamples; ++k) {
      const Eigen::Map<const Vector> f(list[k].data());
      const Vector gain = p * f / (0.99 + f.dot(p * f));
      theta += gain * (s.y[k] - f.dot(theta));
      p = (p - gain * (f.transpose() * p)) / 0.99;
    }
    benchmark::DoNotOptimize(theta);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kSamples));
}
BENCHMARK(textbook_rls);

void arx(benchmark::State& state) { run(state, Arx<double, 3>::create({common()}).value()); }
BENCHMARK(arx);

void output_error(benchmark::State& state) {
  OutputErrorConfig c;
  c.common = common();
  c.gradient = static_cast<OutputErrorGradient>(state.range(0));
  run(state, OutputError<double, 3>::create(c).value());
}
BENCHMARK(output_error)->ArgName("gradient")->DenseRange(0, 1);

template <class Scalar>
void closed_loop_output_error(benchmark::State& state) {
  ClosedLoopOutputErrorConfig c;
  c.common = common();
  c.controller_numerator = kNumerator;
  c.controller_denominator = kDenominator;
  c.gradient = static_cast<ClosedLoopGradient>(state.range(0));
  run(state, ClosedLoopOutputError<Scalar, 3>::create(c).value());
}
BENCHMARK(closed_loop_output_error<double>)->ArgName("gradient")->DenseRange(0, 2);
BENCHMARK(closed_loop_output_error<float>)->ArgName("gradient")->Arg(0);

/// On demand, not per sample: resonance with its standard deviation, local stability.
void resonance_with_deviation(benchmark::State& state) {
  const DiscreteModel<double, 3> m{kB, kA};
  const ModelCovariance<double, 3> c = ModelCovariance<double, 3>::Identity();
  for (auto _ : state) benchmark::DoNotOptimize(SampledModes<3>(m, 250.0).resonances(c));
}
BENCHMARK(resonance_with_deviation);

void local_stability_of_a_model(benchmark::State& state) {
  PseudoLinearRecursion<3> r;
  r.model = {kB, kA};
  r.delay_samples = 1;
  r.controller = controller_coefficients(kNumerator, kDenominator);
  for (auto _ : state) benchmark::DoNotOptimize(local_stability(r));
}
BENCHMARK(local_stability_of_a_model);

/// Nightly: a billion updates, excitation off half of the time; fails the run when the covariance does.
void rls_endurance(benchmark::State& state) {
  for (auto _ : state) {
    auto estimator = RecursiveLeastSquares<double, 6>::create({}).value();
    std::uint64_t seed = 88172645463325252ULL;
    std::array<double, 6> f{};
    for (int block = 0; block < 1000; ++block) {
      const bool excited = block % 2 == 0;
      for (int k = 0; k < 1000000; ++k) {
        for (std::size_t i = 5; i > 0; --i) f[i] = 0.9 * f[i - 1];
        f[0] = excited ? uniform(seed) : 0.0;
        estimator.step(f, f[0] - 0.5 * f[1] + 0.8 * f[2] + (excited ? 0.1 * uniform(seed) : 0.0));
      }
      const auto p = estimator.information_inverse();
      if (!p.allFinite() || p != p.transpose() || p.diagonal().minCoeff() <= 0.0 || p.trace() > 7e4 ||
          estimator.excited() != excited || std::abs(estimator.parameters()[0] - 1.0) > 0.1)
        state.SkipWithError("the covariance or the estimate went astray");
    }
  }
  state.SetItemsProcessed(state.iterations() * 1000000000);
}
BENCHMARK(rls_endurance)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace resonid::online
