// SPDX-License-Identifier: MIT
#include "monitor_run.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <pthread.h>
#include <spawn.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <optional>
#include <resonid/base/error_text.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

#include "errors.hpp"
#include "monitor/service/install.hpp"
#include "monitor/service/log.hpp"
#include "monitor/service/notify.hpp"
#include "output.hpp"
#include "terminal.hpp"

namespace resonid::cli {
namespace {

using monitor::LogLevel;
using monitor::say;

constexpr std::chrono::minutes kMemoryReturnedEvery{1};

/// Half of the time after which the watchdog would end us.
double watchdog_pace_s() { return std::clamp(0.5 * monitor::watchdog_s().value_or(4.0), 0.01, 2.0); }

void say_lines(LogLevel level, std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    say(level, "{}", text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

std::string change_text(const monitor::ConfigurationChange& c) {
  const auto value = [](const std::string& text) { return text.empty() ? "nothing" : text; };
  const std::string what = c.before == c.after ? fmt::format("what {} holds has changed", c.after)
                                               : fmt::format("{}, was {}", value(c.after), value(c.before));
  return fmt::format("{}: {}{}", c.path, what, c.begins_anew ? " (begins anew)" : "");
}

monitor::Installation installed(const monitor::Configuration& configuration) {
  auto installation = monitor::installation_of(configuration, RESONID_VERSION);
  if (!installation) throw InputError(message_of(installation.error()));
  return std::move(*installation);
}

/// What was assumed of units.
void say_notes(const monitor::ConfigurationFile& file) {
  for (const auto& note : file.findings.notes) say(LogLevel::info, "{}", message_of(note));
}

/// By default glibc gives each thread that allocates its own heap, and what lies free in one is not to be had
/// in another: in a service of a dozen threads twice what is in use. Learning and answers do not wait for
/// two.
void bound_heap() {
#ifdef M_ARENA_MAX
  mallopt(M_ARENA_MAX, 2);
#endif
}

/// What learning and long answers took and freed goes back to the machine: otherwise the most that was ever
/// in use at once stays with the process, and over weeks that only grows.
void return_free_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

/// Where a person sits at a desktop; whoever cannot has the address.
void open_in_browser(const std::string& url) {
  if (output_settings().quiet || !is_screen(STDOUT_FILENO)) return;
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
  posix_spawn_file_actions_t silent;
  posix_spawn_file_actions_init(&silent);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&silent, stream, "/dev/null", O_WRONLY, 0);
  posix_spawnattr_t own;  // its own group and signals: Ctrl-C ends the service alone
  posix_spawnattr_init(&own);
  posix_spawnattr_setflags(&own, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&own, &none);
  std::string program = "xdg-open", argument = url;
  char* const arguments[] = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  static_cast<void>(::posix_spawnp(&child, program.c_str(), &silent, &own, arguments, environ));
  posix_spawnattr_destroy(&own);
  posix_spawn_file_actions_destroy(&silent);
}

/// Which keys are told by options.
monitor::ToldElsewhere by_options(const ConfiguredRun& run) {
  monitor::ToldElsewhere options;
  if (!run.data.empty()) options["monitor.data"] = "--data";
  if (!run.listen.empty()) options["monitor.listen"] = "--listen";
  return options;
}

/// A service that can take over another configuration.
class Reloadable {
 public:
  Reloadable(ConfiguredRun run, monitor::Configuration configuration)
      : run_(std::move(run)),
        configuration_(std::move(configuration)),
        keys_(monitor::configuration_keys(configuration_)),
        service_(started(installed(configuration_), output_settings().quiet, by_options(run_))) {}

  /// The file again. What is wrong with it is told, and the service goes on as it was.
  void reload() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    monitor::notify(
        fmt::format("RELOADING=1\nMONOTONIC_USEC={}", now.tv_sec * 1'000'000 + now.tv_nsec / 1000));
    try {
      take_over(configuration_of(run_, tell_log));
    } catch (const InputError& error) {
      say_lines(LogLevel::error, error.what());
      say(LogLevel::error, "the configuration is not taken over; the service goes on as it was");
    }
    monitor::notify("READY=1");
  }
  void stop() { service_->stop(); }
  [[nodiscard]] const monitor::Service& service() const { return *service_; }

 private:
  void take_over(monitor::ConfigurationFile file) {
    auto& next = file.configuration;
    auto keys = monitor::configuration_keys(next);
    const auto differences = monitor::changes(keys_, keys);
    if (differences.empty()) return say(LogLevel::info, "the configuration has not changed");
    say_notes(file);
    for (const auto& change : differences) say(LogLevel::info, "{}", change_text(change));
    auto installation = installed(next);
    service_.reset();  // all that was taken is kept, and port and files are free
    try {
      service_ = started(std::move(installation), true, by_options(run_));
    } catch (const InputError& error) {
      say_lines(LogLevel::error, error.what());
      go_back();
      return say(LogLevel::error, "the service goes on with the configuration that it had");
    }
    configuration_ = std::move(next);
    keys_ = std::move(keys);
    say(LogLevel::info, "the configuration is taken over: {}", service_->url());
  }

  void go_back() {
    try {
      service_ = started(installed(configuration_), true, by_options(run_));
    } catch (const InputError& error) {
      throw std::runtime_error(fmt::format("the former configuration cannot run either: {}", error.what()));
    }
  }

  ConfiguredRun run_;
  monitor::Configuration configuration_;
  std::vector<monitor::ConfigurationKey> keys_;
  std::unique_ptr<monitor::Service> service_;
};

}  // namespace

sigset_t block_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGPIPE, SIG_IGN);  // TLS writes to connections that brokers and clients have closed
  return signals;
}

int wait_for_signal(const sigset_t& signals, double every_s, const monitor::Service& service,
                    const std::function<bool()>& ended) {
  const auto seconds = static_cast<time_t>(every_s);
  const timespec wait{seconds, static_cast<long>(1e9 * (every_s - static_cast<double>(seconds)))};
  auto next_return = std::chrono::steady_clock::now() + kMemoryReturnedEvery;
  while (!ended()) {
    const int signal = sigtimedwait(&signals, nullptr, &wait);
    if (signal > 0) return signal;
    if (service.healthy()) monitor::notify("WATCHDOG=1");
    if (const auto now = std::chrono::steady_clock::now(); now >= next_return) {
      return_free_memory();
      next_return = now + kMemoryReturnedEvery;
    }
  }
  return 0;
}

std::unique_ptr<monitor::Service> started(monitor::Installation installation, bool quiet,
                                          const monitor::ToldElsewhere& options) {
  bound_heap();
  auto service = monitor::Service::start(std::move(installation));
  if (!service) {
    Error& error = service.error();
    const auto option = options.find("monitor." + error.field.str());
    if (error.where.empty() && option != options.end()) error.field = option->second;
    throw InputError(message_of(error));
  }
  if (!quiet) print(fmt::format("Monitoring: {} (Ctrl-C ends)\n", (*service)->url()));
  return std::move(*service);
}

monitor::ToldElsewhere all_by_options() {
  return {{"monitor.data", "--data"}, {"monitor.listen", "--listen"}};
}

void run_service(monitor::Installation installation, std::string_view place) {
  const sigset_t signals = block_signals();
  const auto service = started(std::move(installation), output_settings().quiet, all_by_options());
  open_in_browser(fmt::format("{}{}", service->url(), place));
  monitor::notify("READY=1");
  static_cast<void>(wait_for_signal(signals, watchdog_pace_s(), *service));
  monitor::notify("STOPPING=1");
  service->stop();
}

void tell_log(LogLevel level, const std::string& text) { say(level, "{}", text); }

monitor::ConfigurationFile configuration_of(const ConfiguredRun& run, const Tell& tell) {
  auto file = monitor::read_configuration(run.path, [&](monitor::Configuration& c) {
    if (!run.data.empty()) c.monitor.data = std::filesystem::absolute(run.data).string();
    if (!run.listen.empty()) c.monitor.listen = run.listen;
    return by_options(run);
  });
  for (const auto& w : file.findings.warnings) tell(LogLevel::warning, message_of(w));
  if (!file.usable()) {
    std::string all;
    for (const auto& e : file.findings.errors) all += (all.empty() ? "" : "\n") + message_of(e);
    throw InputError(all);
  }
  return file;
}

void run_configured(const ConfiguredRun& run) {
  sigset_t signals{};
  std::optional<Reloadable> begun;
  try {
    auto file = configuration_of(run, tell_log);
    signals = block_signals();  // until then they end it
    say_notes(file);
    begun.emplace(run, std::move(file.configuration));
  } catch (const InputError& error) {
    if (!monitor::logs_to_journal()) throw;
    say_lines(LogLevel::error, error.what());
    throw ToldError(error.what());
  }
  Reloadable& service = *begun;
  monitor::notify("READY=1");
  while (wait_for_signal(signals, watchdog_pace_s(), service.service()) == SIGHUP) service.reload();
  monitor::notify("STOPPING=1");
  service.stop();
}

}  // namespace resonid::cli
