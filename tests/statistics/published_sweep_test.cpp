// SPDX-License-Identifier: MIT
// The published sweep over the published drive (Nevaranta 2016, Pub. VI, system 2), noise 0.1 rad/s, 20
// seeds: mean over the seeds of each run's relative rms error on a 1 Hz grid, 2 ... 33 Hz.
#include <gtest/gtest.h>

#include <cmath>
#include <experiments.hpp>

namespace resonid {
namespace {

constexpr std::uint64_t kSeeds = 20;

std::vector<double> grid_hz() {
  std::vector<double> grid;
  for (int f = 2; f <= 33; ++f) grid.push_back(f);
  return grid;
}

plant::Simulation simulate(double noise, double reference, std::uint64_t seed) {
  auto c = test::published_drive(noise, reference, seed);
  test::sweep(c);
  return test::simulated(c, grid_hz());
}

identification::Options defaults() {
  identification::Options o;
  o.excitation_type = identification::ExcitationType::chirp;
  o.chirp = {35.0, 1.5, 17.0};
  o.lines_hz = grid_hz();
  o.controller = data::pi_controller(1.036, 0.147, 0.002);
  o.delay_s = 0.004;
  return o;
}

identification::Options published() {
  auto o = defaults();
  o.method = identification::Method::kalman;
  o.approach = Approach::direct;
  o.model = identification::ModelChoice::none;
  o.tracker.lambda = 8.0;
  o.tracker.offset = false;
  o.tracker.smoothing = false;
  return o;
}

identification::Options with_model() {
  auto o = defaults();
  o.method = identification::Method::model;
  return o;
}

double mean_relative_rms(const identification::Options& options, double reference) {
  double mean = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto simulation = simulate(0.1, reference, seed);
    const auto result = identification::identify(simulation.record, options).value();
    const auto& truth = simulation.truth.response;
    EXPECT_EQ(result.response.lines(), truth.lines());
    double sum = 0.0;
    for (std::size_t i = 0; i < truth.lines(); ++i)
      sum += std::norm(result.response.value[i] - truth.value[i]) / std::norm(truth.value[i]);
    mean += std::sqrt(sum / static_cast<double>(truth.lines())) / static_cast<double>(kSeeds);
  }
  return mean;
}

TEST(PublishedSweep, PublishedMethodHasItsPublishedError) {
  EXPECT_NEAR(mean_relative_rms(published(), 0.0), 0.19, 0.019);
}

TEST(PublishedSweep, DefaultResponse) {
  EXPECT_LE(mean_relative_rms(defaults(), 0.0), 0.090);
  EXPECT_LE(mean_relative_rms(defaults(), 10.0), 0.090);
}

TEST(PublishedSweep, TwoMassModel) {
  EXPECT_LE(mean_relative_rms(with_model(), 0.0), 0.0145);
  EXPECT_LE(mean_relative_rms(with_model(), 10.0), 0.0145);
}

}  // namespace
}  // namespace resonid
