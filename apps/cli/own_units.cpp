// SPDX-License-Identifier: MIT
#include "own_units.hpp"

#include <algorithm>
#include <optional>
#include <resonid/io/detail/number_list.hpp>
#include <resonid/io/detail/own_units.hpp>
#include <string_view>

namespace resonid::cli {
namespace {

/// What of an option the result stores.
class Stored {
 public:
  explicit Stored(const identification::Result& result) : options_(result.options) {}
  [[nodiscard]] std::optional<std::string> text(std::string_view name) const {
    const auto found =
        std::find_if(options_.begin(), options_.end(), [&](const auto& given) { return given.name == name; });
    return found == options_.end() ? std::nullopt : std::optional(found->value);
  }
  [[nodiscard]] std::optional<double> number(std::string_view name) const {
    const auto given = text(name);
    return given ? io::parse_number(*given) : std::nullopt;
  }

 private:
  const std::vector<identification::GivenOption>& options_;
};

io::ColumnMapping mapping_of(const identification::Result& result) {
  const Stored stored(result);
  io::ColumnMapping mapping;
  mapping.input_scale = stored.number("input-scale").value_or(1.0);
  mapping.output_scale = stored.number("output-scale").value_or(1.0);
  mapping.input_unit = stored.text("input-unit");
  mapping.output_unit = stored.text("output-unit");
  mapping.counts_per_rev = stored.number("counts-per-rev");
  mapping.rated_torque = stored.number("rated-torque");
  mapping.torque_constant = stored.number("torque-constant");
  mapping.differentiate = stored.text("differentiate").has_value();
  return mapping;
}

std::string named(const std::string& unit, const std::string& column) {
  return unit.empty() && !column.empty() ? "[" + column + "]" : unit;
}

}  // namespace

void put_own_units(const identification::Result& result, identification::Tuning& tuning) {
  const auto mapping = mapping_of(result);
  const auto& record = result.record;
  const bool slides = result.units.input == "N" || result.units.velocity == "m/s";
  const auto motion = slides ? data::Motion::linear : data::Motion::rotary;
  const auto input = io::own_input_unit({record.input, result.units.input, record.reading, motion}, mapping);
  const auto output = io::own_velocity_unit({record.output, result.units.velocity, record.reading, motion},
                                            mapping, record.output_quantity);
  tuning.input_scale = 1.0 / input.factor;
  tuning.output_scale = 1.0 / output.factor;
  tuning.input_unit = named(input.unit, record.input);
  tuning.output_unit = named(output.unit, record.output);
}

}  // namespace resonid::cli
