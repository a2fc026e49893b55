// SPDX-License-Identifier: MIT
#include "design/ends_of_lines.hpp"

#include <vector>

namespace resonid::design {
namespace {

/// Lines near to one another: w at the highest of them, with its error.
struct Group {
  double frequency_hz = 0.0, w = 0.0, error = 0.0;

  [[nodiscard]] double least() const { return w - error; }
  [[nodiscard]] double most() const { return w + error; }
};

/// From the last line down.
class Ends {
 public:
  Ends(std::span<const double> frequencies_hz, std::span<const double> sizes, std::span<const double> radii,
       double sample_time_s)
      : sample_time_s_(sample_time_s) {
    constexpr double kGroup = 1.05, kSure = 0.6;
    for (std::size_t i = frequencies_hz.size(); i > 0;) {
      const double top_hz = frequencies_hz[i - 1];
      double sum = 0.0, squares = 0.0, lines = 0.0;
      for (; i > 0 && kGroup * frequencies_hz[i - 1] > top_hz; --i) {
        const double scale = per_inertia(frequencies_hz[i - 1]), radius = scale * radii[i - 1];
        sum += scale * sizes[i - 1];
        squares += radius * radius;
        ++lines;
      }
      groups_.push_back({top_hz, sum / lines, kSure * std::sqrt(squares) / lines});
    }
    end_.size = sizes.back() + radii.back();
  }

  MachineEnd run() {
    constexpr double kNearlyHalf = 0.95;
    end_.is_whole = 2.0 * last().frequency_hz * sample_time_s_ >= kNearlyHalf;
    if (end_.is_whole) return end_;
    look_for_flank();
    by_differences_ = falls_as_differences();
    const auto peak = passed_peak();
    const double level = peak ? level_below(*peak) : largest_in(kTwoOctaves);
    constexpr double kLag = 0.85;  // room for lags
    end_.dips = peak ? without_cosine(last(), last().most()) < kLag * level : falls_to_dip(level);
    if (end_.rises) count_inertia(largest_in(kTwoOctaves));
    if (!peak || end_.dips) count_inertia(level);
    return end_;
  }

 private:
  static constexpr double kOctave = 2.0, kTwoOctaves = 4.0;
  static constexpr double kBelow = 1.5;  ///< By which w is less than at a peak, below it.

  [[nodiscard]] double per_inertia(double f) const {
    return 2.0 * std::sin(kPi * std::min(f * sample_time_s_, 0.5));
  }
  [[nodiscard]] const Group& last() const { return groups_.front(); }
  [[nodiscard]] bool is_within(const Group& g, double times) const {
    return times * g.frequency_hz >= last().frequency_hz;
  }
  [[nodiscard]] double cosine(const Group& g) const {
    constexpr double kLeast = 0.05;
    return std::max(kLeast, std::cos(kPi * g.frequency_hz * sample_time_s_));
  }
  /// Along the last octave an inertia's velocity by differences falls by the cosine, and hardly more.
  [[nodiscard]] bool falls_as_differences() const {
    constexpr double kFlat = 0.75;
    return std::ranges::all_of(groups_, [&](const Group& g) {
      return !is_within(g, kOctave) || kFlat * g.least() / cosine(g) <= last().most() / cosine(last());
    });
  }
  /// One that is measured has no cosine in it.
  [[nodiscard]] double without_cosine(const Group& g, double w) const {
    return by_differences_ ? w / cosine(g) : w;
  }
  [[nodiscard]] double largest_in(double times) const {
    double largest = 0.0;
    for (const Group& g : groups_)
      if (is_within(g, times)) largest = std::max(largest, g.least());
    return largest;
  }
  void count_inertia(double w) { end_.size = std::max(end_.size, w / per_inertia(last().frequency_hz)); }

  void look_for_flank() {
    constexpr double kRise = 1.2, kPastPeak = 1.3;
    constexpr int kFewest = 4;
    int within = 0;
    bool is_past_peak = false;
    for (const Group& g : groups_) {
      if (!is_within(g, kOctave)) break;
      ++within;
      is_past_peak = is_past_peak || g.least() > kPastPeak * last().most();
      if (!is_past_peak && last().least() > kRise * g.most()) end_.rises = true;
    }
    end_.is_sparse = within < kFewest;
  }

  /// The highest group within two octaves if it is a peak: w is less by the time of the last line, and
  /// below it within an octave. Friction makes w rise too, but along more than that.
  [[nodiscard]] std::optional<std::size_t> passed_peak() const {
    constexpr double kAbove = 1.3;
    std::size_t top = 0;
    for (std::size_t i = 1; i < groups_.size(); ++i) {
      const Group &here = groups_[i], &highest = groups_[top];
      if (here.least() > highest.least()) top = i;
      if (!is_within(groups_[top], kTwoOctaves)) return std::nullopt;
      const bool is_near = kOctave * here.frequency_hz >= groups_[top].frequency_hz;
      if (is_near && kBelow * here.most() < groups_[top].least() &&
          groups_[top].least() > kAbove * last().most())
        return top;
    }
    return std::nullopt;
  }

  /// What w is below the lowest anti-resonance under a peak, where lines show it; 0 where they do not.
  [[nodiscard]] double level_below(std::size_t peak) const {
    constexpr double kBack = 1.3;
    double least = groups_[peak].most(), level = 0.0, level_hz = 0.0;
    for (std::size_t i = peak + 1; i < groups_.size(); ++i) {
      const Group& here = groups_[i];
      if (level == 0.0) {
        least = std::min(least, here.most());
        if (here.least() > kBack * least) level = here.least(), level_hz = here.frequency_hz;
      } else if (here.least() > level) {
        level = here.least(), level_hz = here.frequency_hz;
      } else if (kBelow * here.most() < level && kOctave * here.frequency_hz >= level_hz) {
        least = here.most();  // that was another peak
        level = 0.0;
      }
    }
    return level;
  }

  [[nodiscard]] bool falls_to_dip(double level) const {
    constexpr double kLittle = 0.25, kLess = 0.6, kSteep = 1.5, kQuarter = 1.19;
    const double w = without_cosine(last(), last().most());
    if (w < kLittle * level) return true;
    if (!(w < kLess * level)) return false;
    for (const Group& g : groups_) {
      if (!(kQuarter * g.frequency_hz < last().frequency_hz)) continue;
      const double way = std::log(per_inertia(last().frequency_hz) / per_inertia(g.frequency_hz));
      return std::log(std::max(without_cosine(g, g.least()), 0.0) / w) > kSteep * way;
    }
    return false;
  }

  double sample_time_s_;
  bool by_differences_ = false;
  std::vector<Group> groups_;
  MachineEnd end_;
};

}  // namespace

MachineEnd machine_end(std::span<const double> frequencies_hz, std::span<const double> sizes,
                       std::span<const double> radii, double sample_time_s) {
  return Ends(frequencies_hz, sizes, radii, sample_time_s).run();
}

}  // namespace resonid::design
