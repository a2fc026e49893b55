// SPDX-License-Identifier: MIT
// What the default response reaches without any model: the published sweep over the published drive
// (Nevaranta 2016, Pub. VI, system 2), 1 Hz grid, 2 ... 33 Hz.
#include <experiments.hpp>
#include <response_fit_coverage.hpp>

namespace resonid {
namespace {

std::vector<double> whole_hertz() {
  std::vector<double> grid;
  for (int f = 2; f <= 33; ++f) grid.push_back(f);
  return grid;
}

/// Relative rms of the default response without a model.
double relative_rms(double noise, std::uint64_t seed, double reference = 0.0,
                    identification::Method method = identification::Method::automatic) {
  auto experiment = test::published_drive(noise, reference, seed);
  test::sweep(experiment);
  const auto grid = whole_hertz();
  const auto simulation = test::simulated(experiment, grid);
  auto options = test::known(experiment);
  options.lines_hz = grid;
  options.model = identification::ModelChoice::none;
  options.method = method;
  const auto response = test::identified(simulation.record, options).response;
  const auto& truth = simulation.truth.response;
  EXPECT_EQ(response.lines(), truth.lines());
  double sum = 0.0;
  for (std::size_t i = 0; i < truth.lines(); ++i) sum += std::norm(response.value[i] / truth.value[i] - 1.0);
  return std::sqrt(sum / static_cast<double>(truth.lines()));
}

TEST(NonParametric, DefaultIsWithinTheFloorsInNoise) {
  constexpr std::uint64_t kSeeds = 20;
  for (const double reference : {0.0, 10.0}) {
    double mean = 0.0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
      mean += relative_rms(0.1, seed, reference) / static_cast<double>(kSeeds);
    RecordProperty("mean", std::to_string(mean));
    EXPECT_LE(mean, 0.050);
  }
}

TEST(NonParametric, DefaultIsWithinTheFloorsWithoutNoise) {
  EXPECT_LE(relative_rms(0.0, 1), 0.012);
  EXPECT_LE(relative_rms(0.0, 1, 10.0), 0.012);
}

/// The local rational method, its width chosen by itself: a window that may hold a pole and a zero is wide.
TEST(NonParametric, LocalRationalIsFarBelowTheFloorInNoise) {
  constexpr auto kMethod = identification::Method::local_rational;
  constexpr std::uint64_t kSeeds = 4;
  double mean = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
    mean += relative_rms(0.1, seed, 0.0, kMethod) / static_cast<double>(kSeeds);
  RecordProperty("mean", std::to_string(mean));
  const double clean = relative_rms(0.0, 1, 0.0, kMethod);
  RecordProperty("clean", std::to_string(clean));
  EXPECT_LE(mean, 0.042);
  EXPECT_LE(clean, 0.012);
}

/// Averaged spectra smooth over frequency and have correlated lines; a fit to them must know both. The count
/// over 400 seeds stands in tests/statistics.
TEST(NonParametric, FitToAveragedSpectraIsNeitherBiasedNorTooSure) {
  constexpr int kSeeds = 48;
  test::Coverage coverage;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
    coverage.add(test::welch_fit(test::random_minute(seed).record, 1024).model);
  for (std::size_t i = 0; i < coverage.bias.size(); ++i) {
    SCOPED_TRACE(test::Coverage::kNames[i]);
    const double mean = coverage.bias[i] / coverage.seeds;
    const double rms = std::sqrt(coverage.mean_square[i] / coverage.seeds);
    EXPECT_LT(std::abs(mean), 3.3 / std::sqrt(kSeeds));  // 0.1 %
    EXPECT_LT(rms, 1.34);                                // chi-square of 48 degrees, 0.05 %
    EXPECT_GT(rms, 0.6);                                 // bars of a quarter too wide, and 0.1 %
  }
}

}  // namespace
}  // namespace resonid
