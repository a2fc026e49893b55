// SPDX-License-Identifier: MIT
// An axis with each kind of estimator: with rows, margins of the loop, the controller's check.
#include <array>
#include <resonid/online/axis.hpp>
#include <string_view>
#include <tooth_belt.hpp>

#include "subject.hpp"

namespace resonid::test {
namespace {

using namespace resonid::online;

template <class Number>
struct Room : AxisRoom {
  using Real = Number;
  static constexpr std::size_t kInjectedLines = 0, kBaselinePoints = 0, kChangeWindow = 64;
};

/// With the count that the suite asks every estimator for.
template <class Axis>
struct Counting : Axis {
  explicit Counting(const Axis& axis) noexcept : Axis(axis) {}
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return this->result().skipped_samples; }
};

AxisConfig common() {
  static const auto controller = tooth_belt_controller(1.0 / kRateHz);
  AxisConfig c;
  c.sample_rate_hz = kRateHz;
  c.controller_numerator = controller.numerator;
  c.controller_denominator = controller.denominator;
  c.known_delay_s = 1.0 / kRateHz;
  c.row_every_samples = 10;
  c.centre_hz = 20.0;
  return c;
}

template <class Number>
struct OfAxis {
  using Scalar = Number;
  static constexpr bool kTyped = true;
  static constexpr unsigned kArguments = kRu | kU | kY;
  static constexpr double kRecovered = 0.02;
  template <class E>
  static std::tuple<AxisSample<Number>> arguments(const E&, const Sample& s) noexcept {
    return {{static_cast<Number>(s[0]), static_cast<Number>(s[1]), static_cast<Number>(s[2])}};
  }
  template <class E>
  static void observe(const E& e, Answers& answers) noexcept {
    const AxisRow& row = e.row();
    if (e.lines() > 0) {  // those that are excited
      answers.figure(e.line(1).response);
      answers.figure(e.line(2).response);
    } else {
      answers.figure(row.resonance_hz.value);
      answers.figure(row.crossover_hz.value);
    }
    for (const Figure& f : {row.resonance_hz, row.antiresonance_hz, row.crossover_hz, row.phase_margin_deg,
                            row.modulus_margin}) {
      answers.add(f.value);
      answers.add(f.std);
    }
    for (const Figure& f : row.parameter) answers.add(f.value);
    answers.add(row.lag_samples);
    answers.add(row.coherence);
    answers.add(row.uncertainty);
    answers.add(row.controller_differs ? 1.0 : 0.0);
    answers.add(static_cast<double>(row.verdict));
    answers.add(static_cast<double>(e.result().counts.all));
  }
};

template <class Number>
struct LinesAxis : OfAxis<Number> {
  using Listed = BasicAxis<Room<Number>, AxisLines<Number, 21>>;
  static constexpr std::string_view kName = "Axis of lines",
                                    kAsListed = "21 lines, no injection, 64 blocks of change detection",
                                    kCost =
                                        "as ResponseTracker; a row, `spread_samples` apart: a line or a "
                                        "point of the margins each";
  static auto make() {
    static constexpr std::array<double, 4> kLines{8.0, 12.0, 31.0, 40.0};
    AxisConfig c = common();
    c.lines_hz = kLines;
    using Axis = BasicAxis<Room<Number>, AxisLines<Number, 4>>;
    return Counting<Axis>(Axis::create(c).value());
  }
};

template <class Number>
struct DampedAxis : OfAxis<Number> {
  using Listed = BasicAxis<Room<Number>, AxisClosedLoop<Number>>;
  static constexpr std::string_view kName = "Axis of ClosedLoopOutputError",
                                    kAsListed = "order 3, no injection, 64 blocks of change detection",
                                    kCost = "as ClosedLoopOutputError; a row: its covariance and 360 points";
  static constexpr double kSpike = 100.0;
  static auto make() {
    static const auto machine = tooth_belt(0.8, 1.0 / kRateHz);
    AxisConfig c = common();
    c.method = AxisMethod::damped_closed_loop;
    c.row_every_samples = 100;
    c.start_b = machine.b;
    c.start_a = machine.a;
    return Counting<Listed>(Listed::create(c).value());
  }
};

template <class Number>
void add(std::vector<Case>& all) {
  all.push_back(case_of<LinesAxis<Number>>());
  all.push_back(case_of<DampedAxis<Number>>());
}

}  // namespace

void add_axis_cases(std::vector<Case>& all) {
  add<double>(all);
  add<float>(all);
}

}  // namespace resonid::test
