// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/track/axis_setup.hpp>
#include <identification/track/stiffness_drift.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/response/periodic_averaging.hpp>

namespace resonid::identification::detail {
namespace {

using online::AxisConfig;
using online::AxisMethod;

constexpr std::size_t kMostLines = 256;
constexpr double kPeriodsRemembered = 24.0;  // of the resonance, by recursive least squares
constexpr double kPeriodsOfVariables = 6.0;  // the same of instrumental variables
constexpr double kPeriodsOfPhysical = 4.0;   // the same of the physical tracker
constexpr double kPeriodsOfLongTerm = 30.0;  // the same over hours, kLongTerm_s at least
constexpr double kLongTerm_s = 2.0;
constexpr double kNoiseMemory_s = 100.0;
constexpr double kLoadDrift = 0.02;        // of the largest torque, in a second
constexpr double kFrictionShare = 0.3;     // of the largest torque: how much of it friction may take
constexpr double kStartDeviations = 10.0;  // of a start's own: how far off it may be

/// The engine's method has the same name; automatic is chosen before.
constexpr std::optional<AxisMethod> same_name(TrackMethod method) {
  return from_name<AxisMethod>(name_of(method));
}
static_assert(std::ranges::all_of(kTrackMethodNames, [](const auto& known) {
  return same_name(known.value).has_value() == (known.value != TrackMethod::automatic);
}));

AxisMethod method_of(const TrackPlan& plan) {
  const bool follows_chirp = plan.method == TrackMethod::kalman && plan.measurement.sweep;
  return follows_chirp ? AxisMethod::chirp : *same_name(plan.method);
}

online::AxisOutput output_of(data::OutputQuantity quantity) {
  switch (quantity) {
    case data::OutputQuantity::position:
      return online::AxisOutput::position;
    case data::OutputQuantity::acceleration:
      return online::AxisOutput::acceleration;
    case data::OutputQuantity::velocity:
      break;
  }
  return online::AxisOutput::velocity;
}

double largest_of(const std::vector<double>& x) {
  double largest = 0.0;
  for (const double v : x) largest = std::max(largest, std::abs(v));
  return largest;
}

double fastest_of(const data::Record& stretch) {
  const auto& y = stretch.output.samples;
  if (stretch.output_quantity == data::OutputQuantity::velocity) return std::max(1e-12, largest_of(y));
  double fastest = 1e-12;
  for (std::size_t k = 1; k < y.size(); ++k) fastest = std::max(fastest, std::abs(y[k] - y[k - 1]));
  return fastest * stretch.sample_rate_hz;
}

/// How far off the start may be: ten times what its own covariance says, and at least as far as a machine
/// changes. The tracker is ready once it knows twice as much: of the damping, which warmth and wear move most
/// and a record tells least, no more must be asked than the record can tell.
online::StartingValue starting(const fit::DriveModel& drive, fit::Parameter parameter) {
  const double least = parameter == fit::kDamping ? 0.3 : 0.1;
  const auto e = drive.estimate(parameter);
  return {e.value, std::clamp(kStartDeviations * e.std / std::max(e.value, 1e-300), least, 1.0)};
}

void set_physical(const data::Record& stretch, const TrackOptions& options, const TrackPlan& plan,
                  AxisSetup& setup) {
  const auto& drive = plan.start->drive;
  auto& p = setup.config.physical;
  p.driven_inertia = starting(drive, fit::kDrivenInertia);
  p.load_inertia = starting(drive, fit::kLoadInertia);
  p.stiffness = starting(drive, fit::kStiffness);
  p.damping = starting(drive, fit::kDamping);
  const double largest = std::max(largest_of(stretch.input.samples), 1e-12);
  const auto viscous = drive.estimate(fit::kViscousFriction);
  p.viscous_friction_nms_rad.value = drive.parameters.viscous_friction;
  // What a start found is not known: held, it would stand in every margin, and in none of their bars.
  if (drive.estimated[fit::kViscousFriction] && std::isfinite(viscous.std))
    p.viscous_friction_nms_rad.std = kStartDeviations * viscous.std;
  if (options.common.friction == Friction::viscous || options.common.friction == Friction::both)
    p.viscous_friction_nms_rad.std = kFrictionShare * largest / fastest_of(stretch);
  if (setup.config.coulomb_friction) p.coulomb_friction_nm.std = kFrictionShare * largest;
  p.torque_offset_std_nm = largest;
  p.torque_offset_drift_nm_rt_s = 0.002 * largest;
  p.at_best_known_time = true;  // rows tell the time that they describe
  p.memory_s = options.memory_s;
  const bool moves = drift_follows_position(stretch, options, plan) || options.drift_per_s;
  if (options.long_term && !moves) {
    if (!(p.memory_s > 0.0)) p.memory_s = std::max(kLongTerm_s, kPeriodsOfLongTerm / drive.resonance().value);
  } else if (!(p.memory_s > 0.0) || moves) {
    p.stiffness_drift_per_s = first_drift(stretch, options, plan);
  }
  if (options.long_term) {
    p.noise_memory_s = kNoiseMemory_s;
    p.torque_offset_drift_nm_rt_s =
        kLoadDrift * largest;  // small steps of the load are none of the parameters'
  }
  setup.memory_s = p.memory_s > 0.0 ? p.memory_s : kPeriodsOfPhysical / drive.resonance().value;
}

void set_discrete(const data::Record& stretch, const TrackOptions& options, const TrackPlan& plan,
                  AxisSetup& setup) {
  fit::DriveModel drive = plan.start->drive;
  drive.sample_time_s = stretch.sample_time_s();
  const auto g = drive.transfer_function();
  const std::size_t order = drive.structure == fit::Structure::rigid ? 1 : 3;
  for (std::size_t i = 1; i <= order; ++i) {
    setup.start_b.push_back(i < g.numerator.size() ? g.numerator[i] : 0.0);
    setup.start_a.push_back(i < g.denominator.size() ? g.denominator[i] : 0.0);
  }
  setup.config.adaptation.forgetting = options.forgetting;
  setup.config.extrapolate = options.extrapolate;
  const double own = stretch.output_quantity == data::OutputQuantity::position ? 0.5 : 0.0;
  const double delay = plan.delay_s * stretch.sample_rate_hz + own;
  setup.fractional_delay = delay - std::round(delay);
  const double periods =
      plan.method == TrackMethod::instrumental_variables ? kPeriodsOfVariables : kPeriodsRemembered;
  if (order > 1) setup.memory_s = periods / drive.resonance().value;
}

expected<void, Error> set_lines(const data::Record& stretch, const TrackOptions& options,
                                const TrackPlan& plan, AxisSetup& setup) {
  auto& c = setup.config;
  const auto& m = plan.measurement;
  c.approach = plan.approach;
  c.signal_offset = options.common.tracker.offset;
  c.lambda = options.common.tracker.lambda;
  c.pole_radius = options.common.tracker.pole_radius;
  c.known_delay_s = options.common.delay_s;
  if (c.method == AxisMethod::chirp) return {};
  setup.lines_hz = m.grid_hz;
  if (setup.lines_hz.empty()) {
    if (m.period_samples == 0)
      return tl::unexpected(Error{"lines_hz", "must be given: the excitation shows no period"});
    setup.lines_hz = excited_lines_hz(stretch, plan, options.common);
    if (setup.lines_hz.empty())
      return tl::unexpected(Error{"lines_hz", "must be given: the excitation shows none"});
  }
  if (setup.lines_hz.size() > kMostLines)
    return tl::unexpected(
        Error{"lines_hz", fmt::format("must be given: the excitation has {} lines, {} at most can be tracked",
                                      setup.lines_hz.size(), kMostLines)});
  if (c.method != AxisMethod::sliding_dft) return {};
  // Two periods unless told otherwise: no line then stands beside another one, and a Hann window takes out
  // what a machine that changes spreads between them.
  auto window = static_cast<std::size_t>(std::llround(options.memory_s * stretch.sample_rate_hz));
  const std::size_t period = m.period_samples;
  if (period > 0)
    window = window == 0 ? 2 * period : std::max<std::size_t>(1, (window + period / 2) / period) * period;
  if (window == 0)
    return tl::unexpected(
        Error{"memory_s", "must be given: the excitation shows no period to be the window"});
  c.window_samples = window;
  if (period > 0 && window >= 2 * period) c.window = online::DftWindow::hann;
  setup.memory_s = static_cast<double>(window) / stretch.sample_rate_hz;
  return {};
}

/// What the gap is to, over the band in which the baseline was measured.
void set_baseline(const data::Record& stretch, const TrackOptions& options, AxisSetup& setup) {
  if (!options.baseline) return;
  constexpr std::size_t kPoints = 1000;
  const auto& response = options.baseline->response;
  if (!options.baseline->model) {
    const std::size_t stride = (response.lines() + kPoints - 1) / kPoints;
    for (std::size_t i = 0; i < response.lines(); i += stride) {
      setup.baseline_hz.push_back(response.frequency_hz[i]);
      setup.baseline.push_back(response.value[i]);
    }
    return;
  }
  auto drive = options.baseline->model->drive;
  drive.sample_time_s = stretch.sample_time_s();
  const auto model = drive.transfer_function();
  const double nyquist = 0.5 * stretch.sample_rate_hz;
  const double low = response.lines() > 0 ? response.frequency_hz.front() : 0.001 * nyquist;
  const double high =
      response.lines() > 0 ? std::min(response.frequency_hz.back(), nyquist) : 0.998 * nyquist;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double f = low * std::pow(high / low, static_cast<double>(i) / static_cast<double>(kPoints - 1));
    setup.baseline_hz.push_back(f);
    setup.baseline.push_back(model.response(f));
  }
}

void set_change(const TrackOptions& options, AxisSetup& setup) {
  if (!options.change_of) return;
  constexpr double kBlocks = 16.0;
  auto& c = setup.config;
  c.change_of = options.change_of;
  c.change.block_s = change_block_s(options, setup);
  c.change.baseline_s = kBlocks * c.change.block_s;
  c.change.false_alarm_interval_s = options.false_alarm_interval_s;
}

/// Where excitation is looked for.
double centre_hz(const data::Record& stretch, const TrackPlan& plan) {
  if (plan.start && plan.start->drive.structure == fit::Structure::two_mass)
    return plan.start->drive.resonance().value;
  const auto& m = plan.measurement;
  return m.low_hz > 0.0 ? std::sqrt(m.low_hz * m.high_hz) : 0.1 * stretch.sample_rate_hz;
}

}  // namespace

double change_block_s(const TrackOptions& options, const AxisSetup& setup) {
  constexpr double kShortest = 0.25, kRows = 4.0;
  const double row_s = static_cast<double>(options.every) / setup.config.sample_rate_hz;
  const double memory = options.memory_s > 0.0 ? options.memory_s : setup.memory_s;
  const bool forgets = setup.config.method == AxisMethod::physical && setup.config.physical.memory_s > 0.0;
  return std::max({kShortest, (forgets ? 0.5 : 2.0) * memory, kRows * row_s});
}

std::vector<double> excited_lines_hz(const data::Record& stretch, const TrackPlan& plan,
                                     const Options& options) {
  response::PeriodicConfig config;
  config.period_samples = plan.measurement.period_samples;
  if (options.band_hz) {
    config.band_low_hz = plan.measurement.low_hz;
    config.band_high_hz = plan.measurement.high_hz;
  }
  std::vector<double> lines;
  if (const auto found = response::periodic_lines(stretch, config, plan.approach))
    for (const auto& line : found->lines) lines.push_back(line.frequency_hz);
  return lines;
}

expected<std::unique_ptr<AxisSetup>, Error> axis_setup(const data::Record& stretch,
                                                       const TrackOptions& options, const TrackPlan& plan) {
  auto setup = std::make_unique<AxisSetup>();
  AxisConfig& c = setup->config;
  c.sample_rate_hz = stretch.sample_rate_hz;
  c.method = method_of(plan);
  c.output = output_of(stretch.output_quantity);
  c.known_delay_s = std::max(0.0, plan.delay_s);
  c.memory_s = options.memory_s;
  c.row_every_samples = options.every;
  c.centre_hz = centre_hz(stretch, plan);
  c.has_excitation = stretch.excitation.present();
  if (plan.measurement.sweep) c.sweep = *plan.measurement.sweep;
  c.coulomb_friction = estimates_dry_friction(options);
  if (options.common.controller) {
    setup->numerator = options.common.controller->numerator;
    setup->denominator = options.common.controller->denominator;
  }
  const bool two_masses = plan.start && plan.start->drive.structure == fit::Structure::two_mass;
  const auto needs = [&](const char* what) {
    return tl::unexpected(
        Error{"method", fmt::format("{} needs {} as initial model, and the recording shows none: give .start",
                                    name_of(plan.method), what)});
  };
  if (is_lines(plan.method)) {
    if (auto set = set_lines(stretch, options, plan, *setup); !set) return tl::unexpected(set.error());
  } else if (!two_masses && !follows_rigid(plan.method)) {
    return needs("a two-mass model");
  } else if (plan.method == TrackMethod::physical) {
    set_physical(stretch, options, plan, *setup);
  } else {
    set_discrete(stretch, options, plan, *setup);
  }
  set_baseline(stretch, options, *setup);
  set_change(options, *setup);
  setup->point();
  return setup;
}

void AxisSetup::point() {
  config.controller_numerator = numerator;
  config.controller_denominator = denominator;
  config.lines_hz = lines_hz;
  config.start_b = start_b;
  config.start_a = start_a;
  config.baseline_hz = baseline_hz;
  config.baseline_response = baseline;
}

void AxisSetup::save(ByteWriter& to) const {
  AxisConfig plain = config;  // addresses would make each run's bytes others
  plain.controller_numerator = plain.controller_denominator = plain.lines_hz = plain.start_b = plain.start_a =
      plain.baseline_hz = {};
  plain.baseline_response = {};
  to.put(plain);
  for (const auto* list : {&lines_hz, &numerator, &denominator, &start_b, &start_a, &baseline_hz})
    to.put(*list);
  to.put(baseline);
  to.put(memory_s);
  to.put(fractional_delay);
}

std::unique_ptr<AxisSetup> AxisSetup::restored(ByteReader& from) {
  auto setup = std::make_unique<AxisSetup>();
  from.get(setup->config);
  for (auto* list : {&setup->lines_hz, &setup->numerator, &setup->denominator, &setup->start_b,
                     &setup->start_a, &setup->baseline_hz})
    from.get(*list);
  from.get(setup->baseline);
  from.get(setup->memory_s);
  from.get(setup->fractional_delay);
  if (!from.ok() || !positive(setup->config.sample_rate_hz)) return nullptr;
  setup->point();
  return setup;
}

namespace {

/// The field of TrackOptions that one of the engine comes from.
const char* field_of(std::string_view field) {
  struct Name {
    std::string_view field;
    const char* ours;
  };
  constexpr Name kNames[] = {{"controller", "controller"},  {"numerator", "controller"},
                             {"denominator", "controller"}, {"pole_radius", "pole_radius"},
                             {"lambda", "lambda"},          {"window", "memory_s"},
                             {"memory", "memory_s"},        {"lines", "lines_hz"},
                             {"frequency", "lines_hz"},     {"sweep", "chirp"},
                             {"from_hz", "chirp"},          {"to_hz", "chirp"},
                             {"baseline", "baseline"},      {"change", "change_of"},
                             {"block", "change_of"},        {"false_alarm", "false_alarm_interval_s"},
                             {"delay", "delay_s"}};
  const auto* found = std::ranges::find_if(kNames, [&](const Name& n) { return field.starts_with(n.field); });
  return found == std::end(kNames) ? "method" : found->ours;
}

}  // namespace

AxisPointer axis_memory() {
  std::size_t space = sizeof(online::Axis) + alignof(online::Axis);
  void* block = std::calloc(1, space);
  if (block == nullptr) throw std::bad_alloc();
  void* place = block;
  std::align(alignof(online::Axis), sizeof(online::Axis), place, space);
  return {static_cast<online::Axis*>(place), FreeAxis{block}};
}

expected<AxisPointer, Error> make_axis(const AxisSetup& setup, const TrackPlan& plan) {
  auto axis = axis_memory();
  const auto made = online::Axis::create_in(axis.get(), setup.config);
  if (made) return axis;
  const Error& e = made.error();
  if (e.field == "start_b")  // it has the right size: what is left to be refused is its loop
    return tl::unexpected(
        Error{"controller", fmt::format("{}: the loop of the initial model and this controller is "
                                        "unstable: controller, delay or sign do not belong to "
                                        "this recording",
                                        name_of(plan.method))});
  std::string message = fmt::format("{}: {} {}", name_of(plan.method), e.field.view(), e.requirement.view());
  if (std::isfinite(e.value)) message += fmt::format(" (found {:.6g})", e.value);
  return tl::unexpected(Error{field_of(e.field), std::move(message)});
}

}  // namespace resonid::identification::detail
