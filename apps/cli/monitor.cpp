// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <pthread.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <memory>
#include <resonid/base/error_text.hpp>
#include <string>

#include "brief.hpp"
#include "errors.hpp"
#include "help.hpp"
#include "monitor/service/configuration.hpp"
#include "monitor/service/install.hpp"
#include "monitor/service/notify.hpp"
#include "monitor/service/service.hpp"
#include "options.hpp"
#include "output.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

struct MonitorVerbOptions {
  std::string configuration, data, listen;
  bool demo = false, check = false, schema = false;
  double speed = 1.0;
};

/// Findings of a configuration on standard error; refuses one that cannot run.
monitor::Configuration configuration_of(const std::string& path) {
  auto file = monitor::read_configuration(path);
  for (const auto& w : file.findings.warnings) print_error(fmt::format("warning: {}\n", message_of(w)));
  if (file.usable()) return std::move(file.configuration);
  std::string all;
  for (const auto& e : file.findings.errors) all += (all.empty() ? "" : "\n") + message_of(e);
  throw InputError(all);
}

void refuse_contradictions(const CLI::App& verb, const MonitorVerbOptions& o) {
  const auto given = [&](const char* name) { return verb.get_option(name)->count() > 0; };
  if (o.demo && !o.configuration.empty())
    throw UsageError("--demo: needs no configuration, found '" + o.configuration + "'");
  if (!o.demo && !o.schema && o.configuration.empty())
    throw UsageError("a configuration file is required, or --demo (see: resonid monitor --schema)");
  if (given("--speed") && !o.demo) throw UsageError("--speed: is for --demo");
  if (!(o.speed >= 0.01 && o.speed <= 1000.0))
    throw UsageError(fmt::format("--speed: found {:g}, required 0.01 ... 1000", o.speed));
}

/// Waits for the signals that end the service, and lets the watchdog of systemd hear of it meanwhile.
int wait_for_end(const sigset_t& signals) {
  const double every_s = 0.5 * monitor::watchdog_s().value_or(2.0);
  const auto seconds = static_cast<time_t>(every_s);
  const timespec wait{seconds, static_cast<long>(1e9 * (every_s - static_cast<double>(seconds)))};
  while (true) {
    const int signal = sigtimedwait(&signals, nullptr, &wait);
    if (signal == SIGINT || signal == SIGTERM) return signal;
    monitor::notify("WATCHDOG=1");
  }
}

void run_monitor(const CLI::App& verb, const MonitorVerbOptions& o) {
  refuse_contradictions(verb, o);
  if (o.schema) {
    print(monitor::configuration_document());
    return;
  }
  std::string temporary;
  monitor::Installation installation;
  if (o.demo) {
    std::string data = o.data;
    if (data.empty()) {
      data = (std::filesystem::temp_directory_path() / "resonid-monitor-XXXXXX").string();
      if (mkdtemp(data.data()) == nullptr)
        throw InputError(fmt::format("'{}': the folder cannot be made", data));
      temporary = data;
    }
    installation = monitor::demo_installation(data, o.speed, RESONID_VERSION);
    const auto at = monitor::endpoint(o.listen.empty() ? "127.0.0.1:8080" : o.listen, 0);
    if (!at) throw UsageError("--listen: " + message_of(at.error()));
    installation.web.listening.address = at->host;
    installation.web.listening.port = at->port;
  } else {
    auto configuration = configuration_of(o.configuration);
    if (!o.data.empty()) configuration.monitor.data = std::filesystem::absolute(o.data).string();
    if (!o.listen.empty()) configuration.monitor.listen = o.listen;
    if (o.check) {
      print(fmt::format("{}: {} axes, {} sources: nothing to object\n", o.configuration,
                        configuration.axes.tables.size(), configuration.sources.tables.size()));
      return;
    }
    auto made = monitor::installation_of(configuration, RESONID_VERSION);
    if (!made) throw InputError(message_of(made.error()));
    installation = std::move(*made);
  }
  // Before any thread begins: all of them leave these to the one that waits.
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  ::signal(SIGPIPE, SIG_IGN);  // TLS writes to connections that brokers and clients have closed
  auto service = monitor::Service::start(std::move(installation));
  if (!service) throw InputError(message_of(service.error()));
  for (const auto& remark : (*service)->remarks()) print_error(remark + "\n");
  print(fmt::format("Monitoring: {} (Ctrl-C ends)\n", (*service)->url()));
  std::fflush(stdout);
  monitor::notify("READY=1");
  wait_for_end(signals);
  monitor::notify("STOPPING=1");
  (*service)->stop();
  if (!temporary.empty()) {
    std::error_code ignored;
    std::filesystem::remove_all(temporary, ignored);
  }
}

}  // namespace

void add_monitor(CLI::App& app) {
  auto* verb = app.add_subcommand(
      "monitor",
      "Watches running drives: estimates with error bars, changes, alarms, in a browser and over HTTP");
  verb->footer(
      "Examples:\n"
      "  resonid monitor --demo\n"
      "  resonid monitor monitor.toml --check\n"
      "  resonid monitor monitor.toml\n"
      "  resonid monitor --schema\n"
      "--demo runs simulated drives, of which one belt loosens after three minutes (--speed 20: after nine "
      "seconds). What a configuration may hold: docs/monitor_configuration.md, or --schema. Ctrl-C and "
      "SIGTERM end "
      "the service; what was learned and seen is kept in the data folder.");
  const auto o = std::make_shared<MonitorVerbOptions>();
  verb->add_option("CONFIG", o->configuration, "configuration of the installation")->type_name("FILE.toml");
  verb->add_flag("--demo", o->demo, "simulated drives instead of a configuration");
  add_number(*verb, "--speed", o->speed, "X", "--demo: so many times faster than real time");
  verb->add_flag("--check", o->check, "check the configuration and end");
  verb->add_flag("--schema", o->schema, "print what a configuration may hold and end");
  verb->add_option("--data", o->data,
                   "folder of all that is kept; otherwise as configured, for --demo a temporary one")
      ->type_name("FOLDER");
  verb->add_option("--listen", o->listen,
                   "address of page and interface, 127.0.0.1:8080 for --demo; port 0: any")
      ->type_name("HOST:PORT");
  verb->callback([verb, o] { run_monitor(*verb, *o); });
}

}  // namespace resonid::cli
