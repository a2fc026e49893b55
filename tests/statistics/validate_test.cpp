// SPDX-License-Identifier: MIT
// How often `validate` doubts the true drive, and how often one of another stiffness: the published drive
// (Nevaranta 2016, Pub. VI, system 2) in closed loop, PRBS of 2.1 Nm.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <experiments.hpp>
#include <resonid/fit/drive_model.hpp>
#include <resonid/identification/validate.hpp>
#include <string>
#include <uniformity.hpp>
#include <vector>

namespace resonid {
namespace {

plant::ExperimentConfig experiment(double seconds, double noise, double stiffness, std::uint64_t seed) {
  auto c = test::published_drive(noise, 10.0, seed);
  c.drive.stiffness *= stiffness;
  c.excitation.kind = online::Kind::prbs;
  c.excitation.register_length = 13;
  c.excitation.amplitude = 2.1;
  c.run.duration_s = seconds;
  return c;
}

/// The true drive, known exactly.
fit::DriveModel true_drive(const plant::ExperimentConfig& c) {
  fit::DriveModel drive;
  drive.structure = fit::Structure::two_mass;
  const double radius = c.drive.radius_m;
  drive.parameters.driven_inertia = c.drive.driven_inertia;
  drive.parameters.load_inertia = c.drive.load_inertia;
  drive.parameters.stiffness = c.drive.stiffness * radius * radius;
  drive.parameters.damping = c.drive.damping * radius * radius;
  drive.sample_time_s = 1.0 / c.run.sample_rate_hz;
  drive.known_delay_s = c.measurement.delay_s;
  return drive;
}

struct Verdicts {
  int seeds = 0, doubted = 0;
  double visible =
      0.0;  ///< Mean energy of what the wrong stiffness does to the output over the noise variance.
};

/// What another drive makes of the same input, beside what this one makes, over the noise.
double energy(const data::TransferFunction& one, const data::TransferFunction& other,
              const std::vector<double>& input, double noise) {
  const auto a = one.simulate(input), b = other.simulate(input);
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += std::pow((a[k] - b[k]) / noise, 2);
  return sum;
}

/// The model of stiffness 1 on records of a machine of another stiffness. `fitted`: a two-mass model fitted
/// to a record of the same length and noise, where it is trusted; else the true one.
Verdicts verdicts(double seconds, double noise, double stiffness, bool fitted, int seeds) {
  Verdicts v;
  for (int i = 0; i < seeds; ++i) {
    const auto c = experiment(seconds, noise, 1.0, 1000 + static_cast<std::uint64_t>(i));
    const auto own = test::simulated(c);
    auto options = test::known(c);
    identification::CandidateModel candidate;
    if (fitted) {
      options.model = identification::ModelChoice::two_mass;
      const auto result = test::identified(own.record, options);
      if (!result.model || !result.trusted) continue;
      candidate = identification::candidate_of(result);
    } else {
      candidate.model = identification::ModelResult{true_drive(c), true, 0.0, {}, {}};
    }
    const auto other =
        test::simulated(experiment(seconds, noise, stiffness, 5000 + static_cast<std::uint64_t>(i)));
    const auto validation = identification::validate(other.record, candidate, {options, 25});
    if (!validation) {
      ADD_FAILURE() << validation.error().requirement;
      continue;
    }
    v.visible += energy(own.truth.plant, other.truth.plant, other.record.input.samples, noise) / seeds;
    ++v.seeds;
    if (validation->verdict != identification::Verdict::accepted) ++v.doubted;
  }
  std::printf("K x %.2f, %g s, noise %g, %s: %d of %d doubted, visible %.3g\n", stiffness, seconds, noise,
              fitted ? "fitted" : "true", v.doubted, v.seeds, v.visible);
  return v;
}

constexpr double kSeconds[] = {1.0, 2.0, 5.0, 16.0};
constexpr double kNoise[] = {0.02, 0.1, 0.5};

TEST(Validate, SeldomDoubtsTheTrueModel) {
  for (const bool fitted : {false, true}) {
    int seeds = 0, doubted = 0;
    for (const double seconds : kSeconds)
      for (const double noise : kNoise) {
        const auto v = verdicts(seconds, noise, 1.0, fitted, fitted ? 20 : 100);
        seeds += v.seeds;
        doubted += v.doubted;
      }
    EXPECT_GT(seeds, 100);
    EXPECT_LE(static_cast<double>(doubted), 0.05 * seeds) << fitted;
  }
}

/// Whether the stiffness can be seen at all is a matter of energy: what it changes of the output, over the
/// noise variance. Initial state, load torque and the other parameters take over what they can, nine tenths
/// of it at worst: of 1000, ten standard deviations are left, of which four are asked.
TEST(Validate, FindsAStiffnessThatIsOff) {
  constexpr double kAlways = 1000.0, kMostly = 200.0;
  int always = 0;
  for (const double stiffness : {0.95, 0.9, 0.8})
    for (const double seconds : kSeconds)
      for (const double noise : kNoise) {
        const auto v = verdicts(seconds, noise, stiffness, false, 20);
        SCOPED_TRACE(testing::Message() << "K x " << stiffness << ", " << seconds << " s, noise " << noise);
        ASSERT_EQ(v.seeds, 20);
        if (v.visible > kAlways) {
          EXPECT_EQ(v.doubted, v.seeds);
          ++always;
        } else if (v.visible > kMostly) {
          EXPECT_GE(v.doubted, 12);
        }
      }
  EXPECT_GE(always, 12);
}

// ---- whether the probabilities are ones

struct Kind {
  const char* name;
  online::Kind excitation;
  bool coloured;
};
constexpr Kind kKinds[] = {
    {"chirp", online::Kind::chirp, false},         {"chirp, coloured", online::Kind::chirp, true},
    {"PRBS", online::Kind::prbs, false},           {"PRBS, coloured", online::Kind::prbs, true},
    {"multisine", online::Kind::multisine, false}, {"multisine, coloured", online::Kind::multisine, true}};

plant::ExperimentConfig driven(const Kind& kind, std::uint64_t seed) {
  auto c = test::published_drive(0.1, 10.0, seed);
  c.excitation.kind = kind.excitation;
  c.excitation.amplitude = kind.excitation == online::Kind::prbs ? 2.1 : 1.0;
  c.run.duration_s = 16.0;
  if (kind.excitation == online::Kind::chirp) {
    test::sweep(c);
    c.run.duration_s = 17.0;
  } else if (kind.excitation == online::Kind::prbs) {
    c.excitation.register_length = 13;
  } else {
    constexpr double kLines[] = {2.9, 5.9, 8.9, 11.9, 14.9, 17.9, 20.9, 23.9};
    c.excitation.lines_hz.assign(kLines);
  }
  if (kind.coloured) c.measurement.noise_bandwidth_hz = 20.0;
  return c;
}

struct Probabilities {
  std::vector<double> dependence, velocity, input, response;
};

/// The machine's own model, known exactly or fitted to another record or (`own`) to this one.
enum class Model { exact, of_another, of_this };

Probabilities probabilities(const Kind& kind, Model model, int seeds) {
  Probabilities p;
  for (int i = 0; i < seeds; ++i) {
    const auto c = driven(kind, 20000 + static_cast<std::uint64_t>(i));
    const auto record = test::simulated(c).record;
    auto options = test::known(c);
    identification::CandidateModel candidate;
    identification::ValidateOptions how{options, 25};
    if (model == Model::exact) {
      candidate.model = identification::ModelResult{true_drive(c), true, 0.0, {}, {}};
    } else {
      options.model = identification::ModelChoice::two_mass;
      const auto other = model == Model::of_this
                             ? record
                             : test::simulated(driven(kind, 40000 + static_cast<std::uint64_t>(i))).record;
      const auto result = test::identified(other, options);
      if (!result.model) continue;
      candidate = identification::candidate_of(result);
      how.own_record = model == Model::of_this;
    }
    const auto v = identification::validate(record, candidate, how);
    if (!v) {
      ADD_FAILURE() << v.error().requirement;
      continue;
    }
    p.dependence.push_back(v->dependence.probability);
    p.response.push_back(v->response_probability.value_or(1.0));
    for (const auto& map : v->maps)
      (map.over == "velocity" ? p.velocity : p.input).push_back(map.probability);
  }
  return p;
}

void tell(const char* what, const std::vector<double>& p) {
  std::printf("  %-10s %4zu  KS %.3f  below 0.05: %.3f  0.01: %.3f  0.001: %.3f\n", what, p.size(),
              test::uniformity(p), test::share_below(p, 0.05), test::share_below(p, 0.01),
              test::share_below(p, 0.001));
}

/// Uniform over the seeds, each kind on its own; 200 of them, or RESONID_SEEDS.
void expect_uniform(Model model) {
  const char* told = std::getenv("RESONID_SEEDS");
  const int seeds = told ? std::atoi(told) : 200;
  for (const Kind& kind : kKinds) {
    SCOPED_TRACE(kind.name);
    const auto p = probabilities(kind, model, seeds);
    std::printf("%s\n", kind.name);
    tell("dependence", p.dependence);
    tell("velocity", p.velocity);
    tell("input", p.input);
    tell("response", p.response);
    std::fflush(stdout);
    EXPECT_GT(test::uniformity(p.dependence), 1e-3);
    EXPECT_GT(test::uniformity(p.velocity), 1e-3);
    EXPECT_TRUE(p.input.empty() || test::uniformity(p.input) > 1e-3);
    // An upper bound: the greater of two probabilities.
    EXPECT_LE(test::share_below(p.response, 1e-3), 0.005 + 2.0 / seeds);
  }
}

TEST(ValidateProbabilities, AreUniformForTheExactModel) { expect_uniform(Model::exact); }
TEST(ValidateProbabilities, AreUniformForAModelOfAnotherRecord) { expect_uniform(Model::of_another); }
TEST(ValidateProbabilities, AreUniformForTheModelOfTheRecordItself) { expect_uniform(Model::of_this); }

}  // namespace
}  // namespace resonid
