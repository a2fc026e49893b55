// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace resonid::test {

/// A golden JSON file (tests/golden; see the README there for where it comes from).
inline nlohmann::json golden_json(const std::string& name) {
  std::ifstream file(std::string(RESONID_GOLDEN_DIR) + "/" + name);
  if (!file) throw std::runtime_error("golden file missing: " + name);
  return nlohmann::json::parse(file);
}

/// One column of a golden CSV file.
inline std::vector<double> golden_column(const std::string& name, const std::string& column) {
  std::ifstream file(std::string(RESONID_GOLDEN_DIR) + "/" + name);
  if (!file) throw std::runtime_error("golden file missing: " + name);
  std::string line;
  std::getline(file, line);
  std::istringstream header(line);
  int index = -1;
  int i = 0;
  for (std::string cell; std::getline(header, cell, ','); ++i)
    if (cell == column) index = i;
  if (index < 0) throw std::runtime_error("no column " + column + " in " + name);
  std::vector<double> values;
  while (std::getline(file, line)) {
    std::istringstream row(line);
    std::string cell;
    for (int j = 0; j <= index; ++j) std::getline(row, cell, ',');
    values.push_back(std::strtod(cell.c_str(), nullptr));
  }
  return values;
}

/// `{"re": [...], "im": [...]}` as complex numbers.
inline std::vector<std::complex<double>> golden_complex(const nlohmann::json& pair) {
  std::vector<std::complex<double>> values;
  for (std::size_t i = 0; i < pair.at("re").size(); ++i)
    values.emplace_back(pair.at("re")[i].get<double>(), pair.at("im")[i].get<double>());
  return values;
}

}  // namespace resonid::test
