// SPDX-License-Identifier: MIT
#include "design/maxima.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace resonid::design {
namespace {

/// Where the parabola through three points is largest; nothing finite where it bends the other way.
double vertex_of(const Maximum& left, const Maximum& top, const Maximum& right) {
  const double a = top.frequency_hz - left.frequency_hz, b = right.frequency_hz - top.frequency_hz;
  const double p = (top.value - left.value) * b, q = (top.value - right.value) * a;
  return top.frequency_hz + 0.5 * (p * b - q * a) / (p + q);
}

}  // namespace

Maximum refined_maximum(Maximum left, Maximum top, Maximum right, const SizesAt& sizes_at) {
  constexpr int kRounds = 25;
  constexpr double kFlat = 1e-12, kNarrow = 1e-9, kNear = 0.04;
  for (int round = 0; round < kRounds; ++round) {
    const double width = right.frequency_hz - left.frequency_hz;
    // Lines that are at a bound on both sides of a maximum are level too: not before the first round.
    const bool flat = round > 0 && top.value - std::min(left.value, right.value) < kFlat * top.value;
    if (flat || width < kNarrow * right.frequency_hz) break;
    const double below = top.frequency_hz - left.frequency_hz, above = right.frequency_hz - top.frequency_hz;
    const double middle = above > below ? top.frequency_hz + 0.5 * above : top.frequency_hz - 0.5 * below;
    double vertex = vertex_of(left, top, right);
    if (!(vertex > left.frequency_hz && vertex < right.frequency_hz)) vertex = middle;
    // The parabola's vertex between two near points, and half of the wider side in case that it misleads.
    const double near = std::clamp(std::abs(vertex - top.frequency_hz), 1e-3 * width, kNear * width);
    std::array<double, 4> at = {vertex - near, vertex, vertex + near, middle};
    for (double& f : at) f = std::clamp(f, left.frequency_hz, right.frequency_hz);
    std::array<double, 4> sizes{};
    sizes_at(at, sizes);
    std::array<Maximum, 7> all = {left, top, right};
    for (std::size_t i = 0; i < at.size(); ++i) all[3 + i] = {at[i], sizes[i]};
    std::sort(all.begin(), all.end(),
              [](const Maximum& a, const Maximum& b) { return a.frequency_hz < b.frequency_hz; });
    const auto best = std::max_element(all.begin(), all.end(),
                                       [](const Maximum& a, const Maximum& b) { return a.value < b.value; });
    // Points that fell together do not count as neighbours.
    auto before = best, after = best;
    while (before != all.begin() && before->frequency_hz == best->frequency_hz) --before;
    while (after + 1 != all.end() && after->frequency_hz == best->frequency_hz) ++after;
    left = *before;
    right = *after;
    top = *best;
  }
  return top;
}

std::vector<Maximum> maxima_between(std::span<const double> lines_hz, std::span<const double> sizes,
                                    double least, const SizesAt& sizes_at) {
  std::vector<Maximum> found;
  const auto line = [&](std::size_t i) { return Maximum{lines_hz[i], sizes[i]}; };
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const std::size_t before = i == 0 ? 0 : i - 1, after = i + 1 == sizes.size() ? i : i + 1;
    if (!(sizes[i] >= sizes[before]) || !(sizes[i] >= sizes[after]) || !(sizes[i] > least)) continue;
    found.push_back(refined_maximum(line(before), line(i), line(after), sizes_at));
  }
  return found;
}

Maximum largest_between(std::span<const double> lines_hz, std::span<const double> sizes,
                        const SizesAt& sizes_at) {
  constexpr double kSeen = 0.97;
  const auto top = static_cast<std::size_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  Maximum best{lines_hz[top], sizes[top]};
  for (const auto& one : maxima_between(lines_hz, sizes, kSeen * sizes[top], sizes_at))
    if (one.value > best.value) best = one;
  return best;
}

}  // namespace resonid::design
