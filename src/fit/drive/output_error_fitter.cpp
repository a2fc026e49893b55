// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/drive/bending.hpp>
#include <fit/drive/constancy.hpp>
#include <fit/drive/friction_fit.hpp>
#include <fit/drive/friction_scores.hpp>
#include <fit/drive/output_error_cost.hpp>
#include <fit/drive/output_error_fitter.hpp>
#include <fit/drive/record_consistency.hpp>
#include <fit/drive/score.hpp>
#include <fit/least_squares.hpp>
#include <limits>
#include <memory>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>

#include "data/pole_at_one.hpp"
#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {
namespace {

constexpr int kMaximumIterations = 60;

/// A noise model of every n-th sample, for all of them.
NoiseModel spread(const NoiseModel& noise, std::size_t n) {
  NoiseModel wide{{}, noise.innovation_variance};
  wide.polynomial.assign(n * noise.order() + 1, 0.0);
  for (std::size_t i = 0; i <= noise.order(); ++i) wide.polynomial[n * i] = noise.polynomial[i];
  return wide;
}

/// A record with its noise, as it is found.
struct Part : RecordPart {
  NoiseModel noise;
  double weight = 1.0;
  std::size_t samples = 0;
  double variance = 0.0;
};

class OutputErrorFitter {
 public:
  OutputErrorFitter(std::vector<RecordPart> parts, const OutputErrorConfig& config)
      : config_(config),
        setup_(setup_of(*parts.front().record, config)),
        layout_(parts.size(), setup_.controller_order()) {
    const data::Record& record = *parts.front().record;
    for (auto& p : parts) parts_.push_back({std::move(p), {}, 1.0, 0, 0.0});
    auto& model = fit_.model;
    model = config.initial;
    model.sample_time_s = record.sample_time_s();
    model.known_delay_s = config.known_delay_s;
    model.estimated =
        estimated_parameters(config.initial.structure, config.viscous_friction, config.delay, config.further);
    if (!config.delay && !config.fixed_model) model.delay_s = 0.0;
    if (!config.viscous_friction && !config.fixed_model) model.parameters.viscous_friction = 0.0;
    x_.assign(static_cast<std::size_t>(layout_.size()), 0.0);
    const auto physical = setup_.coordinates.from(model);
    std::copy(physical.begin(), physical.end(), x_.begin());
    start_ = x_;
    store_friction(config.coulomb_start.value_or(0.0), config.further_friction, x_);
    start_states();
    activate();
  }

  JointOutputErrorFit run() {
    if (config_.fixed_model) {
      solve(false, linear_part());
      physical_ = result_;
      if (dry()) follow_friction(linear_part());
    } else if (dry() && config_.further_friction.any()) {
      begin_near();
    } else if (!config_.noise_model) {
      solve(false, active_);
      if (dry()) follow_friction(active_);
    } else {
      solve(false, linear_part());
      const auto start = x_;
      const double at_start = raw_power();
      weigh();
      if (dry() && config_.coulomb_start) {
        x_[kCommonCoulomb] = *config_.coulomb_start;
        set_friction(x_);
        follow_friction(linear_part());
      } else if (dry()) {
        follow_friction(active_);
      }
      solve_whitened();
      // A start whose own error outweighs the noise makes a noise model that hides the resonance, and the fit
      // then simulates worse than the start did. Plain output error is led by what is large.
      constexpr double kMisled = 1.2;
      if (raw_power() > kMisled * at_start) {
        x_ = start;
        solve(false, active_);
        weigh();
        solve_whitened();
      }
    }
    covariance_ = noise_scale() * detail::covariance(physical_, layout_.size());
    if (delay_presses()) physical_.converged = false;
    if (dry() && !config_.fixed_model) include_friction();
    if (setup_.controller && !config_.fixed_model) include_controller();
    finish();
    return std::move(fit_);
  }

 private:
  static SimulationSetup setup_of(const data::Record& record, const OutputErrorConfig& config) {
    const auto& start = config.initial;
    const double slowest = start.structure == Structure::rigid
                               ? kTwoPi / record.duration_s()
                               : kTwoPi * start.modes().front().frequency_hz.value;
    SimulationSetup setup{start.structure,
                          record.output_quantity,
                          {start.parameters.driven_inertia * slowest, record.sample_time_s(),
                           start.parameters.driven_inertia * slowest * slowest},
                          config.known_delay_s * record.sample_rate_hz,
                          std::nullopt};
    const auto asked = [&](Parameter p) {
      return std::find(config.further.begin(), config.further.end(), p) != config.further.end();
    };
    if (start.torque_lag_s > 0.0 || asked(kTorqueLag)) setup.lag = Lag::first_order;
    setup.velocity = start.velocity;
    if (config.at_load) setup.mass = (order_of(start.structure) - 1) / 2;
    setup.grounded = start.grounded() || asked(kMotorGroundStiffness) || asked(kLoadGroundStiffness);
    if (config.predictor == Predictor::closed_loop) setup.controller = config.controller;
    return setup;
  }

  [[nodiscard]] bool dry() const { return !parts_.front().raw.direction.empty(); }
  [[nodiscard]] int records() const { return static_cast<int>(parts_.size()); }
  [[nodiscard]] Part& part(int r) { return parts_[static_cast<std::size_t>(r)]; }
  [[nodiscard]] const Part& part(int r) const { return parts_[static_cast<std::size_t>(r)]; }
  [[nodiscard]] double& at(int record, int local) {
    return x_[static_cast<std::size_t>(layout_.of(record, local))];
  }

  void activate() {
    active_.assign(x_.size(), false);
    const auto& model = fit_.model;
    std::copy(model.estimated.begin(), model.estimated.end(), active_.begin());
    active_[kCommonCoulomb] = dry() && config_.coulomb_friction;
    const bool hidden = setup_.controller && data::has_pole_at_one(*setup_.controller);
    for (int r = 0; r < records(); ++r) {
      const auto set = [&](int local, bool on) {
        active_[static_cast<std::size_t>(layout_.of(r, local))] = on;
      };
      for (int i = 0; i < order_of(model.structure); ++i) set(kInitialState + i, config_.initial_state);
      const bool place = setup_.quantity == data::OutputQuantity::position;
      set(kPlace, config_.initial_state && (place || setup_.grounded));
      // Between springs the place at the start tells a velocity all that a constant torque does.
      set(kOffset, config_.offset && !hidden && (place || !setup_.grounded));
      set(kBehind, config_.initial_state && setup_.lag != Lag::none);
      for (int i = 0; i < setup_.controller_order(); ++i)
        set(kControllerState + i, config_.initial_state || hidden);
    }
  }

  void start_states() {
    for (int r = 0; r < records(); ++r) {
      const auto& y = part(r).raw.output;
      double velocity = 0.0;
      if (setup_.quantity == data::OutputQuantity::velocity) {
        velocity = config_.initial_state ? y.front() : 0.0;
      } else if (setup_.quantity == data::OutputQuantity::position && config_.initial_state) {
        velocity = (y.back() - y.front()) / part(r).record->duration_s();
        at(r, kPlace) = y.front();
      }
      const int masses = (order_of(setup_.structure) + 1) / 2;
      for (int i = 0; i < masses; ++i) at(r, kInitialState + i) = velocity;  // all turn alike
    }
  }

  [[nodiscard]] std::vector<bool> linear_part() const {
    auto mask = active_;
    std::fill(mask.begin(), mask.begin() + kParameterCount, false);
    return mask;
  }

  /// Noise models, parameters and the course of friction in turns, from the residual that x_ leaves.
  void solve_whitened() {
    auto noises = config_.noise_start.empty() ? noises_of_residual() : config_.noise_start;
    constexpr int kRounds = 5;
    bool wanders = false;
    double before = std::numeric_limits<double>::infinity();
    for (int round = 0; round < kRounds; ++round) {
      if (dry() && round > 0) set_friction(raw_x());
      for (int r = 0; r < records(); ++r) part(r).noise = noises[static_cast<std::size_t>(r)];
      solve(true, active_);
      const double result_cost = result_.cost;
      const bool lost = !result_.converged, lost_again = lost && wanders;
      wanders = lost;
      solve_linear_part_raw();
      weigh_whitened();
      if ((lost && lag_is_none()) || (lost_again && dry())) break;
      if (is_behind(std::exchange(before, result_cost), result_cost)) break;
      noises = noises_of_residual();
      bool settled = records() == 1 || round > 1;
      for (int r = 0; r < records(); ++r)
        settled = settled && alike(noises[static_cast<std::size_t>(r)], part(r).noise);
      if (settled && (!dry() || round > 1)) break;
    }
  }

  /// Whether the fit whose noise was the start is clearly better, and further rounds would not change that.
  [[nodiscard]] bool is_behind(double before, double now) const {
    double of_start = 0.0;
    for (int r = 0; r < records() && !config_.noise_start.empty(); ++r)
      of_start += 0.5 * static_cast<double>(part(r).samples) * std::pow(part(r).weight, 2) *
                  config_.noise_start[static_cast<std::size_t>(r)].innovation_variance;
    constexpr double kClearly = 1.05, kHardly = 0.1;
    const double behind = now - kClearly * of_start;
    return of_start > 0.0 && behind > 0.0 && before - now < kHardly * behind;
  }

  /// Whether the search for a lag or filter ended where there is none.
  [[nodiscard]] bool lag_is_none() const {
    return (active_[kTorqueLag] && x_[kTorqueLag] <= 0.0) ||
           (active_[kOutputFilter] && x_[kOutputFilter] <= 0.0);
  }

  /// Whether the delay ends at a bound that the record clearly wants to cross: then it is another machine's,
  /// or the known delay is wrong. By the gain of a step across, a chi-square of one degree of freedom.
  [[nodiscard]] bool delay_presses() const {
    const auto bound = delay_bounds();
    const double at = x_[kDelay];
    const auto found = std::find(physical_.active.begin(), physical_.active.end(), kDelay);
    if (found == physical_.active.end() || (at > bound.lower && at < bound.upper)) return false;
    constexpr double kClearly = 25.0;
    const double slope = physical_.gradient(found - physical_.active.begin()) / noise_scale();
    return slope * slope * covariance_(kDelay, kDelay) > kClearly;
  }

  static bool alike(const NoiseModel& a, const NoiseModel& b) {
    if (a.order() != b.order()) return false;
    double sum = 0.0, size = 0.0;
    for (std::size_t i = 0; i < a.polynomial.size(); ++i) {
      sum += std::pow(a.polynomial[i] - b.polynomial[i], 2);
      size += std::pow(a.polynomial[i], 2);
    }
    return std::sqrt(sum / size) < 0.02;
  }

  /// White where nothing but rounding is left, whose colour is of no use, and where a residual foretells
  /// itself as no noise does: that is the model's own error, to be fitted and not to be filtered out.
  [[nodiscard]] std::vector<NoiseModel> noises_of_residual() const {
    constexpr double kRounding = 1e-9;
    constexpr double kForetold = 1e-10;
    std::vector<NoiseModel> noises;
    for (int r = 0; r < records(); ++r) {
      const auto residual = raw_residual(r);
      const double left = mean_square(residual);
      noises.emplace_back();
      if (left < kRounding * kRounding * mean_square(part(r).raw.output)) continue;
      auto noise = fit_noise_model(residual, config_.max_noise_order);
      if (noise.innovation_variance >= kForetold * left) noises.back() = spread(noise, part(r).hold.samples);
    }
    return noises;
  }

  /// Records count by their noise; of a single one it does not matter.
  void weigh() {
    if (records() == 1) return;
    for (int r = 0; r < records(); ++r) set_weight(part(r), mean_square(raw_residual(r)));
  }
  void weigh_whitened() {
    if (records() == 1) return;
    for (int r = 0; r < records(); ++r) set_weight(part(r), part(r).variance);
  }
  static void set_weight(Part& p, double variance) {
    const double floor = 1e-20 * mean_square(p.raw.output);  // a record without noise
    p.weight = 1.0 / std::sqrt(std::max(variance, floor + 1e-300));
  }

  [[nodiscard]] std::vector<DriveSignals> signals_of(bool with_noise) const {
    std::vector<DriveSignals> signals;
    for (const auto& p : parts_) signals.push_back(with_noise ? whitened(p.raw, p.noise) : p.raw);
    return signals;
  }

  /// Keeps references to the signals.
  [[nodiscard]] std::unique_ptr<OutputErrorCost> cost_of(const SimulationSetup& setup,
                                                         const std::vector<DriveSignals>& signals,
                                                         const std::vector<bool>& mask) const {
    std::vector<OutputErrorCost::Part> pieces;
    for (int r = 0; r < records(); ++r) {
      OutputErrorCost::Part piece{{setup, signals[static_cast<std::size_t>(r)]}, part(r).weight, {}};
      for (int i = 0; i < layout_.local_size(); ++i)
        if (mask[static_cast<std::size_t>(layout_.of(r, i))]) piece.active.push_back(i);
      pieces.push_back(std::move(piece));
    }
    return std::make_unique<OutputErrorCost>(std::move(pieces), layout_, SearchRange(start_), checked());
  }

  /// Where the controller is uncertain, so is the model that is simulated in its loop: by how far the minimum
  /// moves with the coefficients, to first order.
  void include_controller() {
    const auto& doubt = config_.controller_covariance;
    if (doubt.size() == 0 || !(noise_scale() > 0.0)) return;
    const auto signals = signals_of(with_noise_);
    const Eigen::MatrixXd normal = covariance_ / noise_scale();
    const auto gradient_with = [&](const Eigen::VectorXd& step) {
      data::TransferFunction c = *setup_.controller;
      const auto zeros = c.numerator.size();
      for (std::size_t i = 0; i < zeros; ++i) c.numerator[i] += step(static_cast<Eigen::Index>(i));
      for (std::size_t i = 1; i < c.denominator.size(); ++i)
        c.denominator[i] += step(static_cast<Eigen::Index>(zeros + i - 1));
      auto moved = setup_;
      moved.controller = std::move(c);
      const auto cost = cost_of(moved, signals, active_);
      const auto columns = static_cast<Eigen::Index>(x_.size());
      Eigen::VectorXd residuals(cost->num_residuals());
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> slopes(cost->num_residuals(),
                                                                                    columns);
      const double* blocks[] = {x_.data()};
      double* jacobians[] = {slopes.data()};
      if (!cost->Evaluate(blocks, residuals.data(), jacobians))
        residuals.setConstant(std::numeric_limits<double>::quiet_NaN());
      return Eigen::VectorXd(slopes.transpose() * residuals);
    };
    // Along the axes of the ellipsoid: coefficients of an integrating controller nearly cancel.
    const auto axes = linalg::symmetric_eigenpairs(doubt);
    for (Eigen::Index i = 0; i < doubt.rows(); ++i) {
      const double std = std::sqrt(std::max(0.0, axes.values(i)));
      if (!(std > 0.0)) continue;
      constexpr double kSmall = 0.1;  // of the standard deviation
      const Eigen::VectorXd step = kSmall * std * axes.vectors.col(i);
      const Eigen::VectorXd move = normal * (gradient_with(-step) - gradient_with(step)) / (2.0 * kSmall);
      if (move.allFinite()) covariance_ += move * move.transpose();
    }
  }

  /// One solution with the noise models or without.
  void solve(bool with_noise, const std::vector<bool>& mask, int iterations = kMaximumIterations) {
    const auto signals = signals_of(with_noise);
    std::vector<Bound> bounds;
    if (mask[kDelay]) bounds.push_back(delay_bounds());
    if (mask[kTorqueLag]) bounds.push_back({kTorqueLag, 0.0, kMaximumLagSamples});
    if (mask[kOutputFilter]) bounds.push_back({kOutputFilter, 0.0, kMaximumFilterPole});
    // With a noise model the cost need not be exact to more digits than the likelihood tells apart.
    const Effort effort{iterations, config_.noise_model ? 1e-9 : 1e-14};
    const std::unique_ptr<bool[]> flags(new bool[mask.size()]);
    std::copy(mask.begin(), mask.end(), flags.get());
    const std::span<const bool> active(flags.get(), mask.size());
    const bool linear =
        std::none_of(mask.begin(), mask.begin() + kParameterCount, [](bool on) { return on; });
    result_ = linear ? minimise_linear(*cost_of(setup_, signals, mask), x_, active)
                     : detail::minimise(cost_of(setup_, signals, mask), x_, active, bounds, effort);
    with_noise_ = with_noise;
    if (!mask[kDrivenInertia]) return;
    physical_ = result_;
    for (int r = 0; r < records(); ++r) {
      const auto left =
          DriveSimulation(setup_, signals[static_cast<std::size_t>(r)]).residual(layout_.local(r, x_));
      part(r).samples = left.size();
      const auto own = static_cast<double>(physical_.active.size()) / records();
      const double n = static_cast<double>(left.size());
      part(r).variance = n * mean_square(left) / std::max(1.0, n - own);
    }
  }

  [[nodiscard]] bool whitened_any() const {
    return with_noise_ &&
           std::any_of(parts_.begin(), parts_.end(), [](const Part& p) { return p.noise.order() > 0; });
  }

  /// The whitened fit's initial state belongs to whitened signals; the raw residual needs its own.
  void solve_linear_part_raw() {
    if (!whitened_any()) return;
    const auto whitened_x = x_;
    start_states();
    auto mask = linear_part();
    mask[kCommonCoulomb] = false;  // common to all, and already known
    solve(false, mask);
    raw_x_ = x_;
    x_ = whitened_x;
    with_noise_ = true;
  }

  [[nodiscard]] std::vector<double> raw_residual(int r) const { return raw_residual(r, part(r).raw); }
  [[nodiscard]] std::vector<double> raw_residual(int r, const DriveSignals& raw) const {
    return DriveSimulation(setup_, raw).residual(layout_.local(r, whitened_any() ? raw_x_ : x_));
  }

  /// What the hold-out samples say of the fit to the others.
  [[nodiscard]] HoldoutFit judge_holdout(int r) const {
    DriveSignals rest = part(r).raw;
    for (std::size_t k = 0; k < rest.unused.size(); ++k)
      if (!part(r).hold.is_new(k)) rest.unused[k] = false;
    const auto& filled = part(r).record->sampling.filled;
    for (const std::size_t k : filled)
      if (k < rest.unused.size()) rest.unused[k] = false;
    double mean = 0.0, count = 0.0, total = 0.0;
    for (std::size_t k = 0; k < rest.output.size(); ++k)
      if (rest.unused[k]) mean += rest.output[k], count += 1.0;
    mean /= std::max(1.0, count);
    for (std::size_t k = 0; k < rest.output.size(); ++k)
      if (rest.unused[k]) total += std::pow(rest.output[k] - mean, 2);
    rest.unused.flip();  // old values of a held output count neither here nor there
    for (const std::size_t k : filled)
      if (k < rest.unused.size()) rest.unused[k] = true;
    const auto residual = raw_residual(r, rest);
    const double left = mean_square(residual) * static_cast<double>(residual.size());
    HoldoutFit judged{residual.size(), fit_percent_of(left, total), 0.0};
    const auto white = with_noise_ ? whitened(rest, part(r).noise) : rest;
    const auto innovations = DriveSimulation(setup_, white).residual(layout_.local(r, x_));
    judged.score =
        static_cast<double>(innovations.size()) * std::log(std::max(mean_square(innovations), 1e-300));
    return judged;
  }
  [[nodiscard]] double raw_power() const {
    double sum = 0.0;
    for (int r = 0; r < records(); ++r) sum += part(r).weight * part(r).weight * mean_square(raw_residual(r));
    return sum;
  }

  /// The course of dry friction under x, for the next solution. Says whether it is much the same as before.
  bool set_friction(const std::vector<double>& x) {
    double changed = 0.0, all = 0.0;
    for (int r = 0; r < records(); ++r) {
      auto& raw = part(r).raw;
      auto course = DriveSimulation(setup_, raw).friction(layout_.local(r, x));
      for (std::size_t k = 0; k < raw.direction.size(); ++k)
        changed += std::abs(course.direction[k] - raw.direction[k]);
      all += static_cast<double>(raw.direction.size());
      raw.direction = std::move(course.direction);
      raw.stuck = std::move(course.stuck);
      raw.direction_parts = std::move(course.direction_parts);
      raw.stuck_parts = std::move(course.stuck_parts);
      raw.on_load = std::move(course.on_load);
    }
    constexpr double kSame = 1e-5;
    return changed < kSame * all;
  }

  void follow_friction(const std::vector<bool>& mask) {
    // Before the course has settled, a few steps do. Where turns lead away, the best of them is taken.
    constexpr int kTurns = 12, kFew = 10, kWorse = 2;
    solve(false, mask, kFew);
    double least = std::numeric_limits<double>::infinity();
    auto best = x_;
    int worse = 0;
    for (int turn = 0; turn < kTurns && worse < kWorse; ++turn) {
      const bool same = set_friction(x_);
      solve(false, mask, same || turn + 1 == kTurns ? kMaximumIterations : kFew);
      worse = result_.converged || result_.cost < least ? 0 : worse + 1;
      if (result_.cost < least) {
        least = result_.cost;
        best = x_;
      }
      if (same) return;
    }
    if (worse == 0) return;
    x_ = best;
    set_friction(x_);
    solve(false, mask);
  }

  /// More of dry friction than its size begins near its end: turns would lead away, since at a given course
  /// they move the size alone. What they would say gives the steps of slopes.
  void begin_near() {
    auto states = linear_part();
    states[kCommonCoulomb] = false;
    solve(false, states);
    set_friction(x_);
    follow_friction(states);
    raw_x_ = x_;
    if (config_.noise_model) {
      const auto noises = noises_of_residual();
      for (int r = 0; r < records(); ++r) part(r).noise = noises[static_cast<std::size_t>(r)];
    }
    solve(config_.noise_model, active_);
    weigh_whitened();
    x_ = raw_x_;
    physical_.converged = false;
  }

  [[nodiscard]] double samples() const {
    std::size_t sum = 0;
    for (const auto& p : parts_) sum += p.samples;
    return static_cast<double>(sum);
  }
  [[nodiscard]] double noise_scale() const {
    return 2.0 * physical_.cost / std::max(1.0, samples() - static_cast<double>(physical_.active.size()));
  }

  [[nodiscard]] Bound delay_bounds() const {
    double largest = kMaximumDelaySamples;  // that leaves enough of every record
    for (const auto& p : parts_)
      largest = std::min(
          largest, kDelayedPart * static_cast<double>(p.record->samples()) - setup_.known_delay_samples);
    return {kDelay,
            setup_.controller ? std::max(kMinimumDelaySamples, -setup_.known_delay_samples)
                              : kMinimumDelaySamples,
            largest};
  }
  [[nodiscard]] int checked() const {
    return setup_.structure == Structure::three_mass ? kParameterCount : kMiddleInertia;
  }

  [[nodiscard]] NoiseModel noise_of(int r) const { return with_noise_ ? part(r).noise : NoiseModel{}; }

  [[nodiscard]] FrictionProblem friction_problem() const {
    const auto allowed = [this](const std::vector<double>& x) {
      return SearchRange(start_).contains(x.data(), checked());
    };
    FrictionProblem problem{setup_, {}, physical_.active, allowed, friction_bounds(config_.further_friction)};
    problem.bounds.push_back(delay_bounds());
    for (int r = 0; r < records(); ++r) {
      problem.records.push_back({part(r).raw, noise_of(r), part(r).weight, {}});
      for (int i = 0; i < layout_.local_size(); ++i)
        problem.records.back().coordinates.push_back(layout_.of(r, i));
    }
    return problem;
  }
  [[nodiscard]] const std::vector<double>& raw_x() const { return whitened_any() ? raw_x_ : x_; }

  /// The turns take the course of friction as given: they come near, but slowly, and their covariance leaves
  /// out that the course is in doubt as well; more of friction than its size they hold. Where steps that move
  /// the course find no end, since the model is too simple, the turns' result stays, with the larger
  /// deviations.
  void include_friction() {
    const auto further = coordinates_of(config_.further_friction);
    auto& active = physical_.active;
    active.insert(active.end(), further.begin(), further.end());
    std::sort(active.begin(), active.end());
    const auto count = static_cast<Eigen::Index>(active.size());
    constexpr double kDoubt = 0.1;  // of a start
    Eigen::VectorXd fixed(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const int at = active[static_cast<std::size_t>(i)];
      fixed(i) = std::sqrt(std::max(0.0, covariance_(at, at)));
      if (std::find(further.begin(), further.end(), at) != further.end())
        fixed(i) =
            kDoubt * (std::abs(x_[static_cast<std::size_t>(at)]) +
                      std::abs(x_[at == common_friction(kStribeckVelocity) ? static_cast<std::size_t>(at)
                                                                           : kCommonCoulomb]));
    }
    // The noise model is of what the simpler friction of the turns leaves.
    const int rounds = further.empty() || !config_.noise_model ? 1 : 4;
    for (int round = 0; round < rounds; ++round) {
      const auto problem = friction_problem();
      const auto fit = fit_with_friction(problem, raw_x(), fixed);
      if (!further.empty()) physical_.converged = fit && fit->converged;
      if (!fit) return;
      Eigen::VectorXd larger = Eigen::VectorXd::Ones(count);
      if ((!fit->converged || fit->rough) && further.empty())
        larger = fixed.cwiseQuotient(fit->covariance.diagonal().cwiseSqrt()).cwiseMax(1.0);
      for (Eigen::Index i = 0; i < count; ++i)
        for (Eigen::Index j = 0; j < count; ++j)
          covariance_(active[static_cast<std::size_t>(i)], active[static_cast<std::size_t>(j)]) =
              larger(i) * larger(j) * fit->covariance(i, j);
      if (!fit->converged && further.empty()) return;
      take(problem, *fit);
      fixed = fit->covariance.diagonal().cwiseSqrt();
      if (round + 1 == rounds || !renew_noise()) return;
    }
  }

  /// Noise models of what is left now. Says whether they are others.
  bool renew_noise() {
    const auto noises = noises_of_residual();
    bool same = true;
    for (int r = 0; r < records(); ++r)
      same = same && alike(noises[static_cast<std::size_t>(r)], part(r).noise);
    if (same) return false;
    raw_x_ = raw_x();
    for (int r = 0; r < records(); ++r) part(r).noise = noises[static_cast<std::size_t>(r)];
    with_noise_ = true;
    if (!whitened_any()) x_ = raw_x_;
    weigh_whitened();
    return true;
  }

  /// What was found with friction on the raw signals; the whitened ones have states of their own.
  void take(const FrictionProblem& problem, const FrictionFit& fit) {
    const auto& x = fit.x;
    physical_.cost = 0.5 * fit.cost;
    for (int r = 0; r < records(); ++r) {
      const auto left = problem.residual(problem.records[static_cast<std::size_t>(r)], x);
      const double n = static_cast<double>(left.size());
      const double own = static_cast<double>(physical_.active.size()) / records();
      part(r).samples = static_cast<std::size_t>(left.size());
      part(r).variance = left.squaredNorm() / std::max(1.0, n - own);
    }
    set_friction(x);
    if (!whitened_any()) {
      x_ = x;
      return;
    }
    auto states = linear_part();
    const auto share = [&](int at) {
      x_[static_cast<std::size_t>(at)] = x[static_cast<std::size_t>(at)];
      states[static_cast<std::size_t>(at)] = false;
    };
    for (int i = 0; i < kCommon; ++i) share(i);
    for (int r = 0; r < records(); ++r) share(layout_.of(r, kOffset));
    solve(true, states);
    raw_x_ = x;
  }

  void finish() {
    auto& fit = fit_;
    setup_.coordinates.store(x_.data(), fit.model);
    fit.converged = physical_.converged;
    const double n = samples();
    const double parameters = static_cast<double>(physical_.active.size());
    const Eigen::MatrixXd& covariance = covariance_;
    const auto scale = setup_.coordinates.jacobian(fit.model);
    for (int i = 0; i < kParameterCount; ++i)
      for (int j = 0; j < kParameterCount; ++j)
        fit.model.covariance(i, j) =
            covariance(i, j) * scale[static_cast<std::size_t>(i)] * scale[static_cast<std::size_t>(j)];
    if (config_.fixed_model) {
      fit.model.covariance = config_.initial.covariance;
      fit.model.estimated = config_.initial.estimated;
    }
    const auto estimate = [&](int i) {
      return data::Estimate{x_[static_cast<std::size_t>(i)], std::sqrt(std::max(0.0, covariance(i, i)))};
    };
    if (dry() && config_.coulomb_friction) fit.coulomb_friction = estimate(kCommonCoulomb);
    if (dry()) fit.further_friction = further_friction_of(config_.further_friction, x_, covariance);
    double likelihood = 0.0, noise_orders = 0.0;
    for (int r = 0; r < records(); ++r) {
      const auto& p = part(r);
      OutputErrorFit own;
      const int offset = layout_.of(r, kOffset);
      if (active_[static_cast<std::size_t>(offset)]) own.offset = estimate(offset);
      describe(r, own);
      const double count = static_cast<double>(p.samples),
                   order = static_cast<double>(own.noise.order()) / static_cast<double>(p.hold.samples);
      const double square = records() == 1 ? 2.0 * physical_.cost : p.variance * count;
      own.bic = count * std::log(std::max(square / count, 1e-300)) + (parameters + order) * std::log(n);
      likelihood += count * std::log(std::max(square / count, 1e-300));
      noise_orders += order;
      fit.records.push_back(std::move(own));
    }
    fit.bic = likelihood + (parameters + noise_orders) * std::log(n);
    if (records() > 1 && !config_.fixed_model) fit.against_others = consistency();
    if (config_.fixed_model && config_.disturbances)
      for (int r = 0; r < records(); ++r) test_bending(r, fit.records[static_cast<std::size_t>(r)]);
    if (dry() && config_.score_friction && !config_.fixed_model && config_.holdout.empty())
      fit.lacking_friction = score_friction(friction_problem(), raw_x(), covariance, config_.further_friction,
                                            config_.coulomb_friction);
    if (!config_.fixed_model && config_.holdout.empty())
      for (int r = 0; r < records(); ++r) {
        auto& own = fit.records[static_cast<std::size_t>(r)];
        own.constancy = constancy(r);
        own.lacking = lacking(r);
      }
  }

  /// Lagrange multiplier tests: what of the residual follows the slope by a parameter that is not estimated,
  /// beyond what the estimated ones could take up.
  [[nodiscard]] std::vector<Lacking> lacking(int r) const {
    std::vector<int> columns;
    for (int i = 0; i < kParameterCount; ++i)
      if (fit_.model.estimated[static_cast<std::size_t>(i)]) columns.push_back(i);
    std::vector<Lacking> found;
    const auto estimated = static_cast<Eigen::Index>(columns.size());
    for (const Parameter p : kFurtherTried)
      if (!fit_.model.estimated[static_cast<std::size_t>(p)] && may_have_parameter(setup_.structure, p)) {
        columns.push_back(p);
        found.push_back({p, 0.0});
      }
    const auto tried = static_cast<Eigen::Index>(found.size());
    for (int i = kInitialState; i < layout_.local_size(); ++i)
      if (active_[static_cast<std::size_t>(layout_.of(r, i))]) columns.push_back(i);
    if (tried == 0 || columns.size() > DriveSimulation::kMostColumns) return {};
    SimulationSetup wider = setup_;
    wider.lag = Lag::first_order;
    wider.grounded = true;
    const auto signals = with_noise_ ? whitened(part(r).raw, part(r).noise) : part(r).raw;
    const Eigen::MatrixXd factor = DriveSimulation(wider, signals).factor(layout_.local(r, x_), columns);
    if (!factor.allFinite()) return {};
    Eigen::MatrixXd ordered(factor.rows(), factor.cols());  // states beside the estimated ones
    const Eigen::Index states = factor.cols() - 1 - estimated - tried;
    ordered << factor.leftCols(estimated), factor.middleCols(estimated + tried, states),
        factor.middleCols(estimated, tried), factor.rightCols(1);
    score(ordered, estimated + states, part(r).variance, found);
    return found;
  }

  /// Of a given model; the record's own coordinates are those of its raw signals.
  void test_bending(int r, OutputErrorFit& fit) const {
    std::vector<int> estimated, own;
    for (int i = 0; i < kParameterCount; ++i)
      if (config_.initial.estimated[static_cast<std::size_t>(i)]) estimated.push_back(i);
    for (int i = kInitialState; i < layout_.local_size(); ++i)
      if (active_[static_cast<std::size_t>(layout_.of(r, i))]) own.push_back(i);
    fit.noise = noises_of_residual()[static_cast<std::size_t>(r)];
    auto test = bending_of(setup_, part(r).raw, layout_.local(r, x_), estimated, own, fit.noise);
    const auto scale = setup_.coordinates.jacobian(fit_.model);
    for (auto& b : test.found)
      for (int i = 0; i < kParameterCount; ++i) b.shift(i) *= scale[static_cast<std::size_t>(i)];
    for (auto& c : test.constancy) c.scatter *= std::abs(scale[static_cast<std::size_t>(c.parameter)]);
    fit.noise.innovation_variance = test.left;
    fit.bending = std::move(test.found);
    fit.constancy = std::move(test.constancy);
  }

  [[nodiscard]] std::vector<Constancy> constancy(int r) const {
    const std::size_t stretches = stretches_of(part(r).samples);
    if (stretches == 0) return {};
    std::vector<int> active, names;
    for (int i = 0; i < layout_.local_size(); ++i) {
      if (!active_[static_cast<std::size_t>(layout_.of(r, i))]) continue;
      active.push_back(i);
      if (i < kParameterCount) names.push_back(i);
    }
    const auto signals = with_noise_ ? whitened(part(r).raw, part(r).noise) : part(r).raw;
    const DriveSimulation simulation(setup_, signals);
    const auto local = layout_.local(r, x_);
    std::vector<StretchFactor> parts;
    for (auto& [factor, samples] : simulation.factors(local, active, stretches))
      parts.push_back({std::move(factor), samples});
    auto found = constancy_of(parts, names);
    if (part(r).samples <= kLongRecord)
      for (const auto& c : constancy_over_frequency(simulation.rows(local, active), names))
        found.push_back(c);
    const auto scale = setup_.coordinates.jacobian(fit_.model);
    for (auto& c : found) c.scatter *= std::abs(scale[static_cast<std::size_t>(c.parameter)]);
    return found;
  }

  [[nodiscard]] std::vector<Consistency> consistency() const {
    std::vector<RecordScore> said;
    for (int r = 0; r < records(); ++r) {
      std::vector<int> columns, own;
      for (int i = 0; i < layout_.local_size(); ++i)
        if (active_[static_cast<std::size_t>(layout_.of(r, i))])
          (layout_.of(r, i) < kCommon ? columns : own).push_back(i);
      const auto common = static_cast<Eigen::Index>(columns.size());
      columns.insert(columns.end(), own.begin(), own.end());
      const auto signals = with_noise_ ? whitened(part(r).raw, part(r).noise) : part(r).raw;
      const Eigen::MatrixXd factor =
          part(r).weight * DriveSimulation(setup_, signals).factor(layout_.local(r, x_), columns);
      const Eigen::MatrixXd nuisance = factor.middleCols(common, static_cast<Eigen::Index>(own.size()));
      Eigen::MatrixXd rest(factor.rows(), common + 1);
      rest << factor.leftCols(common), factor.rightCols(1);
      if (nuisance.cols() > 0) rest -= nuisance * (linalg::pseudo_inverse(nuisance).matrix * rest);
      const Eigen::MatrixXd slopes = rest.leftCols(common);
      said.push_back({slopes.transpose() * slopes, slopes.transpose() * rest.rightCols(1)});
    }
    return against_others(said);
  }

  void describe(int r, OutputErrorFit& own) const {
    const auto& p = part(r);
    own.model = fit_.model;
    own.converged = fit_.converged;
    own.coulomb_friction = fit_.coulomb_friction;
    own.further_friction = fit_.further_friction;
    own.samples = p.samples;
    if (dry()) own.friction_torque = friction_of(p.raw, x_[kCommonCoulomb]);
    if (dry()) own.load_friction_torque = load_friction_of(p.raw);
    own.one_direction = (config_.coulomb_friction || config_.further_friction.any()) && !dry();
    if (!config_.holdout.empty()) own.holdout = judge_holdout(r);
    DriveSignals all = p.raw;
    all.unused.clear();
    own.residual = raw_residual(r, all);
    own.first_sample = p.raw.output.size() - own.residual.size();
    for (std::size_t i = 1; i < own.residual.size(); ++i)  // that of the simulation held alike
      if (!p.hold.is_new(own.first_sample + i)) own.residual[i] = own.residual[i - 1];
    own.noise = with_noise_ ? p.noise : NoiseModel{};
    own.noise.innovation_variance = p.variance;
    const auto& y = p.raw.output;
    const double centre = mean(y);
    double total = 0.0;
    for (std::size_t k = own.first_sample; k < y.size(); ++k) total += (y[k] - centre) * (y[k] - centre);
    const double left = mean_square(own.residual) * static_cast<double>(own.residual.size());
    own.fit_percent = fit_percent_of(left, total);
  }

  const OutputErrorConfig& config_;
  SimulationSetup setup_;
  CoordinateLayout layout_;
  std::vector<Part> parts_;
  std::vector<double> x_, start_, raw_x_;
  std::vector<bool> active_;
  bool with_noise_ = false;
  LeastSquaresResult result_, physical_;
  Eigen::MatrixXd covariance_;
  JointOutputErrorFit fit_;
};

}  // namespace

JointOutputErrorFit fit_drive(std::vector<RecordPart> parts, const OutputErrorConfig& config) {
  return OutputErrorFitter(std::move(parts), config).run();
}

}  // namespace resonid::fit::detail
