// SPDX-License-Identifier: MIT
#include <ceres/jet.h>

#include <Eigen/QR>
#include <algorithm>
#include <fit/least_squares.hpp>
#include <fit/sampled_drive.hpp>
#include <numeric>
#include <resonid/fit/output_error.hpp>

namespace resonid::fit {
namespace {

constexpr int kMaximumIterations = 60;

// The fit's parameter vector: the physical ones, then those that enter linearly.
constexpr int kMostStates = detail::Sizes<3>::kStates;
enum : int { kInitialState = kParameterCount, kOffset = kInitialState + kMostStates, kCoulomb, kAll };

/// Signals as the fit sees them: whitened by the noise model, which commutes with the drive because both are
/// linear.
struct Signals {
  std::vector<double> input;
  std::vector<double> output;
  std::vector<double> direction;  // sign of the velocity; empty without dry friction
  double constant = 1.0;          // what a constant becomes
  std::vector<bool> unused;       // [sample] of the output: no residual is taken there; empty: none
};

/// Past the first `order` samples: whether any of the samples that the whitened one is made of is marked.
std::vector<bool> marked(const std::vector<bool>& samples, std::size_t order) {
  if (samples.size() <= order) return {};
  std::vector<bool> any(samples.size() - order, false);
  for (std::size_t k = 0; k < any.size(); ++k)
    for (std::size_t i = k; i <= k + order && !any[k]; ++i) any[k] = samples[i];
  return any;
}

Signals whitened(const Signals& raw, const NoiseModel& noise) {
  Signals s;
  s.input = whiten(raw.input, noise);
  s.output = whiten(raw.output, noise);
  if (!raw.direction.empty()) s.direction = whiten(raw.direction, noise);
  s.constant = std::accumulate(noise.polynomial.begin(), noise.polynomial.end(), 0.0);
  s.unused = marked(raw.unused, noise.order());
  return s;
}

/// Residuals of the simulated output as a cost for Ceres. Jacobian and residual are compressed to the
/// triangular factor of [J r] while they are made: an exactly equivalent problem of kAll + 1 rows, whatever
/// the record's length.
class OutputErrorCost : public ceres::CostFunction {
 public:
  OutputErrorCost(const Signals& signals, data::OutputQuantity quantity, Structure structure,
                  detail::Coordinates coordinates, double known_delay_samples,
                  const detail::SearchRange& range)
      : signals_(signals),
        quantity_(quantity),
        structure_(structure),
        coordinates_(coordinates),
        known_delay_samples_(known_delay_samples),
        range_(range) {
    set_num_residuals(kAll + 1);
    mutable_parameter_block_sizes()->push_back(kAll);
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    if (!range_.contains(blocks[0], structure_ == Structure::three_mass ? kParameterCount : kDelay + 1))
      return false;
    std::fill(residuals, residuals + kAll + 1, 0.0);
    if (jacobians == nullptr || jacobians[0] == nullptr) {
      double sum = 0.0;
      simulate(blocks[0], [&](double r) { sum += r * r; });
      residuals[0] = std::sqrt(sum);
      return std::isfinite(sum);
    }
    using Jet = ceres::Jet<double, kAll>;
    std::array<Jet, kAll> x;
    for (int i = 0; i < kAll; ++i) x[static_cast<std::size_t>(i)] = Jet(blocks[0][i], i);
    Compressed compressed;
    simulate(x.data(), [&](const Jet& r) { compressed.add(r.v, r.a); });
    return compressed.write(residuals, jacobians[0]);
  }

  /// Calls sink(output - simulated output) for every sample that the delay leaves.
  template <class T, class Sink>
  void simulate(const T* x, Sink&& sink) const {
    detail::with_masses(structure_, [&](auto masses) { simulate_drive<masses>(x, sink); });
  }

 private:
  template <int Masses, class T, class Sink>
  void simulate_drive(const T* x, Sink&& sink) const {
    constexpr int kOrder = detail::Sizes<Masses>::kOrder;
    const auto drive = detail::sampled_drive<Masses>(coordinates_.parameters(x, Masses == 3), quantity_,
                                                     coordinates_.delay_samples(x) + T(known_delay_samples_),
                                                     coordinates_.sample_time_s);
    const auto& s = drive.system;
    const bool position = quantity_ == data::OutputQuantity::position;
    std::array<T, kOrder> state;
    for (int i = 0; i < kOrder; ++i) state[static_cast<std::size_t>(i)] = x[kInitialState + i];
    T place = x[kOffset - 1];
    const T constant = x[kOffset] * T(signals_.constant);
    const auto first = static_cast<std::size_t>(drive.whole_delay + 1);
    for (std::size_t k = first; k < signals_.output.size(); ++k) {
      const std::size_t j = k - first;
      T torque = constant + T(signals_.input[j]);
      if (!signals_.direction.empty()) torque -= x[kCoulomb] * signals_.direction[j];
      T output = s.d * torque;
      for (int i = 0; i < kOrder; ++i) output += s.c(i) * state[static_cast<std::size_t>(i)];
      if (position) output += s.c(kOrder) * place;
      if (signals_.unused.empty() || !signals_.unused[k]) sink(T(signals_.output[k]) - output);
      const auto past = state;
      const auto next = [&](int i) {
        T sum = s.b(i) * torque;
        for (int c = 0; c < kOrder; ++c) sum += s.a(i, c) * past[static_cast<std::size_t>(c)];
        return sum;
      };
      if (position) place += next(kOrder);
      for (int i = 0; i < kOrder; ++i) state[static_cast<std::size_t>(i)] = next(i);
    }
  }

  class Compressed {
   public:
    template <class Row>
    void add(const Row& derivative, double residual) {
      rows_.row(used_).template head<kAll>() = derivative.transpose();
      rows_(used_, kAll) = residual;
      if (++used_ == kRows) reduce();
    }
    bool write(double* residuals, double* jacobian) {
      reduce();
      const auto r = rows_.template topRows<kAll + 1>();
      Eigen::Map<Eigen::Matrix<double, kAll + 1, kAll, Eigen::RowMajor>> j(jacobian);
      j = r.template leftCols<kAll>();
      Eigen::Map<Eigen::Matrix<double, kAll + 1, 1>> out(residuals);
      out = r.col(kAll);
      return r.allFinite();
    }

   private:
    static constexpr int kRows = 256;
    void reduce() {
      rows_.bottomRows(kRows - used_).setZero();
      qr_.compute(rows_);
      const Eigen::Matrix<double, kAll + 1, kAll + 1> factor =
          qr_.matrixQR().topRows(kAll + 1).template triangularView<Eigen::Upper>();
      rows_.setZero();
      rows_.template topRows<kAll + 1>() = factor;
      used_ = kAll + 1;
    }
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, kAll + 1>;
    Rows rows_ = Rows::Zero(kRows, kAll + 1);
    Eigen::HouseholderQR<Rows> qr_{kRows, kAll + 1};
    int used_ = 0;
  };

  const Signals& signals_;
  data::OutputQuantity quantity_;
  Structure structure_;
  detail::Coordinates coordinates_;
  double known_delay_samples_;
  detail::SearchRange range_;
};

/// Sign of the velocity at every sample, from centred differences where the output is a position.
std::vector<double> direction_of(const data::Record& record) {
  const auto& y = record.output.samples;
  const std::size_t n = y.size();
  std::vector<double> direction(n, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    double v = y[k];
    if (record.output_quantity == data::OutputQuantity::position)
      v = y[std::min(k + 1, n - 1)] - y[k == 0 ? 0 : k - 1];
    direction[k] = v > 0.0 ? 1.0 : (v < 0.0 ? -1.0 : 0.0);
  }
  return direction;
}

using Vector = std::array<double, kAll>;
using Mask = std::array<bool, kAll>;

class OutputErrorFitter {
 public:
  OutputErrorFitter(const data::Record& record, const OutputErrorConfig& config)
      : record_(record), config_(config), known_delay_samples_(config.known_delay_s * record.sample_rate_hz) {
    raw_.input = record.input.samples;
    raw_.output = record.output.samples;
    if (!config.held_back.empty()) raw_.unused.assign(raw_.output.size(), false);
    for (const auto& [from, to] : config.held_back)
      for (std::size_t k = from; k < std::min(to, raw_.output.size()); ++k) raw_.unused[k] = true;
    if (config.coulomb_friction) raw_.direction = direction_of(record);
    const auto& start = config.initial;
    const double fastest = start.structure == Structure::rigid
                               ? kTwoPi / record.duration_s()
                               : kTwoPi * start.modes().front().frequency_hz.value;
    coordinates_ = {start.parameters.driven_inertia * fastest, record.sample_time_s()};
    fit_.model = start;
    fit_.model.sample_time_s = record.sample_time_s();
    fit_.model.known_delay_s = config.known_delay_s;
    fit_.model.estimated = estimated_parameters(start.structure, config.viscous_friction, config.delay);
    if (!config.delay && !config.fixed_model) fit_.model.delay_s = 0.0;
    if (!config.viscous_friction && !config.fixed_model) fit_.model.parameters.viscous_friction = 0.0;
    const auto physical = coordinates_.from(fit_.model);
    std::copy(physical.begin(), physical.end(), x_.begin());
    start_ = x_;
    start_state();
    active_.fill(false);
    std::copy(fit_.model.estimated.begin(), fit_.model.estimated.end(), active_.begin());
    for (int i = 0; i < order_of(start.structure); ++i)
      active_[static_cast<std::size_t>(kInitialState + i)] = config.initial_state;
    active_[kOffset - 1] = config.initial_state && record.output_quantity == data::OutputQuantity::position;
    active_[kOffset] = config.offset;
    active_[kCoulomb] = config.coulomb_friction;
  }

  OutputErrorFit run() {
    if (config_.fixed_model) {
      solve(NoiseModel{}, linear_part());
      physical_ = result_;
    } else if (!config_.noise_model) {
      solve(NoiseModel{}, active_);
    } else {
      solve(NoiseModel{}, linear_part());
      const Vector start = x_;
      const double at_start = power(raw_residual());
      solve_whitened();
      // A start whose own error outweighs the noise makes a noise model that hides the resonance, and the fit
      // then simulates worse than the start did. Plain output error is led by what is large.
      constexpr double kMisled = 1.2;
      if (power(raw_residual()) > kMisled * at_start) {
        x_ = start;
        solve(NoiseModel{}, active_);
        solve_whitened();
      }
    }
    finish();
    return std::move(fit_);
  }

 private:
  /// Noise model and parameters in turns, from the residual that x_ leaves.
  void solve_whitened() {
    NoiseModel noise = noise_of(raw_residual());
    constexpr int kRounds = 5;
    for (int round = 0; round < kRounds; ++round) {
      solve(noise, active_);
      solve_linear_part_raw();
      const NoiseModel next = noise_of(raw_residual());
      const bool settled = next.order() == noise.order() && difference(next, noise) < 0.02;
      if (settled || round + 1 == kRounds) break;
      noise = next;
    }
  }

  /// White where nothing but rounding is left, whose colour is of no use, and where a residual foretells
  /// itself as no noise does: that is the model's own error, to be fitted and not to be filtered out.
  [[nodiscard]] NoiseModel noise_of(const std::vector<double>& residual) const {
    constexpr double kRounding = 1e-9;
    constexpr double kForetold = 1e-10;
    const double left = power(residual);
    if (left < kRounding * kRounding * power(raw_.output)) return {};
    auto noise = fit_noise_model(residual, config_.max_noise_order);
    if (noise.innovation_variance < kForetold * left) return {};
    return noise;
  }

  static double power(const std::vector<double>& residual) {
    return std::inner_product(residual.begin(), residual.end(), residual.begin(), 0.0) /
           static_cast<double>(residual.size());
  }

  void start_state() {
    const auto& y = raw_.output;
    double velocity = 0.0;
    if (record_.output_quantity == data::OutputQuantity::velocity) {
      velocity = config_.initial_state ? y.front() : 0.0;
    } else if (record_.output_quantity == data::OutputQuantity::position && config_.initial_state) {
      velocity = (y.back() - y.front()) / record_.duration_s();
      x_[kOffset - 1] = y.front();
    }
    x_[kInitialState] = velocity;
    for (int i = 1; i < (order_of(config_.initial.structure) + 1) / 2; ++i)
      x_[static_cast<std::size_t>(kInitialState + i)] = velocity;  // all masses turn alike
  }

  [[nodiscard]] Mask linear_part() const {
    Mask mask = active_;
    std::fill(mask.begin(), mask.begin() + kParameterCount, false);
    return mask;
  }

  [[nodiscard]] std::unique_ptr<OutputErrorCost> cost(const Signals& signals) const {
    return std::make_unique<OutputErrorCost>(signals, record_.output_quantity, config_.initial.structure,
                                             coordinates_, known_delay_samples_, detail::SearchRange(start_));
  }

  void solve(const NoiseModel& noise, const Mask& mask) {
    const Signals signals = whitened(raw_, noise);
    std::vector<detail::Bound> bounds;
    if (mask[kDelay]) bounds.push_back({kDelay, detail::kMinimumDelaySamples, detail::kMaximumDelaySamples});
    // With a noise model the cost need not be exact to more digits than the likelihood tells apart.
    const detail::Effort effort{kMaximumIterations, config_.noise_model ? 1e-9 : 1e-14};
    result_ = detail::minimise(cost(signals), x_, mask, bounds, effort);
    noise_ = noise;
    std::size_t count = 0;
    cost(signals)->simulate(x_.data(), [&](double) { ++count; });
    fit_.samples = count;
    if (mask[kDrivenInertia]) physical_ = result_;
  }

  /// The whitened fit's initial state belongs to whitened signals; the raw residual needs its own.
  void solve_linear_part_raw() {
    if (noise_.order() == 0) return;
    const NoiseModel noise = noise_;
    const auto count = fit_.samples;
    const Vector whitened_x = x_;
    start_state();
    solve(NoiseModel{}, linear_part());
    raw_x_ = x_;
    x_ = whitened_x;
    noise_ = noise;
    fit_.samples = count;
  }

  [[nodiscard]] std::vector<double> raw_residual() const { return raw_residual(raw_); }
  [[nodiscard]] std::vector<double> raw_residual(const Signals& raw) const {
    std::vector<double> residual;
    residual.reserve(raw.output.size());
    const Vector& x = noise_.order() == 0 ? x_ : raw_x_;
    cost(raw)->simulate(x.data(), [&](double r) { residual.push_back(r); });
    return residual;
  }

  /// What the samples that were held back say of the fit to the others.
  [[nodiscard]] HeldBackFit judge_held_back() const {
    HeldBackFit judged;
    Signals rest = raw_;
    rest.unused.flip();
    const auto residual = raw_residual(rest);
    judged.samples = residual.size();
    double mean = 0.0, total = 0.0;
    for (std::size_t k = 0; k < raw_.output.size(); ++k)
      if (raw_.unused[k]) mean += raw_.output[k] / static_cast<double>(std::max<std::size_t>(1, judged.samples));
    for (std::size_t k = 0; k < raw_.output.size(); ++k)
      if (raw_.unused[k]) total += std::pow(raw_.output[k] - mean, 2);
    const double left = power(residual) * static_cast<double>(residual.size());
    judged.fit_percent = total > 0.0 ? 100.0 * (1.0 - std::sqrt(left / total)) : 0.0;
    const Signals white = whitened(rest, noise_);
    double sum = 0.0, count = 0.0;
    cost(white)->simulate(x_.data(), [&](double r) {
      sum += r * r;
      count += 1.0;
    });
    judged.information = count * std::log(std::max(sum / std::max(1.0, count), 1e-300));
    return judged;
  }

  static double difference(const NoiseModel& a, const NoiseModel& b) {
    double sum = 0.0, size = 0.0;
    for (std::size_t i = 0; i < a.polynomial.size(); ++i) {
      sum += std::pow(a.polynomial[i] - b.polynomial[i], 2);
      size += std::pow(a.polynomial[i], 2);
    }
    return std::sqrt(sum / size);
  }

  void finish() {
    coordinates_.store(x_.data(), fit_.model);
    fit_.converged = physical_.converged;
    const double n = static_cast<double>(fit_.samples);
    const double parameters = static_cast<double>(physical_.active.size());
    const double variance = 2.0 * physical_.cost / std::max(1.0, n - parameters);
    const Eigen::MatrixXd covariance = variance * detail::covariance(physical_, kAll);
    const auto scale = coordinates_.jacobian(fit_.model);
    for (int i = 0; i < kParameterCount; ++i)
      for (int j = 0; j < kParameterCount; ++j)
        fit_.model.covariance(i, j) =
            covariance(i, j) * scale[static_cast<std::size_t>(i)] * scale[static_cast<std::size_t>(j)];
    if (config_.fixed_model) {
      fit_.model.covariance = config_.initial.covariance;
      fit_.model.estimated = config_.initial.estimated;
    }
    if (config_.offset)
      fit_.offset = Estimate{x_[kOffset], std::sqrt(std::max(0.0, covariance(kOffset, kOffset)))};
    if (config_.coulomb_friction)
      fit_.coulomb_friction =
          Estimate{x_[kCoulomb], std::sqrt(std::max(0.0, covariance(kCoulomb, kCoulomb)))};
    if (!raw_.unused.empty()) fit_.held_back = judge_held_back();
    Signals all = raw_;
    all.unused.clear();
    fit_.residual = raw_residual(all);
    fit_.first_sample = raw_.output.size() - fit_.residual.size();
    fit_.noise = noise_;
    fit_.noise.innovation_variance = variance;
    fit_.information = n * std::log(std::max(2.0 * physical_.cost / n, 1e-300)) +
                       (parameters + static_cast<double>(noise_.order())) * std::log(n);
    const auto& y = raw_.output;
    const double mean = std::accumulate(y.begin(), y.end(), 0.0) / static_cast<double>(y.size());
    double total = 0.0, left = 0.0;
    for (std::size_t k = fit_.first_sample; k < y.size(); ++k) total += (y[k] - mean) * (y[k] - mean);
    for (const double r : fit_.residual) left += r * r;
    fit_.fit_percent = total > 0.0 ? 100.0 * (1.0 - std::sqrt(left / total)) : 0.0;
  }

  const data::Record& record_;
  const OutputErrorConfig& config_;
  double known_delay_samples_;
  Signals raw_;
  detail::Coordinates coordinates_;
  Vector x_{};
  Vector start_{};
  Vector raw_x_{};
  Mask active_{};
  NoiseModel noise_;
  detail::LeastSquaresResult result_;
  detail::LeastSquaresResult physical_;
  OutputErrorFit fit_;
};

}  // namespace

expected<OutputErrorFit, ConfigError> fit_output_error(const data::Record& record,
                                                       const OutputErrorConfig& config) {
  if (record.samples() < 50)
    return refuse("record", "needs at least 50 samples", static_cast<double>(record.samples()));
  if (record.input.samples.size() != record.samples())
    return refuse("record", "needs an input of the output's length");
  if (!(config.known_delay_s >= 0.0)) return refuse("known_delay_s", "must be >= 0", config.known_delay_s);
  if (config.known_delay_s > 0.25 * record.duration_s())
    return refuse("known_delay_s", "must be a small part of the record", config.known_delay_s);
  for (int i = 0; i < kParameterCount; ++i) {
    const double value = config.initial.value(static_cast<Parameter>(i));
    if (has_parameter(config.initial.structure, i) && !(value > 0.0 && std::isfinite(value)))
      return refuse("initial", "must have positive inertias, stiffnesses and dampings");
  }
  return OutputErrorFitter(record, config).run();
}

}  // namespace resonid::fit
