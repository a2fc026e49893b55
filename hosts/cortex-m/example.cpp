// SPDX-License-Identifier: MIT
// Least firmware: excite, track, read the response. A real one reads the converter and the encoder where
// `Plant` is here, and calls servo() from its timer interrupt. Returns 0 when the response is right.
#include <array>
#include <complex>
#include <new>
#include <resonid/online/excitation/prbs.hpp>
#include <resonid/online/lines/line_bank.hpp>

namespace {

using Bank = resonid::online::LineBank<float, 8>;
using Prbs = resonid::online::Prbs;

constexpr double kSampleRateHz = 2000.0;
constexpr double kPeriodSamples =
    127.0;  // of a PRBS of 7 cells: its lines are whole multiples of rate/period
constexpr std::size_t kLines = 8;

/// Stands for the machine: y(k+1) = 0.95 y(k) + 0.1 u(k).
struct Plant {
  float y = 0.0F;
  void step(float u) { y = 0.95F * y + 0.1F * u; }
};

/// Everything that the interrupt needs, made before it is switched on. Static: no heap, no start-up code.
struct Servo {
  Prbs excitation;
  Bank bank;
  Plant plant;
  std::array<float, kLines> re{}, im{};
};

void servo(Servo& s) noexcept {  // once per sample
  const float y = s.plant.y;     // read the encoder
  const auto u = static_cast<float>(s.excitation.step());
  s.bank.step(u, y);
  s.bank.responses(s.re, s.im);
  s.plant.step(u);  // write the torque
}

}  // namespace

int program();
int program() {
  std::array<double, kLines> lines_hz{};
  for (std::size_t i = 0; i < kLines; ++i)
    lines_hz[i] = static_cast<double>(i + 1) * kSampleRateHz / kPeriodSamples;
  const auto excitation =
      Prbs::create({.sample_rate_hz = kSampleRateHz, .amplitude = 0.5, .register_length = 7});
  resonid::online::LineBankConfig config;
  config.bank = {.sample_rate_hz = kSampleRateHz, .frequency_hz = lines_hz, .lambda = 500.0};
  const auto bank = Bank::create(config);
  if (!excitation || !bank) return 1;  // error().field and error().requirement say why

  alignas(Servo) static std::array<std::byte, sizeof(Servo)> memory;
  Servo& s = *new (&memory) Servo{*excitation, *bank, Plant{}};
  for (int k = 0; k < 20000; ++k) servo(s);

  for (std::size_t i = 0; i < kLines; ++i) {
    const double angle = resonid::kTwoPi * static_cast<double>(i + 1) / kPeriodSamples;
    const auto truth = 0.1 / (std::polar(1.0, angle) - 0.95);
    if (std::abs(std::complex<double>(s.re[i], s.im[i]) - truth) > 0.05 * std::abs(truth)) return 2;
  }
  return s.bank.ready() ? 0 : 3;
}
