// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <resonid/base/expected.hpp>

#include "report/json/fields.hpp"

namespace resonid::report {

/// What the description says of a result.
[[nodiscard]] nlohmann::json write(const std::function<void(Fields&)>& description);

/// Fills what the description names; what is not as described, all of it, is the error.
[[nodiscard]] expected<void> read(const nlohmann::json& json,
                                  const std::function<void(Fields&)>& description);

/// A key of a file with what is below it.
struct Sketch {
  std::string name;  ///< "*": any further one.
  std::string meaning, unit;
  Presence presence = Presence::required;
  Range range = any;
  std::string type;                ///< Of JSON Schema, or "numbers", "rows" ...
  std::vector<std::string> names;  ///< Of a choice.
  std::string schema;              ///< Of an object that is a file of its own.
  std::vector<Sketch> parts;
  std::vector<std::vector<Sketch>> kinds;  ///< Parts of which an object has one set.
};
[[nodiscard]] Sketch sketch(const std::function<void(Fields&)>& description);

}  // namespace resonid::report
