// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <monitoring/cause.hpp>
#include <random>

namespace resonid::monitoring::test {

/// A machine of two masses and its loop, as they are.
struct TrueMachine {
  double stiffness = 100.0, driven_inertia = 0.01, load_inertia = 0.02, damping = 0.02;
  double coulomb_friction = 0.2, load_torque = 0.5;
  double modulus_margin = 0.6, phase_margin = 50.0, gap = 0.01;
};

/// What a tracker says of it: stiffness and inertias of one estimate, whose errors are correlated (the load's
/// inertia carries the stiffness with it, and one scale carries all), the frequencies derived from them.
/// Standard deviations are the true ones of each figure by itself.
class Tracker {
 public:
  /// `quality`: 1 for errors of a per cent, larger is worse.
  Tracker(double quality, double scale_error, std::mt19937_64& random)
      : quality_(quality), scale_(scale_error), random_(random) {}

  [[nodiscard]] std::array<online::Figure, kWatched> look_at(const TrueMachine& m) {
    const double driven = 0.01 * quality_, load = 0.015 * quality_, frequency = 0.002 * quality_;
    const double scale = normal() * scale_, e1 = scale + driven * normal(), e2 = scale + load * normal(),
                 ef = frequency * normal();
    const double j1 = m.driven_inertia * std::exp(e1), j2 = m.load_inertia * std::exp(e2),
                 k = m.stiffness * std::exp(e2 + 2.0 * ef);
    const double share = j1 / (j1 + j2);
    std::array<online::Figure, kWatched> out{};
    const auto put = [&](Watched w, double value, double std) {
      out[static_cast<std::size_t>(w)] = {value, std};
    };
    constexpr double kPerHz = 2.0 * 3.14159265358979323846;
    const double fa = std::sqrt(k / j2) / kPerHz, fr = std::sqrt(k / j1 + k / j2) / kPerHz;
    put(Watched::antiresonance, fa, fa * frequency);
    // fr^2 = fa^2 (1 + j2/j1)
    put(Watched::resonance, fr, fr * std::hypot(frequency, 0.5 * (1.0 - share) * std::hypot(driven, load)));
    put(Watched::stiffness, k, k * std::hypot(scale_, load, 2.0 * frequency));
    put(Watched::driven_inertia, j1, j1 * std::hypot(scale_, driven));
    put(Watched::load_inertia, j2, j2 * std::hypot(scale_, load));
    const double ed = 0.05 * quality_;
    put(Watched::damping, m.damping * std::exp(scale + ed * normal()), m.damping * std::hypot(ed, scale_));
    const double ec = 0.02 * quality_;
    put(Watched::coulomb_friction, m.coulomb_friction * (1.0 + ec * normal()), m.coulomb_friction * ec);
    const double et = 0.01 * quality_ * m.coulomb_friction;
    put(Watched::load_torque, m.load_torque + et * normal(), et);
    put(Watched::modulus_margin, m.modulus_margin * std::exp(0.01 * quality_ * normal()),
        m.modulus_margin * 0.01 * quality_);
    put(Watched::phase_margin, m.phase_margin + 0.5 * quality_ * normal(), 0.5 * quality_);
    put(Watched::gap, m.gap + 0.003 * quality_ * normal(), 0.003 * quality_);
    return out;
  }

 private:
  double normal() { return std::normal_distribution<double>()(random_); }
  double quality_, scale_;
  std::mt19937_64& random_;
};

inline double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

inline TrueMachine any_machine(std::mt19937_64& random) {
  TrueMachine m;
  const double ratio = std::exp(uniform(random, std::log(0.2), std::log(5.0)));
  m.load_inertia = ratio * m.driven_inertia;
  m.stiffness = std::pow(6.28 * uniform(random, 5.0, 60.0), 2.0) * m.load_inertia;
  m.load_torque = uniform(random, -1.0, 1.0);
  m.modulus_margin = uniform(random, 0.4, 0.8);
  m.phase_margin = uniform(random, 35.0, 65.0);
  return m;
}

/// The machine after a cause of this relative size, with what else follows: a loop whose plant changed has
/// other margins, and a response away from the baseline. Every second one has what may come with the cause.
inline TrueMachine changed(TrueMachine m, Cause cause, double size, std::mt19937_64& random) {
  const double way = uniform(random, 0.0, 1.0) < 0.5 ? -1.0 : 1.0;
  const bool more = uniform(random, 0.0, 1.0) < 0.5;
  const auto loop_follows = [&](double by) {
    m.modulus_margin *= std::exp(by * uniform(random, -0.5, 0.5));
    m.phase_margin += 57.3 * by * uniform(random, -0.3, 0.3);
    m.gap += by * uniform(random, 0.1, 0.8);
  };
  switch (cause) {
    case Cause::coupling_looser:
    case Cause::coupling_stiffer:
      m.stiffness *= cause == Cause::coupling_looser ? 1.0 - size : 1.0 + size;
      if (more) m.damping *= std::exp(uniform(random, -1.0, 1.0) * size);
      if (more) m.coulomb_friction *= std::exp(uniform(random, -0.5, 0.5) * size);
      loop_follows(size);
      break;
    case Cause::load_heavier:
    case Cause::load_lighter: {
      const double by = cause == Cause::load_heavier ? 1.0 + size : 1.0 - size;
      m.load_inertia *= by;
      if (more) m.load_torque *= by;
      if (more) m.coulomb_friction *= by;
      loop_follows(size);
      break;
    }
    case Cause::motor_inertia:
      m.driven_inertia *= 1.0 + way * size;
      loop_follows(size);
      break;
    case Cause::input_scale: {
      const double by = 1.0 + way * size;
      for (double* x : {&m.stiffness, &m.driven_inertia, &m.load_inertia, &m.damping, &m.coulomb_friction,
                        &m.load_torque})
        *x *= by;
      loop_follows(size);
      break;
    }
    case Cause::friction_rose:
    case Cause::friction_fell: {
      const double by = cause == Cause::friction_rose ? 1.0 + 4.0 * size : 1.0 / (1.0 + 4.0 * size);
      const double which = uniform(random, 0.0, 3.0);
      if (which < 2.0) m.damping *= by;
      if (which > 1.0) m.coulomb_friction *= by;
      loop_follows(0.2 * size);
      break;
    }
    case Cause::load_torque:
      m.load_torque += way * 3.0 * size * m.coulomb_friction;
      break;
    case Cause::delay_or_gains:
      m.modulus_margin *= 1.0 - size;
      m.phase_margin -= 57.3 * size * uniform(random, 0.0, 1.0);
      if (more) m.gap += size * uniform(random, 0.0, 0.5);
      break;
    case Cause::not_described:
      m.gap += size;
      if (more) m.modulus_margin *= 1.0 - 0.3 * size;
      break;
    case Cause::unknown:
      break;
  }
  return m;
}

inline std::array<FigureShift, kWatched> shifts_between(const TrueMachine& before, const TrueMachine& after,
                                                        Tracker& baseline, Tracker& now) {
  const auto from = baseline.look_at(before), to = now.look_at(after);
  std::array<FigureShift, kWatched> shifts{};
  for (std::size_t i = 0; i < kWatched; ++i) shifts[i] = {from[i], to[i]};
  return shifts;
}

}  // namespace resonid::monitoring::test
