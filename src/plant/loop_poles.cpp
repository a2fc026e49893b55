// SPDX-License-Identifier: MIT
#include "plant/loop_poles.hpp"

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::plant {
namespace {

using Complex = std::complex<double>;

/// Sum of x_i z^-i.
Complex in_powers(const std::vector<double>& x, Complex z) {
  Complex sum = 0.0;
  for (std::size_t i = x.size(); i-- > 0;) sum = sum / z + x[i];
  return sum;
}

struct Ways {
  Eigen::RowVectorXd early, whole;  // by the states
};
/// Ways of the driven side up to the reading and over the whole sample.
Ways ways(const SampledDrive& drive) {
  const Eigen::Index angle = drive.a.rows() - 1;
  const Eigen::RowVectorXd now = Eigen::RowVectorXd::Unit(drive.a.rows(), angle);
  return {drive.early_angle - now, drive.a.row(angle) - now};
}

/// From the velocity that is read to what C acts on: filtered, held, and of a cascade its integral beside it.
Complex seen_by_law(const VelocityPath& path, double step_s, Complex z) {
  Complex seen = 1.0;
  if (path.filter_pole > 0.0) seen = (1.0 - path.filter_pole) / (1.0 - path.filter_pole / z);
  if (path.hold > 1) {
    Complex mean = 0.0;
    for (std::size_t i = 0; i < path.hold; ++i) mean = mean / z + 1.0;
    seen *= mean / static_cast<double>(path.hold);
  }
  return seen + path.position_gain * step_s * z / (z - 1.0);
}

/// L(z) without the whole samples of the delay.
Complex loop_without_delay(const SampledDrive& drive, const VelocityPath& path,
                           const data::TransferFunction& controller, Complex z) {
  const Eigen::Index n = drive.moving_states();
  Eigen::MatrixXcd m = -drive.a.topLeftCorner(n, n).cast<Complex>();
  m.diagonal().array() += z;
  const Eigen::VectorXcd x = linalg::ComplexLu(m).solve(drive.b.head(n).cast<Complex>());
  const auto seen = [&](const Eigen::RowVectorXd& row, double command) {
    return (row.head(n).cast<Complex>() * x)(0) + command;
  };
  Complex reading = seen(drive.early_velocity, drive.early_velocity_command);
  if (path.source ==
      VelocitySource::encoder) {  // way up to the reading, and what was left of the sample before
    const auto [first, all] = ways(drive);
    const Complex early = seen(first, drive.early_angle_command);
    reading = (early + (seen(all, drive.b(drive.b.size() - 1)) - early) / z) / drive.sample_time_s;
  }
  const Complex law = in_powers(controller.numerator, z) / in_powers(controller.denominator, z);
  return law * seen_by_law(path, drive.sample_time_s, z) * reading / z;
}

/// Angles at which |L| may change fast: 1 % apart, and close to the machine's own poles as close as these lie
/// to the circle.
std::vector<double> angles_of(const SampledDrive& drive, double outside) {
  constexpr double kFirst = 1e-11;  // rad, well below `outside`: the turn around an integrator is seen
  constexpr double kRatio = 1.01;
  constexpr double kNearest = 0.05;  // of a pole's distance from the circle
  constexpr double kStep = 1.05;
  std::vector<double> angles;
  for (double angle = kFirst; angle < kPi; angle *= kRatio) angles.push_back(angle);
  angles.push_back(kPi);
  const Eigen::Index n = drive.moving_states();
  const Eigen::VectorXcd poles = linalg::eigenvalues(drive.a.topLeftCorner(n, n));
  for (Eigen::Index i = 0; i < n; ++i) {
    const Complex pole = poles(i);
    const double centre = std::arg(pole);
    if (!(centre > 0.0)) continue;
    const double distance = std::max(std::abs(1.0 - std::abs(pole)), outside);
    angles.push_back(centre);
    for (double off = kNearest * distance; off < 0.1 * centre; off *= kStep) {
      angles.push_back(centre - off);
      if (centre + off < kPi) angles.push_back(centre + off);
    }
  }
  std::sort(angles.begin(), angles.end());
  return angles;
}

}  // namespace

data::FrequencyResponse loop_response(const SampledDrive& drive, const SampleDelay& delay,
                                      const VelocityPath& path, const data::TransferFunction& controller,
                                      std::vector<double> frequency_hz) {
  data::FrequencyResponse loop;
  loop.frequency_hz = std::move(frequency_hz);
  // A held velocity samples the loop anew: at the rate of its new values the images add up.
  const std::size_t images = path.position_gain > 0.0 ? 1 : path.hold;
  for (const double f : loop.frequency_hz) {
    Complex sum = 0.0;
    for (std::size_t i = 0; i < images; ++i) {
      const double turns = static_cast<double>(i) / static_cast<double>(images);
      const double angle = kTwoPi * (f * drive.sample_time_s + turns);
      sum += loop_without_delay(drive, path, controller, std::polar(1.0, angle)) *
             std::polar(1.0, -angle * static_cast<double>(delay.whole));
    }
    loop.value.push_back(sum);
  }
  return loop;
}

bool loop_is_unstable(const SampledDrive& drive, const SampleDelay& delay, const VelocityPath& path,
                      const data::TransferFunction& controller) {
  constexpr double kOutside = 1e-9;  // of the circle: integrators lie on it
  const auto samples = static_cast<double>(delay.whole);
  const double delay_log_gain = -samples * std::log1p(kOutside);
  // From one angle to the next L without the delay hardly changes, and the delay's turn is known: what lies
  // in between needs no evaluation however long the delay is.
  double angle = 0.0, log_gain = 0.0, phase = 0.0;  // of the last L
  Complex last = 0.0;
  // At 0 and at half the sample rate L is real: left of -1, an odd number of poles is outside.
  const auto left_of_critical = [&] { return log_gain > 0.0 && std::cos(phase) < 0.0; };
  double encirclements = 0.0;
  for (const double next : angles_of(drive, kOutside)) {
    const Complex loop = loop_without_delay(drive, path, controller, std::polar(1.0 + kOutside, next));
    if (loop == 0.0) continue;
    const double next_log_gain = std::log(std::abs(loop)) + delay_log_gain;
    const bool first = last == 0.0;
    const double next_phase =
        first ? std::arg(loop) - next * samples : phase + std::arg(loop / last) - (next - angle) * samples;
    if (!first && std::max(log_gain, next_log_gain) > 0.0) {
      // The part of the way on which |L| > 1.
      const double unity = log_gain / (log_gain - next_log_gain);
      const double from = log_gain > 0.0 ? 0.0 : unity;
      const double to = next_log_gain > 0.0 ? 1.0 : unity;
      const auto half_turns = [&](double part) {
        return std::floor((phase + part * (next_phase - phase) + kPi) / kTwoPi);
      };
      encirclements += half_turns(to) - half_turns(from);
    }
    angle = next;
    log_gain = next_log_gain;
    phase = next_phase;
    last = loop;
    if (first && left_of_critical()) return true;
  }
  return encirclements != 0.0 || left_of_critical();
}

namespace {

/// The closed loop over one sample, x(k+1) = step x(k), in which the held velocity is renewed or stays.
/// State: [machine; readings r_0 ... r_m, newest first; for differences the position increment's second half;
/// the velocity filter's and the held value; of a cascade the position; controller]. A free machine without
/// its angle: increments of position are linear in the rest.
class LoopStep {
  using Index = Eigen::Index;

 public:
  LoopStep(const SampledDrive& drive, const SampleDelay& delay, const VelocityPath& path,
           const data::TransferFunction& controller)
      : drive_(drive),
        path_(path),
        controller_(controller),
        machine_(drive.moving_states()),
        reading_(machine_ + static_cast<Index>(delay.whole)),
        rest_(reading_ + 1),
        filter_(rest_ + (path.source == VelocitySource::encoder ? 1 : 0)),
        kept_(filter_ + (path.filter_pole > 0.0 ? 1 : 0)),
        position_(kept_ + (path.hold > 1 ? 1 : 0)),
        first_(position_ + (path.position_gain > 0.0 ? 1 : 0)),
        order_(static_cast<Index>(std::max(controller.numerator.size(), controller.denominator.size())) - 1) {
  }

  [[nodiscard]] Eigen::MatrixXd at(bool renewed) const {
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(first_ + order_, first_ + order_);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(first_ + order_);  // of u
    put_machine(a, b);
    const Eigen::RowVectorXd seen = put_path(a, renewed);
    const Eigen::RowVectorXd u = put_controller(a, seen);
    return a + b * u;
  }

 private:
  void put_machine(Eigen::MatrixXd& a, Eigen::VectorXd& b) const {
    const Index n = machine_;
    a.topLeftCorner(n, n) = drive_.a.topLeftCorner(n, n);
    b.head(n) = drive_.b.head(n);
    if (path_.source == VelocitySource::encoder) {
      // Way in this sample up to the reading, and the rest of it, which the next reading adds.
      const double rate = 1.0 / drive_.sample_time_s;
      const auto [early, whole] = ways(drive_);
      a.row(n).head(n) = rate * early.head(n);
      b(n) = rate * drive_.early_angle_command;
      a(n, rest_) = 1.0;
      a.row(rest_).head(n) = rate * (whole - early).head(n);
      b(rest_) = rate * (drive_.b(drive_.b.size() - 1) - drive_.early_angle_command);
    } else {
      a.row(n).head(n) = drive_.early_velocity.head(n);
      b(n) = drive_.early_velocity_command;
    }
    for (Index i = n + 1; i <= reading_; ++i) a(i, i - 1) = 1.0;
  }

  /// What the controller's law acts on, by the state.
  Eigen::RowVectorXd put_path(Eigen::MatrixXd& a, bool renewed) const {
    const auto unit = [&](Index i) { return Eigen::RowVectorXd::Unit(a.cols(), i); };
    Eigen::RowVectorXd seen = unit(reading_);
    if (path_.filter_pole > 0.0) {
      seen = path_.filter_pole * unit(filter_) + (1.0 - path_.filter_pole) * seen;
      a.row(filter_) = seen;
    }
    if (path_.hold > 1) {
      if (!renewed) seen = unit(kept_);
      a.row(kept_) = seen;
    }
    if (path_.position_gain > 0.0) {  // backward Euler
      a.row(position_) = unit(position_) + drive_.sample_time_s * unit(reading_);
      seen += path_.position_gain * a.row(position_);
    }
    return seen;
  }

  /// In transposed direct form: c = b0 e + s1, s_i' = s_(i+1) + b_i e - a_i c, with e = -seen. Returns c.
  Eigen::RowVectorXd put_controller(Eigen::MatrixXd& a, const Eigen::RowVectorXd& seen) const {
    const auto coefficient = [](const std::vector<double>& x, Index i) {
      return static_cast<std::size_t>(i) < x.size() ? x[static_cast<std::size_t>(i)] : 0.0;
    };
    const double a0 = controller_.denominator[0];
    Eigen::RowVectorXd u = -controller_.numerator[0] / a0 * seen;
    if (order_ > 0) u(first_) += 1.0;
    for (Index i = 0; i < order_; ++i) {
      a.row(first_ + i) -= coefficient(controller_.numerator, i + 1) / a0 * seen;
      if (i + 1 < order_) a(first_ + i, first_ + i + 1) += 1.0;
      a.row(first_ + i) -= coefficient(controller_.denominator, i + 1) / a0 * u;
    }
    return u;
  }

  const SampledDrive& drive_;
  const VelocityPath& path_;
  const data::TransferFunction& controller_;
  Index machine_;  // states of it; then the places of the others
  Index reading_;  // the oldest, which is read
  Index rest_;     // way from the reading to the sample's end, of differences
  Index filter_, kept_, position_, first_;
  Index order_;
};

}  // namespace

std::complex<double> dominant_loop_pole(const SampledDrive& drive, const SampleDelay& delay,
                                        const VelocityPath& path, const data::TransferFunction& controller) {
  const LoopStep step(drive, delay, path, controller);
  Eigen::MatrixXd a = step.at(true);
  if (path.hold > 1) {
    const Eigen::MatrixXd between = step.at(false);
    for (std::size_t i = 1; i < path.hold; ++i) a = (between * a).eval();
  }
  std::complex<double> greatest = 0.0;
  for (const auto& pole : linalg::eigenvalues(a))
    if (std::abs(pole) > std::abs(greatest)) greatest = pole;
  return path.hold > 1 ? std::pow(std::abs(greatest), 1.0 / static_cast<double>(path.hold)) : greatest;
}

}  // namespace resonid::plant
