// SPDX-License-Identifier: MIT
#include "help.hpp"

#include <unistd.h>

#include <algorithm>
#include <memory>

#include "options.hpp"
#include "terminal.hpp"

namespace resonid::cli {
namespace {

constexpr const char* kGeneral = "General";
constexpr std::size_t kFormColumns = 28;     // of an option, before what it does
constexpr std::size_t kNarrowTerminal = 60;  // below it the two stand below one another

bool is_listed(const CLI::Option& option) { return !option.get_group().empty(); }

bool may_end_not_trusted(const CLI::App& verb) {
  const auto options = verb.get_options();
  return std::any_of(options.begin(), options.end(), [](const CLI::Option* option) {
    return option->get_name(false, true).starts_with("--require-");
  });
}

std::string heading(std::string_view text) { return painted(text, Paint::bold, STDOUT_FILENO) + "\n"; }

/// A form, and beside it, or below a long one, what it means.
std::string entry(const std::string& form, const std::string& meaning, std::size_t width) {
  if (meaning.empty()) return "  " + form + "\n";
  const bool narrow = width < kNarrowTerminal;
  const std::string indent(narrow ? 6 : kFormColumns, ' ');
  const std::string begin = "  " + form;
  if (narrow || columns_of(begin) + 2 > kFormColumns)
    return begin + "\n" + wrapped(meaning, width, indent, indent);
  return wrapped(meaning, width, begin + std::string(kFormColumns - columns_of(begin), ' '), indent);
}

/// A command as it can be pasted: lines that go on end with a backslash, options stay with what they take.
std::string command_lines(std::string command, std::size_t width) {
  constexpr char kTogether = '\x1f';
  for (std::size_t from = command.find(" --"); from != std::string::npos; from = command.find(" --", from)) {
    from = command.find(' ', from + 1);
    if (from != std::string::npos && command[from + 1] != '-') command[from] = kTogether;
  }
  std::string text = wrapped(command, width, "  ", "      ", " \\");
  std::replace(text.begin(), text.end(), kTogether, ' ');
  return text;
}

std::string usage_of(const CLI::App& verb, std::size_t width) {
  return wrapped("Usage: " + command_of(verb) + " " + operands_of(verb), width, "", "    ");
}

std::string title(const CLI::App& verb, std::size_t width) {
  const auto& text = verb.get_description();
  return text.empty() ? "" : wrapped(text + (text.ends_with('.') ? "" : "."), width, "", "") + "\n";
}

std::string verbs_text(const CLI::App& app, std::size_t width) {
  std::string text, group;
  for (const auto* verb : listed_verbs(app)) {
    if (verb->get_group() != group) {
      group = verb->get_group();
      text += "\n" + heading(group + ":");
    }
    text += entry(verb->get_name(), verb->get_description(), width);
  }
  return text;
}

std::string examples_text(const CLI::App& verb, std::size_t width) {
  std::string text;
  for (const auto& line : footer_of(verb))
    text += line.command ? command_lines(line.text, width) : wrapped(line.text, width, "", "");
  return text.empty() ? text : "\n" + text;
}

std::string long_help(const CLI::App& verb, std::size_t width) {
  std::string text = title(verb, width) + usage_of(verb, width);
  if (const auto arguments = options_of(verb, {}); !arguments.empty()) {
    text += "\n" + heading("Arguments:");
    for (const auto* option : arguments) text += entry(form_of(*option), meaning_of(*option), width);
  }
  text += verbs_text(verb, width);
  for (const auto& group : listed_groups(verb)) {
    text += "\n" + heading(group + ":");
    for (const auto* option : options_of(verb, group))
      text += entry(form_of(*option), meaning_of(*option), width);
  }
  text += examples_text(verb, width) + "\n" + heading("Exit codes:");
  for (const auto& exit : exit_codes_of(verb))
    text += entry(std::string(exit.code), std::string(exit.meaning), width);
  return text;
}

std::string short_help(const CLI::App& verb, std::size_t width) {
  std::string text = title(verb, width) + usage_of(verb, width) + verbs_text(verb, width);
  for (const auto* option : options_of(verb, {})) text += entry(form_of(*option), meaning_of(*option), width);
  text += "\n";
  for (const auto& group : listed_groups(verb)) {
    std::string names;
    for (const auto* option : options_of(verb, group))
      names += (names.empty() ? "" : ", ") + option->get_name(false, true);
    std::replace(names.begin(), names.end(), ',', ' ');
    text += entry(group, names, width);
  }
  const auto lines = footer_of(verb);
  const auto example =
      std::find_if(lines.begin(), lines.end(), [](const FooterLine& line) { return line.command; });
  if (example != lines.end()) text += "\nExample:\n" + command_lines(example->text, width);
  return text + "\n" + wrapped("'" + command_of(verb) + " --help' explains them.", width, "", "");
}

}  // namespace

std::string command_of(const CLI::App& verb) {
  std::string name;
  for (const CLI::App* app = &verb; app != nullptr; app = app->get_parent())
    name = app->get_name() + (name.empty() ? "" : " " + name);
  return name;
}

std::vector<std::string> listed_groups(const CLI::App& verb) {
  std::vector<std::string> groups;
  bool general = false;
  for (const auto* option : verb.get_options([](const CLI::Option* o) { return o->nonpositional(); })) {
    const auto& group = option->get_group();
    if (group == kGeneral) general = true;
    if (group.empty() || group == kGeneral) continue;
    if (std::find(groups.begin(), groups.end(), group) == groups.end()) groups.push_back(group);
  }
  if (general) groups.emplace_back(kGeneral);
  return groups;
}

std::vector<const CLI::Option*> options_of(const CLI::App& verb, const std::string& group) {
  return verb.get_options([&](const CLI::Option* option) {
    return group.empty() ? option->get_positional() && is_listed(*option)
                         : option->nonpositional() && option->get_group() == group;
  });
}

std::vector<const CLI::App*> listed_verbs(const CLI::App& app) {
  auto verbs = app.get_subcommands([](const CLI::App* verb) { return !verb->get_group().empty(); });
  std::vector<std::string> groups;  // in the order in which they come up
  for (const auto* verb : verbs)
    if (std::find(groups.begin(), groups.end(), verb->get_group()) == groups.end())
      groups.push_back(verb->get_group());
  const auto place = [&](const CLI::App* verb) {
    return std::find(groups.begin(), groups.end(), verb->get_group()) - groups.begin();
  };
  std::stable_sort(verbs.begin(), verbs.end(),
                   [&](const CLI::App* a, const CLI::App* b) { return place(a) < place(b); });
  return verbs;
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

std::string form_of(const CLI::Option& option) {
  std::string form;
  if (option.get_positional()) {
    form = option.get_name(true, false);
    if (option.get_expected_max() > 1) form += " ...";
    return form;
  }
  for (const auto& name : option.get_snames()) form += (form.empty() ? "-" : ", -") + name;
  for (const auto& name : option.get_lnames()) form += (form.empty() ? "--" : ", --") + name;
  if (takes_value(option) && !option.get_type_name().empty()) form += " " + option.get_type_name();
  return form;
}

std::string meaning_of(const CLI::Option& option) {
  std::string text = option.get_description();
  if (takes_value(option) && !option.get_default_str().empty())
    text += "; default " + option.get_default_str();
  if (const auto others = option.get_excludes(); !others.empty()) {
    std::vector<std::string> names;
    for (const auto* other : others) names.push_back(other->get_name());
    std::sort(names.begin(), names.end());
    for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "; not with " : ", ") + names[i];
  }
  return text;
}

std::string operands_of(const CLI::App& verb) {
  std::string text;
  if (!listed_verbs(verb).empty()) text += verb.get_parent() == nullptr ? "VERB " : "KIND ";
  for (const auto* option : options_of(verb, {})) {
    std::string name = option->get_name(true, false) + (option->get_expected_max() > 1 ? "..." : "");
    if (!option->get_required()) name = "[" + name + "]";
    text += name + " ";
  }
  return text + "[OPTIONS]";
}

std::vector<FooterLine> footer_of(const CLI::App& verb) {
  std::vector<FooterLine> lines;
  const std::string footer = verb.get_footer();
  for (std::size_t from = 0; from < footer.size();) {
    const auto end = std::min(footer.find('\n', from), footer.size());
    const std::string line = footer.substr(from, end - from);
    from = end + 1;
    const auto indent = std::min(line.find_first_not_of(' '), line.size());
    if (indent == line.size()) continue;
    if (indent > 2 && !lines.empty() && lines.back().command)
      lines.back().text += " " + line.substr(indent);
    else
      lines.push_back({indent >= 2, line.substr(indent)});
  }
  return lines;
}

std::vector<ExitCodeText> exit_codes_of(const CLI::App& verb) {
  std::vector<ExitCodeText> codes = {
      {"0", "done"},
      {"1", "anything that has no code of its own"},
      {"2", "wrong usage, or input that cannot be read; the message names option or file, line and column"},
  };
  if (may_end_not_trusted(verb))
    codes.push_back({"3", "not trusted, where a --require option asks for trust"});
  codes.push_back({"130", "interrupted"});
  return codes;
}

std::string HelpFormatter::make_help(const CLI::App* app, std::string, CLI::AppFormatMode mode) const {
  return mode == CLI::AppFormatMode::All ? long_help(*app, text_width()) : short_help(*app, text_width());
}

void add_summary_options(CLI::App& verb) {
  verb.option_defaults()->group("Results");
  verb.add_flag("--brief", output_settings().brief,
                "only the verdict, the key figures and what speaks against them");
}

void add_general_options(CLI::App& app) {
  auto& settings = output_settings();
  app.option_defaults()->group(kGeneral);
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_help_flag("-h", "short help");
  app.set_help_all_flag("--help", "all options with what they do, examples and exit codes");
  app.add_flag("-q,--quiet", settings.quiet, "say nothing but errors");
  app.add_flag("-v,--verbose", settings.verbose, "report every stage with the elapsed time");
  constexpr std::string_view kWhen[] = {"auto", "always", "never"};
  add_choice(
      app, "--color", kWhen, [&settings](std::size_t i) { settings.colour = static_cast<When>(i); },
      "colour of verdicts and errors; auto: on a terminal, unless NO_COLOR is set")
      ->type_name("WHEN")
      ->default_str("auto");
  app.add_flag("--ascii", settings.ascii, "texts in ASCII ('+-', 'kg m2'), as where the locale is not UTF-8");
  for (auto* verb : app.get_subcommands({})) add_general_options(*verb);
}

}  // namespace resonid::cli
