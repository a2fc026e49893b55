// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace resonid::identification::detail {

/// Every threshold that decides what a user of this stage is told, with its reason or calibration. What only
/// steers an algorithm (steps, grid sizes, tolerances of rounding) stands where it is used.
struct Criteria {
  // ---- prepare: what a record is taken for
  std::size_t fewest_samples = 128;  ///< Of a record; fewer hold no response.
  double recorded_level =
      1e-3;  ///< Of the range: how near to its levels a recorded excitation of two stays ...
  double reconstructed_level = 0.03;  ///< ... and a reconstructed one, which carries the rounding of u and y.
  int excitation_turns = 40;       ///< A motion profile turns a few times; what excites, at least so often.
  double exact_repetition = 1e-6;  ///< Of the variance: a reconstructed excitation repeats to 0.1 %.
  double excitation_share = 1e-4;  ///< Of the input's variance, below which a reconstruction is rounding.
  double told_excitation =
      0.5;  ///< Share of a recorded excitation that a told chirp or period must explain ...
  double told_of_input =
      0.1;  ///< ... and of an input, in which the loop's motion and friction stand as well.
  double more_than_chance = 3.0;  ///< Times the share of a chirp that is not there.
  double same_sweep = 0.03;       ///< Of a chirp's span: how near a told one must be to the one that is seen.
  double copied = 1e-6;           ///< Of the variance: what a copy of a signal leaves is rounding.
  double motion_share = 0.9;  ///< Of the input's variance, explained by motion and friction: nothing excites.
  double followed_reference = 0.9;     ///< Correlation with the output, from which on the reference leads it.
  double feedback_false_alarm = 1e-3;  ///< Probability of feedback seen where there is none, per record.

  // ---- measure: what the response is worth
  double usable_line = 0.5;        ///< std/|G| of a line that says something of the value.
  double hardly_any_lines = 0.05;  ///< Share of usable lines below which averages have failed ...
  double clearly_more_lines =
      2.0;                       ///< ... and how many times more another method must give to take its place.
  double more_known = 0.03;      ///< Of the band, for which a shorter segment is worth its resolution.
  double same_coherence = 0.03;  ///< Mean coherence by which resolutions are as good as one another.
  double lost_coherence = 0.1;   ///< The same in any tenth of the band: a mode takes up no more.
  double coherent_gap = 2.0;     ///< Factor of frequency that an anti-resonance may drown in.
  double fed_back_power = 1e-3;  ///< Of the densest excitation: less may be noise in a closed loop.
  double held_band = 0.8;        ///< Of half the rate of a held output's new values, up to which lines count.
  std::size_t fewest_lines = 4;  ///< Of a response that tells a drive; periodic ones of fewer are none.
  double relevant_distortion = 1e-3;  ///< Of the output; less is of no consequence to a loop.
  double warned_distortion = 0.1;     ///< Of the output, from which the finding is a warning.

  // ---- measure: what the record shows of its loop
  double feedback_bias = 0.1;  ///< Of |G|: errors of that size are told, and mended beyond the error bars.
  double input_by_noise =
      0.5;  ///< Share of the input's power, of a typical line, that noise fed back may be. Without excitation
            ///< it is 0.95 and more, with one that moves the output clearly below 0.1.
  double input_by_noise_alone = 0.9;  ///< The same from which on no model makes anything of the rest.
  double input_by_noise_in_part =
      0.3;  ///< The same that a tenth of the lines exceeds, of averages over the input.
  double lines_above_noise = 0.1;  ///< Share of usable lines that noise alone gives at most: sweeps of no
                                   ///< effect have 0 ... 0.09, those that tell a drive just so 0.2.
  double bias_uncertainty = 1.0 / 3.0;  ///< Of the bias taken out, kept as its standard deviation.
  double most_bias = 10.0;  ///< Beyond it the autoregression's own response vanishes and tells nothing.
  double controller_difference =
      0.02;  ///< Of |C|, from which a told controller is another: a phase moves by up to 1 deg ...
  double controller_deviations = 3.0;  ///< ... and beyond the error bars (0.3 % false alarms).
  double noisy_input = 2e-3;  ///< Of u - ru, below which simulation from u is biased within its error bars.
  double orientation_line = 0.3;   ///< std/|G| of a line whose phase is taken for that of the drive.
  double quantity_fits = 0.1;      ///< Model error below which a response is that of a drive ...
  double quantity_gain = 0.33;     ///< ... and the part of it that taking the output for another one leaves.
  double orientation_slope = 0.3;  ///< A drive's response falls with slope -1, its inverse grows with 1.

  // ---- select: which structure a record shows
  double explained_response = 0.005;    ///< Model error below which two masses leave nothing to a third ...
  double explained_record = 99.999;     ///< ... and per cent of fit; what remains is rounding.
  double residual_beyond_chance = 1.5;  ///< Times the 3 % limit of a lag: 0.1 % for each of 40.
  double holdout_clear = 10.0;          ///< Gain in the hold-out score that decides: odds of 150 to 1.
  double contradicted = 10.0;           ///< Times that gain, lost over the whole record: then it was chance.
  double biased_lines = 50.0;           ///< In BIC of lines: a further parameter explains some of any bias.
  double ruled_out = 300.0;             ///< In BIC of lines that may repeat one another.
  double more_parameters = 8.0;         ///< In BIC, for friction or delay that only lines ask for.
  double dry_friction_found = 4.0;      ///< Standard deviations from none.
  double viscous_friction_found = 2.0;  ///< The same beside dry friction.
  double clearly_better = 20.0;   ///< In BIC, for what a record shows and its response does not: odds of 2e4.
  double known_resonance = 0.05;  ///< std/value of a resonance that such a fit must have.
  double true_enough = 0.05;      ///< Model error of unbiased lines beyond which a drive is not linear ...
  double beyond_noise = 5.0;      ///< ... where it exceeds the noise so many times.
  double better_simulation = 3.0,
         some_simulation = 10.0;       ///< Per cent of fit by which a fit corrects its response.
  std::size_t holdout_samples = 1000;  ///< Shorter records can spare none.
  double one_in_thousand = 3.1;        ///< Quantile of the median's scatter.
  double correctable_position = 90.0;  ///< Per cent of fit below which a drifting position leaks otherwise.

  // ---- judge: findings on model, loop and bootstrap
  double uncertain_resonance = 0.05;  ///< std/value, beyond which the result is not to be trusted.
  double determined_mode = 0.3;       ///< std/value of a black box's mode, beyond which it is none.
  double striking_mode_db =
      10.0;  ///< Of a dip or peak that no smooth error of a response or a model makes: a factor of 3.
  double other_extremum = 2.0;     ///< Factor by which curves then differ, beyond noise, ...
  double same_mode = 0.1;          ///< ... throughout so much of its frequency: nearer ones are the same.
  double uncertain_damping = 0.5;  ///< std/value: the order of magnitude.
  double uncertain_inertia = 0.2;  ///< std/value, by which a loop tuned with it would have the wrong gain.
  double constancy_false_alarm =
      1e-3;  ///< Probability, per record, that a parameter that stays the same is said to change.
  double constant_parameter =
      0.005;  ///< Scatter over value of an inertia or a stiffness that one value describes.
  double noticeable_shift = 1.0;  ///< Standard deviations by which what bends a machine moves a parameter ...
  double correctable_shift = 0.02;  ///< ... and of an inertia or a stiffness, beyond which first order fails.
  double trace_share = 0.3;         ///< Of what the strongest explains: less may be left of it.
  double as_well_as_a_mass =
      0.4;               ///< Of what a third mass explains, explained by what bends two masses to
                         ///< first order: 0.07 where there is a third mass, 0.56 where there is none.
  double outlier = 6.0;  ///< Standard deviations, by the median; of Gaussian noise one sample in 5e8.
  std::size_t fewest_outliers = 4;
  double outlier_share = 2e-4;  ///< Of the samples.
  double slipped_gain =
      9.0;  ///< In log-likelihood (1e-5 by chance), by which lost or doubled samples explain a residual ...
  double slipped_one_way = 2.0;  ///< ... and times what the other of the two explains.
  double contradicted_inertia =
      0.01;  ///< Of the inertia in all, by which a model may differ from what its motion took ...
  double contradicted_deviations = 4.0;  ///< ... and beyond both error bars.
  double misfit = 0.1, worthless = 0.3;  ///< Model error that is told, and with which a model is none.
  double unexplained = 0.4;              ///< Correlation of residual and simulation, and 3 times its limit.
  double nearly_all = 99.0;              ///< Per cent of fit: what remains is small, whatever it follows.
  double phase_margin_deg = 30.0, modulus_margin = 0.5;  ///< Usual least ones (Astrom and Hagglund 2006).
  double margin_line = 0.3;  ///< std/|L| of lines that margins are read from: margins of noise are none.
  double beyond_band = 1.5;  ///< Factor by which an identified controller, or a model to higher frequencies,
                             ///< may be extrapolated.
  double lower_mode = 0.3,
         upper_mode = 1.5;  ///< Times the band's ends: where a model's single pair still shows.
  double bootstrap_scatter =
      0.5;  ///< Of the error bars, below which replicas miss what lines have in common.

  double second_output_deviations =
      4.0;  ///< By which a second output's factor or delay is not that of the output ...
  double noticeable_scale = 1e-3;     ///< ... and least ones that count, of the factor
  double unrelated_scale = 1e-6;      ///< Factor of a signal that is none of the load, whatever its unit.
  double noticeable_lateness = 0.05;  ///< ... and in samples.
  double encoder_scale = 0.01;        ///< Off by more, counts or ratio of a load encoder are wrong ...
  double accelerometer_scale = 0.1;   ///< ... and the calibration of an accelerometer, of usually 2 ... 10 %.

  // ---- join
  double same_rate = 1e-3;        ///< Relative: clocks of one machine, read from time columns.
  double scattering_lines = 2.0;  ///< Chi-square per degree from which the records' responses scatter.
  double known_parameter = 1.0;   ///< std of a logarithm: known better than to a factor of e.

  // ---- validate
  double noticeable_error = 0.1,
         rejected_error = 0.3;        ///< rms over the lines of |error|/|G|, as misfit, worthless.
  double refitted_difference = 0.02;  ///< Of an inertia or a stiffness fitted to the record itself, ...
  double refitted_deviations = 4.0;   ///< ... and of both error bars: by chance once in 16 000.
  double excited_residual =
      0.5;                   ///< Share of the residual above the lowest line, below which drift rules it.
  double poor_fit = 50.0;    ///< Per cent of the output that a model of this drive reproduces at least.
  double motion_fit = 95.0;  ///< Per cent, where motion and friction alone drive: from there on details of
                             ///< friction, integrated, are what is left.
  double improbable_line = 1e-4;  ///< Of noise alone at any line.
  double chance = 0.01;           ///< Of a dependence by noise alone.
  double fit_points = 10.0;       ///< Per cent of fit less than its own record lets expect.
  double improbable_map = 1e-3,
         map_share = 0.01;     ///< Of a static nonlinearity: by chance, and of the residual.
  double usable_error = 0.25;  ///< Variance/|G|^2 of a line that counts.

  // ---- compare
  double far_from_one = 30.0;     ///< |G| or its inverse from which chordal distances see little.
  std::size_t fewest_pairs = 20;  ///< Of repetitions, for an interval.
};
inline constexpr Criteria kCriteria{};

}  // namespace resonid::identification::detail
