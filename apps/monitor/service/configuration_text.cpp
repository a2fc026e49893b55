// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <resonid/io/detail/sha256.hpp>

#include "io/described_text.hpp"
#include "io/schema.hpp"
#include "io/toml_text.hpp"
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

/// Whether what an axis has learned depends on this key of it.
bool is_learned(std::string_view key) {
  return key != "source" && key != "channel" && !key.starts_with("alarms.");
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
    return !is_learned(key_in_axis(key.path, axis));
  });
  return io::toml_of(keys);
}

/// Whether an axis, or all of them, begin anew where a key differs.
bool is_learned_from(const std::string& path, const Configuration& configuration) {
  if (path == kOfTheRows || path == "monitor.data") return true;
  std::string_view axis;  // the longest name that fits
  for (const auto& [name, config] : configuration.axes.tables)
    if (is_of_axis(path, name) && name.size() > axis.size()) axis = name;
  return !axis.empty() && is_learned(key_in_axis(path, axis));
}

/// The file that a key names whose value is not a part of the configuration: a token, a certificate.
std::string file_in(const io::DescribedKey& key) {
  if (!key.key.ends_with("_file")) return {};
  const auto table = io::parse_toml("file = " + key.value, key.path);
  return table ? (*table)["file"].value_or(std::string()) : std::string();
}

struct MonitorChecks {
  template <class Config>
  expected<void, Error> operator()(const Config& config) const {
    if constexpr (requires { faults(config); }) {
      if (auto found = faults(config); !found.empty())
        return unexpected<Error>(std::move(found.front().error));
    } else if constexpr (requires { check(config); }) {
      return check(config);
    }
    return {};
  }
};

constexpr std::string_view kIntroduction = R"md(# Configuration of the monitor

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
`motion = "linear"` read kg for kgm2, N for Nm, N/m for Nm/rad and m for rad; of an input in A without `torque_constant` (in %
without `rated_torque`) A (%) for Nm: stiffness in A/rad, inertias in A s2/rad, limits of alarms too. A key that ends in
`_hz`, `_s` or `_bytes` carries its unit. Files are named relative to the folder of the configuration.

Passwords and tokens never stand in the configuration but in files of their own, which only the service should be able to
read. They are not printed, stored, or part of any digest.

## Errors

`resonid monitor --check FILE.toml` says all that can be known beforehand, one line for each error, warning or note, with file, line
and column, what was found and what is required; of `--data` and `--listen` with the option. Of what hangs on a key that cannot
be read nothing is said until it can be. The service does not start with an error. A `note` says what was assumed and
converted of an axis' units: read them, no program knows what a drive sends. Units that contradict one another are errors:
of torque or angle with `motion = "linear"`, of force or length without it, of another quantity than `output_quantity`, or of
another than the column's name tells where no scale converts it. Columns that a CSV file that is there has not in its line of names are warned of.
Two of `input`, `output` and `excitation` are one column in open loop only: the input may be the excitation, the output neither.
What the [service](monitor_service.md) alone can know, a port that is in use, is not looked at. Errors are also keys that can have no effect: a
`torque_constant` without an input in A, a limit of a margin without a `controller`, of the gap without a `baseline`, of dry
friction without `friction = "dry"` (or `"both"`), or of stiffness, inertias, damping or load torque with a `method` other than
`"auto"` and `"physical"`. What `[alarms]` says of all axes is one where no axis at all can obey it.

    m.toml:14:10: axis.x.source: found 'lime' (did you mean 'line'?), required the name of a source; there are: line
    m.toml:9:8: source.line.path: '/var/lib/x.csv' is not there yet
    m.toml:12:1: axis.y: no unit in 'u': Nm assumed

## What can change while it runs

SIGHUP, or `systemctl reload`, reads the file again, and the files that it names: certificates and tokens that were renewed
are taken over, too. If there is an error, it is told and nothing changes; without a change that is said. Else each change is told and the
service stops and starts again within its process, which takes a second or two: history is kept, pages connect again by
themselves, and of the samples of that time each source keeps its [promise](monitor_sources.md). If it cannot start with the
new configuration (a port in use), it goes on with the former one and says why.

| what has changed | the axes |
|---|---|
| `[retention]`, `[publish]`, `[source.NAME]`, `[monitor]` but for the two below | go on with what they have learned |
| `[alarms]`, `alarms`, `source` and `channel` of an axis | go on with what they have learned |
| `false_alarm_interval_s`, the number of axes | the same; it counts for what is learned from then on |
| `row_every_s`, `data` | all begin anew |
| everything else of an `[axis.NAME]`, what the files that it names hold | this axis begins anew; with another rate, length or number of columns the ring of raw samples does, too |
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

std::vector<ConfigurationKey> configuration_keys(const Configuration& configuration) {
  std::vector<ConfigurationKey> all;
  for (auto& key : keys_of_configuration(configuration)) {
    const auto file = file_in(key);
    std::string digest;
    if (!file.empty())
      if (auto known = io::sha256_of_file(configuration.file(file).string())) digest = std::move(*known);
    all.push_back(
        {key.path, std::move(key.value), std::move(digest), is_learned_from(key.path, configuration)});
  }
  return all;
}

std::vector<ConfigurationChange> changes(std::span<const ConfigurationKey> from,
                                         std::span<const ConfigurationKey> to) {
  std::map<std::string_view, const ConfigurationKey*> before;
  for (const auto& key : from) before[key.path] = &key;
  std::vector<ConfigurationChange> all;
  const auto one_sided = [](const ConfigurationKey& key) {  // as all keys of an axis that comes or goes
    return key.learned_from || key.path.starts_with("axis.");
  };
  for (const auto& key : to) {
    const auto known = before.find(key.path);
    if (known == before.end()) {
      all.push_back({key.path, "", key.value, one_sided(key)});
      continue;
    }
    const auto& old = *known->second;
    if (old.value != key.value || old.digest != key.digest)
      all.push_back({key.path, old.value, key.value, key.learned_from});
    before.erase(known);
  }
  for (const auto& key : from)
    if (before.contains(key.path)) all.push_back({key.path, key.value, "", one_sided(key)});
  return all;
}

std::string configuration_document() {
  return std::string(kIntroduction) + io::schema::chapters_of(Configuration{}, MonitorChecks{});
}

}  // namespace resonid::monitor
