// SPDX-License-Identifier: MIT
#include "completion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "help.hpp"
#include "options.hpp"

namespace resonid::cli {
namespace {

/// What may stand behind an option.
enum class Operand { none, name, file, folder, other };

Operand operand_of(const CLI::Option& option) {
  if (!takes_value(option)) return Operand::none;
  if (!choices_of(option).empty()) return Operand::name;
  const auto type = option.get_type_name();
  if (type.find("FOLDER") != std::string::npos) return Operand::folder;
  for (const char* file : {"FILE", ".json", "SPEC"})
    if (type.find(file) != std::string::npos) return Operand::file;
  return Operand::other;
}

std::vector<const CLI::Option*> named_options(const CLI::App& verb) {
  return verb.get_options(
      [](const CLI::Option* option) { return option->nonpositional() && !option->get_group().empty(); });
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const auto& name : option.get_snames()) names.push_back("-" + name);
  for (const auto& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

/// A verb, its kinds and so on, each with the words that lead to it: "excite chirp".
void for_each_verb(const CLI::App& app, const std::string& words,
                   const std::function<void(const CLI::App&, const std::string&)>& body) {
  body(app, words);
  for (const auto* verb : listed_verbs(app))
    for_each_verb(*verb, words.empty() ? verb->get_name() : words + " " + verb->get_name(), body);
}

std::string verb_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const auto* verb : listed_verbs(app)) names.push_back(verb->get_name());
  return fmt::format("{}", fmt::join(names, " "));
}

/// In single quotes, as bash, zsh and fish read it; the first two have no escapes in them.
std::string quoted(const std::string& text, std::string_view quote) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string(quote) : std::string(1, c);
  return out + "'";
}

std::string bash_operands(const CLI::App& verb, const std::string& words) {
  std::string text;
  for (const auto* option : named_options(verb)) {
    const auto operand = operand_of(*option);
    if (operand == Operand::none) continue;
    std::string labels;
    for (const auto& name : names_of(*option))
      labels += fmt::format("{}'{}:{}'", labels.empty() ? "" : "|", words, name);
    const char* made = operand == Operand::file     ? "_resonid_files -f"
                       : operand == Operand::folder ? "_resonid_files -d"
                                                    : ":";
    const std::string action =
        operand == Operand::name
            ? fmt::format("COMPREPLY=($(compgen -W '{}' -- \"$cur\"))", fmt::join(choices_of(*option), " "))
            : made;
    text += fmt::format("    {}) {}; return ;;\n", labels, action);
  }
  return text;
}

std::string zsh_escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string zsh_operand(const CLI::Option& option) {
  const std::string label = zsh_escaped(option.get_type_name());
  switch (operand_of(option)) {
    case Operand::none:
      return "";
    case Operand::name:
      return fmt::format(":{}:({})", label, fmt::join(choices_of(option), " "));
    case Operand::file:
      return ":" + label + ":_files";
    case Operand::folder:
      return ":" + label + ":_files -/";
    case Operand::other:
      break;
  }
  return ":" + label + ": ";
}

std::string zsh_function_of(const std::string& words) {
  std::string name = words.empty() ? "_resonid" : "_resonid_" + words;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

std::string zsh_arguments(const CLI::App& verb) {
  std::string text;
  for (const auto* option : named_options(verb))
    for (const auto& name : names_of(*option))
      text += " \\\n    " + quoted(fmt::format("{}[{}]{}", name, zsh_escaped(option->get_description()),
                                               zsh_operand(*option)),
                                   R"('\'')");
  return text;
}

std::string fish_condition(const std::string& words) {
  if (words.empty()) return "__fish_use_subcommand";
  std::string text;
  for (std::size_t from = 0; from < words.size();) {
    const auto end = std::min(words.find(' ', from), words.size());
    text +=
        (text.empty() ? "" : "; and ") + ("__fish_seen_subcommand_from " + words.substr(from, end - from));
    from = end + 1;
  }
  return text;
}

std::string fish_operand(const CLI::Option& option) {
  switch (operand_of(option)) {
    case Operand::none:
      return "";
    case Operand::name:
      return fmt::format(" -x -a '{}'", fmt::join(choices_of(option), " "));
    case Operand::file:
    case Operand::folder:
      return " -r -F";
    case Operand::other:
      break;
  }
  return " -x";
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  std::string verbs, operands, options;
  for_each_verb(app, "", [&](const CLI::App& verb, const std::string& words) {
    if (!words.empty()) {
      const auto space = words.rfind(' ');
      const std::string before = space == std::string::npos ? "" : words.substr(0, space);
      verbs += fmt::format("      '{}|{}') verb='{}' ;;\n", before, verb.get_name(), words);
    }
    operands += bash_operands(verb, words);
    std::string names;
    for (const auto* option : named_options(verb))
      for (const auto& name : names_of(*option)) names += (names.empty() ? "" : " ") + name;
    options += fmt::format("    '{}') options='{}' words='{}' ;;\n", words, names,
                           words == "help" ? verb_names(app) : verb_names(verb));
  });
  return "# bash completion for resonid, made by 'resonid help --completion bash'\n"
         "_resonid_files() {\n"
         "  compopt -o filenames 2>/dev/null\n"
         "  mapfile -t COMPREPLY < <(compgen \"$1\" -- \"$cur\")\n"
         "}\n"
         "_resonid() {\n"
         "  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} verb='' options='' words='' "
         "i\n"
         "  if [[ $cur == '=' ]]; then cur=''; elif [[ $prev == '=' ]]; then "
         "prev=${COMP_WORDS[COMP_CWORD-2]}; "
         "fi\n"
         "  COMPREPLY=()\n"
         "  for ((i = 1; i < COMP_CWORD; i++)); do\n"
         "    case \"$verb|${COMP_WORDS[i]}\" in\n" +
         verbs +
         "    esac\n"
         "  done\n"
         "  case \"$verb:$prev\" in\n" +
         operands +
         "  esac\n"
         "  case \"$verb\" in\n" +
         options +
         "  esac\n"
         "  if [[ $cur == -* ]]; then COMPREPLY=($(compgen -W \"$options\" -- \"$cur\"));\n"
         "  elif [[ -n $words ]]; then COMPREPLY=($(compgen -W \"$words\" -- \"$cur\"));\n"
         "  else _resonid_files -f; fi\n"
         "}\n"
         "complete -F _resonid resonid\n";
}

std::string zsh_completion(const CLI::App& app) {
  std::string text =
      "#compdef resonid\n# zsh completion for resonid, made by 'resonid help --completion zsh'\n";
  for_each_verb(app, "", [&](const CLI::App& verb, const std::string& words) {
    const auto kinds = listed_verbs(verb);
    text += zsh_function_of(words) + "() {\n";
    if (kinds.empty()) {
      const std::string operand =
          words == "help" ? "'*:verb:(" + verb_names(app) + ")'" : std::string("'*:file:_files'");
      text += "  _arguments -s" + zsh_arguments(verb) + " \\\n    " + operand + "\n}\n";
      return;
    }
    text +=
        "  local curcontext=$curcontext state line\n  _arguments -C -s" + zsh_arguments(verb) +
        " \\\n    '1:verb:->verb' '*::argument:->rest'\n  case $state in\n    verb)\n      local -a verbs=(";
    for (const auto* kind : kinds)
      text += "\n        " + quoted(kind->get_name() + ":" + zsh_escaped(kind->get_description()), R"('\'')");
    text += ")\n      _describe verb verbs ;;\n    rest)\n      case $line[1] in\n";
    for (const auto* kind : kinds)
      text += fmt::format("        {}) {} ;;\n", kind->get_name(),
                          zsh_function_of(words.empty() ? kind->get_name() : words + " " + kind->get_name()));
    text += "      esac ;;\n  esac\n}\n";
  });
  return text +
         "if [ \"$funcstack[1]\" = \"_resonid\" ]; then _resonid \"$@\"; else compdef _resonid resonid; fi\n";
}

std::string fish_completion(const CLI::App& app) {
  std::string text = "# fish completion for resonid, made by 'resonid help --completion fish'\n";
  for_each_verb(app, "", [&](const CLI::App& verb, const std::string& words) {
    const std::string begin = fmt::format("complete -c resonid -n '{}'", fish_condition(words));
    for (const auto* kind : listed_verbs(verb))
      text +=
          fmt::format("{} -f -a {} -d {}\n", begin, kind->get_name(), quoted(kind->get_description(), "\\'"));
    if (words == "help") text += fmt::format("{} -f -a '{}'\n", begin, verb_names(app));
    for (const auto* option : named_options(verb)) {
      std::string names;
      for (const auto& name : option->get_snames()) names += " -s " + name;
      for (const auto& name : option->get_lnames()) names += " -l " + name;
      text +=
          begin + names + fish_operand(*option) + " -d " + quoted(option->get_description(), "\\'") + "\n";
    }
  });
  return text;
}

}  // namespace resonid::cli
