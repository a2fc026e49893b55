// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <monitoring/alarm_settings.hpp>
#include <monitoring/axis_spec.hpp>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/identification/options.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/online/excitation/excitation.hpp>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/named_tables.hpp"
#include "monitor/brokers/mqtt_version.hpp"
#include "monitor/samples/format.hpp"

// The configuration of `resonid monitor`, a TOML file: docs/monitor_configuration.md, which these
// descriptions are written from. Files are named relative to the folder that the configuration lies in.
namespace resonid::monitor {

enum class SourceKind : std::uint8_t { standard_input, file, tcp, udp, mqtt, nats, hal, demo };
inline constexpr EnumName<SourceKind> kSourceKindNames[] = {{SourceKind::standard_input, "stdin"},
                                                            {SourceKind::file, "file"},
                                                            {SourceKind::tcp, "tcp"},
                                                            {SourceKind::udp, "udp"},
                                                            {SourceKind::mqtt, "mqtt"},
                                                            {SourceKind::nats, "nats"},
                                                            {SourceKind::hal, "hal"},
                                                            {SourceKind::demo, "demo"}};
[[nodiscard]] constexpr std::span<const EnumName<SourceKind>> enum_names(SourceKind) noexcept {
  return kSourceKindNames;
}

/// The service itself: [monitor].
struct MonitorConfig {
  std::string data;
  std::string listen = "127.0.0.1:8080";
  std::vector<std::string> host_names;
  std::string write_token_file, read_token_file;
  std::string certificate_file, key_file;
  bool insecure = false;
  double false_alarm_interval_s = 3.6e6;
  double row_every_s = 0.1;
  std::uint64_t workers = 0;
};
template <class Visitor>
void describe(Visitor&& v, MonitorConfig& c) {
  v("data", c.data, "folder of everything that is kept; made where there is none");
  v("listen", c.listen, "HOST:PORT at which page and interface are, [::1]:PORT for IPv6");
  v("host_names", c.host_names, "names by which clients may call it, beside localhost and addresses");
  v("write_token_file", c.write_token_file,
    "file with the token, at least 16 characters, that every request needs which changes something; empty: "
    "none is needed on loopback, and elsewhere nothing can be changed");
  v("read_token_file", c.read_token_file, "the same of requests that only read; empty: they need none");
  v("certificate_file", c.certificate_file, "certificate with its chain (PEM), for TLS; with key_file");
  v("key_file", c.key_file, "key of the certificate (PEM)");
  v("insecure", c.insecure, "listen beyond loopback without a token for writes");
  v("false_alarm_interval_s", c.false_alarm_interval_s,
    "mean time between changes that are told and are none, of all axes together, 60 ... 1e12 (s)");
  v("row_every_s", c.row_every_s, "time from estimate to estimate of an axis, 0.001 ... 60 (s)");
  v("workers", c.workers, "threads that follow the axes, 0 ... 1024; 0: one per core");
}

/// How long history is kept: [retention].
struct RetentionConfig {
  double rows_s = 30.0 * 86400.0;
  double five_minutes_s = 365.0 * 86400.0;
  double hours_s = 10.0 * 365.0 * 86400.0;
  double days_s = 0.0;
  double evidence_s = 365.0 * 86400.0;
  std::uint64_t size_bytes = 10'000'000'000;
};
template <class Visitor>
void describe(Visitor&& v, RetentionConfig& c) {
  v("rows_s", c.rows_s, "of rows, one per second; 0: for ever (s)");
  v("five_minutes_s", c.five_minutes_s, "of means over five minutes; 0: for ever (s)");
  v("hours_s", c.hours_s, "of means over hours; 0: for ever (s)");
  v("days_s", c.days_s, "of means over days; 0: for ever (s)");
  v("evidence_s", c.evidence_s, "of the samples around alarms that are closed; 0: for ever (s)");
  v("size_bytes", c.size_bytes,
    "of database, evidence and its reports, without rings, >= 1e7; beyond it the oldest evidence goes first "
    "while it takes more than half, then rows, five minutes, hours, and the rest of evidence (bytes)");
}

/// How a server is reached. Passwords stand in files of their own.
struct Connection {
  std::string address;
  std::string user, password_file;
  bool tls = false;
  std::string ca_file, certificate_file, key_file;
};
template <class Visitor>
void describe(Visitor&& v, Connection& c) {
  v("address", c.address, "HOST:PORT of the server");
  v("user", c.user, "name to log in with; empty: none");
  v("password_file", c.password_file,
    "file whose first line is the password; without a user, of a NATS server: the token, or its .creds file");
  v("tls", c.tls, "speak TLS");
  v("ca_file", c.ca_file,
    "certificates that the server's is checked against (PEM); empty: those of the system");
  v("certificate_file", c.certificate_file,
    "own certificate (PEM), where the server asks for one; with key_file");
  v("key_file", c.key_file, "its key (PEM)");
}

struct MqttPublishConfig {
  std::string topic;
  std::uint64_t qos = 1;
  MqttVersion version = MqttVersion::v3_1_1;
  std::string client_id;
  Connection connection;
};
template <class Visitor>
void describe(Visitor&& v, MqttPublishConfig& c) {
  v("topic", c.topic, "topic of alarms; empty: they are not published there");
  v("qos", c.qos, "quality of service, 0 ... 2");
  v("version", c.version, "that of MQTT; with 5 a broker says when it must not take an alarm");
  v("client_id", c.client_id, "name as a client; empty: a new one each time");
  describe(v, c.connection);
}

struct NatsPublishConfig {
  std::string subject;
  bool stored = false;
  Connection connection;
};
template <class Visitor>
void describe(Visitor&& v, NatsPublishConfig& c) {
  v("subject", c.subject, "subject of alarms; empty: they are not published there");
  v("stored", c.stored,
    "whether a stream of JetStream has to confirm that it keeps the alarm, else the server that it has it");
  describe(v, c.connection);
}

/// Where alarms are told: [publish].
struct PublishConfig {
  std::string webhook_url, webhook_token_file;
  MqttPublishConfig mqtt;
  NatsPublishConfig nats;
};
template <class Visitor>
void describe(Visitor&& v, PublishConfig& c) {
  v("webhook_url", c.webhook_url,
    "address, http:// or https://, that every transition of an alarm is posted to; "
    "empty: none");
  v("webhook_token_file", c.webhook_token_file, "file with the token that is sent along; empty: none");
  v("mqtt", c.mqtt, "alarms to an MQTT broker");
  v("nats", c.nats, "alarms to a NATS server");
}

/// Where samples come from: [source.NAME]. `kind` and `format` decide which of the other fields count.
struct SourceConfig {
  SourceKind kind = SourceKind::standard_input;
  SampleFormat format = SampleFormat::csv;
  std::vector<std::string> columns;
  std::string path;
  bool from_start = true;
  Connection connection;
  std::uint64_t connections = 64;
  std::uint64_t receive_buffer_bytes = 4'194'304;
  std::string topic;
  std::uint64_t qos = 1;
  MqttVersion version = MqttVersion::v3_1_1;
  std::string client_id;
  std::string subject, stream, durable;
  std::uint64_t pending_messages = 65'536, pending_bytes = 67'108'864;
  std::uint64_t hal_channel = 0;
  std::vector<std::string> experiments = {"demo"};
  double speed = 1.0;
};
template <class Visitor>
void describe(Visitor&& v, SourceConfig& c) {
  v("kind", c.kind,
    "stdin, a file that grows, frames or lines by TCP or UDP, an MQTT or a NATS server, HAL of LinuxCNC, or "
    "a "
    "simulated drive");
  if (c.kind == SourceKind::hal) {
    v("hal_channel", c.hal_channel, "channel of the sampler component, 0 ... 7");
    v("columns", c.columns,
      "names of its pins, in their order; overruns: sampler.N.overruns, by which what its FIFO lost is "
      "counted");
    return;
  }
  if (c.kind == SourceKind::demo) {
    v("experiments", c.experiments,
      "experiments, files or shipped ones by name, that are run one beside the other: each is an axis with "
      "its name");
    v("speed", c.speed, "how many times faster than real time, 0.01 ... 1000");
    return;
  }
  v("format", c.format, "how samples are written");
  if (c.format == SampleFormat::csv)
    v("columns", c.columns, "names of the columns, where no line of names comes before the numbers");
  switch (c.kind) {
    case SourceKind::file:
      v("path", c.path, "the file; it may be rotated");
      v("from_start", c.from_start,
        "whether what the file holds at the very first start is read, else what is appended from then on");
      break;
    case SourceKind::tcp:
      v("address", c.connection.address,
        "HOST:PORT to listen at, :PORT for all interfaces; tcp: or unix:/PATH");
      v("connections", c.connections, "clients at once, 1 ... 10000");
      break;
    case SourceKind::udp:
      v("address", c.connection.address,
        "HOST:PORT to listen at, :PORT for all interfaces; tcp: or unix:/PATH");
      v("receive_buffer_bytes", c.receive_buffer_bytes, "buffer of the socket, 1e4 ... 1e9 (bytes)");
      break;
    case SourceKind::mqtt:
      describe(v, c.connection);
      v("topic", c.topic, "topic to subscribe to, with + and # as wildcards");
      v("qos", c.qos, "quality of service, 0 ... 1; 0 loses what comes while nobody listens");
      v("version", c.version, "that of MQTT");
      v("client_id", c.client_id,
        "name as a client, for which the broker keeps messages; empty: made of host, data "
        "folder and the source's name");
      break;
    case SourceKind::nats:
      describe(v, c.connection);
      v("subject", c.subject, "subject to subscribe to, with * and > as wildcards");
      v("stream", c.stream,
        "JetStream that keeps the messages; empty: none does, and what is missed is lost");
      v("durable", c.durable, "name of the consumer in that stream; empty: the source's name");
      v("pending_messages", c.pending_messages, "messages that may wait here, 1 ... 1e8; without a stream");
      v("pending_bytes", c.pending_bytes, "their size, 1e6 ... 1e9, likewise (bytes)");
      break;
    case SourceKind::standard_input:
    case SourceKind::hal:
    case SourceKind::demo:
      break;
  }
}

/// Steps of a load are changes that are none: load_torque tells its limits only.
[[nodiscard]] inline monitoring::AxisAlarmSettings standard_alarms() {
  monitoring::AxisAlarmSettings alarms;
  alarms[monitoring::Watched::load_torque].changes = false;
  return alarms;
}

/// One machine axis: [axis.NAME].
struct AxisConfig {
  std::string source, channel;
  double sample_rate_hz = 0.0;
  std::string input, output, excitation, position;
  data::Motion motion = data::Motion::rotary;
  data::OutputQuantity output_quantity = data::OutputQuantity::velocity;
  std::string input_unit, output_unit;
  double input_scale = 1.0, excitation_scale = 1.0, output_scale = 1.0, position_scale = 1.0;
  std::optional<double> torque_constant, rated_torque, counts_per_rev;
  std::string controller;
  double delay_s = 0.0;
  identification::ExcitationType excitation_type = identification::ExcitationType::automatic;
  std::vector<double> chirp;
  online::LineList lines_hz;
  std::uint64_t period_samples = 0;
  std::vector<double> band_hz;
  identification::TrackMethod method = identification::TrackMethod::automatic;
  double memory_s = 0.0;
  std::optional<double> drift_per_s;
  identification::Friction friction = identification::Friction::automatic;
  std::string start, baseline;
  double baseline_s = 600.0;
  double ring_s = 120.0;
  monitoring::AxisAlarmSettings alarms = standard_alarms();
};
template <class Visitor>
void describe(Visitor&& v, AxisConfig& c) {
  v("source", c.source, "name of the source that its samples come from");
  v("channel", c.channel,
    "what the source calls it: the name in its messages, else their topic or subject; empty: as here");
  v("sample_rate_hz", c.sample_rate_hz, "> 0 ... 1e6 (Hz)");
  v("input", c.input, "column of the torque (force), u");
  v("output", c.output, "column of the measured motion, y");
  v("excitation", c.excitation,
    "column of what is added to the controller's output, ru; empty: there is none");
  v("position", c.position,
    "column of the machine's position, where its stiffness depends on it; empty: none");
  v("motion", c.motion, "rotary (kgm2, Nm/rad, Nms/rad) or linear (kg, N/m, Ns/m)");
  v("output_quantity", c.output_quantity, "velocity, position or acceleration");
  v("input_unit", c.input_unit,
    "unit of the scaled input, Nm, A, % ...; empty: as the column's name tells, else Nm (N)");
  v("output_unit", c.output_unit,
    "unit of the scaled output, rpm, mm/s, deg ...; empty: as the column's name tells, else rad/s (m/s) ...");
  v("input_scale", c.input_scale, "factor of input and excitation, not 0; -1 turns their sign round");
  v("excitation_scale", c.excitation_scale, "further factor of the excitation alone, likewise");
  v("output_scale", c.output_scale, "factor of the output, likewise");
  v("position_scale", c.position_scale, "factor of the position, likewise");
  v("torque_constant", c.torque_constant,
    "torque (force) per current, of an input in A and its excitation, which is in A too (or by "
    "excitation_scale); not 0 (Nm/A)");
  v("rated_torque", c.rated_torque, "what 100 % are, of an input in per cent, > 0 (Nm)");
  v("counts_per_rev", c.counts_per_rev, "resolution of an encoder whose counts are the output, > 0");
  v("controller", c.controller,
    "the velocity controller, pi:KP,TI (Nms/rad, s) or a file with its transfer function; empty: not known");
  v("delay_s", c.delay_s, "known delay of the output, 0 ... 64 samples (s)");
  v("excitation_type", c.excitation_type, "how the drive is excited");
  v("chirp", c.chirp,
    "[FROM, TO, DURATION] of a linear chirp from sample 0 on (Hz, Hz, s); empty: found in the samples");
  v("lines_hz", c.lines_hz, "frequencies to follow, ascending; empty: found in the samples (Hz)");
  v("period_samples", c.period_samples, "period of the excitation; 0: found in the samples");
  v("band_hz", c.band_hz, "[FROM, TO] in which the drive is looked at; empty: where it is excited (Hz)");
  v("method", c.method, "how the drive is followed");
  v("memory_s", c.memory_s, "how long the estimate remembers; 0: chosen (s)");
  v("drift_per_s", c.drift_per_s,
    "physical only: relative change of the stiffness per second that the machine can reach; empty: chosen "
    "(1/s)");
  v("friction", c.friction,
    "what is followed of friction on the driven side; only with dry or both has dry friction a figure, and "
    "alarms");
  v("start", c.start, "result of `resonid identify --json` that the estimate begins with; empty: learned");
  v("baseline", c.baseline,
    "result of `resonid identify --json` to which the gap is taken; empty: there is no gap");
  v("baseline_s", c.baseline_s, "how long a figure is watched before its changes can be told, 1 ... 1e7 (s)");
  v("ring_s", c.ring_s, "length of the samples that are kept, evidence of alarms, 10 ... 1e6 (s)");
  v("alarms", c.alarms, "alarms of this axis");
}

struct Configuration {
  MonitorConfig monitor;
  RetentionConfig retention;
  PublishConfig publish;
  io::NamedTables<SourceConfig> sources;
  monitoring::AxisAlarmSettings alarms = standard_alarms();
  io::NamedTables<AxisConfig> axes;
  std::filesystem::path folder;  ///< That file names are relative to; not in the file.

  [[nodiscard]] std::filesystem::path file(std::string_view name) const { return folder / name; }
};
template <class Visitor>
void describe(Visitor&& v, Configuration& c) {
  v("monitor", c.monitor, "the service");
  v("retention", c.retention, "how long history is kept");
  v("publish", c.publish, "where alarms are told");
  v("source", c.sources, "where samples come from");
  v("alarms", c.alarms, "alarms of every axis that does not say otherwise");
  c.axes.standard.alarms = c.alarms;
  v("axis", c.axes, "a machine axis");
}

/// What is wrong with one key of a table.
struct TableFault {
  Error error;
  bool depends = false;  ///< Other keys of the table have a say.
};
/// One of each key at most.
[[nodiscard]] std::vector<TableFault> faults(const MonitorConfig& config);
[[nodiscard]] std::vector<TableFault> faults(const RetentionConfig& config);
[[nodiscard]] std::vector<TableFault> faults(const MqttPublishConfig& config);
[[nodiscard]] std::vector<TableFault> faults(const NatsPublishConfig& config);
[[nodiscard]] std::vector<TableFault> faults(const PublishConfig& config);
[[nodiscard]] std::vector<TableFault> faults(const SourceConfig& config);
/// Without its alarms, which have a check of their own.
[[nodiscard]] std::vector<TableFault> faults(const AxisConfig& config);

/// What there is to say of a configuration. Fields as "axis.x.delay_s".
struct Findings {
  std::vector<Error> errors;    ///< Each keeps the service from running.
  std::vector<Error> warnings;  ///< These do not.
  std::vector<Error> notes;     ///< What was assumed and converted of units.
};

/// Fields that are told elsewhere than in the file, and how they are called there: "monitor.listen",
/// "--listen".
using ToldElsewhere = std::map<std::string, std::string>;

/// Where a configuration comes from.
struct Origin {
  /// Keys and tables that could not be read. What depends on them is not known, and nothing is said of it.
  std::set<std::string> unread;
  ToldElsewhere elsewhere;
};

/// Everything that can be known before it runs: ranges of every key, axes without a source, two axes on one
/// channel, ports and clients' names that are used twice, files that are missing, broken or not readable,
/// tokens, certificates and keys that web server and brokers' clients would refuse, a data folder that cannot
/// be written, and what is open to everybody. Files are read, nothing is written.
[[nodiscard]] Findings check(const Configuration& configuration, const Origin& origin = {});

struct ConfigurationFile {
  Configuration configuration;
  Findings findings;  ///< Each with file, line and column.

  [[nodiscard]] bool usable() const noexcept { return findings.errors.empty(); }
};
/// Sets what is told elsewhere than in the file, before it is checked; findings name it as it is called
/// there.
using Adjust = std::function<ToldElsewhere(Configuration&)>;
/// A configuration, each key of it that cannot be read, and what check() finds. What is no such file is one
/// error.
[[nodiscard]] ConfigurationFile read_configuration(const std::filesystem::path& path,
                                                   const Adjust& adjust = {});
/// As above for a text in memory; `source` stands for the file name in messages.
[[nodiscard]] ConfigurationFile parse_configuration(std::string_view text, std::string_view source,
                                                    const std::filesystem::path& folder,
                                                    const Adjust& adjust = {});

/// A name as axes and sources may have, made of any text; short enough for a number behind it.
[[nodiscard]] std::string axis_name(std::string_view text);

/// HOST:PORT taken apart; of [::1]:PORT the host is ::1.
struct Endpoint {
  std::string host;
  std::uint16_t port = 0;

  /// Only this machine reaches it.
  [[nodiscard]] bool is_loopback() const;
};
/// `least_port`: 0 where any free port will do.
[[nodiscard]] expected<Endpoint, Error> endpoint(std::string_view text, std::uint16_t least_port = 1);

/// Where a source listens: HOST:PORT, :PORT for all interfaces (host ::), with `sockets` also unix:/PATH (all
/// of it the host, port 0).
[[nodiscard]] expected<Endpoint, Error> listening(std::string_view text, bool sockets);

/// The first line of a regular file, without white space around it. Errors: no such file, not readable,
/// shorter than `least` characters. Messages never tell what it holds.
[[nodiscard]] expected<std::string, Error> read_secret(const std::filesystem::path& path,
                                                       std::size_t least = 1);
inline constexpr std::size_t kShortestToken = 16;

/// Figures of an axis whose changes are alarms: its detectors (monitoring/threshold.hpp).
[[nodiscard]] std::size_t detectors_of(const AxisConfig& axis);

/// What a demo source calls the drive of one of its experiments: the name of the experiment or of its file.
[[nodiscard]] std::string demo_axis(const std::string& experiment);

/// What is known of each axis, in the order of their names: units converted to SI as in recordings,
/// controllers and results read, the false-alarm interval of the installation divided over all detectors. For
/// a configuration without errors; else the first error in question.
[[nodiscard]] expected<std::vector<monitoring::AxisSpec>> axis_specs(const Configuration& configuration);

// The configuration as it counts, defaults filled in, is TOML again. Files with which an axis begins stand in
// it with their digest.

[[nodiscard]] std::string configuration_text(const Configuration& configuration);
/// One axis' part, with what of [monitor] its rows depend on. Empty: there is no such axis.
[[nodiscard]] std::string axis_text(const Configuration& configuration, const std::string& axis);
/// The part of axis_text() that what it has learned depends on: where that is the same, a snapshot may be
/// taken up again.
[[nodiscard]] std::string learning_text(const Configuration& configuration, const std::string& axis);
/// SHA-256 of one of these texts, 64 hexadecimal digits.
[[nodiscard]] std::string configuration_digest(std::string_view text);

/// A key of a configuration as it was read.
struct ConfigurationKey {
  std::string path;           ///< "axis.x.delay_s"
  std::string value;          ///< As in TOML.
  std::string digest;         ///< Of the file that it names, where another content is another configuration.
  bool learned_from = false;  ///< The axis begins anew where it differs, or all of them.
};
/// All keys, and what is in the files that they name.
[[nodiscard]] std::vector<ConfigurationKey> configuration_keys(const Configuration& configuration);

struct ConfigurationChange {
  std::string path;
  std::string before, after;  ///< As in TOML; empty: not there. The same: what the file holds has changed.
  bool begins_anew = false;   ///< The axis, or all of them; else axes go on with what they have learned.

  friend bool operator==(const ConfigurationChange&, const ConfigurationChange&) = default;
};
/// Every key that differs, in the order of `to`, then those that are gone.
[[nodiscard]] std::vector<ConfigurationChange> changes(std::span<const ConfigurationKey> from,
                                                       std::span<const ConfigurationKey> to);

/// docs/monitor_configuration.md but for its comment: every table and key with type, default, range, unit and
/// where it applies.
[[nodiscard]] std::string configuration_document();

}  // namespace resonid::monitor
