// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <string>

namespace resonid::cli {

/// Where `monitor --discover` looks, and for how long.
struct DiscoverOptions {
  std::string url, password_file, ca_file;
  double seconds = 10.0;
};
/// --discover, --seconds, --password-file, --ca-file.
void add_discover_options(CLI::App& verb, DiscoverOptions& o);

/// Refuses --seconds and the like without --discover, and --discover beside other work.
void refuse_without_discovery(const CLI::App& verb, const DiscoverOptions& o);

/// Prints what there is and a configuration of it, as one TOML file. Ctrl-C ends the search.
void run_discover(const DiscoverOptions& o);

}  // namespace resonid::cli
