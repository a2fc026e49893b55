// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstdint>
#include <functional>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/controller.hpp>
#include <resonid/design/detail/bounds.hpp>
#include <resonid/design/detail/filtered_pi.hpp>
#include <resonid/design/detail/loop_figures.hpp>
#include <resonid/design/detail/trade_off.hpp>
#include <resonid/identification/result.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::plant {
struct ExperimentConfig;
}

namespace resonid::identification {

struct Track;

/// What a controller is made of.
enum class ControllerStructure {
  automatic,      ///< PI, and PI with biquads: the one with the least error of the load.
  pi,             ///< Exactly the best one under the bounds.
  p,              ///< Without an integral part: exactly the largest gain under the bounds.
  cascade,        ///< Position gain over PI.
  pi_biquads,     ///< PI with notches, leads or low-passes.
  pid,            ///< PI with a filtered derivative.
  rst,            ///< By pole placement.
  state_feedback  ///< With a Kalman filter that observes the load and its torque.
};
inline constexpr EnumName<ControllerStructure> kControllerStructureNames[] = {
    {ControllerStructure::automatic, "auto"},
    {ControllerStructure::pi, "pi"},
    {ControllerStructure::p, "p"},
    {ControllerStructure::cascade, "cascade"},
    {ControllerStructure::pi_biquads, "pi+biquads"},
    {ControllerStructure::pid, "pid"},
    {ControllerStructure::rst, "rst"},
    {ControllerStructure::state_feedback, "state-feedback"}};
[[nodiscard]] constexpr std::span<const EnumName<ControllerStructure>> enum_names(
    ControllerStructure) noexcept {
  return kControllerStructureNames;
}

using design::Guarantee;

/// What is wanted of the controller. The defaults are those of docs/methods/tune.md 5.1: calm.
struct TuneOptions {
  ControllerStructure structure = ControllerStructure::automatic;
  double largest_sensitivity = 1.4;    ///< Bound on |S|, > 1.
  double largest_load_transfer = 1.3;  ///< Bound on |T_load|, > 1; infinite: none.
  /// On |position of the load by its reference| of a cascade, > 1, in place of the bound on |T_load|.
  double largest_position_transfer = 1.05;
  std::optional<double> largest_complementary;
  /// On |C S|, Nm/(rad/s). Absent: filters may have twice that of the best PI.
  std::optional<double> largest_controller_sensitivity;
  std::size_t biquads = 1;                     ///< 1 ... 4
  std::optional<double> least_bandwidth_hz;    ///< The load's, for every machine that may be.
  std::optional<double> torque_limit;          ///< The drive's, in the unit of torque.
  std::optional<double> largest_noise_torque;  ///< Rms of the torque that measurement noise makes.
  double reference_step = 1.0;                 ///< What of velocity is stepped for figures of the reference.
  double overshoot = 0.02;   ///< The load's after that step, part of it, for the set-point weight.
  double confidence = 0.95;  ///< Inside (0, 1).
  Guarantee guarantee = Guarantee::probability;
  /// Standard deviation of the delay. Absent: that of the result, or a quarter of a sample where it has none.
  std::optional<double> delay_std_s;
  /// A controller that is judged in place of designing one.
  std::optional<data::Controller> evaluate;
  /// From reference to torque by the denominator of `evaluate`, where that is not its numerator.
  std::vector<double> evaluate_reference;
  /// kv of `evaluate`, 1/s, where that is a position loop over a PI, C (1 + kv q): it is judged as a cascade,
  /// and the bound of |T_load| is that of the position, 1.05.
  std::optional<double> evaluate_position_gain;
  /// The controller under which was recorded: shown beside the one that is proposed.
  std::optional<data::Controller> running;
  std::vector<double> running_reference;        ///< T of `running`, as of `evaluate`.
  std::optional<double> running_position_gain;  ///< kv of `running`, as of `evaluate`.
  /// Positions of the results, ascending: gains are scheduled over them.
  std::vector<double> positions;
  std::optional<double> largest_speed;  ///< Largest one of the position along them, in their unit per s.
  bool shaper = false;                  ///< Also choose an input shaper for the loop.
  double shaper_limit = 0.05;           ///< Residual vibration that it may leave.
  bool force = false;                   ///< Also of results that are not trusted; every output says so.
  std::size_t draws = 10'000;           ///< Machines that the confidence is counted on.
  std::uint64_t seed = 1;
  std::function<void(std::string_view)> progress = {};
};

/// One figure of a loop: of the identified machine, and of the machines that may be.
struct LoopFigure {
  std::string name;  ///< As in JSON: "sensitivity_peak", "phase_margin_deg".
  std::string unit;
  double value = 0.0;
  std::optional<double> frequency_hz;  ///< Where a maximum over frequency is.
  std::optional<double> low, high;     ///< Central 95 % over the posterior.
  std::optional<double> worst;         ///< Over the ellipsoid that the design was made for.
  std::optional<double> bound;
  std::optional<double> probability;  ///< That the bound is exceeded.
};

/// |L| = 1 of the identified machine, and of the machines that may be, where their loops cross 1 there too.
struct TunedCrossing : design::Crossing {
  /// Central 95 % over the posterior; of the phase margin on the turn of its value.
  std::optional<double> frequency_low_hz = {}, frequency_high_hz = {};
  std::optional<double> phase_margin_low_deg = {}, phase_margin_high_deg = {};
  std::optional<double> phase_margin_worst_deg = {};  ///< Least size, as LoopFigure::worst.
};

/// A real function of frequency or time, and in between which values 95 % of the machines that may be lie.
struct Band {
  std::vector<double> value, low, high;
};

/// What a loop looks like.
struct LoopCurves {
  std::vector<double> frequency_hz;
  std::vector<std::complex<double>> loop;  ///< L of the identified machine.
  Band loop_size, loop_phase_deg, sensitivity, complementary, load_transfer;
  /// L at key frequencies of the machines that may be: covariance of (real, imaginary).
  struct Ellipse {
    double frequency_hz = 0.0;
    std::complex<double> value;
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  };
  std::vector<Ellipse> ellipses;
  std::vector<double> time_s;
  Band load_by_reference;    ///< Velocity of the load after the reference step.
  Band torque_by_reference;  ///< Torque meanwhile.
  Band load_by_torque;       ///< Velocity of the load after a torque step of 1 on it.
};

/// What a position loop adds to its torque by the reference, of the identified machine
/// (docs/methods/tune.md 8.3): inertia times its acceleration, friction by its velocity.
struct TunedFeedForward {
  double inertia = 0.0;  ///< The whole.
  double viscous = 0.0;  ///< Friction of all sides, torque per velocity.
  double coulomb = 0.0;  ///< In the direction of the velocity.
  double delay_s = 0.0;  ///< By which the feedback is given position and velocity of the reference later.
};

/// A state of the machine that a state feedback estimates, and what it takes of it: torque = -sum of gain
/// times estimated state.
struct TunedState {
  std::string name, unit;      ///< "velocity of the load", "load torque"; "rad/s".
  double gain = 0.0;           ///< Torque per unit of the state.
  double observer_gain = 0.0;  ///< By what the estimate is corrected per unit of velocity measured otherwise.
};

/// One controller, designed or given, and what it does.
struct TunedController {
  std::string structure;                    ///< Name of a ControllerStructure, "running" or "given".
  std::string name;                         ///< For people: "PI + 1 biquad".
  data::TransferFunction feedback;          ///< From velocity error to torque.
  std::optional<design::FilteredPi> gains;  ///< Where it is a PI with or without biquads.
  std::optional<double> position_gain;      ///< kv of a cascade, 1/s.
  std::optional<double> derivative_gain, derivative_time_s;  ///< A PID's, and its filter.
  std::optional<TunedFeedForward> feed_forward;              ///< A cascade's.
  double set_point_weight = 1.0;                             ///< b
  std::vector<double> reference_numerator;                   ///< T of u = (T r - R y)/S where it is not R.
  std::vector<TunedState> states;                            ///< A state feedback's, the load torque last.
  std::vector<LoopFigure> figures;
  std::vector<TunedCrossing> crossings;  ///< All, ascending.
  std::vector<design::ClosedLoopMode> modes;
  bool stable = false;  ///< On the identified machine.
  double spectral_radius = 0.0;
  std::size_t draws = 0, exceeding = 0, unstable = 0;  ///< Machines of the posterior.
  double radius = 0.0;              ///< The ellipsoid's over which the bounds are met, standard deviations.
  std::vector<std::string> limits;  ///< The bounds that keep the gains down, by names of figures.
  bool within = false;              ///< Every bound is met with the confidence that is wanted.
  std::string remark;               ///< Why it was not proposed.
  LoopCurves curves;

  [[nodiscard]] double probability() const {
    return draws == 0 ? 0.0 : static_cast<double>(exceeding) / static_cast<double>(draws);
  }
  [[nodiscard]] const LoopFigure* figure(std::string_view figure_name) const;
};

/// Gains over position.
struct TunedSchedule {
  struct Node {
    double position = 0.0, kp = 0.0, ki = 0.0;
    double radius = 0.0;  ///< That of the ellipsoid over which the bounds are met there, standard deviations.
  };
  std::vector<Node> nodes;
  std::vector<LoopFigure> figures;                 ///< Largest over the stroke, with the position fixed.
  double worst_position = 0.0;                     ///< Where machines exceed a bound most often.
  std::optional<double> fixed_iae, scheduled_iae;  ///< On a run, of one PI for all and of the schedule.
  bool within = false;  ///< All bounds are met with the confidence at every position.
  /// What of the machines of a position exceeds a bound.
  struct Place {
    double position = 0.0, probability = 0.0;
  };
  std::vector<Place> places;  ///< Every position that was looked at.
  double set_point_weight = 1.0;
  /// Up to which speed of the position a run does no more harm than a slow one, and the one up to which was
  /// looked; positions per s.
  std::optional<double> largest_speed, looked_speed;

  /// That a bound is exceeded, at the worst position.
  [[nodiscard]] double probability() const;
};

/// An input shaper for the closed loop.
struct TunedShaper {
  std::string kind;  ///< "zv", "mzv" ..., of two modes "zv+mzv".
  double duration_s = 0.0;
  double vibration = 0.0;  ///< That 95 % of the machines stay below, of that of an unshaped step.
  bool chosen = false;
  std::vector<double> amplitudes, times_s;
};

/// A figure of a run on a simulated machine beside what was promised of it.
struct SimulatedFigure {
  std::string name, unit;
  std::optional<double> promised;  ///< By the design, the linear loop of the identified machine.
  double simulated = 0.0;
};
struct SimulatedRun {
  std::string what;  ///< "reference step", "load step", "motion", "motion of the experiment".
  std::vector<double> time_s, reference, velocity, torque;
  std::vector<SimulatedFigure> figures;
};

/// What was promised of a figure, and what a recording under the new controller shows.
struct CheckedFigure {
  std::string name, unit;
  data::Estimate predicted, measured;
  std::optional<double> probability;  ///< That noise alone makes so large a difference.
};
struct TuningCheck {
  std::string record;
  std::vector<CheckedFigure> figures;
  std::vector<double> frequency_hz;                       ///< [line]
  std::vector<std::complex<double>> predicted, measured;  ///< [line] L
  std::vector<double> predicted_std, measured_std;        ///< [line] total, complex
  double probability = 1.0;                               ///< That noise makes so large a one at any line.
  double worst_line_hz = 0.0;    ///< The line that differs most surely; 0: none by more than matters.
  std::size_t judged_lines = 0;  ///< Those near the margins.
  bool agrees = true;
  /// Whether the recording is good enough to tell: if not, nothing is known to differ, nor to agree.
  bool decided = true;
  std::string cause;  ///< The likely one, where it does not.
  /// By how much the gain of the whole loop (a part of it) and its delay differ from what was promised, all
  /// judged lines together. Absent: too few lines.
  std::optional<data::Estimate> gain_change, delay_change_s;
  /// The least differences that 90 % of such recordings would show, for error bars of promise and recording.
  std::optional<double> detectable_gain, detectable_delay_s;
};

/// A controller for an identified drive, beside others, and what is known of them.
struct Tuning {
  std::vector<std::string> files;    ///< Names of the records that were identified.
  std::vector<std::string> results;  ///< Files of the results, where they come from files.
  Units units;
  double sample_time_s = 0.0;
  bool by_response = false;               ///< Designed by the lines of a response: there is no machine.
  std::vector<fit::DriveModel> machines;  ///< [result]
  double delay_std_s = 0.0;
  bool delay_std_assumed = false;  ///< A quarter of a sample, as the result tells none.
  TuneOptions options;
  /// What a scale of the recording makes of gains: drive units of torque and velocity per SI unit.
  double input_scale = 1.0, output_scale = 1.0;
  std::string input_unit, output_unit;      ///< Those drive units, "A" and "rpm"; empty: not told.
  std::vector<TunedController> candidates;  ///< The best first; the controller that is judged alone.
  std::optional<TunedController> running;   ///< Under which was recorded.
  std::optional<TunedController> nominal;   ///< The proposed structure, without regard to uncertainty.
  std::vector<design::TradeOff> over_sensitivity, over_load_transfer;
  std::vector<design::ExperimentValue> experiment;
  std::optional<TunedSchedule> schedule;
  std::vector<TunedShaper> shapers;                   ///< Ascending in duration.
  std::optional<design::ClosedLoopMode> shaped_mode;  ///< That they were made for.
  std::optional<design::ClosedLoopMode> second_shaped_mode;
  std::vector<SimulatedRun> simulated;
  std::optional<TuningCheck> check;  ///< By a recording under the proposed (or judged) controller.
  bool trusted = false;              ///< All results are, and the proposed controller is within the bounds.
  std::vector<diagnostics::Finding> findings;

  [[nodiscard]] const TunedController& proposed() const { return candidates.front(); }
  /// Whether a given controller was judged instead.
  [[nodiscard]] bool is_evaluation() const { return options.evaluate.has_value(); }
};

/// Designs a controller for the machine, or one that suits all machines, of these results, so that every
/// bound is met with the confidence that is wanted, whatever machine of the posterior it is
/// (docs/methods/tune.md). Refused (the error says what): results that are not trusted, without a drive model
/// or its covariance, of different rates or units; bounds that no controller meets, and which could be met; a
/// crossover outside the band that was identified.
[[nodiscard]] expected<Tuning, Error> tune(std::span<const Result> results, const TuneOptions& options = {});
[[nodiscard]] expected<Tuning, Error> tune(const Result& result, const TuneOptions& options = {});

/// What tune() takes for a gain schedule: a result for each of some positions, ascending.
struct ResultsOverPosition {
  std::vector<double> positions;  ///< In the unit of the rows' position: TuneOptions::positions.
  std::vector<Result> results;    ///< [position]
};

/// The machine over the position of its trusted rows, as a tracker of physical parameters gives them
/// (docs/methods/tune.md 12). Stretches of position are halved until no inertia, stiffness or damping changes
/// by more than 5 %, or than its error bars, within one. Each gives the result's model with the parameters
/// of a straight line through its rows, in logarithms, over position, and as their covariance the mean of
/// the rows' own plus the variance around that line: neither divided by the number of rows, since neighbours
/// rest on the same samples. What is not tracked stays as the result has it. The first and the last position
/// are those of the outermost rows.
///
/// Refused are rows without position or without the parameters of a two-mass drive, fewer than ten that are
/// trusted, rows at one position only, rows of another machine or other units (a total inertia off by a
/// factor of two), and gaps, or too few rows, over which a parameter changes by more than a
/// fifth.
[[nodiscard]] expected<ResultsOverPosition, Error> results_over_position(const Result& result,
                                                                         const Track& rows);

/// The identified machine as an experiment: its model, which must be there, with dry friction, lags, delay
/// and torque limit.
[[nodiscard]] plant::ExperimentConfig experiment_of(const Result& result, const TuneOptions& options);

/// Runs the proposed controller, and the running one, on the drive of an experiment: a reference step, a step
/// of the load's torque, and the motion of the experiment where it has one; without noise and excitation.
/// What the loop does there stands beside what was promised. A drive on which the loop is unstable is a
/// finding; anything else that the experiment does not allow is refused, and so is a design by a response.
[[nodiscard]] expected<void, Error> simulate_on(Tuning& tuning, const plant::ExperimentConfig& experiment);

/// The same on the identified machine; a model that cannot be simulated, or is not there, is a finding.
void simulate_on_model(Tuning& tuning, const Result& result);

/// Sets what was promised of the proposed (or judged) controller beside what a recording under it shows:
/// `measured` is the result of that recording, identified with the controller and an excitation,
/// `designed_for` the result that the controller was designed for. Lines are compared by L = Ru/U - 1 (of
/// methods that smooth over lines: by controller times response), each with the error bars of both sides;
/// margins likewise. Where they disagree the finding names the likely
/// cause, by what differs between both models: the delay, the gain, the stiffness, the load, another mode.
/// Refused: a result without excitation, of another sample time or other units; a design by a response, or
/// of a gain schedule, which is no one loop.
[[nodiscard]] expected<void, Error> check_on(Tuning& tuning, const Result& designed_for,
                                             const Result& measured);

/// For one controller for several results: the comparison with the machine that explains the recording best,
/// which the finding `checked-machine` names. `measured[i]` is the result of that recording, identified with
/// the delay of `designed_for[i]`.
[[nodiscard]] expected<void, Error> check_on(Tuning& tuning, std::span<const Result> designed_for,
                                             std::span<const Result> measured);

}  // namespace resonid::identification
