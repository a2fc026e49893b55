// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/online/excitation/detail/splitmix64.hpp>
#include <resonid/online/excitation/excitation.hpp>
#include <resonid/online/excitation/metrics.hpp>

#include "linalg/decompositions.hpp"
#include "planning/experiment_layout.hpp"
#include "planning/waveform.hpp"

namespace resonid::planning::detail {
namespace {

constexpr std::size_t kMostGridLines = online::kMaxLines;
constexpr double kWeakLine = 1e-5;  // of the strongest line's power: left out
constexpr std::size_t kFewestPeriods = 2;

/// Peak over rms of what the limits hold for.
struct Crests {
  double excitation = 1.45, torque = 1.45, velocity = 1.45, position = 1.45;
};

/// A multisine with a period of its own.
class Layout {
 public:
  Layout(const Task& task, std::size_t period_samples) : task_(task), period_(period_samples) {
    const double step = task.sample_rate_hz / static_cast<double>(period_);
    const auto first = static_cast<std::size_t>(std::max(1.0, std::ceil(task.low_hz / step - 1e-9)));
    const auto last = static_cast<std::size_t>(std::floor(task.high_hz / step + 1e-9));
    for (std::size_t l = first; l <= last; ++l) grid_hz_.push_back(static_cast<double>(l) * step);
  }

  [[nodiscard]] bool possible() const {
    return grid_hz_.size() >= 2 && grid_hz_.size() <= kMostGridLines &&
           task_.most_samples >= kFewestPeriods * period_;
  }

  /// Chooses lines and phases, and lays out a short run that tells about how long is needed.
  [[nodiscard]] Experiment design(Plan& plan) {
    Crests crests;
    DesignProblem problem;
    problem.criterion = task_.config.criterion;
    problem.use = uses(crests);
    for (std::size_t s = 0; s < task_.drives.size(); ++s)
      problem.models.push_back({line_sensitivities(task_.drives[s], grid_hz_), task_.targets[s]});
    const auto distribution = distribute_power(problem);
    plan.grid_hz = grid_hz_;
    plan.grid_power.assign(distribution.power.begin(), distribution.power.end());
    plan.design_gap = distribution.gap;
    choose_waveform(problem, distribution.power);
    settle();
    choose_start();
    return of(fewest());
  }

  /// The least whole number of periods that meets the targets, or as many as the time allows.
  [[nodiscard]] Experiment counted(Experiment x) const {
    const std::size_t most = task_.most_samples / period_;
    std::size_t periods = x.periods;
    while (x.ratio > 1.0 && periods < most) {
      const double guess = static_cast<double>(periods) * x.ratio * x.ratio;
      periods = static_cast<std::size_t>(
          std::clamp(std::floor(guess), static_cast<double>(periods + 1), static_cast<double>(most)));
      x = of(periods);
    }
    while (x.ratio <= 1.0 && periods > fewest()) {  // a guess may have gone too far
      Experiment shorter = of(periods - 1);
      if (shorter.ratio > 1.0) break;
      x = std::move(shorter);
      --periods;
    }
    return x;
  }

 private:
  [[nodiscard]] Eigen::MatrixXd uses(const Crests& crests) const {
    const auto loop = loop_response(task_.config.drive, grid_hz_);
    const auto& limits = task_.config.limits;
    const auto lines = static_cast<Eigen::Index>(grid_hz_.size());
    Eigen::MatrixXd use(5, lines);
    for (Eigen::Index k = 0; k < lines; ++k) {
      const auto i = static_cast<std::size_t>(k);
      use(0, k) = std::pow(crests.excitation / limits.excitation, 2);
      use(1, k) = std::norm(loop.torque[i]) * std::pow(crests.torque / limits.torque, 2);
      use(2, k) = std::norm(loop.torque[i]) * std::pow(1.0 / limits.torque_rms, 2);
      use(3, k) = std::norm(loop.velocity[i]) * std::pow(crests.velocity / limits.velocity, 2);
      use(4, k) = std::norm(loop.position[i]) * std::pow(2.0 * crests.position / limits.stroke, 2);
    }
    return use;
  }

  void choose_waveform(const DesignProblem& design, const Eigen::VectorXd& power) {
    const auto& limits = task_.config.limits;
    WaveformProblem w;
    w.design = &design;
    w.seed = task_.config.seed;
    // Cost grows with the square of the lines; many of them have few bad starts.
    w.random_starts = grid_hz_.size() <= 100 ? 3 : grid_hz_.size() <= 200 ? 1 : 0;
    for (const double f : grid_hz_)
      w.harmonic.push_back(
          static_cast<std::size_t>(std::llround(f / task_.sample_rate_hz * static_cast<double>(period_))));
    const auto add = [&](const std::vector<std::complex<double>>& gain, double limit, double rms) {
      if (!std::isfinite(limit)) return;
      w.signals.push_back({gain, limit});
      w.rms_limit.push_back(rms);
    };
    constexpr double kNone = std::numeric_limits<double>::infinity();
    add(std::vector<std::complex<double>>(grid_hz_.size(), 1.0), limits.excitation, kNone);
    for (const auto& drive : task_.drives) {  // what is flat for one of them need not be so for another
      const auto loop = loop_response(drive, grid_hz_);
      const auto first = static_cast<Eigen::Index>(w.signals.size());
      add(loop.torque, limits.torque, limits.torque_rms);
      add(loop.velocity, limits.velocity, kNone);
      const bool torque = std::isfinite(limits.torque);
      if (torque) add_start(w, drive, true, first);
      if (std::isfinite(limits.velocity)) add_start(w, drive, false, first + (torque ? 1 : 0));
      add(loop.position, 0.5 * limits.stroke, kNone);
    }
    const auto waveform = optimise_waveform(w, power);
    double strongest = 0.0;
    for (const auto& a : waveform.amplitude) strongest = std::max(strongest, std::norm(a));
    for (std::size_t k = 0; k < grid_hz_.size(); ++k) {
      if (std::norm(waveform.amplitude[k]) < kWeakLine * strongest) continue;
      x_.frequency_hz.push_back(grid_hz_[k]);
      x_.line_amplitude.push_back(std::abs(waveform.amplitude[k]));
      x_.phase_rad.push_back(std::arg(waveform.amplitude[k]));
    }
  }

  /// The transient of the first period from rest: what a drive needs while it settles, beyond what it needs
  /// ever after. Few states make it, so a projection on some random combinations of lines holds all of it.
  void add_start(WaveformProblem& w, const NominalDrive& drive, bool of_torque, Eigen::Index signal) const {
    constexpr Eigen::Index kStates = 16;
    const auto lines = static_cast<Eigen::Index>(grid_hz_.size());
    const auto& steady = w.signals[static_cast<std::size_t>(signal)];
    const auto instants = static_cast<Eigen::Index>(kInstantsPerLine * w.harmonic.back());
    Eigen::MatrixXd transient(instants, 2 * lines);
    std::vector<double> wave(period_);
    for (Eigen::Index column = 0; column < 2 * lines; ++column) {
      const auto k = static_cast<std::size_t>(column % lines);
      const std::complex<double> phasor =
          column < lines ? std::complex<double>(1.0) : std::complex<double>(0.0, 1.0);
      const double step = kTwoPi * static_cast<double>(w.harmonic[k]) / static_cast<double>(period_);
      for (std::size_t i = 0; i < period_; ++i)
        wave[i] = (phasor * std::polar(1.0, step * static_cast<double>(i))).real();
      const auto motion = simulate(drive, wave);
      for (Eigen::Index r = 0; r < instants; ++r) {
        const auto i = static_cast<std::size_t>(r) * period_ / static_cast<std::size_t>(instants);
        const double after =
            (phasor * steady.gain[k] * std::polar(1.0, step * static_cast<double>(i))).real();
        transient(r, column) = ((of_torque ? motion.torque : motion.velocity)[i] - after) / steady.limit;
      }
    }
    const auto states = std::min({kStates, 2 * lines, instants});
    online::SplitMix64 random(task_.config.seed);
    Eigen::MatrixXd some(2 * lines, states);
    for (double& v : some.reshaped()) v = 2.0 * random.uniform() - 1.0;
    const Eigen::MatrixXd shape = linalg::Qr(transient * some).thin_q();
    w.starts.push_back({signal, shape, shape.transpose() * transient});
  }

  [[nodiscard]] std::vector<double> samples(std::size_t count) const {
    std::vector<double> out(count);
    online::Multisine<online::kMaxLines>::create(
        {task_.sample_rate_hz, x_.frequency_hz, x_.line_amplitude, online::Phases::given, x_.phase_rad})
        ->fill(out);
    return out;
  }

  /// Counts the periods until the drive repeats itself within 1 %.
  void settle() {
    constexpr std::size_t kMostSettling = 40;
    for (x_.settle_periods = 1; x_.settle_periods < kMostSettling; ++x_.settle_periods) {
      const auto motion = simulate(task_.config.drive, samples((x_.settle_periods + 1) * period_));
      const auto* last = motion.velocity.data() + x_.settle_periods * period_;
      double largest = 0.0, change = 0.0;
      for (std::size_t k = 0; k < period_; ++k) {
        largest = std::max(largest, std::abs(last[k]));
        change = std::max(change, std::abs(last[k] - *(last + k - period_)));
      }
      if (change <= 0.01 * largest) break;
    }
  }

  /// Shifts in time at which the signal may start. A free drive without a controller keeps the velocity with
  /// which its rigid motion would have passed there: where the stroke is limited, only those where that is
  /// none.
  [[nodiscard]] std::vector<double> starts() const {
    constexpr int kStarts = 48, kFiner = 8;
    const double period_s = static_cast<double>(period_) / task_.sample_rate_hz;
    const bool drifts = !task_.config.drive.controller && std::isfinite(task_.config.limits.stroke);
    std::vector<double> list;
    if (!drifts) {
      for (int i = 0; i < kStarts; ++i) list.push_back(period_s * i / kStarts);
      return list;
    }
    const auto velocity = [&](double time_s) {
      double sum = 0.0;
      for (std::size_t k = 0; k < x_.phase_rad.size(); ++k) {
        const double omega = kTwoPi * x_.frequency_hz[k];
        const auto line = std::polar(x_.line_amplitude[k], x_.phase_rad[k] + omega * time_s);
        sum += (line / (std::polar(1.0, omega / task_.sample_rate_hz) - 1.0)).real();
      }
      return sum;
    };
    double before = 0.0, v_before = velocity(0.0);
    for (int i = 1; i <= kFiner * kStarts; ++i) {
      const double after = period_s * i / (kFiner * kStarts), v_after = velocity(after);
      if (v_before * v_after <= 0.0) {
        double low = before, high = after, v_low = v_before;
        for (int halving = 0; halving < 60; ++halving) {
          const double middle = 0.5 * (low + high), v = velocity(middle);
          (v * v_low > 0.0 ? low : high) = middle;
          if (v * v_low > 0.0) v_low = v;
        }
        list.push_back(low);
      }
      before = after;
      v_before = v_after;
    }
    return list;
  }

  /// Turns the signal in time so that its start asks least of the drive.
  void choose_start() {
    const auto phases = x_.phase_rad;
    const auto list = starts();
    double least = HUGE_VAL, best_s = 0.0;
    const auto turn = [&](double time_s) {
      for (std::size_t k = 0; k < phases.size(); ++k) {
        const double angle = phases[k] + kTwoPi * x_.frequency_hz[k] * time_s;
        x_.phase_rad[k] = angle - kTwoPi * std::floor(angle / kTwoPi);
      }
    };
    for (const double time_s : list) {
      turn(time_s);
      const double use = most_used(task_.config.limits, peaks_of(task_, samples(2 * period_))).first;
      if (use < least - 1e-9) {
        least = use;
        best_s = time_s;
      }
    }
    turn(best_s);
  }

  [[nodiscard]] Experiment of(std::size_t periods) const {
    Experiment x = x_;
    x.type = ExcitationType::multisine;
    x.periods = periods;
    x.period_samples = period_;
    x.excitation = samples(periods * period_);
    scale_to_limits(task_, x);
    evaluate(task_, x);
    return x;
  }

  [[nodiscard]] std::size_t fewest() const {
    return std::min(task_.most_samples / period_, x_.settle_periods + kFewestPeriods);
  }

  const Task& task_;
  std::size_t period_;
  std::vector<double> grid_hz_;
  Experiment x_;
};

/// Periods whose line distance resolves the resonances; of a rigid machine, that reach its lowest line.
std::vector<std::size_t> periods_to_try(const Task& task) {
  const double rate = task.sample_rate_hz;
  if (task.config.period_s) return {static_cast<std::size_t>(std::llround(*task.config.period_s * rate))};
  double step = task.low_hz;
  const auto modes = modes_of(task.config.drive.model);
  if (!modes.empty()) {
    step = HUGE_VAL;
    for (const auto& mode : modes) step = std::min(step, mode.damping_ratio.value * mode.frequency_hz.value);
    step = std::clamp(step, task.high_hz / 300.0, task.high_hz / 8.0);
  }
  std::vector<std::size_t> periods;
  const auto most = static_cast<double>(task.most_samples);
  for (const double factor : {0.5, 0.75, 1.0, 1.5}) {
    const double period = factor * rate / step;
    // Where the time is short, periods that fill it.
    const double count = std::max(std::floor(most / period), static_cast<double>(kFewestPeriods + 1));
    constexpr double kMany = 20.0;
    const double samples = count < kMany ? std::floor(most / count) : std::round(period);
    if (samples >= 16.0) periods.push_back(static_cast<std::size_t>(samples));
  }
  return periods;
}

}  // namespace

expected<Experiment, Error> plan_multisine(const Task& task, Plan& plan) {
  struct Candidate {
    Layout layout;
    Experiment shortest;
    Plan design;
    double needed_s;
  };
  std::vector<Candidate> candidates;
  double least_s = HUGE_VAL;
  for (const std::size_t period : periods_to_try(task)) {
    Layout layout(task, period);
    if (!layout.possible()) continue;
    Plan design;
    Experiment x = layout.design(design);
    const double needed_s = std::max(x.duration_s, x.needed_s.value_or(HUGE_VAL));
    least_s = std::min(least_s, needed_s);
    candidates.push_back({std::move(layout), std::move(x), std::move(design), needed_s});
  }
  // Only those are laid out in full length that may be the best; one, where the targets are out of sight.
  const double most_s = static_cast<double>(task.most_samples) / task.sample_rate_hz;
  const double close = least_s > 1.5 * most_s ? 1.0 : 1.4;
  std::optional<Experiment> best;
  for (auto& candidate : candidates) {
    if (candidate.needed_s > close * least_s) continue;
    Experiment x = candidate.layout.counted(std::move(candidate.shortest));
    const auto rank = [](const Experiment& e) {
      return std::pair(e.ratio > 1.0, e.ratio > 1.0 ? e.ratio : e.duration_s);
    };
    if (!best || rank(x) < rank(*best)) {
      best = std::move(x);
      plan.grid_hz = candidate.design.grid_hz;
      plan.grid_power = candidate.design.grid_power;
      plan.design_gap = candidate.design.design_gap;
    }
  }
  if (best) return std::move(*best);
  if (task.config.period_s)
    return refuse("period_s",
                  "must leave 2 ... 512 lines in the band and fit twice into the time of the experiment",
                  *task.config.period_s);
  return refuse("max_time_s", "must hold two periods of lines as close as the band and the damping ask for",
                most_s);
}

}  // namespace resonid::planning::detail
