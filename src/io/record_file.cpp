// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <iterator>
#include <resonid/io/csv.hpp>
#include <vector>

#include "io/units.hpp"

namespace resonid::io {
namespace {

/// What a column's name ends with to tell a unit that is not the expected one.
std::string unit_ending(const std::string& unit, const std::string& expected_unit) {
  if (unit.empty() || unit == expected_unit) return {};
  const std::string suffix = suffix_of(unit);
  return suffix.empty() ? fmt::format(" [{}]", unit) : suffix;
}

}  // namespace

std::string record_csv(const data::Record& record) {
  const std::string input = input_si_unit(record.motion);
  const std::string output = output_si_unit(record.motion, record.output_quantity);
  const std::string position = output_si_unit(record.motion, data::OutputQuantity::position);
  std::string text = "time_s";
  std::vector<const std::vector<double>*> columns;
  const auto add = [&](const char* name, const data::Channel& channel, const std::string& si) {
    if (!channel.present()) return;
    text += fmt::format(",{}{}", name, unit_ending(channel.unit, si));
    columns.push_back(&channel.samples);
  };
  add("ru", record.excitation, input);
  add("u", record.input, input);
  add("y", record.output, output);
  add("r", record.reference, output);
  add("position", record.position, position);
  const bool acceleration = record.second_output_kind == data::SecondOutput::load_accelerometer;
  add(acceleration ? "load_acceleration" : "load_position", record.second_output,
      acceleration ? output_si_unit(record.motion, data::OutputQuantity::acceleration) : position);
  text += '\n';
  auto out = std::back_inserter(text);
  for (std::size_t i = 0; i < record.samples(); ++i) {
    // 12 digits: a sum of decimal sample times prints as the decimal that it stands for.
    fmt::format_to(out, "{:.12g}", record.start_time_s + static_cast<double>(i) / record.sample_rate_hz);
    for (const auto* column : columns) fmt::format_to(out, ",{}", (*column)[i]);
    text += '\n';
  }
  return text;
}

}  // namespace resonid::io
