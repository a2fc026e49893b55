// SPDX-License-Identifier: MIT
#include <array>
#include <resonid/online/control.hpp>
#include <string_view>

#include "subject.hpp"

namespace resonid::test {
namespace {

using namespace resonid::online;

constexpr std::array<Biquad, 2> kBiquads{{{20.0, 0.2, 0.6}, {60.0, 0.9, 0.5}}};
constexpr std::array<GainNode, 3> kNodes{{{-1.0, 0.4, 8.0}, {0.0, 0.6, 12.0}, {1.0, 0.3, 6.0}}};

/// PI, filters, schedule and limit, in a loop: the velocity is some of the record and what the last torque
/// made of it.
template <class Real>
struct DriveControlTraits {
  using Scalar = Real;
  using Listed = DriveControl<Real>;
  static constexpr bool kTyped = true;
  static constexpr std::string_view kName = "DriveControl", kAsListed = "4 biquads, 17 nodes",
                                    kCost = "biquads, twice during an exchange; nodes";
  static constexpr unsigned kArguments = kRu | kU | kY;
  static constexpr double kRecovered = 1e-4;
  static Listed make() {
    DriveControlConfig c;
    c.sample_rate_hz = kRateHz;
    c.set_point_weight = 0.7;
    c.torque_limit = 50.0;
    c.biquads = kBiquads;
    c.schedule = kNodes;
    return Listed::create(c).value();
  }
  static std::tuple<ControlInputs<Real>> arguments(const Listed& e, const Sample& s) noexcept {
    ControlInputs<Real> inputs;
    inputs.reference = static_cast<Real>(s[0]);
    inputs.velocity = static_cast<Real>(s[2]) + Real(0.4) * e.torque();
    inputs.position = inputs.torque_feed_forward = static_cast<Real>(s[1]);
    return {inputs};
  }
  static void observe(const Listed& e, Answers& answers) noexcept {
    answers.figure(static_cast<double>(e.torque()));
    answers.figure(static_cast<double>(e.integral()));
    answers.add(static_cast<double>(e.kp()));
    answers.add(static_cast<double>(e.ki()));
    answers.add(static_cast<double>(e.velocity_reference()));
    answers.add(e.limited() ? 1.0 : 0.0);
    answers.add(e.in_gap() ? 1.0 : 0.0);
  }
};

}  // namespace

void add_control_cases(std::vector<Case>& all) {
  all.push_back(case_of<DriveControlTraits<double>>());
  all.push_back(case_of<DriveControlTraits<float>>());
}

}  // namespace resonid::test
