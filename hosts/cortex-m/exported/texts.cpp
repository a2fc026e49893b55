// SPDX-License-Identifier: MIT
// cortex_texts FOLDER: writes designs of control as C texts and what compiles them (exported.h), and prints
// the torque that each has to give: "torque NAME VALUE" per sample, by the law's definition, without the
// texts.
#include <fmt/format.h>

#include <exported_laws.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>

namespace {

using resonid::design::CNumber;
using resonid::design::ExportedController;
using namespace resonid::test;

/// Every variant in double and float, with a name of its own.
std::vector<std::pair<ExportedController, CNumber>> texts() {
  std::vector<ExportedController> variants = exported_variants();
  for (const ExportedController& variant : position_variants()) variants.push_back(variant);
  std::vector<std::pair<ExportedController, CNumber>> all;
  for (std::size_t i = 0; i < variants.size(); ++i)
    for (const CNumber number : {CNumber::in_double, CNumber::in_float}) {
      variants[i].name = fmt::format("law_{}_{}", i, number == CNumber::in_float ? "float" : "double");
      all.emplace_back(variants[i], number);
    }
  return all;
}

/// A state and two functions that give the texts one interface. The values that are told are all those of
/// columns_of(), whatever the controller takes of them.
std::string wrapped(const ExportedController& exported, CNumber number) {
  std::string arguments;
  for (const Column& column : columns_of(exported))
    for (std::size_t i = 0; i < std::size(kAllColumns); ++i)
      if (column.value == kAllColumns[i])
        arguments += fmt::format(", ({})told[{}]", number == CNumber::in_float ? "float" : "double", i);
  return fmt::format(
      "static {0} state_of_{0};\n"
      "static void init_{0}(void) {{ {0}_init(&state_of_{0}); }}\n"
      "static double step_{0}(const double* told) {{ return (double){0}_step(&state_of_{0}{1}); }}\n",
      exported.name, arguments);
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
  std::string source = "#include \"exported.h\"\n", table;
  int controllers = 0;
  for (const auto& [exported, number] : texts()) {
    const auto text = to_c(exported, number);
    if (!text || !write(folder / (exported.name + ".h"), *text)) return 1;
    source += fmt::format("#include \"{}.h\"\n", exported.name) + wrapped(exported, number);
    table += fmt::format("  {{\"{0}\", init_{0}, step_{0}}},\n", exported.name);
    ++controllers;
    for (const double torque : by_definition(exported))
      std::cout << fmt::format("torque {} {:.17g}\n", exported.name, torque);
  }
  source += fmt::format(
      "const int exported_count = {};\nconst exported_controller exported_controllers[] = {{\n{}}};\n",
      controllers, table);
  return write(folder / "exported.c", source + told()) ? 0 : 1;
}
