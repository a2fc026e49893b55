// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <monitoring/scale_lines.hpp>
#include <resonid/base/constants.hpp>
#include <type_traits>

namespace resonid::monitoring {
namespace {

static_assert(std::is_trivially_copyable_v<ScaleLines>);

constexpr double kLowest = 1.0 / 2500.0, kHighest = 0.3;  // of the sample rate
constexpr double kPeriodsOfBlock = 6.0;
constexpr double kLineMemory_s = 20.0;  // at least, and 33 blocks
constexpr double kLeastKeep = 0.97;

std::complex<double> turned_by(double radians) noexcept { return {std::cos(radians), std::sin(radians)}; }

double line_hz(std::size_t line, double sample_rate_hz) noexcept {
  const double part = static_cast<double>(line) / static_cast<double>(ScaleLines::kLines - 1);
  return sample_rate_hz * kLowest * std::pow(kHighest / kLowest, part);
}

}  // namespace

ScaleLines::ScaleLines(double sample_rate_hz, std::span<const double> numerator,
                       std::span<const double> denominator)
    : sample_rate_hz_(sample_rate_hz) {
  if (numerator.empty() || denominator.empty()) {
    denominator_[0] = numerator_[1] = 1.0;
    denominator_[1] = numerator_[0] = -1.0;
  } else {
    std::transform(numerator.begin(), numerator.end(), numerator_.begin(),
                   [&](double b) { return b / denominator[0]; });
    std::transform(denominator.begin(), denominator.end(), denominator_.begin(),
                   [&](double a) { return a / denominator[0]; });
  }
  for (std::size_t i = 0; i < kLines; ++i) {
    Block& block = blocks_[i];
    const double hz = line_hz(i, sample_rate_hz);
    block.length = static_cast<std::uint32_t>(std::ceil(kPeriodsOfBlock * sample_rate_hz / hz));
    block.keep = std::max(kLeastKeep, 1.0 - block.length / (kLineMemory_s * sample_rate_hz));
    block.turn = turned_by(-kTwoPi * hz / sample_rate_hz);
    block.window_turn = turned_by(kTwoPi / block.length);
    begin(block);
  }
}

void ScaleLines::begin(Block& block) noexcept {
  block.n = 0;
  block.phasor = 1.0;
  block.window = turned_by(kPi / block.length);
  block.a = block.b = block.e = 0.0;
}

double ScaleLines::push(Polynomial& past, const Polynomial& by, double newest) noexcept {
  std::copy_backward(past.begin(), past.end() - 1, past.end());
  past[0] = newest;
  double sum = 0.0;
  for (std::size_t i = 0; i <= kMaxOrder; ++i) sum += by[i] * past[i];
  return sum;
}

void ScaleLines::step(double ru, double u, double y) noexcept {
  const double a = push(torque_, denominator_, u), e = push(excitation_, denominator_, ru);
  const double b = -push(output_, numerator_, y);
  if (filled_ < kMaxOrder) {  // the products still hold what was not measured
    ++filled_;
    return;
  }
  for (std::size_t i = 0; i < kLines; ++i) {
    Block& block = blocks_[i];
    const Complex w = (1.0 - block.window.real()) * block.phasor;  // twice Hann's
    block.a += a * w;
    block.b += b * w;
    block.e += e * w;
    block.phasor *= block.turn;
    block.window *= block.window_turn;
    if (++block.n >= block.length) end_block(i);
  }
}

void ScaleLines::end_block(std::size_t line) noexcept {
  Block& k = blocks_[line];
  Line& sum = sums_[line];
  if (std::isfinite(std::norm(k.a) + std::norm(k.b) + std::norm(k.e))) {
    sum.ae = k.keep * sum.ae + k.a * std::conj(k.e);
    sum.be = k.keep * sum.be + k.b * std::conj(k.e);
    sum.ab = k.keep * sum.ab + k.a * std::conj(k.b);
    sum.aa = k.keep * sum.aa + std::norm(k.a);
    sum.bb = k.keep * sum.bb + std::norm(k.b);
    sum.ee = k.keep * sum.ee + std::norm(k.e);
    sum.blocks = k.keep * sum.blocks + 1.0;
  }
  begin(k);
}

void ScaleLines::interrupt() noexcept {
  filled_ = 0;
  for (Block& block : blocks_) begin(block);
}

void ScaleLines::reset() noexcept {
  interrupt();
  sums_ = {};
}

double ScaleLines::frequency_hz(std::size_t line) const noexcept { return line_hz(line, sample_rate_hz_); }

ScaleLines::Complex ScaleLines::at(const Polynomial& polynomial, std::size_t line) const noexcept {
  const Complex back = turned_by(-kTwoPi * frequency_hz(line) / sample_rate_hz_);
  Complex sum = 0.0;
  for (std::size_t i = polynomial.size(); i-- > 0;) sum = sum * back + polynomial[i];
  return sum;
}

}  // namespace resonid::monitoring
