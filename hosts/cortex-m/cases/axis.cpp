// SPDX-License-Identifier: MIT
#include <array>
#include <new>
#include <resonid/online/axis.hpp>

#include "../define_case.hpp"
#include "../record.hpp"
#include "cases.hpp"

using namespace resonid::online;

namespace {

struct Room : AxisRoom {
  using Real = float;
  static constexpr std::size_t kInjectedLines = 0, kBaselinePoints = 0, kChangeWindow = 0;
};

/// Eight lines, their fit, margins with standard deviations, gates and verdict: a row every 64 samples, its
/// work spread over them.
struct AxisCase {
  using Estimator = BasicAxis<Room, AxisLines<float, 8>>;
  static inline Storage<Estimator> axis;

  static bool create() {
    static constexpr auto kHz = [] {
      std::array<double, 8> hz{};
      for (std::size_t i = 0; i < 8; ++i) hz[i] = drive::kLineSpacingHz * 10.0 * static_cast<double>(i + 1);
      return hz;
    }();
    AxisConfig c;
    c.sample_rate_hz = drive::kSampleRateHz;
    c.controller_numerator = drive::kControllerNumerator;
    c.controller_denominator = drive::kControllerDenominator;
    c.loop = AxisLoop::controller_at_lines;
    c.lines_hz = kHz;
    c.row_every_samples = c.spread_samples = 64;
    return Estimator::create_in(&*axis, c).has_value();
  }
  static void step(const Sample& s) { axis->step({s.ru, s.u, s.y}); }
  static void report(Output& out) {
    for (std::size_t i = 0; i < axis->lines(); ++i) {
      const std::complex<float> g(axis->line(i).response);
      out.floats("line", std::array{g.real(), g.imag()});
    }
    const AxisRow& row = axis->row();
    for (const Figure& f : {row.crossover_hz, row.phase_margin_deg, row.modulus_margin})
      out.floats("margin", std::array{static_cast<float>(f.value)});
    out.number("rows", static_cast<std::uint32_t>(axis->result().counts.rows));
  }
};

}  // namespace

const Case axis_lines_8 = case_of<AxisCase>("axis_lines_8", Injection::multisine);
