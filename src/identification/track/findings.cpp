// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <identification/track/findings.hpp>
#include <resonid/online/supervision/detail/controller_check.hpp>
#include <string>

namespace resonid::identification::detail {
namespace {

using diagnostics::Finding;
using diagnostics::Severity;
using Findings = std::vector<Finding>;

constexpr double kColoured = 0.15;       // practical limit of a correlation (Landau et al. 2011)
constexpr double kMostColoured = 0.5;    // error bars 1.7 times too small: sqrt((1 + r)/(1 - r))
constexpr double kEnough = 0.8;          // share of the rows
constexpr double kLost = 0.05;           // share of the rows
constexpr double kEnoughExcited = 0.5;   // likewise: a drive need not be excited all the time
constexpr double kUnstableShare = 0.05;  // of the times, that a noisy estimate may look unstable
constexpr double kNoticeable = 0.05;     // samples of delay

double share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

void add(Findings& findings, const char* id, bool bad, double value, double threshold, std::string meaning) {
  findings.push_back({id, bad ? Severity::error : Severity::warning, value, threshold, std::move(meaning)});
}

/// How many of the rows passed each gate.
void inspect_gates(const online::Axis& axis, const online::AxisCounts& n, Findings& findings) {
  const auto& result = axis.result();
  const online::AxisCriteria criteria;
  if (n.ready == 0) {
    add(findings, "never-ready", true, static_cast<double>(n.rows), 0.0,
        "The estimator never got beyond its start: the recording is too short, nothing excited the drive, or "
        "the initial model is not that of this machine. Excite more strongly, record longer, or give another "
        ".start.");
    return;
  }
  const TrustShares s = shares_of(n);
  if (s.excited < 1.0)
    add(findings, "no-excitation", s.excited < kEnoughExcited, result.weakest_excitation,
        criteria.weak_excitation,
        fmt::format("For {:.1f} % of the time the excitation around the resonance was below a tenth of the "
                    "strongest so far: the estimate is frozen there, and not valid. Excite throughout.",
                    100.0 * (1.0 - s.excited)));
  if (n.excited == 0) return;
  if (s.converged < 1.0) {
    const auto& row = axis.row();
    const bool known = std::isfinite(row.uncertainty);
    add(findings, "not-converged", s.converged < kEnough, known ? row.uncertainty : s.converged,
        known ? row.most_uncertainty : 1.0,
        fmt::format(
            "For {:.1f} % of the time the estimate was too uncertain (at most {:.2g} % is allowed), "
            "still moving, or showed no resonance. Excite more strongly, or average longer (.memory_s).",
            100.0 * (1.0 - s.converged), 100.0 * row.most_uncertainty));
  }
  if (n.lost > 0)
    add(findings, "lost", share(n.lost, n.ready) > kLost, share(n.lost, n.ready), kLost,
        fmt::format(
            "For {:.2g} % of the time after its start, the estimator had lost the machine: its "
            "predictions failed, or it had to restart. Excite more strongly, or give a better initial model "
            "(.start).",
            100.0 * share(n.lost, n.ready)));
  if (s.physical < 1.0)
    add(findings, "unphysical", s.physical < kEnough, s.physical, 1.0,
        fmt::format("For {:.1f} % of the time the estimate was not physical: unstable, or with an inertia, "
                    "stiffness or damping below zero. Excite more strongly, or average longer (.memory_s).",
                    100.0 * (1.0 - s.physical)));
  if (s.residual < 1.0)
    add(findings, "residual-grown", s.residual < kEnough, result.worst_residual_growth,
        criteria.residual_growth,
        fmt::format("The residual grew to {:.1f} times its usual rms: the machine did something that the "
                    "model does not describe, or changed faster than the estimate follows. Look at the "
                    "recording there, or "
                    "average for a shorter time (.memory_s).",
                    result.worst_residual_growth));
  const double correlation = result.residual_correlation;
  if (!axis.white_residual() || !(std::abs(correlation) > kColoured)) return;
  const bool bad = correlation > kMostColoured;
  findings.push_back(
      {"coloured-residual", bad ? Severity::error : Severity::info, correlation,
       bad ? kMostColoured : kColoured,
       bad ? "Neighbouring residuals are alike: the model lacks dynamics, such as the lag "
             "of a torque loop, a filter "
             "or friction, or the noise is slow. The error bars are far too small. See what "
             "identify says of the recording."
           : "Neighbouring residuals are correlated: the noise is not white, or the model "
             "lacks dynamics. The error bars are then too small: take them for lower bounds."});
}

/// Whether a small error of the parameters would have grown.
void inspect_stability(const online::AxisStability& s, TrackMethod method, Findings& findings) {
  if (kUnstableShare * static_cast<double>(s.watched) < static_cast<double>(s.unstable))
    add(findings, "locally-unstable", true, s.least_eigenvalue, 0.0,
        fmt::format("{} does not converge to the true parameters of this machine, whose damping is too low "
                    "for this sample rate. Use d-cloe, iv or physical.",
                    name_of(method)));
  if (s.restarts > 0)
    add(findings, "predictor-lost", true, static_cast<double>(s.restarts), 0.0,
        "The predictor diverged from the measured output and was restarted: the estimate is not reliable. "
        "Use d-cloe, iv or physical.");
}

void inspect_controller(const ControllerRows& rows, Findings& findings) {
  const double differing = share(rows.differing, rows.seen);
  if (!(differing > kLost)) return;
  findings.push_back(
      {"controller-differs", differing > 1.0 - kEnough ? Severity::error : Severity::warning, rows.difference,
       online::ControllerCheck<double>::kRelevant,
       fmt::format("The controller given is not the one that ran: for {:.0f} % of the time excitation, input "
                   "and output show another one{}. The margins are not those of this loop, and methods that "
                   "use the controller give wrong estimates. Give the controller that ran (.controller).",
                   100.0 * differing,
                   rows.difference
                       ? fmt::format(", which differs from it by up to {:.0f} %", 100.0 * *rows.difference)
                       : std::string())});
}

void inspect_change(const online::AxisResult& result, double start_time_s, Findings& findings) {
  if (!result.changed) return;
  const auto& c = result.change;
  add(findings, "changed", false, c.size, c.size_std,
      fmt::format("From {:.4g} s on the watched figure differs by {:.4g} +- {:.2g}; the change was detected "
                  "at {:.4g} s. Compare results from before and after it.",
                  start_time_s + c.time_s, c.size, 2.0 * c.size_std, start_time_s + c.detected_s));
}

}  // namespace

void ControllerRows::add(const online::AxisRow& row) {
  const bool known = std::isfinite(row.controller_difference);
  if (known || row.controller_differs) ++seen;
  if (!row.controller_differs) return;
  ++differing;
  if (known) difference = row.controller_difference;
}

online::AxisCounts since(const online::AxisCounts& now, const online::AxisCounts& then) {
  return {now.rows - then.rows,           now.ready - then.ready,
          now.lost - then.lost,           now.excited - then.excited,
          now.converged - then.converged, now.physical - then.physical,
          now.residual - then.residual,   now.all - then.all};
}

TrustShares shares_of(const online::AxisCounts& n) {
  return {share(n.excited, n.ready), share(n.converged, n.excited), share(n.physical, n.excited),
          share(n.residual, n.excited), share(n.all, n.ready)};
}

std::vector<Finding> run_findings(const online::Axis& axis, const online::AxisCounts& counts,
                                  const ControllerRows& controller, const TrackPlan& plan,
                                  const AxisSetup& setup, double start_time_s) {
  Findings findings;
  inspect_gates(axis, counts, findings);
  inspect_controller(controller, findings);
  inspect_change(axis.result(), start_time_s, findings);
  inspect_stability(axis.result().stability, plan.method, findings);
  if (!setup.start_b.empty() && std::abs(setup.fractional_delay) > kNoticeable)
    findings.push_back({"fractional-delay", Severity::info, setup.fractional_delay, kNoticeable,
                        fmt::format("{} models whole samples of delay only: the other {:+.2f} samples became "
                                    "part of the model's zeros. physical takes any delay.",
                                    name_of(plan.method), setup.fractional_delay)});
  return findings;
}

std::vector<Finding> learning_findings(const TrackOptions& options, const TrackPlan& plan,
                                       const AxisSetup& setup) {
  Findings findings;
  if (options.whole_record)
    findings.push_back(
        {"whole-record",
         Severity::info,
         {},
         {},
         "Method, excitation and initial model were chosen from the whole recording: the rows use "
         "later samples, which a drive would not have had. For an on-line test learn from a stretch "
         "(.learn_s)."});
  if (!plan.start) return findings;
  const double further = plan.delay_s - options.common.delay_s;
  if (std::abs(further) * setup.config.sample_rate_hz > kNoticeable)
    findings.push_back({"further-delay",
                        Severity::info,
                        further,
                        {},
                        fmt::format("The initial model has a delay of {:.3g} ms where {:.3g} ms were given: "
                                    "the model's delay is used, in the margins too. Check the delay given.",
                                    1e3 * plan.delay_s, 1e3 * options.common.delay_s)});
  const auto& drive = plan.start->drive;
  // A held output is late by the mean of its hold.
  const auto hold = static_cast<double>(plan.measurement.hold.samples);
  const double lag_s =
      drive.torque_lag_s + drive.output_filter_s + 0.5 * (hold - 1.0) / setup.config.sample_rate_hz;
  if (lag_s * setup.config.sample_rate_hz > kNoticeable)
    findings.push_back(
        {"untracked-lag", Severity::error, lag_s, kNoticeable / setup.config.sample_rate_hz,
         fmt::format(
             "{} lags by {:.3g} ms, which no estimator here models: inertias and damping take it over, and "
             "the "
             "margins lack it. Use identify on parts of the recording.",
             hold > 1.0
                 ? fmt::format(
                       "Torque loop, output filter or an output that is new in every {:g}th sample only",
                       hold)
                 : "Torque loop or output filter",
             1e3 * lag_s)});
  if (!plan.start->trusted)
    findings.push_back({"untrusted-start",
                        Severity::error,
                        {},
                        {},
                        "The initial model is itself not reliable (`identify` says why), and what is tracked "
                        "from it has its "
                        "structure and delay. Give .start, or the right input, output and delay."});
  return findings;
}

std::vector<Finding> gap_findings(const data::Record& record) {
  if (record.sampling.gaps == 0) return {};
  return {{"shifted-times", Severity::error, static_cast<double>(record.sampling.gaps), 0.0,
           fmt::format("Samples are missing (the longest gap is {:.3g} s, the first at {:.6g} s): the times "
                       "of rows after a gap are too early by its length, and the estimators ran on as if "
                       "nothing were missing. Track the parts separately with .from_s and .to_s.",
                       record.sampling.largest_gap_s, record.sampling.first_gap_at_s)}};
}

}  // namespace resonid::identification::detail
