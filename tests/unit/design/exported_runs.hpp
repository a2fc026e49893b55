// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exported_laws.hpp>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "design/controller.hpp"
#include "design/export.hpp"

namespace resonid::test {

/// The design's own simulation by its states: what the texts must do.
inline std::vector<double> simulated(const design::ExportedController& exported,
                                     const std::vector<Sample>& samples) {
  const auto& controller = exported.controller;
  const double step = exported.sample_time_s;
  // By superposition: all of the error, and the part that the set-point weight takes off.
  const auto main = design::states_of(controller, step);
  const auto weight = design::states_of(
      design::FilteredPi{controller.kp * (exported.set_point_weight - 1.0), 0.0, controller.biquads}, step);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(main.a.rows()), w = Eigen::VectorXd::Zero(weight.a.rows());
  std::vector<double> torque;
  for (const Sample& sample : samples) {
    const double error = sample.reference - sample.velocity;
    double u = main.c * x + main.d * error + weight.c * w + weight.d * sample.reference;
    const bool sums = controller.ki != 0.0;
    const double sum = sums ? x(0) : 0.0;
    x = (main.a * x + main.b * error).eval();
    w = (weight.a * w + weight.b * sample.reference).eval();
    const double limit = exported.torque_limit.value_or(INFINITY);
    if (sums && ((u > limit && error >= 0.0) || (u < -limit && error <= 0.0))) x(0) = sum;
    torque.push_back(std::clamp(u, -limit, limit));
  }
  return torque;
}

/// A folder of the test's own, and programs that run in it.
class ExportedRuns : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "resonid_export_XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  [[nodiscard]] std::string read(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(folder_ / name).rdbuf();
    return text.str();
  }
  /// Exit code; what it says stands in "log".
  [[nodiscard]] int shell(const std::string& words) const {
    const int status = std::system(("cd '" + folder_.string() + "' && { " + words + "; } 2> log").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  void write_samples(const std::vector<Sample>& samples, const std::string& more = "") const {
    std::ostringstream rows;
    rows.precision(17);
    for (const Sample& sample : samples) rows << sample.reference << ' ' << sample.velocity << more << '\n';
    write("rows", rows.str());
  }
  /// A velocity law as structured text on exported_samples(); `more`: cycle time and whether it is enabled.
  template <class Law>
  void run_structured_text(const Law& law, const std::string& more = " 0.001 1") const {
    const auto text = design::to_structured_text(law);
    ASSERT_TRUE(text) << text.error().requirement;
    write("controller.st", *text);
    write_samples(exported_samples(), more);
    ASSERT_EQ(
        shell(std::string("'") + RESONID_PYTHON + "' '" + RESONID_DESIGN_TESTS +
              "/structured_text.py' controller.st reference velocity cycle_time enable < rows > torque"),
        0)
        << *text << read("log");
  }
  /// First column of what a program has printed.
  [[nodiscard]] std::vector<double> printed(const std::string& name) const {
    std::ifstream file(folder_ / name);
    std::vector<double> values;
    for (std::string line; std::getline(file, line);) values.push_back(std::strtod(line.c_str(), nullptr));
    return values;
  }
  static void expect_alike(const std::vector<double>& found, const std::vector<double>& wanted,
                           double tolerance) {
    ASSERT_EQ(found.size(), wanted.size());
    double most = 0.0, error = 0.0;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      most = std::max(most, std::abs(wanted[i]));
      error = std::max(error, std::abs(found[i] - wanted[i]));
    }
    EXPECT_GT(most, 0.0);
    EXPECT_LT(error, tolerance * most);
  }

  std::filesystem::path folder_;
};

}  // namespace resonid::test
