// SPDX-License-Identifier: MIT
#include "design/machine.hpp"

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::design {
namespace {

/// A mode and, to both sides, so many lines nearer and farther than its width.
void add_around(double centre_hz, double width_hz, int around, std::vector<double>& lines) {
  constexpr double kNear = 0.05, kFar = 20.0;  // times the width
  lines.push_back(centre_hz);
  for (int i = 0; i < around; ++i) {
    const double distance = width_hz * kNear * std::pow(kFar / kNear, i / (around - 1.0));
    lines.push_back(centre_hz - distance);
    lines.push_back(centre_hz + distance);
  }
}

void keep_inside(double lowest_hz, double highest_hz, std::vector<double>& lines) {
  std::erase_if(lines, [&](double f) { return !(f >= lowest_hz && f <= highest_hz); });
  std::sort(lines.begin(), lines.end());
  lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
}

}  // namespace

std::vector<double> first_lines_hz(const fit::DriveModel& model, double share, double known_to_hz) {
  const int logarithmic = static_cast<int>(400 * share), even = static_cast<int>(60 * share);
  const int around = static_cast<int>(18 * share);
  const double nyquist_hz = 0.5 / model.sample_time_s;
  double lowest_hz = 1e-4 * nyquist_hz;
  const auto modes = model.modes();
  if (!modes.empty()) lowest_hz = std::min(lowest_hz, 0.01 * modes.front().frequency_hz.value);
  std::vector<double> lines;
  for (int i = 0; i < logarithmic; ++i)
    lines.push_back(nyquist_hz * std::pow(lowest_hz / nyquist_hz, 1.0 - i / (logarithmic - 1.0)));
  for (int i = 0; i < even; ++i) lines.push_back(nyquist_hz * (0.3 + 0.7 * i / (even - 1.0)));
  for (const auto& mode : modes) {
    const double centre = mode.frequency_hz.value;
    add_around(centre, std::max(mode.damping_ratio.value, 1e-4) * centre, around, lines);
  }
  for (const double corner : {known_to_hz, 2.0 * known_to_hz}) lines.push_back(corner);
  keep_inside(lowest_hz, nyquist_hz, lines);
  return lines;
}

std::vector<double> first_lines_hz(const fit::DriveModel& model, const LinearController& controller,
                                   double share, double known_to_hz) {
  constexpr double kNarrow = 0.2;  // damping ratio; what is wider, logarithmic lines do not miss
  auto lines = first_lines_hz(model, share, known_to_hz);
  if (controller.states().a.rows() < 2) return lines;
  const double lowest_hz = lines.front(), nyquist_hz = 0.5 / model.sample_time_s;
  // On the flanks of a high peak L may pass -1 within a part of the width.
  const int around = std::max(40, static_cast<int>(72 * share));
  const std::size_t before = lines.size();
  for (const auto& pole : linalg::eigenvalues(controller.states().a)) {
    if (!(pole.imag() > 0.0)) continue;
    const auto s = std::log(pole) / model.sample_time_s;
    if (!(std::abs(s.real()) < kNarrow * std::abs(s))) continue;
    add_around(s.imag() / kTwoPi, std::max(std::abs(s.real()), 1e-4 * std::abs(s)) / kTwoPi, around, lines);
  }
  if (lines.size() > before) keep_inside(lowest_hz, nyquist_hz, lines);
  return lines;
}

MachineLines::MachineLines(const Machine& machine, double share) {
  add(machine, first_lines_hz(machine.model(), share, machine.known_to_hz()));
}

std::vector<double> MachineLines::frequencies_hz() const {
  std::vector<double> all;
  for (const Line& line : lines_) all.push_back(line.frequency_hz);
  return all;
}

void MachineLines::add(const Machine& machine, std::span<const double> frequencies_hz) {
  const auto plant = machine.response().at(frequencies_hz);
  const double step = machine.sample_time_s();
  for (std::size_t i = 0; i < frequencies_hz.size(); ++i) {
    const auto inverse_z = std::polar(1.0, -kTwoPi * frequencies_hz[i] * step);
    lines_.push_back({frequencies_hz[i], plant[i], inverse_z, step / (1.0 - inverse_z),
                      weight_beyond(frequencies_hz[i], machine.known_to_hz())});
  }
  std::sort(lines_.begin(), lines_.end(),
            [](const Line& a, const Line& b) { return a.frequency_hz < b.frequency_hz; });
  lines_.erase(std::unique(lines_.begin(), lines_.end(),
                           [](const Line& a, const Line& b) { return a.frequency_hz == b.frequency_hz; }),
               lines_.end());
}

}  // namespace resonid::design
