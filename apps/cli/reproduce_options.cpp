// SPDX-License-Identifier: MIT
#include "reproduce_options.hpp"

#include "options.hpp"

namespace resonid::cli {

void add_reproduce_options(CLI::App& verb, ReproduceOptions& o) {
  constexpr std::uint64_t kFewestSeeds = 2;
  verb.option_defaults()->group("Results");
  verb.add_option("NAME", o.name, "which; all when not given")->type_name("");
  verb.add_option("--report", o.report, "self-contained HTML page with the figures' counterparts")
      ->type_name("FILE");
  verb.add_option("--out", o.out, "a page NAME.html in this folder for every experiment that is run")
      ->type_name("FOLDER");
  verb.add_option("--markdown", o.markdown, "text and tables ('-': standard output)")->type_name("FILE");
  verb.add_option("--json", o.json, "everything, for machines ('-': standard output)")->type_name("FILE");
  add_count(verb, "--seeds", o.seeds, "noisy runs that means and deviations are taken over, >= 2",
            kFewestSeeds);
}

}  // namespace resonid::cli
