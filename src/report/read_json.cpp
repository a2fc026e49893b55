// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>

#include "report/json_place.hpp"
#include "report/result_lists.hpp"

namespace resonid::report {
namespace {

using identification::Result;

data::FrequencyResponse read_response(const JsonPlace& j) {
  data::FrequencyResponse g;
  g.frequency_hz = j.at("frequency_hz").numbers();
  const auto real = j.at("real").numbers();
  const auto imag = j.at("imag").numbers();
  const std::size_t n = g.lines();
  const auto same = [&](const char* key, std::size_t size) {
    if (size != n) j.maybe(key).refuse("as many numbers as frequency_hz has, " + std::to_string(n));
  };
  same("real", real.size());
  same("imag", imag.size());
  for (std::size_t i = 1; i < n; ++i)
    if (!(g.frequency_hz[i] > g.frequency_hz[i - 1]) || !(g.frequency_hz[0] >= 0.0))
      j.at("frequency_hz").refuse("ascending frequencies >= 0");
  for (std::size_t i = 0; i < std::min({n, real.size(), imag.size()}); ++i)
    g.value.emplace_back(real[i], imag[i]);
  const auto fill = [&](const char* key, std::vector<double>& target) {
    const auto place = j.maybe(key);
    if (!place.present()) return;
    for (const auto& element : place.elements()) target.push_back(element.not_negative());
    same(key, target.size());
  };
  fill("std", g.std);
  fill("coherence", g.coherence);
  if (const auto unsettled = j.maybe("unsettled_hz"); unsettled.present())
    g.unsettled_hz = unsettled.numbers();
  return g;
}

identification::RecordFacts read_record(const JsonPlace& j) {
  identification::RecordFacts r;
  r.file = j.at("file").text();
  r.samples = j.at("samples").count();
  r.sample_rate_hz = j.at("sample_rate_hz").positive();
  if (const auto quantity = j.maybe("output_quantity"); quantity.present())
    r.output_quantity =
        static_cast<data::OutputQuantity>(quantity.choice({"velocity", "position", "acceleration"}));
  const auto signals = j.at("signals");
  r.input = signals.at("input").text();
  r.output = signals.at("output").text();
  r.time = signals.maybe_text("time");
  r.excitation = signals.maybe_text("excitation");
  r.reference = signals.maybe_text("reference");
  return r;
}

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

std::vector<data::Mode> read_modes(const JsonPlace& j) {
  std::vector<data::Mode> list;
  for (const auto& e : j.elements()) {
    data::Mode r;
    r.anti = e.at("kind").choice({"resonance", "antiresonance"}) == 1;
    r.frequency_hz = {e.at("frequency_hz").positive(), kUnknown};
    if (const auto std = e.maybe("std_hz"); std.present()) r.frequency_hz.std = std.not_negative();
    r.damping_ratio = {e.maybe_number("damping_ratio").value_or(kUnknown),
                       e.maybe_number("damping_ratio_std").value_or(kUnknown)};
    r.from_model = e.at("source").choice({"response", "model"}) == 1;
    list.push_back(r);
  }
  return list;
}

data::Estimate read_estimate(const JsonPlace& j) {
  const auto std = j.maybe("std");
  return {j.at("value").number(), std.present() ? std.not_negative() : 0.0};
}

double& value_of(fit::DriveModel& drive, int parameter) {
  auto& p = drive.parameters;
  double* const all[] = {&p.driven_inertia, &p.load_inertia,     &p.stiffness,
                         &p.damping,        &p.viscous_friction, &drive.delay_s,
                         &p.middle_inertia, &p.stiffness_2,      &p.damping_2};
  return *all[parameter];
}

void read_covariance(const JsonPlace& j, fit::DriveModel& drive) {
  std::vector<int> order;
  for (const auto& name : j.at("parameters").elements())
    order.push_back(static_cast<int>(
        name.choice(std::vector<std::string>(fit::kParameterNames.begin(), fit::kParameterNames.end()))));
  const auto rows = j.at("matrix").elements();
  if (rows.size() != order.size()) j.maybe("matrix").refuse("a row for each of the parameters");
  for (std::size_t i = 0; i < std::min(rows.size(), order.size()); ++i) {
    const auto row = rows[i].numbers();
    if (row.size() != order.size()) rows[i].refuse("a number for each of the parameters");
    for (std::size_t k = 0; k < std::min(row.size(), order.size()); ++k)
      drive.covariance(order[i], order[k]) = row[k];
  }
}

identification::ModelResult read_model(const JsonPlace& j, identification::Units& units) {
  identification::ModelResult model;
  auto& drive = model.drive;
  drive.structure =
      static_cast<fit::Structure>(j.at("structure").choice({"rigid", "two-mass", "three-mass", "black-box"}));
  const bool flexible = drive.structure != fit::Structure::rigid;
  if (const auto to = j.maybe("fitted_to"); to.present())
    model.from_record = to.choice({"response", "record"}) == 1;
  model.model_error = j.maybe_number("model_error").value_or(0.0);
  const auto parameters = j.at("parameters");
  for (int i = 0; i < fit::kParameterCount; ++i) {
    const std::string name(fit::kParameterNames[static_cast<std::size_t>(i)]);
    const bool needed = fit::has_parameter(drive.structure, i);
    const bool always = i == fit::kViscousFriction || i == fit::kDelay;
    const auto place = needed ? parameters.at(name) : parameters.maybe(name);
    if (!place.present() || !(needed || always)) continue;
    const auto e = read_estimate(place);
    if (needed && !(e.value > 0.0)) place.maybe("value").refuse("a number > 0");
    value_of(drive, i) = e.value;
    drive.covariance(i, i) = e.std * e.std;
    const bool only_if_estimated = flexible ? i == fit::kViscousFriction : i == fit::kDelay;
    drive.estimated[static_cast<std::size_t>(i)] = only_if_estimated || e.std > 0.0;
  }
  units.inertia = parameters.maybe("driven_inertia").maybe_text("unit");
  units.stiffness = parameters.maybe("stiffness").maybe_text("unit");
  units.damping = parameters.maybe(flexible ? "damping" : "viscous_friction").maybe_text("unit");
  if (const auto c = parameters.maybe("coulomb_friction"); c.present())
    model.coulomb_friction = read_estimate(c);
  if (const auto o = parameters.maybe("offset"); o.present()) model.offset = read_estimate(o);
  if (const auto covariance = j.maybe("covariance"); covariance.present()) read_covariance(covariance, drive);
  drive.sample_time_s = j.at("transfer_function").at("sample_time_s").positive();
  return model;
}

identification::LoopResult read_loop(const JsonPlace& j) {
  identification::LoopResult loop;
  auto& m = loop.margins;
  loop.source = j.maybe_text("source");
  m.modulus_margin = j.at("modulus_margin").number();
  m.modulus_margin_hz = j.maybe_number("modulus_margin_hz").value_or(0.0);
  m.worst_phase_margin_deg = j.maybe_number("worst_phase_margin_deg");
  m.gain_margin_db = j.maybe_number("gain_margin_db");
  m.gain_margin_hz = j.maybe_number("gain_margin_hz");
  if (const auto all = j.maybe("crossovers"); all.present()) {
    for (const auto& c : all.elements())
      m.crossovers.push_back({c.at("frequency_hz").positive(), c.at("phase_margin_deg").number()});
  } else if (const auto crossover = j.maybe("crossover_hz"); crossover.present()) {
    m.crossovers.push_back({crossover.positive(), j.at("phase_margin_deg").number()});
  }
  loop.crossover_std_hz = j.maybe_number("crossover_std_hz");
  loop.phase_margin_std_deg = j.maybe_number("phase_margin_std_deg");
  loop.modulus_margin_std = j.maybe_number("modulus_margin_std");
  loop.gain_margin_std_db = j.maybe_number("gain_margin_std_db");
  return loop;
}

identification::Validation read_validation(const JsonPlace& j) {
  identification::Validation v;
  v.fit_percent = j.at("fit_percent").number();
  if (const auto of = j.maybe("of"); of.present()) v.of_record = of.choice({"lines", "record"}) == 1;
  v.cross_correlation_max = j.maybe_number("cross_correlation_max");
  v.limit = j.maybe_number("limit");
  v.residual_rms = j.maybe_number("residual_rms");
  return v;
}

std::vector<diagnostics::Finding> read_findings(const JsonPlace& j) {
  std::vector<diagnostics::Finding> list;
  for (const auto& e : j.elements()) {
    diagnostics::Finding f;
    f.id = e.at("id").text();
    if (const auto severity = e.maybe("severity"); severity.present())
      f.severity = static_cast<diagnostics::Severity>(severity.choice({"info", "warning", "error"}));
    f.value = e.maybe_number("value");
    f.threshold = e.maybe_number("threshold");
    f.meaning = e.at("meaning").text();
    list.push_back(std::move(f));
  }
  return list;
}

void read_units(const JsonPlace& j, identification::Units& units) {
  if (!j.present()) return;
  units.input = units.torque = j.at("input").text();
  units.velocity = j.at("velocity").text();
  units.response = j.at("response").text();
  units.physical =
      (units.input == "Nm" && units.velocity == "rad/s") || (units.input == "N" && units.velocity == "m/s");
}

}  // namespace

expected<Result, JsonError> result_from_json(const nlohmann::json& json) {
  JsonError error;
  const JsonPlace file(json, error.problems);
  const bool several =
      file.at("schema").choice({"resonid.identification/1", "resonid.identifications/1"}) == 1;
  const auto joint = several ? file.maybe("joint") : file;
  if (several && !joint.present())
    error.problems.push_back(
        {"$.joint", "nothing", "one estimate of all records, as 'identify --join' writes it"});
  const auto root = several ? joint.at("result") : file;
  if (!error.problems.empty()) return unexpected(std::move(error));
  Result result;
  result.record = read_record(root.at("record"));
  result.method = root.at("method").text();
  result.approach = root.at("approach").text();
  if (const auto c = root.maybe("confidence"); c.present()) result.confidence = c.positive();
  if (const auto d = root.maybe("known_delay_s"); d.present()) result.known_delay_s = d.not_negative();
  if (const auto r = root.maybe("radius_m"); r.present()) result.radius_m = r.positive();
  read_units(root.maybe("units"), result.units);
  result.response = read_response(root.at("frequency_response"));
  if (const auto d = root.maybe("distortion"); d.present())
    result.distortion = read_distortion(d, result.response.lines());
  result.modes = read_modes(root.at("resonances"));
  if (const auto model = root.maybe("model"); model.present()) {
    const auto structure = model.maybe("structure");
    if (structure.present() && structure.is("black-box")) {
      result.black_box = read_black_box(model);
      result.black_box->model.known_delay_s = result.known_delay_s;
    } else {
      result.model = read_model(model, result.units);
      result.model->drive.known_delay_s = result.known_delay_s;
    }
  }
  if (const auto loop = root.maybe("loop"); loop.present()) result.loop = read_loop(loop);
  if (const auto v = root.maybe("validation"); v.present()) result.validation = read_validation(v);
  if (const auto v = root.maybe("cross_validation"); v.present())
    result.independent = identification::IndependentValidation{v.at("file").text(),
                                                               v.at("approach").text(),
                                                               v.at("simulation_fit_percent").number(),
                                                               v.at("prediction_fit_percent").number(),
                                                               v.maybe_number("response_error"),
                                                               v.at("verdict").text()};
  read_lists(root, result);
  result.trusted = root.at("trusted").flag();
  result.findings = read_findings(root.at("findings"));
  if (!error.problems.empty()) return unexpected(std::move(error));
  return result;
}

}  // namespace resonid::report
