// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <experiments.hpp>
#include <resonid/identification/tune.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/plant/detail/white_noise.hpp>
#include <string>
#include <string_view>
#include <true_loop.hpp>

// identify -> tune -> the machine as it really is, over seeds.
namespace resonid::test {

/// The true two masses of an experiment at the driven shaft.
inline data::TwoMassParameters true_masses(const plant::ExperimentConfig& c) {
  const double square = c.drive.radius_m * c.drive.radius_m;
  return {c.drive.driven_inertia, c.drive.load_inertia, square * c.drive.stiffness, square * c.drive.damping,
          c.drive.viscous_friction};
}

struct TunedSeeds {
  int seeds = 0, untrusted = 0, refused = 0, unstable = 0, inside = 0;
  double worst_sensitivity = 0.0, worst_load_transfer = 0.0;

  [[nodiscard]] std::string text() const {
    char line[200];
    std::snprintf(
        line, sizeof line,
        "%d seeds: inside %d, unstable %d, not trusted %d, refused %d; largest Ms %.4f, T_load %.4f", seeds,
        inside, unstable, untrusted, refused, worst_sensitivity, worst_load_transfer);
    return line;
  }
};

/// The delay that is told is the nominal one; the real one is normal around it, with a standard deviation of
/// a quarter of a sample, which is what a tuning assumes where nothing is told.
inline TunedSeeds tuned_seeds(std::string_view experiment, std::uint64_t first, int seeds,
                              const identification::TuneOptions& how) {
  TunedSeeds found;
  const auto nominal = io::shipped_experiment(experiment);
  const double step = 1.0 / nominal.run.sample_rate_hz;
  identification::Options told;
  told.controller = data::pi_controller(1.036, 0.147, step);
  told.delay_s = nominal.measurement.delay_s;
  for (int i = 0; i < seeds; ++i) {
    auto c = nominal;
    c.run.seed = first + static_cast<std::uint64_t>(i);
    c.measurement.delay_s += plant::WhiteNoise(c.run.seed + 1'000'003, 0.25 * step).step();
    ++found.seeds;
    const auto result = identified(simulated(c, std::vector<double>{5.0}).record, told);
    if (!result.trusted) {
      ++found.untrusted;
      for (const auto& f : result.findings)
        if (f.severity == diagnostics::Severity::error)
          std::printf("seed %d: delay %+.3f ms, not trusted: %s (%s)\n", static_cast<int>(c.run.seed),
                      1e3 * (c.measurement.delay_s - nominal.measurement.delay_s), f.id.c_str(),
                      f.meaning.c_str());
      continue;
    }
    const auto tuning = identification::tune(result, how);
    if (!tuning) {
      ++found.refused;
      std::printf("seed %d: %s\n", static_cast<int>(c.run.seed), message_of(tuning.error()).c_str());
      continue;
    }
    const auto truth =
        TrueTwoMass(true_masses(c), c.measurement.delay_s, step).under(tuning->proposed().feedback);
    found.unstable += truth.stable ? 0 : 1;
    const bool inside = truth.stable && truth.sensitivity <= how.largest_sensitivity &&
                        truth.load_transfer <= how.largest_load_transfer;
    found.inside += inside ? 1 : 0;
    found.worst_sensitivity = std::max(found.worst_sensitivity, truth.sensitivity);
    found.worst_load_transfer = std::max(found.worst_load_transfer, truth.load_transfer);
    if (!inside)
      std::printf("seed %d: delay %+.3f ms, found %+.3f, std %.4f; Ms %.4f, T_load %.4f, radius %.4f\n",
                  static_cast<int>(c.run.seed), 1e3 * (c.measurement.delay_s - nominal.measurement.delay_s),
                  1e3 * (result.model->drive.delay_s + result.model->drive.known_delay_s -
                         nominal.measurement.delay_s),
                  1e3 * tuning->delay_std_s, truth.sensitivity, truth.load_transfer, truth.spectral_radius);
  }
  std::printf("%s, %s: %s\n", std::string(experiment).c_str(), std::string(name_of(how.structure)).c_str(),
              found.text().c_str());
  std::fflush(stdout);
  return found;
}

}  // namespace resonid::test
