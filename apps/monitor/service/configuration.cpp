// SPDX-License-Identifier: MIT
#include "monitor/service/configuration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/io/detail/number_list.hpp>
#include <resonid/io/experiment.hpp>
#include <utility>

#include "io/described_text.hpp"
#include "io/text.hpp"
#include "io/toml_text.hpp"
#include "io/toml_visitor.hpp"

namespace resonid::monitor {
namespace {

/// One table's keys in their order; the first fault counts.
class TableCheck {
 public:
  TableCheck& range(const char* key, double value, double least, double most) {
    if (!(value >= least && value <= most))
      note(key, fmt::format("must be {:g} ... {:g}", least, most), value);
    return *this;
  }
  TableCheck& range(const char* key, std::uint64_t value, std::uint64_t least, std::uint64_t most) {
    if (value < least || value > most)
      note(key, fmt::format("must be {} ... {}", least, most), static_cast<double>(value));
    return *this;
  }
  TableCheck& positive(const char* key, const std::optional<double>& value) {
    if (value && !(*value > 0.0)) note(key, "must be > 0", *value);
    return *this;
  }
  TableCheck& not_zero(const char* key, double value) {
    if (value == 0.0) note(key, "must not be 0", value);
    return *this;
  }
  /// For ever, or as long.
  TableCheck& age(const char* key, double value) {
    if (value != 0.0 && !(value >= 60.0 && std::isfinite(value))) note(key, "must be 0 or >= 60", value);
    return *this;
  }
  TableCheck& given(const char* key, const std::string& text) {
    return require(key, !text.empty(), "must be given");
  }
  TableCheck& require(const char* key, bool fine, const std::string& requirement) {
    if (!fine) note(key, requirement);
    return *this;
  }
  TableCheck& endpoint(const char* key, const std::string& text, std::uint16_t least_port = 1) {
    if (const auto fine = monitor::endpoint(text, least_port); !fine)
      note(key, fine.error().requirement.str());
    return *this;
  }
  TableCheck& listening(const char* key, const std::string& text, bool sockets) {
    if (const auto fine = monitor::listening(text, sockets); !fine) note(key, fine.error().requirement.str());
    return *this;
  }
  TableCheck& pair(const char* first, bool has_first, const char* second, bool has_second) {
    if (has_first && !has_second) note(first, fmt::format("must be given together with {}", second));
    if (has_second && !has_first) note(second, fmt::format("must be given together with {}", first));
    return *this;
  }
  /// MQTT takes a password together with a user only.
  TableCheck& login(const Connection& c) {
    return require("password_file", c.password_file.empty() || !c.user.empty(), "needs a user");
  }
  TableCheck& connection(const Connection& c) {
    endpoint("address", c.address);
    require("ca_file", c.ca_file.empty() || c.tls, "needs tls = true");
    require("certificate_file", c.certificate_file.empty() || c.tls, "needs tls = true");
    return pair("certificate_file", !c.certificate_file.empty(), "key_file", !c.key_file.empty());
  }

  [[nodiscard]] expected<void, Error> result() {
    if (fault_) return unexpected<Error>(std::move(*fault_));
    return {};
  }

 private:
  void note(const char* key, std::string requirement, double value = std::nan("")) {
    if (!fault_) fault_ = Error{key, std::move(requirement), value};
  }
  std::optional<Error> fault_;
};

bool ascends(std::span<const double> values) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!(values[i] > (i == 0 ? 0.0 : values[i - 1]))) return false;
  return true;
}

/// Refuses the first key that is not as by default: nothing is published with these keys.
template <class Config>
expected<void, Error> as_by_default(const Config& config, const char* needs) {
  const auto keys = io::described_keys(config), usual = io::described_keys(Config{});
  const auto [key, same] = std::mismatch(keys.begin(), keys.end(), usual.begin(), usual.end());
  if (key == keys.end()) return {};
  return refuse(key->key, needs);
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

expected<void, Error> check(const MonitorConfig& c) {
  return TableCheck()
      .given("data", c.data)
      .endpoint("listen", c.listen, 0)
      .pair("certificate_file", !c.certificate_file.empty(), "key_file", !c.key_file.empty())
      .range("false_alarm_interval_s", c.false_alarm_interval_s, 60.0, 1e12)
      .range("row_every_s", c.row_every_s, 0.001, 60.0)
      .range("workers", c.workers, 0, 1024)
      .result();
}

expected<void, Error> check(const RetentionConfig& c) {
  return TableCheck()
      .age("rows_s", c.rows_s)
      .age("five_minutes_s", c.five_minutes_s)
      .age("hours_s", c.hours_s)
      .age("days_s", c.days_s)
      .age("evidence_s", c.evidence_s)
      .range("size_bytes", c.size_bytes, 10'000'000, 1'000'000'000'000'000)
      .result();
}

expected<void, Error> check(const MqttPublishConfig& c) {
  if (c.topic.empty() && c.connection.address.empty()) return as_by_default(c, "needs topic and address");
  return TableCheck()
      .pair("topic", !c.topic.empty(), "address", !c.connection.address.empty())
      .require("topic", c.topic.find_first_of("+#") == c.topic.npos, "must not hold the wildcards + and #")
      .range("qos", c.qos, 0, kMostQos)
      .connection(c.connection)
      .login(c.connection)
      .result();
}

expected<void, Error> check(const NatsPublishConfig& c) {
  if (c.subject.empty() && c.connection.address.empty()) return as_by_default(c, "needs subject and address");
  return TableCheck()
      .pair("subject", !c.subject.empty(), "address", !c.connection.address.empty())
      .require("subject", c.subject.find_first_of("*> \t") == c.subject.npos,
               "must hold neither blanks nor the wildcards * and >")
      .connection(c.connection)
      .result();
}

expected<void, Error> check(const PublishConfig& c) {
  const std::string_view url = c.webhook_url;
  const bool http = url.starts_with("http://") || url.starts_with("https://");
  const auto authority = url.substr(0, url.find('/', url.find("//") == url.npos ? 0 : url.find("//") + 2));
  return TableCheck()
      .require("webhook_url", url.empty() || http, "must begin with http:// or https://")
      .require("webhook_url", authority.find('@') == authority.npos,
               "must hold neither user nor password: webhook_token_file is for secrets")
      .require("webhook_token_file", c.webhook_token_file.empty() || !url.empty(),
               "must be given together with webhook_url")
      .result();
}

expected<void, Error> check(const SourceConfig& c) {
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
          .require("durable", c.durable.empty() || !c.stream.empty(), "needs a stream")
          .require("durable", c.durable.find_first_of(".*> \t") == c.durable.npos,
                   "must hold no dots, blanks or wildcards")
          .range("pending_messages", c.pending_messages, 1, 100'000'000)
          .range("pending_bytes", c.pending_bytes, 1'000'000, 1'000'000'000)
          .require("pending_messages",
                   c.stream.empty() || c.pending_messages == SourceConfig{}.pending_messages,
                   "has no meaning with a stream, which keeps what waits")
          .require("pending_bytes", c.stream.empty() || c.pending_bytes == SourceConfig{}.pending_bytes,
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

expected<void, Error> check(const AxisConfig& c) {
  constexpr double kMostRate = 1e6, kLeastRate = 1e-3, kMostDelaySamples = 64.0, kMost = 1e12;
  const auto& chirp = c.chirp;
  const auto& band = c.band_hz;
  const double nyquist_hz = 0.5 * c.sample_rate_hz;
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
      .not_zero("input_scale", c.input_scale)
      .not_zero("excitation_scale", c.excitation_scale)
      .not_zero("output_scale", c.output_scale)
      .not_zero("position_scale", c.position_scale)
      .require("excitation_scale", c.excitation_scale == 1.0 || !c.excitation.empty(), "needs an excitation")
      .require("position_scale", c.position_scale == 1.0 || !c.position.empty(), "needs a position")
      .not_zero("torque_constant", c.torque_constant.value_or(1.0))
      .positive("rated_torque", c.rated_torque)
      .positive("counts_per_rev", c.counts_per_rev)
      .range("delay_s", c.delay_s, 0.0, kMostDelaySamples / c.sample_rate_hz)
      .require("chirp", sound_chirp,
               "must be [FROM, TO, DURATION], frequencies > 0 and below half the sample rate, a duration > 0")
      .require("lines_hz", ascends(lines) && (lines.empty() || lines.back() < nyquist_hz),
               "must ascend, > 0 and below half the sample rate")
      .range("period_samples", c.period_samples, 0, 1'000'000'000)
      .require("band_hz", sound_band, "must be [FROM, TO], > 0, ascending and up to half the sample rate")
      .range("memory_s", c.memory_s, 0.0, kMost)
      .range("drift_per_s", c.drift_per_s.value_or(0.0), 0.0, 1.0)
      .require("drift_per_s", !c.drift_per_s || may_drift,
               fmt::format("needs method = \"physical\" or \"auto\", found \"{}\"", name_of(c.method)))
      .range("baseline_s", c.baseline_s, 1.0, 1e7)
      .range("ring_s", c.ring_s, 10.0, 1e6)
      .result();
}

ConfigurationFile parse_configuration(std::string_view text, std::string_view source,
                                      const std::filesystem::path& folder, const Adjust& adjust) {
  ConfigurationFile file;
  const auto table = io::parse_toml(text, source);
  auto read = table ? io::read_described<Configuration>(*table, source) : unexpected(table.error());
  if (!read) {
    file.findings.errors.push_back(read.error());
    return file;
  }
  file.configuration = std::move(*read);
  file.configuration.folder = folder;
  if (adjust) adjust(file.configuration);
  file.findings = check(file.configuration);
  for (auto* list : {&file.findings.errors, &file.findings.warnings, &file.findings.notes})
    for (auto& finding : *list) finding = io::placed(*table, source, std::move(finding));
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
