// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <resonid/base/constants.hpp>
#include <resonid/data/record.hpp>
#include <resonid/response/line_estimates.hpp>
#include <sstream>
#include <string>
#include <vector>

namespace resonid::test {

inline std::vector<double> multisine(std::size_t period, std::size_t periods, const std::vector<int>& lines) {
  std::vector<double> samples(period * periods, 0.0);
  for (std::size_t k = 0; k < samples.size(); ++k)
    for (std::size_t i = 0; i < lines.size(); ++i)
      samples[k] +=
          0.5 * std::cos(kTwoPi * lines[i] * static_cast<double>(k) / static_cast<double>(period) -
                         kPi * static_cast<double>(i * (i + 1)) / static_cast<double>(lines.size()));
  return samples;
}

inline std::vector<double> recorded_column(const std::filesystem::path& path, const std::string& name) {
  std::ifstream file(path);
  std::string row;
  std::getline(file, row);
  std::istringstream header(row);
  std::vector<std::string> names;
  for (std::string cell; std::getline(header, cell, ',');) names.push_back(cell);
  const auto wanted = std::find(names.begin(), names.end(), name) - names.begin();
  std::vector<double> values;
  while (std::getline(file, row)) {
    std::istringstream cells(row);
    std::string cell;
    for (long i = 0; i <= wanted; ++i) std::getline(cells, cell, ',');
    values.push_back(std::strtod(cell.c_str(), nullptr));
  }
  return values;
}

/// Two-mass bench: open loop, full-grid multisine of 2500 samples per period, 6 periods, angle of the motor.
inline data::Record two_mass_bench(const std::filesystem::path& path) {
  data::Record record;
  record.sample_rate_hz = 2500.0;
  record.output_quantity = data::OutputQuantity::position;
  record.input.samples = recorded_column(path, "iq_meas_A");
  for (double& x : record.input.samples) x *= 0.564;
  record.output.samples = recorded_column(path, "theta_motor_rad");
  return record;
}

inline response::ResponseOptions direct() {
  response::ResponseOptions options;
  options.approach = Approach::direct;
  return options;
}

}  // namespace resonid::test
