// SPDX-License-Identifier: MIT
#include "tune_conditions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "errors.hpp"
#include "profile.hpp"

namespace resonid::cli {
namespace {

using Structure = identification::ControllerStructure;

/// With which calls an option, or every one of a group, has an effect.
struct Condition {
  std::string_view option;  ///< Long name, or that of a group.
  bool (*is_met)(const TuneCall&);
  std::string_view found, required;
};

bool reads_recording(const TuneCall& c) { return c.check; }
bool designs(const TuneCall& c) { return !c.evaluate; }
bool has_model(const TuneCall& c) { return !c.by_response; }
bool may_be_position_loop(const TuneCall& c) { return c.position_loop.value_or(true); }
bool may_be_velocity_loop(const TuneCall& c) { return !c.position_loop.value_or(false); }
bool may_have_filters(const TuneCall& c) {
  return c.structure == Structure::automatic || c.structure == Structure::pi_biquads;
}

bool may_integrate(const TuneCall& c) { return c.structure != Structure::p; }

constexpr std::string_view kNoCheck = "no --check, whose recording it is for";
constexpr std::string_view kCheck = "--check RECORD with it";
constexpr std::string_view kDesign = "a design: leave out --evaluate";
constexpr std::string_view kNoModel = "a RESULT that holds no drive model";
constexpr std::string_view kModel = "one with a model: lines of a response tell neither steps nor draws";

/// The first that is not met is told.
constexpr std::array kConditions = {
    Condition{"delay", [](const TuneCall& c) { return c.first_loop; }, "a RESULT, which tells it",
              "--first-loop"},
    Condition{"sample-rate", [](const TuneCall& c) { return c.first_loop || c.check; },
              "a RESULT, which tells it", "--first-loop, or --check"},
    Condition{"Recording", reads_recording, kNoCheck, kCheck},
    Condition{"Excitation", reads_recording, kNoCheck, kCheck},
    Condition{"Estimation", reads_recording, kNoCheck, kCheck},
    Condition{"Model", reads_recording, kNoCheck, kCheck},
    Condition{"Kalman method", reads_recording, kNoCheck, kCheck},
    Condition{"shaper-limit", [](const TuneCall& c) { return c.shaper; },
              "no --shaper, whose vibration it limits", "--shaper with it"},
    Condition{"export-name", [](const TuneCall& c) { return c.exports; }, "no --export, whose name it is",
              "--export FORMAT:FILE with it"},
    Condition{"export-thread", [](const TuneCall& c) { return c.hal; }, "no --export hal, whose thread it is",
              "--export hal:FILE with it"},
    Condition{"export-axis", [](const TuneCall& c) { return c.klipper; },
              "no --export klipper, whose axis it is", "--export klipper:FILE with it"},
    Condition{"structure", designs, "--evaluate, whose controller tells it", kDesign},
    Condition{"biquads", designs, "--evaluate, whose controller tells it", kDesign},
    Condition{"overshoot", designs, "--evaluate, whose controller tells its set-point weight", kDesign},
    Condition{"speed", designs, "--evaluate, which is one controller for all positions", kDesign},
    Condition{"biquads", may_have_filters, "a --structure without filters", "auto or pi+biquads"},
    Condition{"load-peak", may_be_velocity_loop, "a position loop, whose load is bounded by its position",
              "--position-peak"},
    Condition{"position-peak", may_be_position_loop, "no position loop, whose bound it is",
              "--structure cascade, or --evaluate of one, with it"},
    Condition{"overshoot", may_be_velocity_loop, "a position loop, which has no set-point weight",
              "a structure of a velocity loop"},
    Condition{"overshoot", may_integrate, "a P, which has no set-point weight",
              "a --structure with an integral part"},
    Condition{"overshoot", has_model, kNoModel, kModel},
    Condition{"step", has_model, kNoModel, kModel},
    Condition{"biquads", has_model, kNoModel, kModel},
    Condition{"draws", has_model, kNoModel, kModel},
    Condition{"seed", has_model, kNoModel, kModel},
};

/// Beside those of the group General.
constexpr std::array<std::string_view, 9> kOfFirstLoop = {"first-loop",    "sample-rate", "delay",
                                                          "max-torque",    "export",      "export-name",
                                                          "export-thread", "json",        "brief"};

bool goes_with_first_loop(std::string_view name, const std::string& group) {
  return group == "General" ||
         std::find(kOfFirstLoop.begin(), kOfFirstLoop.end(), name) != kOfFirstLoop.end();
}

}  // namespace

void refuse_unused(const CLI::App& verb, const TuneCall& call) {
  for (const auto* option : verb.get_options()) {
    if (option->count() == 0 || option->get_lnames().empty() || is_from_profile(*option)) continue;
    const auto& name = option->get_lnames().front();
    const auto& group = option->get_group();
    if (call.first_loop && !goes_with_first_loop(name, group))
      throw UsageError(fmt::format("--{}: found with --first-loop, required a RESULT with it", name));
    for (const auto& condition : kConditions) {
      const bool own_rule = condition.option == name;
      // --sample-rate is of the recording's group, and goes with more.
      if (!own_rule && (condition.option != group || name == "sample-rate")) continue;
      if (!condition.is_met(call))
        throw UsageError(
            fmt::format("--{}: found with {}, required {}", name, condition.found, condition.required));
    }
  }
}

}  // namespace resonid::cli
