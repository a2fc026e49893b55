// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/measure/resolution.hpp>
#include <limits>
#include <resonid/response/welch.hpp>

namespace resonid::identification::detail {
namespace {

double reference_power(const response::LineEstimates& lines, std::size_t i) {
  const auto& line = lines.lines[i];
  return std::max(lines.has_excitation ? std::norm(line.excitation) : 0.0,
                  lines.has_excitation ? 0.0 : std::norm(line.input));
}

/// Whether the line's own power is not what a window leaks of its neighbours or of the strongest line.
std::vector<bool> excited(const response::LineEstimates& lines) {
  constexpr std::size_t kReach = 4;  // lines in which a Hann window falls by 60 dB
  constexpr double kBeside = 1e-2, kAnywhere = 1e-7;
  std::vector<double> power;
  double most = 0.0;
  for (std::size_t i = 0; i < lines.lines.size(); ++i) {
    power.push_back(reference_power(lines, i));
    most = std::max(most, power.back());
  }
  std::vector<bool> own;
  for (std::size_t i = 0; i < power.size(); ++i) {
    double near = 0.0;
    for (std::size_t k = i > kReach ? i - kReach : 0; k < std::min(i + kReach + 1, power.size()); ++k)
      near = std::max(near, power[k]);
    own.push_back(power[i] > kBeside * near && power[i] > kAnywhere * most);
  }
  return own;
}

/// Coherence without its mean by chance.
double beyond_chance(const response::LineEstimate& line) {
  if (!std::isfinite(line.coherence)) return 0.0;
  const double degrees = std::max(line.degrees_of_freedom, 1.0);
  return std::max(0.0, line.coherence - (1.0 - line.coherence) / degrees);
}

/// [point] of a logarithmic grid: index of the line there, or one past the last.
std::vector<std::size_t> lines_at(const response::LineEstimates& lines, double low_hz, double high_hz) {
  constexpr int kPoints = 200;
  const auto& all = lines.lines;
  std::vector<std::size_t> at;
  for (int k = 0; k < kPoints; ++k) {
    const double f = low_hz * std::pow(high_hz / low_hz, (k + 0.5) / kPoints);
    const auto after = static_cast<std::size_t>(
        std::lower_bound(all.begin(), all.end(), f,
                         [](const auto& l, double hz) { return l.frequency_hz < hz; }) -
        all.begin());
    const bool last = after == all.size();
    const bool first = after == 0;
    const auto nearest =
        last || (!first && f - all[after - 1].frequency_hz < all[after].frequency_hz - f) ? after - 1 : after;
    if (all.empty() || (last && first)) {
      at.push_back(all.size());
      continue;
    }
    // Half a line's distance belongs to each.
    const double spacing = nearest > 0 ? all[nearest].frequency_hz - all[nearest - 1].frequency_hz
                           : nearest + 1 < all.size()
                               ? all[nearest + 1].frequency_hz - all[nearest].frequency_hz
                               : 0.0;
    at.push_back(std::abs(all[nearest].frequency_hz - f) <= 0.51 * spacing ? nearest : all.size());
  }
  return at;
}

/// Share of a logarithmic scale on which lines are known to 30 %.
double known_share(const response::LineEstimates& lines, const data::FrequencyResponse& g, double low_hz,
                   double high_hz) {
  if (g.lines() != lines.lines.size()) return 0.0;
  const auto at = lines_at(lines, low_hz, high_hz);
  const auto known = std::count_if(at.begin(), at.end(), [&](std::size_t i) {
    return i < g.lines() && g.std[i] < kCriteria.orientation_line * std::abs(g.value[i]);
  });
  return static_cast<double>(known) / static_cast<double>(at.size());
}

/// Lines first ... last, by their ln f.
struct Run {
  std::size_t first = 0, last = 0, lines = 0;
};

/// Runs of known lines among mostly known ones; a few that chance makes known here and there are none.
std::vector<Run> known_runs(const std::vector<double>& x, const std::vector<bool>& known) {
  constexpr double kReach = 0.1;  // of ln f, in which most lines are known, and that parts runs
  constexpr std::size_t kFewest = 3, kSparse = 3;
  std::vector<Run> runs;
  std::size_t low = 0, high = 0, count = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    for (; high < x.size() && x[high] <= x[i] + kReach; ++high) count += known[high] ? 1 : 0;
    for (; x[low] < x[i] - kReach; ++low) count -= known[low] ? 1 : 0;
    if (!known[i] || 2 * count < high - low) continue;
    if (runs.empty() || (x[i] - x[runs.back().last] > kReach && i > runs.back().last + kSparse))
      runs.push_back({i, i, 0});
    runs.back().last = i;
    ++runs.back().lines;
  }
  std::erase_if(runs, [&](const Run& r) {
    return r.lines < kFewest || (x[r.last] - x[r.first] < 0.5 * kReach && r.last - r.first > 2 * kSparse);
  });
  return runs;
}

}  // namespace

std::optional<std::pair<double, double>> coherent_band(const response::LineEstimates& lines,
                                                       const data::FrequencyResponse& g) {
  const double gap = std::log(kCriteria.coherent_gap);
  const auto own = excited(lines);
  std::vector<double> x;
  std::vector<bool> known;
  for (std::size_t i = 0, k = 0; i < g.lines(); ++i) {
    while (k < lines.lines.size() && lines.lines[k].frequency_hz < g.frequency_hz[i]) ++k;
    x.push_back(std::log(g.frequency_hz[i]));
    // An indirect response may look known where it is noise: its coherence tells.
    constexpr double kChance = 4.0;  // times 1/degrees: exceeded by 2 % of noise
    const bool coherent =
        k < own.size() &&
        (!std::isfinite(lines.lines[k].coherence) || !std::isfinite(lines.lines[k].degrees_of_freedom) ||
         lines.lines[k].coherence * lines.lines[k].degrees_of_freedom > kChance);
    known.push_back(coherent && own[k] && g.std[i] < kCriteria.usable_line * std::abs(g.value[i]));
  }
  std::vector<Run> stretches;
  for (const auto& run : known_runs(x, known)) {
    if (stretches.empty() || x[run.first] - x[stretches.back().last] > gap)
      stretches.push_back(run);
    else
      stretches.back().last = run.last;
  }
  const auto widest = std::max_element(stretches.begin(), stretches.end(), [&](const Run& a, const Run& b) {
    return x[a.last] - x[a.first] < x[b.last] - x[b.first];
  });
  if (widest == stretches.end()) return std::nullopt;
  return std::pair{g.frequency_hz[widest->first], g.frequency_hz[widest->last]};
}

namespace {

std::vector<double> coherences(const response::LineEstimates& lines, double low_hz, double high_hz) {
  std::vector<double> all;
  for (const std::size_t i : lines_at(lines, low_hz, high_hz))
    all.push_back(i < lines.lines.size() ? beyond_chance(lines.lines[i]) : 0.0);
  return all;
}

}  // namespace

double coherent_share(const response::LineEstimates& lines, double low_hz, double high_hz) {
  double sum = 0.0;
  const auto all = coherences(lines, low_hz, high_hz);
  for (const double c : all) sum += c;
  return sum / static_cast<double>(all.size());
}

double coherent_gain(const response::LineEstimates& finer, const response::LineEstimates& coarser,
                     double low_hz, double high_hz) {
  const auto fine = coherences(finer, low_hz, high_hz), coarse = coherences(coarser, low_hz, high_hz);
  const std::size_t tenth = fine.size() / 10;
  double sum = 0.0, most = 0.0;
  for (std::size_t k = 0; k < fine.size(); ++k) {
    sum += fine[k] - coarse[k];
    if (k >= tenth) sum -= fine[k - tenth] - coarse[k - tenth];
    if (k + 1 >= tenth) most = std::max(most, sum / static_cast<double>(tenth));
  }
  return most;
}

expected<Resolved, Error> resolved_welch_lines(const data::Record& record, const Plan& plan,
                                               const Options& options) {
  constexpr std::size_t kShortest = 512;
  const std::size_t usual = response::default_segment(record.samples(), record.sample_rate_hz);
  std::size_t longest = usual;
  while (4 * 2 * longest <= record.samples()) longest *= 2;
  struct Trial {
    Resolved found;
    data::FrequencyResponse response;
  };
  std::vector<Trial> trials;
  double low_hz = std::numeric_limits<double>::infinity(), high_hz = 0.0;
  std::optional<Error> refusal;
  for (std::size_t segment = longest; segment >= std::min(usual, kShortest); segment /= 2) {
    response::WelchConfig config;
    config.segment_samples = segment;
    config.band_low_hz = plan.low_hz;
    config.band_high_hz = plan.high_hz;
    auto lines = response::welch_lines(record, config, plan.approach);
    if (!lines) {
      refusal = lines.error();
      continue;
    }
    auto g = response::plant_response(*lines, {plan.approach, options.controller, options.delay_s});
    if (!g || g->lines() == 0) continue;
    if (const auto band = coherent_band(*lines, *g)) {
      low_hz = std::min(low_hz, band->first);
      high_hz = std::max(high_hz, band->second);
    }
    Trial trial{{}, std::move(*g)};
    trial.found.lines = std::move(*lines);
    trial.found.segment_samples = segment;
    trials.push_back(std::move(trial));
  }
  if (trials.empty())
    return tl::unexpected(refusal ? std::move(*refusal) : Error{"input", "gives no finite response"});
  if (!(high_hz > low_hz)) {  // nothing is coherent anywhere: the broadest lines, as they are
    return std::move(trials.back().found);
  }
  for (auto& t : trials) {
    t.found.share = coherent_share(t.found.lines, low_hz, high_hz);
    t.found.low_hz = low_hz;
    t.found.high_hz = high_hz;
  }
  const bool too_coarse = trials.size() > 1 && coherent_gain(trials[0].found.lines, trials[1].found.lines,
                                                             low_hz, high_hz) > kCriteria.lost_coherence;
  Trial* chosen = nullptr;
  double most = 0.0;
  for (auto& t : trials) {
    const double share = known_share(t.found.lines, t.response, low_hz, high_hz);
    if (chosen != nullptr && !(share > most + kCriteria.more_known)) continue;
    // Beyond its first lines, which a shorter segment cannot have.
    const double from_hz =
        std::max(low_hz, 3.0 * record.sample_rate_hz / static_cast<double>(t.found.segment_samples));
    if (chosen != nullptr && from_hz < high_hz &&
        coherent_gain(chosen->found.lines, t.found.lines, from_hz, high_hz) > kCriteria.lost_coherence)
      break;
    chosen = &t;
    most = share;
  }
  chosen->found.too_coarse = too_coarse;
  return std::move(chosen->found);
}

std::vector<double> fine_grid(const data::Record& record, double low_hz, double high_hz) {
  constexpr double kApart = 0.01;
  const double spacing = 1.0 / record.duration_s(), nyquist = 0.5 * record.sample_rate_hz;
  std::vector<double> grid;
  for (double f = std::max(low_hz, 2.0 * spacing); f <= std::min(high_hz, 0.98 * nyquist);
       f += std::max(spacing, kApart * f))
    grid.push_back(f);
  return grid;
}

}  // namespace resonid::identification::detail
