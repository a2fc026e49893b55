// SPDX-License-Identifier: MIT
#include "monitor/service/install.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <resonid/io/experiment.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <utility>

#include "monitor/service/axis_spec_of.hpp"
#include "monitor/service/source_settings.hpp"
#include "monitoring/threshold.hpp"

namespace resonid::monitor {
namespace {

using Made = expected<std::unique_ptr<Source>, Error>;

Made plain(expected<std::unique_ptr<NetworkSource>, Error> made) {
  if (!made) return tl::unexpected(std::move(made.error()));
  return std::unique_ptr<Source>(std::move(*made));
}

Format format_of(const SourceConfig& c) { return {c.format, c.columns}; }

TopicSettings topic_of(const SourceConfig& c, const std::string& filter) { return {filter, format_of(c)}; }

expected<Access, Error> access_of(const Configuration& all, const Connection& c) {
  Access access;
  if (!c.user.empty()) {
    Credentials credentials{c.user, {}};
    if (!c.password_file.empty()) {
      auto password = read_secret(all.file(c.password_file));
      if (!password) return tl::unexpected(std::move(password.error()));
      credentials.password = std::move(*password);
    }
    access.credentials = std::move(credentials);
  }
  const auto file = [&](const std::string& name) {
    return name.empty() ? std::filesystem::path() : all.file(name);
  };
  if (c.tls) access.tls = Tls{file(c.ca_file), file(c.certificate_file), file(c.key_file)};
  return access;
}

/// Experiments as machines that run on: each is an axis with its name, or that of its file.
expected<std::vector<DemoMachine>, Error> machines_of(const Configuration& all, const SourceConfig& c) {
  constexpr double kRun_s = 4.0 * 3600.0;
  const auto shipped = io::shipped_experiments();
  std::vector<DemoMachine> machines;
  for (const auto& name : c.experiments) {
    DemoMachine machine{demo_axis(name), {}};
    if (std::any_of(shipped.begin(), shipped.end(), [&](const auto& s) { return s.name == name; })) {
      machine.experiment = io::shipped_experiment(name);
    } else {
      auto read = io::read_experiment(all.file(name));
      if (!read) return tl::unexpected(std::move(read.error()));
      machine.experiment = std::move(*read);
    }
    machine.experiment.excitation.repeat = true;
    machine.experiment.run.duration_s = std::max(machine.experiment.run.duration_s, kRun_s);
    machines.push_back(std::move(machine));
  }
  return machines;
}

using Settings = expected<SourceSettings, Error>;

/// No other installation's at the same broker, which would throw this one out; the same for ever.
std::string client_id_of(const Configuration& all, const std::string& source) {
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host.front() = '\0';
  std::error_code code;
  const auto data = std::filesystem::weakly_canonical(all.file(all.monitor.data), code);
  const auto digest = configuration_digest(fmt::format("{}\n{}", host.data(), data.string()));
  return fmt::format("resonid-{}-{}", digest.substr(0, 12), source);
}

Settings mqtt_settings(const Configuration& all, const std::string& name, const SourceConfig& c) {
  auto access = access_of(all, c.connection);
  if (!access) return tl::unexpected(std::move(access.error()));
  const auto at = endpoint(c.connection.address);
  if (!at) return tl::unexpected(at.error());
  MqttSourceSettings settings;
  settings.broker.host = at->host;
  settings.broker.port = at->port;
  settings.broker.client_id = c.client_id.empty() ? client_id_of(all, name) : c.client_id;
  settings.broker.version = c.version;
  settings.broker.access = std::move(*access);
  settings.topics = {topic_of(c, c.topic)};
  settings.qos = static_cast<int>(c.qos);
  return settings;
}

expected<NatsSettings, Error> nats_servers_of(const Configuration& all, const Connection& c) {
  auto access = access_of(all, c);
  if (!access) return tl::unexpected(std::move(access.error()));
  NatsSettings servers;
  servers.servers = {nats_url(c.address, c.tls)};
  servers.access = std::move(*access);
  if (c.user.empty() && !c.password_file.empty()) servers.token_file = all.file(c.password_file);
  return servers;
}

Settings nats_settings(const Configuration& all, const std::string& name, const SourceConfig& c) {
  auto servers = nats_servers_of(all, c.connection);
  if (!servers) return tl::unexpected(std::move(servers.error()));
  if (!c.stream.empty()) {
    JetStreamSourceSettings settings;
    settings.servers = std::move(*servers);
    settings.stream = c.stream;
    settings.consumer = c.durable.empty() ? name : c.durable;
    settings.subjects = topic_of(c, c.subject);
    return settings;
  }
  NatsSourceSettings settings;
  settings.servers = std::move(*servers);
  settings.subjects = {topic_of(c, c.subject)};
  settings.most_messages = static_cast<int>(c.pending_messages);
  settings.most_bytes = static_cast<int>(c.pending_bytes);
  return settings;
}

}  // namespace

Settings source_settings(const Configuration& all, const std::string& name) {
  const SourceConfig& c = all.sources.tables.at(name);
  switch (c.kind) {
    case SourceKind::standard_input:
      return StreamSettings{format_of(c), 0};
    case SourceKind::file: {
      FileSettings settings;
      settings.path = all.file(c.path);
      settings.format = format_of(c);
      settings.from_start = c.from_start;
      return settings;
    }
    case SourceKind::tcp: {
      TcpSettings settings;
      settings.address = c.connection.address;
      settings.format = format_of(c);
      settings.most_connections = static_cast<std::size_t>(c.connections);
      return settings;
    }
    case SourceKind::udp:
      return UdpSettings{c.connection.address, format_of(c), static_cast<int>(c.receive_buffer_bytes)};
    case SourceKind::mqtt:
      return mqtt_settings(all, name, c);
    case SourceKind::nats:
      return nats_settings(all, name, c);
    case SourceKind::hal: {
      CommandSettings settings;
      settings.command = {"halsampler", "-c", std::to_string(c.hal_channel),
                          "-t"};  // with each sample's number
      settings.format.sample_wraps = true;
      settings.format.columns = {"sample"};
      settings.format.columns.insert(settings.format.columns.end(), c.columns.begin(), c.columns.end());
      return settings;
    }
    case SourceKind::demo: {
      auto machines = machines_of(all, c);
      if (!machines) return tl::unexpected(std::move(machines.error()));
      return DemoSettings{std::move(*machines), c.speed};
    }
  }
  return tl::unexpected(Error{"kind", "must be one that there is"});
}

namespace {

struct MakeSource {
  Axes& axes;
  Made operator()(StreamSettings s) const { return make_stream_source(std::move(s), axes); }
  Made operator()(FileSettings s) const { return make_file_source(std::move(s), axes); }
  Made operator()(TcpSettings s) const { return plain(make_tcp_source(std::move(s), axes)); }
  Made operator()(UdpSettings s) const { return plain(make_udp_source(std::move(s), axes)); }
  Made operator()(MqttSourceSettings s) const { return make_mqtt_source(std::move(s), axes); }
  Made operator()(NatsSourceSettings s) const { return make_nats_source(std::move(s), axes); }
  Made operator()(JetStreamSourceSettings s) const { return make_jetstream_source(std::move(s), axes); }
  Made operator()(CommandSettings s) const { return make_command_source(std::move(s), axes); }
  Made operator()(DemoSettings s) const { return make_demo_source(std::move(s), axes); }
};

/// None where no file is named; one that cannot be read must not open the page to everybody.
expected<std::string, Error> token_of(const Configuration& all, const std::string& file) {
  if (file.empty()) return std::string();
  return read_secret(all.file(file), kShortestToken);
}

using MadePublisher = expected<std::unique_ptr<Publisher>, Error>;

MadePublisher make_webhook(const Configuration& all) {
  WebhookSettings settings;
  settings.url = all.publish.webhook_url;
  if (const auto& file = all.publish.webhook_token_file; !file.empty()) {
    auto token = read_secret(all.file(file));
    if (!token) return tl::unexpected(std::move(token.error()));
    settings.bearer = std::move(*token);
  }
  return make_webhook_publisher(std::move(settings));
}

MadePublisher make_mqtt_target(const Configuration& all) {
  const auto& c = all.publish.mqtt;
  auto access = access_of(all, c.connection);
  if (!access) return tl::unexpected(std::move(access.error()));
  const auto at = endpoint(c.connection.address);
  if (!at) return tl::unexpected(at.error());
  MqttSettings settings;
  settings.host = at->host;
  settings.port = at->port;
  settings.version = c.version;
  settings.client_id = c.client_id;
  settings.access = std::move(*access);
  return make_mqtt_publisher(std::move(settings), static_cast<int>(c.qos));
}

MadePublisher make_nats_target(const Configuration& all) {
  auto servers = nats_servers_of(all, all.publish.nats.connection);
  if (!servers) return tl::unexpected(std::move(servers.error()));
  return make_nats_publisher(std::move(*servers), all.publish.nats.stored);
}

}  // namespace

std::vector<InstalledTarget> targets_of(const std::shared_ptr<const Configuration>& configuration) {
  const auto& p = configuration->publish;
  std::vector<InstalledTarget> targets;
  const auto add = [&](const char* name, const std::string& topic,
                       MadePublisher (*make)(const Configuration&)) {
    targets.push_back({name, topic, [configuration, make] { return make(*configuration); }});
  };
  if (!p.webhook_url.empty()) add("webhook", "alarms", make_webhook);
  if (!p.mqtt.topic.empty()) add("mqtt", p.mqtt.topic, make_mqtt_target);
  if (!p.nats.subject.empty()) add("nats", p.nats.subject, make_nats_target);
  return targets;
}

expected<Installation, Error> installation_of(const Configuration& configuration, std::string version) {
  Installation all;
  const auto& m = configuration.monitor;
  all.data = configuration.file(m.data);
  all.version = std::move(version);
  all.false_alarm_interval_s = m.false_alarm_interval_s;
  all.engine.workers = static_cast<std::size_t>(m.workers);
  const auto& r = configuration.retention;
  all.retention.rows_s = r.rows_s;
  all.retention.five_minutes_s = r.five_minutes_s;
  all.retention.hours_s = r.hours_s;
  all.retention.days_s = r.days_s;
  all.retention.evidence_s = r.evidence_s;
  all.retention.bytes = r.size_bytes;
  const auto at = endpoint(m.listen, 0);
  if (!at) return tl::unexpected(at.error());
  all.web.listening = {at->host, at->port,
                       m.certificate_file.empty() ? "" : configuration.file(m.certificate_file).string(),
                       m.key_file.empty() ? "" : configuration.file(m.key_file).string()};
  all.web.host_names = m.host_names;
  all.web.host_names.push_back(at->host);  // the address that is told at the start must answer
  auto write_token = token_of(configuration, m.write_token_file);
  if (!write_token) return tl::unexpected(std::move(write_token.error()));
  auto read_token = token_of(configuration, m.read_token_file);
  if (!read_token) return tl::unexpected(std::move(read_token.error()));
  all.web.write_token = std::move(*write_token);
  all.web.read_token = std::move(*read_token);
  auto specs = axis_specs(configuration);
  if (!specs) return tl::unexpected(std::move(specs.error()));
  for (auto& spec : *specs) {
    const auto& c = configuration.axes.tables.at(spec.name);
    InstalledAxis axis;
    axis.columns = {c.excitation, c.input, c.output, c.position};
    axis.source = c.source;
    axis.channel = c.channel;
    axis.ring_s = c.ring_s;
    axis.configuration = learning_text(configuration, spec.name);
    axis.controller = c.controller;
    if (!c.controller.empty() && !tells_controller(c.controller))  // for a command that is run elsewhere
      axis.controller = configuration.file(c.controller).string();
    axis.spec = std::move(spec);
    all.axes.push_back(std::move(axis));
  }
  // One configuration for all sources, for as long as they are.
  const auto kept = std::make_shared<const Configuration>(configuration);
  for (const auto& [name, source] : configuration.sources.tables)
    all.sources.push_back({name, std::string(name_of(source.kind)), [kept, name = name](Axes& axes) -> Made {
                             auto settings = source_settings(*kept, name);
                             if (!settings) return tl::unexpected(std::move(settings.error()));
                             return std::visit(MakeSource{axes}, std::move(*settings));
                           }});
  all.targets = targets_of(kept);
  return all;
}

Installation demo_installation(const std::filesystem::path& data, double speed, std::string version) {
  constexpr double kBaseline_s = 60.0;
  Installation all;
  all.data = data;
  all.version = std::move(version);
  auto machines = demo_machines();
  constexpr std::size_t kDetectors = 10;  // of each axis
  all.engine.stale_s = 5.0;
  for (const auto& machine : machines) {
    const auto& e = machine.experiment;
    InstalledAxis axis;
    axis.spec.name = machine.axis;
    axis.spec.sample_rate_hz = e.run.sample_rate_hz;
    axis.spec.motion = e.drive.motion;
    axis.spec.baseline_s = kBaseline_s;
    axis.spec.track.common.delay_s = e.measurement.delay_s;
    if (e.controller.kind == plant::ControllerKind::pi) {
      axis.spec.track.common.controller = pi(e.controller.gain, e.controller.integral_time_s);
      axis.controller = fmt::format("pi:{},{}", e.controller.gain, e.controller.integral_time_s);
    }
    axis.spec.alarms = standard_alarms();
    axis.spec.false_alarm_interval_s =
        *monitoring::detector_interval_s(all.false_alarm_interval_s, kDetectors * machines.size());
    axis.columns = {"ru", "u", "y", ""};
    axis.source = "demo";
    axis.ring_s *= std::max(1.0, 0.5 * speed);  // a snapshot lets go of what came in 10 s
    axis.configuration = "demo " + machine.axis;
    all.axes.push_back(std::move(axis));
  }
  all.sources.push_back({"demo", "demo", [machines, speed](Axes& axes) -> Made {
                           return make_demo_source({machines, speed}, axes);
                         }});
  return all;
}

}  // namespace resonid::monitor
