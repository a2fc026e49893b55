// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <golden.hpp>
#include <resonid/design/detail/bounds.hpp>
#include <resonid/fit/drive_model.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "design/controller.hpp"
#include "design/machine.hpp"
#include "design/schedule.hpp"

namespace resonid::test {

/// A golden plant: J1, J2, K, D; J and viscous friction of a rigid one; J1, J2, J3, K12, K23, D12, D23.
inline design::Machine golden_machine(const std::vector<double>& p, double sample_time_s, double delay_s) {
  fit::DriveModel m;
  m.sample_time_s = sample_time_s;
  m.known_delay_s = delay_s;
  auto& q = m.parameters;
  q.driven_inertia = p.at(0);
  if (p.size() == 2) {
    m.structure = fit::Structure::rigid;
    q.viscous_friction = p[1];
  } else if (p.size() == 4) {
    q.load_inertia = p[1];
    q.stiffness = p[2];
    q.damping = p[3];
  } else {
    m.structure = fit::Structure::three_mass;
    q.middle_inertia = p.at(1);
    q.load_inertia = p.at(2);
    q.stiffness = p.at(3);
    q.stiffness_2 = p.at(4);
    q.damping = p.at(5);
    q.damping_2 = p.at(6);
  }
  return design::Machine(m);
}

/// All machines of a golden case.
inline std::vector<design::Machine> golden_machines(const nlohmann::json& one) {
  const double step = one.at("sample_time_s"), delay = one.at("delay_s");
  std::vector<design::Machine> machines;
  if (one.at("parameters").front().is_array()) {
    for (const auto& p : one.at("parameters")) machines.push_back(golden_machine(p, step, delay));
  } else {
    machines.push_back(golden_machine(one.at("parameters"), step, delay));
  }
  return machines;
}

/// The source's tooth belt over its stroke: its three lengths in parallel and in series.
inline constexpr design::Stroke kBeltStroke{0.38, 1.65};
inline fit::DriveModel tooth_belt_at(double position_m) {
  constexpr double kPulley = 0.0028, kRadius = 0.0199, kLoad = 6.7 * kRadius * kRadius, kSpecific = 376406.25;
  const double stiffness =
      kRadius * kRadius * kSpecific * (1.0 / position_m + 1.0 / (1.7 - position_m + 2.14));
  const double damping = stiffness / (10.0 * std::sqrt(stiffness * (1.0 / kPulley + 1.0 / kLoad)));
  return golden_machine({kPulley, kLoad, stiffness, damping}, 0.0005, 0.001).model();
}

/// system2, R5 or bench, as the cases of the structures name them.
inline design::Machine golden_plant(const nlohmann::json& structures, const std::string& plant) {
  for (const auto& c : structures.at("cascade").at("cases"))
    if (c.at("plant") == plant)
      return golden_machine(c.at("parameters"), c.at("sample_time_s"), c.at("delay_s"));
  throw std::out_of_range(plant);
}

inline design::Bounds golden_bounds(const nlohmann::json& b) {
  const auto get = [&](const char* name) {
    return b.contains(name) ? std::optional(b.at(name).get<double>()) : std::nullopt;
  };
  return {get("sensitivity"), get("complementary"), get("load_transfer"), get("controller_sensitivity"),
          get("s_minus_t")};
}

inline std::vector<design::Biquad> golden_biquads(const nlohmann::json& one) {
  std::vector<design::Biquad> biquads;
  if (one.contains("biquads"))
    for (const auto& b : one.at("biquads"))
      biquads.push_back({b.at("frequency_hz"), b.at("zeta_numerator"), b.at("zeta_denominator")});
  return biquads;
}

/// check(case, machine) for every golden case of RST and state feedback.
template <class Check>
void for_each_rst_and_lqg(const Check& check) {
  const auto golden = golden_json("e_tune_structures.json");
  ASSERT_EQ(golden.at("rst_lqg").at("cases").size(), 4U);
  for (const auto& c : golden.at("rst_lqg").at("cases")) {
    SCOPED_TRACE(c.at("plant").dump() + " " + c.at("bounds").dump());
    check(c, golden_machines(c).front());
  }
}

}  // namespace resonid::test
