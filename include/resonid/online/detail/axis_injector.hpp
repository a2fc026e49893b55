// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/axis_config.hpp>
#include <resonid/online/detail/one_of.hpp>
#include <resonid/online/excitation/chirp.hpp>
#include <resonid/online/excitation/guarded_excitation.hpp>
#include <resonid/online/excitation/multisine.hpp>
#include <resonid/online/excitation/prbs.hpp>
#include <span>

namespace resonid::online::detail {

/// The excitations that an axis can be given, each with the peak value that is asked for, behind the guard.
template <class Real, std::size_t MaxLines>
class AxisInjector {
 public:
  using Sample = MachineSample<Real>;
  static constexpr bool kInjects = true;

  static expected<AxisInjector, Error> create(const AxisConfig& c) noexcept {
    AxisInjector injector;
    injector.sample_rate_hz_ = c.sample_rate_hz;
    if (!c.injects) return injector;
    const bool sweeps = c.sweep.duration_s > 0.0;
    if (c.lines_hz.empty() && !sweeps) return injector;  // what it is handed
    const double last_hz = c.lines_hz.empty() ? std::max(c.sweep.from_hz, c.sweep.to_hz) : c.lines_hz.back();
    constexpr double kBandOverBits = 0.3;  // up to which a PRBS is flat
    const double bits_hz = last_hz / kBandOverBits;
    const auto prbs = Prbs::create(
        {.sample_rate_hz = c.sample_rate_hz,
         .amplitude = 1.0,
         .register_length = kRegister,
         .clock_divider = static_cast<std::size_t>(std::max(1.0, std::floor(c.sample_rate_hz / bits_hz)))});
    if (!prbs) return unexpected<Error>(prbs.error());
    injector.prbs_ = OneOf<Prbs>(*prbs);
    ChirpConfig sweep{.sample_rate_hz = c.sample_rate_hz, .amplitude = 1.0, .repeat = true};
    sweep.from_hz = sweeps ? c.sweep.from_hz : c.lines_hz.front();
    sweep.to_hz = sweeps ? c.sweep.to_hz : last_hz;
    sweep.duration_s = sweeps ? c.sweep.duration_s : AxisInjection{}.sweep_s;
    const auto chirp = Chirp::create(sweep);
    if (!chirp) return unexpected<Error>(chirp.error());
    injector.chirp_ = OneOf<Chirp>(*chirp);
    if (c.lines_hz.empty()) return injector;
    const std::array<double, 1> amplitude{1.0};
    const auto lines = Lines::create(
        {.sample_rate_hz = c.sample_rate_hz, .frequency_hz = c.lines_hz, .amplitude = amplitude});
    if (!lines) return unexpected<Error>(lines.error());
    injector.lines_ = OneOf<Lines>(*lines);
    injector.lines_peak_ = peak_of(*lines, c.sample_rate_hz);
    return injector;
  }

  /// From the first sample. Where it is refused nothing is injected.
  expected<void, Error> start(const AxisInjection& what) noexcept {
    guard_.clear();
    GuardedExcitationConfig limits = what.guard;
    limits.sample_rate_hz = sample_rate_hz_;
    const auto guard = Guard::create(limits);
    if (!guard) return unexpected<Error>(guard.error());
    if (!can(what.kind)) return refuse("kind", "must be one that create() was told what it needs for");
    if (what.kind == Kind::chirp) {
      ChirpConfig sweep = chirp_.template get_if<Chirp>()->config();
      sweep.duration_s = what.sweep_s;
      const auto chirp = Chirp::create(sweep);
      if (!chirp) return unexpected<Error>(chirp.error());
      chirp_ = OneOf<Chirp>(*chirp);
    }
    if (auto* lines = lines_.template get_if<Lines>()) lines->reset();
    if (auto* prbs = prbs_.template get_if<Prbs>()) prbs->reset();
    kind_ = what.kind;
    amplitude_ = kind_ == Kind::multisine ? limits.amplitude / lines_peak_ : limits.amplitude;
    guard_ = OneOf<Guard>(*guard);
    return {};
  }
  void stop() noexcept {
    if (auto* guard = guarded()) guard->stop();
  }
  void reset() noexcept {
    guard_.clear();
    injected_ = Real(0);
  }
  Real excite(const Sample& now, Real given) noexcept {
    injected_ = Real(0);
    if (active()) injected_ = guarded()->step(kind_ == AxisInjection::Kind::given ? given : generate(), now);
    return injected_;
  }
  void miss(std::uint64_t count) noexcept {
    if (active()) guarded()->miss(count);
  }
  void watch(double amplitude) noexcept {
    if (auto* guard = guarded()) guard->watch(static_cast<Real>(amplitude));
  }

  [[nodiscard]] bool started() const noexcept { return guard_.holds_one(); }
  [[nodiscard]] bool active() const noexcept { return guard() != nullptr && !guard()->stopped(); }
  [[nodiscard]] bool steady() const noexcept { return guard() != nullptr && guard()->steady(); }
  [[nodiscard]] bool tripped() const noexcept { return guard() != nullptr && guard()->tripped(); }
  [[nodiscard]] StopReason reason() const noexcept {
    return guard() != nullptr ? guard()->reason() : StopReason::none;
  }
  /// None before the first start.
  [[nodiscard]] const GuardedExcitation<Real>* guard() const noexcept {
    return guard_.template get_if<Guard>();
  }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return lines_.intact() && prbs_.intact() && chirp_.intact() && guard_.intact() && can(kind_);
  }

 private:
  using Lines = Multisine<MaxLines>;
  using Guard = GuardedExcitation<Real>;
  using Kind = AxisInjection::Kind;
  static constexpr std::size_t kRegister = 13;

  [[nodiscard]] Guard* guarded() noexcept { return guard_.template get_if<Guard>(); }
  /// Whether create() made what the kind needs.
  [[nodiscard]] bool can(Kind kind) const noexcept {
    return kind == Kind::given || (kind == Kind::multisine && lines_.holds_one()) ||
           (kind == Kind::prbs && prbs_.holds_one()) || (kind == Kind::chirp && chirp_.holds_one());
  }
  static double peak_of(Lines lines, double sample_rate_hz) noexcept {
    constexpr double kWatched_s = 30.0;
    const auto longest = static_cast<std::size_t>(kWatched_s * sample_rate_hz);
    const std::size_t period = lines.period_samples();
    double peak = 0.0;
    for (std::size_t k = period > 0 ? std::min(period, longest) : longest; k > 0; --k)
      peak = std::max(peak, std::abs(lines.step()));
    return peak;
  }
  Real generate() noexcept {
    return static_cast<Real>(amplitude_ * (kind_ == Kind::chirp  ? chirp_.template get_if<Chirp>()->step()
                                           : kind_ == Kind::prbs ? prbs_.template get_if<Prbs>()->step()
                                                                 : lines_.template get_if<Lines>()->step()));
  }

  OneOf<Lines> lines_;
  OneOf<Prbs> prbs_;
  OneOf<Chirp> chirp_;
  OneOf<Guard> guard_;
  double sample_rate_hz_ = 0.0, lines_peak_ = 1.0, amplitude_ = 0.0;
  Real injected_{};
  AxisInjection::Kind kind_ = AxisInjection::Kind::given;
};

/// An axis that only watches.
template <class Real>
class NoInjector {
 public:
  using Sample = MachineSample<Real>;
  static constexpr bool kInjects = false;
  static expected<NoInjector, Error> create(const AxisConfig& c) noexcept {
    if (c.injects) return refuse("injects", "must be false: this axis was built without excitations");
    return NoInjector{};
  }
  expected<void, Error> start(const AxisInjection&) noexcept {
    return refuse("kind", "must be one that this axis was built with: it has none");
  }
  void stop() noexcept {}
  void reset() noexcept {}
  Real excite(const Sample&, Real) noexcept { return Real(0); }
  void miss(std::uint64_t) noexcept {}
  void watch(double) noexcept {}
  [[nodiscard]] bool started() const noexcept { return false; }
  [[nodiscard]] bool active() const noexcept { return false; }
  [[nodiscard]] bool steady() const noexcept { return false; }
  [[nodiscard]] bool tripped() const noexcept { return false; }
  [[nodiscard]] StopReason reason() const noexcept { return StopReason::none; }
  [[nodiscard]] bool intact() const noexcept { return true; }
};

}  // namespace resonid::online::detail
