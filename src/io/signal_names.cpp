// SPDX-License-Identifier: MIT
#include "io/signal_names.hpp"

#include <algorithm>
#include <cctype>
#include <span>
#include <vector>

#include "io/text.hpp"

namespace resonid::io {
namespace {

using Kind = SignalSense::Kind;

/// The words of a name, in lower case: "PLC_PRG.fActTorque" is plc, prg, f, act, torque.
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words;
  std::string word;
  const auto end = [&] {
    if (!word.empty()) words.push_back(lower(word));
    word.clear();
  };
  for (std::size_t i = 0; i < name.size(); ++i) {
    const auto c = static_cast<unsigned char>(name[i]);
    const bool letter = std::isalpha(c) != 0 || c >= 0x80;
    const bool begins =
        std::isupper(c) != 0 && i > 0 && std::islower(static_cast<unsigned char>(name[i - 1])) != 0;
    if (!letter || begins) end();
    if (letter) word.push_back(name[i]);
  }
  end();
  return words;
}

bool has(const std::vector<std::string>& words, std::span<const std::string_view> wanted) {
  return std::any_of(words.begin(), words.end(), [&](const std::string& word) {
    return std::find(wanted.begin(), wanted.end(), word) != wanted.end();
  });
}

bool holds(const std::vector<std::string>& words, std::span<const std::string_view> parts) {
  return std::any_of(words.begin(), words.end(), [&](const std::string& word) {
    return std::any_of(parts.begin(), parts.end(), [&](auto part) { return word.find(part) != word.npos; });
  });
}

/// What no input or output is, whatever else its name says.
constexpr std::string_view kAside[] = {"limit",  "temp",    "fault",    "error",  "warn",
                                       "ripple", "voltage", "spannung", "status", "schlepp"};
constexpr std::string_view kCommanded[] = {"soll",   "setpoint",  "command", "demand",
                                           "target", "reference", "request"};
constexpr std::string_view kCommandedWords[] = {"set", "cmd", "ref", "des", "desired"};
constexpr std::string_view kActual[] = {"actual", "meas", "feedback", "estimate", "istwert", "gemessen"};
constexpr std::string_view kActualWords[] = {"act", "ist", "fb", "fbk", "mess", "est", "used"};

struct Vocabulary {
  Kind kind;
  std::vector<std::string_view> parts;    ///< Of a word, wherever they stand in it.
  std::vector<std::string_view> words;    ///< Whole words.
  std::vector<std::string_view> letters;  ///< Words that say so beside "act", "soll" and their like only.
};

const std::vector<Vocabulary>& vocabularies() {
  static const std::vector<Vocabulary> all = {
      {Kind::torque, {"torque", "moment", "force", "kraft"}, {"trq"}, {"m", "t", "f"}},
      {Kind::acceleration, {"accel", "beschleunig"}, {"acc"}, {"a"}},
      {Kind::velocity,
       {"velocity", "velo", "speed", "drehzahl", "geschwindig", "omega"},
       {"vel", "vl", "rpm"},
       {"n", "v", "w"}},
      {Kind::position,
       {"position", "angle", "winkel", "encoder", "theta"},
       {"pos", "phi", "lage", "pl", "weg"},
       {"s", "x"}},
      {Kind::current, {"current", "strom"}, {"iq", "il"}, {"i", "q"}},
  };
  return all;
}

std::optional<Kind> kind_of(Dimension dimension) {
  switch (dimension) {
    case Dimension::time:
      return Kind::time;
    case Dimension::angle:
    case Dimension::length:
    case Dimension::counts:
      return Kind::position;
    case Dimension::angular_velocity:
    case Dimension::velocity:
    case Dimension::count_rate:
      return Kind::velocity;
    case Dimension::angular_acceleration:
    case Dimension::acceleration:
      return Kind::acceleration;
    case Dimension::torque:
    case Dimension::force:
      return Kind::torque;
    case Dimension::current:
      return Kind::current;
    default:
      return std::nullopt;
  }
}

Kind kind_of(const std::vector<std::string>& words, bool qualified) {
  constexpr std::string_view kTime[] = {"time", "zeit", "timestamp"};
  constexpr std::string_view kTimeWords[] = {"t"};
  constexpr std::string_view kNumber[] = {"sample", "samples", "index", "idx", "nr"};
  if (has(words, kNumber) && words.size() <= 2) return Kind::sample_number;
  if (holds(words, kTime) || (words.size() == 1 && has(words, kTimeWords))) return Kind::time;
  for (const auto& v : vocabularies())
    if (holds(words, v.parts) || has(words, v.words)) return v.kind;
  if (qualified)
    for (const auto& v : vocabularies())
      if (has(words, v.letters)) return v.kind;
  return Kind::none;
}

}  // namespace

SignalSense sense_of(std::string_view base, const std::optional<Unit>& unit) {
  const auto words = words_of(base);
  SignalSense sense;
  sense.commanded = holds(words, kCommanded) || has(words, kCommandedWords);
  const auto begins_ist = [](const std::string& word) { return word.starts_with("ist") && word.size() > 5; };
  sense.actual = holds(words, kActual) || has(words, kActualWords) ||
                 std::any_of(words.begin(), words.end(), begins_ist);
  sense.aside = holds(words, kAside);
  if (sense.aside) return sense;
  const auto of_unit = unit ? kind_of(unit->dimension) : std::nullopt;
  const Kind of_name = kind_of(words, sense.commanded || sense.actual);
  sense.kind = of_unit ? *of_unit : of_name;
  return sense;
}

}  // namespace resonid::io
