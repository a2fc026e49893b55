// SPDX-License-Identifier: MIT
#include <new>
#include <resonid/online/axis.hpp>

#include "../define_case.hpp"
#include "../record.hpp"
#include "cases.hpp"

using namespace resonid::online;

namespace {

/// Room for what watches only.
struct Room : AxisRoom {
  using Real = float;
  static constexpr std::size_t kInjectedLines = 0, kBaselinePoints = 0, kChangeWindow = 0;
  static constexpr bool kControllerCheck = false;
};

constexpr std::array<double, drive::kLines> lines() {
  std::array<double, drive::kLines> hz{};
  for (std::size_t i = 0; i < hz.size(); ++i)
    hz[i] = drive::kLineSpacingHz * 10.0 * static_cast<double>(i + 1);
  return hz;
}

/// An axis with one estimator, the work of a row spread over all samples from row to row.
template <class OneEstimator, AxisMethod Method, std::size_t Every>
struct AxisCase {
  using Estimator = BasicAxis<Room, OneEstimator>;
  static inline Storage<Estimator> axis;

  static bool create() {
    constexpr std::array start_b{0.15, -0.13, 0.13}, start_a{-1.0, 0.84, -0.84};
    constexpr auto hz = lines();
    AxisConfig c;
    c.sample_rate_hz = drive::kSampleRateHz;
    c.method = Method;
    c.lines_hz = hz;
    c.start_b = start_b;
    c.start_a = start_a;
    c.controller_numerator = drive::kControllerNumerator;
    c.controller_denominator = drive::kControllerDenominator;
    c.row_every_samples = c.spread_samples = Every;
    return axis.hold(Estimator::create(c));
  }
  static void step(const Sample& s) { axis->step({s.ru, s.u, s.y}); }
  static void report(Output& out) {
    const AxisRow& row = axis->row();
    const auto print = [&out](const char* name, double x) {
      out.floats(name, std::array{static_cast<float>(x)});
    };
    print("resonance", row.resonance_hz.value);
    print("antiresonance", row.antiresonance_hz.value);
    print("crossover", row.crossover_hz.value);
    print("phase_margin", row.phase_margin_deg.value);
    print("modulus_margin", row.modulus_margin.value);
  }
};

using LinesCase = AxisCase<AxisLines<float, drive::kLines>, AxisMethod::lines, drive::kLines + 2>;
using ClosedLoopCase = AxisCase<AxisClosedLoop<float>, AxisMethod::damped_closed_loop, 128>;

}  // namespace

const Case axis_lines_21 = case_of<LinesCase>("axis_lines_21", Injection::multisine);
const Case axis_cloe_3 = case_of<ClosedLoopCase>("axis_cloe_3", Injection::prbs);
