// SPDX-License-Identifier: MIT
#include <benchmark/benchmark.h>

#include <cstdlib>
#include <filesystem>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/linear_system.hpp>
#include <resonid/data/two_mass.hpp>
#include <resonid/identification/identify.hpp>

namespace resonid::identification {
namespace {

/// Two-mass bench under a periodic multisine of 240 lines, as the real recording has it: six periods of 2500
/// samples at 2500 Hz, white noise on the velocity.
data::Record multisine_record() {
  constexpr std::size_t kPeriod = 2500, kPeriods = 6;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> phase(0.0, kTwoPi);
  std::normal_distribution<double> noise(0.0, 0.02);
  std::vector<double> torque(kPeriod, 0.0);
  for (int line = 11; line <= 250; ++line) {
    const double p = phase(random);
    for (std::size_t k = 0; k < kPeriod; ++k)
      torque[k] += 0.5 * std::cos(kTwoPi * line * static_cast<double>(k) / kPeriod + p);
  }
  const auto drive = zero_order_hold(
      data::continuous_system(data::TwoMassParameters{2.69e-3, 2.69e-3, 310.0, 0.03, 0.0}), 1.0 / 2500.0);
  data::Record record;
  record.source = "multisine";
  record.sample_rate_hz = 2500.0;
  record.input.unit = "Nm";
  record.output.unit = "rad/s";
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < kPeriod * kPeriods; ++k) {
    const double u = torque[k % kPeriod];
    record.input.samples.push_back(u);
    record.output.samples.push_back(x(0) + noise(random));
    x = drive.a * x + drive.b * u;
  }
  return record;
}

/// The whole job on 15 000 samples; the floor is one second.
void identify_15000_samples(benchmark::State& state) {
  const auto record = multisine_record();
  Options options;
  options.drop_periods = 1;
  for (auto _ : state) {
    auto result = identify(record, options);
    if (!result || !result->trusted) state.SkipWithError("not identified");
    benchmark::DoNotOptimize(result);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<long>(record.samples()));
}
BENCHMARK(identify_15000_samples)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace resonid::identification
