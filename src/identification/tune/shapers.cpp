// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <utility>

#include "design/normal.hpp"
#include "design/shaper_choice.hpp"
#include "identification/tune/scheduled.hpp"
#include "identification/tune/value.hpp"
#include "linalg/parallel.hpp"

namespace resonid::identification {
namespace {

constexpr std::size_t kShaperDraws = 500;
constexpr double kShare = 0.95;  // of the draws that stay below the limit

/// A machine that may be, and its controller.
struct ShapedLoop {
  design::Posterior posterior;
  Law law;
};

/// Of every result, and every node of a schedule.
std::vector<ShapedLoop> shaped_loops(const Tuning& tuning, const std::vector<design::Posterior>& posteriors) {
  std::vector<ShapedLoop> loops;
  if (!tuning.schedule) {
    for (const auto& posterior : posteriors) loops.push_back({posterior, law_of(tuning.proposed())});
    return loops;
  }
  std::vector<double> positions = tuning.options.positions;
  for (const auto& node : tuning.schedule->nodes) positions.push_back(node.position);
  std::sort(positions.begin(), positions.end());
  positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
  const auto posterior_at = posterior_over(tuning, posteriors);
  const auto gains = gains_over(*tuning.schedule);
  for (const double position : positions) {
    Law law = law_of(gains.at(position), tuning.sample_time_s);
    set_weight(law, tuning.schedule->set_point_weight);
    loops.push_back({posterior_at(position), std::move(law)});
  }
  return loops;
}

/// What the load shows of one machine after a step of the reference by 1.
struct LoadModes {
  design::ModesOfDraw modes;  ///< The one it shows most, and a second one that is more than may be left.
  double amplitude = 0.0;     ///< Of the first, a period after the step.
};

LoadModes modes_of(const design::Machine& machine, const Law& law, double least) {
  std::vector<design::ShownMode> shown;
  const auto kv = law.what.position_gain;
  const double step = machine.sample_time_s();
  // From the reference of position to that of velocity, and on to the position of the load.
  const auto of_position = [&](std::complex<double> z) {
    const auto q = step * z / (z - 1.0);
    return *kv * q / (1.0 + *kv * q);
  };
  if (kv)
    shown = shown_modes(loop_of(machine, law), of_position);
  else
    shown = shown_modes(loop_of(machine, law));
  LoadModes found;
  for (const auto& mode : shown)
    if (found.modes.size() < 2 && mode.size > (found.modes.empty() ? 0.0 : least))
      found.modes.push_back(mode.mode);
  // A pole and its conjugate show twice the real part of what one of them does.
  if (!found.modes.empty()) {
    const double damping = found.modes.front().damping_ratio;
    const double of_half_a_period = std::exp(-kPi * damping / std::sqrt(1.0 - damping * damping));
    found.amplitude = 2.0 * shown.front().size * of_half_a_period;
  }
  return found;
}

/// [draw] Of all loops; the draws of several go together.
struct LoadDraws {
  std::vector<design::ModesOfDraw> modes;
  std::vector<double> amplitude;  ///< The largest.

  /// That 95 % of the machines stay below.
  [[nodiscard]] double unshaped() const {
    auto ordered = amplitude;
    std::sort(ordered.begin(), ordered.end());
    return ordered_quantile(ordered, kShare);
  }
};

LoadDraws drawn_modes(const std::vector<ShapedLoop>& loops, double least, std::uint64_t seed) {
  LoadDraws draws{std::vector<design::ModesOfDraw>(kShaperDraws), std::vector<double>(kShaperDraws, 0.0)};
  for (const auto& loop : loops) {
    design::StandardNormal normal(seed);
    std::vector<Eigen::VectorXd> points;
    for (std::size_t i = 0; i < kShaperDraws; ++i) points.push_back(normal.next(loop.posterior.dimension()));
    linalg::for_each_index(kShaperDraws, 0, [&](std::size_t i) {
      const auto found = modes_of(design::Machine(loop.posterior.at(points[i])), loop.law, least);
      draws.modes[i].insert(draws.modes[i].end(), found.modes.begin(), found.modes.end());
      draws.amplitude[i] = std::max(draws.amplitude[i], found.amplitude);
    });
  }
  return draws;
}

/// Whether two modes of one machine count, somewhere.
std::optional<design::TwoModes> two_of(const std::vector<ShapedLoop>& loops,
                                       const std::vector<design::ModesOfDraw>& draws, double least) {
  for (const auto& loop : loops) {
    const auto modes = modes_of(design::Machine(loop.posterior.nominal()), loop.law, least).modes;
    if (modes.size() > 1) return design::two_modes(draws);
  }
  return std::nullopt;
}

std::string kinds_in_words(const std::vector<design::ShaperKind>& kinds) {
  std::string text;
  for (const auto kind : kinds) text += (text.empty() ? "" : "+") + std::string(name_of(kind));
  return text;
}

bool put_shapers(Tuning& tuning, const std::vector<design::ShapedMode>& designed,
                 const std::vector<design::ModesOfDraw>& draws) {
  const auto choice =
      choose_shaper(designed, draws, {tuning.options.shaper_limit, kShare, tuning.sample_time_s});
  if (!choice) return false;
  tuning.shapers.clear();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < choice->candidates.size(); ++i) {
    const auto& c = choice->candidates[i];
    // Of the pairs for two modes those that are not both longer and worse than another one.
    if (designed.size() > 1 && c.quantile >= least) continue;
    least = std::min(least, c.quantile);
    tuning.shapers.push_back({kinds_in_words(c.kinds), c.shaper.duration_s(), c.quantile, choice->chosen == i,
                              c.shaper.amplitudes, c.shaper.times_s});
  }
  const auto told = [](const design::ShapedMode& mode) {
    return design::ClosedLoopMode{mode.frequency_hz, mode.damping_ratio};
  };
  tuning.shaped_mode = told(designed.front());
  tuning.second_shaped_mode.reset();
  if (designed.size() > 1) tuning.second_shaped_mode = told(designed.back());
  return choice->chosen.has_value();
}

}  // namespace

void add_shapers(Tuning& tuning, const std::vector<design::Posterior>& posteriors) {
  if (!tuning.proposed().stable) return;
  const double least = tuning.options.shaper_limit;
  const auto loops = shaped_loops(tuning, posteriors);
  const auto drawn = drawn_modes(loops, least, tuning.options.seed);
  const auto& draws = drawn.modes;
  const auto middle = middle_mode(draws);
  if (const double unshaped = drawn.unshaped(); unshaped <= least) {
    tuning.shapers = {{"none", 0.0, unshaped, true, {1.0}, {0.0}}};
    if (middle) tuning.shaped_mode = design::ClosedLoopMode{middle->frequency_hz, middle->damping_ratio};
    return;
  }
  if (!middle) return;
  const bool met = put_shapers(tuning, {*middle}, draws);
  if (met) return;
  // Where no shaper of one mode does: one for each of two, or of the halves of the range in which one moves.
  auto two = two_of(loops, draws, least);
  if (!two) two = design::split_at(draws, middle->frequency_hz);
  const auto low = middle_mode(two->low), high = middle_mode(two->high);
  if (!low || !high) return;
  const auto of_one = std::exchange(tuning.shapers, {});
  if (put_shapers(tuning, {*low, *high}, draws)) return;
  tuning.shapers = of_one;
  tuning.shaped_mode = design::ClosedLoopMode{middle->frequency_hz, middle->damping_ratio};
  tuning.second_shaped_mode.reset();
}

}  // namespace resonid::identification
