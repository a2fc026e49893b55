// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/flushed.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/online/axis_config.hpp>
#include <resonid/online/axis_result.hpp>
#include <resonid/online/detail/axis_reading.hpp>

namespace resonid::online::detail {

/// Mean that fades with a time constant in samples; a plain mean until then.
template <class Real>
class FadingLevel {
 public:
  explicit FadingLevel(Real samples = Real(1)) noexcept : samples_(std::max(Real(1), samples)) {}
  /// `x` stands for so many samples.
  void add(Real x, Real count = Real(1)) noexcept {
    if (count_ < Real(2) * samples_) count_ += count;  // it counts only until it is filled
    value_ = flushed(value_ + count / std::min(count_, std::max(samples_, count)) * (x - value_));
  }
  void reset() noexcept { value_ = count_ = Real(0); }
  [[nodiscard]] Real value() const noexcept { return value_; }
  [[nodiscard]] bool filled() const noexcept { return count_ >= samples_; }

 private:
  Real samples_;
  Real value_ = Real(0), count_ = Real(0);
};

/// Follows excitation and residual sample by sample, and judges every row by AxisCriteria
/// (docs/methods/axis.md).
template <class Real>
class AxisGatekeeper {
 public:
  AxisGatekeeper() = default;
  /// Excitation is looked for from a fifth to three times `centre_hz`; of a sweep (0) wherever it is. A
  /// stretch is twenty periods of it, a quarter of a second at least.
  AxisGatekeeper(double sample_rate_hz, double centre_hz, bool sweep) noexcept : sweep_(sweep) {
    const double centre = centre_hz / sample_rate_hz;
    high_pass_ = static_cast<Real>(-std::expm1(-kTwoPi * 0.2 * centre));
    low_pass_ = static_cast<Real>(-std::expm1(-kTwoPi * 3.0 * centre));
    const auto stretch = static_cast<Real>(std::max(0.25 * sample_rate_hz, 20.0 / centre));
    excitation_ = residual_ = missing_ = FadingLevel<Real>(stretch);
    resonance_ = FadingLevel<double>(static_cast<double>(stretch));
    constexpr Real kUsualStretches(20);  // memory of what is usual
    usual_residual_ = correlation_ = lagged_power_ = FadingLevel<Real>(kUsualStretches * stretch);
  }

  /// `x` is the excitation, or the torque where there is none; the residual not a number while the estimate
  /// is not ready.
  void sample(Real x, Real residual, bool missing) noexcept {
    ++samples_;
    missing_.add(missing ? Real(1) : Real(0));
    if (std::isfinite(x)) {
      x = banded(x);
      excitation_.add(x * x);
      if (excitation_.filled()) strongest_ = std::max(strongest_, excitation_.value());
    }
    if (!std::isfinite(residual)) return;
    residual_.add(residual * residual);
    usual_residual_.add(residual * residual);
    if (std::isfinite(last_residual_)) {
      correlation_.add(residual * last_residual_);
      lagged_power_.add(residual * residual);
    }
    last_residual_ = residual;
  }
  void miss(std::uint64_t count) noexcept {
    samples_ += count;
    missing_.add(Real(1), static_cast<Real>(count));
  }
  void reset() noexcept {
    slow_ = smooth_ = strongest_ = Real(0);
    last_residual_ = kNan;
    for (auto* level : {&excitation_, &residual_, &missing_, &usual_residual_, &correlation_, &lagged_power_})
      level->reset();
    resonance_.reset();
    samples_ = judged_samples_ = 0;
  }

  /// Fills the row's gates, verdict, residual and uncertainty, and counts.
  void judge(const AxisReading& reading, const AxisCriteria& c, AxisRow& row, AxisResult& result) noexcept {
    AxisGates& gates = row.gates;
    gates.ready = reading.ready;
    const Real now = excitation_.value();
    const auto weak = static_cast<Real>(c.weak_excitation * c.weak_excitation);
    gates.excited = now > Real(0) && now >= weak * strongest_ && reading.excited;
    gates.converged = converged(reading, c);
    gates.physical = reading.physical;
    gates.residual = residual_holds(c, result);
    gates.complete = static_cast<double>(missing_.value()) <= c.missing;
    gates.covered = !c.inside_lines || (row.antiresonance_hz.value >= reading.first_line_hz &&
                                        row.resonance_hz.value <= reading.last_line_hz);
    row.residual_rms =
        std::isfinite(last_residual_) ? std::sqrt(static_cast<double>(residual_.value())) : AxisRow::kUnknown;
    row.uncertainty = reading.uncertainty;
    row.most_uncertainty = reading.most_uncertainty;
    row.trusted = gates.all();
    row.verdict = verdict_of(gates);
    if (lagged_power_.value() > Real(0))
      result.residual_correlation = static_cast<double>(correlation_.value() / lagged_power_.value());
    count(gates, result);
  }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return resonid::intact(sweep_); }

 private:
  static constexpr Real kNan = std::numeric_limits<Real>::quiet_NaN();

  Real banded(Real x) noexcept {
    if (sweep_) return x;
    slow_ = flushed_signal(slow_ + high_pass_ * (x - slow_));
    smooth_ = flushed_signal(smooth_ + low_pass_ * (x - slow_ - smooth_));
    return smooth_;
  }
  [[nodiscard]] bool converged(const AxisReading& r, const AxisCriteria& c) noexcept {
    if (!r.ready) return false;
    if (!r.finds_resonance) return r.uncertainty <= r.most_uncertainty;
    const double hz = r.resonance_hz.value;
    if (!std::isfinite(hz)) return false;
    resonance_.add(hz, static_cast<double>(samples_ - judged_samples_));
    judged_samples_ = samples_;
    const double mean = resonance_.value();
    const bool anti = c.antiresonance_std <= 0.0 ||
                      r.antiresonance_hz.std <= c.antiresonance_std * r.antiresonance_hz.value;
    return anti && !(r.uncertainty > r.most_uncertainty) && std::abs(hz - mean) <= c.restless * mean;
  }
  [[nodiscard]] bool residual_holds(const AxisCriteria& c, AxisResult& result) const noexcept {
    if (!std::isfinite(last_residual_) || !residual_.filled() || !(usual_residual_.value() > Real(0)))
      return true;
    const double growth = std::sqrt(static_cast<double>(residual_.value() / usual_residual_.value()));
    result.worst_residual_growth = std::max(result.worst_residual_growth, growth);
    return growth <= c.residual_growth;
  }
  static AxisVerdict verdict_of(const AxisGates& g) noexcept {
    if (!g.ready) return AxisVerdict::not_ready;
    if (!g.complete) return AxisVerdict::samples_missing;
    if (!g.excited) return AxisVerdict::not_excited;
    if (!g.physical) return AxisVerdict::unphysical;
    if (!g.covered) return AxisVerdict::outside_lines;
    if (!g.converged) return AxisVerdict::not_converged;
    return g.residual ? AxisVerdict::trusted : AxisVerdict::residual_grown;
  }
  void count(const AxisGates& gates, AxisResult& result) const noexcept {
    AxisCounts& n = result.counts;
    ++n.rows;
    if (n.ready == 0 && !gates.ready) return;
    ++n.ready;  // from the first one on every row counts: an estimator that loses its way is not ready again
    if (gates.excited) {
      ++n.excited;
      if (!gates.ready) ++n.lost;
      if (gates.ready && gates.converged) ++n.converged;
      if (gates.physical) ++n.physical;
      if (gates.residual) ++n.residual;
    }
    if (gates.all()) ++n.all;
    if (strongest_ > Real(0))
      result.weakest_excitation = std::min(result.weakest_excitation,
                                           std::sqrt(static_cast<double>(excitation_.value() / strongest_)));
  }

  bool sweep_ = false;
  Real high_pass_ = Real(0), low_pass_ = Real(0);  // of the band, per sample
  Real slow_ = Real(0), smooth_ = Real(0);         // their states
  FadingLevel<Real> excitation_, residual_, missing_, usual_residual_, correlation_, lagged_power_;
  FadingLevel<double> resonance_;
  Real strongest_ = Real(0);
  Real last_residual_ = kNan;
  std::uint64_t samples_ = 0, judged_samples_ = 0;
};

}  // namespace resonid::online::detail
