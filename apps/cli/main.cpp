// SPDX-License-Identifier: MIT
#include <CLI/App.hpp>
#include <cli/program.hpp>
#include <string_view>

#include "provenance.hpp"
#include "verbs.hpp"

int main(int argc, char** argv) {
  using namespace resonid::cli;
  remember_command("resonid", argc, argv);
  if (argc > 1 && std::string_view(argv[1]) == "reproduce") return run_reproduce(argc - 1, argv + 1);
  CLI::App app("Identifies resonating mechanical systems in electric drives.", "resonid");
  app.set_version_flag("--version", "resonid " RESONID_VERSION);
  app.footer("'resonid VERB --help' explains a verb and shows an example.");
  add_excite(app);
  add_simulate(app);
  add_inspect(app);
  add_identify(app);
  add_track(app);
  add_validate(app);
  add_compare(app);
  add_plan(app);
  add_reproduce(app);
  return run_program(app, argc, argv, true);
}
