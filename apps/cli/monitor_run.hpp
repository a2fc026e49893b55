// SPDX-License-Identifier: MIT
#pragma once

#include <csignal>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "monitor/service/configuration.hpp"
#include "monitor/service/log.hpp"
#include "monitor/service/service.hpp"

namespace resonid::cli {

/// SIGINT, SIGTERM and SIGHUP, blocked from now on: to be called before any thread begins.
[[nodiscard]] sigset_t block_signals();

/// Waits for one of these signals, and lets the watchdog of systemd hear of it meanwhile while the service is
/// healthy. 0: it has `ended` by itself, which is asked from time to time.
[[nodiscard]] int wait_for_signal(
    const sigset_t& signals, double every_s, const monitor::Service& service,
    const std::function<bool()>& ended = [] { return false; });

/// A service that runs; its address is told. Where it cannot, what is wrong is told of the option by which a
/// key was told.
[[nodiscard]] std::unique_ptr<monitor::Service> started(monitor::Installation installation, bool quiet,
                                                        const monitor::ToldElsewhere& options);

/// The options of what runs without a configuration.
[[nodiscard]] monitor::ToldElsewhere all_by_options();

/// Until one of the signals ends it. On a desktop a browser opens at a place of the page.
void run_service(monitor::Installation installation, std::string_view place);

/// A configuration file, and what the command line says instead of it.
struct ConfiguredRun {
  std::string path, data, listen;  ///< Empty: as configured.
};
/// How one line of what is to be said of a configuration is told.
using Tell = std::function<void(monitor::LogLevel, const std::string&)>;
/// A file that can be used: warnings are told; throws what keeps it from running.
[[nodiscard]] monitor::ConfigurationFile configuration_of(const ConfiguredRun& run, const Tell& tell);
/// As lines of the log, as a service tells everything.
void tell_log(monitor::LogLevel level, const std::string& text);
/// A service with this configuration until it is told to end; with SIGHUP the file is read again and taken
/// over.
void run_configured(const ConfiguredRun& run);

}  // namespace resonid::cli
