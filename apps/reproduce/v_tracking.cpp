// SPDX-License-Identifier: MIT
#include "reproduce/v_tracking.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <memory>
#include <resonid/base/constants.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/models/detail/response_fit.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/models/recursive_response_fit.hpp>

#include "reproduce/runs.hpp"

namespace resonid::reproduction::v {
namespace {

using Dft = online::SlidingDft<double, 21, 400>;
using Tracker = online::ResponseTracker<Dft>;
using Fit = online::ResponseFit<double, 3, 21>;
using LineFit = online::RecursiveResponseFit<double, 3, 21>;

constexpr std::size_t kLongestWindow = 400;  // so that all methods are judged over the same part of the run

plant::ExperimentConfig experiment(const Method& method, double noise_rms, std::uint64_t seed) {
  auto config = io::shipped_experiment("v_tooth_multisine");
  config.measurement.noise_rms = noise_rms;
  config.run.seed = seed;
  config.excitation.lines_hz.assign(grid_hz(20.0, 120.0, method.step_hz));
  return config;
}

/// On the heap: it holds three windows of every line.
std::unique_ptr<Tracker> tracker_of(const Method& method, const plant::Simulation& simulation,
                                    const std::vector<double>& lines) {
  const auto dft =
      Dft::create({simulation.record.sample_rate_hz, method.window_samples, lines, method.window});
  online::ResponseTrackerConfig known;
  known.known_delay_s = simulation.truth.delay_s;
  known.controller_numerator = simulation.truth.controller->numerator;
  known.controller_denominator = simulation.truth.controller->denominator;
  return std::make_unique<Tracker>(*Tracker::create(*dft, known));
}

/// Calls `each(sample, tracker)` once the first window is full.
void track(const Method& method, const plant::Simulation& simulation, const std::vector<double>& lines,
           std::size_t to, const std::function<void(std::size_t, const Tracker&)>& each) {
  const auto tracker = tracker_of(method, simulation, lines);
  const auto& record = simulation.record;
  for (std::size_t k = 0; k < to; ++k) {
    tracker->step(record.excitation.samples[k], record.input.samples[k], record.output.samples[k]);
    if (tracker->ready()) each(k, *tracker);
  }
}

/// Total inertia from the integrator's residue, the rest from poles and zeros.
Drive drive_of(const online::DiscreteModel<double, 3>& m, double rate_hz, double radius_m) {
  const online::SampledModes<3> modes(m, rate_hz);
  const auto resonances = modes.resonances(), antiresonances = modes.antiresonances();
  Drive d;
  d.resonance_hz = d.stiffness = d.damping = d.inertia = std::nan("");
  if (resonances.empty()) return d;
  d.resonance_hz = resonances[0].frequency_hz;
  if (antiresonances.empty()) return d;
  const double total = (3.0 + 2.0 * m.a[0] + m.a[1]) / (rate_hz * (m.b[0] + m.b[1] + m.b[2]));
  const double high = kTwoPi * d.resonance_hz, low = kTwoPi * antiresonances[0].frequency_hz;
  d.inertia = total * (low / high) * (low / high);
  const double cart_kg = (total - d.inertia) / (radius_m * radius_m);
  d.stiffness = low * low * cart_kg;
  d.damping = 2.0 * resonances[0].damping_ratio * high / (1.0 / cart_kg + radius_m * radius_m / d.inertia);
  return d;
}

double at(const std::vector<double>& time_s, const std::vector<double>& value, double t) {
  const auto above = std::upper_bound(time_s.begin(), time_s.end(), t) - time_s.begin();
  const auto i = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(above, 1, static_cast<std::ptrdiff_t>(time_s.size()) - 1));
  const double part = (t - time_s[i - 1]) / (time_s[i] - time_s[i - 1]);
  return value[i - 1] + part * (value[i] - value[i - 1]);
}

}  // namespace

Method published() { return {.name = "5 Hz, one period, rectangular, Levy (published)"}; }
Method best() {
  return {.name = "10 Hz, two periods, Hann, Sanathanan-Koerner",
          .step_hz = 10.0,
          .window = online::DftWindow::hann,
          .levy = false};
}

double Run::position_m(double sample) const {
  const auto& over = *simulation.truth.over_time;
  return at(over.time_s, over.position_m, sample / simulation.record.sample_rate_hz);
}

Drive Run::truth(double sample) const {
  const auto& over = *simulation.truth.over_time;
  const auto& c = experiment.drive;
  Drive d;
  d.resonance_hz = at(over.time_s, over.resonance_hz, sample / simulation.record.sample_rate_hz);
  d.inertia = c.driven_inertia;
  const double omega = kTwoPi * d.resonance_hz;
  d.stiffness = omega * omega / (1.0 / c.cart_mass_kg + c.radius_m * c.radius_m / c.driven_inertia);
  d.damping = d.stiffness / (omega * c.quality);
  return d;
}

Run run(const Method& method, double noise_rms, std::uint64_t seed, std::size_t every) {
  Run r;
  r.experiment = experiment(method, noise_rms, seed);
  r.simulation = simulated(r.experiment);
  r.lines_hz = grid_hz(20.0, 120.0, method.step_hz);
  const double rate = r.simulation.record.sample_rate_hz;
  const auto& reference = r.simulation.record.reference.samples;
  const double greatest = *std::max_element(reference.begin(), reference.end());
  const auto steady = [&](double x) { return x > 0.999999 * greatest; };
  r.from =
      static_cast<std::size_t>(std::find_if(reference.begin(), reference.end(), steady) - reference.begin());
  r.to =
      static_cast<std::size_t>(reference.rend() - std::find_if(reference.rbegin(), reference.rend(), steady));
  const std::size_t iterations = method.levy ? 0 : 2;
  auto fit = *Fit::create({.sample_rate_hz = rate,
                           .frequency_hz = r.lines_hz,
                           .integrator = !method.levy,
                           .iterations = iterations});
  auto line_fit = *LineFit::create({.sample_rate_hz = rate, .frequency_hz = r.lines_hz});
  std::vector<std::complex<double>> lines(r.lines_hz.size());
  track(method, r.simulation, r.lines_hz, r.to, [&](std::size_t k, const Tracker& tracker) {
    if (method.line_by_line) line_fit.step(tracker.response(line_fit.next_line(), method.approach));
    if (k + 1 < r.from + kLongestWindow || k % every != 0) return;
    if (!method.line_by_line) {
      for (std::size_t l = 0; l < lines.size(); ++l) lines[l] = tracker.response(l, method.approach);
      fit.step(lines);
    }
    Estimate e;
    e.sample = k;
    e.model = method.line_by_line ? line_fit.model() : fit.model();
    e.centre = static_cast<double>(k) - tracker.lag_samples(0);
    e.described = e.centre - (method.line_by_line ? line_fit.lag_samples() : fit.lag_samples());
    e.drive = drive_of(e.model, rate, r.experiment.drive.radius_m);
    r.estimates.push_back(e);
  });
  return r;
}

AtPosition response_at(const Method& method, double position_m, std::uint64_t seed) {
  const auto config = experiment(method, 0.02, seed);
  const auto simulation = simulated(config);
  const auto lines = grid_hz(20.0, 120.0, method.step_hz);
  auto rest = config;
  rest.motion = {};
  rest.motion.kind = plant::MotionKind::standstill;
  rest.motion.from = position_m;
  rest.run.duration_s = 0.1;
  const auto truth = simulated(rest, lines).truth.response;
  const auto& over = *simulation.truth.over_time;
  const double rate = simulation.record.sample_rate_hz;
  AtPosition result;
  track(method, simulation, lines, simulation.record.samples(), [&](std::size_t k, const Tracker& tracker) {
    const double centre_s = (static_cast<double>(k) - tracker.lag_samples(0)) / rate;
    if (!result.frequency_hz.empty() || at(over.time_s, over.position_m, centre_s) < position_m) return;
    const auto decibel = [](std::complex<double> g) { return 20.0 * std::log10(std::abs(g)); };
    for (std::size_t l = 0; l < lines.size(); ++l) {
      result.frequency_hz.push_back(lines[l]);
      result.estimated_db.push_back(decibel(tracker.response(l, method.approach)));
      result.true_db.push_back(decibel(truth.value[l]));
    }
  });
  return result;
}

}  // namespace resonid::reproduction::v
