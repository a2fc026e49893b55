// SPDX-License-Identifier: MIT
#include <array>
#include <bit>
#include <resonid/online/excitation/prbs.hpp>

namespace resonid::online {
namespace {

using Taps = std::array<std::uint8_t, 4>;
constexpr std::array<Taps, Prbs::kMaxRegister + 1> kTaps{{
    {},
    {},
    {2, 1},
    {3, 2},
    {4, 3},
    {5, 3},
    {6, 5},
    {7, 6},
    {8, 6, 5, 4},
    {9, 5},
    {10, 7},
    {11, 9},
    {12, 6, 4, 1},
    {13, 4, 3, 1},
    {14, 5, 3, 1},
    {15, 14},
    {16, 15, 13, 4},
    {17, 14},
    {18, 11},
    {19, 6, 2, 1},
    {20, 17},
    {21, 19},
    {22, 21},
    {23, 18},
    {24, 23, 22, 17},
}};

}  // namespace

std::uint32_t Prbs::taps(std::size_t register_length) noexcept {
  if (register_length > kMaxRegister) return 0;
  std::uint32_t mask = 0;
  for (const std::uint8_t cell : kTaps[register_length])
    if (cell > 0) mask |= std::uint32_t{1} << (cell - 1);
  return mask;
}

expected<Prbs, Error> Prbs::create(const PrbsConfig& config) {
  if (!(config.sample_rate_hz > 0.0)) return refuse("sample_rate_hz", "must be > 0", config.sample_rate_hz);
  if (!(config.amplitude > 0.0)) return refuse("amplitude", "must be > 0", config.amplitude);
  if (config.register_length < kMinRegister || config.register_length > kMaxRegister)
    return refuse("register_length", "must be 2 ... 24", static_cast<double>(config.register_length));
  if (config.clock_divider < 1 || config.clock_divider > 1000000)
    return refuse("clock_divider", "must be 1 ... 1000000", static_cast<double>(config.clock_divider));
  if (config.start_state < 1 || config.start_state >= std::uint32_t{1} << config.register_length)
    return refuse("start_state", "must be 1 ... 2^register_length - 1",
                  static_cast<double>(config.start_state));
  return Prbs(config);
}

double Prbs::step() noexcept {
  const bool plus = ((cells_ >> (config_.register_length - 1)) & 1U) != 0;
  if (++bit_samples_ == config_.clock_divider) {
    bit_samples_ = 0;
    const auto feedback =
        static_cast<std::uint32_t>(std::popcount(cells_ & taps(config_.register_length)) & 1);
    const std::uint32_t all = (std::uint32_t{1} << config_.register_length) - 1;
    cells_ = ((cells_ << 1) | feedback) & all;
  }
  return plus ? config_.amplitude : -config_.amplitude;
}

void Prbs::reset() noexcept {
  cells_ = config_.start_state;
  bit_samples_ = 0;
}

Band Prbs::band() const noexcept {
  constexpr double kHalfPower = 0.442946;  // sinc^2(pi x) = 1/2
  return {config_.sample_rate_hz / static_cast<double>(period_samples()),
          kHalfPower * config_.sample_rate_hz / static_cast<double>(config_.clock_divider)};
}

}  // namespace resonid::online
