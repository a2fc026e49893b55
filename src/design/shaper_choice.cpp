// SPDX-License-Identifier: MIT
#include "design/shaper_choice.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <utility>

#include "design/closed_loop.hpp"
#include "design/normal.hpp"
#include "linalg/decompositions.hpp"
#include "linalg/parallel.hpp"

namespace resonid::design {
namespace {

/// All kinds for the first mode, or all pairs for two.
expected<std::vector<ShaperCandidate>> candidates_for(const std::vector<ShapedMode>& designed, double limit) {
  std::vector<ShaperCandidate> all = {{{}, {{1.0}, {0.0}}, 0.0}};
  for (const ShapedMode& mode : designed) {
    std::vector<ShaperCandidate> longer;
    for (const ShaperKind kind : kShaperKinds) {
      const auto shaper = shaper_for(kind, mode, limit);
      if (!shaper) return tl::unexpected(shaper.error());
      for (ShaperCandidate candidate : all) {
        candidate.kinds.push_back(kind);
        candidate.shaper = convolved(candidate.shaper, *shaper);
        longer.push_back(std::move(candidate));
      }
    }
    all = std::move(longer);
  }
  return all;
}

/// Linear between order statistics.
double quantile_of(std::vector<double> values, double quantile) {
  std::sort(values.begin(), values.end());
  const double at = quantile * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (at - std::floor(at)) * (values[above] - values[below]);
}

bool is_shorter(const ShaperCandidate& a, const ShaperCandidate& b) {
  constexpr double kAlike = 1e-9;
  const double difference = a.shaper.duration_s() - b.shaper.duration_s();
  return std::abs(difference) > kAlike * b.shaper.duration_s() ? difference < 0.0 : a.quantile < b.quantile;
}

}  // namespace

double vibration_quantile(const Shaper& shaper, const std::vector<ModesOfDraw>& draws, double quantile) {
  if (draws.empty()) return 0.0;
  std::vector<double> worst;
  for (const ModesOfDraw& modes : draws) {
    double most = 0.0;
    for (const ShapedMode& mode : modes) most = std::max(most, residual_vibration(shaper, mode));
    worst.push_back(most);
  }
  return quantile_of(worst, quantile);
}

std::optional<ShapedMode> middle_mode(const std::vector<ModesOfDraw>& draws) {
  std::vector<double> frequencies_hz, dampings;
  for (const ModesOfDraw& modes : draws) {
    for (const ShapedMode& mode : modes) {
      frequencies_hz.push_back(mode.frequency_hz);
      dampings.push_back(mode.damping_ratio);
    }
  }
  if (dampings.empty()) return std::nullopt;
  const double low_hz = quantile_of(frequencies_hz, 0.025), high_hz = quantile_of(frequencies_hz, 0.975);
  return ShapedMode{std::sqrt(low_hz * high_hz), quantile_of(dampings, 0.5)};
}

expected<ShaperChoice> choose_shaper(const std::vector<ShapedMode>& designed,
                                     const std::vector<ModesOfDraw>& draws, const ShaperOptions& options) {
  if (designed.empty() || designed.size() > 2)
    return refuse("designed", "must be one or two modes", static_cast<double>(designed.size()));
  if (draws.empty()) return refuse("draws", "must not be empty");
  if (!(options.quantile > 0.0 && options.quantile < 1.0))
    return refuse("quantile", "must be > 0 and below 1", options.quantile);
  auto candidates = candidates_for(designed, options.limit);
  if (!candidates) return tl::unexpected(candidates.error());
  ShaperChoice choice{std::move(*candidates), std::nullopt};
  for (ShaperCandidate& candidate : choice.candidates) {
    if (options.sample_time_s) candidate.shaper = sampled(candidate.shaper, *options.sample_time_s);
    candidate.quantile = vibration_quantile(candidate.shaper, draws, options.quantile);
  }
  std::sort(choice.candidates.begin(), choice.candidates.end(), is_shorter);
  for (std::size_t i = 0; i < choice.candidates.size() && !choice.chosen; ++i)
    if (choice.candidates[i].quantile <= options.limit) choice.chosen = i;
  return choice;
}

std::vector<ShownMode> shown_modes(const ClosedLoop& loop,
                                   const std::function<std::complex<double>(std::complex<double>)>& further) {
  const auto right = linalg::eigenpairs(loop.a), left = linalg::eigenpairs(loop.a.transpose());
  std::vector<ShownMode> found;
  for (Eigen::Index i = 0; i < right.values.size(); ++i) {
    const std::complex<double> pole = right.values(i);
    constexpr double kGone = 1e-3;  // after a sample
    if (!(pole.imag() > 0.0) || std::abs(pole) < kGone || !(std::abs(pole) < 1.0)) continue;
    Eigen::Index j = 0;
    (left.values.array() - pole).abs().minCoeff(&j);
    const Eigen::VectorXcd r = right.vectors.col(i), l = left.vectors.col(j);
    const std::complex<double> shown = loop.load.cast<std::complex<double>>() * r;
    const auto excited = (l.transpose() * loop.reference.cast<std::complex<double>>()).value();
    auto step = shown * excited / (l.transpose() * r).value() / (pole - 1.0);
    if (further) step *= further(pole);
    const auto s = std::log(pole) / loop.sample_time_s;
    found.push_back({{std::abs(s) / kTwoPi, -s.real() / std::abs(s)},
                     std::abs(step) * std::exp(s.real() * kPi / s.imag())});
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.size > b.size; });
  return found;
}

std::optional<ShapedMode> shaped_mode_of(const fit::DriveModel& machine, const FilteredPi& controller) {
  const auto modes =
      shown_modes(closed_loop(fit::sampled_states(machine), states_of(controller, machine.sample_time_s)));
  if (modes.empty() || !(modes.front().size > 0.0)) return std::nullopt;
  return modes.front().mode;
}

TwoModes split_at(const std::vector<ModesOfDraw>& draws, double frequency_hz) {
  TwoModes two{std::vector<ModesOfDraw>(draws.size()), std::vector<ModesOfDraw>(draws.size())};
  for (std::size_t i = 0; i < draws.size(); ++i)
    for (const ShapedMode& mode : draws[i])
      (mode.frequency_hz < frequency_hz ? two.low : two.high)[i].push_back(mode);
  return two;
}

std::optional<TwoModes> two_modes(const std::vector<ModesOfDraw>& draws, double least) {
  // Between the least and the largest frequency of the draws that have both, in their logarithms.
  double low = 0.0, high = 0.0;
  std::size_t both = 0;
  for (const ModesOfDraw& modes : draws) {
    if (modes.size() < 2) continue;
    const auto [first, last] =
        std::minmax_element(modes.begin(), modes.end(),
                            [](const auto& a, const auto& b) { return a.frequency_hz < b.frequency_hz; });
    low += std::log(first->frequency_hz);
    high += std::log(last->frequency_hz);
    ++both;
  }
  if (both == 0 || static_cast<double>(both) < least * static_cast<double>(draws.size())) return std::nullopt;
  return split_at(draws, std::exp(0.5 * (low + high) / static_cast<double>(both)));
}

std::vector<ModesOfDraw> shaped_modes(const Posterior& posterior, const FilteredPi& controller,
                                      std::size_t draws, std::uint64_t seed) {
  StandardNormal normal(seed);
  std::vector<Eigen::VectorXd> points;
  for (std::size_t i = 0; i < draws; ++i) points.push_back(normal.next(posterior.dimension()));
  std::vector<ModesOfDraw> modes(draws);
  linalg::for_each_index(draws, 0, [&](std::size_t i) {
    if (const auto mode = shaped_mode_of(posterior.at(points[i]), controller)) modes[i] = {*mode};
  });
  return modes;
}

}  // namespace resonid::design
