// SPDX-License-Identifier: MIT
#include "reproduction/publication_iv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <resonid/reproduction/experiments.hpp>
#include <resonid/reproduction/reproduction.hpp>

namespace resonid::reproduction {
namespace {

using report::Section;

constexpr double kParts = 8.0;  // of the work, alike for progress

Section machines(const iv::System& a, const iv::System& b) {
  Section section;
  section.title = "Table 1: the two machines";
  section.text = {
      "Two rollers coupled by a belt, driven and measured on the same side, simulated as exact "
      "zero-order-hold equivalent with a PI velocity controller at 10 rad/s. Sample time, controller, delay "
      "and noise are not printed; the last table says what was taken."};
  report::ComparisonTable table{"Undamped frequencies from the printed parameters", {}};
  const auto put = [&](const char* name, const iv::System& s, double printed) {
    const double resonance = data::resonance_hz(*s.truth.two_mass);
    table.rows.push_back({fmt::format("{}: resonance", name), "Hz", printed, resonance, {}, resonance, ""});
    const double antiresonance = data::antiresonance_hz(*s.truth.two_mass);
    table.rows.push_back(
        {fmt::format("{}: anti-resonance", name), "Hz", {}, antiresonance, {}, antiresonance, ""});
  };
  put("A", a, 15.1);
  put("B", b, 11.1);
  section.tables.push_back(std::move(table));
  return section;
}

/// The figure of a row, for a sentence.
double figure(const Section& section, std::size_t table, std::size_t row) {
  return section.tables[table].rows[row].reproduced.value_or(0.0);
}

std::vector<std::string> summary(const Section& responses, const Section& gap) {
  return {
      fmt::format("The method does what the print says. Without noise the bank's responses agree with the "
                  "simulated drives to {:.0e} % (A) and {:.0e} % (B) at all eight lines; with noise of 0.1 "
                  "rad/s they scatter by {:.1f} % and {:.1f} % rms.",
                  figure(responses, 0, 0), figure(responses, 1, 0), figure(responses, 0, 1),
                  figure(responses, 1, 1)),
      fmt::format(
          "The change from A to B is plain in the pointwise distance: {:.2f} at 11.9 Hz, {:.3f} at 2.9 Hz.",
          figure(gap, 0, 3), figure(gap, 0, 0)),
      "What does not hold as printed: what is said of lambda on figure 2 b, the off-line PRBS at the sample "
      "time of the sister publication, and f7 as the line of the largest error (not by noise). The print "
      "shows its results as pictures, so most rows have no published figure."};
}

}  // namespace

report::Document publication_iv(const Options& options) {
  const auto part = [&](int number) -> iv::Step {
    return [&options, number](double done) {
      if (options.progress) options.progress((number + done) / kParts);
    };
  };
  const auto config_a = shipped_experiment("iv_multisine_a");
  auto config_a_120 = config_a;
  config_a_120.drive.damping = 120.0;  // Table 2.1
  const auto a = iv::run_system("A", config_a, options, part(0));
  const auto b = iv::run_system("B", shipped_experiment("iv_multisine_b"), options, part(1));
  const auto a_120 = iv::run_system("A, D = 120", config_a_120, options, part(2));
  const auto printed = iv::run_offline(shipped_experiment("iv_prbs_a"), options, part(3));
  const auto held_a = iv::run_offline(shipped_experiment("iv_prbs_divided_a"), options, part(4));
  const auto held_b = iv::run_offline(shipped_experiment("iv_prbs_divided_b"), options, part(5));

  report::Document document;
  document.title = "Publication IV: a multisine tracked by a bank of Kalman filters";
  document.command = "resonid reproduce iv";
  document.sections = {machines(a, b),
                       iv::known_signal(options, part(6)),
                       iv::offline_response(printed, held_a),
                       iv::estimated_output(options, part(7)),
                       iv::line_responses(a, b, a_120, held_a, held_b),
                       iv::distances(a, b, a_120, held_a, held_b)};
  document.summary = summary(document.sections[4], document.sections[5]);
  document.discrepancies = iv::discrepancies();
  return document;
}

}  // namespace resonid::reproduction
