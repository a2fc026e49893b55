// SPDX-License-Identifier: MIT
#include <CLI/App.hpp>
#include <algorithm>
#include <cli/program.hpp>
#include <string>

#include "errors.hpp"
#include "help.hpp"
#include "profile.hpp"
#include "provenance.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

void add_verbs(CLI::App& app) {
  app.set_version_flag("-V,--version", "resonid " RESONID_VERSION)->group("General");
  app.require_subcommand(0, 1);  // what follows may be called like a verb: an experiment, a file
  app.footer("'resonid help VERB' explains a verb and shows an example.");
  add_excite(app);
  add_simulate(app);
  add_plan(app);
  add_inspect(app);
  add_identify(app);
  add_track(app);
  add_validate(app);
  add_compare(app);
  add_tune(app);
  add_monitor(app);
  add_demo(app);
  add_reproduce(app);
  add_help(app);
  const auto under = [&app](const char* heading, std::initializer_list<const char*> verbs) {
    for (const char* verb : verbs) app.get_subcommand(verb)->group(heading);
  };
  under("Experiments", {"excite", "simulate", "plan"});
  under("Recordings", {"inspect", "identify", "track", "validate", "compare"});
  under("Control", {"tune"});
  under("Running machines", {"monitor"});
  under("More", {"demo", "reproduce", "help"});
  add_general_options(app);
  add_profile_options(app);
}

/// The verb among the arguments: the first that is neither an option of the program nor what one takes.
std::size_t verb_index(const CLI::App& app, const std::vector<std::string>& arguments) {
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (!arguments[i].starts_with('-')) return i;
    const auto* option = app.get_option_no_throw(arguments[i]);
    if (option != nullptr && takes_value(*option)) ++i;
  }
  return arguments.size();
}

int run_resonid(int argc, char** argv) {
  remember_command("resonid", argc, argv);
  CLI::App app("Identifies resonating mechanical systems in electric drives.", "resonid");
  add_verbs(app);
  auto arguments = arguments_of(argc, argv);
  const auto at = verb_index(app, arguments);
  const std::string verb = at < arguments.size() ? arguments[at] : "";
  if (verb == "help") {
    arguments.erase(arguments.begin() + static_cast<std::ptrdiff_t>(at));
    return run_help(app, arguments);
  }
  return run_program(
      app, arguments,
      [&](const std::vector<std::string>& words) {
        auto all = with_profile(app, words);
        if (verb == "reproduce") {
          all.erase(all.begin() + static_cast<std::ptrdiff_t>(at));
          return run_reproduce(all);
        }
        parse(app, all);
        if (app.get_subcommands().empty()) throw UsageError("a verb is required");
        return int{kDone};
      },
      verb != "monitor");  // which ends in its own way
}

}  // namespace
}  // namespace resonid::cli

int main(int argc, char** argv) { return resonid::cli::run_resonid(argc, argv); }
