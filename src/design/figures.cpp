// SPDX-License-Identifier: MIT
#include "design/figures.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <resonid/base/constants.hpp>

#include "design/course.hpp"
#include "linalg/decompositions.hpp"

namespace resonid::design {
namespace {

using Function = std::function<double(const LoopFunctions::Values&)>;

/// A frequency between two at which the function changes its sign.
double root_between(const LoopFunctions& loop, const Function& function, double from_hz, double to_hz) {
  constexpr int kInner = 4, kRounds = 20;
  const bool rises = function(loop.at(std::array{from_hz}).front()) < 0.0;
  for (int round = 0; round < kRounds && to_hz - from_hz > 1e-12 * to_hz; ++round) {
    std::array<double, kInner> points;
    const double width = (to_hz - from_hz) / (kInner + 1.0);
    for (std::size_t i = 0; i < kInner; ++i) points[i] = from_hz + width * static_cast<double>(i + 1);
    const auto values = loop.at(points);
    std::size_t before = 0;
    while (before < kInner && (function(values[before]) < 0.0) == rises) ++before;
    from_hz += width * static_cast<double>(before);
    to_hz = from_hz + width;
  }
  return 0.5 * (from_hz + to_hz);
}

double phase_margin_deg(const std::complex<double>& loop) { return std::arg(-loop) * 180.0 / kPi; }

class Figures {
 public:
  Figures(const Machine& machine, const LinearController& controller, double share)
      : loop_(machine.response(), controller, machine.known_to_hz()),
        closed_(closed_loop(machine.states(), controller.states())),
        lines_hz_(first_lines_hz(machine.model(), controller, share, machine.known_to_hz())),
        values_(loop_.at(lines_hz_)) {}

  LoopFigures run() {
    LoopFigures f;
    const Eigen::VectorXcd poles = linalg::eigenvalues(closed_.a);
    f.spectral_radius = poles.cwiseAbs().maxCoeff();
    f.stable = f.spectral_radius < kStableRadius;
    for (const Transfer transfer : kTransfers) f.peaks.push_back(loop_.largest(transfer, lines_hz_));
    find_crossings(f);
    find_gain_margin(f);
    find_bandwidth(f);
    find_modes(poles, f);
    if (f.stable) {
      // Torque after an impulse of measured noise.
      f.noise_gain = std::sqrt(closed_.torque_by_reference * closed_.torque_by_reference +
                               impulse_energy(closed_.a, closed_.reference, closed_.torque));
      f.load_step = load_step_of(closed_, f.spectral_radius);
    }
    return f;
  }

 private:
  void find_crossings(LoopFigures& f) const {
    const Function above = [](const auto& v) { return std::log(std::abs(v.loop)); };
    for (std::size_t i = 1; i < values_.size(); ++i) {
      const bool before = above(values_[i - 1]) >= 0.0, after = above(values_[i]) >= 0.0;
      if (before == after) continue;
      const double at = root_between(loop_, above, lines_hz_[i - 1], lines_hz_[i]);
      const double margin = phase_margin_deg(loop_.at(std::array{at}).front().loop);
      f.crossings.push_back({at, margin, before});
      if (!f.worst_phase_margin_deg || std::abs(margin) < std::abs(*f.worst_phase_margin_deg))
        f.worst_phase_margin_deg = margin;
      const double delay = (margin >= 0.0 ? margin : margin + 360.0) / 360.0 / at;
      f.delay_margin_s = std::min(f.delay_margin_s.value_or(delay), delay);
    }
  }

  void find_gain_margin(LoopFigures& f) const {
    const Function beside = [](const auto& v) { return v.loop.imag(); };
    for (std::size_t i = 1; i < values_.size(); ++i) {
      const auto a = values_[i - 1].loop, b = values_[i].loop;
      if ((a.imag() >= 0.0) == (b.imag() >= 0.0) || !(a.real() < 0.0 && b.real() < 0.0)) continue;
      const double at = root_between(loop_, beside, lines_hz_[i - 1], lines_hz_[i]);
      const double size = std::abs(loop_.at(std::array{at}).front().loop);
      if (!(size < 1.0)) continue;
      const double margin = -20.0 * std::log10(size);
      f.gain_margin_db = std::min(f.gain_margin_db.value_or(margin), margin);
    }
  }

  void find_bandwidth(LoopFigures& f) const {
    const Function above = [](const auto& v) {
      return std::log(v.size_of(Transfer::load_transfer)) + 0.5 * std::log(2.0);
    };
    for (std::size_t i = 1; i < values_.size(); ++i) {
      if (!(above(values_[i - 1]) >= 0.0) || above(values_[i]) >= 0.0) continue;
      f.load_bandwidth_hz = root_between(loop_, above, lines_hz_[i - 1], lines_hz_[i]);
      return;
    }
  }

  void find_modes(const Eigen::VectorXcd& poles, LoopFigures& f) const {
    constexpr double kGone = 1e-6;  // after a sample: a delay's
    for (const auto& pole : poles) {
      if (!(pole.imag() > 0.0) || std::abs(pole) < kGone) continue;
      const auto s = std::log(pole) / closed_.sample_time_s;
      f.modes.push_back({std::abs(s) / kTwoPi, -s.real() / std::abs(s)});
    }
    std::sort(f.modes.begin(), f.modes.end(),
              [](const auto& a, const auto& b) { return a.frequency_hz < b.frequency_hz; });
  }

  LoopFunctions loop_;
  ClosedLoop closed_;
  std::vector<double> lines_hz_;
  std::vector<LoopFunctions::Values> values_;
};

}  // namespace

const Peak& LoopFigures::peak(Transfer transfer) const {
  return *std::find_if(peaks.begin(), peaks.end(), [&](const Peak& p) { return p.transfer == transfer; });
}

LoadStep load_step_of(const ClosedLoop& loop, double spectral_radius) {
  constexpr double kSettled = 1e-7;
  const auto while_quiet = static_cast<std::size_t>(std::ceil(0.1 / loop.sample_time_s)) + 100;
  const auto course = course_of(loop.a, -loop.load_torque, loop.load, spectral_radius, kSettled, while_quiet);
  LoadStep step;
  step.iae = loop.sample_time_s * course.absolute;
  step.ie = -loop.sample_time_s * course.sum;
  step.peak = -course.lowest;
  step.rebound = step.peak > 0.0 ? course.highest / step.peak : 0.0;
  return step;
}

LoopFigures figures_of(const Machine& machine, const LinearController& controller, double share) {
  return Figures(machine, controller, share).run();
}

}  // namespace resonid::design
