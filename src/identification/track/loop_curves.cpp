// SPDX-License-Identifier: MIT
#include <cmath>
#include <identification/track/loop_curves.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/online/supervision/detail/loop_grid.hpp>

namespace resonid::identification::detail {
namespace {

using Complex = std::complex<double>;

bool finite(Complex z) { return std::isfinite(z.real()) && std::isfinite(z.imag()); }

}  // namespace

LoopCurves::LoopCurves(const TrackOptions& options, const TrackPlan& plan, const AxisSetup& setup)
    : setup_(setup), controller_(options.common.controller), delay_s_(plan.delay_s) {}

Complex LoopCurves::controller_and_delay(double f) const {
  return controller_->response(f) * std::polar(1.0, -kTwoPi * f * delay_s_);
}

std::optional<data::FrequencyResponse> LoopCurves::baseline() const {
  if (!controller_ || setup_.baseline_hz.empty()) return std::nullopt;
  data::FrequencyResponse loop;
  loop.frequency_hz = setup_.baseline_hz;
  for (std::size_t i = 0; i < setup_.baseline.size(); ++i)
    loop.value.push_back(setup_.baseline[i] * controller_and_delay(loop.frequency_hz[i]));
  return loop;
}

data::FrequencyResponse LoopCurves::curve(const online::Axis& axis) const {
  data::FrequencyResponse loop;
  const auto add = [&](double f, Complex plant) {
    if (!finite(plant)) return;
    loop.frequency_hz.push_back(f);
    loop.value.push_back(plant * controller_and_delay(f));
  };
  if (axis.has_model()) {
    online::detail::LoopGrid grid(setup_.config.sample_rate_hz, setup_.config.loop_from_hz);
    for (grid.begin(axis.row().resonance_hz.value); !grid.done(); grid.advance())
      add(grid.hz(), axis.response(grid.hz()));
  } else if (setup_.config.method == online::AxisMethod::chirp) {
    for (const auto& [f, plant] : swept_) add(f, plant);
  } else {
    for (std::size_t i = 0; i < axis.lines(); ++i)
      if (const auto line = axis.line(i); line.settled) add(line.frequency_hz, line.response);
  }
  return loop;
}

void LoopCurves::add(const online::Axis& axis, double time_s) {
  if (!controller_) return;
  if (setup_.config.method == online::AxisMethod::chirp) {
    constexpr double kPoints = 500.0;
    const auto line = axis.line(0);
    const double width = std::abs(setup_.config.sweep.to_hz - setup_.config.sweep.from_hz) / kPoints;
    if (line.settled && finite(line.response))
      swept_.try_emplace(width * std::round(line.frequency_hz / width), line.response);
  }
  newest_s_ = time_s;
  if (rows_++ % stride_ != 0) return;
  auto now = curve(axis);
  if (now.lines() < 2) return;
  kept_.push_back({time_s, std::move(now)});
  if (kept_.size() <= kMost) return;
  for (std::size_t i = 1; 2 * i < kept_.size(); ++i) kept_[i] = std::move(kept_[2 * i]);
  kept_.resize((kept_.size() + 1) / 2);
  stride_ *= 2;
}

std::vector<LoopSnapshot> LoopCurves::take(const online::Axis& axis) {
  if (controller_ && (kept_.empty() || kept_.back().time_s < newest_s_))
    if (auto now = curve(axis); now.lines() > 1) kept_.push_back({newest_s_, std::move(now)});
  return std::move(kept_);
}

}  // namespace resonid::identification::detail
