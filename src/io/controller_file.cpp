// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <resonid/io/controller_file.hpp>
#include <resonid/io/detail/number_list.hpp>

namespace resonid::io {
namespace {

using Result = expected<ControllerFile, Error>;

Result refused(std::string requirement) { return unexpected(Error{{}, std::move(requirement)}); }
Result refused(std::string where, std::string requirement) {
  return unexpected(Error{{}, std::move(requirement), std::nan(""), std::move(where)});
}

Result pi(const std::string& numbers, double sample_time_s) {
  const auto comma = numbers.find(',');
  const auto gain = parse_number(numbers.substr(0, comma));
  const auto time = comma == std::string::npos ? std::nullopt : parse_number(numbers.substr(comma + 1));
  if (!gain || !time)
    return refused(fmt::format("found 'pi:{}', required pi:KP,TI with two numbers", numbers));
  if (*gain == 0.0 || !(*time > 0.0))
    return refused(
        fmt::format("found KP = {:g}, TI = {:g} s, required KP other than 0 and TI > 0", *gain, *time));
  ControllerFile controller{data::pi_controller(*gain, *time, sample_time_s), "pi", {}, {}, {}};
  return controller;
}

/// A non-empty array of finite numbers, or nothing.
std::optional<std::vector<double>> coefficients(const nlohmann::json& json, const char* key) {
  if (!json.is_object() || !json.contains(key) || !json[key].is_array() || json[key].empty())
    return std::nullopt;
  std::vector<double> values;
  for (const auto& entry : json[key]) {
    if (!entry.is_number() || !std::isfinite(entry.get<double>())) return std::nullopt;
    values.push_back(entry.get<double>());
  }
  return values;
}

using Complaint = expected<void, std::string>;

/// A file without a sample time is at the record's.
Complaint checked_step(const nlohmann::json& json, double sample_time_s) {
  if (!json.contains("sample_time_s")) return {};
  const auto& found = json["sample_time_s"];
  if (!found.is_number() || !(found.get<double>() > 0.0))
    return unexpected(std::string("\"sample_time_s\" must be a number > 0"));
  constexpr double kSame = 0.01;
  const double step = found.get<double>();
  if (std::abs(step - sample_time_s) <= kSame * sample_time_s) return {};
  return unexpected(fmt::format(
      "runs at {:g} s, the recording at {:g} s; a controller must run at the recording's sample time", step,
      sample_time_s));
}

/// Whether a polynomial in z^-1 is 0 there, but for rounding.
bool has_root(const std::vector<double>& polynomial, double inverse_z) {
  constexpr double kRounding = 1e-6;
  double sum = 0.0, size = 0.0, power = 1.0;
  for (const double term : polynomial) {
    sum += term * power;
    size += std::abs(term * power);
    power *= inverse_z;
  }
  return std::abs(sum) <= kRounding * size;
}

/// 1 + kv q = ((1 + kv Ts) - z^-1)/(1 - z^-1) is a factor of a cascade.
bool contains_position(const data::TransferFunction& feedback, double gain) {
  return has_root(feedback.numerator, 1.0 + gain * feedback.sample_time_s) &&
         has_root(feedback.denominator, 1.0);
}

/// A number that is there, or nothing; `complaint` keeps what is there and none.
std::optional<double> number_of(const nlohmann::json& json, const char* key, Complaint& complaint) {
  const auto found = json.find(key);
  if (found == json.end()) return std::nullopt;
  if (found->is_number() && std::isfinite(found->get<double>())) return found->get<double>();
  complaint = unexpected(fmt::format("\"{}\" must be a number", key));
  return std::nullopt;
}

Complaint read_biquads(const nlohmann::json& gains, ControllerParts& parts) {
  const auto list = gains.find("biquads");
  if (list == gains.end()) return {};
  const auto wrong = unexpected(
      std::string("\"biquads\" must be an array of frequency_hz, numerator_damping and denominator_damping"));
  if (!list->is_array()) return wrong;
  for (const auto& entry : *list) {
    Complaint complaint;
    if (!entry.is_object()) return wrong;
    const auto frequency = number_of(entry, "frequency_hz", complaint),
               numerator = number_of(entry, "numerator_damping", complaint),
               denominator = number_of(entry, "denominator_damping", complaint);
    if (!frequency || !numerator || !denominator) return wrong;
    parts.biquads.push_back({*frequency, *numerator, *denominator});
  }
  return {};
}

/// What the law is made of, of files that tell it.
Complaint read_parts(const nlohmann::json& json, ControllerFile& controller) {
  const auto gains = json.find("gains");
  if (gains == json.end()) return {};
  Complaint complaint;
  std::optional<double> kp, ki;
  if (gains->is_object()) {
    kp = number_of(*gains, "kp", complaint);
    ki = number_of(*gains, "ki", complaint);
  }
  if (!kp || !ki) return unexpected(std::string("\"gains\" must be an object with the numbers kp and ki"));
  ControllerParts parts{*kp, *ki, {}, {}, {}, 1.0};
  if (auto read = read_biquads(*gains, parts); !read) return read;
  parts.derivative_gain = number_of(json, "derivative_gain", complaint);
  parts.derivative_time_s = number_of(json, "derivative_time_s", complaint);
  parts.set_point_weight = number_of(json, "set_point_weight", complaint).value_or(1.0);
  if (complaint && parts.derivative_gain.has_value() != parts.derivative_time_s.has_value())
    return unexpected(
        std::string("\"derivative_gain\" and \"derivative_time_s\": required both of them, or none"));
  controller.parts = std::move(parts);
  return complaint;
}

Complaint read_further(const nlohmann::json& json, ControllerFile& controller) {
  if (const auto found = json.find("structure"); found != json.end()) {
    if (!found->is_string()) return unexpected(std::string("\"structure\" must be a text"));
    controller.structure = found->get<std::string>();
  }
  if (json.contains("reference_numerator")) {
    const auto reference = coefficients(json, "reference_numerator");
    if (!reference)
      return unexpected(std::string("\"reference_numerator\" must be an array of numbers in powers of z^-1"));
    controller.reference_numerator = *reference;
  }
  if (auto parts = read_parts(json, controller); !parts) return parts;
  const auto gain = json.find("position_gain");
  if (gain == json.end()) return {};
  if (!gain->is_number() || !(gain->get<double>() > 0.0) || !std::isfinite(gain->get<double>()))
    return unexpected(std::string("\"position_gain\" must be a number > 0, in 1/s"));
  controller.position_gain = gain->get<double>();
  if (!controller.reference_numerator.empty())
    return unexpected(
        std::string("\"reference_numerator\" and \"position_gain\": required one of them, as a position loop "
                    "tells by its gain what the reference does"));
  if (!contains_position(controller, *controller.position_gain))
    return unexpected(
        fmt::format("\"position_gain\" {:g} is no part of numerator and denominator, which must be the whole "
                    "feedback of the velocity, C (1 + kv Ts/(1 - z^-1))",
                    *controller.position_gain));
  return {};
}

}  // namespace

Result read_controller(const std::string& text, double sample_time_s) {
  if (text.rfind("pi:", 0) == 0) return pi(text.substr(3), sample_time_s);
  std::ifstream file;
  const bool is_contents = text.starts_with('{');
  if (!is_contents) file.open(text);
  if (!is_contents && !file)
    return refused(fmt::format("'{}' is neither pi:KP,TI nor a file that can be read", text));
  const auto json =
      is_contents ? nlohmann::json::parse(text, nullptr, false) : nlohmann::json::parse(file, nullptr, false);
  if (json.is_discarded()) return refused(text, "is not valid JSON");
  const auto numerator = coefficients(json, "numerator");
  const auto denominator = coefficients(json, "denominator");
  if (!numerator || !denominator)
    return refused(text, "needs \"numerator\" and \"denominator\", arrays of numbers in powers of z^-1");
  if (denominator->front() == 0.0) return refused(text, "the denominator must not begin with 0");
  if (auto step = checked_step(json, sample_time_s); !step) return refused(text, step.error());
  ControllerFile controller{{*numerator, *denominator, sample_time_s}, {}, {}, {}, {}};
  if (auto further = read_further(json, controller); !further) return refused(text, further.error());
  return controller;
}

}  // namespace resonid::io
