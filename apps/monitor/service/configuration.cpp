// SPDX-License-Identifier: MIT
#include "monitor/service/configuration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <resonid/io/detail/number_list.hpp>
#include <resonid/io/experiment.hpp>
#include <utility>

#include "io/described_text.hpp"
#include "io/text.hpp"
#include "io/toml_text.hpp"
#include "io/toml_visitor.hpp"

namespace resonid::monitor {
namespace {

/// One table's keys in their order; of each the first fault counts.
class TableCheck {
 public:
  TableCheck& range(const char* key, double value, double least, double most) {
    return require(key, value >= least && value <= most, fmt::format("must be {:g} ... {:g}", least, most),
                   value);
  }
  TableCheck& range(const char* key, std::uint64_t value, std::uint64_t least, std::uint64_t most) {
    return require(key, value >= least && value <= most, fmt::format("must be {} ... {}", least, most),
                   static_cast<double>(value));
  }
  TableCheck& positive(const char* key, const std::optional<double>& value) {
    return require(key, !value || *value > 0.0, "must be > 0", value.value_or(0.0));
  }
  TableCheck& not_zero(const char* key, double value) {
    return require(key, value != 0.0, "must not be 0", value);
  }
  /// For ever, or as long.
  TableCheck& age(const char* key, double value) {
    const bool fine = value == 0.0 || (value >= 60.0 && std::isfinite(value));
    return require(key, fine, "must be 0 or >= 60", value);
  }
  TableCheck& given(const char* key, const std::string& text) {
    return require(key, !text.empty(), "must be given");
  }
  TableCheck& require(const char* key, bool fine, const std::string& requirement,
                      double value = std::nan("")) {
    if (!fine) note({Error{key, requirement, value}, false});
    return *this;
  }
  /// What this key asks of others.
  TableCheck& depends(const char* key, bool fine, const std::string& requirement) {
    if (!fine) note({Error{key, requirement}, true});
    return *this;
  }
  TableCheck& endpoint(const char* key, const std::string& text, std::uint16_t least_port = 1) {
    const auto fine = monitor::endpoint(text, least_port);
    return require(key, fine.has_value(), fine ? "" : fine.error().requirement.str());
  }
  TableCheck& listening(const char* key, const std::string& text, bool sockets) {
    const auto fine = monitor::listening(text, sockets);
    return require(key, fine.has_value(), fine ? "" : fine.error().requirement.str());
  }
  TableCheck& pair(const char* first, bool has_first, const char* second, bool has_second) {
    depends(first, has_second || !has_first, fmt::format("must be given together with {}", second));
    return depends(second, has_first || !has_second, fmt::format("must be given together with {}", first));
  }
  /// MQTT takes a password together with a user only.
  TableCheck& login(const Connection& c) {
    return depends("password_file", c.password_file.empty() || !c.user.empty(), "needs a user");
  }
  /// An address that is not given is told by the keys that need one.
  TableCheck& connection(const Connection& c) {
    if (!c.address.empty()) endpoint("address", c.address);
    depends("ca_file", c.ca_file.empty() || c.tls, "needs tls = true");
    depends("certificate_file", c.certificate_file.empty() || c.tls, "needs tls = true");
    return pair("certificate_file", !c.certificate_file.empty(), "key_file", !c.key_file.empty());
  }
  /// Nothing is published with these keys.
  template <class Config>
  TableCheck& as_by_default(const Config& config, const char* needs) {
    const auto keys = io::described_keys(config), usual = io::described_keys(Config{});
    for (std::size_t i = 0; i < keys.size(); ++i)
      if (keys[i] != usual[i]) note({Error{keys[i].key, needs}, true});
    return *this;
  }

  [[nodiscard]] std::vector<TableFault> result() { return std::move(faults_); }

 private:
  void note(TableFault fault) {
    const auto of_same_key = [&](const TableFault& f) { return f.error.field == fault.error.field.view(); };
    if (std::none_of(faults_.begin(), faults_.end(), of_same_key)) faults_.push_back(std::move(fault));
  }
  std::vector<TableFault> faults_;
};

bool ascends(std::span<const double> values) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!(values[i] > (i == 0 ? 0.0 : values[i - 1]))) return false;
  return true;
}

constexpr std::uint64_t kMostQos = 2;
constexpr std::uint64_t kMostSourceQos = 1;  // with 2 a message is acknowledged before its samples are kept

/// A topic's levels: wildcards stand for whole levels, # for the last ones.
bool is_topic_filter(std::string_view topic) {
  for (std::size_t i = 0; i < topic.size(); ++i) {
    if (topic[i] != '+' && topic[i] != '#') continue;
    const bool begins = i == 0 || topic[i - 1] == '/';
    const bool ends = i + 1 == topic.size() || (topic[i] == '+' && topic[i + 1] == '/');
    if (!begins || !ends) return false;
  }
  return topic.find('\0') == topic.npos;
}

/// Reads a file on behind what is wrong in it: each key that is refused is told and taken out.
class Reading {
 public:
  Reading(toml::table table, std::string_view source) : table_(std::move(table)), source_(source) {}

  /// What could be read of it, if anything.
  std::optional<Configuration> configuration() {
    constexpr std::size_t kMostErrors = 100;  // for each, all is read again
    while (errors_.size() < kMostErrors) {
      auto read = io::read_described<Configuration>(table_, source_);
      if (read) return std::move(*read);
      const Error& fault = read.error();
      const std::string path = take_out(table_, fault.where.view(), "");
      // A kind that could not be read is none that is missing; tables at one place are taken out one by one.
      const bool told = !errors_.empty() && errors_.back().where == fault.where.view();
      if (!told && !unread_.contains(path + ".kind")) errors_.push_back(fault);
      if (path.empty()) break;
      unread_.insert(path);
      if (fault.field.empty()) misspelt(path, fault.requirement.view());
    }
    if (errors_.size() == kMostErrors)
      errors_.push_back({"", fmt::format("these are the first {}; further ones are not told", kMostErrors)});
    return std::nullopt;
  }
  [[nodiscard]] const std::vector<Error>& errors() const noexcept { return errors_; }
  [[nodiscard]] const std::set<std::string>& unread() const noexcept { return unread_; }

 private:
  [[nodiscard]] bool is_at(const toml::node& node, std::string_view where) const {
    if (io::position(source_, node.source()) == where) return true;
    const auto* list = node.as_array();
    return list != nullptr &&
           std::any_of(list->begin(), list->end(), [&](const toml::node& e) { return is_at(e, where); });
  }
  /// Path of what was there; the innermost: `[a.b]` is the place of `a` as well.
  std::string take_out(toml::table& table, std::string_view where, const std::string& outer) {
    for (auto&& [key, node] : table) {
      std::string path = outer.empty() ? std::string(key.str()) : fmt::format("{}.{}", outer, key.str());
      if (auto* inner = node.as_table())
        if (auto found = take_out(*inner, where, path); !found.empty()) return found;
      if (!is_at(node, where) && io::position(source_, key.source()) != where) continue;
      table.erase(std::string(key.str()));
      return path;
    }
    return {};
  }
  /// The key that was meant is not missing.
  void misspelt(const std::string& path, std::string_view requirement) {
    constexpr std::string_view kMeant = "(did you mean '";
    const auto at = requirement.find(kMeant);
    if (at == requirement.npos) return;
    const auto begin = at + kMeant.size();
    const auto dot = path.rfind('.');
    unread_.insert((dot == path.npos ? "" : path.substr(0, dot + 1)) +
                   std::string(requirement.substr(begin, requirement.find('\'', begin) - begin)));
  }

  toml::table table_;
  std::string_view source_;
  std::vector<Error> errors_;
  std::set<std::string> unread_;
};

}  // namespace

expected<Endpoint, Error> endpoint(std::string_view text, std::uint16_t least_port) {
  const auto refused = [&] {
    return refuse("", fmt::format("found {}, required HOST:PORT with a port {} ... 65535, an IPv6 address as "
                                  "[::1]:PORT",
                                  io::in_quotes(text), least_port));
  };
  const auto colon = text.rfind(':');
  if (colon == text.npos) return refused();
  std::string_view host = text.substr(0, colon);
  const auto port = io::parse_number(text.substr(colon + 1));
  const bool bracketed = host.starts_with('[') && host.ends_with(']');
  if (bracketed) host = host.substr(1, host.size() - 2);
  const bool named = !host.empty() && host.find_first_of(" \t/@[]") == host.npos &&
                     (bracketed || host.find(':') == host.npos);
  if (!named || !port || *port != std::floor(*port) || *port < least_port || *port > 65535.0)
    return refused();
  return Endpoint{std::string(host), static_cast<std::uint16_t>(*port)};
}

expected<Endpoint, Error> listening(std::string_view text, bool sockets) {
  constexpr std::string_view kSocket = "unix:/";
  if (sockets && text.starts_with(kSocket) && text.size() > kSocket.size())
    return Endpoint{std::string(text), 0};
  auto at = endpoint(text.starts_with(':') ? "[::]" + std::string(text) : std::string(text));
  if (!at)
    return refuse("",
                  fmt::format("found {}, required HOST:PORT with a port 1 ... 65535, [IPV6]:PORT, :PORT for "
                              "all interfaces{}",
                              io::in_quotes(text), sockets ? ", or unix:/PATH" : ""));
  return at;
}

bool Endpoint::is_loopback() const {
  return host.starts_with("unix:") || host == "localhost" || host == "::1" || host.starts_with("127.");
}

std::vector<TableFault> faults(const MonitorConfig& c) {
  return TableCheck()
      .given("data", c.data)
      .endpoint("listen", c.listen, 0)
      .pair("certificate_file", !c.certificate_file.empty(), "key_file", !c.key_file.empty())
      .range("false_alarm_interval_s", c.false_alarm_interval_s, 60.0, 1e12)
      .range("row_every_s", c.row_every_s, 0.001, 60.0)
      .range("workers", c.workers, 0, 1024)
      .result();
}

std::vector<TableFault> faults(const RetentionConfig& c) {
  return TableCheck()
      .age("rows_s", c.rows_s)
      .age("five_minutes_s", c.five_minutes_s)
      .age("hours_s", c.hours_s)
      .age("days_s", c.days_s)
      .age("evidence_s", c.evidence_s)
      .range("size_bytes", c.size_bytes, 10'000'000, 1'000'000'000'000'000)
      .result();
}

std::vector<TableFault> faults(const MqttPublishConfig& c) {
  if (c.topic.empty() && c.connection.address.empty())
    return TableCheck().as_by_default(c, "needs topic and address").result();
  return TableCheck()
      .pair("topic", !c.topic.empty(), "address", !c.connection.address.empty())
      .require("topic", c.topic.find_first_of("+#") == c.topic.npos, "must not hold the wildcards + and #")
      .range("qos", c.qos, 0, kMostQos)
      .connection(c.connection)
      .login(c.connection)
      .result();
}

std::vector<TableFault> faults(const NatsPublishConfig& c) {
  if (c.subject.empty() && c.connection.address.empty())
    return TableCheck().as_by_default(c, "needs subject and address").result();
  return TableCheck()
      .pair("subject", !c.subject.empty(), "address", !c.connection.address.empty())
      .require("subject", c.subject.find_first_of("*> \t") == c.subject.npos,
               "must hold neither blanks nor the wildcards * and >")
      .connection(c.connection)
      .result();
}

std::vector<TableFault> faults(const PublishConfig& c) {
  const std::string_view url = c.webhook_url;
  const bool http = url.starts_with("http://") || url.starts_with("https://");
  const auto authority = url.substr(0, url.find('/', url.find("//") == url.npos ? 0 : url.find("//") + 2));
  return TableCheck()
      .require("webhook_url", url.empty() || http, "must begin with http:// or https://")
      .require("webhook_url", authority.find('@') == authority.npos,
               "must hold neither user nor password: webhook_token_file is for secrets")
      .depends("webhook_token_file", c.webhook_token_file.empty() || !url.empty(),
               "must be given together with webhook_url")
      .result();
}

std::vector<TableFault> faults(const SourceConfig& c) {
  TableCheck t;
  switch (c.kind) {
    case SourceKind::standard_input:
      break;
    case SourceKind::file:
      t.given("path", c.path);
      break;
    case SourceKind::tcp:
      t.given("address", c.connection.address)
          .listening("address", c.connection.address, true)
          .range("connections", c.connections, 1, 10'000);
      break;
    case SourceKind::udp:
      t.given("address", c.connection.address)
          .listening("address", c.connection.address, false)
          .range("receive_buffer_bytes", c.receive_buffer_bytes, 10'000, 1'000'000'000);
      break;
    case SourceKind::mqtt:
      t.given("address", c.connection.address)
          .given("topic", c.topic)
          .connection(c.connection)
          .require("topic", is_topic_filter(c.topic), "must have + as a whole level and # as the last one")
          .range("qos", c.qos, 0, kMostSourceQos)
          .login(c.connection);
      break;
    case SourceKind::nats:
      t.given("address", c.connection.address)
          .given("subject", c.subject)
          .connection(c.connection)
          .require("subject", c.subject.find_first_of(" \t") == c.subject.npos, "must hold no blanks")
          .depends("durable", c.durable.empty() || !c.stream.empty(), "needs a stream")
          .require("durable", c.durable.find_first_of(".*> \t") == c.durable.npos,
                   "must hold no dots, blanks or wildcards")
          .range("pending_messages", c.pending_messages, 1, 100'000'000)
          .range("pending_bytes", c.pending_bytes, 1'000'000, 1'000'000'000)
          .depends("pending_messages",
                   c.stream.empty() || c.pending_messages == SourceConfig{}.pending_messages,
                   "has no meaning with a stream, which keeps what waits")
          .depends("pending_bytes", c.stream.empty() || c.pending_bytes == SourceConfig{}.pending_bytes,
                   "has no meaning with a stream, which keeps what waits");
      break;
    case SourceKind::hal:
      t.require("columns", !c.columns.empty(), "must be given").range("hal_channel", c.hal_channel, 0, 7);
      break;
    case SourceKind::demo:
      t.require("experiments", !c.experiments.empty(), "must name one at least")
          .range("speed", c.speed, 0.01, 1e3);
      break;
  }
  return t.result();
}

std::vector<TableFault> faults(const AxisConfig& c) {
  constexpr double kMostRate = 1e6, kLeastRate = 1e-3, kMostDelaySamples = 64.0, kMost = 1e12;
  const auto& chirp = c.chirp;
  const auto& band = c.band_hz;
  // Without a rate nothing is known of what it bounds.
  const bool rated = c.sample_rate_hz >= kLeastRate && c.sample_rate_hz <= kMostRate;
  const double rate_hz = rated ? c.sample_rate_hz : std::numeric_limits<double>::infinity();
  const double most_delay_s =
      rated ? kMostDelaySamples / c.sample_rate_hz : std::numeric_limits<double>::max();
  const double nyquist_hz = 0.5 * rate_hz;
  const bool sound_chirp = chirp.empty() || (chirp.size() == 3 && chirp[0] > 0.0 && chirp[0] < nyquist_hz &&
                                             chirp[1] > 0.0 && chirp[1] < nyquist_hz && chirp[2] > 0.0);
  const bool sound_band = band.empty() || (band.size() == 2 && ascends(band) && band[1] <= nyquist_hz);
  const auto lines = c.lines_hz.hz();
  const bool may_drift =
      c.method == identification::TrackMethod::automatic || c.method == identification::TrackMethod::physical;
  return TableCheck()
      .given("source", c.source)
      .range("sample_rate_hz", c.sample_rate_hz, kLeastRate, kMostRate)
      .given("input", c.input)
      .given("output", c.output)
      .depends(
          "output", c.output.empty() || c.output != c.input,
          fmt::format("found {}, the column of the input; required another one", io::in_quotes(c.output)))
      .depends("excitation", c.excitation.empty() || c.excitation != c.output,
               fmt::format("found {}, the column of the output; required another one",
                           io::in_quotes(c.excitation)))
      .not_zero("input_scale", c.input_scale)
      .not_zero("excitation_scale", c.excitation_scale)
      .not_zero("output_scale", c.output_scale)
      .not_zero("position_scale", c.position_scale)
      .depends("excitation_scale", c.excitation_scale == 1.0 || !c.excitation.empty(), "needs an excitation")
      .depends("position_scale", c.position_scale == 1.0 || !c.position.empty(), "needs a position")
      .not_zero("torque_constant", c.torque_constant.value_or(1.0))
      .positive("rated_torque", c.rated_torque)
      .positive("counts_per_rev", c.counts_per_rev)
      .range("delay_s", c.delay_s, 0.0, most_delay_s)
      .require("chirp", sound_chirp,
               "must be [FROM, TO, DURATION], frequencies > 0 and below half the sample rate, a duration > 0")
      .require("lines_hz", ascends(lines) && (lines.empty() || lines.back() < nyquist_hz),
               "must ascend, > 0 and below half the sample rate")
      .range("period_samples", c.period_samples, 0, 1'000'000'000)
      .require("band_hz", sound_band, "must be [FROM, TO], > 0, ascending and up to half the sample rate")
      .range("memory_s", c.memory_s, 0.0, kMost)
      .range("drift_per_s", c.drift_per_s.value_or(0.0), 0.0, 1.0)
      .depends("drift_per_s", !c.drift_per_s || may_drift,
               fmt::format("needs method = \"physical\" or \"auto\", found \"{}\"", name_of(c.method)))
      .range("baseline_s", c.baseline_s, 1.0, 1e7)
      .range("ring_s", c.ring_s, 10.0, 1e6)
      .result();
}

ConfigurationFile parse_configuration(std::string_view text, std::string_view source,
                                      const std::filesystem::path& folder, const Adjust& adjust) {
  ConfigurationFile file;
  const auto table = io::parse_toml(text, source);
  auto rest = io::parse_toml(text, source);  // a copy would have no places
  if (!rest) {
    file.findings.errors.push_back(rest.error());
    return file;
  }
  Reading reading(std::move(*rest), source);
  auto configuration = reading.configuration();
  file.findings.errors = reading.errors();
  if (!configuration) return file;
  file.configuration = std::move(*configuration);
  file.configuration.folder = folder;
  Origin origin{reading.unread(), {}};
  if (adjust) origin.elsewhere = adjust(file.configuration);
  for (const auto& [field, option] : origin.elsewhere) origin.unread.erase(field);
  auto found = check(file.configuration, origin);
  for (auto* list : {&found.errors, &found.warnings, &found.notes})
    for (auto& finding : *list) {
      const auto option = origin.elsewhere.find(finding.field.str());
      if (option == origin.elsewhere.end())
        finding = io::placed(*table, source, std::move(finding));
      else
        finding.field = option->second;
    }
  std::move(found.errors.begin(), found.errors.end(), std::back_inserter(file.findings.errors));
  file.findings.warnings = std::move(found.warnings);
  file.findings.notes = std::move(found.notes);
  return file;
}

ConfigurationFile read_configuration(const std::filesystem::path& path, const Adjust& adjust) {
  const auto text = io::read_experiment_text(path);
  if (text) return parse_configuration(*text, path.string(), path.parent_path(), adjust);
  ConfigurationFile file;
  file.findings.errors.push_back(text.error());
  return file;
}

std::string demo_axis(const std::string& experiment) {
  return std::filesystem::path(experiment).stem().string();
}

}  // namespace resonid::monitor
