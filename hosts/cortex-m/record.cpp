// SPDX-License-Identifier: MIT
#include "record.hpp"

#include <array>
#include <cstdint>

namespace {

constexpr double kPi = 3.14159265358979323846;

constexpr double sine(double x) {  // Taylor, |x| <= pi/2 after folding
  if (x > kPi) return -sine(x - kPi);
  if (x > 0.5 * kPi) x = kPi - x;
  double term = x, sum = x;
  for (int n = 1; n < 12; ++n) {
    term *= -x * x / ((2.0 * n) * (2.0 * n + 1.0));
    sum += term;
  }
  return sum;
}
constexpr std::int64_t rounded(double x) { return static_cast<std::int64_t>(x < 0.0 ? x - 0.5 : x + 0.5); }

constexpr std::size_t kTurn = 1024;  // entries of the sine
constexpr auto kSine = [] {
  std::array<std::int32_t, kTurn> table{};
  for (std::size_t i = 0; i < kTurn; ++i)
    table[i] = static_cast<std::int32_t>(
        rounded(0x1p24 * sine(2.0 * kPi * static_cast<double>(i) / static_cast<double>(kTurn))));
  return table;
}();

/// Zero-order-hold equivalent of the drive: states are both velocities and the torque of the spring.
constexpr std::size_t kStates = 3;
using Matrix = std::array<std::array<double, kStates + 1>, kStates + 1>;
constexpr Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c{};
  for (std::size_t i = 0; i <= kStates; ++i)
    for (std::size_t j = 0; j <= kStates; ++j)
      for (std::size_t k = 0; k <= kStates; ++k) c[i][j] += a[i][k] * b[k][j];
  return c;
}
constexpr Matrix zoh_drive() {
  using namespace drive;
  constexpr int kHalvings = 8;
  const double step = 1.0 / kSampleRateHz / (1U << kHalvings);
  const double a = step / kDrivenInertiaKgm2, b = step / kLoadInertiaKgm2;
  const Matrix m = {{{-a * kDampingNmsPerRad, a * kDampingNmsPerRad, -a, a},
                     {b * kDampingNmsPerRad, -b * kDampingNmsPerRad, b, 0.0},
                     {step * kStiffnessNmPerRad, -step * kStiffnessNmPerRad, 0.0, 0.0},
                     {}}};
  Matrix sum{};
  for (int n = 12; n >= 1; --n) {
    Matrix next = product(m, sum);
    for (std::size_t i = 0; i <= kStates; ++i)
      for (std::size_t j = 0; j <= kStates; ++j)
        next[i][j] = (next[i][j] + m[i][j]) / n;  // M (1 + M/2 (1 + M/3 ...)) = exp(M) - 1
    sum = next;
  }
  for (std::size_t i = 0; i <= kStates; ++i) sum[i][i] += 1.0;
  for (int n = 0; n < kHalvings; ++n) sum = product(sum, sum);
  return sum;
}

constexpr unsigned kCoefficientBits = 28;  // coefficients in 2^-28
constexpr auto kDrive = [] {
  const Matrix m = zoh_drive();
  std::array<std::array<std::int64_t, kStates + 1>, kStates> rows{};
  for (std::size_t i = 0; i < kStates; ++i)
    for (std::size_t j = 0; j <= kStates; ++j) rows[i][j] = rounded(0x1p28 * m[i][j]);
  return rows;
}();

/// ru in units of 2^-24 Nm.
class Source {
 public:
  explicit Source(Injection injection) : injection_(injection) {}

  std::int64_t next() {
    switch (injection_) {
      case Injection::multisine:
        return multisine();
      case Injection::chirp:
        return chirp();
      case Injection::prbs:
        return prbs();
      case Injection::none:
        break;
    }
    return 0;
  }

 private:
  std::int64_t multisine() {
    std::int64_t sum = 0;
    for (std::size_t i = 1; i <= drive::kLines; ++i)  // phases of about pi i^2/n spread the energy over time
      sum += kSine[(10 * i * sample_ + kTurn * i * i / (2 * drive::kLines)) % kTurn];
    ++sample_;
    return sum / 4;
  }
  std::int64_t chirp() {
    constexpr auto kFrom = static_cast<std::uint32_t>(drive::kChirpFromHz / drive::kSampleRateHz * 0x1p32);
    constexpr auto kRate =
        static_cast<std::uint32_t>((drive::kChirpToHz - drive::kChirpFromHz) / drive::kChirpDurationS /
                                   drive::kSampleRateHz / drive::kSampleRateHz * 0x1p32);
    const std::int64_t sine = kSine[(phase_ >> 22U) % kTurn];
    phase_ += kFrom + kRate * static_cast<std::uint32_t>(sample_++);
    return sine;
  }
  std::int64_t prbs() {  // x^10 + x^7 + 1
    const std::uint32_t bit = ((cells_ >> 9U) ^ (cells_ >> 6U)) & 1U;
    cells_ = (cells_ << 1U) | bit;
    return bit != 0 ? std::int64_t{1} << 24U : -(std::int64_t{1} << 24U);
  }

  Injection injection_;
  std::size_t sample_ = 0;
  std::uint32_t phase_ = 0;
  std::uint32_t cells_ = 1;
};

/// Uniform noise of +-2^-10 rad/s in units of 2^-24, from a linear congruential generator.
class Noise {
 public:
  std::int64_t next() {
    state_ = state_ * 1664525U + 1013904223U;  // Numerical Recipes, "quick and dirty"
    return static_cast<std::int64_t>(state_ >> 17U) - (1 << 14);
  }

 private:
  std::uint32_t state_ = 1;
};

constexpr unsigned kResolutionBits = 8;  // signals are rounded to 2^-16: exact as float up to 256
float measured(std::int64_t x) {
  return static_cast<float>(
             static_cast<std::int32_t>((x + (1 << (kResolutionBits - 1))) >> kResolutionBits)) *
         0x1p-16F;
}
std::int64_t resolved(std::int64_t x) {
  return ((x + (1 << (kResolutionBits - 1))) >> kResolutionBits) << kResolutionBits;
}

}  // namespace

void make_record(Injection injection, std::span<Sample> samples) {
  Source source(injection);
  Noise noise;
  std::array<std::int64_t, kStates> x{};
  std::int64_t integral = 0;  // of y/64
  for (Sample& s : samples) {
    const std::int64_t y = resolved(x[0] + noise.next());
    const std::int64_t ru = resolved(source.next());
    integral += y / 64;
    const std::int64_t u = resolved(ru - y - integral);
    s = {measured(ru), measured(u), measured(y)};
    const std::array<std::int64_t, kStates> now = x;
    for (std::size_t i = 0; i < kStates; ++i) {
      std::int64_t sum = kDrive[i][kStates] * u;
      for (std::size_t j = 0; j < kStates; ++j) sum += kDrive[i][j] * now[j];
      x[i] = sum >> kCoefficientBits;
    }
  }
}
