// SPDX-License-Identifier: MIT
// Flexible robot arm (its README beside the recording): a model of the PRBS record simulates the square-wave
// record. What is chosen is chosen on the PRBS record; the square wave only judges.
#include <cmath>
#include <numbers>
#include <recordings.hpp>
#include <resonid/fit/order_selection.hpp>
#include <resonid/io/record_reader.hpp>

namespace resonid {
namespace {

using Samples = std::vector<double>;

/// Voltage to the rate of the tip's angle, 34.18 theta - 3.307 strain, in degrees per second.
data::Record tip_rate(const std::filesystem::path& path) {
  const auto column = [&](const char* name) {
    io::ColumnMapping columns;
    columns.input = "u_V";
    columns.output = name;
    columns.output_quantity = data::OutputQuantity::position;
    return io::read_record(path, columns).value();
  };
  auto record = column("theta_motor_V");
  const auto strain = column("strain_V");
  auto& y = record.output.samples;
  for (std::size_t k = 0; k < y.size(); ++k) y[k] = 34.18 * y[k] - 3.307 * strain.output.samples[k];
  for (std::size_t k = y.size(); k-- > 1;) y[k] = (y[k] - y[k - 1]) * record.sample_rate_hz;
  y[0] = y[1];
  record.output_quantity = data::OutputQuantity::velocity;
  return record;
}

/// Butterworth low-pass of order 4 (bilinear transform), from the steady state of the first sample.
Samples low_passed(Samples x, double cut_off_hz, double sample_rate_hz) {
  const double w = std::tan(std::numbers::pi * cut_off_hz / sample_rate_hz);
  for (const double q : {0.541196100146197, 1.30656296487638}) {
    const double n = 1.0 / (1.0 + w / q + w * w);
    const double gain = w * w * n, a1 = 2.0 * (w * w - 1.0) * n, a2 = (1.0 - w / q + w * w) * n;
    double x1 = x[0], x2 = x[0], y1 = x[0], y2 = x[0];
    for (double& v : x) {
      const double y = gain * (v + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
      x2 = x1;
      x1 = v;
      y2 = y1;
      y1 = y;
      v = y;
    }
  }
  return x;
}

double fit_percent(const Samples& y, const Samples& error) {
  double mean = 0.0, total = 0.0, left = 0.0;
  for (const double v : y) mean += v / static_cast<double>(y.size());
  for (std::size_t k = 0; k < y.size(); ++k) {
    total += (y[k] - mean) * (y[k] - mean);
    left += error[k] * error[k];
  }
  return 100.0 * (1.0 - std::sqrt(left / total));
}

TEST(FlexibleArm, PrbsModelSimulatesTheSquareWave) {
  RESONID_RECORDING_OR_SKIP(path, "ist_flexible_arm/prbs.csv");
  const auto prbs = tip_rate(path), square = tip_rate(path.parent_path() / "square.csv");
  fit::OrderSelectionConfig config;
  config.highest = 8;
  const auto chosen = fit::select_order(prbs, config);
  ASSERT_TRUE(chosen.has_value());
  EXPECT_TRUE(chosen->fit.stable);
  const auto error = fit::simulation_residual(square, chosen->fit.model, config.model);
  ASSERT_TRUE(error.has_value());
  ASSERT_EQ(error->size(), square.samples());
  constexpr double kCutOffHz = 5.0;  // above the arm's modes at 3.4 and 4.0 Hz
  const double rate = square.sample_rate_hz;
  const double reached =
      fit_percent(low_passed(square.output.samples, kCutOffHz, rate), low_passed(*error, kCutOffHz, rate));
  RecordProperty("order", chosen->order);
  RecordProperty("fit_percent", std::to_string(reached));
  EXPECT_GT(reached, 90.0) << "order " << chosen->order;
}

}  // namespace
}  // namespace resonid
