// SPDX-License-Identifier: MIT
#include "monitor/service/raw_csv.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <vector>

namespace resonid::monitor {
namespace {

/// The options of `identify` that an axis' samples need.
std::string options_of(const InstalledAxis& axis) {
  const auto& spec = axis.spec;
  std::string options;
  const auto add = [&](const std::string& option) { options += " " + option; };
  if (spec.input_scale != 1.0) add(fmt::format("--input-scale {}", spec.input_scale));
  if (spec.output_scale != 1.0) add(fmt::format("--output-scale {}", spec.output_scale));
  if (spec.motion == data::Motion::linear) add("--motion linear");
  if (spec.output_quantity != data::OutputQuantity::velocity)
    add(fmt::format("--output-quantity {}", name_of(spec.output_quantity)));
  if (!axis.controller.empty()) add("--controller " + axis.controller);
  if (spec.track.common.delay_s > 0.0) add(fmt::format("--delay {}", spec.track.common.delay_s));
  return options;
}

}  // namespace

std::string raw_csv(const Ring& ring, const InstalledAxis& axis, std::uint64_t from, std::uint64_t to) {
  std::string text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "# axis {}, samples {} to {}; resonid identify THIS.csv --time t_s{}\nt_s",
                 axis.spec.name, from, to, options_of(axis));
  const bool excitation = axis.spec.has_excitation, position = axis.spec.has_position;
  text += excitation ? ",ru,u,y" : ",u,y";
  text += position ? ",position\n" : "\n";
  std::vector<double> values;
  std::uint64_t at = ring.position_of(from);
  while (at < ring.end()) {
    const auto piece = ring.copy(at, 4096, values);
    if (piece.samples == 0) break;
    for (std::size_t k = 0; k < piece.samples; ++k) {
      const std::uint64_t sample = piece.first_sample + k;
      if (sample >= to) return text;
      fmt::format_to(out, "{:.9g}", static_cast<double>(sample - from) / axis.spec.sample_rate_hz);
      for (std::size_t c = 0; c < ring.channels(); ++c) {
        double x = piece.values[k * ring.channels() + c];
        if (excitation && c == 0) x *= axis.spec.excitation_scale;  // which identify has no option for
        if (std::isfinite(x))
          fmt::format_to(out, ",{}", x);
        else
          text += ',';
      }
      text += '\n';
    }
    at = piece.position + piece.samples;
  }
  return text;
}

}  // namespace resonid::monitor
