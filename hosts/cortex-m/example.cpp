// SPDX-License-Identifier: MIT
// Least firmware: an axis that excites itself within limits and follows its machine at eight lines. A real
// one reads the converter and the encoder where `Plant` is here, and calls servo() from its timer interrupt.
// Returns 0 when the response is right.
#include <array>
#include <complex>
#include <new>
#include <resonid/online/axis.hpp>

namespace {

using namespace resonid::online;

constexpr double kSampleRateHz = 2000.0;
constexpr double kPeriodSamples = 128.0;  // lines are whole multiples of rate/period
constexpr std::size_t kLines = 8;

/// What the image carries: one estimator, its excitation and nothing else.
struct Room : AxisRoom {
  using Real = float;
  static constexpr std::size_t kInjectedLines = kLines, kBaselinePoints = 0, kChangeWindow = 0;
  static constexpr bool kControllerCheck = false;
};
using ServoAxis = BasicAxis<Room, AxisLines<float, kLines>>;

/// Stands for the machine: y(k+1) = 0.95 y(k) + 0.1 u(k).
struct Plant {
  float y = 0.0F;
  void step(float u) { y = 0.95F * y + 0.1F * u; }
};

void servo(ServoAxis& axis, Plant& plant) noexcept {  // once per sample
  const float y = plant.y;                            // read the encoder
  const float control = -0.2F * y;
  const float u = control + axis.excite({.torque = control, .velocity = y});
  axis.step({axis.injected(), u, y});
  plant.step(u);  // write the torque
}

}  // namespace

int program();
int program() {
  std::array<double, kLines> lines_hz{};
  for (std::size_t i = 0; i < kLines; ++i)
    lines_hz[i] = static_cast<double>(i + 1) * kSampleRateHz / kPeriodSamples;
  AxisConfig config;
  config.sample_rate_hz = kSampleRateHz;
  config.lines_hz = lines_hz;
  config.loop = AxisLoop::measured;
  config.row_every_samples = config.spread_samples = kLines + 2;  // a line per sample
  config.injects = true;

  // Static: no heap, no start-up code.
  alignas(ServoAxis) static std::array<std::byte, sizeof(ServoAxis)> memory;
  const auto axis = ServoAxis::create_in(&memory, config);
  if (!axis) return 1;  // error().field and error().requirement say why
  AxisInjection injection;
  injection.guard.amplitude = 0.5;
  injection.guard.velocity_limit = 10.0;
  if (!(*axis)->start(injection)) return 2;
  Plant plant;
  for (int k = 0; k < 20000; ++k) servo(**axis, plant);

  for (std::size_t i = 0; i < kLines; ++i) {
    const double angle = resonid::kTwoPi * static_cast<double>(i + 1) / kPeriodSamples;
    const auto truth = 0.1 / (std::polar(1.0, angle) - 0.95);
    if (!(std::abs((*axis)->line(i).response - truth) < 0.05 * std::abs(truth))) return 3;
  }
  return (*axis)->result().settled && (*axis)->row().coherence > 0.99 ? 0 : 4;
}
