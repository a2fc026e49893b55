// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <resonid/report/json.hpp>

#include "report/json/files.hpp"

namespace resonid::report {
namespace {

using nlohmann::json;

/// "resonid.identification/1" -> "identification"
std::string short_name(const std::string& schema) {
  const auto from = schema.find('.') + 1;
  return schema.substr(from, schema.find('/') - from);
}

json number_of(Range range) {
  json j{{"type", "number"}};
  if (range == positive) j["exclusiveMinimum"] = 0;
  if (range == not_negative) j["minimum"] = 0;
  return j;
}

json array_of(json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

/// The schemas of files that stand in another one.
using Definitions = std::map<std::string, json>;

json object_of(const Sketch& s, Definitions& definitions);

json schema_of(const Sketch& s, Definitions& definitions) {
  if (s.type == "number") return number_of(s.range);
  if (s.type == "count") return {{"type", "integer"}, {"minimum", 0}};
  if (s.type == "choice") return {{"type", "string"}, {"enum", s.names}};
  if (s.type == "numbers") return array_of(number_of(s.range));
  if (s.type == "rows") return array_of({{"type", {"number", "null"}}});
  if (s.type == "matrix") return array_of(array_of(number_of(s.range)));
  if (s.type == "list") return array_of(object_of(s, definitions));
  if (s.type == "object") return object_of(s, definitions);
  if (s.type.ends_with('s')) return array_of({{"type", s.type.substr(0, s.type.size() - 1)}});
  return {{"type", s.type}};
}

json described(const Sketch& s, Definitions& definitions) {
  json j = schema_of(s, definitions);
  j["description"] = s.meaning;
  if (!s.unit.empty()) j["unit"] = s.unit;
  return j;
}

void put_parts(const std::vector<Sketch>& parts, json& to, Definitions& definitions) {
  for (const auto& part : parts) {
    if (part.name == "*") {
      to["additionalProperties"] = described(part, definitions);
      continue;
    }
    to["properties"][part.name] = described(part, definitions);
    if (part.presence == Presence::required) to["required"].push_back(part.name);
  }
}

json own_schema(const Sketch& s, Definitions& definitions) {
  json j{{"type", "object"}};
  if (!s.schema.empty()) {
    j["properties"]["schema"] = {{"const", s.schema}, {"description", "name and version of the format"}};
    j["required"].push_back("schema");
  }
  put_parts(s.parts, j, definitions);
  for (const auto& kind : s.kinds) {
    if (!kind.empty() && kind.front().type == "file") {
      j["anyOf"].push_back(object_of(kind.front(), definitions));
      continue;
    }
    json k = json::object();
    put_parts(kind, k, definitions);
    j["anyOf"].push_back(std::move(k));
  }
  return j;
}

json object_of(const Sketch& s, Definitions& definitions) {
  if (s.schema.empty()) return own_schema(s, definitions);
  const std::string name = short_name(s.schema);
  if (!definitions.contains(name)) {
    definitions[name] = {};
    definitions[name] = own_schema(sketch(result_file(name).description), definitions);
  }
  return {{"$ref", "#/$defs/" + name}};
}

const char* type_text(const Sketch& s) {
  static const std::map<std::string, const char*, std::less<>> kTexts = {{"number", "number"},
                                                                         {"integer", "whole number"},
                                                                         {"count", "whole number >= 0"},
                                                                         {"boolean", "true, false"},
                                                                         {"string", "text"},
                                                                         {"numbers", "numbers"},
                                                                         {"integers", "whole numbers"},
                                                                         {"booleans", "true, false per row"},
                                                                         {"strings", "texts"},
                                                                         {"matrix", "rows of numbers"},
                                                                         {"rows", "numbers or null"},
                                                                         {"list", "list of objects"},
                                                                         {"object", "object"}};
  const auto found = kTexts.find(s.type);
  return found == kTexts.end() ? "" : found->second;
}

std::string type_cell(const Sketch& s) {
  std::string text;
  for (const auto& name : s.names) text += fmt::format("{}`\"{}\"`", text.empty() ? "" : ", ", name);
  if (s.names.empty()) text = type_text(s);
  if (s.type == "number" || s.type == "numbers") {
    if (s.range == positive) text += " > 0";
    if (s.range == not_negative) text += " >= 0";
  }
  return text;
}

std::string escaped(std::string text) {
  for (std::size_t i = text.find('|'); i != std::string::npos; i = text.find('|', i + 2))
    text.insert(i, "\\");
  return text;
}

void put_rows(const std::vector<Sketch>& parts, const std::string& path, std::string& text);

void put_row(const Sketch& s, const std::string& path, std::string& text) {
  if (s.type == "file") {
    text += fmt::format("| | | | | all of `{}` |\n", s.schema);
    return;
  }
  const std::string name = path + (s.name == "*" ? "NAME" : s.name) + (s.type == "list" ? "[]" : "");
  const bool file = !s.schema.empty();
  text += fmt::format("| `{}` | {} | {} | {} | {} |\n", name, type_cell(s),
                      s.unit == "unit" ? "`unit`" : s.unit, name_of(s.presence),
                      escaped(s.meaning) + (file ? fmt::format(": all of `{}`", s.schema) : ""));
  if (file) return;
  put_rows(s.parts, name + ".", text);
  for (const auto& kind : s.kinds) put_rows(kind, name + ".", text);
}

void put_rows(const std::vector<Sketch>& parts, const std::string& path, std::string& text) {
  for (const auto& part : parts) put_row(part, path, text);
}

}  // namespace

json json_schema(std::string_view kind) {
  const auto& file = result_file(kind);
  Sketch root = sketch(file.description);
  const std::string schema = root.schema;
  root.schema.clear();
  Definitions definitions;
  json j = own_schema(root, definitions);
  j["properties"]["schema"] = {{"const", schema}, {"description", "name and version of the format"}};
  j["required"].push_back("schema");
  j["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  j["title"] = schema;
  j["description"] = file.made_by;
  for (auto& [part, definition] : definitions) j["$defs"][part] = std::move(definition);
  return j;
}

std::string results_document() {
  std::string text(kResultsIntroduction);
  for (const auto& file : result_files()) {
    const Sketch root = sketch(file.description);
    text += fmt::format("\n## {}\n\n{}. Schema: [{}.json](schema/{}.json).\n\n", root.schema, file.made_by,
                        file.name, file.name);
    text += "| key | type | unit | there | meaning |\n|---|---|---|---|---|\n";
    put_rows(root.parts, "", text);
  }
  return text;
}

}  // namespace resonid::report
