// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>

#include "reproduce/publication_iv.hpp"

namespace resonid::reproduction::iv {
namespace {

using report::Chart;
using report::ComparisonTable;
using report::Curve;
constexpr int kDrawn = 300;  // points of a drawn curve
using Reading = std::vector<double> (*)(const Response&);

Curve true_curve(std::string name, const plant::Truth& truth, Reading reading) {
  const auto grid = even_ratio_grid_hz(2.0, 30.0, kDrawn);
  return {std::move(name), Curve::Mark::line, grid, reading(true_response(truth, grid)), {}};
}

Curve points(std::string name, const std::vector<double>& frequency_hz, const Response& response,
             Reading reading) {
  return {std::move(name), Curve::Mark::points, frequency_hz, reading(response), {}};
}

Chart bode_chart(std::string title, bool magnitude) {
  return {std::move(title),
          "frequency (Hz)",
          magnitude ? "magnitude (dB, 0 dB = 1 (rad/s)/Nm)" : "phase (deg)",
          true,
          false,
          {},
          "",
          ""};
}

/// Errors of one reading of the bank.
struct Errors {
  Spread rms_percent;  // over lines and seeds; its deviation is that of a single seed's rms over the lines
  Spread largest_db;   // over the lines
  Spread largest_deg;
  std::vector<double> line_rms_percent;  // [line], over the seeds
};

Errors errors_of(const std::vector<Response>& seeds, const Response& truth) {
  const auto lines = static_cast<double>(truth.size());
  std::vector<double> power, rms, db, deg;
  std::vector<double> line_power(truth.size(), 0.0);
  for (const Response& response : seeds) {
    power.push_back(0.0);
    db.push_back(0.0);
    deg.push_back(0.0);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const auto ratio = response[i] / truth[i];
      power.back() += std::norm(ratio - 1.0) / lines;
      line_power[i] += std::norm(ratio - 1.0) / static_cast<double>(seeds.size());
      db.back() = std::max(db.back(), std::abs(20.0 * std::log10(std::abs(ratio))));
      deg.back() = std::max(deg.back(), std::abs(std::arg(ratio)) * 180.0 / kPi);
    }
    rms.push_back(100.0 * std::sqrt(power.back()));
  }
  Errors e{spread(rms), spread(db), spread(deg), {}};
  e.rms_percent.mean = 100.0 * std::sqrt(spread(power).mean);
  for (const double p : line_power) e.line_rms_percent.push_back(100.0 * std::sqrt(p));
  return e;
}

double largest_percent(const Response& response, const Response& truth) {
  double largest = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    largest = std::max(largest, 100.0 * std::abs(response[i] / truth[i] - 1.0));
  return largest;
}

/// What noise must make of the lines: an error of `phasor` standard deviations of the noise in Y - G U, which
/// is the noise itself (with feedback as without), over |U|, relative to |G|. In percent, [line].
std::vector<double> expected_percent(const System& s, double phasor) {
  std::vector<double> out;
  for (std::size_t i = 0; i < s.lines_hz.size(); ++i)
    out.push_back(100.0 * s.noise_rms * phasor / s.input_amplitude[i] / std::abs(s.true_response[i]));
  return out;
}

std::size_t argmax(const std::vector<double>& values) {
  return static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
}

ComparisonTable error_table(const System& s) {
  ComparisonTable table{fmt::format("Errors of the response at the eight lines, {}", s.name), {}};
  // Two components of variance r/(2 lambda + c'c) each; 4 r/N over N samples.
  const auto bank = expected_percent(s, std::sqrt(2.0 / (2.0 * kLambda + kLines + 1.0)));
  const auto least = expected_percent(s, 2.0 / std::sqrt(kJudged / s.truth.plant.sample_time_s));
  const Errors newest = errors_of(s.newest, s.true_response);
  const Errors averaged = errors_of(s.averaged, s.true_response);
  const Errors fitted = errors_of(s.least_squares, s.true_response);
  table.rows.push_back({"bank, newest sample, no noise: largest",
                        "%",
                        {},
                        largest_percent(s.noise_free, s.true_response),
                        {},
                        0.0,
                        "once settled, the bank separates the lines exactly",
                        kRounding});
  table.rows.push_back(row("bank, newest sample: rms", "%", newest.rms_percent, rms(bank), {},
                           "as published; true: from the bank's noise variance r/(2 lambda + c'c)"));
  table.rows.push_back(row("bank, newest sample: largest", "dB", newest.largest_db, {}));
  table.rows.push_back(row("bank, newest sample: largest", "deg", newest.largest_deg, {}));
  table.rows.push_back(row("bank, mean over whole periods: rms", "%", averaged.rms_percent, rms(least), {},
                           "the same bank, its phasors averaged over 20 s; true: the least possible"));
  table.rows.push_back(
      row("least squares over 20 s: rms", "%", fitted.rms_percent, rms(least), {}, "likewise"));
  const std::size_t worst = argmax(newest.line_rms_percent);
  table.rows.push_back(
      {"line of the largest relative error",
       "Hz",
       20.9,
       s.lines_hz[worst],
       {},
       s.lines_hz[argmax(bank)],
       fmt::format("{:.1f} % there; true: where |G U| is least, so noise does not single out f7",
                   newest.line_rms_percent[worst])});
  return table;
}

/// Mean and scatter of a reading at each line, for both systems.
ComparisonTable line_table(std::string title, const char* quantity, const char* unit, const System& a,
                           const System& b, Reading reading) {
  ComparisonTable table{std::move(title), {}};
  for (const System* s : {&a, &b}) {
    std::vector<std::vector<double>> columns(s->lines_hz.size());
    const auto truth = reading(s->true_response);
    for (const Response& response : s->newest) {
      const auto values = reading(response);
      for (std::size_t i = 0; i < values.size(); ++i) columns[i].push_back(values[i]);
    }
    for (std::size_t i = 0; i < columns.size(); ++i)
      table.rows.push_back(row(fmt::format("{}: {} at {:g} Hz", s->name, quantity, s->lines_hz[i]), unit,
                               spread(columns[i]), truth[i]));
  }
  return table;
}

Chart system_chart(const System& s, const OfflineRun& offline, bool magnitude) {
  Chart chart = bode_chart(
      fmt::format("Counterpart of figures 7 and 8: {} of {}", magnitude ? "magnitude" : "phase", s.name),
      magnitude);
  const Reading reading = magnitude ? magnitude_db : phase_deg;
  const auto& estimate = offline.averaged.front();
  chart.curves = {true_curve("true", s.truth, reading),
                  {"off line, PRBS", Curve::Mark::dashed, estimate.frequency_hz, reading(estimate.value), {}},
                  points("bank, no noise", s.lines_hz, s.noise_free, reading),
                  points("bank, seed 1", s.lines_hz, s.newest.front(), reading)};
  return chart;
}

/// The highest |G| seen above the anti-resonance, and where.
struct Peak {
  double frequency_hz = 0.0;
  double magnitude = 0.0;
};
Peak peak_of(const std::vector<double>& frequency_hz, const Response& response) {
  Peak peak;
  for (std::size_t i = 0; i < response.size(); ++i)
    if (frequency_hz[i] > 9.0 && frequency_hz[i] < 25.0 && std::abs(response[i]) > peak.magnitude)
      peak = {frequency_hz[i], std::abs(response[i])};
  return peak;
}

/// What one way of computing it shows of the response, over the seeds.
void put_estimate_rows(ComparisonTable& table, const std::string& name, const plant::Truth& truth,
                       const std::vector<data::FrequencyResponse>& estimates) {
  const auto grid = even_ratio_grid_hz(2.0, 30.0, kDrawn);
  const Peak highest = peak_of(grid, true_response(truth, grid));
  std::vector<double> frequency, magnitude, rms;
  for (const auto& response : estimates) {
    const Peak peak = peak_of(response.frequency_hz, response.value);
    frequency.push_back(peak.frequency_hz);
    magnitude.push_back(peak.magnitude);
    const Response exact = true_response(truth, response.frequency_hz);
    double power = 0.0;
    for (std::size_t i = 0; i < exact.size(); ++i) power += std::norm(response.value[i] / exact[i] - 1.0);
    rms.push_back(100.0 * std::sqrt(power / static_cast<double>(exact.size())));
  }
  const auto& first = estimates.front();
  const auto within = [](double f) { return f >= 11.0 && f <= 19.0; };
  const auto near = std::count_if(first.frequency_hz.begin(), first.frequency_hz.end(), within);
  table.rows.push_back(row(name + ": line with the highest |G|", "Hz", spread(frequency),
                           highest.frequency_hz, {},
                           fmt::format("{} lines between 11 and 19 Hz, where the resonance is", near)));
  table.rows.push_back(row(name + ": highest |G| seen", "(rad/s)/Nm", spread(magnitude), highest.magnitude));
  table.rows.push_back(row(name + ": rms error, 2 ... 30 Hz", "%", spread(rms), 0.0));
}

void put_offline_rows(ComparisonTable& table, const std::string& name, const OfflineRun& run) {
  table.rows.push_back(
      {name + ": distance of the sequence's lines", "Hz", {}, 1.0 / run.period_s, {}, {}, ""});
  put_estimate_rows(table, name + ", Welch", run.truth, run.welch);
  if (!run.averaged.empty()) put_estimate_rows(table, name + ", periods averaged", run.truth, run.averaged);
}

/// What the change of the machine does to the true response at a line, in words.
std::string change_at(const System& a, const System& b, std::size_t line) {
  const auto ratio = b.true_response[line] / a.true_response[line];
  return fmt::format("{:.1f} dB and {:.0f} degrees at f{}", 20.0 * std::log10(std::abs(ratio)),
                     std::arg(ratio) * 180.0 / kPi, line + 1);
}

}  // namespace

report::Section offline_response(const OfflineRun& printed, const OfflineRun& held,
                                 const OfflineRun& longer) {
  report::Section section;
  section.title = "Figure 4: off-line response of A";
  section.text = {
      fmt::format("The paper excites with a PRBS of a 7-cell register, +-2.3 Nm, takes Welch's spectra, and "
                  "names no sample time, no clock and no segment. At the 2 ms of Publication VI the sequence "
                  "repeats after {:.3f} s, so its lines lie {:.2f} Hz apart: too few to draw a resonance at "
                  "15.1 Hz whose width is 2.5 Hz, as the printed figure does. Between the lines Welch's "
                  "spectra hold leakage and noise.",
                  printed.period_s, 1.0 / printed.period_s),
      fmt::format("Two ways out are shown. Each bit held for 8 samples puts the lines {:.3f} Hz apart and "
                  "leaves more than half the power up to 27 Hz; the 17 cells of Publication VI repeat after "
                  "{:.0f} s, so that 30 s hold every frequency.",
                  1.0 / held.period_s, longer.period_s),
      fmt::format("Welch: Hann segments of {} samples that overlap by half. Whole periods of the short "
                  "sequences can be averaged instead, without a window: nothing leaks, and the lines of the "
                  "sequence hold its whole power. Joint input-output; the first 2 s are left out.",
                  kSegment)};
  for (const bool magnitude : {true, false}) {
    Chart chart = bode_chart(
        fmt::format("Counterpart of figure 4: {} of A", magnitude ? "magnitude" : "phase"), magnitude);
    const Reading reading = magnitude ? magnitude_db : phase_deg;
    const auto curve = [&](const char* name, Curve::Mark mark, const data::FrequencyResponse& g) {
      return Curve{name, mark, g.frequency_hz, reading(g.value), {}};
    };
    std::vector<double> lines;
    for (std::size_t i = 0; i < kLines; ++i) lines.push_back(2.9 + 3.0 * static_cast<double>(i));
    chart.curves = {true_curve("true", held.truth, reading),
                    curve("17 cells at 2 ms, Welch", Curve::Mark::line, longer.welch.front()),
                    curve("bits held 8 samples, periods", Curve::Mark::dashed, held.averaged.front()),
                    curve("7 cells at 2 ms, Welch", Curve::Mark::dashed, printed.welch.front()),
                    curve("7 cells at 2 ms, periods", Curve::Mark::points, printed.averaged.front()),
                    points("the eight lines chosen", lines, true_response(held.truth, lines), reading)};
    section.charts.push_back(std::move(chart));
  }
  ComparisonTable table{"What each PRBS shows of A, noise sd 0.1 rad/s", {}};
  put_offline_rows(table, "7 cells at 2 ms", printed);
  put_offline_rows(table, "bits held 8 samples", held);
  put_offline_rows(table, "17 cells at 2 ms", longer);
  section.tables.push_back(std::move(table));
  return section;
}

report::Section line_responses(const System& a, const System& b, const System& a_120,
                               const OfflineRun& offline_a, const OfflineRun& offline_b) {
  report::Section section;
  section.title = "Figures 7 and 8: responses of A and B at the eight lines";
  section.text = {
      "Banks with lambda 100 on u and y, direct, the known delay of 4 ms taken out, read after 30 s. True "
      "is the zero-order-hold equivalent of the simulated drive. The paper shows pictures only; of the two "
      "figures it says that the line f7 (20.9 Hz) has the largest error, and that the change from A to B "
      "shows best at f3 and f4. In truth it is " +
          change_at(a, b, 2) + ", " + change_at(a, b, 3) + ", and " + change_at(a, b, 4) + ".",
      "A row 'rms' is over lines and seeds; its +- is that of a single seed's rms over the lines.",
      "The bank uses what its memory of about 250 samples holds. Its phasors averaged over whole periods, "
      "or least squares over the same recording, come down to the bound: the error of the published reading "
      "is "
      "the price of being ready at every sample.",
      "System A has the damping of 100 Ns/m that Publication IV prints; 'A, D = 120' is the same with the "
      "120 of Table 2.1 and Publication VI."};
  section.charts = {system_chart(a, offline_a, true), system_chart(a, offline_a, false),
                    system_chart(b, offline_b, true), system_chart(b, offline_b, false)};
  const auto seeds = a.newest.size();
  section.tables = {
      error_table(a), error_table(b), error_table(a_120),
      line_table(fmt::format("Figure 8: magnitude, bank, noise sd {:g} rad/s, {} seeds", a.noise_rms, seeds),
                 "|G|", "dB", a, b, magnitude_db),
      line_table(fmt::format("Figure 8: phase, bank, noise sd {:g} rad/s, {} seeds", a.noise_rms, seeds),
                 "phase", "deg", a, b, phase_deg)};
  return section;
}

}  // namespace resonid::reproduction::iv
