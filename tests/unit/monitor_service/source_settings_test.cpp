// SPDX-License-Identifier: MIT
#include "monitor/service/source_settings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <resonid/base/error_text.hpp>

#include "folder.hpp"

namespace resonid::monitor {
namespace {

std::string told(const Format& format) { return fmt::format("{} {}", name_of(format.kind), format.columns); }
std::string told(const Access& access) {
  std::string all;
  if (access.credentials) all = access.credentials->user + " " + access.credentials->password;
  if (access.tls)
    all += fmt::format(" tls {} {} {}", access.tls->authorities.string(), access.tls->certificate.string(),
                       access.tls->key.string());
  return all;
}
std::string told(const TopicSettings& topic) {
  return fmt::format("{} {}", topic.filter, told(topic.format));
}
std::string told(const NatsSettings& nats) {
  return fmt::format("{} {} {}", nats.servers, told(nats.access), nats.token_file.string());
}
std::string told(const StreamSettings& s) { return told(s.format); }
std::string told(const FileSettings& s) {
  return fmt::format("{} {} {}", s.path.string(), told(s.format), s.from_start);
}
std::string told(const TcpSettings& s) {
  return fmt::format("{} {} {}", s.address, told(s.format), s.most_connections);
}
std::string told(const UdpSettings& s) {
  return fmt::format("{} {} {}", s.address, told(s.format), s.receive_buffer_bytes);
}
std::string told(const MqttSourceSettings& s) {
  const auto& b = s.broker;
  return fmt::format("{}:{} {} {} {} {} {}", b.host, b.port, name_of(b.version), b.client_id, told(b.access),
                     told(s.topics.at(0)), s.qos);
}
std::string told(const NatsSourceSettings& s) {
  return fmt::format("{} {} {} {}", told(s.servers), told(s.subjects.at(0)), s.most_messages, s.most_bytes);
}
std::string told(const JetStreamSourceSettings& s) {
  return fmt::format("{} {} {} {}", told(s.servers), s.stream, s.consumer, told(s.subjects));
}
std::string told(const CommandSettings& s) { return fmt::format("{} {}", s.command, told(s.format)); }
std::string told(const DemoSettings& s) {
  std::string all = fmt::format("{}", s.speed);
  for (const auto& machine : s.machines) all += " " + machine.axis;
  return all;
}

/// What is built of the configuration's only source.
std::string built(const Configuration& configuration) {
  const auto settings = source_settings(configuration, "s");
  if (!settings) return message_of(settings.error());
  return std::visit([](const auto& s) { return told(s); }, *settings);
}

/// Another value for the key with this number; which it is.
struct ChangeOne {
  std::size_t number;
  std::string& changed;
  std::size_t at = 0;

  template <class Field>
  void operator()(std::string_view name, Field& field, std::string_view) {
    if (at++ != number) return;
    changed = name;
    static const std::map<std::string_view, std::string> kOther = {{"address", "elsewhere:99"},
                                                                   {"password_file", "other"}};
    if constexpr (std::is_same_v<Field, std::string>)
      field = kOther.contains(name) ? kOther.at(name) : field + "other";
    else if constexpr (std::is_same_v<Field, bool>)
      field = !field;
    else if constexpr (std::is_same_v<Field, std::vector<std::string>>)
      field = {name == "experiments" ? "belt_loosens" : "other"};
    else if constexpr (std::is_enum_v<Field>)
      field = static_cast<Field>(static_cast<int>(field) == 0 ? 1 : 0);
    else
      field += 1;
  }
};

/// Every key of every kind, in one of the ways to use that kind at least.
TEST(SourceSettings, EveryKeyChangesWhatIsBuilt) {
  const Folder folder;
  std::ofstream(folder.path() / "password") << "one\n";
  std::ofstream(folder.path() / "other") << "two\n";
  std::vector<SourceConfig> ways;
  for (const auto& [kind, name] : kSourceKindNames) {
    SourceConfig way;
    way.kind = kind;
    way.path = "samples.csv";
    way.topic = way.subject = "machines";
    way.connection = {"here:1000", "me", "password", true, "ca", "certificate", "key"};
    ways.push_back(way);
    if (kind == SourceKind::nats) {
      way.stream = "stream";
      way.durable = "mine";
      ways.push_back(way);
    }
  }
  std::map<std::string, bool> acts;
  for (const auto& way : ways) {
    Configuration configuration;
    configuration.folder = folder.path();
    configuration.sources.tables["s"] = way;
    const std::string before = built(configuration);
    std::string key = "none yet";
    for (std::size_t k = 1; !key.empty(); ++k) {  // behind the kind
      SourceConfig other = way;
      key.clear();
      describe(ChangeOne{k, key}, other);
      if (key.empty()) break;
      configuration.sources.tables["s"] = other;
      bool& acting = acts[fmt::format("{}.{}", name_of(way.kind), key)];
      acting = acting || built(configuration) != before;
    }
  }
  EXPECT_GT(acts.size(), 40U);
  for (const auto& [key, acting] : acts) EXPECT_TRUE(acting) << key;
}

/// What docs/monitor_sources.md tells of a source is what a configuration makes of it.
TEST(SourceSettings, DefaultsAreThoseOfTheSources) {
  const SourceConfig configured;
  EXPECT_EQ(configured.connections, TcpSettings{}.most_connections);
  EXPECT_EQ(configured.receive_buffer_bytes, static_cast<std::uint64_t>(UdpSettings{}.receive_buffer_bytes));
  EXPECT_EQ(configured.pending_messages, static_cast<std::uint64_t>(NatsSourceSettings{}.most_messages));
  EXPECT_EQ(configured.pending_bytes, static_cast<std::uint64_t>(NatsSourceSettings{}.most_bytes));
  EXPECT_EQ(configured.qos, static_cast<std::uint64_t>(MqttSourceSettings{}.qos));
  EXPECT_EQ(configured.version, MqttSettings{}.version);
  EXPECT_EQ(configured.from_start, FileSettings{}.from_start);
}

TEST(SourceSettings, HalsamplerNumbersItsLinesBy32Bits) {
  Configuration configuration;
  SourceConfig way;
  way.kind = SourceKind::hal;
  way.columns = {"u", "y"};
  configuration.sources.tables["s"] = way;
  const auto settings = source_settings(configuration, "s");
  ASSERT_TRUE(settings.has_value());
  const auto& command = std::get<CommandSettings>(*settings);
  EXPECT_EQ(command.command, (std::vector<std::string>{"halsampler", "-c", "0", "-t"}));
  EXPECT_EQ(command.format.columns, (std::vector<std::string>{"sample", "u", "y"}));
  EXPECT_TRUE(command.format.sample_wraps);
}

TEST(SourceSettings, TwoInstallationsAreTwoMqttClients) {
  const auto client = [](const char* data) {
    Configuration configuration;
    configuration.monitor.data = data;
    SourceConfig way;
    way.kind = SourceKind::mqtt;
    way.topic = "machines";
    way.connection.address = "here:1000";
    configuration.sources.tables["s"] = way;
    return std::get<MqttSourceSettings>(source_settings(configuration, "s").value()).broker.client_id;
  };
  EXPECT_EQ(client("/data/a"), client("/data/b/../a"));
  EXPECT_NE(client("/data/a"), client("/data/b"));
  EXPECT_TRUE(client("/data/a").ends_with("-s")) << client("/data/a");
}

TEST(SourceSettings, WithoutATlsFileThereIsTlsAllTheSame) {
  Configuration configuration;
  SourceConfig way;
  way.kind = SourceKind::nats;
  way.connection.address = "here:1000";
  configuration.sources.tables["s"] = way;
  const std::string before = built(configuration);
  configuration.sources.tables["s"].connection.tls = true;
  EXPECT_NE(built(configuration), before);
}

}  // namespace
}  // namespace resonid::monitor
