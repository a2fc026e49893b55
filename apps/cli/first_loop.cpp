// SPDX-License-Identifier: MIT
#include "first_loop.hpp"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/first_loop.hpp>
#include <resonid/report/detail/tune.hpp>
#include <utility>

#include "brief.hpp"
#include "errors.hpp"
#include "name_values.hpp"
#include "option_names.hpp"
#include "output.hpp"
#include "provenance.hpp"
#include "terminal.hpp"
#include "tune_exports.hpp"

namespace resonid::cli {
namespace {

using identification::FirstLoop;
using identification::FirstLoopOptions;

/// Names of what is known, as the library's errors have them.
const std::vector<std::string> kKnownNames = {"motor_inertia", "total_inertia", "largest_ratio",
                                              "torque_lag_s", "least_damping"};

FirstLoopOptions options_of(const FirstLoopVerb& given) {
  FirstLoopOptions o;
  for (const auto& item : name_values("--first-loop", given.known)) {
    const double value = number_of("--first-loop", item, kKnownNames);
    if (item.name == "motor_inertia") o.motor_inertia = value;
    if (item.name == "total_inertia") o.total_inertia = value;
    if (item.name == "largest_ratio") o.largest_ratio = value;
    if (item.name == "torque_lag_s") o.torque_lag_s = value;
    if (item.name == "least_damping") o.least_damping = value;
  }
  if (!given.sample_rate_hz) throw UsageError("--sample-rate HZ is required with --first-loop");
  o.sample_rate_hz = *given.sample_rate_hz;
  o.delay_s = given.delay_s.value_or(0.0);
  o.torque_limit = given.torque_limit;
  return o;
}

FirstLoop designed(const FirstLoopOptions& options) {
  auto loop = identification::first_loop(options);
  if (loop) return std::move(*loop);
  for (const auto& name : kKnownNames)
    if (loop.error().field == name) throw UsageError("--first-loop: " + message_of(loop.error()));
  throw UsageError(in_options(loop.error()));
}

/// The ratios of inertias that are promised; where both inertias are told, theirs is known.
std::string ratio_words(const FirstLoopOptions& o) {
  constexpr double kLeast = 0.1, kMost = 10.0;
  const std::string all = "whose load has 0.1 ... 10 times the motor's inertia";
  if (!o.motor_inertia || !o.total_inertia) return all;
  const double ratio = *o.total_inertia / *o.motor_inertia - 1.0;
  return ratio >= kLeast && ratio <= kMost
             ? fmt::format("whose load has {:.3g} times the motor's inertia, as this one's", ratio)
             : fmt::format("{} (this one's has {:.3g} times, which was not looked at)", all, ratio);
}

std::vector<std::string> sentences_of(const FirstLoop& loop) {
  const auto& gains = *loop.controller.gains;
  const auto& o = loop.options;
  std::vector<std::string> said = {
      fmt::format("Gains: kp {:.3g} Nm/(rad/s), ki {:.3g} Nm/rad (Ti {:.3g} s), set-point weight b 1.",
                  gains.kp, gains.ki, gains.kp / gains.ki),
      fmt::format(
          "Soft on purpose: it crosses over near {:.2g} Hz, as long as motor and load move as one. It is "
          "half of what keeps every two-mass machine stable {} and whose resonance has a damping ratio of "
          "{:g} "
          "or more, wherever it lies.",
          loop.crossover_hz, ratio_words(o), o.least_damping),
      fmt::format(
          "Assumed: {:.3g} ms from torque to measured velocity: delay {:g} ms, half a sample {:g} ms, torque "
          "lag {:g} ms. Give the longest delay that may be.",
          1e3 * loop.lag_s, 1e3 * o.delay_s, 500.0 / o.sample_rate_hz, 1e3 * o.torque_lag_s)};
  if (!o.motor_inertia)
    said.push_back(fmt::format(
        "The motor's inertia is not known: it is taken for that of the largest ratio, {:g}. From the total "
        "inertia alone no gain is safe.",
        *o.largest_ratio));
  said.push_back(
      "Next: let it hold or turn the machine while 'resonid excite' writes what to add to its torque, "
      "record, identify the recording, and tune from that result.");
  return said;
}

nlohmann::json json_of(const FirstLoop& loop) {
  auto json = report::controller_json(loop.controller);
  const auto& o = loop.options;
  nlohmann::json known{
      {"sample_rate_hz", o.sample_rate_hz}, {"delay_s", o.delay_s}, {"torque_lag_s", o.torque_lag_s},
      {"least_damping", o.least_damping},   {"lag_s", loop.lag_s},  {"crossover_hz", loop.crossover_hz}};
  const auto put = [&](const char* name, const std::optional<double>& value) {
    if (value) known[name] = *value;
  };
  put("motor_inertia", o.motor_inertia);
  put("total_inertia", o.total_inertia);
  put("largest_ratio", o.largest_ratio);
  put("torque_limit", o.torque_limit);
  json["kp"] = loop.controller.gains->kp;
  json["ki"] = loop.controller.gains->ki;
  json["first_loop"] = std::move(known);
  return json;
}

std::string text_of(const FirstLoop& loop, const TuneExport& wanted,
                    const identification::ExportNames& names) {
  if (wanted.format == identification::ExportFormat::json)
    return report::controller_json(loop.controller).dump(2) + "\n";
  auto text = identification::exported(loop, wanted.format, names);
  if (!text)
    throw UsageError(fmt::format("--export {}: {}", name_of(wanted.format), message_of(text.error())));
  return std::move(*text);
}

}  // namespace

void run_first_loop(const FirstLoopVerb& given) {
  const auto exports = exports_of(given.exports);
  std::vector<std::pair<std::string_view, std::string_view>> outputs = {{"--json", given.json}};
  for (const auto& e : exports) outputs.emplace_back("--export", e.file);
  const bool quiet = no_summary(outputs);
  refuse_shared_files({}, outputs);
  for (const auto& [option, file] : outputs) refuse_unwritable({file});
  const FirstLoop loop = designed(options_of(given));
  std::vector<std::string> texts;  // all of them before the first is written
  for (const auto& e : exports) texts.push_back(text_of(loop, e, given.names));
  for (std::size_t i = 0; i < exports.size(); ++i) write_output(exports[i].file, texts[i]);
  if (!given.json.empty()) {
    auto json = json_of(loop);
    report::put_provenance(json, provenance_of_files({}));
    write_json(given.json, json);
  }
  if (quiet) return;
  print_summary(brief_text("A first loop, for a machine of which no more than inertias are known.",
                           sentences_of(loop)));
  for (const auto& e : exports) print(fmt::format("{} written to {}\n", name_of(e.format), e.file));
}

}  // namespace resonid::cli
