// SPDX-License-Identifier: MIT
// Laws of polynomials as texts: run against what the polynomials mean.
#include <gtest/gtest.h>

#include <resonid/fit/drive_model.hpp>

#include "design/export.hpp"
#include "design/state_feedback.hpp"
#include "exported_runs.hpp"

namespace resonid::design {
namespace {

using test::by_definition;
using test::exported_samples;
using test::rst_variants;

class RstExport : public test::ExportedRuns {
 protected:
  void run_c(const ExportedRst& law, CNumber number) {
    const auto text = to_c(law, number);
    ASSERT_TRUE(text) << text.error().requirement;
    const std::string real = number == CNumber::in_float ? "float" : "double", name = law.name;
    write("controller.h", *text);
    write("run.c", "#include <stdio.h>\n#include \"controller.h\"\nint main(void) {\n  " + name +
                       " c;\n  double r, y;\n  " + name +
                       "_init(&c);\n  while (scanf(\"%lf %lf\", &r, &y) == 2)\n" +
                       "    printf(\"%.17g\\n\", (double)" + name + "_step(&c, (" + real + ")r, (" + real +
                       ")y));\n  return 0;\n}\n");
    write_samples(exported_samples());
    const std::string flags =
        " -std=c99 -O1 -ffp-contract=off -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror";
    ASSERT_EQ(shell("'" + std::string(RESONID_C_COMPILER) + "'" + flags + " run.c -o run"), 0)
        << *text << read("log");
    ASSERT_EQ(shell("./run < rows > torque"), 0) << read("log");
  }
};

TEST_F(RstExport, IsTheLawInC) {
  for (const auto& variant : rst_variants()) {
    const ExportedRst& law = variant.law;
    SCOPED_TRACE(law.what + (law.torque_limit ? " limited" : ""));
    const auto wanted = by_definition(variant, exported_samples());
    run_c(law, CNumber::in_double);
    expect_alike(printed("torque"), wanted, 1e-12);
    run_c(law, CNumber::in_float);
    expect_alike(printed("torque"), wanted, 1e-3);
  }
}

TEST_F(RstExport, IsTheLawInStructuredText) {
  for (const auto& variant : rst_variants()) {
    SCOPED_TRACE(variant.law.what + (variant.law.torque_limit ? " limited" : ""));
    run_structured_text(variant.law);
    expect_alike(printed("torque"), by_definition(variant, exported_samples()), 1e-12);
  }
}

TEST_F(RstExport, GivesNoTorqueAtAnotherCycleTimeOrDisabled) {
  for (const char* more : {" 0.002 1", " 0.001 0"}) {
    run_structured_text(rst_variants().front().law, more);
    for (const double torque : printed("torque")) EXPECT_EQ(torque, 0.0);
  }
}

/// Long at the limit, where noise drives the derivative too: once the error turns, so does the torque.
TEST_F(RstExport, DoesNotWindUp) {
  ExportedRst law = rst_variants().front().law;
  law.torque_limit = 0.5;
  run_c(law, CNumber::in_double);
  const auto torque = printed("torque");
  EXPECT_LE(*std::max_element(torque.begin(), torque.end()), 0.5);
  EXPECT_GT(std::count(torque.begin(), torque.end(), 0.5), 20);
  EXPECT_LT(torque[251], 0.0);  // the reference fell one sample before
}

/// Delays and an observer make a high order: the text gives what its states do, from which it was made.
TEST_F(RstExport, IsStateFeedback) {
  fit::DriveModel machine;
  machine.structure = fit::Structure::two_mass;
  machine.parameters.driven_inertia = 0.032;
  machine.parameters.load_inertia = 0.032;
  machine.parameters.stiffness = 1660.0;
  machine.parameters.damping = 0.1;
  machine.sample_time_s = 0.002;
  machine.known_delay_s = 0.004;
  const auto feedback = state_feedback(machine, {});
  ASSERT_TRUE(feedback);
  const auto& states = feedback->controller;
  const LinearController linear(states, machine.sample_time_s);
  // S is the characteristic polynomial, R what the responses at as many points say: by Leverrier's recursion.
  const auto n = states.a.rows();
  ASSERT_GE(n, 5);
  ExportedRst law;
  law.s = {1.0};
  law.r = {states.d};
  Eigen::MatrixXd m = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index k = 1; k <= n; ++k) {
    law.r.push_back((states.c * m * states.b).value());
    const Eigen::MatrixXd am = states.a * m;
    law.s.push_back(-am.trace() / static_cast<double>(k));
    m = am + law.s.back() * Eigen::MatrixXd::Identity(n, n);
    law.r.back() += states.d * law.s.back();
  }
  law.sample_time_s = machine.sample_time_s;
  law.what = "State feedback";
  std::vector<double> wanted;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  for (const auto& sample : exported_samples()) {
    const double error = sample.reference - sample.velocity;
    wanted.push_back(states.c * x + states.d * error);
    x = (states.a * x + states.b * error).eval();
  }
  run_c(law, CNumber::in_double);
  expect_alike(printed("torque"), wanted, 1e-9);
  run_structured_text(law, " 0.002 1");
  expect_alike(printed("torque"), wanted, 1e-9);
}

TEST(RstExportRefusal, NamesWhatIsWrong) {
  ExportedRst law = rst_variants().front().law;
  law.s.clear();
  EXPECT_EQ(to_c(law, CNumber::in_double).error().field, "structure");
  law.s = {0.0, 1.0};
  EXPECT_EQ(to_structured_text(law).error().field, "structure");
  law = rst_variants().front().law;
  law.r.front() = NAN;
  EXPECT_EQ(to_c(law, CNumber::in_double).error().field, "structure");
  law = rst_variants().front().law;
  law.name = "while";
  EXPECT_EQ(to_structured_text(law).error().field, "name");
  law = rst_variants().front().law;
  law.torque_limit = 0.0;
  EXPECT_EQ(to_c(law, CNumber::in_double).error().field, "torque_limit");
}

/// A slow integral beside a quick derivative is lost in floats.
TEST(RstExportRefusal, FloatsThatLoseTheLaw) {
  const auto pid = Pid{0.6, 0.01, 0.4, 0.01}.transfer_function(1e-4);
  ExportedRst law;
  law.r = pid.numerator;
  law.s = pid.denominator;
  law.sample_time_s = 1e-4;
  EXPECT_EQ(to_c(law, CNumber::in_float).error().field, "structure");
  EXPECT_TRUE(to_c(law, CNumber::in_double));
}

}  // namespace
}  // namespace resonid::design
