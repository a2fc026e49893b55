// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/models/detail/lag.hpp>
#include <resonid/online/models/detail/line_rows.hpp>
#include <resonid/online/models/detail/weighted_rows.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <span>

namespace resonid::online {

struct ResponseFitConfig {
  double sample_rate_hz = 0.0;             ///< Sample rate of the model, > 0.
  std::span<const double> frequency_hz{};  ///< Lines in (0, sample_rate_hz/2), as many as parameters / 2.
  bool integrator = true;                  ///< Fix one pole at z = 1 (a free drive).
  /// Passes of Sanathanan and Koerner per step(), >= 1, that follow a first one by Levy's method or, with a
  /// warm start, the last step's model. 0: Levy's method alone.
  std::size_t iterations = 1;
  bool warm_start = true;
  /// Weigh each line by the inverse of its variance too. Right for a machine at rest; while it changes, the
  /// lines near the resonance scatter most and say most.
  bool weigh_deviations = false;
};

/// Rational model B/A of a plant's response at lines, renewed from the lines' present values as often as
/// step() is called: Levy's method, or Sanathanan and Koerner's weights 1/|A|, warm from the model before.
///
///   minimise  sum_l w_l |A(z_l) G_l - B(z_l)|^2,        w_l = 1, 1/|A_before(z_l)|^2 or that over std_l^2
///
/// G_l has no known delay in it. The covariance is that of the noise in the lines, carried through the
/// weights in use (sandwich); what a moving machine or a wrong order adds shows in misfit(). A fit that
/// cannot be made (too few finite lines) leaves the model as it was. Between steps that share a window the
/// error hardly changes. No heap. Source: Levy 1959; Sanathanan and Koerner 1963; Nevaranta 2016,
/// eqs. 3.15-3.19, Pub. V.
template <class Real, std::size_t Order, std::size_t MaxLines>
class ResponseFit {
 public:
  using Scalar = Real;
  using Complex = std::complex<Real>;
  static constexpr std::size_t kOrder = Order;

  static expected<ResponseFit, Error> create(const ResponseFitConfig& config) {
    if (auto fault = check(config)) return unexpected<Error>(*fault);
    ResponseFit fit;
    fit.count_ = config.frequency_hz.size();
    fit.iterations_ = config.iterations;
    fit.warm_ = config.warm_start;
    fit.integrator_ = config.integrator;
    fit.weigh_ = config.weigh_deviations;
    fit.columns_ = 2 * Order - (config.integrator ? 1 : 0);
    for (std::size_t l = 0; l < fit.count_; ++l)
      fit.line_[l] = LineRows<Real, Order>(config.frequency_hz[l] / config.sample_rate_hz);
    return fit;
  }

  /// One value per line and, where known, its total standard deviation (std^2 = E|error|^2); a line whose
  /// value or deviation is not finite is left out.
  void step(std::span<const Complex> response, std::span<const Real> standard_deviation = {}) noexcept {
    ++steps_;
    const Lines before = lines_;
    lines_.known = !standard_deviation.empty();
    std::size_t usable = 0;
    for (std::size_t l = 0; l < count_; ++l) {
      const bool given = l < response.size() && (!lines_.known || l < standard_deviation.size());
      lines_.value[l] = given ? response[l] : Complex();
      lines_.variance[l] = lines_.known && given ? standard_deviation[l] * standard_deviation[l] : Real(1);
      lines_.usable[l] = given && std::isfinite(std::norm(lines_.value[l])) &&
                         std::isfinite(lines_.variance[l]) && lines_.variance[l] > Real(0);
      if (lines_.usable[l]) ++usable;
    }
    if (2 * usable < columns_ || !fit()) {
      lines_ = before;
      ++skipped_;
    }
  }
  void reset() noexcept {
    lines_ = {};
    model_ = {};
    ready_ = false;
    steps_ = skipped_ = 0;
  }

  [[nodiscard]] DiscreteModel<Real, Order> model() const noexcept { return model_.model(); }
  /// Covariance of [b, a]; infinite until there is a model. Costs about as much as a fit.
  [[nodiscard]] ModelCovariance<Real, Order> covariance() const noexcept {
    if (!ready_) return ModelCovariance<Real, Order>::Constant(std::numeric_limits<Real>::infinity());
    WeightedRows<Real, 2 * Order> sum(columns_);
    ModelCovariance<Real, Order> scatter = ModelCovariance<Real, Order>::Zero();
    const Real common = lines_.known ? Real(1) : response_variance();
    for (std::size_t l = 0; l < count_; ++l) {
      if (!lines_.usable[l]) continue;
      const auto rows = line_[l].rows(lines_.value[l]);
      const Real weight = lines_.weight[l];
      sum.add(rows.real, rows.right.real(), weight);
      sum.add(rows.imag, rows.right.imag(), weight);
      const Real variance = Real(0.5) * common * lines_.variance[l] * line_[l].power(model_);
      const Eigen::Map<const Column> re(rows.real.data()), im(rows.imag.data());
      scatter += weight * weight * variance * (re * re.transpose() + im * im.transpose());
    }
    const ModelCovariance<Real, Order> inverse = sum.covariance();
    return model_covariance<Real, Order>(inverse * scatter * inverse);
  }
  /// rms over the lines of |error|/std, or of |error| in the response's unit when no deviations are known.
  [[nodiscard]] Real misfit() const noexcept {
    Real sum(0), used(0);
    for (std::size_t l = 0; l < count_; ++l) {
      if (!lines_.usable[l]) continue;
      sum += std::norm(error(l)) / lines_.variance[l];
      used += Real(1);
    }
    return used > Real(0) ? std::sqrt(sum / used) : std::numeric_limits<Real>::quiet_NaN();
  }
  /// How far the model lags behind slow changes of the machine, beyond the lag of the lines that it is given
  /// (half a window for the sliding DFT): see oscillation_memory_samples().
  [[nodiscard]] double lag_samples() const noexcept {
    return ready_ ? oscillation_memory_samples(model()) : 0.0;
  }
  /// Whether there is a model.
  [[nodiscard]] bool ready() const noexcept { return ready_; }
  [[nodiscard]] std::size_t lines() const noexcept { return count_; }
  [[nodiscard]] std::uint64_t steps() const noexcept { return steps_; }
  /// Steps that left the model as it was.
  [[nodiscard]] std::uint64_t skipped_steps() const noexcept { return skipped_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    constexpr std::size_t kMostPasses = 1000;
    return intact_flags(warm_, integrator_, weigh_, ready_, lines_.known) &&
           std::all_of(lines_.usable.begin(), lines_.usable.end(),
                       [](const bool& usable) { return resonid::intact(usable); }) &&
           count_ >= 1 && count_ <= MaxLines && columns_ <= 2 * Order && iterations_ <= kMostPasses;
  }

 private:
  using Column = Eigen::Matrix<Real, static_cast<int>(2 * Order), 1>;
  /// What the present model was fitted to.
  struct Lines {
    std::array<Complex, MaxLines> value{};
    std::array<Real, MaxLines> variance{}, weight{};
    std::array<bool, MaxLines> usable{};
    bool known = false;  // the variances
  };

  ResponseFit() = default;

  static std::optional<Error> check(const ResponseFitConfig& c) {
    if (!(c.sample_rate_hz > 0.0) || !std::isfinite(c.sample_rate_hz))
      return Error{"sample_rate_hz", "must be > 0", c.sample_rate_hz};
    const auto lines = static_cast<double>(c.frequency_hz.size());
    if (2 * c.frequency_hz.size() < 2 * Order - (c.integrator ? 1 : 0))
      return Error{"frequency_hz", "needs at least half as many lines as parameters", lines};
    if (c.frequency_hz.size() > MaxLines)
      return Error{"frequency_hz", "has more lines than the fit was built for", lines};
    for (const double f : c.frequency_hz)
      if (!(f > 0.0 && f < 0.5 * c.sample_rate_hz))
        return Error{"frequency_hz", "must be > 0 and below half the sample rate", f};
    return std::nullopt;
  }

  bool fit() noexcept {
    DifferenceModel<Real, Order> present = model_;
    bool known = warm_ && ready_ && iterations_ > 0;
    for (std::size_t pass = known ? 1 : 0; pass <= iterations_; ++pass, known = true) {
      WeightedRows<Real, 2 * Order> sum(columns_);
      for (std::size_t l = 0; l < count_; ++l) {
        if (!lines_.usable[l]) continue;
        Real weight = weigh_ ? Real(2) / lines_.variance[l] : Real(1);
        if (known)
          weight /= line_[l].power(present);
        else if (integrator_)
          weight /= line_[l].difference() * line_[l].difference();
        lines_.weight[l] = weight;
        const auto rows = line_[l].rows(lines_.value[l]);
        sum.add(rows.real, rows.right.real(), weight);
        sum.add(rows.imag, rows.right.imag(), weight);
      }
      const auto solution = sum.solution();
      for (const Real x : solution)
        if (!std::isfinite(x)) return false;
      if (!sum.determined()) return false;
      std::copy_n(solution.begin(), Order, present.beta.begin());
      std::copy_n(solution.begin() + Order, Order, present.alpha.begin());
    }
    model_ = present;
    return ready_ = true;
  }

  [[nodiscard]] Complex error(std::size_t l) const noexcept {
    return lines_.value[l] - line_[l].numerator(model_) / line_[l].denominator(model_);
  }
  /// The lines' common variance from the misfit, for lines of unknown deviation.
  [[nodiscard]] Real response_variance() const noexcept {
    Real used(0);
    for (std::size_t l = 0; l < count_; ++l) used += lines_.usable[l] ? Real(1) : Real(0);
    const Real rms = misfit();
    return rms * rms * used / std::max(Real(1), used - Real(0.5) * Real(columns_));
  }

  std::array<LineRows<Real, Order>, MaxLines> line_{};
  Lines lines_{};
  DifferenceModel<Real, Order> model_{};
  std::size_t count_ = 0, columns_ = 0, iterations_ = 1;
  bool warm_ = true, integrator_ = true, weigh_ = false, ready_ = false;
  std::uint64_t steps_ = 0, skipped_ = 0;
};

static_assert(std::is_trivially_copyable_v<ResponseFit<double, 3, 21>>);
static_assert(std::is_trivially_copyable_v<ResponseFit<float, 3, 21>>);

}  // namespace resonid::online
