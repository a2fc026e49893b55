// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/loop.hpp>
#include <resonid/base/constants.hpp>

namespace resonid::identification::detail {
namespace {

using Complex = std::complex<double>;
using diagnostics::LoopMargins;

/// Logarithmic grid, dense enough that a chord of the Nyquist curve is as good as the curve.
std::vector<double> dense_grid(double low_hz, double high_hz) {
  constexpr int kPoints = 1500;
  std::vector<double> grid;
  grid.reserve(kPoints);
  for (int i = 0; i < kPoints; ++i)
    grid.push_back(low_hz * std::pow(high_hz / low_hz, static_cast<double>(i) / (kPoints - 1)));
  return grid;
}

class Loop {
 public:
  Loop(const Options& options, const data::FrequencyResponse& controller)
      : options_(options), controller_(controller) {}

  [[nodiscard]] data::FrequencyResponse curve(const fit::DriveModel& drive,
                                              const std::vector<double>& grid) const {
    auto loop = drive.response(grid);
    const double delay = options_.delay_s + drive.delay_s;
    for (std::size_t i = 0; i < grid.size(); ++i) {
      const Complex factor = controller_at(grid[i]) * std::polar(1.0, -kTwoPi * grid[i] * delay);
      loop.value[i] *= factor;
      loop.standard_deviation[i] *= std::abs(factor);
    }
    return loop;
  }

  [[nodiscard]] Complex controller_at(double f) const {
    return options_.controller ? options_.controller->response(f) : controller_.at(f);
  }

 private:
  const Options& options_;
  const data::FrequencyResponse& controller_;
};

LoopResult from_model(const Loop& loop, const std::vector<double>& grid, const fit::DriveModel& drive) {
  LoopResult result;
  result.source = "model";
  result.curve = loop.curve(drive, grid);
  result.margins = diagnostics::loop_margins(result.curve);
  const auto value = [&](const fit::DriveModel& m, auto&& part) {
    auto plain = m;
    plain.estimated.fill(false);  // no standard deviations of the moved model
    return part(diagnostics::loop_margins(loop.curve(plain, grid)));
  };
  if (result.margins.crossover_hz()) {
    result.crossover_std_hz = drive.standard_deviation_of([&](const fit::DriveModel& m) {
      return value(m, [](const LoopMargins& l) { return l.crossover_hz().value_or(0.0); });
    });
    result.phase_margin_std_deg = drive.standard_deviation_of([&](const fit::DriveModel& m) {
      return value(m, [](const LoopMargins& l) { return l.phase_margin_deg().value_or(0.0); });
    });
  }
  if (result.margins.gain_margin_db) {
    result.gain_margin_std_db = drive.standard_deviation_of([&](const fit::DriveModel& m) {
      return value(m, [](const LoopMargins& l) { return l.gain_margin_db.value_or(0.0); });
    });
  }
  result.modulus_margin_std = drive.standard_deviation_of([&](const fit::DriveModel& m) {
    return value(m, [](const LoopMargins& l) { return l.modulus_margin; });
  });
  return result;
}

LoopResult from_response(const data::FrequencyResponse& curve) {
  LoopResult result;
  result.source = "response";
  result.curve = curve;
  result.margins = diagnostics::loop_margins(curve);
  return result;
}

}  // namespace

std::optional<LoopResult> loop_of(const Plan& plan, const Options& options,
                                  const response::LineEstimates& lines,
                                  const data::FrequencyResponse& response,
                                  const std::optional<ModelResult>& model) {
  data::FrequencyResponse controller;
  if (!options.controller) {
    auto measured = response::controller_response(lines);
    if (!measured || measured->lines() < 2) return std::nullopt;
    if (lines.output_quantity !=
        data::OutputQuantity::velocity) {  // the controller sees the recorded quantity
      const auto loop = response::loop_response(lines);
      if (!loop) return std::nullopt;
      return from_response(*loop);
    }
    controller = std::move(*measured);
  }
  const Loop loop(options, controller);
  if (model) {
    const double nyquist = 0.499 / lines.sample_time_s;
    const double low =
        options.controller ? std::min(0.1 * plan.low_hz, 0.01 * nyquist) : controller.frequency_hz.front();
    const double high = options.controller ? nyquist : controller.frequency_hz.back();
    return from_model(loop, dense_grid(std::max(low, 1e-6 * nyquist), high), model->drive);
  }
  if (!options.controller) {
    const auto measured = response::loop_response(lines);
    if (!measured) return std::nullopt;
    return from_response(*measured);
  }
  auto curve = response;
  for (std::size_t i = 0; i < curve.lines(); ++i) {
    const double f = curve.frequency_hz[i];
    const Complex factor = loop.controller_at(f) * std::polar(1.0, -kTwoPi * f * options.delay_s);
    curve.value[i] *= factor;
    if (!curve.standard_deviation.empty()) curve.standard_deviation[i] *= std::abs(factor);
  }
  return from_response(curve);
}

}  // namespace resonid::identification::detail
