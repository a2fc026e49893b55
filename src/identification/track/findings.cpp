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

constexpr double kColoured = 0.15;       // practical limit of a correlation (METHOD 9)
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
        "The estimator never got beyond its start: the record is too short, nothing excited the drive, or "
        "the model to begin with is not that of this machine.");
    return;
  }
  const TrustShares s = shares_of(n);
  if (s.excited < 1.0)
    add(findings, "no-excitation", s.excited < kEnoughExcited, result.weakest_excitation,
        criteria.weak_excitation,
        fmt::format(
            "For {:.1f} % of the time the excitation around the resonance was below a tenth of what it "
            "had been: the estimate is held there and not trusted.",
            100.0 * (1.0 - s.excited)));
  if (n.excited == 0) return;
  if (s.converged < 1.0) {
    const auto& row = axis.row();
    const bool known = std::isfinite(row.uncertainty);
    add(findings, "not-converged", s.converged < kEnough, known ? row.uncertainty : s.converged,
        known ? row.most_uncertainty : 1.0,
        fmt::format(
            "For {:.1f} % of the time the estimate was too uncertain ({:.2g} % is required), not at rest, "
            "or showed no resonance.",
            100.0 * (1.0 - s.converged), 100.0 * row.most_uncertainty));
  }
  if (n.lost > 0)
    add(findings, "lost", share(n.lost, n.ready) > kLost, share(n.lost, n.ready), kLost,
        fmt::format("For {:.2g} % of the time after it had begun, the estimator was not in step with the "
                    "machine: what it predicted did not happen, or it had to begin anew.",
                    100.0 * share(n.lost, n.ready)));
  if (s.physical < 1.0)
    add(findings, "unphysical", s.physical < kEnough, s.physical, 1.0,
        fmt::format(
            "For {:.1f} % of the time the estimate was no machine: unstable, or an inertia, stiffness "
            "or damping below zero.",
            100.0 * (1.0 - s.physical)));
  if (s.residual < 1.0)
    add(findings, "residual-grown", s.residual < kEnough, result.worst_residual_growth,
        criteria.residual_growth,
        fmt::format(
            "The residual grew to {:.1f} times its usual rms: the machine did something that the model "
            "does not know, or changed faster than the estimate follows.",
            result.worst_residual_growth));
  if (axis.white_residual() && std::abs(result.residual_correlation) > kColoured)
    findings.push_back(
        {"coloured-residual", Severity::info, result.residual_correlation, kColoured,
         "Neighbouring residuals are correlated: the noise is not white or the model misses something; the "
         "error bars are then too small."});
}

/// Whether a small error of the parameters would have grown.
void inspect_stability(const online::AxisStability& s, TrackMethod method, Findings& findings) {
  if (kUnstableShare * static_cast<double>(s.watched) < static_cast<double>(s.unstable))
    add(findings, "locally-unstable", true, s.least_eigenvalue, 0.0,
        fmt::format("{} is driven away from the right parameters of this machine: it is damped too "
                    "little for so fast a sampling. Use d-cloe, iv or physical.",
                    name_of(method)));
  if (s.restarts > 0)
    add(findings, "predictor-lost", true, static_cast<double>(s.restarts), 0.0,
        "The predictor ran away from the measured output and was started again: the estimate "
        "is not to be trusted. Use d-cloe, iv or physical.");
}

void inspect_controller(const online::AxisRow& row, Findings& findings) {
  if (!row.controller_differs) return;
  const double off = row.controller_difference;  // not known to a figure yet: not a number
  findings.push_back(
      {"controller-differs", Severity::error, std::isfinite(off) ? std::optional(off) : std::nullopt,
       online::ControllerCheck<double>::kRelevant,
       fmt::format(
           "The controller told is not the one that ran: excitation, input and output show another one{}. "
           "The margins are not those of this loop, and methods that use the controller are wrong.",
           std::isfinite(off) ? fmt::format(", which differs from it by up to {:.0f} %", 100.0 * off)
                              : std::string())});
}

void inspect_change(const online::AxisResult& result, double start_time_s, Findings& findings) {
  if (!result.changed) return;
  const auto& c = result.change;
  add(findings, "changed", false, c.size, c.size_std,
      fmt::format(
          "From {:.4g} s on the watched figure was another one, by {:.4g} +- {:.2g}; it was noticed at "
          "{:.4g} s.",
          start_time_s + c.time_s, c.size, 2.0 * c.size_std, start_time_s + c.detected_s));
}

}  // namespace

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
                                  const TrackPlan& plan, const AxisSetup& setup, double start_time_s) {
  Findings findings;
  inspect_gates(axis, counts, findings);
  inspect_controller(axis.row(), findings);
  inspect_change(axis.result(), start_time_s, findings);
  inspect_stability(axis.result().stability, plan.method, findings);
  if (!setup.start_b.empty() && std::abs(setup.left_of_delay) > kNoticeable)
    findings.push_back(
        {"fractional-delay", Severity::info, setup.left_of_delay, kNoticeable,
         fmt::format("{} knows whole samples of delay only: {:+.2f} samples of it became part of the "
                     "model's zeros. physical takes any delay.",
                     name_of(plan.method), setup.left_of_delay)});
  return findings;
}

std::vector<Finding> learning_findings(const TrackOptions& options, const TrackPlan& plan,
                                       const AxisSetup& setup) {
  Findings findings;
  if (options.whole_record)
    findings.push_back({"whole-record",
                        Severity::info,
                        {},
                        {},
                        "Method, excitation and start were decided from the whole record: the rows know what "
                        "came after them, "
                        "which a drive would not have known."});
  if (!plan.start) return findings;
  const double further = plan.delay_s - options.common.delay_s;
  if (std::abs(further) * setup.config.sample_rate_hz > kNoticeable)
    findings.push_back(
        {"further-delay",
         Severity::info,
         further,
         {},
         fmt::format("The model to begin with has {:.3g} ms of delay where {:.3g} ms were given: "
                     "its own is used, in the margins too.",
                     1e3 * plan.delay_s, 1e3 * options.common.delay_s)});
  if (!plan.start->trusted)
    findings.push_back(
        {"untrusted-start",
         Severity::error,
         {},
         {},
         "The model to begin with is itself not to be trusted (`identify` says why), and what is tracked "
         "from "
         "it has its structure and its delay. Give .start, or input, output and delay as they are."});
  return findings;
}

std::vector<Finding> gap_findings(const data::Record& record) {
  if (record.sampling.gaps == 0) return {};
  return {{"shifted-times", Severity::error, static_cast<double>(record.sampling.gaps), 0.0,
           fmt::format(
               "Samples are missing (the longest gap is {:.3g} s, the first at {:.6g} s): rows after a gap "
               "carry times that are too early by it, and estimators ran on as if nothing were missing. "
               "Track the parts by themselves with .from_s and .to_s.",
               record.sampling.largest_gap_s, record.sampling.first_gap_at_s)}};
}

}  // namespace resonid::identification::detail
