// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/track_plan.hpp>
#include <identification/track_trust.hpp>
#include <resonid/base/constants.hpp>

namespace resonid::identification::detail {
namespace {

using diagnostics::Finding;
using diagnostics::Severity;

constexpr double kWeakExcitation = 0.1;   // of the strongest rms so far
constexpr double kRestless = 0.1;         // relative distance from its mean over the last stretch
constexpr double kResidualGrowth = 3.0;   // rms, against the usual one
constexpr double kUsualStretches = 20.0;  // memory of what is usual, in stretches
constexpr double kColoured = 0.15;        // practical limit of a correlation (METHOD 9)
constexpr double kEnough = 0.8;           // share of the rows
constexpr double kLost = 0.05;            // share of the rows
constexpr double kEnoughExcited = 0.5;    // likewise: a drive need not be excited all the time

/// Frequency about which excitation is looked for.
double centre_hz(const data::Record& record, const TrackPlan& plan) {
  if (plan.start && plan.start->drive.structure == fit::Structure::two_mass)
    return plan.start->drive.resonance().value;
  if (plan.measurement.low_hz > 0.0) return std::sqrt(plan.measurement.low_hz * plan.measurement.high_hz);
  return 0.1 * record.sample_rate_hz;
}

/// A stretch of the record: twenty periods of the resonance, a quarter of a second at least.
double stretch_samples(const data::Record& record, const TrackPlan& plan) {
  return std::max(0.25, 20.0 / centre_hz(record, plan)) * record.sample_rate_hz;
}

double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

TrustGates::TrustGates(const data::Record& record, const TrackPlan& plan)
    : has_excitation_(record.excitation.present()), sweep_(plan.measurement.sweep.has_value()) {
  const double centre = centre_hz(record, plan) / record.sample_rate_hz;
  high_pass_ = 1.0 - std::exp(-kTwoPi * 0.2 * centre);
  low_pass_ = 1.0 - std::exp(-kTwoPi * 3.0 * centre);
  const double stretch = stretch_samples(record, plan);
  excitation_ = residual_ = resonance_ = FadingLevel(stretch);
  usual_residual_ = correlation_ = lagged_power_ = FadingLevel(kUsualStretches * stretch);
  if (plan.start && !plan.start->whole_record) start_samples_ = plan.start->samples;
}

/// The part of a signal from a fifth to three times the resonance; a sweep counts wherever it is.
double TrustGates::banded(double x) {
  if (sweep_) return x;
  slow_ += high_pass_ * (x - slow_);
  smooth_ += low_pass_ * (x - slow_ - smooth_);
  return smooth_;
}

void TrustGates::sample(double ru, double u, double residual) {
  ++samples_;
  const double x = banded(has_excitation_ ? ru : u);
  if (std::isfinite(x)) excitation_.add(x * x);
  if (excitation_.filled()) strongest_ = std::max(strongest_, excitation_.value());
  if (!std::isfinite(residual)) return;
  residual_.add(residual * residual);
  usual_residual_.add(residual * residual);
  if (std::isfinite(last_residual_)) {
    correlation_.add(residual * last_residual_);
    lagged_power_.add(residual * residual);
  }
  last_residual_ = residual;
}

bool TrustGates::excited() const {
  const double now = excitation_.value();
  return now > 0.0 && now >= kWeakExcitation * kWeakExcitation * strongest_;
}

bool TrustGates::converged(OnlineTracker& tracker, OnlineValue resonance) {
  if (!tracker.ready()) return false;
  uncertainty_ = tracker.uncertainty();
  most_uncertainty_ = tracker.most_uncertainty();
  if (!tracker.finds_resonance()) return uncertainty_ <= most_uncertainty_;
  if (!std::isfinite(resonance.value)) return false;
  resonance_.add(resonance.value, static_cast<double>(samples_ - judged_samples_));
  judged_samples_ = samples_;
  const double mean = resonance_.value();
  return !(uncertainty_ > most_uncertainty_) && std::abs(resonance.value - mean) <= kRestless * mean;
}

bool TrustGates::residual_holds(bool known) {
  if (!known || !residual_.filled() || !(usual_residual_.value() > 0.0)) return true;
  const double growth = std::sqrt(residual_.value() / usual_residual_.value());
  worst_growth_ = std::max(worst_growth_, growth);
  return growth <= kResidualGrowth;
}

Gates TrustGates::judge(OnlineTracker& tracker, OnlineValue resonance) {
  Gates gates;
  gates.ready = tracker.ready() && samples_ > start_samples_;
  gates.excited = excited() && tracker.excited();
  gates.converged = converged(tracker, resonance);
  gates.physical = tracker.physical();
  gates.residual = residual_holds(std::isfinite(last_residual_));
  ++rows_;
  if (ready_ == 0 && !gates.ready) return gates;
  ++ready_;  // from the first one on every row counts: an estimator that loses its way is not ready again
  if (gates.excited) {
    ++excited_rows_;
    if (!gates.ready) ++lost_;
    if (gates.ready && gates.converged) ++converged_;
    if (gates.physical) ++physical_;
    if (gates.residual) ++residual_rows_;
  }
  if (gates.all()) ++all_;
  if (strongest_ > 0.0) weakest_ = std::min(weakest_, std::sqrt(excitation_.value() / strongest_));
  return gates;
}

double TrustGates::residual_rms() const {
  return std::isfinite(last_residual_) ? std::sqrt(residual_.value()) : kUnknown;
}

TrustShares TrustGates::shares() const {
  return {share(excited_rows_, ready_), share(converged_, excited_rows_), share(physical_, excited_rows_),
          share(residual_rows_, excited_rows_), share(all_, ready_)};
}

void TrustGates::inspect(const OnlineTracker& tracker, std::vector<Finding>& findings) const {
  const auto say = [&](const char* id, bool bad, double value, double threshold, std::string meaning) {
    findings.push_back({id, bad ? Severity::error : Severity::warning, value, threshold, std::move(meaning)});
  };
  if (ready_ == 0) {
    say("never-ready", true, static_cast<double>(rows_), 0.0,
        "The estimator never got beyond its start: the record is too short, nothing excited the drive, or "
        "the model to "
        "begin with is not that of this machine.");
    return;
  }
  const TrustShares s = shares();
  if (s.excited < 1.0)
    say("no-excitation", s.excited < kEnoughExcited, weakest_, kWeakExcitation,
        fmt::format(
            "For {:.1f} % of the time the excitation around the resonance was below a tenth of what it "
            "had been: the estimate is held there and not trusted.",
            100.0 * (1.0 - s.excited)));
  if (excited_rows_ == 0) return;
  if (s.converged < 1.0) {
    const bool known = std::isfinite(uncertainty_);
    say("not-converged", s.converged < kEnough, known ? uncertainty_ : s.converged,
        known ? most_uncertainty_ : 1.0,
        fmt::format(
            "For {:.1f} % of the time the estimate was too uncertain ({:.2g} % is required), not at rest, "
            "or showed no resonance.",
            100.0 * (1.0 - s.converged), 100.0 * most_uncertainty_));
  }
  if (lost_ > 0)
    say("lost", share(lost_, ready_) > kLost, share(lost_, ready_), kLost,
        fmt::format("For {:.2g} % of the time after it had begun, the estimator was not in step with the "
                    "machine: what it "
                    "predicted did not happen, or it had to begin anew.",
                    100.0 * share(lost_, ready_)));
  if (s.physical < 1.0)
    say("unphysical", s.physical < kEnough, s.physical, 1.0,
        fmt::format(
            "For {:.1f} % of the time the estimate was no machine: unstable, or an inertia, stiffness "
            "or damping below zero.",
            100.0 * (1.0 - s.physical)));
  if (s.residual < 1.0)
    say("residual-grown", s.residual < kEnough, worst_growth_, kResidualGrowth,
        fmt::format(
            "The residual grew to {:.1f} times its usual rms: the machine did something that the model "
            "does not know, or changed faster than the estimate follows.",
            worst_growth_));
  if (tracker.white_residual() && lagged_power_.value() > 0.0) {
    const double r = correlation_.value() / lagged_power_.value();
    if (std::abs(r) > kColoured)
      findings.push_back(
          {"coloured-residual", Severity::info, r, kColoured,
           "Neighbouring residuals are correlated: the noise is not white or the model misses something; the "
           "error bars are then too small."});
  }
}

}  // namespace resonid::identification::detail
