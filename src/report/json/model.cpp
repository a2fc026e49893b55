// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "report/json/results.hpp"

namespace resonid::report {
namespace {

using fit::Parameter;

constexpr std::array<std::string_view, 4> kStructures = {"rigid", "two-mass", "three-mass", "black-box"};
constexpr std::array<std::string_view, 2> kFittedTo = {"response", "record"};

struct ParameterText {
  Parameter parameter;
  std::string_view meaning;
};
constexpr std::array<ParameterText, fit::kParameterCount> kParameters = {
    {{fit::kDrivenInertia, "inertia of the driven side, of the whole machine where it is rigid"},
     {fit::kLoadInertia, "inertia of the load, referred to the driven shaft"},
     {fit::kStiffness, "stiffness of the coupling, referred to the driven shaft"},
     {fit::kDamping, "damping of the coupling"},
     {fit::kViscousFriction, "viscous friction of the driven side"},
     {fit::kDelay, "fitted delay, on top of the known one"},
     {fit::kLoadViscousFriction, "viscous friction of the load"},
     {fit::kTorqueLag, "time constant of the torque loop, of first order"},
     {fit::kOutputFilter, "time constant of the filter of the measured velocity, of first order"},
     {fit::kMotorGroundStiffness, "spring from the driven side to the ground; below 0: gravity that topples"},
     {fit::kLoadGroundStiffness, "spring from the load to the ground"},
     {fit::kMiddleInertia, "inertia between driven side and load"},
     {fit::kStiffness2, "stiffness between middle inertia and load"},
     {fit::kDamping2, "damping between middle inertia and load"}}};

/// To be read into: as identification::unit_of.
std::string& unit_of(identification::Units& units, Parameter parameter, std::string& seconds) {
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
      return seconds;
    default:
      return units.damping;
  }
}

/// A physical parameter: those of the structure are required, friction and delay are there where they are
/// estimated (viscous friction of a rigid drive and delay of a flexible one always).
void describe_parameter(Fields& f, const ParameterText& text, fit::DriveModel& drive,
                        identification::Units& units) {
  const Parameter p = text.parameter;
  const auto at = static_cast<std::size_t>(p);
  const bool flexible = drive.structure != fit::Structure::rigid;
  const bool needed = fit::has_parameter(drive.structure, p);
  if (!(needed || fit::may_have_parameter(drive.structure, p) || f.sketching())) return;
  const bool always = needed || p == (flexible ? fit::kDelay : fit::kViscousFriction);
  const bool only_if_estimated = !always;
  const bool given = p != fit::kViscousFriction && p != fit::kDelay && drive.value(p) != 0.0;
  const Key key{fit::kParameterNames[at], text.meaning, {}, needed ? positive : any};
  std::string seconds = "s";
  auto e = f.reading() ? data::Estimate{} : drive.estimate(p);
  const bool there = quantity(f, key, e, unit_of(units, p, seconds), always || drive.estimated[at] || given,
                              needed && !f.sketching() ? Presence::required : Presence::optional);
  if (!f.reading() || !there) return;
  drive.set(p, e.value);
  drive.covariance(p, p) = e.std * e.std;
  drive.estimated[at] = (only_if_estimated && p <= fit::kDelay) || !(e.std <= 0.0);
}

void describe_covariance(Fields& f, fit::DriveModel& drive) {
  std::vector<std::string> names;
  std::vector<int> order;
  const auto find = [&](std::string_view name) {
    const auto& all = fit::kParameterNames;
    return static_cast<int>(std::find(all.begin(), all.end(), name) - all.begin());
  };
  for (int i = 0; i < fit::kParameterCount; ++i)
    if (!f.reading() && drive.estimated[static_cast<std::size_t>(i)]) order.push_back(i);
  for (const int i : order) names.emplace_back(fit::kParameterNames[static_cast<std::size_t>(i)]);
  Eigen::MatrixXd matrix = drive.covariance(order, order);
  f.object({"covariance", "covariance of the estimated parameters; absent: no correlations are known"},
           !order.empty() && matrix.allFinite(), [&] {
             f({"parameters", "names in the order of rows and columns"}, names);
             if (f.reading()) {
               order.clear();
               for (const auto& name : names) order.push_back(find(name));
               const bool known =
                   order.size() <= fit::kParameterNames.size() &&
                   std::none_of(order.begin(), order.end(), [](int i) { return i == fit::kParameterCount; });
               f.require(known, "parameters",
                         fmt::format("names of parameters: {}", fmt::join(fit::kParameterNames, ", ")));
               if (!known) return;
               matrix.resize(static_cast<Eigen::Index>(order.size()),
                             static_cast<Eigen::Index>(order.size()));
             }
             f({"matrix", "row by row, of the parameters in their units"}, matrix);
             if (f.reading()) drive.covariance(order, order) = matrix;
           });
}

/// At the belt: Nm/rad over the radius squared.
void describe_belt(Fields& f, const fit::DriveModel& drive, double radius_m) {
  const auto put = [&](const Key& key, Parameter p, std::string unit) {
    auto e = drive.estimate(p);
    e.value /= radius_m * radius_m;
    e.std /= radius_m * radius_m;
    quantity(f, key, e, unit);
  };
  put({"belt_stiffness", "stiffness at the belt, with a radius"}, fit::kStiffness, "N/m");
  put({"belt_damping", "damping at the belt"}, fit::kDamping, "Ns/m");
  if (drive.structure != fit::Structure::three_mass && !f.sketching()) return;
  put({"belt_stiffness_2", "the same behind the middle inertia"}, fit::kStiffness2, "N/m");
  put({"belt_damping_2", "the same behind the middle inertia"}, fit::kDamping2, "Ns/m");
}

void describe_drive(Fields& f, identification::Result& result, identification::ModelResult& model) {
  auto& drive = model.drive;
  Chosen structure{f.sketching() ? std::span(kStructures).first(3) : std::span(kStructures),
                   static_cast<std::size_t>(drive.structure)};
  f({"structure", "what the drive is taken for"}, structure);
  if (f.reading()) drive.structure = static_cast<fit::Structure>(std::min<std::size_t>(structure.index, 2));
  f.choice({"fitted_to", "the recording (output error), or the measured response"}, kFittedTo,
           model.from_record, Presence::assumed);
  f.assumed({"model_error", "relative difference to the measured response that noise does not explain"},
            model.model_error);
  if (!f.writing() || f.sketching() || drive.velocity != fit::Velocity::sampled)
    f.choice({"velocity", "measured at the sample itself, or by differences: the mean over the past sample"},
             drive.velocity, Presence::assumed);
  f.object({"parameters", "physical parameters, referred to the driven shaft"}, [&] {
    for (const auto& text : kParameters) describe_parameter(f, text, drive, result.units);
    if (!f.reading() && (result.radius_m || f.sketching()) && drive.structure != fit::Structure::rigid)
      describe_belt(f, drive, result.radius_m.value_or(1.0));
    quantity(f, {"coulomb_friction", "dry friction of the driven side"}, model.coulomb_friction,
             result.units.torque);
    auto& more = model.further_friction;
    quantity(f, {"breakaway_friction", "torque that it takes to start the driven side"}, more.breakaway,
             result.units.torque);
    quantity(f,
             {"stribeck_velocity",
              "velocity v over which breakaway friction falls to coulomb_friction as exp(-(w/v)^2)"},
             more.stribeck_velocity, result.units.velocity);
    quantity(f, {"load_coulomb_friction", "dry friction of the load"}, more.load_coulomb,
             result.units.torque);
    quantity(f, {"offset", "constant torque"}, model.offset, result.units.torque);
  });
  auto g = f.writing() ? drive.transfer_function() : data::TransferFunction{};
  f.object(
      {"transfer_function", "transfer function of the sampled drive, without delay; the parameters rule"},
      [&] {
        f.assumed({"numerator", "b0, b1 ... in powers of z^-1"}, g.numerator);
        f.assumed({"denominator", "1, a1 ... in powers of z^-1"}, g.denominator);
        f({"sample_time_s", "sample time of the sampled drive", "s", positive}, g.sample_time_s);
      });
  if (f.reading()) drive.sample_time_s = g.sample_time_s;
  describe_covariance(f, drive);
}

/// "b0 ... bn, a1 ... am", as the covariance of a black-box model orders them.
std::vector<std::string> coefficient_names(const data::TransferFunction& g) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < g.numerator.size(); ++i) names.push_back(fmt::format("b{}", i));
  for (std::size_t i = 1; i < g.denominator.size(); ++i) names.push_back(fmt::format("a{}", i));
  return names;
}

void describe_black_box(Fields& f, identification::BlackBoxResult& box) {
  auto& g = box.model.transfer_function;
  Chosen structure{std::span(kStructures).last(1), 0};
  f({"structure", "a rational model without drive structure"}, structure);
  f.derived({"order", "order of the denominator"},
            g.denominator.empty() ? std::size_t{0} : g.denominator.size() - 1);
  f({"delay_samples", "delay of the model, the known one included"}, box.model.delay_samples);
  f({"fit_percent", "fit of the simulation", "%"}, box.fit_percent);
  std::string seconds = "s";
  quantity(f, {"delay", "an additional delay, on top of the known one"}, box.further_delay, seconds);
  f.object({"transfer_function", "without the delay"}, [&] {
    describe(f, g);
    if (!f.reading()) return;
    f.require(!g.numerator.empty(), "numerator", "at least one number");
    f.require(!g.denominator.empty() && g.denominator.front() == 1.0, "denominator",
              "numbers that begin with 1");
    if (g.denominator.empty()) g.denominator = {1.0};
  });
  constexpr std::size_t kMostCoefficients = 1000;
  f.require(g.numerator.size() + g.denominator.size() <= kMostCoefficients, "transfer_function",
            "at most 1000 coefficients");
  if (g.numerator.size() + g.denominator.size() > kMostCoefficients) return;
  auto names = coefficient_names(g);
  const auto size = static_cast<Eigen::Index>(names.size());
  auto& covariance = box.model.covariance;
  const bool known = f.object({"covariance", "covariance of the coefficients; absent: not known"},
                              covariance.rows() == size && covariance.allFinite(), [&] {
                                f.derived({"parameters", "names in the order of rows and columns"}, names);
                                if (f.reading()) covariance.resize(size, size);
                                f({"matrix", "row by row"}, covariance);
                              });
  if (f.reading() && !known) covariance = Eigen::MatrixXd::Constant(size, size, kUnknown);
}

}  // namespace

void describe_machine(Fields& f, fit::DriveModel& drive, identification::Units& units) {
  Chosen structure{std::span(kStructures).first(3), static_cast<std::size_t>(drive.structure)};
  f({"structure", "what the drive is taken for"}, structure);
  if (f.reading()) drive.structure = static_cast<fit::Structure>(structure.index);
  f.choice({"velocity", "measured at the sample itself, or by differences: the mean over the past sample"},
           drive.velocity);
  f.object({"parameters", "physical parameters, referred to the driven shaft"}, [&] {
    for (const auto& text : kParameters) describe_parameter(f, text, drive, units);
  });
  f.unless(0.0, {"known_delay_s", "known delay in the measured velocity", "s", not_negative},
           drive.known_delay_s);
  f({"sample_time_s", "sample time of the sampled drive", "s", positive}, drive.sample_time_s);
  describe_covariance(f, drive);
}

void describe_model(Fields& f, identification::Result& r) {
  f.object({"model", "the fitted model"}, r.model || r.black_box, [&] {
    const bool box = f.reading() ? f.says("structure", "black-box") : !r.model && r.black_box;
    f.one_of(2, box ? 1 : 0, [&](std::size_t kind) {
      if (kind == 0) {
        if (!r.model) r.model.emplace();
        describe_drive(f, r, *r.model);
        if (f.reading()) r.model->drive.known_delay_s = r.known_delay_s;
      } else {
        if (!r.black_box) r.black_box.emplace();
        describe_black_box(f, *r.black_box);
        if (f.reading()) r.black_box->model.known_delay_s = r.known_delay_s;
      }
    });
  });
}

}  // namespace resonid::report
