// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/diagnostics/detail/data_findings.hpp>
#include <span>

namespace resonid::diagnostics {
namespace {

constexpr double kLowCoherence = 0.8;
constexpr double kUsableCoherence = 0.6;

/// Share of samples within 1e-6 of the range from the extremes, in runs of at least three: a limit at work.
/// Two-level excitations (a PRBS measured at the reference) sit at both extremes nearly always and are not
/// limited.
double saturated_share(const std::vector<double>& u) {
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  const double range = *high - *low;
  if (!(range > 0.0)) return 0.0;
  std::size_t limited = 0, run = 0, inside = 0;
  for (const double x : u) {
    const bool extreme = x - *low < 1e-6 * range || *high - x < 1e-6 * range;
    if (!extreme) {
      ++inside;
      if (run >= 3) limited += run;
      run = 0;
    } else {
      ++run;
    }
  }
  if (run >= 3) limited += run;
  if (inside * 4 < u.size()) return 0.0;
  return static_cast<double>(limited) / static_cast<double>(u.size());
}

void inspect_timing(const data::Record& record, std::vector<Finding>& findings) {
  const auto& s = record.sampling;
  if (!s.filled.empty()) {
    const double share = static_cast<double>(s.filled.size()) / static_cast<double>(record.samples());
    findings.push_back({"filled-samples", Severity::warning, share, 0.0,
                        fmt::format("{} of {} samples ({:.2g} %) were missing and are interpolated. Record "
                                    "without losses where that is possible.",
                                    s.filled.size(), record.samples(), 100.0 * share)});
  }
  if (!s.measured && s.gaps == 0) return;
  if (s.gaps > 0)
    findings.push_back(
        {"gaps", Severity::error, s.largest_gap_s, 1.5 * record.sample_time_s(),
         fmt::format("{} gap{} in the time stamps, the first after {:.6g} s, the longest {:.4g} s long: "
                     "samples are missing there, and what follows comes too early. Take a part without gaps.",
                     s.gaps, s.gaps == 1 ? "" : "s", s.first_gap_at_s, s.largest_gap_s)});
  const double relative = s.jitter_rms_s * record.sample_rate_hz;
  if (relative > 0.05)
    findings.push_back(
        {"jitter", Severity::warning, relative, 0.05,
         fmt::format("The time stamps jitter by {:.1f} % of the sample time (standard deviation). If the "
                     "samples were "
                     "really taken so unevenly, high frequencies are blurred: sample by a timer.",
                     100.0 * relative)});
}

/// Whether |G| itself nearly vanishes between lines `from` and `to`: lower there than half of what it is at
/// both ends.
bool output_vanishes(const data::FrequencyResponse& g, std::size_t from, std::size_t to) {
  const double left = std::abs(g.value[from > 0 ? from - 1 : 0]);
  const double right = std::abs(g.value[std::min(to, g.lines() - 1)]);
  double least = std::abs(g.value[from]);
  for (std::size_t i = from; i < to; ++i) least = std::min(least, std::abs(g.value[i]));
  return from > 0 && to < g.lines() && least < 0.5 * std::min(left, right);
}

/// Lines `from` ... `to - 1`, most of them below the threshold.
struct LowBand {
  std::size_t from = 0;
  std::size_t to = 0;
};

/// Bands of low coherence. Neighbours less than a tenth of their frequency apart are one band: where
/// coherence hovers around the threshold it would fall into dozens. Single lines count only where there are
/// few.
std::vector<LowBand> low_bands(const data::FrequencyResponse& g) {
  std::vector<LowBand> bands;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    if (g.coherence[i] >= kLowCoherence) continue;
    constexpr double kApart = 1.1;
    if (!bands.empty() &&
        (bands.back().to == i || g.frequency_hz[i] < kApart * g.frequency_hz[bands.back().to - 1]))
      bands.back().to = i + 1;
    else
      bands.push_back({i, i + 1});
  }
  const std::size_t least = g.lines() < 33 ? 1 : 2;
  std::erase_if(bands, [&](const LowBand& b) { return b.to - b.from < least; });
  return bands;
}

Finding low_coherence(const data::FrequencyResponse& g, const LowBand& band) {
  const auto first = g.coherence.begin() + static_cast<std::ptrdiff_t>(band.from);
  const auto lowest = static_cast<std::size_t>(
      std::min_element(first, g.coherence.begin() + static_cast<std::ptrdiff_t>(band.to)) -
      g.coherence.begin());
  const char* reason = output_vanishes(g, band.from, band.to)
                           ? "The output nearly vanishes there, as it does in an anti-resonance."
                           : "Little excitation or much noise there: do not read resonances from that band.";
  return {"low-coherence", Severity::warning, g.coherence[lowest], kLowCoherence,
          fmt::format("Coherence is below {:.1f} from {:.4g} to {:.4g} Hz, lowest at {:.4g} Hz ({:.2f}). {}",
                      kLowCoherence, g.frequency_hz[band.from], g.frequency_hz[band.to - 1],
                      g.frequency_hz[lowest], g.coherence[lowest], reason)};
}

/// A sample more than ten times as far from the median as all but 0.5 % of the others are: a transmission
/// error.
void inspect_outliers(const data::Channel& channel, std::vector<Finding>& findings) {
  if (channel.samples.size() < 200) return;
  const double middle = median(channel.samples);
  std::vector<double> distance;
  for (const double x : channel.samples) distance.push_back(std::abs(x - middle));
  const auto largest =
      static_cast<std::size_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
  const double furthest = distance[largest];
  const auto usual =
      distance.begin() + static_cast<std::ptrdiff_t>(0.995 * static_cast<double>(distance.size()));
  std::nth_element(distance.begin(), usual, distance.end());
  constexpr double kFar = 10.0;
  if (!(furthest > kFar * *usual) || !(*usual > 0.0)) return;
  findings.push_back(
      {"outlier", Severity::error, channel.samples[largest], middle + kFar * *usual,
       fmt::format("Sample {} of {} is {:.4g}, far from all others: a transmission or conversion error. "
                   "Remove it, or cut the recording with .from_s and .to_s.",
                   largest, channel.name, channel.samples[largest])});
}

struct Run {
  std::size_t first = 0, samples = 0;
};

/// Longest stretch of the same value, and how many samples stand in stretches of three and more at the values
/// `low` and `high`.
struct Runs {
  Run longest;
  std::size_t low = 0, high = 0;
};

Runs runs_of(const std::vector<double>& y, double low, double high) {
  Runs runs;
  for (std::size_t first = 0, k = 1; k <= y.size(); ++k) {
    if (k < y.size() && y[k] == y[first]) continue;
    const std::size_t length = k - first;
    if (length > runs.longest.samples) runs.longest = {first, length};
    if (length >= 3 && y[first] == low) runs.low += length;
    if (length >= 3 && y[first] == high) runs.high += length;
    first = k;
  }
  return runs;
}

/// A velocity that stands still at a value other than zero while the torque goes on, or that ends at a limit:
/// a bus or a converter, no machine. Not of coarse velocities, which keep their few values for long.
void inspect_velocity(const data::Record& record, std::vector<Finding>& findings) {
  constexpr std::size_t kValues = 100;  // different ones, from which on a velocity is no coarse one
  constexpr double kStuck = 0.02;       // of the samples
  constexpr double kLimited = 0.01;     // of the samples
  constexpr double kMoves = 0.25;       // of its variance, that the input has meanwhile
  const auto& y = record.output.samples;
  const auto& u = record.input.samples;
  if (y.size() < 2 * kValues || u.size() != y.size()) return;
  std::vector<double> sorted = y;
  std::sort(sorted.begin(), sorted.end());
  const auto values = static_cast<std::size_t>(std::unique(sorted.begin(), sorted.end()) - sorted.begin());
  if (values < kValues) return;
  const double low = sorted.front(), high = sorted[values - 1];
  const double still = 1e-3 * std::max(std::abs(low), std::abs(high));
  const Runs runs = runs_of(y, low, high);
  const auto n = static_cast<double>(y.size());
  const auto [first, samples] = runs.longest;
  const std::span<const double> meanwhile(u.data() + first, samples);
  if (static_cast<double>(samples) > kStuck * n && std::abs(y[first]) > still &&
      variance(meanwhile) > kMoves * variance(u))
    return findings.push_back(
        {"stuck-output", Severity::error, static_cast<double>(samples) / n, kStuck,
         fmt::format("The output {} repeats the same value {:.6g} over {} samples from {:.4g} s on, while "
                     "the input goes "
                     "on: the measurement stood still. Take a part without that (.from_s, .to_s).",
                     record.output.name, y[first], samples,
                     record.start_time_s + static_cast<double>(first) / record.sample_rate_hz)});
  const bool at_high = runs.high >= runs.low;
  const double limit = at_high ? high : low;
  const double share = static_cast<double>(at_high ? runs.high : runs.low) / n;
  if (share > kLimited && std::abs(limit) > still)
    findings.push_back(
        {"limited-output", Severity::error, share, kLimited,
         fmt::format("The output {} stays at its limit {:.6g} for {:.1f} % of the time: its measurement is "
                     "clipped there. Excite less, or move more slowly.",
                     record.output.name, limit, 100.0 * share)});
}

/// A position that steps by more than half of its span where all other steps are small, and runs through the
/// span besides: a counter that wraps around or is set anew. What wraps around by one range the reader
/// undoes.
void inspect_position(const data::Record& record, std::vector<Finding>& findings) {
  constexpr double kJump = 0.5, kUsual = 0.25;     // of the span
  constexpr double kMost = 0.25;                   // of the samples
  constexpr std::size_t kBins = 16, kFilled = 12;  // of the span
  const auto& y = record.output.samples;
  const auto [low, high] = std::minmax_element(y.begin(), y.end());
  const double span = *high - *low;
  if (!(span > 0.0)) return;
  std::vector<double> jumps;
  std::size_t first = 0;
  std::array<bool, kBins> filled{};
  for (std::size_t k = 0; k < y.size(); ++k) {
    filled[std::min(kBins - 1, static_cast<std::size_t>((y[k] - *low) / span * kBins))] = true;
    const double step = k > 0 ? std::abs(y[k] - y[k - 1]) : 0.0;
    if (step > kJump * span) {
      if (jumps.empty()) first = k;
      jumps.push_back(step);
    } else if (step > kUsual * span) {
      return;
    }
  }
  const auto full = static_cast<std::size_t>(std::count(filled.begin(), filled.end(), true));
  if (jumps.empty() || static_cast<double>(jumps.size()) > kMost * static_cast<double>(y.size()) ||
      full < kFilled)
    return;
  const auto [least, most] = std::minmax_element(jumps.begin(), jumps.end());
  const std::string by = jumps.size() == 1
                             ? fmt::format("once by {:.5g}", *least)
                             : fmt::format("{} times by {:.5g} ... {:.5g}", jumps.size(), *least, *most);
  findings.push_back(
      {"position-jumps", Severity::error, static_cast<double>(jumps.size()), 0.0,
       fmt::format("The position {} jumps {} {} from one sample to the next, first at {:.4g} s, which shows "
                   "no range: "
                   "the counter was set anew, lost counts, or wraps around. Give .counts_per_rev if it wraps "
                   "around there, or take a part between two jumps (.from_s, .to_s).",
                   record.output.name, by, record.output.unit,
                   record.start_time_s + static_cast<double>(first) / record.sample_rate_hz)});
}

}  // namespace

std::vector<Finding> inspect(const data::Record& record) {
  std::vector<Finding> findings;
  inspect_timing(record, findings);
  const auto& u = record.input.samples;
  const auto& y = record.output.samples;
  const auto constant = [](const std::vector<double>& x) {
    const auto [low, high] = std::minmax_element(x.begin(), x.end());
    return *low == *high;
  };
  if (constant(u))
    findings.push_back({"no-excitation",
                        Severity::error,
                        0.0,
                        {},
                        fmt::format("The input {} is constant: nothing can be learned from it. Is the right "
                                    "signal recorded (.input)?",
                                    record.input.name)});
  if (constant(y))
    findings.push_back({"dead-output",
                        Severity::error,
                        0.0,
                        {},
                        fmt::format("The output {} is constant: is the right signal recorded (.output)?",
                                    record.output.name)});
  inspect_outliers(record.input, findings);
  inspect_outliers(record.output, findings);
  if (record.output_quantity == data::OutputQuantity::velocity) inspect_velocity(record, findings);
  if (record.output_quantity == data::OutputQuantity::position) inspect_position(record, findings);
  const double saturated = saturated_share(u);
  if (saturated > 0.005)
    findings.push_back(
        {"saturation", saturated > 0.1 ? Severity::error : Severity::warning, saturated, 0.005,
         fmt::format("The input stays at its limit for {:.1f} % of the time. A limited drive is not "
                     "linear: reduce the amplitude.",
                     100.0 * saturated)});
  return findings;
}

std::vector<Finding> inspect(const data::FrequencyResponse& g) {
  std::vector<Finding> findings;
  if (!g.unsettled_hz.empty())
    findings.push_back(
        {"unsettled-lines", Severity::warning, static_cast<double>(g.unsettled_hz.size()), 0.0,
         fmt::format("{} of {} lines had not settled when the recording ended (the first at {:.4g} Hz): "
                     "record longer, or track fewer lines.",
                     g.unsettled_hz.size(), g.lines() + g.unsettled_hz.size(), g.unsettled_hz.front())});
  if (g.coherence.size() != g.lines() || g.lines() == 0) return findings;
  const double middle = median(g.coherence);
  const auto usable = static_cast<double>(
      std::count_if(g.coherence.begin(), g.coherence.end(), [](double c) { return c >= kUsableCoherence; }));
  const double all = static_cast<double>(g.lines());
  if (usable < std::max(std::min(3.0, all), 0.05 * all)) {
    findings.push_back(
        {"incoherent", Severity::error, usable / static_cast<double>(g.lines()), 0.05,
         fmt::format("The excitation is too weak for noise and motion, or the output is no response to it "
                     "(wrong column): only "
                     "{:.0f} of {} lines from {:.3g} to {:.3g} Hz are coherent (median coherence {:.2f}). "
                     "Excite more strongly "
                     "there, or check the columns (.input, .output).",
                     usable, g.lines(), g.frequency_hz.front(), g.frequency_hz.back(), middle)});
    return findings;
  }
  for (const auto& band : low_bands(g)) findings.push_back(low_coherence(g, band));
  return findings;
}

}  // namespace resonid::diagnostics
