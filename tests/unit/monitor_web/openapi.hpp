// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

namespace resonid::monitor::web::test {

/// The description of the API, and what of OpenAPI's schemas it uses.
class OpenApi {
 public:
  OpenApi() : document(nlohmann::json::parse(std::ifstream(RESONID_OPENAPI))) {}

  /// What an answer has that its description does not say, or the other way round; empty: all is right.
  [[nodiscard]] std::string faults(const std::string& method, const std::string& path, int status,
                                   const std::string& content_type, const std::string& body) const {
    const auto* const operation = find(method, path);
    if (operation == nullptr) return method + " " + path + " is not described";
    const auto responses = operation->at("responses");
    const auto code = std::to_string(status);
    if (!responses.contains(code)) return "status " + code + " is not described";
    const auto& content = resolved(responses.at(code)).at("content");
    const auto type = content_type.substr(0, content_type.find(';'));
    if (!content.contains(type)) return "content type " + type + " is not described";
    if (type != "application/json") return {};
    const auto value = nlohmann::json::parse(body, nullptr, false);
    return value.is_discarded() ? "no JSON: " + body
                                : differs(value, content.at(type).at("schema"), "answer");
  }

  /// Where a value is not of a schema; empty: it is.
  [[nodiscard]] std::string differs(const nlohmann::json& value, const nlohmann::json& given,
                                    const std::string& where) const {
    const auto& schema = resolved(given);
    if (schema.contains("oneOf")) {
      std::string all;
      for (const auto& one : schema.at("oneOf")) {
        const auto fault = differs(value, one, where);
        if (fault.empty()) return {};
        all += fault + "; ";
      }
      return all;
    }
    if (value.is_null() && schema.value("nullable", false)) return {};
    const std::string type = schema.at("type");
    const bool right = type == "object"    ? value.is_object()
                       : type == "array"   ? value.is_array()
                       : type == "string"  ? value.is_string()
                       : type == "boolean" ? value.is_boolean()
                       : type == "integer" ? value.is_number_integer()
                                           : value.is_number();
    if (!right) return where + " is no " + type;
    if (schema.contains("enum") &&
        schema.at("enum").end() == std::find(schema.at("enum").begin(), schema.at("enum").end(), value))
      return where + " is none of the values: " + value.dump();
    if (schema.contains("minimum") && value < schema.at("minimum")) return where + " is too small";
    if (type == "array")
      for (std::size_t i = 0; i < value.size(); ++i)
        if (auto fault = differs(value[i], schema.at("items"), where + "[" + std::to_string(i) + "]");
            !fault.empty())
          return fault;
    if (type != "object") return {};
    for (const auto& name : schema.value("required", nlohmann::json::array()))
      if (!value.contains(name.get<std::string>())) return where + " lacks " + name.get<std::string>();
    const auto properties = schema.value("properties", nlohmann::json::object());
    const auto others = schema.at("additionalProperties");
    for (const auto& [name, part] : value.items()) {
      if (!properties.contains(name) && others == false) return where + "." + name + " is not described";
      const auto fault =
          differs(part, properties.contains(name) ? properties.at(name) : others, where + "." + name);
      if (!fault.empty()) return fault;
    }
    return {};
  }

  [[nodiscard]] const nlohmann::json& schema(const std::string& name) const {
    return document.at("components").at("schemas").at(name);
  }

  nlohmann::json document;

 private:
  /// {name} stands for one part of a path.
  static bool is_of(std::string path, std::string pattern) {
    for (auto open = pattern.find('{'); open != std::string::npos; open = pattern.find('{', open + 1)) {
      const auto end = path.find('/', open);
      if (path.size() <= open || end == open) return false;
      path.replace(open, std::min(end, path.size()) - open, "{}");
      pattern.replace(open, pattern.find('}', open) + 1 - open, "{}");
    }
    return path == pattern;
  }
  [[nodiscard]] const nlohmann::json& resolved(const nlohmann::json& part) const {
    if (!part.contains("$ref")) return part;
    return document.at(nlohmann::json::json_pointer(part.at("$ref").get<std::string>().substr(1)));
  }
  [[nodiscard]] const nlohmann::json* find(const std::string& method, const std::string& path) const {
    for (const auto& [pattern, operations] : document.at("paths").items())
      if (is_of(path, pattern) && operations.contains(method)) return &operations.at(method);
    return nullptr;
  }
};

}  // namespace resonid::monitor::web::test
