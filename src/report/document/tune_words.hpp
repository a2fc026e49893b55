// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/identification/tune.hpp>
#include <resonid/identification/tune_export.hpp>
#include <resonid/report/detail/document.hpp>
#include <string>
#include <string_view>
#include <vector>

// Words that text and page of a tuning share.
namespace resonid::report {

/// A figure of a loop as people call it.
struct FigureWords {
  std::string_view name;    ///< As in JSON.
  std::string_view words;   ///< In tables: "largest |S|, Ms".
  std::string_view symbol;  ///< In sentences: "|S|".
};
/// Those of a name that is not known: the name with spaces. `of_position`: of a cascade, whose load is
/// bounded by its position, and whose load step moves the measured position; the load's, which its curves
/// show, stands off by torque over stiffness.
[[nodiscard]] std::string loop_figure_words(std::string_view name, bool of_position = false);
[[nodiscard]] std::string loop_figure_symbol(std::string_view name, bool of_position = false);

/// What a figure's numbers are multiplied by to be shown, and their unit then: shares in %, short times in
/// ms.
struct ShownUnit {
  double factor = 1.0;
  std::string unit;

  /// Three digits, without the unit.
  [[nodiscard]] std::string number(double value) const;
  /// With the unit.
  [[nodiscard]] std::string text(double value) const;
};
[[nodiscard]] ShownUnit shown_unit(const identification::LoopFigure& figure);

/// Three digits, the zeros at their end too: "1.40", "0.0530", "143".
[[nodiscard]] std::string three_digits(double value);
/// "98.1 ms", from a second on "10.5 s".
[[nodiscard]] std::string time_text(double seconds);
/// "10 000"
[[nodiscard]] std::string grouped(std::size_t count);
/// "4.2 %"
[[nodiscard]] std::string share_text(double share);

using identification::gain_units;
using identification::GainUnits;

/// Whether it is its gain kp alone.
[[nodiscard]] bool is_p(const identification::TunedController& controller);

/// "kp 2.11 Nm/(rad/s), ki 21.5 Nm/rad (Ti 98.1 ms)", of a P kp alone; times `factor`.
[[nodiscard]] std::string gains_text(const identification::TunedController& controller,
                                     const GainUnits& units, double factor = 1.0);

[[nodiscard]] std::optional<double> value_of(const identification::TunedController& controller,
                                             std::string_view figure);

/// With its unit; "unknown" where there is none.
[[nodiscard]] std::string figure_text(const identification::TunedController& controller,
                                      std::string_view figure);

/// Whether a figure is known as a worst case alone, since a design by a response has no machine that it would
/// be a value of.
[[nodiscard]] bool is_worst_alone(const identification::LoopFigure& figure);

/// Empty where there is none.
[[nodiscard]] std::string unit_of_figure(const identification::TunedController& controller,
                                         std::string_view figure);

/// Whether the lines of a response do not tell that the loop of the proposal is stable.
[[nodiscard]] bool stability_is_unknown(const identification::Tuning& tuning);

/// Whether nothing but the bounds speaks against a tuning.
[[nodiscard]] bool results_are_trusted(const identification::Tuning& tuning);

/// Whether both close a loop of velocity, or both one of position: else their loads' curves, figures and
/// |T_load| mean different things.
[[nodiscard]] bool are_alike(const identification::TunedController& a,
                             const identification::TunedController& b);
/// Why the running controller is left out where it is not alike; empty where it is, and without one.
[[nodiscard]] std::string left_out_sentence(const identification::Tuning& tuning);

/// How many times smaller the load's error after a torque step is than under the running controller; nothing
/// where one is of velocity and the other of position.
[[nodiscard]] std::optional<double> stiffer_by(const identification::Tuning& tuning);
/// "2.7 times stiffer"
[[nodiscard]] std::string stiffness_words(double ratio);

/// Whether one controller was designed, or is judged, for several machines at once.
[[nodiscard]] bool is_for_several(const identification::Tuning& tuning);
/// The file of one of several results, whose machine that is; "result 2" where it has none.
[[nodiscard]] std::string file_of_machine(const identification::Tuning& tuning, std::size_t i);
/// Of the first, whose machine figures and curves are of.
[[nodiscard]] std::string first_file(const identification::Tuning& tuning);
/// "the identified machine"; of several "the machine of x.json".
[[nodiscard]] std::string machine_words(const identification::Tuning& tuning);
/// What of a design for several machines is of which; empty for one.
[[nodiscard]] std::string several_sentence(const identification::Tuning& tuning);

/// "|S| <= 1.40, |T_load| <= 1.30": bounds on figures; empty without.
[[nodiscard]] std::string bounds_text(const identification::TunedController& controller);

/// Parts of sentences(): what matters most, the command that follows from it included; what the loop is like.
[[nodiscard]] std::vector<std::string> lead_sentences(const identification::Tuning& tuning);
[[nodiscard]] std::vector<std::string> loop_sentences(const identification::Tuning& tuning);
/// The uncertainty of the delay, and what less uncertainty would buy.
[[nodiscard]] std::vector<std::string> uncertainty_sentences(const identification::Tuning& tuning);
/// Empty where there is nothing of the kind; first what a design without regard to uncertainty does.
[[nodiscard]] std::string nominal_sentence(const identification::Tuning& tuning);
[[nodiscard]] std::string schedule_sentence(const identification::Tuning& tuning);
[[nodiscard]] std::string shaper_sentence(const identification::Tuning& tuning);
/// One for each run of the proposed controller: what was run, what came and what was promised.
[[nodiscard]] std::vector<std::string> simulated_sentences(const identification::Tuning& tuning);

/// All controllers that are compared, with what people call them: candidates, the one without regard to
/// uncertainty, the running one.
struct ComparedController {
  const identification::TunedController& controller;
  std::string name;
};
[[nodiscard]] std::vector<ComparedController> compared_controllers(const identification::Tuning& tuning);

/// Their gains and figures, and all figures of the first with interval, worst case, bound and probability.
[[nodiscard]] Table candidate_table(const identification::Tuning& tuning);
[[nodiscard]] Table figure_table(const identification::TunedController& controller);
/// Every frequency with |L| = 1: the least margin need not be that of the first.
[[nodiscard]] Table crossing_table(const identification::TunedController& controller);
[[nodiscard]] Table schedule_table(const identification::Tuning& tuning);
[[nodiscard]] Table shaper_table(const identification::Tuning& tuning);

/// "reference step" of "reference step with the running controller".
struct RunName {
  std::string what;
  bool running = false;
};
[[nodiscard]] RunName name_of_run(const identification::SimulatedRun& run);
/// With what it was made of: "reference step of 1 rad/s", "load step of 0.5 Nm with the running controller".
[[nodiscard]] std::string run_words(const identification::Tuning& tuning,
                                    const identification::SimulatedRun& run);

/// What a recording under the controller shows; empty without one.
[[nodiscard]] std::string check_sentence(const identification::Tuning& tuning);
[[nodiscard]] Table check_table(const identification::TuningCheck& check);

}  // namespace resonid::report
