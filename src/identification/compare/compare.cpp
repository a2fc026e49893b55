// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/compare/replicas.hpp>
#include <identification/criteria.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/identification/compare.hpp>
#include <resonid/identification/detail/figures.hpp>

namespace resonid::identification {
namespace {

using diagnostics::Finding;
using diagnostics::Severity;

void note(Changes& c, const char* id, Severity severity, std::string meaning) {
  c.findings.push_back({id, severity, {}, {}, std::move(meaning)});
}

Difference difference(std::string name, std::string unit, const data::Estimate& first,
                      const data::Estimate& second) {
  Difference d{
      std::move(name), std::move(unit), first, second, second.value - first.value, {}, {}, {}, false, {}};
  const auto known = [](double sd) { return sd > 0.0 && std::isfinite(sd); };
  if (known(first.std) && known(second.std)) {
    d.std = std::hypot(first.std, second.std);
    d.probability = std::erfc(std::abs(d.change) / *d.std / std::sqrt(2.0));
  }
  if (first.value != 0.0) d.relative = d.change / std::abs(first.value);
  return d;
}

/// Resonances of a kind in pairs, lowest with lowest.
void compare_resonances(const Result& first, const Result& second, Changes& c) {
  for (const bool anti : {true, false}) {
    const auto of = [&](const Result& r) {
      std::vector<data::Mode> list;
      std::copy_if(r.modes.begin(), r.modes.end(), std::back_inserter(list),
                   [&](const data::Mode& x) { return x.anti == anti; });
      return list;
    };
    const auto a = of(first), b = of(second);
    const std::string name = anti ? "antiresonance" : "resonance";
    if (a.size() != b.size())
      note(c, "different-resonances", Severity::warning,
           fmt::format("The first result has {} {}{}, the second {}. Those that both have are compared, the "
                       "lowest with the lowest. Identify both with the same .model.",
                       a.size(), name, a.size() == 1 ? "" : "s", b.size()));
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
      const std::string number = std::max(a.size(), b.size()) > 1 ? fmt::format("_{}", i + 1) : "";
      c.resonances.push_back(difference(name + number, "Hz", a[i].frequency_hz, b[i].frequency_hz));
      if (a[i].from_model != b[i].from_model)
        note(c, "different-sources", Severity::warning,
             fmt::format("The {} is the model's undamped frequency in one result and an extremum of the "
                         "response in the other. These differ even for the same machine. Identify both with "
                         "a drive model.",
                         name));
    }
  }
  std::sort(c.resonances.begin(), c.resonances.end(),
            [](const Difference& a, const Difference& b) { return a.first.value < b.first.value; });
}

bool comparable_models(const Result& first, const Result& second, Changes& c) {
  if (!first.model || !second.model) {
    note(c, "no-model", Severity::info,
         fmt::format(
             "{} no drive model: parameters and the v-gap are not compared. Identify both with one (.model).",
             first.model || second.model ? "One result has" : "Both results have"));
    return false;
  }
  if (first.model->drive.structure != second.model->drive.structure) {
    note(
        c, "different-structures", Severity::warning,
        fmt::format("One result is {}, the other {}: their parameters mean different things and are not "
                    "compared. Identify both with the same .model.",
                    fit::name_of(first.model->drive.structure), fit::name_of(second.model->drive.structure)));
    return false;
  }
  return true;
}

void compare_parameters(const Result& first, const Result& second, Changes& c) {
  const auto &a = first.model->drive, &b = second.model->drive;
  const auto& u = first.units;
  for (int i = 0; i < fit::kParameterCount; ++i) {
    const auto p = static_cast<fit::Parameter>(i);
    if (!fit::has_parameter(a.structure, i) &&
        !(a.estimated[static_cast<std::size_t>(i)] && b.estimated[static_cast<std::size_t>(i)]))
      continue;
    c.parameters.push_back(difference(std::string(fit::kParameterNames[static_cast<std::size_t>(i)]),
                                      unit_of(p, u), a.estimate(p), b.estimate(p)));
  }
  const auto optional = [&](const char* name, const std::string& unit, const std::optional<data::Estimate>& x,
                            const std::optional<data::Estimate>& y) {
    if (x && y) c.parameters.push_back(difference(name, unit, *x, *y));
  };
  optional("coulomb_friction", u.torque, first.model->coulomb_friction, second.model->coulomb_friction);
  const auto &f = first.model->further_friction, &g = second.model->further_friction;
  optional("breakaway_friction", u.torque, f.breakaway, g.breakaway);
  optional("stribeck_velocity", u.velocity, f.stribeck_velocity, g.stribeck_velocity);
  optional("load_coulomb_friction", u.torque, f.load_coulomb, g.load_coulomb);
  optional("offset", u.torque, first.model->offset, second.model->offset);
}

void compare_margins(const Result& first, const Result& second, Changes& c) {
  if (!first.loop || !second.loop) return;
  const auto &a = *first.loop, &b = *second.loop;
  const auto put = [&](const char* name, const char* unit, std::optional<double> x,
                       std::optional<double> x_std, std::optional<double> y, std::optional<double> y_std) {
    if (x && y)
      c.margins.push_back(difference(name, unit, {*x, x_std.value_or(0.0)}, {*y, y_std.value_or(0.0)}));
  };
  put("crossover", "Hz", a.margins.crossover_hz(), a.crossover_std_hz, b.margins.crossover_hz(),
      b.crossover_std_hz);
  put("phase_margin", "deg", a.margins.phase_margin_deg(), a.phase_margin_std_deg,
      b.margins.phase_margin_deg(), b.phase_margin_std_deg);
  put("modulus_margin", "", a.margins.modulus_margin, a.modulus_margin_std, b.margins.modulus_margin,
      b.modulus_margin_std);
  put("gain_margin", "dB", a.margins.gain_margin_db, a.gain_margin_std_db, b.margins.gain_margin_db,
      b.gain_margin_std_db);
}

/// Whether both plants are far from 1 everywhere, where distances say little.
void inspect_scale(const data::FrequencyResponse& g, const diagnostics::Weight& weight, Changes& c) {
  std::vector<double> size;
  for (std::size_t i = 0; i < g.lines(); ++i)
    size.push_back(std::abs(g.value[i]) * (weight ? std::abs(weight(g.frequency_hz[i])) : 1.0));
  if (size.empty()) return;
  const double typical = median(std::move(size));
  if (typical > detail::kCriteria.far_from_one || typical < 1.0 / detail::kCriteria.far_from_one)
    c.findings.push_back(
        {"gap-scale", Severity::info, typical,
         typical > 1.0 ? detail::kCriteria.far_from_one : 1.0 / detail::kCriteria.far_from_one,
         fmt::format("The magnitude of the compared responses is typically {:.2g}, far from 1. The chordal "
                     "distance is insensitive there: scale the responses by the controller.",
                     typical)});
}

void compare_responses(const Result& first, const Result& second, const CompareOptions& options, Changes& c) {
  diagnostics::Weight weight;
  if (options.weight) weight = [&](double f) { return options.weight->response(f); };
  c.gap = diagnostics::gap_curve(first.response, second.response, weight);
  if (c.gap.frequency_hz.empty()) {
    note(c, "no-common-band", Severity::warning,
         "The bands of the two responses do not overlap: their distance cannot be computed. Excite both in "
         "one band.");
    return;
  }
  if (!c.gap.noise.empty()) c.gap_probability = c.gap.chance();
  inspect_scale(first.response.band(c.gap.frequency_hz.front(), c.gap.frequency_hz.back()), weight, c);
}

void compare_models(const Result& first, const Result& second, const CompareOptions& options, Changes& c) {
  const auto &a = first.model->drive, &b = second.model->drive;
  const auto gap = [&](const fit::DriveModel& x, fit::DriveModel y) {
    y.sample_time_s = x.sample_time_s;
    auto g = x.transfer_function(), h = y.transfer_function();
    if (options.weight) {
      g = diagnostics::weighted(*options.weight, g);
      h = diagnostics::weighted(*options.weight, h);
    }
    return diagnostics::nu_gap(g, h);
  };
  const auto result = gap(a, b);
  if (!result) return;
  c.model_gap = *result;
  const auto distance = [](const auto& g) { return g ? g->largest_distance : 1.0; };
  c.model_gap_std =
      std::hypot(a.standard_deviation_of([&](const fit::DriveModel& m) { return distance(gap(m, b)); }),
                 b.standard_deviation_of([&](const fit::DriveModel& m) { return distance(gap(a, m)); }));
  c.model_gap_bootstrap = detail::bootstrapped(
      [&](const fit::DriveModel& x, const fit::DriveModel& y) -> std::optional<double> {
        const auto g = gap(x, y);
        if (!g) return std::nullopt;
        return g->gap;
      },
      first, second, options.confidence);
}

/// Holm 1979: the smallest probability against level/m, the next against level/(m-1) ... until one fails.
void judge(Changes& c) {
  std::vector<std::pair<double, bool*>> tests;
  for (auto* list : {&c.resonances, &c.parameters, &c.margins})
    for (auto& d : *list)
      if (d.probability) tests.emplace_back(*d.probability, &d.significant);
  if (c.gap_probability) tests.emplace_back(*c.gap_probability, &c.gap_significant);
  std::sort(tests.begin(), tests.end());
  for (std::size_t i = 0; i < tests.size(); ++i) {
    if (tests[i].first > (1.0 - c.confidence) / static_cast<double>(tests.size() - i)) break;
    *tests[i].second = true;
    c.changed = true;
  }
}

}  // namespace

std::vector<Difference> Changes::all() const {
  auto list = resonances;
  list.insert(list.end(), parameters.begin(), parameters.end());
  list.insert(list.end(), margins.begin(), margins.end());
  return list;
}

expected<Changes, Error> compare(const Result& first, const Result& second, const CompareOptions& options) {
  if (!(options.confidence > 0.0 && options.confidence < 1.0))
    return refuse("confidence", "must lie between 0 and 1", options.confidence);
  Changes c;
  c.first = first.record;
  c.second = second.record;
  c.units = first.units;
  c.confidence = options.confidence;
  c.weighted = options.weight.has_value();
  c.first_response = first.response;
  c.second_response = second.response;
  for (const auto* r : {&first, &second})
    if (!r->trusted)
      note(c, "untrusted-input", Severity::error,
           fmt::format("{} is itself not reliable; its own findings say why.", r->record.file));
  compare_resonances(first, second, c);
  compare_margins(first, second, c);
  if (first.units.response != second.units.response) {
    note(c, "different-units", Severity::error,
         fmt::format("The first result is in {}, the second in {}: responses and parameters cannot be "
                     "compared. Identify both in the same units (.input_scale, "
                     ".output_scale).",
                     first.units.response.empty() ? "unknown units" : first.units.response,
                     second.units.response.empty() ? "unknown units" : second.units.response));
  } else {
    compare_responses(first, second, options, c);
    if (comparable_models(first, second, c)) {
      compare_parameters(first, second, c);
      compare_models(first, second, options, c);
    }
  }
  for (auto* list : {&c.resonances, &c.parameters, &c.margins})
    for (auto& d : *list) d.interval = detail::interval_of(d, first, second, c.confidence);
  judge(c);
  c.trusted = std::none_of(c.findings.begin(), c.findings.end(),
                           [](const Finding& f) { return f.severity == Severity::error; });
  return c;
}

}  // namespace resonid::identification
