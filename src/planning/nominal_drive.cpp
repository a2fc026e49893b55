// SPDX-License-Identifier: MIT
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/discrete_filter.hpp>
#include <resonid/planning/detail/nominal_drive.hpp>

namespace resonid::planning {
namespace {

/// The machine without its position; as many states as order_of(structure).
template <int States>
LinearSystem<double, States> continuous(const fit::DriveModel& model) {
  const auto& p = model.parameters;
  if constexpr (States == 5) return data::continuous_system<double>(p);
  LinearSystem<double, States> s;
  if constexpr (States == 3) {
    s = data::continuous_system<double>(static_cast<const data::TwoMassParameters&>(p));
    s.a(1, 1) -= p.load_viscous_friction / p.load_inertia;
    return s;
  }
  s.a(0, 0) = -p.viscous_friction / p.driven_inertia;
  s.b(0) = 1.0 / p.driven_inertia;
  s.c(0) = 1.0;
  return s;
}

/// The machine sampled by zero-order hold, and its velocity as it is measured:
/// y(k + 1 + whole_delay) = row x(k) + through u(k), the state between two samples for a fraction of one.
template <int States>
struct Sampled {
  using System = LinearSystem<double, States>;
  explicit Sampled(const fit::DriveModel& model) {
    const System s = continuous<States>(model);
    const double step = model.sample_time_s;
    zoh = zero_order_hold<double, States>(s, step);
    const double delay = std::max(0.0, (model.delay_s + model.known_delay_s) / step);
    whole_delay = static_cast<std::size_t>(std::floor(delay + 1e-9));
    const double fraction = std::max(0.0, delay - static_cast<double>(whole_delay));
    const System partial = zero_order_hold<double, States>(s, (1.0 - fraction) * step);
    row = partial.a.row(0);
    through = partial.b(0);
  }
  System zoh;
  typename System::Row row;
  double through = 0.0;
  std::size_t whole_delay = 0;
};

/// Calls function(Sampled) for the model's structure.
template <class Function>
auto with_sampled(const fit::DriveModel& model, Function&& function) {
  switch (model.structure) {
    case fit::Structure::rigid:
      return function(Sampled<1>(model));
    case fit::Structure::two_mass:
      return function(Sampled<3>(model));
    default:
      return function(Sampled<5>(model));
  }
}

constexpr std::size_t kMostCoefficients = 32;
using Controller = DiscreteFilter<double, kMostCoefficients - 1>;

std::complex<double> delay_factor(const fit::DriveModel& model, double f) {
  return std::polar(1.0, -kTwoPi * f * model.known_delay_s);
}

}  // namespace

std::size_t states_of(const fit::DriveModel& model) noexcept {
  return static_cast<std::size_t>(fit::order_of(model.structure));
}

std::vector<data::Mode> modes_of(const fit::DriveModel& model) {
  fit::DriveModel exact = model;
  exact.estimated.fill(false);  // error bars cost many times the modes
  return exact.modes();
}

expected<void, Error> check(const NominalDrive& drive) {
  const auto& m = drive.model;
  const auto& p = m.parameters;
  if (!(m.sample_time_s > 0.0)) return refuse("sample_rate_hz", "must be > 0", m.sample_time_s);
  for (int i = 0; i < fit::kParameterCount; ++i) {
    const double value = m.value(static_cast<fit::Parameter>(i));
    if (!fit::has_parameter(m.structure, i)) continue;
    if (!(value > 0.0 && std::isfinite(value)))
      return refuse(fit::kParameterNames[static_cast<std::size_t>(i)], "must be > 0", value);
  }
  for (const auto& mode : modes_of(m))
    if (!mode.anti && !(2.0 * mode.frequency_hz.value * m.sample_time_s < 1.0))
      return refuse("sample_rate_hz", "must be more than twice the resonance", 1.0 / m.sample_time_s);
  if (m.grounded()) return refuse("model", "must have no spring to the ground");
  if (!(p.viscous_friction >= 0.0)) return refuse("viscous_friction", "must be >= 0", p.viscous_friction);
  if (!(m.known_delay_s >= 0.0 && m.known_delay_s <= 1000.0 * m.sample_time_s))
    return refuse("delay_s", "must be 0 ... 1000 samples", m.known_delay_s);
  if (!(drive.noise.innovation_variance > 0.0))
    return refuse("noise", "must be > 0", std::sqrt(std::max(0.0, drive.noise.innovation_variance)));
  if (drive.controller && !Controller::create(drive.controller->numerator, drive.controller->denominator))
    return refuse("controller", "must have 1 ... 32 coefficients and a denominator that begins with no 0");
  if (!stable(drive))
    return refuse("controller", "must stabilise the nominal model: its closed loop is unstable");
  return {};
}

LoopResponse loop_response(const NominalDrive& drive, std::span<const double> frequency_hz) {
  const auto plain = drive.model.values(frequency_hz);
  const auto measured = drive.model.values(frequency_hz, true);
  LoopResponse r;
  for (std::size_t i = 0; i < frequency_hz.size(); ++i) {
    const double f = frequency_hz[i];
    std::complex<double> sensitivity = 1.0;
    if (drive.controller)
      sensitivity = 1.0 / (1.0 + drive.controller->response(f) * measured[i] * delay_factor(drive.model, f));
    r.torque.push_back(sensitivity);
    r.velocity.push_back(plain[i] * sensitivity);
    r.position.push_back(r.velocity.back() / std::complex<double>(0.0, kTwoPi * f));
  }
  return r;
}

Motion simulate(const NominalDrive& drive, std::span<const double> excitation,
                std::span<const double> start) {
  const std::size_t n = excitation.size();
  Motion motion{std::vector<double>(n), std::vector<double>(n), std::vector<double>(n), {}};
  std::optional<Controller> controller;
  if (drive.controller)
    controller = *Controller::create(drive.controller->numerator, drive.controller->denominator);
  with_sampled(drive.model, [&](const auto& plant) {
    motion.measured.assign(n + plant.whole_delay + 1, 0.0);
    auto x = std::decay_t<decltype(plant)>::System::Column::Zero().eval();
    const auto states = std::min(start.size(), static_cast<std::size_t>(x.size()));
    for (std::size_t i = 0; i < states; ++i) x(static_cast<Eigen::Index>(i)) = start[i];
    double position = 0.0;
    for (std::size_t k = 0; k < n; ++k) {
      double u = excitation[k];
      if (controller) u -= controller->step(motion.measured[k]);
      motion.torque[k] = u;
      motion.velocity[k] = x(0);
      motion.position[k] = position;
      motion.measured[k + 1 + plant.whole_delay] = plant.row * x + plant.through * u;
      const double before = x(0);
      x = (plant.zoh.a * x + plant.zoh.b * u).eval();
      position += 0.5 * drive.model.sample_time_s * (before + x(0));
    }
  });
  motion.measured.resize(n);
  return motion;
}

bool stable(const NominalDrive& drive) {
  if (!drive.controller) return true;
  // An unstable loop grows out of a kick; a stable one has forgotten most of it after many periods of its
  // slowest motion, which is looked for by waiting longer and longer.
  std::size_t samples = 4096;
  constexpr std::size_t kLongest = std::size_t{1} << 19;
  for (; samples <= kLongest; samples *= 4) {
    std::vector<double> kick(samples, 0.0);
    kick[0] = 1.0;
    const auto motion = simulate(drive, kick);
    double early = 0.0, late = 0.0;
    for (std::size_t k = 0; k < samples; ++k) {
      const double size = std::abs(motion.torque[k]);
      if (!std::isfinite(size) || size > 1e9) return false;
      (2 * k < samples ? early : late) = std::max(2 * k < samples ? early : late, size);
    }
    if (late < 1e-3 * early) return true;
  }
  return false;
}

std::vector<NominalDrive> possible_drives(const NominalDrive& drive, double spread) {
  std::vector<NominalDrive> drives{drive};
  if (!(spread > 0.0)) return drives;
  // Corners of a two-level design of strength two: three basic signs and their products.
  const auto structure = drive.model.structure;
  for (int corner = 0; corner < (structure == fit::Structure::rigid ? 2 : 8); ++corner) {
    const double a = (corner & 1) != 0 ? 1.0 : -1.0;
    const double b = (corner & 2) != 0 ? 1.0 : -1.0;
    const double c = (corner & 4) != 0 ? 1.0 : -1.0;
    NominalDrive other = drive;
    const auto move = [&](double& value, double direction) {
      value *= direction > 0.0 ? 1.0 + spread : 1.0 / (1.0 + spread);
    };
    auto& p = other.model.parameters;
    move(p.driven_inertia, a);
    move(p.load_inertia, b);
    move(p.stiffness, c);
    move(p.damping, a * b * c);
    move(p.middle_inertia, a * b);
    move(p.stiffness_2, a * c);
    move(p.damping_2, b * c);
    if (stable(other)) drives.push_back(other);
  }
  return drives;
}

}  // namespace resonid::planning
