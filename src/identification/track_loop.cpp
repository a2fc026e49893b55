// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/track_loop.hpp>
#include <identification/track_plan.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/gap.hpp>

namespace resonid::identification::detail {
namespace {

using Complex = std::complex<double>;
constexpr int kGridPoints = 200;
constexpr int kNearPoints = 160;   // further ones around the resonance
constexpr double kNearSpan = 1.4;  // as far as this factor
constexpr double kMovedBy = 0.01;  // relative: the points follow then

bool finite(Complex z) { return std::isfinite(z.real()) && std::isfinite(z.imag()); }

std::vector<double> log_grid(double low_hz, double high_hz, int points) {
  std::vector<double> grid;
  for (int i = 0; i < points; ++i)
    grid.push_back(low_hz * std::pow(high_hz / low_hz, static_cast<double>(i) / (points - 1)));
  return grid;
}

}  // namespace

LoopFigures::LoopFigures(const data::Record& record, const TrackOptions& options, const TrackPlan& plan)
    : controller_(options.common.controller), baseline_(options.baseline), delay_s_(plan.delay_s) {
  const double nyquist = 0.5 * record.sample_rate_hz;
  const double low = plan.measurement.low_hz > 0.0 ? std::min(0.1 * plan.measurement.low_hz, 0.01 * nyquist)
                                                   : 0.001 * nyquist;
  grid_hz_ = log_grid(std::max(low, 1e-5 * nyquist), 0.998 * nyquist, kGridPoints);
  model_hz_ = grid_hz_;
  if (!baseline_) return;
  if (baseline_->model) {
    auto drive = baseline_->model->drive;
    drive.sample_time_s = record.sample_time_s();
    baseline_model_ = drive.transfer_function();
  }
  const auto& response = baseline_->response;
  if (response.lines() == 0 && !baseline_->model) {
    baseline_.reset();
    return;
  }
  gap_low_hz_ = response.lines() > 0 ? response.frequency_hz.front() : grid_hz_.front();
  gap_high_hz_ = response.lines() > 0 ? response.frequency_hz.back() : grid_hz_.back();
  std::vector<double> gains;
  for (const double f : grid_hz_)
    if (f >= gap_low_hz_ && f <= gap_high_hz_) gains.push_back(std::abs(baseline_at(f)));
  if (gains.empty()) return;
  std::nth_element(gains.begin(), gains.begin() + static_cast<std::ptrdiff_t>(gains.size() / 2), gains.end());
  scale_ = 1.0 / gains[gains.size() / 2];
}

Complex LoopFigures::baseline_at(double f) const {
  return baseline_model_ ? baseline_model_->response(f) : baseline_->response.at(f);
}

std::optional<data::FrequencyResponse> LoopFigures::baseline_loop() const {
  if (!baseline_ || !controller_) return std::nullopt;
  data::FrequencyResponse loop;
  for (const double f : grid_hz_) {
    if (!baseline_->model && (f < gap_low_hz_ || f > gap_high_hz_)) continue;
    loop.frequency_hz.push_back(f);
    loop.value.push_back(baseline_at(f) * controller_->response(f) * std::polar(1.0, -kTwoPi * f * delay_s_));
  }
  return loop;
}

/// A resonance turns the curve within a small part of its frequency: more points there, so that margins on
/// the chords between them are good to three digits.
void LoopFigures::follow(double resonance_hz) {
  if (!(resonance_hz > 0.0) || std::abs(resonance_hz - near_hz_) <= kMovedBy * near_hz_) return;
  near_hz_ = resonance_hz;
  model_hz_ = grid_hz_;
  const auto near = log_grid(resonance_hz / kNearSpan, resonance_hz * kNearSpan, kNearPoints);
  for (const double f : near)
    if (f > grid_hz_.front() && f < grid_hz_.back()) model_hz_.push_back(f);
  std::sort(model_hz_.begin(), model_hz_.end());
}

void LoopFigures::use_frequencies(std::span<const double> frequency_hz) {
  if (std::equal(frequency_hz.begin(), frequency_hz.end(), frequency_hz_.begin(), frequency_hz_.end()))
    return;
  frequency_hz_.assign(frequency_hz.begin(), frequency_hz.end());
  const std::size_t points = frequency_hz_.size();
  factor_.assign(points, 1.0);
  weight_.assign(points, scale_);
  reference_.assign(points, kUnknown);
  plant_.resize(points);
  for (std::size_t i = 0; i < points; ++i) {
    const double f = frequency_hz_[i];
    if (controller_) {
      weight_[i] = controller_->response(f);
      factor_[i] = weight_[i] * std::polar(1.0, -kTwoPi * f * delay_s_);
    }
    if (baseline_ && f >= gap_low_hz_ * (1.0 - 1e-9) && f <= gap_high_hz_ * (1.0 + 1e-9))
      reference_[i] = weight_[i] * baseline_at(f);
  }
}

void LoopFigures::update(OnlineTracker& tracker) {
  known_ = false;
  gap_ = kUnknown;
  if (!controller_ && !baseline_) return;
  const auto own = tracker.own_frequencies_hz();
  if (tracker.answers_anywhere()) {
    follow(tracker.resonance().value);
    use_frequencies(model_hz_);
  } else {
    if (own.size() < 2 || !tracker.ready()) return;
    use_frequencies(own);
  }
  tracker.response(frequency_hz_, plant_);
  if (!std::all_of(plant_.begin(), plant_.end(), finite)) return;
  for (std::size_t i = 0; i < plant_.size(); ++i) {
    if (!finite(reference_[i])) continue;
    const double distance = diagnostics::chordal_distance(weight_[i] * plant_[i], reference_[i]);
    if (!(distance <= gap_)) gap_ = distance;
  }
  if (!controller_) return;
  curve_.frequency_hz = frequency_hz_;
  curve_.value.resize(plant_.size());
  for (std::size_t i = 0; i < plant_.size(); ++i) curve_.value[i] = factor_[i] * plant_[i];
  margins_ = diagnostics::loop_margins(curve_);
  known_ = true;
}

}  // namespace resonid::identification::detail
