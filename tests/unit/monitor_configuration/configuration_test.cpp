// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

#include "configurations.hpp"

namespace resonid::monitor::test {
namespace {

Configuration configuration_of(const TemporaryFolder& folder, const std::string& text) {
  auto file = parse_configuration(text, "m.toml", folder.path());
  EXPECT_EQ(messages(file.findings.errors), std::vector<std::string>{});
  return std::move(file.configuration);
}

constexpr const char* kMore = R"(controller = "c.json"
alarms.damping.high = 0.2
[axis."x.2"]
source = "t"
sample_rate_hz = 100
input = "u"
output = "y"
drift_per_s = 0.25
[source.t]
kind = "tcp"
address = "127.0.0.1:9000"
)";
constexpr const char* kController = R"({"numerator": [1, -0.9], "denominator": [1, -1]})";

/// Read again, the text is the same configuration, with the same text.
TEST(ConfigurationText, IsTheConfigurationAgain) {
  const TemporaryFolder folder;
  (void)folder.file("c.json", kController);
  const auto configuration = configuration_of(folder, std::string(kLeast) + kMore);
  const auto text = configuration_text(configuration);
  const auto again = configuration_of(folder, text);
  EXPECT_EQ(configuration_text(again), text);
  EXPECT_EQ(changes(configuration_keys(configuration), configuration_keys(again)),
            std::vector<ConfigurationChange>{});
  EXPECT_NE(text.find("\n[axis.\"x.2\"]\nsource = \"t\"\nchannel = \"\"\nsample_rate_hz = 100\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("port"), 0U);
}

TEST(ConfigurationText, DoesNotDependOnHowItIsWritten) {
  const TemporaryFolder folder;
  const auto text = [&](const std::string& written) {
    return configuration_text(configuration_of(folder, written));
  };
  const auto plain = text(std::string(kLeast));
  EXPECT_EQ(text("# a comment\naxis.x = {output = 'y', source = 'in', input = 'u', sample_rate_hz = 5e2}\n"
                 "source.in.kind = 'stdin'\n[monitor]\nworkers = 0\ndata = 'data'\n"),
            plain);
  EXPECT_NE(text(std::string(kLeast) + "delay_s = 1e-3"), plain);
}

/// The digest of "abc" is that of NIST FIPS 180-4.
TEST(ConfigurationText, HasTheUsualDigest) {
  EXPECT_EQ(configuration_digest("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(ConfigurationText, SaysWhatAnAxisDependsOn) {
  const TemporaryFolder folder;
  const auto controller = folder.file("c.json", kController);
  const std::string base = std::string(kLeast) + kMore;
  const auto before = configuration_of(folder, base);
  EXPECT_EQ(axis_text(before, "y"), "");
  const auto same = [&](const std::string& written, bool of_axis, bool of_learning) {
    const auto after = configuration_of(folder, written);
    EXPECT_EQ(axis_text(after, "x") == axis_text(before, "x"), of_axis) << written;
    EXPECT_EQ(learning_text(after, "x") == learning_text(before, "x"), of_learning) << written;
  };
  const auto with = [&](const std::string& old_text, const std::string& new_text) {
    std::string text = base;
    return text.replace(text.find(old_text), old_text.size(), new_text);
  };
  same(base, true, true);
  same(with("drift_per_s = 0.25", "drift_per_s = 0.5"), true, true);  // of another axis
  same(with("[monitor]", "[monitor]\nworkers = 2"), true, true);
  same(with("damping.high = 0.2", "damping.high = 0.3"), false, true);
  same(with("controller", "delay_s = 0.01\ncontroller"), false, false);
  same(with("[monitor]", "[monitor]\nrow_every_s = 1"), false, false);
  const auto learned = learning_text(before, "x");
  (void)folder.file("c.json", R"({"numerator": [2, -0.9], "denominator": [1, -1]})");
  EXPECT_NE(learning_text(before, "x"), learned) << "the file holds another controller";
}

TEST(ConfigurationChanges, SayWhatTheyAskFor) {
  const TemporaryFolder folder;
  (void)folder.file("c.json", kController);
  const std::string base = std::string(kLeast) + kMore;
  const auto before = configuration_of(folder, base);
  std::string text = base;
  const auto put = [&](const std::string& old_text, const std::string& new_text) {
    text.replace(text.find(old_text), old_text.size(), new_text);
  };
  put("[monitor]", "[monitor]\nlisten = '127.0.0.1:81'\nfalse_alarm_interval_s = 36000\nrow_every_s = 1");
  put("damping.high = 0.2", "damping.high = inf");
  put("controller", "channel = 'first'\ndelay_s = 0.01\ncontroller");
  put("9000", "9001");
  text += "[retention]\nrows_s = 3600\n[publish]\nwebhook_url = 'http://a'\n";
  const auto after = configuration_of(folder, text);
  std::map<std::string, ConfigurationChange> found;
  for (const auto& change : changes(configuration_keys(before), configuration_keys(after)))
    found[change.path] = change;
  using C = ConfigurationChange;
  const std::vector<C> required = {{"monitor.listen", "\"127.0.0.1:8080\"", "\"127.0.0.1:81\"", false},
                                   {"monitor.false_alarm_interval_s", "3600000", "36000", false},
                                   {"monitor.row_every_s", "0.1", "1", true},
                                   {"retention.rows_s", "2592000", "3600", false},
                                   {"publish.webhook_url", "\"\"", "\"http://a\"", false},
                                   {"source.t.address", "\"127.0.0.1:9000\"", "\"127.0.0.1:9001\"", false},
                                   {"axis.x.channel", "\"\"", "\"first\"", false},
                                   {"axis.x.delay_s", "0", "0.01", true},
                                   {"axis.x.alarms.damping.high", "0.2", "inf", false}};
  for (const auto& change : required) EXPECT_EQ(found[change.path], change) << change.path;
  EXPECT_EQ(found.size(), required.size());

  // An axis whose name is the beginning of another's comes and goes.
  const auto one = configuration_of(folder, std::string(kLeast));
  for (const auto& change : changes(configuration_keys(before), configuration_keys(one))) {
    if (!change.path.starts_with("axis.x.2.")) continue;
    EXPECT_EQ(change.after, "");
    EXPECT_TRUE(change.begins_anew) << change.path;
  }
  const auto come = changes(configuration_keys(one), configuration_keys(before));
  const ConfigurationChange drift = {"axis.x.2.drift_per_s", "", "0.25", true};
  EXPECT_EQ(std::count(come.begin(), come.end(), drift), 1);
}

/// What a controller was, and a token, is known as it was when they were read.
TEST(ConfigurationChanges, SeeThatAFileHoldsSomethingElse) {
  const TemporaryFolder folder;
  (void)folder.file("c.json", kController);
  (void)folder.file("token", "0123456789abcdef\n");
  const auto configuration = configuration_of(
      folder, "[monitor]\nwrite_token_file = 'token'\n" + std::string(kLeast).substr(10) + kMore);
  const auto before = configuration_keys(configuration);
  (void)folder.file("token", "fedcba9876543210\n");
  (void)folder.file("c.json", R"({"numerator": [2, -0.9], "denominator": [1, -1]})");
  const auto found = changes(before, configuration_keys(configuration));
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0], (ConfigurationChange{"monitor.write_token_file", "\"token\"", "\"token\"", false}));
  EXPECT_EQ(found[1].path, "axis.x.controller");
  EXPECT_TRUE(found[1].begins_anew);
}

/// docs/monitor_configuration.md comes from the descriptions. With RESONID_WRITE_DOCS in the environment it
/// is written instead.
TEST(ConfigurationDocument, IsTheOneInDocs) {
  const std::filesystem::path page = std::filesystem::path(RESONID_DOCS_DIR) / "monitor_configuration.md";
  auto written = configuration_document();
  written.insert(written.find('\n') + 1,
                 "\n<!-- Written by a test with RESONID_WRITE_DOCS=1; change the descriptions in "
                 "apps/monitor/service, not this file. -->\n");
  if (std::getenv("RESONID_WRITE_DOCS") != nullptr) std::ofstream(page, std::ios::binary) << written;
  EXPECT_EQ(contents_of(page), written);
}

TEST(ConfigurationDocument, NamesEveryKeyOfEverySource) {
  const auto written = configuration_document();
  for (const char* row :
       {"| `kind` | `\"stdin\"`, `\"file\"`", "| `topic` | text | required | mqtt |",
        "| `data` | text | required |", "| `experiments` | list of texts | `\"demo\"` | demo |",
        "| `high` | number | inf |", "| `durable` | text | empty | nats |"})
    EXPECT_NE(written.find(row), std::string::npos) << row;
}

/// The document's example and the shipped one are taken as they are.
TEST(ConfigurationExamples, AreTaken) {
  const TemporaryFolder folder;
  const auto example = contents_of(std::filesystem::path(RESONID_EXAMPLES_DIR) / "monitor" / "monitor.toml");
  const auto document = configuration_document();
  const auto begin = document.find("```toml\n") + 8;
  for (const auto& text : {example, document.substr(begin, document.find("```\n", begin) - begin)}) {
    ASSERT_FALSE(text.empty());
    const auto file = parse_configuration(text, "monitor.toml", folder.path());
    EXPECT_EQ(messages(file.findings.errors), std::vector<std::string>{});
    const auto specs = axis_specs(file.configuration);
    EXPECT_TRUE(specs.has_value() && !specs->empty());
  }
}

}  // namespace
}  // namespace resonid::monitor::test
