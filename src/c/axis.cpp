// SPDX-License-Identifier: MIT
#include "axis.hpp"

#include <resonid/c/detail/axis.h>

#include <array>
#include <complex>

#include "adaptation.hpp"
#include "change_config.hpp"
#include "guard_config.hpp"
#include "handle.hpp"
#include "physical_config.hpp"

namespace resonid::c {
namespace {

using online::AxisConfig;
using online::AxisCriteria;
using online::AxisFigure;
using online::AxisGates;
using online::AxisInjection;
using online::AxisLoop;
using online::AxisMethod;
using online::AxisOutput;
using online::AxisVerdict;
static_assert(static_cast<std::uint32_t>(AxisMethod::chirp) == type_of(RESONID_AXIS_CHIRP));
static_assert(static_cast<std::uint32_t>(AxisMethod::physical) == type_of(RESONID_AXIS_PHYSICAL));
static_assert(static_cast<int>(AxisVerdict::residual_grown) == RESONID_VERDICT_RESIDUAL_GROWN);
static_assert(static_cast<int>(AxisLoop::measured) == RESONID_LOOP_MEASURED);
static_assert(static_cast<int>(AxisFigure::gap) + 1 == RESONID_FIGURE_GAP);
static_assert(static_cast<int>(AxisInjection::Kind::given) == RESONID_INJECT_GIVEN);
static_assert(static_cast<int>(AxisOutput::acceleration) == RESONID_AXIS_OF_ACCELERATION);
static_assert(online::kAxisParameters == RESONID_AXIS_PARAMETERS);
static_assert(online::AxisRoom::kBaselinePoints == RESONID_AXIS_MAX_BASELINE);

resonid_figure plain(const online::Figure& f) noexcept { return {f.value, f.std}; }

/// f(C field, C++ field) for all numbers that both hold alike.
template <class C, class Config, class F>
void for_each_number(C& c, Config& a, F&& f) noexcept {
  f(c.weak_excitation, a.weak_excitation);
  f(c.restless, a.restless);
  f(c.residual_growth, a.residual_growth);
  f(c.resonance_std, a.resonance_std);
  f(c.antiresonance_std, a.antiresonance_std);
  f(c.gain_std, a.gain_std);
  f(c.line_std, a.line_std);
  f(c.missing, a.missing);
}
AxisCriteria criteria_of(const resonid_axis_criteria& s) noexcept {
  AxisCriteria c;
  for_each_number(s, c, [](const double& from, double& to) { to = from; });
  c.inside_lines = s.inside_lines != 0;
  return c;
}

/// Settings inside of settings, filled as far as the caller's headers know them.
template <class Defaults>
expected<typename Defaults::Settings> inner(const char* field,
                                            const typename Defaults::Settings* given) noexcept {
  typename Defaults::Settings settings;
  if (given == nullptr) return refuse(field, "must not be NULL");
  if (take<Defaults>(&given->head, settings, nullptr) != RESONID_OK)
    return refuse(field, "must be settings that resonid_defaults() has filled");
  return settings;
}

struct Axes : Variants<Axes, Axis<online::AxisArx<double, 1>>, Axis<online::AxisArx<>>,
                       Axis<online::AxisOutputError<>>, Axis<online::AxisClosedLoop<>>,
                       Axis<online::AxisInstrumental<double, 1>>, Axis<online::AxisInstrumental<>>,
                       Axis<online::AxisPhysical<>>, Axis<online::AxisLines<>>,
                       Axis<online::AxisSlidingDft<>>, Axis<online::AxisSweep<>>> {
  using Settings = resonid_axis_settings;
  using Results = resonid_axis_results;
  static constexpr std::uint32_t kId = family_of(RESONID_AXIS_ARX), kTypes = 11;

  static Settings defaults(std::uint32_t) noexcept {
    const AxisConfig a;
    Settings s{};
    s.output = static_cast<std::uint32_t>(a.output);
    s.approach = static_cast<std::uint32_t>(a.approach);
    s.loop = static_cast<std::uint32_t>(a.loop);
    s.signal_offset = a.signal_offset ? 1 : 0;
    s.forgetting = static_cast<std::uint32_t>(a.adaptation.forgetting);
    s.start_variance = a.adaptation.start_variance;
    s.smallest_factor = a.adaptation.smallest_factor;
    s.noise_variance = a.adaptation.noise_variance;
    s.largest_variance = a.adaptation.largest_variance;
    s.smallest_variance = a.adaptation.smallest_variance;
    s.start_deviation = a.start_deviation;
    s.order = 3;
    s.load_torque = a.load_torque ? 1 : 0;
    s.row_every_samples = static_cast<std::uint32_t>(a.row_every_samples);
    s.spread_samples = static_cast<std::uint32_t>(a.spread_samples);
    s.has_excitation = a.has_excitation ? 1 : 0;
    for_each_number(s.criteria, a.criteria, [](double& to, const double& from) { to = from; });
    s.criteria.inside_lines = a.criteria.inside_lines ? 1 : 0;
    return s;
  }
  static expected<std::uint32_t> variant(const Settings& s) noexcept {
    const bool rigid = s.order == 1;
    switch (static_cast<AxisMethod>(type_of(s.head.kind))) {
      case AxisMethod::arx:
        return rigid ? 0U : 1U;
      case AxisMethod::output_error:
      case AxisMethod::prediction_error:
        return 2U;
      case AxisMethod::closed_loop:
      case AxisMethod::filtered_closed_loop:
      case AxisMethod::damped_closed_loop:
        return 3U;
      case AxisMethod::instrumental_variables:
        return rigid ? 4U : 5U;
      case AxisMethod::physical:
        return 6U;
      case AxisMethod::lines:
        return 7U;
      case AxisMethod::sliding_dft:
        return 8U;
      case AxisMethod::chirp:
        break;
    }
    return 9U;
  }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    using Make = expected<void> (*)(void*, std::uint32_t, const Settings&) noexcept;
    static constexpr Make kMake[] = {&make<online::AxisArx<double, 1>>,
                                     &make<online::AxisArx<>>,
                                     &make<online::AxisOutputError<>>,
                                     &make<online::AxisClosedLoop<>>,
                                     &make<online::AxisInstrumental<double, 1>>,
                                     &make<online::AxisInstrumental<>>,
                                     &make<online::AxisPhysical<>>,
                                     &make<online::AxisLines<>>,
                                     &make<online::AxisSlidingDft<>>,
                                     &make<online::AxisSweep<>>};
    static_assert(std::size(kMake) == kCount);
    return kMake[variant](memory, variant, s);
  }
  template <class T>
  static void step(T& axis, double ru, double u, double y) noexcept {
    axis.step({ru, u, y});
  }
  template <class T>
  static void results(const T& axis, Results& r) noexcept {
    const online::AxisResult& known = axis.result();
    const online::AxisRow& row = known.row;
    r.samples = known.samples;
    r.skipped_samples = known.skipped_samples;
    r.rows = known.counts.rows;
    r.trusted_rows = known.counts.all;
    r.row_sample = row.sample;
    r.trusted = row.trusted ? 1 : 0;
    r.verdict = static_cast<std::uint32_t>(row.verdict);
    r.gates = bits(row.gates);
    r.has_model = axis.has_model() ? 1 : 0;
    r.lag_samples = row.lag_samples;
    for (std::size_t i = 0; i < online::kAxisParameters; ++i) r.parameter[i] = plain(row.parameter[i]);
    r.resonance_hz = plain(row.resonance_hz);
    r.antiresonance_hz = plain(row.antiresonance_hz);
    r.resonance_damping = row.resonance_damping;
    r.antiresonance_damping = row.antiresonance_damping;
    r.driven_inertia = row.driven_inertia;
    r.load_inertia = row.load_inertia;
    r.stiffness = row.stiffness;
    r.crossover_hz = plain(row.crossover_hz);
    r.phase_margin_deg = plain(row.phase_margin_deg);
    r.modulus_margin = plain(row.modulus_margin);
    r.gap = plain(row.gap);
    r.worst_phase_margin_deg = row.worst_phase_margin_deg;
    r.modulus_margin_hz = row.modulus_margin_hz;
    r.gain_margin_db = row.gain_margin_db;
    r.gain_margin_hz = row.gain_margin_hz;
    r.coherence = row.coherence;
    r.residual_rms = row.residual_rms;
    r.uncertainty = row.uncertainty;
    r.most_uncertainty = row.most_uncertainty;
    r.controller_difference = row.controller_difference;
    r.controller_differs = row.controller_differs ? 1 : 0;
    r.changed = known.changed ? 1 : 0;
    r.change_time_s = known.change.time_s;
    r.change_detected_s = known.change.detected_s;
    r.change_size = known.change.size;
    r.change_size_std = known.change.size_std;
    r.lines = static_cast<std::uint32_t>(axis.lines());
    r.injecting = known.injecting ? 1 : 0;
    r.settled = known.settled ? 1 : 0;
    r.stop_reason = static_cast<std::uint32_t>(known.stop_reason);
  }

 private:
  static std::uint32_t bits(const AxisGates& g) noexcept {
    std::uint32_t open = 0;
    const auto gate = [&open](bool is_open, std::uint32_t bit) { open |= is_open ? bit : 0U; };
    gate(g.ready, RESONID_GATE_READY);
    gate(g.excited, RESONID_GATE_EXCITED);
    gate(g.converged, RESONID_GATE_CONVERGED);
    gate(g.physical, RESONID_GATE_PHYSICAL);
    gate(g.residual, RESONID_GATE_RESIDUAL);
    gate(g.complete, RESONID_GATE_COMPLETE);
    gate(g.covered, RESONID_GATE_COVERED);
    return open;
  }
  static expected<void> enumerators(const Settings& s, AxisConfig& a) noexcept {
    const auto output = enumerator("output", s.output, AxisOutput::acceleration);
    if (!output) return unexpected<Error>(output.error());
    const auto approach = enumerator("approach", s.approach, Approach::joint);
    if (!approach) return unexpected<Error>(approach.error());
    const auto loop = enumerator("loop", s.loop, AxisLoop::measured);
    if (!loop) return unexpected<Error>(loop.error());
    const auto window = enumerator("window", s.window, online::DftWindow::hann);
    if (!window) return unexpected<Error>(window.error());
    const auto sweep = enumerator("sweep", s.sweep, online::Sweep::logarithmic);
    if (!sweep) return unexpected<Error>(sweep.error());
    const auto forgetting = enumerator("forgetting", s.forgetting, online::Forgetting::directional);
    if (!forgetting) return unexpected<Error>(forgetting.error());
    if (s.change_of > RESONID_FIGURE_GAP)
      return refuse("change_of", "must be one of its constants", static_cast<double>(s.change_of));
    a.output = *output;
    a.approach = *approach;
    a.loop = *loop;
    a.window = *window;
    a.sweep = {s.from_hz, s.to_hz, s.duration_s, *sweep};
    a.adaptation.forgetting = *forgetting;
    if (s.change_of != RESONID_FIGURE_NONE) a.change_of = static_cast<AxisFigure>(s.change_of - 1);
    return {};
  }
  static expected<AxisConfig> config_of(const Settings& s,
                                        std::span<std::complex<double>> baseline) noexcept {
    AxisConfig a;
    if (const auto fine = enumerators(s, a); !fine) return unexpected<Error>(fine.error());
    if (s.baseline_lines > baseline.size())
      return refuse("baseline_lines", "must be at most RESONID_AXIS_MAX_BASELINE", s.baseline_lines);
    a.sample_rate_hz = s.sample_rate_hz;
    a.method = static_cast<AxisMethod>(type_of(s.head.kind));
    a.known_delay_s = s.known_delay_s;
    a.controller_numerator = array(s.controller_numerator, s.controller_numerator_count);
    a.controller_denominator = array(s.controller_denominator, s.controller_denominator_count);
    a.controller_of_position = s.controller_of_position != 0;
    a.lines_hz = array(s.lines_hz, s.lines);
    a.window_samples = s.window_samples;
    a.signal_offset = s.signal_offset != 0;
    if (s.lambda != 0.0) a.lambda = s.lambda;
    if (s.pole_radius != 0.0) a.pole_radius = s.pole_radius;
    a.averaged_memories = s.averaged_memories;
    a.memory_s = s.memory_s;
    a.adaptation.start_variance = s.start_variance;
    a.adaptation.smallest_factor = s.smallest_factor;
    a.adaptation.noise_variance = s.noise_variance;
    a.adaptation.largest_variance = s.largest_variance;
    a.adaptation.smallest_variance = s.smallest_variance;
    a.extrapolate = s.extrapolate != 0;
    a.start_deviation = s.start_deviation;
    a.high_pass_hz = s.high_pass_hz;
    a.start_b = array(s.start_b, s.order);
    a.start_a = array(s.start_a, s.order);
    a.load_torque = s.load_torque != 0;
    a.coulomb_friction = s.coulomb != 0;
    a.row_every_samples = s.row_every_samples;
    a.spread_samples = s.spread_samples;
    a.loop_from_hz = s.loop_from_hz;
    a.baseline_b = array(s.baseline_b, s.baseline_order);
    a.baseline_a = array(s.baseline_a, s.baseline_order);
    a.baseline_hz = array(s.baseline_hz, s.baseline_lines);
    const auto response = array(s.baseline_response, s.baseline_lines);
    for (std::size_t i = 0; i < response.size(); ++i) baseline[i] = {response[i].re, response[i].im};
    a.baseline_response = baseline.first(response.size());
    a.criteria = criteria_of(s.criteria);
    a.centre_hz = s.centre_hz;
    a.has_excitation = s.has_excitation != 0;
    a.injects = s.injects != 0;
    if (a.method == AxisMethod::physical) {
      const auto physical = inner<PhysicalDefaults>("physical", s.physical);
      if (!physical) return unexpected<Error>(physical.error());
      a.physical = physical_config(*physical);
    }
    if (a.change_of) {
      const auto change = inner<ChangeDefaults>("change", s.change);
      if (!change) return unexpected<Error>(change.error());
      a.change = change_config(*change);
    }
    return a;
  }
  /// In place: an axis is too large for many a stack. What is refused leaves no handle.
  template <class Estimator>
  [[gnu::noinline]] static expected<void> make(void* memory, std::uint32_t variant,
                                               const Settings& s) noexcept {
    using T = Axis<Estimator>;
    std::array<std::complex<double>, RESONID_AXIS_MAX_BASELINE> baseline;
    const auto config = config_of(s, baseline);
    if (!config) return unexpected<Error>(config.error());
    std::memset(memory, 0, handle_size<T>());
    if (const auto made = T::create_in(static_cast<unsigned char*>(memory) + sizeof(Header), *config); !made)
      return unexpected<Error>(made.error());
    ::new (memory) Header{kHandle, kVersion, s.head.kind, variant, handle_size<T>(), 0, {}};
    return {};
  }
};

}  // namespace

const Family kAxis = FamilyOf<Axes>::kFamily;

resonid_status stop_axis(resonid_handle* handle) noexcept {
  return Axes::visit(handle, [](auto& axis) { axis.stop(); });
}

}  // namespace resonid::c

using resonid::c::Axes;
using resonid::c::fail;

resonid_status resonid_axis_step(resonid_handle* axis, double ru, double u, double y,
                                 uint32_t* row) noexcept {
  if (row == nullptr) return RESONID_ERROR_NULL;
  return Axes::visit(axis, [&](auto& a) { *row = a.step({ru, u, y}) ? 1 : 0; });
}

resonid_status resonid_axis_run(resonid_handle* axis, const double* ru, const double* u, const double* y,
                                size_t count, size_t* taken, uint32_t* row) noexcept {
  if (taken == nullptr || row == nullptr) return RESONID_ERROR_NULL;
  if (count > 0 && (u == nullptr || y == nullptr)) return RESONID_ERROR_NULL;
  return Axes::visit(axis, [&](auto& a) {
    *row = 0;
    for (*taken = 0; *taken < count && *row == 0; ++*taken)
      *row = a.step({ru != nullptr ? ru[*taken] : 0.0, u[*taken], y[*taken]}) ? 1 : 0;
  });
}

resonid_status resonid_axis_start(resonid_handle* axis, uint32_t inject, double sweep_s,
                                  const resonid_guard_settings* guard, resonid_error* error) noexcept {
  return Axes::visit(axis, [&](auto& a) -> resonid_status {
    if (guard == nullptr) return resonid::c::fail_null(error, "guard");
    const auto kind = resonid::c::enumerator("inject", inject, resonid::online::AxisInjection::Kind::given);
    if (!kind) return fail(error, kind.error());
    resonid_guard_settings taken;
    if (const auto status = resonid::c::take<resonid::c::GuardDefaults>(&guard->head, taken, error))
      return status;
    const auto limits = resonid::c::guard_config(taken);
    if (!limits) return fail(error, limits.error());
    const auto started = a.start({*kind, sweep_s, *limits});
    return started ? RESONID_OK : fail(error, started.error());
  });
}

resonid_status resonid_axis_excite(resonid_handle* axis, double torque, double velocity, double position,
                                   double given, double* injected) noexcept {
  if (injected == nullptr) return RESONID_ERROR_NULL;
  *injected = 0.0;  // whatever is wrong, nothing is injected
  return Axes::visit(axis, [&](auto& a) { *injected = a.excite({torque, velocity, position}, given); });
}

resonid_status resonid_axis_line(const resonid_handle* axis, uint32_t line, resonid_axis_line_info* info,
                                 size_t struct_size) noexcept {
  resonid_axis_line_info found{};
  const resonid_status status = Axes::visit(axis, [&](const auto& a) -> resonid_status {
    if (line >= a.lines()) return RESONID_ERROR_RANGE;
    const auto l = a.line(line);
    found.settled = l.settled ? 1 : 0;
    found.frequency_hz = l.frequency_hz;
    found.response = {l.response.real(), l.response.imag()};
    found.standard_deviation = l.std;
    return RESONID_OK;
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}

resonid_status resonid_axis_response(const resonid_handle* axis, double frequency_hz,
                                     resonid_complex* response) noexcept {
  if (response == nullptr) return RESONID_ERROR_NULL;
  return Axes::visit(axis, [&](const auto& a) {
    const auto g = a.response(frequency_hz);
    *response = {g.real(), g.imag()};
  });
}

resonid_status resonid_axis_set_loop(resonid_handle* axis, const double* numerator, size_t numerator_count,
                                     const double* denominator, size_t denominator_count,
                                     uint32_t of_position, uint32_t loop, double known_delay_s,
                                     resonid_error* error) noexcept {
  return Axes::visit(axis, [&](auto& a) -> resonid_status {
    const auto from = resonid::c::enumerator("loop", loop, resonid::online::AxisLoop::measured);
    if (!from) return fail(error, from.error());
    if (!(known_delay_s >= 0.0) || !std::isfinite(known_delay_s))
      return fail(error, RESONID_ERROR_SETTINGS, "known_delay_s", "must be >= 0", known_delay_s);
    const auto controller = resonid::online::AxisController::create(
        resonid::c::array(numerator, numerator_count), resonid::c::array(denominator, denominator_count),
        of_position != 0);
    if (!controller) return fail(error, controller.error());
    a.set_loop(*controller, *from, known_delay_s);
    return RESONID_OK;
  });
}

resonid_status resonid_axis_set_criteria(resonid_handle* axis,
                                         const resonid_axis_criteria* criteria) noexcept {
  if (criteria == nullptr) return RESONID_ERROR_NULL;
  return Axes::visit(axis, [&](auto& a) { a.set_criteria(resonid::c::criteria_of(*criteria)); });
}

const char* resonid_axis_parameter_name(const resonid_handle* axis, uint32_t i) noexcept {
  std::string_view name;
  const auto status = Axes::visit(axis, [&](const auto& a) { name = a.parameter_name(i); });
  return status == RESONID_OK && !name.empty() ? name.data() : "";  // of literals
}

const char* resonid_verdict_string(uint32_t verdict) noexcept {
  const auto names = enum_names(resonid::online::AxisVerdict{});
  return verdict < names.size() ? names[verdict].name.data() : "unknown";  // of literals
}
