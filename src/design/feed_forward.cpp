// SPDX-License-Identifier: MIT
#include "design/feed_forward.hpp"

#include <algorithm>
#include <cmath>

#include "design/controller.hpp"

namespace resonid::design {
namespace {

double sign_of(double x) { return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : 0.0; }

/// Twist e of a two-mass drive whose load follows a move, D e' + K e = J2 a + b v, and its first two
/// derivatives. The right side is a polynomial, so that the solution is a finite sum of its derivatives, and
/// what decays from the ends, where the higher of them jump.
class Twist {
 public:
  Twist(const data::ThreeMassParameters& p, const PolynomialMove& move)
      : p_(p), move_(move), time_constant_s_(p.damping / p.stiffness) {}

  [[nodiscard]] std::array<double, 3> at(double time_s) const {
    std::array<double, 3> e{};
    if (!(time_s > 0.0)) return e;
    const bool during = time_s < move_.duration_s;
    if (during) e = forced(move_.at(time_s));
    add_decay(-forced(move_.at(kBegin * move_.duration_s))[0], time_s, e);
    if (!during)
      add_decay(forced(move_.at((1.0 - kBegin) * move_.duration_s))[0], time_s - move_.duration_s, e);
    return e;
  }

 private:
  static constexpr double kBegin = 1e-12;  // just inside, where the derivatives are the polynomial's

  [[nodiscard]] std::array<double, 3> forced(const std::array<double, 10>& x) const {
    std::array<double, 3> e{};
    for (std::size_t d = 0; d < e.size(); ++d) {
      double factor = 1.0 / p_.stiffness;
      for (std::size_t n = d + 1; n < x.size(); ++n) {
        const double acceleration = n + 1 < x.size() ? x[n + 1] : 0.0;
        e[d] += factor * (p_.load_inertia * acceleration + p_.load_viscous_friction * x[n]);
        factor *= -time_constant_s_;
      }
    }
    return e;
  }
  void add_decay(double size, double since_s, std::array<double, 3>& e) const {
    if (!(time_constant_s_ > 0.0)) return;
    double value = size * std::exp(-since_s / time_constant_s_);
    for (double& derivative : e) {
      derivative += value;
      value /= -time_constant_s_;
    }
  }

  const data::ThreeMassParameters& p_;
  const PolynomialMove& move_;
  double time_constant_s_;
};

/// Path of the motor up to its acceleration, and the torque that takes it there.
struct MotorPath {
  double position = 0.0, velocity = 0.0, torque = 0.0;
};

class Path {
 public:
  Path(const fit::DriveModel& model, const PolynomialMove& move, FeedForward kind, double coulomb_nm)
      : p_(model.parameters), move_(move), kind_(kind), coulomb_nm_(coulomb_nm), twist_(p_, move) {
    inertia_ = p_.driven_inertia;
    if (model.structure != fit::Structure::rigid) inertia_ += p_.load_inertia;
    if (model.structure == fit::Structure::three_mass) inertia_ += p_.middle_inertia;
  }

  [[nodiscard]] MotorPath at(double time_s) const {
    const auto x = move_.at(time_s);
    MotorPath path{x[0], x[1], inertia_ * x[2] + p_.load_viscous_friction * x[1]};
    if (kind_ == FeedForward::flexible) {
      const auto e = twist_.at(time_s);
      path.position += e[0];
      path.velocity += e[1];
      path.torque += p_.driven_inertia * e[2];
    }
    path.torque += p_.viscous_friction * path.velocity + coulomb_nm_ * sign_of(path.velocity);
    return path;
  }

 private:
  const data::ThreeMassParameters& p_;
  const PolynomialMove& move_;
  FeedForward kind_;
  double coulomb_nm_;
  double inertia_ = 0.0;
  Twist twist_;
};

/// The torque, up to `most`, that slows the driven side down and stops it, but does not push it on.
double friction_torque(const fit::SampledStates& drive, const Eigen::VectorXd& next, double most) {
  return most > 0.0 ? std::clamp(next(0) / drive.command(0), -most, most) : 0.0;
}

}  // namespace

std::array<double, 10> PolynomialMove::at(double time_s) const {
  std::array<double, 10> x{};
  const double tau = time_s / duration_s;
  if (!(tau > 0.0)) return x;
  x[0] = distance_rad;
  if (!(tau < 1.0)) return x;
  std::array<double, 10> p{0.0, 0.0, 0.0, 0.0, 0.0, 126.0, -420.0, 540.0, -315.0, 70.0};
  double scale = distance_rad;
  for (double& derivative : x) {
    double sum = 0.0;
    for (std::size_t i = p.size(); i-- > 0;) sum = sum * tau + p[i];
    derivative = scale * sum;
    scale /= duration_s;
    for (std::size_t i = 0; i + 1 < p.size(); ++i) p[i] = static_cast<double>(i + 1) * p[i + 1];
    p.back() = 0.0;
  }
  return x;
}

std::optional<std::vector<MoveSample>> move_samples(const fit::DriveModel& model, const PolynomialMove& move,
                                                    FeedForward kind, std::size_t samples,
                                                    double coulomb_nm) {
  if (kind == FeedForward::flexible && (model.structure != fit::Structure::two_mass || model.grounded()))
    return std::nullopt;
  const Path path(model, move, kind, coulomb_nm);
  const double delay_s =
      kind >= FeedForward::delayed ? std::max(0.0, model.delay_s + model.known_delay_s) : 0.0;
  std::vector<MoveSample> all(samples);
  for (std::size_t k = 0; k < samples; ++k) {
    const double time_s = static_cast<double>(k) * model.sample_time_s;
    const MotorPath now = path.at(time_s), late = path.at(time_s - delay_s);
    all[k] = {move.at(time_s)[0], late.position, kind >= FeedForward::velocity ? late.velocity : 0.0,
              kind >= FeedForward::inertia ? now.torque : 0.0};
  }
  return all;
}

MoveFigures move_figures_of(const Machine& machine, const Cascade& cascade,
                            const std::vector<MoveSample>& samples, double duration_s, double coulomb_nm) {
  const auto& drive = machine.states();
  const double step = machine.sample_time_s();
  const ControllerStates velocity = states_of(cascade.velocity, step);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(drive.a.rows()), c = Eigen::VectorXd::Zero(velocity.a.rows());
  double measured_position = 0.0, load_position = 0.0, load_before = 0.0, squares = 0.0;
  MoveFigures found;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const MoveSample& now = samples[k];
    const double measured = drive.measured * x, load = drive.load * x;
    measured_position += step * measured;
    load_position += 0.5 * step * (load_before + load);  // wrong by what the velocity bends within a sample
    load_before = load;
    const double error = std::abs(now.load_position - load_position);
    const double since_end_s = static_cast<double>(k) * step - duration_s;
    if (std::abs(since_end_s) > 1e-9 * duration_s) {  // the end itself is in neither
      double& worst = since_end_s < 0.0 ? found.error_during : found.error_after;
      worst = std::max(worst, error);
    }
    const double deviation = cascade.kv * (now.position - measured_position) + now.velocity - measured;
    const double torque = velocity.c * c + velocity.d * deviation + now.torque;
    c = (velocity.a * c + velocity.b * deviation).eval();
    found.peak_torque = std::max(found.peak_torque, std::abs(torque));
    squares += torque * torque;
    x = (drive.a * x + drive.command * torque).eval();
    x -= drive.command * friction_torque(drive, x, coulomb_nm);
  }
  if (!samples.empty()) found.rms_torque = std::sqrt(squares / static_cast<double>(samples.size()));
  return found;
}

}  // namespace resonid::design
