// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <limits>
#include <resonid/base/error_text.hpp>
#include <string>

#include "io/described_text.hpp"
#include "io/schema.hpp"
#include "io/toml_visitor.hpp"

namespace resonid::io::described_test {

enum class Kind { plain, odd };
inline constexpr EnumName<Kind> kKinds[] = {{Kind::plain, "plain"}, {Kind::odd, "odd"}};
constexpr std::span<const EnumName<Kind>> enum_names(Kind) noexcept { return kKinds; }

struct Limits {
  double low = -std::numeric_limits<double>::infinity();
  double margin = 1.0;
};
template <class Visitor>
void describe(Visitor&& v, Limits& c) {
  v("low", c.low, "least value; -inf: none");
  v("margin", c.margin, "> 0");
}

struct Machine {
  Kind kind = Kind::plain;
  std::string name;
  std::optional<double> drift;
  std::vector<std::string> columns;
  bool on = false;
  std::uint64_t count = 3;
  std::vector<double> band;
  online::LineList lines;
  Limits limits;
};
template <class Visitor>
void describe(Visitor&& v, Machine& c) {
  v("kind", c.kind, "plain or odd");
  v("name", c.name, "any text");
  if (c.kind == Kind::odd) v("drift", c.drift, "chosen where there is none");
  v("columns", c.columns, "texts");
  v("on", c.on, "whether");
  v("count", c.count, "how many");
  v("band", c.band, "two numbers");
  v("lines", c.lines, "lines");
  v("limits", c.limits, "what is allowed");
}

struct File {
  Limits limits{0.5, 1.0};
  NamedTables<Machine> machines;
};
template <class Visitor>
void describe(Visitor&& v, File& c) {
  v("limits", c.limits, "of every machine");
  c.machines.standard.limits = c.limits;
  v("machine", c.machines, "a machine");
}

expected<File> read(std::string_view text) {
  const auto table = parse_toml(text, "m.toml");
  if (!table) return unexpected(table.error());
  return read_described<File>(*table, "m.toml");
}
std::string refusal(std::string_view text) {
  const auto file = read(text);
  return file ? "taken" : message_of(file.error());
}

constexpr std::string_view kWhole = R"([machine."a.b"]
kind = "odd"
name = 'say "x"'
drift = 1e-3
columns = ["u", "y"]
band = [1, 2.5]
lines = "1:3:1"
limits.low = -inf

[machine.c]
kind = "plain"
count = 7

[limits]
low = 2
)";

TEST(Described, ReadsTextsListsAndNamedTables) {
  const auto file = read(kWhole);
  ASSERT_TRUE(file.has_value()) << message_of(file.error());
  ASSERT_EQ(file->machines.tables.size(), 2U);
  const Machine& odd = file->machines.tables.at("a.b");
  EXPECT_EQ(odd.kind, Kind::odd);
  EXPECT_EQ(odd.name, "say \"x\"");
  EXPECT_EQ(odd.drift, 1e-3);
  EXPECT_EQ(odd.columns, (std::vector<std::string>{"u", "y"}));
  EXPECT_EQ(odd.band, (std::vector<double>{1.0, 2.5}));
  EXPECT_EQ(odd.lines.count, 3U);
  EXPECT_EQ(odd.limits.low, -std::numeric_limits<double>::infinity());
  const Machine& plain = file->machines.tables.at("c");
  EXPECT_EQ(plain.count, 7U);
  EXPECT_FALSE(plain.drift.has_value());
  EXPECT_EQ(plain.limits.low, 2.0) << "begins as [limits], although that comes later in the file";
}

TEST(Described, RefusesWithPlaceAndRequirement) {
  EXPECT_EQ(refusal("[machine.x]\nname = 'a'"),
            "m.toml:1:1: [machine.x] has no key 'kind', required: plain or odd");
  EXPECT_EQ(refusal("[machine.x]\nkind = 'plain'\nname = 3"),
            "m.toml:3:8: machine.x.name: found 3, required a text in quotes; it is: any text");
  EXPECT_EQ(refusal("[machine.x]\nkind = 'plain'\ncolumns = ['u', 2]"),
            "m.toml:3:17: machine.x.columns: found 2, required a list of texts; it is: texts");
  EXPECT_EQ(refusal("machine.x = 1"), "m.toml:1:13: machine.x: found 1, required a table; it is: a machine");
  EXPECT_EQ(refusal("[limits]\nmargin = inf"),
            "m.toml:2:10: limits.margin: found inf, required a number; it is: > 0")
      << "only a key whose default is infinite may be";
  EXPECT_EQ(refusal("[limits]\nlow = nan"),
            "m.toml:2:7: limits.low: found nan, required a number; it is: least value; -inf: none");
  EXPECT_EQ(
      refusal("[machine.x]\nkind = 'plain'\ndrift = 1"),
      "m.toml:3:1: unknown key 'machine.x.drift' with kind = 'plain'; known here: kind, name, columns, on, "
      "count, band, lines, limits");
}

TEST(Described, PlacesRefusalsOfAnyDepth) {
  const auto table = parse_toml(kWhole, "m.toml");
  ASSERT_TRUE(table.has_value());
  const auto place = [&](const char* field) {
    return message_of(placed(*table, "m.toml", Error{field, "must be so"}));
  };
  EXPECT_EQ(place("machine.a.b.name"), "m.toml:3:8: machine.a.b.name: must be so");
  EXPECT_EQ(place("machine.a.b.limits.low"), "m.toml:8:14: machine.a.b.limits.low: must be so");
  EXPECT_EQ(place("machine.c.limits.low"),
            "m.toml:10:1: [machine.c] has no key 'limits.low', which must be so");
  EXPECT_EQ(place("machine.c"), "m.toml:10:1: machine.c: must be so");
  EXPECT_EQ(place("other.key"), "m.toml:1:1: has no table [other]; its key must be so");
}

/// What is written is read again as the same, whatever the names and texts.
TEST(Described, WritesWhatItReads) {
  auto file = read(kWhole);
  ASSERT_TRUE(file.has_value());
  file->machines.tables.at("c").name = "tab\t, quote \", backslash \\, \x01, \xc3\xa4";
  const auto keys = described_keys(*file);
  const std::string text = toml_of(keys);
  EXPECT_NE(text.find("[machine.\"a.b\".limits]\nlow = -inf\n"), std::string::npos) << text;
  const auto again = read(text);
  ASSERT_TRUE(again.has_value()) << message_of(again.error()) << text;
  EXPECT_EQ(described_keys(*again), keys);
  EXPECT_EQ(again->machines.tables.at("c").name, file->machines.tables.at("c").name);
}

struct Checks {
  expected<void, Error> operator()(const Machine& m) const {
    if (m.name.empty()) return unexpected<Error>(Error{"name", "must be given"});
    if (m.columns.empty()) return unexpected<Error>(Error{"columns", "must be given"});
    return {};
  }
  template <class Config>
  expected<void, Error> operator()(const Config&) const {
    return {};
  }
};

TEST(Described, IsDocumented) {
  EXPECT_EQ(schema::chapters_of(File{}, Checks{}), R"(
## [limits]: of every machine

| key | type | default | meaning, range (unit) |
|---|---|---|---|
| `low` | number | 0.5 | least value; -inf: none |
| `margin` | number | 1 | > 0 |

## [machine.NAME]: a machine

| key | type | default | only for | meaning, range (unit) |
|---|---|---|---|---|
| `kind` | `"plain"`, `"odd"` | required |  | plain or odd |
| `name` | text | required |  | any text |
| `drift` | number | empty | odd | chosen where there is none |
| `columns` | list of texts | required |  | texts |
| `on` | `true`, `false` | `false` |  | whether |
| `count` | whole number | 3 |  | how many |
| `band` | list of numbers | empty |  | two numbers |
| `lines` | list of numbers or `"FIRST:LAST:STEP"` | empty |  | lines |

## [machine.NAME.limits]: what is allowed

Keys as in [limits].
)");
}

}  // namespace resonid::io::described_test
