// SPDX-License-Identifier: MIT
// Flexible robot arm (its README beside the recording): a model of the PRBS record simulates the square-wave
// record. What is chosen is chosen on the PRBS record; the square wave only judges.
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <numeric>
#include <recordings.hpp>
#include <resonid/fit/detail/order_selection.hpp>
#include <resonid/io/record_reader.hpp>
#include <resonid/response/detail/power_spectrum.hpp>

namespace resonid {
namespace {

using Samples = std::vector<double>;

/// Voltage to the rate of the tip's angle in degrees per second.
data::Record tip_rate(const std::filesystem::path& path) {
  io::ColumnMapping columns;
  columns.input = "u_V";
  columns.output = "34.18*theta_motor_V - 3.307*strain_V";
  columns.output_quantity = data::OutputQuantity::position;
  columns.differentiate = true;
  columns.output_unit = "deg/s";
  return io::read_record(path, columns).value();
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

constexpr double kCutOffHz = 5.0;    // above the arm's modes at 3.4 and 4.0 Hz
constexpr std::size_t kStart = 300;  // samples, 6 s

/// A model of one record simulated on another: what both come to behind the low-pass.
struct Simulated {
  Samples output, residual;

  Simulated(const data::Record& record, const fit::BlackBoxModel& model) {
    const auto error = fit::simulation_residual(record, model, {}).value();
    output = low_passed(record.output.samples, kCutOffHz, record.sample_rate_hz);
    residual = low_passed(error, kCutOffHz, record.sample_rate_hz);
  }
  [[nodiscard]] double fit(std::size_t from, std::size_t to) const {
    const auto part = [&](const Samples& x) {
      return Samples(x.begin() + static_cast<std::ptrdiff_t>(from),
                     x.begin() + static_cast<std::ptrdiff_t>(to));
    };
    return fit_percent(part(output), part(residual));
  }
  [[nodiscard]] double fit() const { return fit(0, output.size()); }
};

class FlexibleArm : public ::testing::Test {
 protected:
  void SetUp() override {
    RESONID_RECORDING_OR_SKIP(path, "ist_flexible_arm/prbs.csv");
    prbs_ = tip_rate(path);
    square_ = tip_rate(path.parent_path() / "square.csv");
    fit::OrderSelectionConfig config;
    config.highest = 8;
    const auto chosen = fit::select_order(prbs_, config);
    ASSERT_TRUE(chosen.has_value());
    EXPECT_TRUE(chosen->fit.stable);
    model_ = chosen->fit.model;
    RecordProperty("order", chosen->order);
  }
  void report(const char* name, double value) {
    RecordProperty(name, std::to_string(value));
    std::printf("%s %.4f\n", name, value);
  }

  data::Record prbs_, square_;
  fit::BlackBoxModel model_;
};

TEST_F(FlexibleArm, PrbsModelSimulatesTheSquareWave) {
  const Simulated square(square_, model_);
  report("fit_percent", square.fit());
  report("fit_percent_first_6_s", square.fit(0, kStart));
  report("fit_percent_after_6_s", square.fit(kStart, square.output.size()));
  EXPECT_GT(square.fit(), 90.0);
  // The start of the record is worse than all that follows, and no other model makes it good.
  EXPECT_LT(square.fit(0, kStart), 90.0);
  EXPECT_GT(square.fit(kStart, square.output.size()), 94.0);
}

TEST_F(FlexibleArm, ALinearModelOfTheSquareWaveItselfReachesItsAuthorsFigure) {
  fit::BlackBoxConfig config;
  config.order = 7;
  const auto own = fit::fit_black_box(square_, config);
  ASSERT_TRUE(own.has_value());
  const Simulated square(square_, own->model);
  report("own_fit_percent", square.fit());
  report("own_fit_percent_after_6_s", square.fit(kStart, square.output.size()));
  EXPECT_GT(square.fit(), 95.5);
  EXPECT_GT(square.fit(kStart, square.output.size()), 96.5);
}

/// What a static function at the input adds on a record, its coefficient estimated on another.
double gained_points(const data::Record& from, const data::Record& to, const fit::BlackBoxModel& model,
                     const std::function<Samples(const data::Record&, const Samples&)>& shape) {
  const auto column = [&](const data::Record& record) {
    const auto error = fit::simulation_residual(record, model, {}).value();
    Samples simulated(record.output.samples);
    for (std::size_t k = 0; k < simulated.size(); ++k) simulated[k] -= error[k];
    return low_passed(model.transfer_function.simulate(shape(record, simulated)), kCutOffHz,
                      record.sample_rate_hz);
  };
  const Simulated source(from, model), target(to, model);
  const auto x = column(from), z = column(to);
  const double weight = std::inner_product(x.begin(), x.end(), source.residual.begin(), 0.0) /
                        std::inner_product(x.begin(), x.end(), x.begin(), 0.0);
  Samples left(target.residual);
  for (std::size_t k = 0; k < left.size(); ++k) left[k] -= weight * z[k];
  return fit_percent(target.output, left) - target.fit();
}

TEST_F(FlexibleArm, NoFrictionAndNoDeadZoneExplainsWhatIsLeft) {
  const auto coulomb = [](const data::Record&, const Samples& velocity) {
    Samples x;
    for (const double v : velocity) x.push_back(v > 0.0 ? 1.0 : -1.0);
    return x;
  };
  // A dead zone of the motor, seen where its voltage changes sign: the first sample after it.
  const auto reversal = [](const data::Record& record, const Samples&) {
    const auto& u = record.input.samples;
    Samples x(u.size(), 0.0);
    for (std::size_t k = 1; k < u.size(); ++k) x[k] = u[k] != u[k - 1] ? u[k] : 0.0;
    return x;
  };
  const double by_friction = gained_points(prbs_, square_, model_, coulomb);
  const double by_reversal = gained_points(prbs_, square_, model_, reversal);
  report("points_by_friction", by_friction);
  report("points_by_reversal", by_reversal);
  report("points_by_friction_on_its_own_record", gained_points(prbs_, prbs_, model_, coulomb));
  EXPECT_LT(by_friction, 0.5);
  EXPECT_LT(by_reversal, 0.5);
}

TEST_F(FlexibleArm, MostOfWhatIsLeftLiesAboveTheModes) {
  const auto error = fit::simulation_residual(prbs_, model_, {}).value();
  const auto left = response::power_spectrum(error, prbs_.sample_rate_hz);
  const auto output = response::power_spectrum(prbs_.output.samples, prbs_.sample_rate_hz);
  const double all = left.between(0.0, 30.0);
  for (const auto& band : {std::pair(0.0, 1.0), std::pair(1.0, 3.0), std::pair(3.0, 5.0),
                           std::pair(5.0, 15.0), std::pair(15.0, 30.0)}) {
    const double share = left.between(band.first, band.second) / all;
    report(("share_from_" + std::to_string(static_cast<int>(band.first)) + "_hz").c_str(), share);
    report(("left_from_" + std::to_string(static_cast<int>(band.first)) + "_hz").c_str(),
           left.between(band.first, band.second) / output.between(band.first, band.second));
  }
  EXPECT_GT(left.between(15.0, 30.0) / all, 0.6);
  EXPECT_LT(left.between(0.0, 3.0) / output.between(0.0, 3.0), 0.01);
}

TEST_F(FlexibleArm, WhatIsLeftOfTheSquareWaveRepeatsAndIsOdd) {
  const Simulated square(square_, model_);
  constexpr std::size_t kPeriod = 100;  // 2 s
  const std::size_t periods = (square.residual.size() - kStart) / kPeriod;
  Samples mean(kPeriod, 0.0);
  double all = 0.0;
  for (std::size_t k = 0; k < periods * kPeriod; ++k) {
    const double e = square.residual[kStart + k];
    mean[k % kPeriod] += e / static_cast<double>(periods);
    all += e * e;
  }
  double repeats = 0.0, odd = 0.0;
  for (std::size_t k = 0; k < kPeriod; ++k) {
    repeats += mean[k] * mean[k];
    odd += std::pow(0.5 * (mean[k] - mean[(k + kPeriod / 2) % kPeriod]), 2);
  }
  report("repeating_share", repeats * static_cast<double>(periods) / all);
  report("odd_share_of_it", odd / repeats);
  EXPECT_GT(repeats * static_cast<double>(periods) / all, 0.5);
  EXPECT_GT(odd / repeats, 0.75);
}

}  // namespace
}  // namespace resonid
