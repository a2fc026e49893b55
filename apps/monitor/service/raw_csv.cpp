// SPDX-License-Identifier: MIT
#include "monitor/service/raw_csv.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>
#include <vector>

namespace resonid::monitor {
namespace {

constexpr double kOverwritten_s = 1.0;

/// A text as one word of a shell.
std::string word(const std::string& text) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.,:/+-";
  if (text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace

std::string identify_options(const InstalledAxis& axis) {
  const auto& spec = axis.spec;
  const auto& common = spec.track.common;
  const identification::Options usual;
  std::string options;
  const auto add = [&](const std::string& option) { options += (options.empty() ? "" : " ") + option; };
  if (spec.input_scale != 1.0) add(fmt::format("--input-scale {}", spec.input_scale));
  if (spec.output_scale != 1.0) add(fmt::format("--output-scale {}", spec.output_scale));
  if (!spec.input_unit.empty()) add("--input-unit " + word(spec.input_unit));
  if (!spec.output_unit.empty()) add("--output-unit " + word(spec.output_unit));
  // Always, since identify tells them by the names of columns otherwise.
  add(fmt::format("--motion {} --output-quantity {}", name_of(spec.motion), name_of(spec.output_quantity)));
  if (common.excitation_type != usual.excitation_type)
    add(fmt::format("--excitation-type {}", name_of(common.excitation_type)));
  if (common.chirp)
    add(fmt::format("--chirp {}:{}:{}", common.chirp->from_hz, common.chirp->to_hz,
                    common.chirp->duration_s));
  if (!common.lines_hz.empty()) add(fmt::format("--lines {}", fmt::join(common.lines_hz, ",")));
  if (common.period_samples > 0) add(fmt::format("--period-samples {}", common.period_samples));
  if (!axis.controller.empty()) add("--controller " + word(axis.controller));
  if (common.delay_s > 0.0) add(fmt::format("--delay {}", common.delay_s));
  if (common.band_hz) add(fmt::format("--band {}:{}", common.band_hz->first, common.band_hz->second));
  if (common.friction != usual.friction) add(fmt::format("--friction {}", name_of(common.friction)));
  return options;
}

std::string downloaded_name(std::string_view alarm_id) { return fmt::format("alarm-{}.csv", alarm_id); }

std::string identify_command(const InstalledAxis& axis, const std::string& file) {
  return fmt::format("resonid identify {} --time t_s {} --report {}.html", file, identify_options(axis),
                     std::string_view(file).substr(0, file.rfind('.')));
}

std::uint64_t oldest_sample(const Ring& ring) {
  const auto oldest = ring.piece(ring.begin(), 1);
  return oldest.samples > 0 ? oldest.first_sample : ring.next_sample();
}

Stretch copied(const Ring& ring, const InstalledAxis& axis, Stretch asked) {
  if (const std::uint64_t oldest = oldest_sample(ring); asked.from < oldest)
    asked.from = oldest + static_cast<std::uint64_t>(kOverwritten_s * axis.spec.sample_rate_hz);
  asked.to = std::min(asked.to, ring.next_sample());
  return asked;
}

std::string raw_csv(const Ring& ring, const InstalledAxis& axis, Stretch asked, const std::string& name) {
  std::string text;
  const auto [from, to] = copied(ring, axis, asked);
  if (from >= to) return text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "# axis {}, samples {} to {}; {}\nt_s", axis.spec.name, from, to,
                 identify_command(axis, name));
  const bool excitation = axis.spec.has_excitation, position = axis.spec.has_position;
  text += excitation ? ",ru,u,y" : ",u,y";
  text += position ? ",position\n" : "\n";
  std::vector<double> values;
  std::uint64_t at = ring.position_of(from);
  while (at < ring.end()) {
    const auto piece = ring.copy(at, 4096, values);
    if (piece.samples == 0) {  // overwritten meanwhile: what follows is a gap
      at = std::max(at + 1, ring.begin());
      continue;
    }
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
