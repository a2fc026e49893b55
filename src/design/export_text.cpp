// SPDX-License-Identifier: MIT
#include "design/export_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

namespace resonid::design {
namespace {

/// Names that mean something in C or in structured text, where case does not count, or stand in the texts.
constexpr std::array kReservedWords = {"abs",
                                       "and",
                                       "array",
                                       "auto",
                                       "begin",
                                       "bool",
                                       "break",
                                       "by",
                                       "byte",
                                       "case",
                                       "char",
                                       "class",
                                       "configuration",
                                       "const",
                                       "constant",
                                       "continue",
                                       "cycle_time",
                                       "default",
                                       "deviation",
                                       "do",
                                       "double",
                                       "dword",
                                       "else",
                                       "elsif",
                                       "enable",
                                       "end",
                                       "enum",
                                       "exit",
                                       "extern",
                                       "false",
                                       "float",
                                       "for",
                                       "function",
                                       "goto",
                                       "if",
                                       "inline",
                                       "int",
                                       "integral",
                                       "limit",
                                       "limited",
                                       "long",
                                       "lreal",
                                       "max",
                                       "min",
                                       "mod",
                                       "not",
                                       "of",
                                       "or",
                                       "out",
                                       "position",
                                       "position_reference",
                                       "program",
                                       "real",
                                       "reference",
                                       "register",
                                       "repeat",
                                       "restrict",
                                       "retain",
                                       "return",
                                       "short",
                                       "signed",
                                       "sizeof",
                                       "static",
                                       "string",
                                       "struct",
                                       "switch",
                                       "task",
                                       "then",
                                       "time",
                                       "to",
                                       "torque",
                                       "torque_feed_forward",
                                       "true",
                                       "type",
                                       "typedef",
                                       "union",
                                       "unsigned",
                                       "until",
                                       "var",
                                       "velocity",
                                       "velocity_feed_forward",
                                       "void",
                                       "volatile",
                                       "way",
                                       "while",
                                       "with",
                                       "word",
                                       "xor"};

bool is_name(const std::string& name) {
  constexpr std::size_t kLongest = 30;
  const auto is_alphanumeric = [](unsigned char c) { return c < 128 && std::isalnum(c) != 0; };
  if (name.size() < 2 || name.size() > kLongest ||
      std::isdigit(static_cast<unsigned char>(name.front())) != 0)
    return false;
  if (name.front() == '_' || name.back() == '_' || name.find("__") != std::string::npos) return false;
  if (!std::all_of(name.begin(), name.end(),
                   [&](char c) { return c == '_' || is_alphanumeric(static_cast<unsigned char>(c)); }))
    return false;
  std::string lower = name;
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return std::none_of(kReservedWords.begin(), kReservedWords.end(),
                      [&](const char* word) { return lower == word; });
}

expected<void> check_schedule(const ExportedController& design) {
  const auto& nodes = design.schedule;
  if (nodes.empty()) return {};
  if (design.controller.kp != 0.0)
    return refuse("kp", "must be 0 where a schedule gives the gains", design.controller.kp);
  if (design.controller.ki != 0.0)
    return refuse("ki", "must be 0 where a schedule gives the gains", design.controller.ki);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!std::isfinite(nodes[i].position) || (i > 0 && !(nodes[i].position > nodes[i - 1].position)))
      return refuse("schedule", "must ascend in position", nodes[i].position);
    if (!(nodes[i].kp >= 0.0 && std::isfinite(nodes[i].kp)))
      return refuse("schedule", "must have a kp >= 0", nodes[i].kp);
    if (!(nodes[i].ki >= 0.0 && std::isfinite(nodes[i].ki)))
      return refuse("schedule", "must have a ki >= 0", nodes[i].ki);
  }
  return {};
}

expected<void> check_position_loop(const ExportedController& design) {
  if (!(design.kv >= 0.0 && std::isfinite(design.kv))) return refuse("kv", "must be >= 0", design.kv);
  if (design.kv > 0.0 && design.set_point_weight != 1.0)
    return refuse("set_point_weight", "must be 1 under a position loop, which it would weigh too",
                  design.set_point_weight);
  if (design.sums_velocity && !design.needs_position())
    return refuse("sums_velocity", "must be false where neither kv nor a schedule asks for the position");
  return {};
}

}  // namespace

expected<void> check_text(const std::string& name, double sample_time_s,
                          const std::optional<double>& torque_limit) {
  if (!is_name(name))
    return refuse(
        "name",
        "must be a letter, then letters, digits and single underscores, 2 to 30 in all, and no word "
        "of the language");
  if (!(sample_time_s > 0.0 && std::isfinite(sample_time_s)))
    return refuse("sample_time_s", "must be > 0", sample_time_s);
  if (torque_limit && !(*torque_limit > 0.0 && std::isfinite(*torque_limit)))
    return refuse("torque_limit", "must be > 0", *torque_limit);
  return {};
}

expected<void> check_exported(const ExportedController& design) {
  const double step = design.sample_time_s, weight = design.set_point_weight;
  if (const auto valid = check_text(design.name, step, design.torque_limit); !valid) return valid;
  if (!(design.controller.kp >= 0.0 && std::isfinite(design.controller.kp)))
    return refuse("kp", "must be >= 0", design.controller.kp);
  if (!(design.controller.ki >= 0.0 && std::isfinite(design.controller.ki)))
    return refuse("ki", "must be >= 0", design.controller.ki);
  if (!(weight >= 0.0 && weight <= 1.0)) return refuse("set_point_weight", "must be from 0 to 1", weight);
  for (const Biquad& biquad : design.controller.biquads) {
    if (!(biquad.frequency_hz > 0.0 && biquad.frequency_hz < 0.5 / step))
      return refuse("biquads", "must lie between 0 and the Nyquist frequency", biquad.frequency_hz);
    if (!(biquad.denominator_damping > 0.0))
      return refuse("biquads", "must have a denominator with damping", biquad.denominator_damping);
  }
  if (const auto nodes = check_schedule(design); !nodes) return nodes;
  return check_position_loop(design);
}

ScheduleSlope slope_behind(const std::vector<ScheduleNode>& nodes, std::size_t i) {
  if (i + 1 >= nodes.size()) return {};
  const ScheduleNode &from = nodes[i], &to = nodes[i + 1];
  const double way = to.position - from.position;
  return {(to.kp - from.kp) / way, (to.ki - from.ki) / way};
}

std::string digits_17(double value) {
  std::string text = fmt::format("{:.17g}", value);
  if (text.find('.') != std::string::npos) return text;
  const auto exponent = text.find('e');
  text.insert(exponent == std::string::npos ? text.size() : exponent, ".0");
  return text;
}

CNumberText c_number_text(CNumber type) {
  if (type == CNumber::in_double) return digits_17;
  return [](double value) { return digits_17(static_cast<double>(static_cast<float>(value))) + "f"; };
}

std::string c_guard_of(const std::string& name) {
  std::string guard = name + "_h";
  for (char& c : guard)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return guard;
}

std::string speed_comment(const ExportedController& design) {
  return design.largest_speed ? fmt::format(" The position may move at up to {:.3g} of its units per s.",
                                            *design.largest_speed)
                              : std::string();
}

std::string law_word(const ExportedController& design) {
  const std::string velocity = design.schedule.empty() && design.controller.ki == 0.0 ? "P" : "PI";
  return design.kv > 0.0 ? "P over " + velocity : velocity;
}

std::string filled_in(std::string_view text, const TextValues& values) {
  std::string filled;
  while (!text.empty()) {
    const auto begin = text.find('@'), end = text.find('@', begin + 1);
    filled += text.substr(0, begin);
    if (begin == std::string_view::npos || end == std::string_view::npos) break;
    const auto key = text.substr(begin + 1, end - begin - 1);
    for (const auto& [known, value] : values)
      if (known == key) filled += value;
    text.remove_prefix(end + 1);
  }
  return filled;
}

}  // namespace resonid::design
