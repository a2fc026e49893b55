// SPDX-License-Identifier: MIT
#include <algorithm>

#include "report/json/results.hpp"

namespace resonid::report {
namespace {

using plant::Truth;

struct TruthUnits {
  std::string inertia, stiffness, damping, torque, velocity, time = "s";
};
TruthUnits units_of(data::Motion motion) {
  if (motion == data::Motion::rotary) return {"kgm2", "Nm/rad", "Nms/rad", "Nm", "rad/s"};
  return {"kg", "N/m", "Ns/m", "N", "m/s"};
}

/// {value, unit}, where it is there.
bool parameter(Fields& f, const Key& key, double& value, std::string& unit, bool there = true) {
  data::Estimate e{value, kUnknown};
  const bool found = quantity(f, key, e, unit, there);
  if (f.reading() && found) value = e.value;
  return found;
}

void describe_coupling(Fields& f, plant::Coupling& c, TruthUnits& units) {
  std::vector<int> between = {static_cast<int>(c.from), static_cast<int>(c.to)};
  f({"between", "places in inertias, from 0"}, between);
  if (f.reading()) {
    f.require(between.size() == 2 && between[0] >= 0 && between[1] >= 0, "between", "two whole numbers >= 0");
    between.resize(2);
    c.from = static_cast<std::size_t>(between[0]);
    c.to = static_cast<std::size_t>(between[1]);
  }
  parameter(f, {"stiffness", "stiffness of this coupling"}, c.stiffness, units.stiffness);
  parameter(f, {"damping", "damping of this coupling"}, c.damping, units.damping);
}

void describe_chain(Fields& f, plant::MassSystem& system, TruthUnits& units) {
  std::vector<data::Estimate> inertias;
  for (const double inertia : system.inertia) inertias.push_back({inertia, kUnknown});
  f.list({"inertias", "inertias of a chain, from the driven side to the load"}, true, inertias,
         [&](data::Estimate& e) {
           f({"value", "inertia", "unit", positive}, e.value);
           f({"unit", "unit of value"}, units.inertia);
         });
  f.list({"couplings", "couplings of a chain"}, true, system.couplings,
         [&](plant::Coupling& c) { describe_coupling(f, c, units); });
  if (!f.reading()) return;
  system.inertia.clear();
  for (const auto& e : inertias) system.inertia.push_back(e.value);
}

/// Room for what a structure has; nothing is known of it yet.
void lay_out(Truth& truth) {
  auto& system = truth.system;
  const std::size_t masses = truth.structure == plant::Structure::rigid        ? 1
                             : truth.structure == plant::Structure::three_mass ? 3
                                                                               : 2;
  if (system.inertia.empty()) system.inertia.assign(masses, 0.0);
  system.viscous.assign(system.inertia.size(), 0.0);
  if (!system.couplings.empty()) return;
  if (masses == 2) system.couplings = {{0, 1, 0.0, 0.0}};
  if (masses == 3) system.couplings = {{0, 1, 0.0, 0.0}, {1, 2, 0.0, 0.0}, {0, 2, 0.0, 0.0}};
}

void describe_ground(Fields& f, plant::MassSystem& system, TruthUnits& units) {
  system.ground.resize(system.inertia.size(), 0.0);  // a system may tell none
  auto& motor = system.ground.front();
  auto& load = system.ground.back();
  parameter(f, {"motor_ground_stiffness", "spring from the driven side to the ground"}, motor,
            units.stiffness, motor > 0.0);
  if (system.ground.size() > 1 || f.sketching())
    parameter(f, {"load_ground_stiffness", "spring from the load to the ground"}, load, units.stiffness,
              load > 0.0);
}

void describe_parameters(Fields& f, Truth& truth) {
  auto& system = truth.system;
  auto units = units_of(truth.motion);
  const bool chain = truth.structure == plant::Structure::chain;
  if (chain || f.sketching()) describe_chain(f, system, units);
  if (!f.writing()) lay_out(truth);
  const std::size_t masses = system.inertia.size();
  const bool flexible = masses > 1, three = truth.structure == plant::Structure::three_mass;
  parameter(f, {"driven_inertia", "inertia of the driven side"}, system.inertia.front(), units.inertia);
  if (f.reading()) {
    truth.motion = units.inertia == "kg" ? data::Motion::linear : data::Motion::rotary;
    units = units_of(truth.motion);
  }
  parameter(f, {"load_inertia", "inertia of the load"}, system.inertia.back(), units.inertia, flexible);
  if (!chain && flexible) {
    parameter(f, {"stiffness", "stiffness of the coupling"}, system.couplings[0].stiffness, units.stiffness);
    parameter(f, {"damping", "damping of the coupling"}, system.couplings[0].damping, units.damping);
  }
  if (three || f.sketching()) {
    auto& s = system;
    if (f.sketching()) s.couplings.resize(3);
    auto& second = s.couplings[1];
    auto& bypass = s.couplings[2];
    parameter(f, {"middle_inertia", "between the two sides"}, s.inertia[1], units.inertia);
    parameter(f, {"stiffness_2", "between middle inertia and load"}, second.stiffness, units.stiffness);
    parameter(f, {"damping_2", "between middle inertia and load"}, second.damping, units.damping);
    const bool bypassed = bypass.stiffness > 0.0;
    parameter(f, {"bypass_stiffness", "past the middle inertia"}, bypass.stiffness, units.stiffness,
              bypassed);
    parameter(f, {"bypass_damping", "past the middle inertia"}, bypass.damping, units.damping, bypassed);
  }
  auto& driven = system.viscous.front();
  auto& load = system.viscous.back();
  parameter(f, {"viscous_friction", "viscous friction of the driven side"}, driven, units.damping,
            !flexible || driven > 0.0);
  if (flexible)
    parameter(f, {"load_viscous_friction", "viscous friction of the load"}, load, units.damping, load > 0.0);
  describe_ground(f, system, units);
  std::string twist = truth.motion == data::Motion::rotary ? "rad" : "m";
  parameter(f, {"backlash", "whole width of the play in the coupling"}, truth.coupling.play, twist,
            truth.coupling.play > 0.0);
  parameter(f, {"stiffening_twist", "twist at which the coupling's torque is twice the linear one"},
            truth.coupling.stiffening_twist, twist, truth.coupling.stiffening_twist > 0.0);
  parameter(f, {"coulomb_friction", "Coulomb friction of the driven side"}, truth.friction.coulomb,
            units.torque, truth.friction.any());
  parameter(f, {"coulomb_friction_negative", "the same in the negative direction, where it differs"},
            truth.friction.coulomb_negative, units.torque, truth.friction.coulomb_negative > 0.0);
  const bool falls =
      truth.friction.stribeck_velocity > 0.0 && truth.friction.at_rest() > truth.friction.coulomb;
  parameter(f, {"breakaway_friction", "torque that it takes to start the driven side, where that is more"},
            truth.friction.breakaway, units.torque, falls);
  parameter(f, {"stribeck_velocity", "velocity over which that falls to coulomb_friction"},
            truth.friction.stribeck_velocity, units.velocity, falls);
  parameter(f, {"load_coulomb_friction", "Coulomb friction of the load"}, truth.load_friction.coulomb,
            units.torque, truth.load_friction.any());
  parameter(f, {"load_coulomb_friction_negative", "the same in the negative direction, where it differs"},
            truth.load_friction.coulomb_negative, units.torque, truth.load_friction.coulomb_negative > 0.0);
  parameter(f, {"torque_lag", "time constant of the torque loop"}, truth.torque_lag_s, units.time,
            truth.torque_lag_s > 0.0);
  parameter(f, {"output_filter", "time constant of the filter of the measured velocity"},
            truth.output_filter_s, units.time, truth.output_filter_s > 0.0);
}

/// Whether the polynomials give the response: of high order at a fast rate their digits cancel.
bool is_accurate(const Truth& truth) {
  constexpr double kMost = 1e-6;
  if (truth.plant.denominator.empty()) return false;
  const auto& response = truth.response;
  for (std::size_t i = 0; i < response.value.size(); ++i) {
    const auto value = response.value[i];
    if (!(std::abs(truth.plant.response(response.frequency_hz[i]) - value) <= kMost * std::abs(value)))
      return false;
  }
  return true;
}

void describe_model(Fields& f, Truth& truth) {
  // A tooth belt is a two-mass drive at every place.
  auto structure =
      truth.structure == plant::Structure::tooth_belt ? plant::Structure::two_mass : truth.structure;
  f.object({"model", "the machine, of one that changes as it is at the start"}, [&] {
    f.choice({"structure", "structure of the machine"}, structure);
    if (f.reading()) truth.structure = structure;
    f.object({"parameters", "at the driven shaft"}, [&] { describe_parameters(f, truth); });
    f.only_if(!f.writing() || is_accurate(truth),
              {"transfer_function", "zero-order-hold equivalent, no delay; absent where its digits cancel"},
              truth.plant);
  });
}

/// A mode with its kind, as the file lists them.
struct KindOfMode {
  data::UndampedMode mode;
  bool anti = false;
};

void describe_modes(Fields& f, Truth& truth) {
  constexpr static std::array<std::string_view, 2> kModeKinds = {"resonance", "antiresonance"};
  std::vector<KindOfMode> all;
  for (const auto& mode : truth.antiresonances) all.push_back({mode, true});
  for (const auto& mode : truth.resonances) all.push_back({mode, false});
  std::sort(all.begin(), all.end(), [](const KindOfMode& a, const KindOfMode& b) {
    return a.mode.frequency_hz < b.mode.frequency_hz;
  });
  f.list(
      {"resonances", "ascending, of a machine that changes at the start"}, true, all,
      [&](KindOfMode& k) {
        std::string source = "model";
        f.choice({"kind", "resonance or anti-resonance"}, kModeKinds, k.anti);
        f({"frequency_hz", "undamped", "Hz", positive}, k.mode.frequency_hz);
        f({"damping_ratio", "share of critical damping"}, k.mode.damping_ratio);
        f({"source", "\"model\""}, source);
      },
      Presence::required);
  if (!f.reading()) return;
  for (const auto& k : all) (k.anti ? truth.antiresonances : truth.resonances).push_back(k.mode);
}

void describe_margins(Fields& f, diagnostics::LoopMargins& m) {
  auto crossover = m.crossover_hz(), phase = m.phase_margin_deg();
  f({"modulus_margin", "smallest distance of L to -1"}, m.modulus_margin);
  f({"crossover_hz", "first downward crossing of |L| = 1", "Hz"}, crossover);
  f({"phase_margin_deg", "at the crossover", "deg"}, phase);
  f({"gain_margin_db", "smallest factor > 1 at arg L = -180 deg", "dB"}, m.gain_margin_db);
  if (f.reading() && crossover) m.crossovers = {{*crossover, phase.value_or(0.0)}};
}

}  // namespace

void describe(Fields& f, SimulatedTruth& t) {
  auto& truth = t.truth;
  f.schema({"resonid.truth/1"});
  auto seed = static_cast<std::size_t>(truth.seed);
  f({"seed", "seed of the measurement noise"}, seed);
  if (f.reading()) truth.seed = seed;
  f({"delay_s", "delay of the measured velocity, not part of the response", "s", not_negative},
    truth.delay_s);
  f.only_if(truth.hold_samples > 1, {"hold_samples", "samples over which the measured velocity is held"},
            truth.hold_samples);
  f({"frequency_response", "from u to what is measured, without the delay"}, truth.response);
  describe_modes(f, truth);
  describe_model(f, truth);
  auto& over_time = truth.over_time;
  f.object({"over_time", "how a machine that changes did so"}, over_time.has_value(), [&] {
    if (!over_time) over_time.emplace();
    f({"time_s", "instants", "s"}, over_time->time_s);
    f({"resonance_hz", "first one per instant, undamped", "Hz"}, over_time->resonance_hz);
    f.unless_empty({"position_m", "position of a tooth belt's cart per instant", "m"}, over_time->position_m);
  });
  f({"controller", "from measured velocity to -u"}, truth.controller);
  f.object({"loop", "margins of the real loop, every delay included"}, truth.controller.has_value(),
           [&] { describe_margins(f, t.margins); });
}

}  // namespace resonid::report
