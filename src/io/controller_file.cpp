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

using Result = expected<data::TransferFunction, Error>;

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
  return data::pi_controller(*gain, *time, sample_time_s);
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
  if (const auto step = json.value("sample_time_s", sample_time_s);
      std::abs(step - sample_time_s) > 0.01 * sample_time_s)
    return refused(
        text,
        fmt::format(
            "runs at {:g} s, the recording at {:g} s; a controller must run at the recording's sample time",
            step, sample_time_s));
  return data::TransferFunction{*numerator, *denominator, sample_time_s};
}

}  // namespace resonid::io
