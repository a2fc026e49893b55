// SPDX-License-Identifier: MIT
#include "man_page.hpp"

#include <algorithm>
#include <cctype>

#include "help.hpp"

namespace resonid::cli {
namespace {

/// Text as roff reads it: dashes are those of options, and no line is taken for a request.
std::string roff(std::string_view text) {
  std::string out;
  if (text.starts_with('.') || text.starts_with('\'')) out = "\\&";
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\')
      out += "\\e";
    else if (text[i] == '-')
      out += "\\-";
    else
      out += text[i];
    if (text[i] == ',' && i + 1 < text.size() && text[i + 1] != ' ')
      out += "\\:";  // long words may break here
  }
  return out;
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

std::string entry(std::string_view form, std::string_view meaning) {
  return ".TP\n.B " + roff(form) + "\n" + roff(meaning) + "\n";
}

/// "-q, --quiet" and "--motion NAME": names are bold, what stands behind them is not.
std::string option_entry(const CLI::Option& option) {
  const std::string form = form_of(option);
  if (!takes_value(option) || option.get_type_name().empty()) return entry(form, meaning_of(option));
  const auto names = form.size() - option.get_type_name().size() - 1;
  return ".TP\n\\fB" + roff(form.substr(0, names)) + "\\fR \\fI" + roff(form.substr(names + 1)) + "\\fR\n" +
         roff(meaning_of(option)) + "\n";
}

std::string footer_section(const CLI::App& verb) {
  std::string text;
  bool commands = false;
  for (const auto& line : footer_of(verb)) {
    if (line.command) {
      text += commands ? "" : ".PP\n.nf\n.RS 4\n";
      text += roff(line.text) + "\n";
    } else {
      text += (commands ? ".RE\n.fi\n" : "") + (".PP\n" + roff(line.text)) + "\n";
    }
    commands = line.command;
  }
  if (commands) text += ".RE\n.fi\n";
  return text.empty() ? text : ".SH NOTES AND EXAMPLES\n" + text;
}

std::string see_also(const CLI::App& verb) {
  const CLI::App* program = &verb;
  while (program->get_parent() != nullptr) program = program->get_parent();
  std::vector<std::string> pages;
  if (program != &verb) pages.push_back(man_page_name(*program));
  const CLI::App& around =
      listed_verbs(verb).empty() && verb.get_parent() != nullptr ? *verb.get_parent() : verb;
  for (const auto* other : listed_verbs(around))
    if (other != &verb) pages.push_back(man_page_name(*other));
  if (pages.empty()) return "";
  std::string text = ".SH SEE ALSO\n";
  for (std::size_t i = 0; i < pages.size(); ++i)
    text += ".BR " + roff(pages[i]) + " (1)" + (i + 1 < pages.size() ? "," : "") + "\n";
  return text;
}

constexpr const char* kFilesAndEnvironment =
    ".SH FILES\n"
    ".TP\n.B resonid.toml\nin the current folder: defaults of options, by their names without dashes\n"
    ".SH ENVIRONMENT\n"
    ".TP\n.B NO_COLOR\nif set and not empty, nothing is coloured unless \\-\\-color asks for it\n"
    ".TP\n.B LC_ALL, LC_CTYPE, LANG\nthe first that is set: texts are ASCII unless it names UTF-8 (or with "
    "\\-\\-ascii)\n"
    ".TP\n.B COLUMNS\nwidth that help is wrapped to, at most 100; otherwise the terminal's\n";

}  // namespace

std::string man_page_name(const CLI::App& verb) {
  std::string name = command_of(verb);
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

std::string man_page(const CLI::App& verb) {
  const std::string name = man_page_name(verb);
  std::string summary = verb.get_description();
  if (!summary.empty()) summary[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(summary[0])));
  if (summary.ends_with('.')) summary.pop_back();
  std::string text =
      ".TH " + roff(upper(name)) + " 1 \"\" \"resonid " RESONID_VERSION "\" \"resonid manual\"\n";
  text += ".nh\n.SH NAME\n" + roff(name) + " \\- " + roff(summary) + "\n";
  text += ".SH SYNOPSIS\n.B " + roff(command_of(verb)) + "\n" + roff(operands_of(verb)) + "\n";
  if (const auto arguments = options_of(verb, {}); !arguments.empty()) {
    text += ".SH ARGUMENTS\n";
    for (const auto* option : arguments) text += entry(form_of(*option), meaning_of(*option));
  }
  std::string group;
  for (const auto* other : listed_verbs(verb)) {
    if (group.empty()) text += verb.get_parent() == nullptr ? ".SH VERBS\n" : ".SH KINDS\n";
    if (other->get_group() != group && other->get_group() != "Kinds")
      text += ".SS " + roff(other->get_group()) + "\n";
    group = other->get_group();
    text += entry(other->get_name(), other->get_description());
  }
  text += ".SH OPTIONS\n";
  for (const auto& options : listed_groups(verb)) {
    text += ".SS " + roff(options) + "\n";
    for (const auto* option : options_of(verb, options)) text += option_entry(*option);
  }
  text += footer_section(verb) + ".SH EXIT STATUS\n";
  for (const auto& exit : exit_codes_of(verb)) text += entry(exit.code, exit.meaning);
  return text + kFilesAndEnvironment + see_also(verb);
}

}  // namespace resonid::cli
