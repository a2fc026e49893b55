// SPDX-License-Identifier: MIT
#include "identification/tune/figure_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "design/cascade.hpp"

namespace resonid::identification {
namespace {

constexpr std::array<std::string_view, 21> kFigureNames = {"sensitivity_peak",
                                                           "complementary_peak",
                                                           "load_peak",
                                                           "controller_sensitivity_peak",
                                                           "process_sensitivity_peak",
                                                           "disk_peak",
                                                           "beyond_band_peak",
                                                           "phase_margin_deg",
                                                           "gain_margin_db",
                                                           "delay_margin_s",
                                                           "crossover_hz",
                                                           "load_bandwidth_hz",
                                                           "load_step_iae",
                                                           "load_step_ie",
                                                           "load_step_peak",
                                                           "load_step_rebound",
                                                           "noise_gain",
                                                           "reference_overshoot",
                                                           "reference_settling_s",
                                                           "reference_peak_torque",
                                                           "reference_rms_torque"};

constexpr std::pair<std::string_view, std::string_view> kFigureWords[] = {
    {"sensitivity_peak", "|S|"},
    {"complementary_peak", "|T|"},
    {"load_peak", "|T_load|"},
    {"controller_sensitivity_peak", "|C S|"},
    {"process_sensitivity_peak", "|G S|"},
    {"disk_peak", "|S - T|"},
    {"beyond_band_peak", "|L| above the band"},
    {"load_step_iae", "IAE of the load step"},
    {"load_step_peak", "peak of the load step"},
    {"reference_overshoot", "overshoot of the load"},
    {"reference_settling_s", "settling of the load"}};

/// What the load does after a torque step on it: its velocity, of a cascade its position.
std::array<FigureValue, 4> load_step_values(const design::Machine& machine, const Law& law,
                                            const design::LoadStep& velocity, const StepResponses& steps) {
  if (!law.what.position_gain)
    return {FigureValue{velocity.iae}, {velocity.ie}, {velocity.peak}, {velocity.rebound}};
  const auto position = position_step_of(machine, {*law.what.gains, *law.what.position_gain});
  const auto& y = steps.load_by_torque;
  const double most = *std::max_element(y.begin(), y.end());
  std::optional<double> rebound;
  if (steps.whole) rebound = position.peak > 0.0 ? std::max(0.0, most) / position.peak : 0.0;
  return {FigureValue{position.iae}, {position.ie}, {position.peak}, {rebound}};
}

/// Overshoot, settling within 2 %, peak and rms torque (over the first second) of a step of the reference;
/// what its end would tell is absent where that is not there. Which part of the delay stands before the
/// machine is not known: settling counts all of it.
std::array<FigureValue, 4> reference_values(const StepResponses& steps, double sample_time_s, double delay_s,
                                            double step) {
  constexpr double kBand = 0.02;
  double overshoot = 0.0, settled = 0.0, peak = 0.0, squares = 0.0;
  const auto second = static_cast<std::size_t>(std::lround(1.0 / sample_time_s));
  for (std::size_t k = 0; k < steps.load_by_reference.size(); ++k) {
    const double y = steps.load_by_reference[k], u = steps.torque_by_reference[k];
    overshoot = std::max(overshoot, y - 1.0);
    if (std::abs(y - 1.0) > kBand) settled = static_cast<double>(k + 1) * sample_time_s + delay_s;
    peak = std::max(peak, std::abs(u));
    if (k < second) squares += u * u;
  }
  const double rms = std::sqrt(squares / static_cast<double>(second)) * step;
  if (steps.whole) return {FigureValue{100.0 * overshoot}, {settled}, {peak * step}, {rms}};
  std::array<FigureValue, 4> known;
  if (steps.load_by_reference.size() >= second) known.back().value = rms;
  return known;
}

}  // namespace

std::vector<FigureValue> figure_values(const design::LoopFigures& f, const design::Machine& machine,
                                       const Law& law, const StepResponses& steps, double reference_step) {
  std::vector<FigureValue> values;
  for (const auto& peak : f.peaks) {
    const bool is_known = peak.transfer != design::Transfer::beyond_band || peak.value > 0.0;
    values.push_back(is_known ? FigureValue{peak.value, peak.frequency_hz} : FigureValue{});
  }
  values.push_back({f.worst_phase_margin_deg});
  values.push_back({f.gain_margin_db});
  values.push_back({f.delay_margin_s});
  std::optional<double> crossover;
  for (const auto& crossing : f.crossings)
    if (crossing.falling && !crossover) crossover = crossing.frequency_hz;
  values.push_back({crossover});
  values.push_back({f.load_bandwidth_hz});
  if (!f.stable) {
    values.resize(kFigureNames.size());
    return values;
  }
  auto load = load_step_values(machine, law, f.load_step, steps);
  // Without an integrator the load goes on for as long as the torque stays.
  if (!integrates(law.what)) load[0] = load[1] = FigureValue{};
  values.insert(values.end(), load.begin(), load.end());
  values.push_back({f.noise_gain});
  const double delay_s = machine.model().known_delay_s + machine.model().delay_s;
  auto reference = reference_values(steps, machine.sample_time_s(), delay_s, reference_step);
  // Nor does it settle where friction keeps it from its reference.
  constexpr double kStays = 0.02;
  const auto& y = steps.load_by_reference;
  if (!integrates(law.what) && !y.empty() && std::abs(y.back() - 1.0) > kStays) reference[1] = FigureValue{};
  values.insert(values.end(), reference.begin(), reference.end());
  return values;
}

std::string place_unit(const std::string& velocity) {
  return velocity.ends_with("/s") ? velocity.substr(0, velocity.size() - 2) : velocity + " s";
}

std::string_view figure_name(std::size_t index) { return kFigureNames[index]; }

std::size_t figure_count() { return kFigureNames.size(); }

std::size_t figure_index(std::string_view name) {
  return static_cast<std::size_t>(std::find(kFigureNames.begin(), kFigureNames.end(), name) -
                                  kFigureNames.begin());
}

double severity_of(std::size_t index, double value) {
  const std::string_view name = figure_name(index);
  if (name == "phase_margin_deg") return -std::abs(value);
  const bool less =
      name.find("margin") != std::string_view::npos || name == "crossover_hz" || name == "load_bandwidth_hz";
  return less ? -value : value;
}

double value_of_severity(std::size_t index, double severity, double beside) {
  if (figure_name(index) == "phase_margin_deg") return std::copysign(severity, beside);
  return severity_of(index, severity);  // its own inverse
}

double absent_value(std::size_t index) {
  using Limits = std::numeric_limits<double>;
  return figure_name(index).find("margin") != std::string_view::npos ? Limits::infinity()
                                                                     : Limits::quiet_NaN();
}

std::string figure_words(std::string_view name) {
  for (const auto& [known, words] : kFigureWords)
    if (known == name) return std::string(words);
  std::string text(name);
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

std::string figure_unit(std::size_t index, const TunedController& controller, const Units& units) {
  const std::string_view name = kFigureNames[index];
  const bool cascade = controller.position_gain.has_value();
  if (name.ends_with("_deg")) return "deg";
  if (name.ends_with("_db")) return "dB";
  if (name.ends_with("_hz")) return "Hz";
  if (name.ends_with("_s")) return "s";
  if (name == "reference_overshoot") return "%";
  if (name.ends_with("_torque")) return units.torque;
  const std::string place = place_unit(units.velocity);
  if (name == "load_step_iae" || name == "load_step_ie") return cascade ? place + " s" : place;
  if (name == "load_step_peak") return cascade ? place : units.velocity;
  if (name == "controller_sensitivity_peak" || name == "noise_gain")
    return units.torque + "/(" + units.velocity + ")";
  if (name == "process_sensitivity_peak") return units.response;
  return "";
}

}  // namespace resonid::identification
