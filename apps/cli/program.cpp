// SPDX-License-Identifier: MIT
#ifdef RESONID_SOLVER_LOGS  // not where Ceres was built to be silent
#include <glog/logging.h>
#endif
#include <unistd.h>
#if __has_include(<malloc.h>)
#include <malloc.h>
#endif

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cli/errors.hpp>
#include <cli/help.hpp>
#include <cli/interrupt.hpp>
#include <cli/option_names.hpp>
#include <cli/output.hpp>
#include <cli/profile.hpp>
#include <cli/program.hpp>
#include <cli/terminal.hpp>
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

void complain(const std::string& message, const std::string& hint = {}) {
  tell_profile();
  print_error(painted("resonid:", Paint::bad, STDERR_FILENO) + " " + in_options(message) + "\n" + hint);
}

void print_wrong_use(const CLI::App& app, const std::string& message) {
  complain(message, "See '" + command_of(deepest(app)) + " --help'.\n");
}

/// Before the parser, whose own complaints are coloured too, and whose help is typeset. What makes no sense
/// is left to it.
void settle_output(const std::vector<std::string>& arguments) {
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    std::string when;
    if (arguments[i] == "--ascii") output_settings().ascii = true;
    if (arguments[i].starts_with("--color=")) when = arguments[i].substr(arguments[i].find('=') + 1);
    if (arguments[i] == "--color" && i + 1 < arguments.size()) when = arguments[i + 1];
    if (when == "always") output_settings().colour = When::always;
    if (when == "never") output_settings().colour = When::never;
  }
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

std::vector<std::string> arguments_of(int argc, char** argv) {
  return {argv + std::min(argc, 1), argv + argc};
}

void parse(CLI::App& app, const std::vector<std::string>& arguments) {
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  app.parse(std::move(reversed));
}

int run_program(CLI::App& app, const std::vector<std::string>& arguments,
                const std::function<int(const std::vector<std::string>&)>& run, bool ends_on_signals) {
  keep_memory();
  quieten_solver();
  settle_output(arguments);
  if (ends_on_signals) end_on_signals();
  try {
    const int code = run(arguments);
    tell_profile();
    return code;
  } catch (const CLI::ExtrasError&) {
    print_wrong_use(app, unknown_argument(app));
  } catch (const CLI::CallForAllHelp&) {
    print_text(app.help("", CLI::AppFormatMode::All));
    return kDone;
  } catch (const CLI::CallForHelp&) {
    print_text(app.help());
    return kDone;
  } catch (const CLI::CallForVersion& version) {
    print(std::string(version.what()) + "\n");
    return kDone;
  } catch (const CLI::ParseError& error) {
    print_wrong_use(app, error.what());
  } catch (const UsageError& error) {
    print_wrong_use(app, error.what() + profile_place(error.what()));
  } catch (const InputError& error) {
    complain(error.what());
  } catch (const ToldError&) {
    tell_profile();
  } catch (const NotTrustedError& error) {
    complain(error.what());
    return kNotTrusted;
  } catch (const InterruptedError& error) {
    return ended_by(error.signal);
  } catch (const std::exception& error) {
    complain(error.what());
    return kFailed;
  }
  return kWrongUse;
}

}  // namespace resonid::cli
