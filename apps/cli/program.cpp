// SPDX-License-Identifier: MIT
#ifdef RESONID_SOLVER_LOGS  // not where Ceres was built to be silent
#include <glog/logging.h>
#endif
#if __has_include(<malloc.h>)
#include <malloc.h>
#endif

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cli/errors.hpp>
#include <cli/option_names.hpp>
#include <cli/output.hpp>
#include <cli/program.hpp>
#include <exception>
#include <resonid/io/detail/suggestion.hpp>
#include <string>
#include <vector>

namespace resonid::cli {
namespace {

/// The verb (or kind) that the command line got to.
const CLI::App& deepest(const CLI::App& app) {
  const auto parsed = app.get_subcommands();
  return parsed.empty() ? app : deepest(*parsed.front());
}

std::string unknown_argument(const CLI::App& app) {
  const CLI::App& verb = deepest(app);
  const auto extras = app.remaining(true);
  const std::string found = extras.empty() ? std::string() : extras.front();
  const std::string word = found.substr(0, found.find('='));
  std::vector<std::string> names;
  for (const auto* option : verb.get_options())
    for (const auto& name : option->get_lnames()) names.push_back("--" + name);
  if (word.rfind('-', 0) != 0) names.clear();
  for (const auto* sub : verb.get_subcommands({})) names.push_back(sub->get_name());
  const bool option = word.rfind('-', 0) == 0;
  const bool chooses = !option && !verb.get_subcommands({}).empty();
  const std::string what = option ? "option" : chooses ? "verb or kind" : "argument";
  return "unknown " + what + " '" + word + "'" + io::suggestion(word, names);
}

void print_wrong_use(const CLI::App& app, const std::string& message) {
  std::string name;
  for (const CLI::App* verb = &deepest(app); verb != nullptr; verb = verb->get_parent())
    name = verb->get_name() + (name.empty() ? "" : " " + name);
  print_error("resonid: " + in_options(message) + "\nSee '" + name + " --help'.\n");
}

/// Matrices come and go by the thousand; to give their pages back each time takes a fifth of some searches.
void keep_memory() {
#ifdef __GLIBC__
  constexpr int kMebibyte = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 8 * kMebibyte);
  mallopt(M_TRIM_THRESHOLD, 64 * kMebibyte);
#endif
}

/// Steps that the solver of the fits takes back itself are no business of the user's.
void quieten_solver() {
#ifdef RESONID_SOLVER_LOGS
  FLAGS_minloglevel = google::GLOG_FATAL;
#endif
}

}  // namespace

int run_program(CLI::App& app, int argc, char** argv, bool needs_verb) {
  keep_memory();
  quieten_solver();
  try {
    app.parse(argc, argv);
    if (needs_verb && app.get_subcommands().empty()) throw UsageError("a verb is required");
    return kDone;
  } catch (const CLI::ExtrasError&) {
    print_wrong_use(app, unknown_argument(app));
  } catch (const CLI::Success& request) {  // --help, --version
    return app.exit(request);
  } catch (const CLI::ParseError& error) {
    print_wrong_use(app, error.what());
  } catch (const UsageError& error) {
    print_wrong_use(app, error.what());
  } catch (const InputError& error) {
    print_error("resonid: " + in_options(error.what()) + "\n");
  } catch (const NotTrustedError& error) {
    print_error("resonid: " + in_options(error.what()) + "\n");
    return kNotTrusted;
  } catch (const std::exception& error) {
    print_error("resonid: " + in_options(error.what()) + "\n");
    return kFailed;
  }
  return kWrongUse;
}

}  // namespace resonid::cli
