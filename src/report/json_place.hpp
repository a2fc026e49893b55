// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <resonid/report/json.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// A place in a JSON text that knows its path. What is wrong there is noted once and read as something
/// harmless, so that reading goes on and finds everything that is wrong.
class JsonPlace {
 public:
  JsonPlace(const nlohmann::json& root, std::vector<JsonProblem>& problems)
      : value_(&root), path_("$"), problems_(&problems) {}

  [[nodiscard]] bool present() const noexcept { return value_ != nullptr; }
  /// A key that must be there.
  [[nodiscard]] JsonPlace at(const std::string& key) const;
  /// A key that may be missing: then not present().
  [[nodiscard]] JsonPlace maybe(const std::string& key) const;
  /// The elements of an array.
  [[nodiscard]] std::vector<JsonPlace> elements() const;

  [[nodiscard]] double number() const;        ///< Finite.
  [[nodiscard]] double positive() const;      ///< > 0
  [[nodiscard]] double not_negative() const;  ///< >= 0
  [[nodiscard]] std::size_t count() const;    ///< Whole, >= 0.
  [[nodiscard]] bool flag() const;
  [[nodiscard]] std::string text() const;
  [[nodiscard]] std::vector<double> numbers() const;
  [[nodiscard]] bool is(const std::string& text) const;  ///< A text and this one; nothing is noted.
  /// The index of a text among `names`.
  [[nodiscard]] std::size_t choice(const std::vector<std::string>& names) const;
  /// The same of a key that may be missing.
  [[nodiscard]] std::optional<double> maybe_number(const std::string& key) const;
  [[nodiscard]] std::string maybe_text(const std::string& key) const;

  /// Notes that something else is required here.
  void refuse(const std::string& required) const;

 private:
  JsonPlace(const nlohmann::json* value, std::string path, std::vector<JsonProblem>* problems)
      : value_(value), path_(std::move(path)), problems_(problems) {}
  [[nodiscard]] JsonPlace part(const std::string& key, bool required) const;

  const nlohmann::json* value_;
  std::string path_;
  std::vector<JsonProblem>* problems_;
};

}  // namespace resonid::report
