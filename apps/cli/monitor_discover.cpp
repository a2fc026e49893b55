// SPDX-License-Identifier: MIT
#include "monitor_discover.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <filesystem>
#include <resonid/base/error_text.hpp>
#include <string_view>
#include <vector>

#include "errors.hpp"
#include "monitor/service/discover_bytes.hpp"
#include "monitor/service/discover_sources.hpp"
#include "options.hpp"
#include "output.hpp"
#include "terminal.hpp"

namespace resonid::cli {
namespace {

using monitor::Discovered;
using monitor::SourceConfig;
using monitor::SourceKind;

/// What the word behind --discover says.
struct Place {
  SourceConfig where;  ///< Kind, and address or path.
  std::string filter;  ///< Of topics or subjects.
};

struct Scheme {
  std::string_view name;
  SourceKind kind;
  bool tls;
  const char* port;  ///< Where none is told; empty: it must be.
  const char* all;   ///< The filter that has all topics; empty: there are none.
};
constexpr Scheme kSchemes[] = {
    {"mqtt", SourceKind::mqtt, false, "1883", "#"}, {"mqtts", SourceKind::mqtt, true, "8883", "#"},
    {"nats", SourceKind::nats, false, "4222", ">"}, {"tls", SourceKind::nats, true, "4222", ">"},
    {"tcp", SourceKind::tcp, false, "", ""},        {"udp", SourceKind::udp, false, "", ""}};

[[noreturn]] void refuse_url(const std::string& url, const std::string& why) {
  throw UsageError(fmt::format("--discover: found '{}', {}", url, why));
}

/// Its FIFO holds numbers alone: which pins they are of, the HAL file of the machine says.
[[noreturn]] void refuse_hal(const std::string& url) {
  refuse_url(
      url,
      "which tells no names; required, in place of it, in the configuration:\n"
      "    [source.hal]\n"
      "    kind = \"hal\"\n"
      "    hal_channel = 0                      # N of sampler.N\n"
      "    columns = [\"ru\", \"u\", \"speed\", \"overruns\"]  # what is wired to sampler.N.pin.0, .1 ..., "
      "in this order\n"
      "with sample_rate_hz of its axis 1e9 / the servo period in ns");
}

Place broker_of(const Scheme& scheme, const std::string& url, std::string_view rest) {
  Place place;
  auto& connection = place.where.connection;
  place.where.kind = scheme.kind;
  connection.tls = scheme.tls;
  const auto slash = rest.find('/');
  std::string address(rest.substr(0, slash));
  if (slash != rest.npos) place.filter = rest.substr(slash + 1);
  const bool broker = *scheme.all != '\0';
  if (!broker && slash != rest.npos) refuse_url(url, "required HOST:PORT and nothing behind it");
  if (place.filter.empty()) place.filter = scheme.all;
  if (const auto at = address.rfind('@'); broker && at != address.npos) {
    connection.user = address.substr(0, at);
    if (connection.user.find(':') != std::string::npos)
      refuse_url("...", "required no password in it: --password-file is for that");
    address.erase(0, at + 1);
  }
  if (broker && address.find(':', address.find(']') + 1) == address.npos)
    address += fmt::format(":{}", scheme.port);
  if (const auto fine = monitor::endpoint(address); !fine)
    throw UsageError(fmt::format("--discover: {}", message_of(fine.error())));
  connection.address = std::move(address);
  return place;
}

Place place_of(const std::string& url) {
  Place place;
  const auto end = url.find("://");
  if (url.starts_with("hal:")) refuse_hal(url);
  if (url == "-") {
    place.where.kind = SourceKind::standard_input;
  } else if (end == url.npos) {
    place.where.kind = SourceKind::file;
    place.where.path = std::filesystem::absolute(url).string();
  } else {
    const auto* const scheme = std::find_if(std::begin(kSchemes), std::end(kSchemes),
                                            [&](const Scheme& s) { return url.substr(0, end) == s.name; });
    if (scheme == std::end(kSchemes))
      refuse_url(url,
                 "required mqtt://, mqtts://, nats://, tls:// (NATS), tcp:// or udp:// with HOST:PORT, a "
                 "file, or -");
    place = broker_of(*scheme, url, std::string_view(url).substr(end + 3));
  }
  return place;
}

monitor::Access access_of(const SourceConfig& where) {
  const auto& c = where.connection;
  monitor::Access access;
  if (!c.user.empty()) access.credentials = monitor::Credentials{c.user, {}};
  if (!c.user.empty() && !c.password_file.empty()) {
    auto password = monitor::read_secret(c.password_file);
    if (!password) throw InputError("--password-file: " + message_of(password.error()));
    access.credentials->password = std::move(*password);
  }
  if (c.tls) access.tls = monitor::Tls{c.ca_file, {}, {}};
  return access;
}

expected<std::vector<Discovered>, Error> discovered(const Place& place, double seconds,
                                                    const monitor::KeepLooking& keep) {
  const auto& c = place.where.connection;
  switch (place.where.kind) {
    case SourceKind::mqtt: {
      monitor::MqttSettings broker;
      const auto at = monitor::endpoint(c.address);
      broker.host = at->host;
      broker.port = at->port;
      broker.access = access_of(place.where);
      return monitor::discover_mqtt(std::move(broker), place.filter, seconds, keep);
    }
    case SourceKind::nats: {
      monitor::NatsSettings servers;
      servers.servers = {monitor::nats_url(c.address, c.tls)};
      servers.access = access_of(place.where);
      if (c.user.empty() && !c.password_file.empty()) servers.token_file = c.password_file;
      return monitor::discover_nats(servers, place.filter, seconds, keep);
    }
    case SourceKind::tcp:
      return monitor::discover_tcp(c.address, seconds, keep);
    case SourceKind::udp:
      return monitor::discover_udp(c.address, seconds, keep);
    case SourceKind::standard_input:
      return monitor::discover_pipe(STDIN_FILENO, seconds, keep);
    case SourceKind::file:
    case SourceKind::hal:
    case SourceKind::demo:
      break;
  }
  return monitor::discover_file(place.where.path, seconds, keep);
}

using Cells = std::array<std::string, 6>;

std::string rate_text(const Discovered& d) {
  if (d.rate_hz() > 0.0) return fmt::format("{:.5g} Hz", d.rate_hz());
  return d.measured_rate_hz > 0.0 ? fmt::format("{:.5g} Hz by arrival", d.measured_rate_hz) : "";
}

Cells cells_of(const Discovered& d) {
  std::string columns;
  for (const auto& column : d.columns) columns += (columns.empty() ? "" : ", ") + column;
  const std::string name = d.name + (d.stream.empty() ? "" : fmt::format(" (stream {})", d.stream));
  return {monitor::printable(name),
          monitor::printable(d.axis),
          d.format ? std::string(name_of(*d.format)) : fmt::format("none of {} messages", d.messages),
          monitor::printable(columns),
          rate_text(d),
          d.format ? fmt::format("{}", d.sample_count) : ""};
}

/// As comments of TOML; columns that are empty everywhere are left out.
std::string table_text(const std::vector<Discovered>& found) {
  std::vector<Cells> rows = {{"name", "axis", "format", "columns", "rate", "samples"}};
  for (const auto& d : found) rows.push_back(cells_of(d));
  std::string text;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    std::string line = "#";
    for (std::size_t c = 0; c < rows[r].size(); ++c) {
      std::size_t width = 0;
      const bool used =
          std::any_of(rows.begin() + 1, rows.end(), [&](const Cells& row) { return !row[c].empty(); });
      if (!used) continue;
      for (const auto& row : rows) width = std::max(width, columns_of(row[c]));
      line += "  " + rows[r][c] + std::string(width - columns_of(rows[r][c]), ' ');
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  }
  return text + '\n';
}

/// Whether Ctrl-C was pressed, which is blocked meanwhile.
bool is_interrupted() {
  sigset_t pending;
  return sigpending(&pending) == 0 && sigismember(&pending, SIGINT) == 1;
}

}  // namespace

void add_discover_options(CLI::App& verb, DiscoverOptions& o) {
  verb.option_defaults()->group("Discovery");
  verb.add_option(
          "--discover", o.url,
          "list what is there and propose a configuration: mqtt://, mqtts://, nats:// or tls:// (NATS) "
          "with [USER@]HOST[:PORT][/FILTER], tcp:// or udp:// with HOST:PORT to listen at, a file, or "
          "- for standard input")
      ->type_name("URL");
  add_number(verb, "--seconds", o.seconds, "S", "how long it looks")->capture_default_str();
  verb.add_option("--password-file", o.password_file,
                  "file whose first line is the password; without USER, for NATS, a token or the .creds "
                  "file")
      ->type_name("FILE");
  verb.add_option("--ca-file", o.ca_file,
                  "certificates that the one of mqtts:// or tls:// is checked against (PEM)")
      ->type_name("FILE");
}

void refuse_without_discovery(const CLI::App& verb, const DiscoverOptions& o) {
  const auto given = [&](const char* name) { return verb.get_option(name)->count() > 0; };
  if (!given("--discover")) {
    for (const char* name : {"--seconds", "--password-file", "--ca-file"})
      if (given(name)) throw UsageError(fmt::format("{}: is for --discover", name));
    return;
  }
  for (const char* name : {"--demo", "--replay", "--rows", "--axis", "--speed", "--check", "--schema",
                           "--data", "--listen", "CONFIG"})
    if (given(name)) throw UsageError(fmt::format("--discover: prints what is there; leave {} out", name));
  if (!(o.seconds >= 0.1 && o.seconds <= 86400.0))
    throw UsageError(fmt::format("--seconds: found {:g}, required 0.1 ... 86400", o.seconds));
}

void run_discover(const DiscoverOptions& o) {
  Place place = place_of(o.url);
  const bool broker = place.where.kind == SourceKind::mqtt || place.where.kind == SourceKind::nats;
  if (!broker && !o.password_file.empty())
    throw UsageError("--password-file: is for brokers, mqtt://, mqtts://, nats:// and tls://");
  if (!place.where.connection.tls && !o.ca_file.empty())
    throw UsageError("--ca-file: is for mqtts:// and tls://");
  const auto file = [](const std::string& name) {
    return name.empty() ? name : std::filesystem::absolute(name).string();
  };
  place.where.connection.password_file = file(o.password_file);
  place.where.connection.ca_file = file(o.ca_file);
  sigset_t interrupt;
  sigemptyset(&interrupt);
  sigaddset(&interrupt, SIGINT);
  pthread_sigmask(SIG_BLOCK, &interrupt, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  const auto found = discovered(place, o.seconds, [] { return !is_interrupted(); });
  if (!found) throw InputError(fmt::format("--discover {}: {}", o.url, message_of(found.error())));
  if (found->empty())
    throw InputError(
        fmt::format("--discover {}: nothing came within {:g} s that are samples; required CSV, JSON, line "
                    "protocol or frames",
                    o.url, o.seconds));
  const auto sources = monitor::sources_of(*found, place.where);
  if (sources.streams.empty()) {
    print_error(table_text(*found));
    throw InputError(fmt::format(
        "--discover {}: nothing of it are samples; required CSV, JSON, line protocol or frames", o.url));
  }
  if (!output_settings().quiet) print(table_text(*found));
  print(monitor::proposal_text(sources.sources, monitor::propose(sources.streams)));
}

}  // namespace resonid::cli
