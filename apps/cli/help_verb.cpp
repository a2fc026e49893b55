// SPDX-License-Identifier: MIT
#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <algorithm>
#include <array>
#include <cli/program.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <resonid/io/detail/suggestion.hpp>
#include <span>
#include <utility>

#include "completion.hpp"
#include "errors.hpp"
#include "help.hpp"
#include "help_findings.hpp"
#include "man_page.hpp"
#include "options.hpp"
#include "output.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

constexpr std::array<std::string_view, 3> kShells = {"bash", "zsh", "fish"};

struct HelpOptions {
  std::vector<std::string> words;
  std::optional<std::size_t> shell;
  bool man = false;
  std::string install;
};

void add_help_options(CLI::App& verb, HelpOptions& o) {
  verb.footer(
      "Examples:\n"
      "  resonid help identify\n"
      "  resonid help excite chirp\n"
      "  resonid help low-coherence\n"
      "  resonid help --completion bash > ~/.local/share/bash-completion/completions/resonid\n"
      "  resonid help --man identify | man -l -");
  verb.option_defaults()->group("Output");
  verb.add_option(
          "VERB", o.words,
          "verb, and kind of a verb; id of a finding, or findings for all of them; the program without one")
      ->type_name("WORD");
  add_choice(
      verb, "--completion", kShells, [&o](std::size_t i) { o.shell = i; },
      "print the script that completes verbs, options and names in this shell")
      ->type_name("SHELL");
  verb.add_flag("--man", o.man, "print the man page");
  verb.add_option("--install-files", o.install, "write completions and man pages as share/ of this folder")
      ->type_name("FOLDER")
      ->group("");  // for the build
}

const CLI::App& named_verb(const CLI::App& app, std::span<const std::string> words) {
  if (words.empty()) return app;
  std::vector<std::string> names;
  for (const auto* verb : listed_verbs(app)) {
    if (verb->get_name() == words.front()) return named_verb(*verb, words.subspan(1));
    names.push_back(verb->get_name());
  }
  throw UsageError("help: found '" + words.front() + "', which is no verb or kind of '" + command_of(app) +
                   "' and no finding" + io::suggestion(words.front(), names));
}

std::string completion_for(const CLI::App& app, std::size_t shell) {
  return shell == 0 ? bash_completion(app) : shell == 1 ? zsh_completion(app) : fish_completion(app);
}

void write_man_pages(const CLI::App& app, const std::filesystem::path& folder) {
  write_output((folder / (man_page_name(app) + ".1")).string(), man_page(app));
  for (const auto* verb : listed_verbs(app)) write_man_pages(*verb, folder);
}

/// Where shells and man look for them below a prefix.
void install_files(const CLI::App& app, const std::filesystem::path& prefix) {
  constexpr std::array<std::pair<std::string_view, std::size_t>, 4> kScripts = {
      {{"share/bash-completion/completions/resonid", 0},
       {"share/zsh/site-functions/_resonid", 1},
       {"share/zsh/vendor-completions/_resonid", 1},  // Debian's own packages
       {"share/fish/vendor_completions.d/resonid.fish", 2}}};
  const auto man = prefix / "share/man/man1";
  std::filesystem::create_directories(man);
  write_man_pages(app, man);
  for (const auto& [name, shell] : kScripts) {
    const auto file = prefix / name;
    std::filesystem::create_directories(file.parent_path());
    write_output(file.string(), completion_for(app, shell));
  }
}

/// Whether the words ask about findings; then they are explained.
bool explains_finding(const HelpOptions& o) {
  if (o.words.size() != 1 || o.shell || o.man || !o.install.empty()) return false;
  if (o.words.front() == "findings") {
    print(findings_page());
    return true;
  }
  const auto text = finding_text(o.words.front());
  if (text) print_text(*text);
  return text.has_value();
}

int explain(const CLI::App& app, const HelpOptions& o) {
  if (explains_finding(o)) return kDone;
  const auto& verb = named_verb(app, o.words);
  if (!o.install.empty())
    install_files(app, o.install);
  else if (o.shell)
    print(completion_for(app, *o.shell));
  else if (o.man)
    print(man_page(verb));
  else if (command_of(verb) == "resonid reproduce")  // which knows its experiments
    return run_reproduce({"--help"});
  else
    print_text(HelpFormatter().make_help(&verb, "", CLI::AppFormatMode::All));
  return kDone;
}

}  // namespace

void add_help(CLI::App& app) {
  auto* verb = app.add_subcommand("help", "Explains a verb, completes command lines, makes man pages");
  const auto o = std::make_shared<HelpOptions>();
  add_help_options(*verb, *o);
  verb->callback([o] {});  // keeps what the options point to
}

int run_help(const CLI::App& app, const std::vector<std::string>& arguments) {
  CLI::App help("Explains a verb, completes command lines, makes man pages", "resonid help");
  HelpOptions o;
  add_help_options(help, o);
  add_general_options(help);
  return run_program(help, arguments, [&](const std::vector<std::string>& words) {
    parse(help, words);
    return explain(app, o);
  });
}

}  // namespace resonid::cli
