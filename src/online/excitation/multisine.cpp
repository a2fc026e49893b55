// SPDX-License-Identifier: MIT
#include <algorithm>
#include <numeric>
#include <resonid/online/excitation/multisine.hpp>

namespace resonid::online {
namespace {

/// Smallest denominator of a fraction equal to x within rounding, by continued fractions; 0 when there is
/// none below 2^20 (a longer one could not be told from an irrational number).
std::uint64_t denominator_of(double x) noexcept {
  constexpr double kTolerance = 4e-15;
  constexpr std::uint64_t kLargest = std::uint64_t{1} << 20;
  std::uint64_t q_before = 0;
  std::uint64_t q = 1;
  double rest = x;
  for (int term = 0; term < 40; ++term) {
    const double scaled = x * static_cast<double>(q);
    if (std::abs(scaled - std::round(scaled)) < kTolerance * static_cast<double>(q)) return q;
    rest -= std::floor(rest);
    if (!(rest > 1e-12)) return 0;
    rest = 1.0 / rest;
    if (rest > static_cast<double>(kLargest)) return 0;
    const std::uint64_t next = static_cast<std::uint64_t>(rest) * q + q_before;
    if (next > kLargest) return 0;
    q_before = q;
    q = next;
  }
  return 0;
}

}  // namespace

expected<void, Error> check(const MultisineConfig& c, std::size_t max_lines) noexcept {
  if (!(c.sample_rate_hz > 0.0)) return refuse("sample_rate_hz", "must be > 0", c.sample_rate_hz);
  const auto& f = c.frequency_hz;
  const auto lines = static_cast<double>(f.size());
  if (f.empty()) return refuse("lines_hz", "must hold at least one frequency");
  if (f.size() > max_lines) return refuse("lines_hz", "holds more lines than there is room for", lines);
  for (std::size_t i = 0; i < f.size(); ++i) {
    if (!(f[i] > 0.0 && f[i] < 0.5 * c.sample_rate_hz))
      return refuse("lines_hz", "must be > 0 and below half the sample rate", f[i]);
    if (i > 0 && !(f[i] > f[i - 1])) return refuse("lines_hz", "must be ascending", f[i]);
  }
  if (c.amplitude.size() != 1 && c.amplitude.size() != f.size())
    return refuse("amplitude", "must be one value, or one per line", static_cast<double>(c.amplitude.size()));
  for (const double a : c.amplitude)
    if (!(a > 0.0)) return refuse("amplitude", "must be > 0", a);
  if (c.phases == Phases::given && c.phase_rad.size() != f.size())
    return refuse("phase_rad", "must hold one phase per line", static_cast<double>(c.phase_rad.size()));
  if (c.periods_per_realisation == 0) return {};
  const auto periods = static_cast<double>(c.periods_per_realisation);
  if (c.phases != Phases::random)
    return refuse("periods_per_realisation", "must be 0 unless phases are random", periods);
  if (common_period_samples(f, c.sample_rate_hz) == 0)
    return refuse("periods_per_realisation", "must be 0: these lines have no common period", periods);
  return {};
}

void multisine_phases(const MultisineConfig& c, std::span<double> phase_rad) noexcept {
  SplitMix64 random = phase_generator(c.seed, 0, phase_rad.size());
  const auto power = [&](std::size_t i) {
    const double a = c.amplitude[c.amplitude.size() == 1 ? 0 : i];
    return a * a;
  };
  double total = 0.0;
  for (std::size_t i = 0; i < phase_rad.size(); ++i) total += power(i);
  double below = 0.0;  // sum_{l<k} A_l²/sum A²
  double sum = 0.0;    // sum_{l<k} (k - l) A_l²/sum A²
  for (std::size_t i = 0; i < phase_rad.size(); ++i) {
    switch (c.phases) {
      case Phases::random:
        phase_rad[i] = random_phase_rad(random);
        break;
      case Phases::schroeder:
        phase_rad[i] = c.first_phase_rad - kTwoPi * (sum - std::floor(sum));
        break;
      case Phases::zero:
        phase_rad[i] = 0.0;
        break;
      case Phases::given:
        phase_rad[i] = c.phase_rad[i];
        break;
    }
    below += power(i) / total;
    sum += below;
  }
}

std::size_t common_period_samples(std::span<const double> frequency_hz, double sample_rate_hz) noexcept {
  constexpr std::uint64_t kLongest = std::uint64_t{1} << 24;
  std::uint64_t period = 1;
  for (const double f : frequency_hz) {
    const std::uint64_t denominator = denominator_of(f / sample_rate_hz);
    if (denominator == 0) return 0;
    period = std::lcm(period, denominator);
    if (period > kLongest) return 0;
  }
  return static_cast<std::size_t>(period);
}

}  // namespace resonid::online
