// SPDX-License-Identifier: MIT
#include "follow_options.hpp"

#include <fmt/format.h>

#include <type_traits>
#include <utility>

#include "errors.hpp"
#include "inherit.hpp"
#include "options.hpp"
#include "result_file.hpp"

namespace resonid::cli {
namespace {

void add_estimator_options(CLI::App& verb, FollowOptions& o, const std::string& every_standard) {
  auto& t = o.track;
  verb.option_defaults()->group("On-line estimator");
  add_enum(verb, "--method", t.method, "the on-line estimator");
  add_number(verb, "--memory", t.memory_s, "SECONDS", "how long the estimate remembers; otherwise chosen");
  add_enum(verb, "--forgetting", t.forgetting,
           "arx, oe, rpem, cloe, f-cloe, d-cloe: how old samples lose weight");
  verb.add_flag("--extrapolate", t.extrapolate,
                "iv: extrapolate to the newest sample; no lag, and nearly twice the variance");
  add_number(
      verb, "--drift", t.drift_per_s, "1/S",
      "physical: relative change of the stiffness per second that the machine can reach; otherwise chosen");
  static_assert(std::is_same_v<std::size_t, std::uint64_t>);
  add_count(verb, "--every", t.every, "a row every so many samples", 1)->default_str(every_standard);
  verb.add_option("--result", o.result,
                  "result of identify that tells columns, units, scales, controller and delay; otherwise "
                  "--baseline or --start does")
      ->type_name("FILE.json");
  verb.add_option("--start", o.start, "result of identify whose model the estimate begins with")
      ->type_name("FILE.json");
  verb.add_option("--baseline", o.baseline, "result of identify to which the gap is taken")
      ->type_name("FILE.json");
}

void inherit_from_results(CLI::App& verb, const FollowOptions& o) {
  for (const auto& [option, file] :
       {std::pair{"--result", &o.result}, {"--baseline", &o.baseline}, {"--start", &o.start}}) {
    if (file->empty()) continue;
    const auto result = read_result(*file, option);
    return inherit(verb, result.options, *file, is_of_record(result, o.record.record));
  }
}

void read_models(FollowOptions& o) {
  if (!o.start.empty()) {
    const auto result = read_result(o.start, "--start");
    if (!result.model)
      throw InputError(fmt::format("--start: '{}': holds no model; required: an initial model", o.start));
    o.track.start = result.model->drive;
    o.track.start_units = result.units;
  }
  if (!o.baseline.empty()) o.track.baseline = read_result(o.baseline, "--baseline");
}

}  // namespace

void add_follow_options(CLI::App& verb, FollowOptions& o, const std::string& every_standard) {
  add_excitation_options(verb, o.method);
  add_estimator_options(verb, o, every_standard);
  add_loop_options(verb, o.method);
  add_result_options(verb, o.method);
  add_drive_model_option(verb, o.method);
  add_friction_option(
      verb, o.method,
      "of the initial model; dry: arx, iv and physical follow Coulomb friction, viscous: physical "
      "follows viscous friction");
  add_tracker_options(verb, o.method);
}

void settle(CLI::App& verb, FollowOptions& o) {
  inherit_from_results(verb, o);
  check(verb, o.method);
  if (verb.get_option("--memory")->count() > 0 && !(o.track.memory_s > 0.0))
    throw UsageError(fmt::format("--memory: found {:g} s, required > 0", o.track.memory_s));
}

data::Record read_followed(CLI::App& verb, FollowOptions& o) {
  read_models(o);
  auto record = read_record(verb, o.record);
  complete(o.method, record);
  o.track.common = o.method.options;
  return record;
}

}  // namespace resonid::cli
