// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <experiments.hpp>
#include <resonid/fit/response_fit.hpp>
#include <resonid/response/welch.hpp>

namespace resonid::test {

/// The published drive (system 2, noise 0.1 rad/s) under 60 s of PRBS, 17 cells, 2.1 Nm.
inline plant::Simulation random_minute(std::uint64_t seed) {
  auto c = published_drive(0.1, 0.0, seed);
  prbs(c);
  c.excitation.register_length = 17;
  c.excitation.amplitude = 2.1;
  c.run.duration_s = 60.0;
  return simulated(c);
}

struct Coverage {
  static constexpr std::array<const char*, 6> kNames = {"driven inertia", "load inertia", "stiffness",
                                                        "damping",        "resonance",    "anti-resonance"};
  int seeds = 0;
  std::array<int, 6> inside{};             ///< 95 % intervals that hold the truth
  std::array<double, 6> mean_square{};     ///< of error over standard deviation
  std::array<double, 6> bias{};            ///< mean error over standard deviation
  std::array<double, 6> relative_error{};  ///< sum of squares

  void add(const fit::DriveModel& model) {
    const data::TwoMassParameters drive{0.032, 0.032, 143.75, 0.3, 0.0};
    const std::array<double, 6> truth = {drive.driven_inertia,      drive.load_inertia,
                                         drive.stiffness,           drive.damping,
                                         data::resonance_hz(drive), data::antiresonance_hz(drive)};
    ++seeds;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const data::Estimate e = i < 4    ? model.estimate(static_cast<fit::Parameter>(i))
                               : i == 4 ? model.resonance()
                                        : model.antiresonance();
      const double ratio = (e.value - truth[i]) / e.std;
      if (std::abs(ratio) < 1.96) ++inside[i];
      mean_square[i] += ratio * ratio;
      bias[i] += ratio;
      relative_error[i] += std::pow(e.value / truth[i] - 1.0, 2);
    }
  }
};

/// Physical fit to the joint Welch response of such a record.
inline fit::ResponseFit welch_fit(const data::Record& record, std::size_t segment = 0) {
  response::WelchConfig config;
  config.segment_samples = segment;
  const auto response = response::welch(record, config, {Approach::joint, {}, 0.004});
  fit::ResponseFitConfig fit;
  fit.sample_time_s = record.sample_time_s();
  fit.known_delay_s = 0.004;
  fit.low_hz = 2.0;
  fit.high_hz = 40.0;
  return fit::fit_response(response.value(), fit).value();
}

}  // namespace resonid::test
