// SPDX-License-Identifier: MIT
#include "design/loop_survey.hpp"

#include <array>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <utility>

#include "design/maxima.hpp"

namespace resonid::design {

LoopSurvey::LoopSurvey(const LinearController& controller, std::vector<double> lines_hz, double sample_time_s,
                       double known_to_hz)
    : controller_(controller),
      lines_hz_(std::move(lines_hz)),
      sample_time_s_(sample_time_s),
      known_to_hz_(known_to_hz) {
  lines_ = lines_at(lines_hz_);
}

std::vector<LoopSurvey::Line> LoopSurvey::lines_at(std::span<const double> frequencies_hz) const {
  const auto c = controller_.at(frequencies_hz);
  std::vector<Line> lines(c.size());
  for (std::size_t i = 0; i < c.size(); ++i) {
    const double half = kPi * frequencies_hz[i] * sample_time_s_;
    const double sine = std::sin(half);
    lines[i] = {{-2.0 * sine * sine, 2.0 * sine * std::cos(half)},
                c[i],
                c[i],
                weight_beyond(frequencies_hz[i], known_to_hz_)};
  }
  if (const auto& reference = controller_.reference_response()) {
    const auto r = reference(frequencies_hz);
    for (std::size_t i = 0; i < r.size(); ++i) lines[i].reference = r[i];
  }
  return lines;
}

namespace {

LoopFunctions::Values around(const RationalResponse& plant, const std::complex<double>& step,
                             const std::complex<double>& controller, const std::complex<double>& reference,
                             double beyond) {
  const auto g = plant.at(step);
  return {plain_product(controller, g.measured), controller, g.load, reference, beyond};
}

}  // namespace

double LoopSurvey::size_at(const RationalResponse& plant, Transfer transfer, double frequency_hz) const {
  const Line line = lines_at(std::array{frequency_hz}).front();
  return around(plant, line.step, line.controller, line.reference, line.beyond).size_of(transfer);
}

std::vector<Peak> LoopSurvey::largest_of(const RationalResponse& plant,
                                         const std::vector<Transfer>& transfers) const {
  std::vector<LoopFunctions::Values> values;
  values.reserve(lines_.size());
  for (const Line& line : lines_)
    values.push_back(around(plant, line.step, line.controller, line.reference, line.beyond));
  std::vector<double> sizes(values.size());
  std::vector<Peak> found;
  for (const Transfer transfer : transfers) {
    for (std::size_t i = 0; i < values.size(); ++i) sizes[i] = values[i].size_of(transfer);
    const auto sizes_at = [&](std::span<const double> frequencies_hz, std::span<double> at) {
      const auto lines = lines_at(frequencies_hz);
      for (std::size_t i = 0; i < lines.size(); ++i)
        at[i] = around(plant, lines[i].step, lines[i].controller, lines[i].reference, lines[i].beyond)
                    .size_of(transfer);
    };
    const auto top = largest_between(lines_hz_, sizes, sizes_at);
    found.push_back({transfer, top.value, top.frequency_hz, 0.0});
  }
  return found;
}

}  // namespace resonid::design
