// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cli/errors.hpp>
#include <cli/help.hpp>
#include <cli/options.hpp>
#include <cli/output.hpp>
#include <cli/profile.hpp>
#include <cli/program.hpp>
#include <cli/progress.hpp>
#include <cli/provenance.hpp>
#include <cli/reproduce_options.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <reproduce/reproduction.hpp>
#include <resonid/io/detail/suggestion.hpp>
#include <resonid/report/detail/document.hpp>
#include <string>
#include <vector>

namespace resonid::cli {
namespace {

std::vector<std::string> known_names() {
  std::vector<std::string> names;
  for (const auto& entry : reproduction::entries()) names.emplace_back(entry.name);
  return names;
}

std::vector<reproduction::Entry> chosen_entries(const std::string& name) {
  const auto& all = reproduction::entries();
  if (name.empty()) return all;
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const reproduction::Entry& e) { return e.name == name; });
  if (found != all.end()) return {*found};
  const auto names = known_names();
  throw UsageError(fmt::format("NAME: found '{}', required one of {}{}", name, fmt::join(names, ", "),
                               io::suggestion(name, names)));
}

/// The command that makes a document, with the option that a copy of it was written by.
std::string command_of(std::string_view name, const ReproduceOptions& o, std::string_view option = {},
                       std::string_view path = {}) {
  const std::string command = fmt::format("resonid reproduce {} --seeds {}", name, o.seeds);
  return option.empty() ? command : fmt::format("{} {} {}", command, option, path);
}

report::Document run_entry(const reproduction::Entry& entry, const ReproduceOptions& o, Progress& progress) {
  progress.stage(fmt::format("running {}", entry.name));
  reproduction::Options options;
  options.seeds = o.seeds;
  options.progress = [&, quarter = 0](double part) mutable {
    if (const int now = static_cast<int>(4.0 * part); now > quarter && now < 4) {
      quarter = now;
      progress.stage(fmt::format("running {}, {} % done", entry.name, 25 * now));
    }
  };
  return entry.run(options);
}

/// The page of an entry below --out.
std::string page_of(const reproduction::Entry& entry, const ReproduceOptions& o) {
  return (std::filesystem::path(o.out) / fmt::format("{}.html", entry.name)).string();
}

void write_documents(const reproduction::Entry& entry, report::Document document, const ReproduceOptions& o) {
  const auto with_command = [&](std::string_view option, const std::string& path) -> const report::Document& {
    document.command = command_of(entry.name, o, option, path);
    document.provenance = provenance_of_files({});
    return document;
  };
  if (!o.out.empty()) write_output(page_of(entry, o), report::document_page(with_command("--out", o.out)));
  if (!o.report.empty()) write_output(o.report, report::document_page(with_command("--report", o.report)));
  if (!o.markdown.empty())
    write_output(o.markdown, report::document_markdown(with_command("--markdown", o.markdown)));
  if (!o.json.empty()) write_json(o.json, report::document_json(with_command("--json", o.json)));
}

void check_options(const ReproduceOptions& o) {
  if (!o.name.empty()) return;
  const std::pair<std::string_view, const std::string*> files[] = {
      {"--report", &o.report}, {"--markdown", &o.markdown}, {"--json", &o.json}};
  for (const auto& [option, path] : files)
    if (!path->empty())
      throw UsageError(fmt::format("{}: required a NAME, one of {}; or --out FOLDER for all", option,
                                   fmt::join(known_names(), ", ")));
}

void run_entries(const ReproduceOptions& o) {
  const bool quiet = no_summary({{"--report", o.report}, {"--markdown", o.markdown}, {"--json", o.json}});
  refuse_shared_files({}, {{"--report", o.report}, {"--markdown", o.markdown}, {"--json", o.json}});
  const auto entries = chosen_entries(o.name);
  check_options(o);
  if (!o.out.empty()) {
    std::error_code failed;
    std::filesystem::create_directories(o.out, failed);
    if (failed) throw std::runtime_error(fmt::format("--out: '{}': {}", o.out, failed.message()));
    for (const auto& entry : entries) refuse_unwritable({page_of(entry, o)});
  }
  refuse_unwritable({o.report, o.markdown, o.json});
  Progress progress;
  std::string separator;
  for (const auto& entry : entries) {
    const auto document = run_entry(entry, o, progress);
    write_documents(entry, document, o);
    if (!quiet) print_text(separator + report::document_text(document, characters_of_text()));
    separator = "\n";
  }
  if (quiet) return;
  if (!o.out.empty()) print(fmt::format("Pages written to {}\n", o.out));
  if (!o.report.empty()) print(fmt::format("Page written to {}\n", o.report));
}

}  // namespace
}  // namespace resonid::cli

int main(int argc, char** argv) {
  using namespace resonid;
  using namespace resonid::cli;
  remember_command("resonid reproduce", argc, argv);
  CLI::App app("Runs published experiments and sets both figures side by side", "resonid reproduce");
  std::string names;
  for (const auto& entry : reproduction::entries()) names += fmt::format("\n{}: {}", entry.name, entry.title);
  app.footer(
      "Example:\n  resonid reproduce iv --report iv.html\n"
      "Names:" +
      names);
  ReproduceOptions o;
  o.seeds = reproduction::Options{}.seeds;
  add_reproduce_options(app, o);
  add_general_options(app);
  add_profile_options(app);  // `resonid` has read it by now
  app.callback([&o] { run_entries(o); });
  return run_program(app, arguments_of(argc, argv), [&app](const std::vector<std::string>& arguments) {
    parse(app, arguments);
    return int{kDone};
  });
}
