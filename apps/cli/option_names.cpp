// SPDX-License-Identifier: MIT
#include "option_names.hpp"

#include <algorithm>
#include <array>
#include <resonid/base/error_text.hpp>
#include <utility>

namespace resonid::cli {
namespace {

struct Unit {
  std::string_view suffix, placeholder;
};
constexpr std::array kUnits{Unit{"_hz", "HZ"}, Unit{"_rad", "RAD"}, Unit{"_s", "SECONDS"}, Unit{"_m", "M"}};

const Unit* unit_of(std::string_view field) {
  for (const auto& unit : kUnits)
    if (field.size() > unit.suffix.size() && field.substr(field.size() - unit.suffix.size()) == unit.suffix)
      return &unit;
  return nullptr;
}

struct Option {
  std::string_view field;         ///< Of the library's options and configurations.
  std::string_view name;          ///< Empty: the field's without its unit, with dashes.
  std::string_view operand = {};  ///< As --help has it, where it helps those who are told to give it.
};
/// Every field that the library's texts name.
constexpr std::array kOptions = {
    Option{"accuracy", {}},
    Option{"approach", {}},
    Option{"band_hz", {}, "LO:HI"},
    Option{"candidate", "MODEL"},
    Option{"change_of", "--detect-change"},
    Option{"check", {}},
    Option{"chirp", {}, "F0:F1:SECONDS"},
    Option{"controller", {}},
    Option{"counts_per_rev", {}, "N"},
    Option{"decimal", {}},
    Option{"delay_s", {}},
    Option{"delay_std_s", "--delay-uncertainty"},
    Option{"differentiate", {}},
    Option{"drift_per_s", "--drift"},
    Option{"drop_periods", {}},
    Option{"evaluate", {}},
    Option{"excitation", {}, "COL"},
    Option{"excitation_type", {}},
    Option{"false_alarm_interval_s", "--false-alarms"},
    Option{"force", {}},
    Option{"friction", {}},
    Option{"from_s", {}},
    Option{"ground", {}},
    Option{"independent", "--validate-on"},
    Option{"header_line", {}},
    Option{"input", {}},
    Option{"input_scale", {}},
    Option{"input_unit", {}},
    Option{"largest_complementary", "--mt"},
    Option{"largest_controller_sensitivity", "--controller-peak"},
    Option{"largest_load_transfer", "--load-peak"},
    Option{"largest_position_transfer", "--position-peak"},
    Option{"largest_noise_torque", "--noise-torque"},
    Option{"largest_sensitivity", "--ms"},
    Option{"largest_speed", "--speed"},
    Option{"learn_s", {}},
    Option{"least_bandwidth_hz", "--bandwidth"},
    Option{"lines_hz", {}},
    Option{"memory_s", {}},
    Option{"method", {}},
    Option{"missing", {}},
    Option{"model", {}},
    Option{"order", {}},
    Option{"output", {}},
    Option{"output_quantity", {}},
    Option{"output_scale", {}},
    Option{"output_unit", {}},
    Option{"period_samples", {}, "N"},
    Option{"position", {}},
    Option{"positions", "--schedule"},
    Option{"rated_torque", {}, "NM"},
    Option{"records", "--join"},
    Option{"reference", {}},
    Option{"reference_step", "--step"},
    Option{"results", "RESULT"},
    Option{"sample_rate_hz", {}, "HZ"},
    Option{"second_output", {}, "COL"},
    Option{"second_output_kind", {}},
    Option{"second_output_scale", {}},
    Option{"second_output_unit", {}},
    Option{"simulate", {}},
    Option{"skip_lines", "--skip"},
    Option{"spread", {}},
    Option{"start", {}},
    Option{"structure", {}},
    Option{"time", {}, "COL"},
    Option{"time_s", "--max-time"},
    Option{"time_unit", {}},
    Option{"to_s", {}},
    Option{"torque_constant", {}, "NM_A"},
    Option{"torque_limit", "--max-torque"},
    Option{"whole_record", {}},
};

const Option* option_of(std::string_view field) {
  const auto found =
      std::find_if(kOptions.begin(), kOptions.end(), [&](const Option& o) { return o.field == field; });
  return found == kOptions.end() ? nullptr : &*found;
}

/// "give .time or .sample_rate_hz": whether a text that ends here asks for what follows.
bool asks(std::string_view before) {
  return before.ends_with("give ") ||
         (before.ends_with(" or ") && before.rfind("give .") != std::string_view::npos);
}

bool in_a_name(char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; }

}  // namespace

std::string option_name(std::string_view field) {
  if (const Option* option = option_of(field); option != nullptr && !option->name.empty())
    return std::string(option->name);
  if (const Unit* unit = unit_of(field)) field.remove_suffix(unit->suffix.size());
  std::string name = "--" + std::string(field);
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

std::string option_unit(std::string_view field) {
  const Unit* unit = unit_of(field);
  return unit == nullptr ? "X" : std::string(unit->placeholder);
}

std::string in_options(std::string_view text) {
  constexpr std::string_view kJoin = "join()";
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const bool begins = i == 0 || !(in_a_name(text[i - 1]) || text[i - 1] == '.');
    if (begins && text.substr(i).starts_with(kJoin)) {
      out += option_name("records");
      i += kJoin.size();
      continue;
    }
    std::size_t end = i + 1;
    while (text[i] == '.' && end < text.size() && in_a_name(text[end])) ++end;
    const auto field = text.substr(i + 1, end - i - 1);
    const Option* option = text[i] == '.' ? option_of(field) : nullptr;
    if (begins && option != nullptr) {
      out += option_name(field);
      if (!option->operand.empty() && asks(text.substr(0, i))) out += " " + std::string(option->operand);
      i = end;
      continue;
    }
    out += text[i++];
  }
  return out;
}

std::string in_options(const Error& error) {
  Error told = error;
  if (!error.field.empty()) told.field = option_name(error.field.view());
  return in_options(message_of(told));
}

}  // namespace resonid::cli
