// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/identification/detail/figures.hpp>

namespace resonid::identification {
namespace {

class List {
 public:
  void put(std::string name, std::string unit, double value, std::optional<double> std) {
    if (!std::isfinite(value)) return;
    if (std && !(std::isfinite(*std) && *std > 0.0)) std.reset();
    figures_.push_back({std::move(name), std::move(unit), value, std});
  }
  void put(std::string name, std::string unit, const std::optional<double>& value,
           std::optional<double> std) {
    if (value) put(std::move(name), std::move(unit), *value, std);
  }
  [[nodiscard]] std::vector<Figure> take() { return std::move(figures_); }

 private:
  std::vector<Figure> figures_;
};

void put_resonances(const Result& result, List& list) {
  int seen[2] = {0, 0};
  for (const auto& r : result.modes) {
    const int number = ++seen[r.anti ? 1 : 0];
    const std::string name = fmt::format("{}resonance{}", r.anti ? "anti" : "",
                                         number > 1 ? fmt::format("_{}", number) : std::string());
    list.put(name + "_hz", "Hz", r.frequency_hz.value, r.frequency_hz.std);
    if (std::isfinite(r.damping_ratio.value))
      list.put(name + "_damping_ratio", "", r.damping_ratio.value, r.damping_ratio.std);
  }
}

void put_parameters(const Result& result, List& list) {
  const auto& drive = result.model->drive;
  for (int i = 0; i < fit::kParameterCount; ++i) {
    if (!drive.estimated[static_cast<std::size_t>(i)]) continue;
    const auto name = fit::kParameterNames[static_cast<std::size_t>(i)];
    const auto e = drive.estimate(static_cast<fit::Parameter>(i));
    list.put(std::string(name), unit_of(static_cast<fit::Parameter>(i), result.units), e.value, e.std);
  }
  const auto put = [&](const char* name, const std::optional<data::Estimate>& e) {
    if (e) list.put(name, result.units.torque, e->value, e->std);
  };
  put("coulomb_friction", result.model->coulomb_friction);
  const auto& further = result.model->further_friction;
  put("breakaway_friction", further.breakaway);
  put("load_coulomb_friction", further.load_coulomb);
  if (const auto& e = further.stribeck_velocity)
    list.put("stribeck_velocity", result.units.velocity, e->value, e->std);
  put("offset", result.model->offset);
}

void put_margins(const LoopResult& loop, List& list) {
  const auto& m = loop.margins;
  list.put("crossover_hz", "Hz", m.crossover_hz(), loop.crossover_std_hz);
  list.put("phase_margin_deg", "deg", m.phase_margin_deg(), loop.phase_margin_std_deg);
  list.put("modulus_margin", "", m.modulus_margin, loop.modulus_margin_std);
  list.put("gain_margin_db", "dB", m.gain_margin_db, loop.gain_margin_std_db);
}

}  // namespace

std::string unit_of(fit::Parameter parameter, const Units& units) {
  switch (parameter) {
    case fit::kDrivenInertia:
    case fit::kLoadInertia:
    case fit::kMiddleInertia:
      return units.inertia;
    case fit::kStiffness:
    case fit::kStiffness2:
    case fit::kMotorGroundStiffness:
    case fit::kLoadGroundStiffness:
      return units.stiffness;
    case fit::kDelay:
    case fit::kTorqueLag:
    case fit::kOutputFilter:
      return "s";
    default:
      return units.damping;
  }
}

std::vector<Figure> figures(const Result& result) {
  List list;
  put_resonances(result, list);
  if (result.model) put_parameters(result, list);
  if (result.black_box && result.black_box->further_delay) {
    const auto& delay = *result.black_box->further_delay;
    list.put("delay", "s", delay.value, delay.std);
  }
  if (result.loop) put_margins(*result.loop, list);
  return list.take();
}

const Figure* find(const std::vector<Figure>& figures, const std::string& name) {
  const auto found =
      std::find_if(figures.begin(), figures.end(), [&](const Figure& f) { return f.name == name; });
  return found == figures.end() ? nullptr : &*found;
}

}  // namespace resonid::identification
