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
#include <resonid/base/expected.hpp>
#include <resonid/online/axis_config.hpp>
#include <resonid/online/axis_result.hpp>
#include <resonid/online/detail/axis_gatekeeper.hpp>
#include <resonid/online/detail/axis_injector.hpp>
#include <resonid/online/detail/axis_lines.hpp>
#include <resonid/online/detail/axis_loop.hpp>
#include <resonid/online/detail/axis_models.hpp>
#include <resonid/online/detail/axis_physical.hpp>
#include <resonid/online/detail/axis_reading.hpp>
#include <resonid/online/detail/axis_sweep.hpp>
#include <resonid/online/detail/axis_watch.hpp>
#include <resonid/online/detail/one_of.hpp>
#include <resonid/online/models/detail/model_response.hpp>
#include <span>
#include <string_view>
#include <type_traits>

namespace resonid::online {

/// What an axis has room for, besides its estimators. Derive from it and say what is to be different.
struct AxisRoom {
  using Real = double;  ///< Type of the samples and of all that runs at every sample; rows are always double.
  static constexpr std::size_t kInjectedLines = 256;  ///< Lines of the multisine; 0: nothing can be injected.
  static constexpr std::size_t kBaselinePoints = 1024;  ///< Points of a baseline that is a response.
  static constexpr std::size_t kChangeWindow = 256;     ///< Blocks of the change detection; 0: there is none.
  static constexpr bool kControllerCheck = true;        ///< `controller_differs` is found.
};

// Estimators that an axis can be built with; each serves the methods in its comment.
template <class Real = double, std::size_t MaxLines = 256>
using AxisLines = detail::AxisFixedLines<KalmanBank<Real, MaxLines>>;  ///< lines
template <class Real = double, std::size_t MaxLines = 256, std::size_t MaxWindow = 16384>
using AxisSlidingDft = detail::AxisFixedLines<SlidingDft<Real, MaxLines, MaxWindow>>;  ///< sliding_dft
template <class Real = double, std::size_t MaxPoints = 512>
using AxisSweep = detail::AxisSweepLine<Real, MaxPoints>;  ///< chirp
template <class Real = double, std::size_t ReplaySamples = 16384>
using AxisPhysical = detail::AxisPhysical<Real, ReplaySamples>;  ///< physical
template <class Real = double, std::size_t Order = 3>
using AxisArx = detail::AxisModel<Arx<Real, Order>>;  ///< arx
template <class Real = double, std::size_t Order = 3>
using AxisOutputError = detail::AxisModel<OutputError<Real, Order>>;  ///< output_error, prediction_error
template <class Real = double, std::size_t Order = 3>
using AxisClosedLoop =
    detail::AxisModel<ClosedLoopOutputError<Real, Order>>;  ///< closed_loop, filtered_..., damped_closed_loop
template <class Real = double, std::size_t Order = 3>
using AxisInstrumental = detail::AxisModel<InstrumentalVariables<Real, Order>>;  ///< instrumental_variables

/// One axis of a machine, followed sample by sample: guarded excitation, one estimator, margins of the loop
/// and gap, change detection, and a verdict, behind one configuration and one result.
///
///   auto axis = Axis::create(config).value();
///   every sample:   torque += axis.excite({.torque = torque, .velocity = velocity});
///                   if (axis.step({axis.injected(), torque, velocity})) ... axis.row() ...
///
/// A pure function (state, samples) -> (state, rows): trivially copyable (a snapshot is a copy), no heap, no
/// clock; the same samples give the same rows in whatever portions they come. A row comes every
/// `row_every_samples`; its work is done at that sample, or spread over `spread_samples` of them. Lost
/// samples: miss(), or samples that are not finite. The estimators are a template argument, so that a
/// firmware image carries those that it uses; a method that none of them serves is refused.
/// docs/methods/axis.md
template <class Room, class... Estimators>
class BasicAxis {
 public:
  using Real = typename Room::Real;
  using Sample = AxisSample<Real>;

  /// Fields of errors are those of AxisConfig (of `physical`: those of PhysicalTrackerConfig).
  static expected<BasicAxis, Error> create(const AxisConfig& config) noexcept;
  class Key {  // of what create() makes
    friend class BasicAxis;
    Key() = default;
  };
  explicit BasicAxis(Key) noexcept {}
  /// In memory of sizeof(BasicAxis), suitably aligned: an axis with all estimators is large for a stack.
  /// Nothing needs to be destroyed.
  static expected<BasicAxis*, Error> create_in(void* memory, const AxisConfig& config) noexcept;

  // Excitation, where the axis injects it.
  /// Begins to inject, with ramps and limits, and forgets what was estimated. Refused: nothing is injected.
  /// No heap; may be called in a servo thread.
  expected<void, Error> start(const AxisInjection& what) noexcept;
  /// Ramps out.
  void stop() noexcept { injector_.stop(); }
  /// Once per sample, before step(): what is to be added to the controller's torque. `given`: for
  /// Kind::given.
  Real excite(const MachineSample<Real>& now, Real given = Real(0)) noexcept;
  [[nodiscard]] Real injected() const noexcept { return injected_; }  ///< What excite() returned last.

  [[nodiscard]] bool injecting() const noexcept { return injector_.active(); }

  // Estimation.
  /// One sample; true when it completed a row.
  bool step(const Sample& sample) noexcept;
  /// Many of them; `on_row(const AxisRow&)` for every row.
  template <class OnRow>
  void run(std::span<const Sample> samples, OnRow&& on_row) {
    for (const Sample& s : samples)
      if (step(s)) on_row(result_.row);
  }
  /// `count` samples were lost: as so many that are not finite, in a bounded time. A row in work, and those
  /// that would have come meanwhile, are not made.
  void miss(std::uint64_t count) noexcept;
  /// As create() left it: nothing known, nothing injected.
  void reset() noexcept;

  [[nodiscard]] const AxisResult& result() const noexcept { return result_; }
  [[nodiscard]] const AxisRow& row() const noexcept { return result_.row; }  ///< The newest one.
  /// Name of one of the row's parameters: "b1" ... "a1" ..., "driven_inertia" ...; empty beyond the last one.
  [[nodiscard]] std::string_view parameter_name(std::size_t i) const noexcept {
    return estimator_.visit([i](const auto& e) { return e.parameter_name(i); });
  }
  /// Number of lines at the newest row; a chirp has one, methods without lines none.
  [[nodiscard]] std::size_t lines() const noexcept;
  [[nodiscard]] AxisLine line(std::size_t i) const noexcept;
  /// The plant at any frequency, as of the newest row, without the known delay; not a number where no model
  /// is known.
  [[nodiscard]] std::complex<double> response(double frequency_hz) const noexcept {
    if (!known_.has_model) return {AxisRow::kUnknown, AxisRow::kUnknown};
    return online::response(known_.model, frequency_hz, sample_rate_hz_);
  }
  [[nodiscard]] bool has_model() const noexcept { return known_.has_model; }
  /// Whether a right model leaves a white residual.
  [[nodiscard]] bool white_residual() const noexcept {
    return estimator_.visit([](const auto& e) { return e.white_residual(); });
  }

  /// False where the memory is so long that the trackers of lines never settle.
  [[nodiscard]] bool settles() const noexcept {
    return estimator_.visit([](const auto& e) {
      if constexpr (requires { e.settling_samples(); })
        return e.settling_samples() < kNeverSettles;
      else
        return true;
    });
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept;

  // What may change while it runs, in bounded time; the next row follows.
  /// The loop whose margins are told. The delay is that of `lines` and `sliding_dft`; other estimators keep
  /// theirs.
  void set_loop(const AxisController& controller, AxisLoop loop, double known_delay_s) noexcept;
  void set_criteria(const AxisCriteria& criteria) noexcept { criteria_ = criteria; }
  /// Relative change of the stiffness per second that `physical` reckons with; others ignore it.
  void set_stiffness_drift(double per_s) noexcept;

  /// The estimator, if it is of this type.
  template <class E>
  [[nodiscard]] const E* estimator() const noexcept {
    return estimator_.template get_if<E>();
  }

 private:
  using Injector =
      std::conditional_t<(Room::kInjectedLines > 0),
                         detail::AxisInjector<Real, std::max<std::size_t>(Room::kInjectedLines, 1)>,
                         detail::NoInjector<Real>>;
  using Baseline = detail::AxisBaseline<Room::kBaselinePoints>;
  using Watch = detail::AxisChangeWatch<Room::kChangeWindow>;
  using Check = detail::AxisControllerCheck<Real, Room::kControllerCheck>;
  using Estimator = detail::OneOf<Estimators...>;

  expected<void, Error> configure(const AxisConfig& config) noexcept;
  template <class First, class... Rest>
  expected<void, Error> make_estimator(const AxisConfig& config) noexcept;

  [[nodiscard]] Real velocity_of(Real output) noexcept;
  void settle() noexcept;
  bool work() noexcept;
  void do_unit() noexcept;
  void read() noexcept;
  void conclude() noexcept;
  [[nodiscard]] std::size_t line_units() const noexcept;
  void forget() noexcept;

  // Told.
  double sample_rate_hz_ = 0.0;
  std::size_t every_ = 1, spread_ = 1;
  AxisOutput output_ = AxisOutput::velocity;
  bool has_excitation_ = true;
  AxisCriteria criteria_;
  // Running.
  Estimator estimator_;
  Injector injector_;
  Baseline baseline_;
  detail::AxisLoopFigures loop_;
  detail::AxisGatekeeper<Real> gates_;
  Watch watch_;
  Check check_;
  AxisResult result_{};
  Real injected_{}, last_output_ = std::numeric_limits<Real>::quiet_NaN();
  std::uint64_t steady_samples_ = 0, steady_after_ = 0;
  bool needs_steady_ = false;
  // The row in work, and what is known from the one before.
  detail::AxisReading reading_{}, known_{};
  enum class Stage { lines, model, done } stage_ = Stage::done;
  std::size_t unit_ = 0;
  std::uint64_t phase_ = 0;  // samples since the last row was due
};

/// The axis with all estimators: some 2 MB, nearly all of it for long windows of many lines.
using Axis = BasicAxis<AxisRoom, AxisLines<>, AxisSlidingDft<>, AxisSweep<>, AxisPhysical<>,
                       AxisArx<double, 1>, AxisArx<>, AxisOutputError<>, AxisClosedLoop<>,
                       AxisInstrumental<double, 1>, AxisInstrumental<>>;

}  // namespace resonid::online

#include <resonid/online/detail/axis_impl.hpp>

namespace resonid::online {

namespace detail {
extern template class AxisFixedLines<KalmanBank<double, 256>>;
extern template class AxisFixedLines<SlidingDft<double, 256, 16384>>;
extern template class AxisSweepLine<double, 512>;
extern template class AxisPhysical<double, 16384>;
extern template class AxisModel<Arx<double, 1>>;
extern template class AxisModel<Arx<double, 3>>;
extern template class AxisModel<OutputError<double, 3>>;
extern template class AxisModel<ClosedLoopOutputError<double, 3>>;
extern template class AxisModel<InstrumentalVariables<double, 1>>;
extern template class AxisModel<InstrumentalVariables<double, 3>>;
}  // namespace detail
extern template class BasicAxis<AxisRoom, AxisLines<>, AxisSlidingDft<>, AxisSweep<>, AxisPhysical<>,
                                AxisArx<double, 1>, AxisArx<>, AxisOutputError<>, AxisClosedLoop<>,
                                AxisInstrumental<double, 1>, AxisInstrumental<>>;

}  // namespace resonid::online
