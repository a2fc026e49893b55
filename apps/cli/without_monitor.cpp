// SPDX-License-Identifier: MIT
#include <CLI/App.hpp>

#include "errors.hpp"
#include "verbs.hpp"

namespace resonid::cli {

/// The verb where the program is built without it: its libraries are to be had as shared ones only.
void add_monitor(CLI::App& app) {
  auto* verb = app.add_subcommand("monitor", "Watches running drives; not in this build");
  verb->allow_extras();
  verb->callback([] {
    throw UsageError(
        "monitor: is not in this build; the package for Debian (.deb) and a build from source have it");
  });
}

}  // namespace resonid::cli
