// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <CLI/Formatter.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::cli {

/// "resonid excite chirp": the words that call a verb.
[[nodiscard]] std::string command_of(const CLI::App& verb);

/// The groups of a verb's options that are listed, in the order in which they were defined, General last.
[[nodiscard]] std::vector<std::string> listed_groups(const CLI::App& verb);
/// The options of a group; of the positional arguments with an empty name.
[[nodiscard]] std::vector<const CLI::Option*> options_of(const CLI::App& verb, const std::string& group);
/// Verbs, or kinds of a verb, in order.
[[nodiscard]] std::vector<const CLI::App*> listed_verbs(const CLI::App& app);

/// Whether a value stands behind the option.
[[nodiscard]] bool takes_value(const CLI::Option& option);
/// "-h", "--motion NAME".
[[nodiscard]] std::string form_of(const CLI::Option& option);
/// What an option does, with its default and what it cannot stand beside.
[[nodiscard]] std::string meaning_of(const CLI::Option& option);
/// "RECORD... [OPTIONS]": what stands behind the command.
[[nodiscard]] std::string operands_of(const CLI::App& verb);

/// A verb's footer. A line that begins with two spaces is a command, more of them go on with it; other lines
/// are paragraphs each.
struct FooterLine {
  bool command = false;
  std::string text;
};
[[nodiscard]] std::vector<FooterLine> footer_of(const CLI::App& verb);

struct ExitCodeText {
  std::string_view code, meaning;
};
/// The exit codes that the verb may end with.
[[nodiscard]] std::vector<ExitCodeText> exit_codes_of(const CLI::App& verb);

/// -h: how a verb is called, the names of its options and the first example; --help
/// (CLI::AppFormatMode::All): everything. Wrapped to text_width().
class HelpFormatter : public CLI::FormatterBase {
 public:
  [[nodiscard]] std::string make_help(const CLI::App* app, std::string name,
                                      CLI::AppFormatMode mode) const override;
};

/// --brief of a verb that prints a summary; options added from here on are listed as its results.
void add_summary_options(CLI::App& verb);

/// Gives every verb -h, --help, -q, -v, --color and the formatter, once all verbs are there.
void add_general_options(CLI::App& app);

}  // namespace resonid::cli
