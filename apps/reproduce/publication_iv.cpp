// SPDX-License-Identifier: MIT
#include "reproduce/publication_iv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <reproduce/reproduction.hpp>
#include <resonid/diagnostics/margins.hpp>
#include <resonid/io/shipped_experiments.hpp>

namespace resonid::reproduction {
namespace {

using report::Section;

constexpr double kParts = 9.0;  // of the work, alike for progress

data::FrequencyResponse loop_of(const plant::Truth& truth) {
  data::FrequencyResponse loop;
  loop.frequency_hz = iv::even_ratio_grid_hz(0.05, 0.499 / truth.plant.sample_time_s, 6000);
  loop.value = iv::open_loop(iv::true_response(truth, loop.frequency_hz), loop.frequency_hz, truth);
  return loop;
}

/// What the paper gives as numbers; all else there are pictures.
Section printed_figures(const iv::System& a, const iv::System& b, const Section& responses) {
  Section section;
  section.title = "Printed figures side by side";
  section.text = {"Publication IV gives few results as numbers. These are all of them; f7 is 20.9 Hz."};
  report::ComparisonTable table{"Every printed figure", {}};
  const double resonance_a = data::resonance_hz(*a.truth.two_mass);
  const double resonance_b = data::resonance_hz(*b.truth.two_mass);
  table.rows = {row("A: resonance", "Hz", resonance_a, resonance_a, 15.1),
                row("B: resonance", "Hz", resonance_b, resonance_b, 11.1)};
  const std::pair<const char*, std::size_t> systems[] = {{"A", 0}, {"B", 1}};
  for (const auto& [name, at] : systems) {
    table.rows.push_back(responses.tables[at].rows.back());
    table.rows.back().quantity = fmt::format("{}: {}", name, table.rows.back().quantity);
  }
  section.tables.push_back(std::move(table));
  return section;
}

Section machines(const iv::System& a, const iv::System& b) {
  Section section;
  section.title = "Table 1: the two machines";
  section.text = {
      "Two rollers coupled by a belt, driven and measured on the same side, simulated as exact "
      "zero-order-hold equivalent with a PI velocity controller at 10 rad/s. Sample time, controller, delay "
      "and noise are not printed; the last table says what was taken."};
  report::ComparisonTable frequencies{"Undamped frequencies from the printed parameters", {}};
  report::ComparisonTable loops{"The simulated loops, delay of 4 ms included", {}};
  const auto put = [&](const char* name, const iv::System& s, double printed) {
    const double resonance = data::resonance_hz(*s.truth.two_mass);
    frequencies.rows.push_back(row(fmt::format("{}: resonance", name), "Hz", resonance, resonance, printed));
    const double antiresonance = data::antiresonance_hz(*s.truth.two_mass);
    frequencies.rows.push_back(
        row(fmt::format("{}: anti-resonance", name), "Hz", antiresonance, antiresonance));
    const auto margins = diagnostics::loop_margins(loop_of(s.truth));
    loops.rows.push_back({fmt::format("{}: crossover", name), "Hz", {}, {}, {}, margins.crossover_hz(), ""});
    loops.rows.push_back(
        {fmt::format("{}: phase margin", name), "deg", {}, {}, {}, margins.phase_margin_deg(), ""});
  };
  put("A", a, 15.1);
  put("B", b, 11.1);
  section.tables = {std::move(frequencies), std::move(loops)};
  return section;
}

/// The figure of a row, for a sentence.
double figure(const Section& section, std::size_t table, std::size_t row) {
  return section.tables[table].rows[row].reproduced.value_or(0.0);
}

std::string at_most(double percent) {
  return percent < iv::kRounding ? "better than 1e-09" : fmt::format("{:.0e}", percent);
}

std::vector<std::string> summary(const Section& responses, const Section& gap) {
  return {
      fmt::format("The method does what the paper says. Without noise the bank's responses agree with the "
                  "simulated drives to {} % (A) and {} % (B) at all eight lines; with noise of 0.1 "
                  "rad/s their standard deviations are {:.1f} % and {:.1f} %.",
                  at_most(figure(responses, 0, 0)), at_most(figure(responses, 1, 0)), figure(responses, 0, 1),
                  figure(responses, 1, 1)),
      fmt::format(
          "The change from A to B is plain in the pointwise distance: {:.2f} at 11.9 Hz, {:.3f} at 2.9 Hz.",
          figure(gap, 0, 3), figure(gap, 0, 0)),
      "What does not hold as printed: what is said of lambda on figure 2 b, the off-line PRBS at the sample "
      "time of the sister publication, and f7 as the line of the largest error (not by noise). The paper "
      "shows its results as pictures, so most rows have no published figure."};
}

}  // namespace

report::Document publication_iv(const Options& options) {
  const auto part = [&](int number) -> iv::Step {
    return [&options, number](double done) {
      if (options.progress) options.progress((number + done) / kParts);
    };
  };
  const auto config_a = io::shipped_experiment("iv_multisine_a");
  auto config_a_120 = config_a;
  config_a_120.drive.damping = 120.0;  // Table 2.1
  const auto a = iv::run_system("A", config_a, options, part(0));
  const auto b = iv::run_system("B", io::shipped_experiment("iv_multisine_b"), options, part(1));
  const auto a_120 = iv::run_system("A, D = 120", config_a_120, options, part(2));
  const auto printed = iv::run_offline(io::shipped_experiment("iv_prbs_a"), options, part(3));
  const auto held_a = iv::run_offline(io::shipped_experiment("iv_prbs_divided_a"), options, part(4));
  const auto held_b = iv::run_offline(io::shipped_experiment("iv_prbs_divided_b"), options, part(5));
  auto of_17_cells = io::shipped_experiment("iv_prbs_a");
  of_17_cells.excitation.register_length = 17;  // as in Publication VI
  const auto longer = iv::run_offline(of_17_cells, options, part(6));

  const Section responses = iv::line_responses(a, b, a_120, held_a, held_b);
  const Section gap = iv::distances(a, b, a_120, held_a, held_b);
  report::Document document;
  document.title = "Publication IV: a multisine tracked by a bank of Kalman filters";
  document.command = fmt::format("resonid reproduce iv --seeds {}", options.seeds);
  document.seeds = options.seeds;
  document.summary = summary(responses, gap);
  document.sections = {printed_figures(a, b, responses),
                       machines(a, b),
                       iv::known_signal(options, part(7)),
                       iv::offline_response(printed, held_a, longer),
                       iv::estimated_output(options, part(8)),
                       responses,
                       gap};
  document.discrepancies = iv::discrepancies();
  return document;
}

}  // namespace resonid::reproduction
