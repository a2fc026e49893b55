// SPDX-License-Identifier: MIT
#include "io/wrap_around.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace resonid::io {
namespace {

constexpr std::size_t kFewestSamples = 16;
constexpr double kMostJumps = 0.25;      // of the samples
constexpr double kUsualStep = 0.25;      // of the span; the largest that is none
constexpr double kJump = 0.5;            // of the span
constexpr double kAgreement = 5.0;       // standard deviations of one jump
constexpr double kDeviations = 3.0;      // of the mean of all
constexpr double kMostUncertain = 0.01;  // of the range
constexpr std::size_t kBins = 16;        // of the span ...
constexpr std::size_t kFilledBins = 12;  // ... that a signal which runs through it fills

double between(std::span<const std::size_t> at, std::size_t k) {
  return at.empty() ? 1.0 : static_cast<double>(at[k] - at[k - 1]);
}

bool is_whole(const std::vector<double>& x) {
  return std::all_of(x.begin(), x.end(), [](double v) { return v == std::round(v); });
}

/// The jumps of a signal, and what they say of the range.
class Jumps {
 public:
  Jumps(const std::vector<double>& x, std::span<const std::size_t> at) : x_(x), at_(at) {
    const auto [low, high] = std::minmax_element(x.begin(), x.end());
    low_ = *low;
    span_ = *high - *low;
    for (std::size_t k = 1; k < x.size(); ++k) {
      const double size = std::abs(step(k)) / between(at, k);
      if (is_jump(k))
        places_.push_back(k);
      else
        alone_ = alone_ && size <= kUsualStep * span_;
    }
  }

  /// Whether there are any, and all other steps are small.
  [[nodiscard]] bool stand_out() const noexcept {
    return alone_ && !places_.empty() &&
           static_cast<double>(places_.size()) < kMostJumps * static_cast<double>(x_.size());
  }
  [[nodiscard]] const std::vector<std::size_t>& places() const noexcept { return places_; }
  [[nodiscard]] double step(std::size_t k) const { return x_[k] - x_[k - 1]; }
  [[nodiscard]] bool whole() const noexcept { return whole_; }
  [[nodiscard]] double least() const noexcept { return least_; }
  [[nodiscard]] double most() const noexcept { return most_; }
  [[nodiscard]] double mean() const noexcept { return mean_; }

  /// Finds between what the range lies; false where the jumps do not agree.
  bool measure() {
    whole_ = is_whole(x_);
    const double resolution = whole_ ? 1.0 : 1e-6 * span_;
    double squares = 0.0;
    std::size_t count = 0;
    for (std::size_t k = 2; k + 1 < x_.size(); ++k) {
      if (is_jump(k - 1) || is_jump(k) || is_jump(k + 1)) continue;
      squares += std::pow(excess(k), 2);
      ++count;
    }
    if (count == 0) return false;
    const double scatter = std::sqrt(squares / static_cast<double>(count));
    double sum = 0.0;
    for (const std::size_t k : places_) sum += std::abs(excess(k));
    const double mean = sum / static_cast<double>(places_.size());
    for (const std::size_t k : places_)
      if (std::abs(std::abs(excess(k)) - mean) > kAgreement * scatter + 2.0 * resolution) return false;
    const double uncertain =
        kDeviations * scatter / std::sqrt(static_cast<double>(places_.size())) + 0.5 * resolution;
    least_ = std::max(mean - uncertain, span_ * (1.0 - 1e-9));
    mean_ = std::max(mean, least_);
    most_ = mean + uncertain;
    return uncertain < kMostUncertain * mean && least_ <= most_;
  }

  /// A signal that steps to and fro between two levels fills none of the range between them.
  [[nodiscard]] bool fills_range() const {
    std::array<bool, kBins> filled{};
    for (const double v : x_)
      filled[std::min(kBins - 1, static_cast<std::size_t>((v - low_) / span_ * kBins))] = true;
    return static_cast<std::size_t>(std::count(filled.begin(), filled.end(), true)) >= kFilledBins;
  }

 private:
  [[nodiscard]] bool is_jump(std::size_t k) const { return std::abs(step(k)) > kJump * span_; }

  /// A step less what the slope on either side makes of it.
  [[nodiscard]] double excess(std::size_t k) const {
    double slope = 0.0;
    int sides = 0;
    for (const std::size_t beside : {k - 1, k + 1}) {
      if (beside == 0 || beside >= x_.size() || is_jump(beside)) continue;
      slope += step(beside) / between(at_, beside);
      ++sides;
    }
    return step(k) - (sides > 0 ? slope / sides : 0.0) * between(at_, k);
  }

  const std::vector<double>& x_;
  std::span<const std::size_t> at_;
  std::vector<std::size_t> places_;
  double low_ = 0.0, span_ = 0.0, least_ = 0.0, most_ = 0.0, mean_ = 0.0;
  bool alone_ = true, whole_ = false;
};

std::optional<double> power_of_two(const Jumps& jumps, int fewest_bits) {
  for (int bits = fewest_bits; bits <= 32; ++bits)
    if (const double range = std::ldexp(1.0, bits); range >= jumps.least() && range <= jumps.most())
      return range;
  return std::nullopt;
}

double roundest(const Jumps& jumps) {
  for (int digit = static_cast<int>(std::floor(std::log10(jumps.most()))); digit >= -9; --digit) {
    const double unit = std::pow(10.0, std::abs(digit));
    const double round =
        digit < 0 ? std::round(jumps.mean() * unit) / unit : std::round(jumps.mean() / unit) * unit;
    if (round >= jumps.least() && round <= jumps.most()) return round;
  }
  return jumps.mean();
}

std::optional<Unwrapped> range_of(const Jumps& jumps, const WrapRanges& ranges) {
  Unwrapped found;
  found.jumps = jumps.places().size();
  found.whole = jumps.whole();
  for (const double known : ranges.known) {
    if (!(known >= jumps.least() && known <= jumps.most())) continue;
    found.range = known;
    return found;
  }
  if (const auto bits = power_of_two(jumps, 8); bits && ranges.counts) {
    found.range = *bits;
    return found;
  }
  if (!ranges.any || found.jumps < 2 || !jumps.fills_range()) return std::nullopt;
  found.estimated = true;
  found.range = jumps.whole() ? power_of_two(jumps, 1).value_or(roundest(jumps)) : roundest(jumps);
  return found;
}

}  // namespace

std::optional<Unwrapped> unwrap(std::vector<double>& values, std::span<const std::size_t> at,
                                const WrapRanges& ranges) {
  if (values.size() < kFewestSamples) return std::nullopt;
  Jumps jumps(values, at);
  if (!jumps.stand_out() || !jumps.measure()) return std::nullopt;
  const auto found = range_of(jumps, ranges);
  if (!found) return std::nullopt;
  std::vector<double> turns;  // one for each jump: undone only when all are known
  for (const std::size_t k : jumps.places()) turns.push_back(jumps.step(k) > 0.0 ? -1.0 : 1.0);
  double passed = 0.0;
  std::size_t next = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (next < turns.size() && jumps.places()[next] == k) passed += turns[next++];
    values[k] += passed * found->range;
  }
  return found;
}

}  // namespace resonid::io
