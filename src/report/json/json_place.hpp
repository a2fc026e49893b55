// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <resonid/base/error.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// A place in a JSON text that is not as required.
struct JsonProblem {
  std::string path;      ///< "$.model.parameters.stiffness.value"
  std::string found;     ///< As it stands there, cut to a line; "nothing".
  std::string required;  ///< "a number"
};
using JsonProblems = std::vector<JsonProblem>;

/// All of them, at least one, as one error: its text is "PATH: found ..., required ..." for each, one a line.
[[nodiscard]] Error error_of(const JsonProblems& problems);

/// A place in a JSON text that knows its path. What is wrong there is noted once and read as something
/// harmless, so that reading goes on and finds everything that is wrong.
class JsonPlace {
 public:
  JsonPlace(const nlohmann::json& root, JsonProblems& problems)
      : value_(&root), path_("$"), problems_(&problems) {}

  [[nodiscard]] bool present() const noexcept { return value_ != nullptr; }
  [[nodiscard]] bool null() const noexcept { return value_ != nullptr && value_->is_null(); }
  [[nodiscard]] JsonPlace none() const { return {nullptr, path_, problems_}; }
  [[nodiscard]] std::vector<std::string> keys() const;  ///< Of an object.
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
  [[nodiscard]] int whole() const;            ///< Whole, of any sign.
  [[nodiscard]] bool flag() const;
  [[nodiscard]] std::string text() const;
  [[nodiscard]] std::vector<double> numbers() const;
  [[nodiscard]] bool is(const std::string& text) const;  ///< A text and this one; nothing is noted.
  /// The index of a text among `names`.
  [[nodiscard]] std::size_t choice(const std::vector<std::string>& names) const;

  /// Notes that something else is required here, or of a key whether it is there or not.
  void refuse(const std::string& required) const;
  void refuse(const std::string& key, const std::string& required) const;

 private:
  JsonPlace(const nlohmann::json* value, std::string path, JsonProblems* problems)
      : value_(value), path_(std::move(path)), problems_(problems) {}
  [[nodiscard]] JsonPlace part(const std::string& key, bool required) const;

  const nlohmann::json* value_;
  std::string path_;
  JsonProblems* problems_;
};

}  // namespace resonid::report
