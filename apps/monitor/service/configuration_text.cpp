// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <resonid/io/detail/sha256.hpp>

#include "io/described_text.hpp"
#include "io/schema.hpp"
#include "monitor/service/configuration.hpp"

namespace resonid::monitor {
namespace {

constexpr std::string_view kOfTheRows = "monitor.row_every_s";  ///< Every axis depends on it.

/// Keys of an axis that may name a file which its estimate begins with.
constexpr std::array<std::string_view, 3> kFiles = {"controller", "start", "baseline"};

bool is_of_axis(const std::string& path, const std::string& axis) {
  return path.starts_with("axis." + axis + ".");
}

/// "alarms.stiffness.low" of "axis.x.alarms.stiffness.low": the name may hold dots, tables of an axis not.
std::string_view key_in_axis(std::string_view path, std::string_view axis) {
  return path.substr(std::string_view("axis.").size() + axis.size() + 1);
}

/// All keys, files with their digests as comments.
std::vector<io::DescribedKey> keys_of_configuration(const Configuration& configuration) {
  auto keys = io::described_keys(configuration);
  std::map<std::string, std::string> files;  // by path
  for (const auto& [name, axis] : configuration.axes.tables) {
    const std::array<const std::string*, 3> values = {&axis.controller, &axis.start, &axis.baseline};
    for (std::size_t i = 0; i < kFiles.size(); ++i)
      if (!values[i]->empty()) files[fmt::format("axis.{}.{}", name, kFiles[i])] = *values[i];
  }
  for (auto& key : keys) {
    const auto named = files.find(key.path);
    if (named == files.end()) continue;
    if (const auto digest = io::sha256_of_file(configuration.file(named->second).string()))
      key.value += "  # sha256 " + *digest;
  }
  return keys;
}

std::string text_of_axis(const Configuration& configuration, const std::string& axis, bool learning_only) {
  const auto named = configuration.axes.tables.find(axis);
  if (named == configuration.axes.tables.end()) return {};
  Configuration one;
  one.monitor = configuration.monitor;
  one.folder = configuration.folder;
  one.axes.tables = {*named};
  auto keys = keys_of_configuration(one);
  std::erase_if(keys, [&](const io::DescribedKey& key) {
    if (key.path == kOfTheRows) return false;
    if (!is_of_axis(key.path, axis)) return true;
    if (!learning_only) return false;
    const auto own = key_in_axis(key.path, axis);
    return own == "source" || own == "channel" || own.starts_with("alarms.");
  });
  return io::toml_of(keys);
}

/// What a key of [monitor] asks for.
Effect effect_of_service(std::string_view path) {
  if (path == kOfTheRows) return Effect::new_axis;
  return path == "monitor.false_alarm_interval_s" ? Effect::at_once : Effect::restart;
}

Effect effect_of(const std::string& path, const Configuration& from, const Configuration& to) {
  if (path.starts_with("monitor.")) return effect_of_service(path);
  if (path.starts_with("source.")) return Effect::new_source;
  if (!path.starts_with("axis.")) return Effect::at_once;
  std::string_view axis;  // the longest name that fits
  for (const auto* configuration : {&from, &to})
    for (const auto& [name, config] : configuration->axes.tables)
      if (is_of_axis(path, name) && name.size() > axis.size()) axis = name;
  const auto key = key_in_axis(path, axis);
  const bool in_both =
      from.axes.tables.contains(std::string(axis)) && to.axes.tables.contains(std::string(axis));
  if (!in_both) return Effect::new_axis;
  if (key == "source" || key == "channel") return Effect::new_source;
  return key.starts_with("alarms.") ? Effect::at_once : Effect::new_axis;
}

struct MonitorChecks {
  template <class Config>
  expected<void, Error> operator()(const Config& config) const {
    if constexpr (requires { check(config); })
      return check(config);
    else
      return {};
  }
};

constexpr std::string_view kIntroduction = R"md(# Configuration of the monitor

<!-- Written by a test with RESONID_WRITE_DOCS=1; change the descriptions in apps/monitor/service, not this file. -->

`resonid monitor FILE.toml` reads one [TOML](https://toml.io) file: where samples come from, which machine axes are in them,
and when people are to be told. [monitor.toml](../examples/monitor/monitor.toml) is one to begin with:

```toml
[monitor]
data = "data"                 # everything that is kept

[source.line]
kind = "mqtt"
address = "broker:1883"
topic = "drives/#"
format = "json"

[axis.gantry-x]
source = "line"
channel = "drives/x"          # the name in the messages, else their topic
sample_rate_hz = 2000.0
input = "iq_A"                # columns; units stand in names, or in input_unit and output_unit
output = "speed_rpm"
excitation = "ru"
torque_constant = 0.62        # Nm/A
controller = "pi:1.036,0.147"
delay_s = 0.004

[alarms.stiffness]
severity = "high"
```

Required are `[monitor]` with `data`, and an `[axis.NAME]` with its source; every other table, and every key that has a
default, may be left out. "Only for" names the values of `kind` for which a key exists; in a source of another kind it is an
error. Names of sources and axes are 1 ... 64 letters, digits, `_`, `-` and `.`; with a dot they stand in quotes:
`[axis."line.3"]`. Numbers are finite; only limits of alarms may be `inf` and `-inf`. Units are those of a rotary drive; with
`motion = "linear"` read kg for kgm2, N for Nm, N/m for Nm/rad and m for rad. A key that ends in `_hz`, `_s` or `_bytes`
carries its unit. Files are named relative to the folder of the configuration.

Passwords and tokens never stand in the configuration but in files of their own, which only the service should be able to
read. They are not printed, stored, or part of any digest.

## Errors

`resonid monitor --check FILE.toml` says all that can be known beforehand, one line for each error or warning, with file, line
and column, what was found and what is required. The service does not start with an error.

    m.toml:14:10: axis.x.source: found 'lime' (did you mean 'line'?), required the name of a source; there are: line
    m.toml:9:8: source.line.path: '/var/lib/x.csv' is not there yet

## What can change while it runs

SIGHUP, or `systemctl reload`, reads the file again. If it has an error, nothing changes.

| keys | taken over |
|---|---|
| `[retention]`, `[publish]`, `[alarms]`, `alarms` of an axis | at once |
| `false_alarm_interval_s` | at once, by what is learned from then on |
| `[source.NAME]`, `source` and `channel` of an axis | at once; the source is opened anew, axes go on with what they know |
| `row_every_s`, and everything else of an `[axis.NAME]`, axes that come or go | at once; the axis begins anew |
| everything else of `[monitor]` | at the next start |
)md";

}  // namespace

std::string configuration_text(const Configuration& configuration) {
  return io::toml_of(keys_of_configuration(configuration));
}

std::string axis_text(const Configuration& configuration, const std::string& axis) {
  return text_of_axis(configuration, axis, false);
}

std::string learning_text(const Configuration& configuration, const std::string& axis) {
  return text_of_axis(configuration, axis, true);
}

std::string configuration_digest(std::string_view text) {
  io::Sha256 digest;
  digest.add(text);
  return digest.hexadecimal();
}

std::vector<ConfigurationChange> changes(const Configuration& from, const Configuration& to) {
  const auto before = keys_of_configuration(from), after = keys_of_configuration(to);
  std::map<std::string_view, std::string_view> values;
  for (const auto& key : before) values[key.path] = key.value;
  std::vector<ConfigurationChange> all;
  const auto add = [&](const std::string& path, std::string_view old_value, std::string_view new_value) {
    all.push_back({path, std::string(old_value), std::string(new_value), effect_of(path, from, to)});
  };
  for (const auto& key : after) {
    const auto old_value = values.find(key.path);
    if (old_value == values.end()) {
      add(key.path, "", key.value);
    } else {
      if (old_value->second != key.value) add(key.path, old_value->second, key.value);
      values.erase(old_value);
    }
  }
  for (const auto& key : before)
    if (values.contains(key.path)) add(key.path, key.value, "");
  return all;
}

std::string configuration_document() {
  return std::string(kIntroduction) + io::schema::chapters_of(Configuration{}, MonitorChecks{});
}

}  // namespace resonid::monitor
