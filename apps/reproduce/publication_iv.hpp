// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <functional>
#include <reproduce/reproduction.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/plant/experiment.hpp>
#include <resonid/report/detail/document.hpp>
#include <string>
#include <vector>

#include "reproduce/spread.hpp"

/// The parts of Publication IV. What the paper leaves open (sample time, controller, noise) stands in the
/// files experiments/iv_*.toml.
namespace resonid::reproduction::iv {

inline constexpr double kLambda = 100.0;  ///< Of the bank, as printed.
inline constexpr std::size_t kLines = 8;  ///< 2.9 ... 23.9 Hz.
inline constexpr double kJudged = 20.0;   ///< Seconds at the end of a record that whole-period estimates see.

/// Told the part done, 0 ... 1, of a section's work.
using Step = std::function<void(double)>;

/// A shipped experiment with its noise, or without any, and a seed of its own.
[[nodiscard]] plant::Simulation simulate(const plant::ExperimentConfig& config, double noise_rms,
                                         std::uint64_t seed);

/// Equation (17) and figure 2: a known signal, and lambda varied.
[[nodiscard]] report::Section known_signal(const Options& options, const Step& step);

/// Figure 5: the measured velocity and what the bank makes of it.
[[nodiscard]] report::Section estimated_output(const Options& options, const Step& step);

/// Responses of one system at the eight lines.
using Response = std::vector<std::complex<double>>;  // [line]

/// One system under the multisine: what is true, and what each way of reading the bank gave.
struct System {
  std::string name;
  plant::Truth truth;
  double noise_rms = 0.0;
  std::vector<double> lines_hz;
  Response true_response;
  std::vector<double> input_amplitude;  ///< [line], |U| without noise
  Response noise_free;                  ///< bank, newest sample
  std::vector<Response> newest;         ///< [seed], bank, newest sample: as published
  std::vector<Response> averaged;       ///< [seed], bank, mean of its phasors over whole periods
  std::vector<Response> least_squares;  ///< [seed], the same time at once
};
[[nodiscard]] System run_system(std::string name, const plant::ExperimentConfig& config,
                                const Options& options, const Step& step);

/// The off-line response of one system from a PRBS, over the seeds.
struct OfflineRun {
  plant::Truth truth;
  double period_s = 0.0;
  std::vector<data::FrequencyResponse> averaged;  ///< [seed], of whole periods; empty where none is whole.
  std::vector<data::FrequencyResponse> welch;     ///< [seed], as published
};
[[nodiscard]] OfflineRun run_offline(const plant::ExperimentConfig& config, const Options& options,
                                     const Step& step);

/// Segments of Welch's method, windowed by Hann and overlapping by half: 4.1 s.
inline constexpr std::size_t kSegment = 2048;

/// Figure 4: a PRBS of 7 cells at 2 ms as printed, with its bits held, and one of 17 cells.
[[nodiscard]] report::Section offline_response(const OfflineRun& printed, const OfflineRun& held,
                                               const OfflineRun& longer);

/// Figures 7 and 8; `a_120` is A with the damping of Table 2.1.
[[nodiscard]] report::Section line_responses(const System& a, const System& b, const System& a_120,
                                             const OfflineRun& offline_a, const OfflineRun& offline_b);

/// Figure 9: the pointwise distance of A and B.
[[nodiscard]] report::Section distances(const System& a, const System& b, const System& a_120,
                                        const OfflineRun& offline_a, const OfflineRun& offline_b);

/// L = C G e^{-jwTd} of a plant response at some frequencies.
[[nodiscard]] Response open_loop(const Response& plant, const std::vector<double>& frequency_hz,
                                 const plant::Truth& truth);
/// T = L/(1 + L) (eq. 21, with the delay).
[[nodiscard]] Response complementary_sensitivity(const Response& plant,
                                                 const std::vector<double>& frequency_hz,
                                                 const plant::Truth& truth);
[[nodiscard]] Response true_response(const plant::Truth& truth, const std::vector<double>& frequency_hz);
[[nodiscard]] std::vector<double> distance(const Response& first, const Response& second);

/// `points` frequencies in even ratio from `low_hz` to `high_hz`.
[[nodiscard]] std::vector<double> even_ratio_grid_hz(double low_hz, double high_hz, int points);

/// What is smaller than this is the computer's rounding: tables show "< 1e-09" instead of digits of no
/// meaning.
inline constexpr double kRounding = 1e-9;

/// Every place where the paper of Publication IV needs a decision.
[[nodiscard]] std::vector<report::Discrepancy> discrepancies();

/// Magnitude in dB and phase in degrees (unwrapped along the lines, started in -180 ... 180) of a response.
[[nodiscard]] std::vector<double> magnitude_db(const Response& response);
[[nodiscard]] std::vector<double> phase_deg(const Response& response);

}  // namespace resonid::reproduction::iv
