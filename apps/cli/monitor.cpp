// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <resonid/base/error_text.hpp>
#include <string>

#include "brief.hpp"
#include "errors.hpp"
#include "help.hpp"
#include "monitor/service/configuration.hpp"
#include "monitor/service/install.hpp"
#include "monitor/service/log.hpp"
#include "monitor/service/replay.hpp"
#include "monitor_discover.hpp"
#include "monitor_replay.hpp"
#include "monitor_run.hpp"
#include "options.hpp"
#include "output.hpp"
#include "terminal.hpp"
#include "verbs.hpp"

namespace resonid::cli {
namespace {

constexpr const char* kUsualAddress = "127.0.0.1:8080";

struct MonitorVerbOptions {
  std::string configuration, data, listen;
  ReplayOptions replay;
  DiscoverOptions discover;
  std::optional<double> speed;
  std::optional<monitor::LogLevel> log_level;
  bool demo = false, check = false, schema = false;

  [[nodiscard]] bool replays() const { return !replay.follow.record.record.empty(); }
};

void refuse_contradictions(const CLI::App& verb, const MonitorVerbOptions& o) {
  if (o.demo && !o.configuration.empty())
    throw UsageError("--demo: needs no configuration, found '" + o.configuration + "'");
  if (o.schema && !o.configuration.empty())
    throw UsageError("--schema: needs no configuration, found '" + o.configuration + "'");
  if (o.demo && o.replays()) throw UsageError("--demo: has its own samples; leave --replay or it out");
  if (!o.demo && !o.schema && !o.replays() && o.configuration.empty())
    throw UsageError("a configuration file is required, or --demo (see: resonid monitor --schema)");
  if (o.speed && !o.demo && !o.replays()) throw UsageError("--speed: is for --demo and --replay");
  if (o.speed && !(*o.speed >= 0.01 && *o.speed <= 1000.0))
    throw UsageError(fmt::format("--speed: found {:g}, required 0.01 ... 1000", *o.speed));
  if (o.check && o.configuration.empty())
    throw UsageError("--check: checks a configuration, which is required with it");
  if (o.replays() && !o.data.empty()) throw UsageError("--data: a replay keeps nothing; leave it out");
  refuse_without_effect(verb, o.replay, !o.configuration.empty());
}

/// The data folder of what keeps nothing, which goes with it.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_((std::filesystem::temp_directory_path() / "resonid-monitor-XXXXXX").string()) {
    if (mkdtemp(path_.data()) == nullptr)
      throw InputError(fmt::format("'{}': the folder cannot be made", path_));
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;
};

void listen_at(monitor::Installation& installation, const std::string& address) {
  const auto at = monitor::endpoint(address, 0);
  if (!at) throw UsageError("--listen: " + message_of(at.error()));
  installation.web.listening.address = at->host;
  installation.web.listening.port = at->port;
}

void run_demo(const MonitorVerbOptions& o) {
  std::optional<TemporaryFolder> temporary;
  auto installation = monitor::demo_installation(o.data.empty() ? temporary.emplace().path() : o.data,
                                                 o.speed.value_or(1.0), RESONID_VERSION);
  listen_at(installation, o.listen.empty() ? kUsualAddress : o.listen);
  run_service(std::move(installation), "#/axis/belt");
}

/// Without --rows the page stays; with it the program ends with the recording.
void run_replay(monitor::Replay replay, const MonitorVerbOptions& o) {
  constexpr double kLook_s = 0.05;
  const auto& path = o.replay.rows;
  const bool ends = !path.empty();
  const bool quiet = no_summary({{"--rows", path}});
  const sigset_t signals = block_signals();
  const TemporaryFolder temporary;
  std::optional<ReplayRows> rows;
  if (ends) rows.emplace(path, replay);
  auto installation = monitor::replay_installation(std::move(replay), temporary.path(), o.speed.value_or(0.0),
                                                   RESONID_VERSION);
  listen_at(installation, !o.listen.empty() ? o.listen : ends ? "127.0.0.1:0" : kUsualAddress);
  if (rows) installation.engine.on_row = [&rows](std::size_t, const auto& axis) { rows->add(axis); };
  const auto service = started(std::move(installation), quiet, all_by_options());
  const int signal = wait_for_signal(signals, kLook_s, *service, [&] { return ends && service->finished(); });
  service->stop();
  if (!ends) return;
  if (signal != 0) throw InterruptedError(signal);
  if (rows->rows() == 0)  // a file of that name stays as it was
    throw InputError(
        fmt::format("no rows: the recording ended before anything could be followed ({}); a "
                    "longer one is required",
                    service->backend().axes(0).axes.front().why));
  rows->finish();
  if (!quiet) print_summary(replay_text(service->backend(), path, *rows));
}

/// Where people read: standard output has one line.
void tell_people(monitor::LogLevel level, const std::string& text) {
  print_error(fmt::format("{}: {}\n", name_of(level), text));
}

void tell_checked(const monitor::ConfigurationFile& file, const std::string& path) {
  if (!output_settings().quiet)
    for (const auto& note : file.findings.notes) print_error(fmt::format("note: {}\n", message_of(note)));
  const auto& c = file.configuration;
  print(fmt::format("{}: {} axes, {} sources: nothing to object\n", path, c.axes.tables.size(),
                    c.sources.tables.size()));
}

void run_monitor(CLI::App& verb, MonitorVerbOptions& o) {
  refuse_without_discovery(verb, o.discover);
  if (!o.discover.url.empty()) return run_discover(o.discover);
  refuse_contradictions(verb, o);
  const bool few = output_settings().quiet || o.replays();
  monitor::set_log_level(o.log_level.value_or(few ? monitor::LogLevel::error : monitor::LogLevel::info));
  if (o.schema) return print(monitor::configuration_document());
  if (o.demo) return run_demo(o);
  const ConfiguredRun run{o.configuration, o.data, o.listen};
  if (!o.check && !o.replays()) return run_configured(run);
  std::optional<monitor::ConfigurationFile> file;
  if (!o.configuration.empty()) file = configuration_of(run, tell_people);
  if (o.check) return tell_checked(*file, o.configuration);
  run_replay(read_replay(verb, o.replay, file ? &file->configuration : nullptr), o);
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
      "  resonid monitor --discover mqtt://broker:1883 > monitor.toml\n"
      "  resonid monitor --replay belt.csv --controller pi:1.036,0.147 --delay 0.004\n"
      "  resonid monitor monitor.toml --axis gantry-x --replay monday.csv --rows rows.csv\n"
      "--demo runs simulated drives, of which one belt loosens after three minutes (--speed 20: after nine "
      "seconds). What a configuration may hold: docs/monitor_configuration.md, or --schema. Ctrl-C and "
      "SIGTERM end the service, SIGHUP makes it read its configuration again; what was learned and seen is "
      "kept in the data folder.\n"
      "--discover prints what a broker, a port or a file carries, and a configuration of it.\n"
      "--replay gives the rows that 'track --long-term' gives of the same recording, with its --every, and "
      "the alarms that there would have been. It keeps nothing.");
  const auto o = std::make_shared<MonitorVerbOptions>();
  verb->add_option("CONFIG", o->configuration, "configuration of the installation")->type_name("FILE.toml");
  verb->add_flag("--demo", o->demo, "simulated drives instead of a configuration");
  add_number(*verb, "--speed", o->speed, "X",
             "--demo, --replay: so many times real time; otherwise once, and a replay as fast as it goes");
  verb->add_flag("--check", o->check, "check the configuration and end");
  verb->add_flag("--schema", o->schema, "print what a configuration may hold and end");
  verb->add_option("--data", o->data,
                   "folder of all that is kept; otherwise as configured, for --demo a temporary one")
      ->type_name("FOLDER");
  verb->add_option("--listen", o->listen,
                   "address of page and interface; otherwise as configured, for --demo and --replay "
                   "127.0.0.1:8080; port 0: any, as with --rows")
      ->type_name("HOST:PORT");
  add_enum(*verb, "--log-level", o->log_level,
           "what is said on standard error while it runs; otherwise info, with --replay or --quiet error",
           "");
  add_discover_options(*verb, o->discover);
  add_replay_options(*verb, o->replay);
  verb->callback([verb, o] { run_monitor(*verb, *o); });
}

}  // namespace resonid::cli
