// SPDX-License-Identifier: MIT
// cortex_texts FOLDER: writes designs of control as C texts and what compiles them (exported.h), and prints
// the torque that each has to give: "torque NAME VALUE" per sample, by the law's definition, without the
// texts.
#include <fmt/format.h>

#include <exported_laws.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <type_traits>

namespace {

using resonid::design::CNumber;
using resonid::design::ExportedController;
using namespace resonid::test;

struct Text {
  std::string name, text;
  CNumber number = CNumber::in_double;
  std::vector<Column> columns;  ///< Its arguments.
  std::vector<double> torque;   ///< Wanted.
};

/// Every variant in double and float, with a name of its own; nothing where a text is refused.
std::optional<std::vector<Text>> texts() {
  std::vector<Text> all;
  bool written = true;
  const auto add = [&](auto law, const std::vector<Column>& columns, const std::vector<double>& torque) {
    const std::size_t variant = all.size() / 2;
    for (const CNumber number : {CNumber::in_double, CNumber::in_float}) {
      law.name = fmt::format("{}_{}_{}", std::is_same_v<decltype(law), ExportedController> ? "law" : "rst",
                             variant, number == CNumber::in_float ? "float" : "double");
      const auto text = to_c(law, number);
      written = written && text.has_value();
      all.push_back({law.name, text.value_or(""), number, columns, torque});
    }
  };
  for (const auto& variants : {exported_variants(), position_variants()})
    for (const ExportedController& law : variants) add(law, columns_of(law), by_definition(law));
  std::vector<Sample> samples;
  for (const Told& told : told_samples()) samples.push_back({told.reference, told.velocity});
  for (const RstVariant& variant : rst_variants())
    add(variant.law, {{"reference", &Told::reference}, {"velocity", &Told::velocity}},
        by_definition(variant, samples));
  if (!written) return std::nullopt;
  return all;
}

/// A state and two functions that give the texts one interface. The values that are told are all those of
/// kAllColumns, whatever the controller takes of them.
std::string wrapped(const Text& text) {
  std::string arguments;
  for (const Column& column : text.columns)
    for (std::size_t i = 0; i < std::size(kAllColumns); ++i)
      if (column.value == kAllColumns[i])
        arguments += fmt::format(", ({})told[{}]", text.number == CNumber::in_float ? "float" : "double", i);
  return fmt::format(
      "static {0} state_of_{0};\n"
      "static void init_{0}(void) {{ {0}_init(&state_of_{0}); }}\n"
      "static double step_{0}(const double* told) {{ return (double){0}_step(&state_of_{0}{1}); }}\n",
      text.name, arguments);
}

bool write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  return static_cast<bool>(out.flush());
}

std::string told() {
  std::string rows;
  const auto samples = told_samples();
  for (const Told& sample : samples) {
    rows += "  {";
    for (const auto value : kAllColumns) rows += fmt::format("{:.17g}, ", sample.*value);
    rows += "},\n";
  }
  return fmt::format(
      "const int exported_samples = {};\nconst double exported_told[][kToldValues] = {{\n{}}};\n",
      samples.size(), rows);
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) return 2;
  const std::filesystem::path folder = arguments[1];
  std::filesystem::create_directories(folder);
  const auto all = texts();
  if (!all) return 1;
  std::string source = "#include \"exported.h\"\n", table;
  int controllers = 0;
  for (const Text& text : *all) {
    if (!write(folder / (text.name + ".h"), text.text)) return 1;
    source += fmt::format("#include \"{}.h\"\n", text.name) + wrapped(text);
    table += fmt::format("  {{\"{0}\", init_{0}, step_{0}}},\n", text.name);
    ++controllers;
    for (const double torque : text.torque)
      std::cout << fmt::format("torque {} {:.17g}\n", text.name, torque);
  }
  source += fmt::format(
      "const int exported_count = {};\nconst exported_controller exported_controllers[] = {{\n{}}};\n",
      controllers, table);
  return write(folder / "exported.c", source + told()) ? 0 : 1;
}
