// SPDX-License-Identifier: MIT
#include <algorithm>
#include <nlohmann/json.hpp>
#include <resonid/io/detail/table.hpp>
#include <vector>

#include "program.hpp"

namespace resonid {
namespace {

std::vector<std::filesystem::path> shipped_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(RESONID_EXPERIMENTS_DIR))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

double least(const std::vector<double>& x) { return *std::min_element(x.begin(), x.end()); }
double most(const std::vector<double>& x) { return *std::max_element(x.begin(), x.end()); }

class ExperimentFiles : public test::ProgramTest {
 protected:
  /// A shipped file with one piece of text replaced must be refused with one line, before anything is
  /// written.
  void expect_refused_change(const std::string& name, const std::string& from, const std::string& to,
                             std::initializer_list<const char*> words) {
    std::string text = test::text_of(std::string(RESONID_EXPERIMENTS_DIR) + "/" + name + ".toml");
    ASSERT_NE(text.find(from), std::string::npos) << name << " lacks " << from;
    text.replace(text.find(from), from.size(), to);
    expect_refused_file(text, words);
  }
  void expect_refused_file(const std::string& text, std::initializer_list<const char*> words) {
    write("e.toml", text);
    expect_one_line("simulate e.toml --out r.csv --truth t.json --json s.json", words);
    for (const char* file : {"r.csv", "t.json", "s.json"})
      EXPECT_FALSE(std::filesystem::exists(path(file))) << file << "\n" << text;
  }
  void expect_one_line(const std::string& arguments, std::initializer_list<const char*> words) {
    expect_refused(arguments, words);
    const std::string message = this->text("stderr.txt");
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
  }
};

TEST_F(ExperimentFiles, EveryShippedOneSimulates) {
  const auto files = shipped_files();
  ASSERT_GE(files.size(), 25U);
  for (const auto& file : files) {
    const std::string arguments = "simulate '" + file.string() + "' --out r.csv --truth t.json";
    const auto done = run(arguments);
    ASSERT_EQ(done.exit_code, 0) << file << "\n" << done.error;
    EXPECT_EQ(done.error, "") << file;
    const auto record = io::read_csv(path("r.csv"));
    ASSERT_TRUE(record.has_value()) << file;
    EXPECT_GE(record->columns[0].size(), 1000U) << file;
    const auto truth = nlohmann::json::parse(text("t.json"));
    EXPECT_TRUE(truth.contains("model")) << file;
    const std::string first = test::text_of(file).substr(0, test::text_of(file).find('\n'));
    EXPECT_EQ(first.substr(0, 2), "# ") << file << " says what it is in its first line";
    EXPECT_EQ(first.back(), '.') << file << ": a sentence, which --list shows";
    EXPECT_LE(first.size(), 112U) << file;
  }
}

TEST_F(ExperimentFiles, NoCartLeavesItsStroke) {
  std::size_t belts = 0;
  for (const auto& file : shipped_files()) {
    if (test::text_of(file).find("\"tooth-belt\"") == std::string::npos) continue;
    ++belts;
    ASSERT_EQ(run("simulate '" + file.string() + "' --out r.csv").exit_code, 0) << file;
    const auto record = io::read_csv(path("r.csv"));
    ASSERT_TRUE(record.has_value());
    ASSERT_EQ(record->names.back(), "position") << file;
    EXPECT_GE(least(record->columns.back()), 0.38) << file;
    EXPECT_LE(most(record->columns.back()), 1.65) << file;
  }
  EXPECT_GE(belts, 8U);
}

TEST_F(ExperimentFiles, AShippedOneRunsByItsName) {
  ASSERT_EQ(run("simulate '" RESONID_EXPERIMENTS_DIR "/rigid.toml' --duration 0.5 --out a.csv").exit_code, 0);
  ASSERT_EQ(run("simulate rigid --duration 0.5 --out b.csv").exit_code, 0);
  EXPECT_EQ(text("a.csv"), text("b.csv"));
  write("rigid", "[drive]\ndriven_inertia = 0\n");  // a file of that name comes first
  expect_one_line("simulate rigid", {"rigid:2:18: drive.driven_inertia: found 0, must be > 0"});
  expect_one_line("simulate belt2", {"belt2:", "no such file", "did you mean 'belt_2'?", "--list"});
}

TEST_F(ExperimentFiles, AreListedWithWhatTheyAre) {
  const auto done = run("simulate --list --json list.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto list = nlohmann::json::parse(text("list.json")).at("experiments");
  const auto files = shipped_files();
  ASSERT_EQ(list.size(), files.size());
  for (const auto& file : files) {
    EXPECT_NE(done.out.find(file.stem().string() + " "), std::string::npos) << file;
    const auto entry = std::find_if(list.begin(), list.end(),
                                    [&](const auto& e) { return e.at("name") == file.stem().string(); });
    ASSERT_NE(entry, list.end()) << file;
    EXPECT_GE(entry->at("about").get<std::string>().size(), 20U) << file;
  }
  expect_refused("simulate demo --list", {"EXPERIMENT", "'demo'", "--list"});
  expect_refused("simulate --list --out r.csv", {"--list: runs nothing"});
  expect_refused("simulate --list --schema", {"--list and --schema"});
}

TEST_F(ExperimentFiles, TheirDocumentIsCurrent) {
  const auto done = run("simulate --schema");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_EQ(done.out, test::text_of(std::string(RESONID_DOCS_DIR) + "/experiment_files.md"))
      << "resonid simulate --schema > docs/experiment_files.md";
}

TEST_F(ExperimentFiles, TheDocumentSaysWhatTheReaderDoes) {
  const std::string document = run("simulate --schema").out;
  // Required, a default, and for which kinds, as the reader's refusals have them.
  for (const char* row :
       {"| `driven_inertia` | number | required | two-mass, rigid, three-mass, tooth-belt |",
        "| `damping` | number | 0 | two-mass, three-mass |",
        "| `radius_m` | number | required | tooth-belt |",
        "| `stroke_to_m` | number | required | tooth-belt |",
        "| `integral_time_s` | number | required | pi, pid, cascade |",
        "| `to` | number | required | trapezoidal, s-curve |",
        "| `register_length` | whole number | 10 | prbs |", "| `seed` | whole number | 1 | seed of the",
        "| `structure` | `\"two-mass\"`, `\"rigid\"`, `\"three-mass\"`, `\"chain\"`, `\"tooth-belt\"` | "
        "`\"two-mass\"` |"})
    EXPECT_NE(document.find(row), std::string::npos) << row;
  // The example in it runs.
  const auto begin = document.find("```toml\n") + 8;
  write("e.toml", document.substr(begin, document.find("```", begin) - begin));
  EXPECT_EQ(run("simulate e.toml").exit_code, 0) << text("stderr.txt");
}

TEST_F(ExperimentFiles, KeysAndTypesAreRefusedWithTheirPlace) {
  expect_refused_change("demo", "delay_s = 0.004", "dealy_s = 0.004",
                        {"e.toml:29:1: unknown key 'measurement.dealy_s' (did you mean 'delay_s'?)"});
  expect_refused_change("demo", "[run]", "[runs]",
                        {"e.toml:32:2: unknown table 'runs' (did you mean 'run'?)"});
  expect_refused_change("demo", "gain = 1.036", "gain = 'high'",
                        {"e.toml:14:8: controller.gain: found 'high', required a number"});
  expect_refused_change("demo", "seed = 1", "seed = 1.0",
                        {"e.toml:34:8: run.seed: found 1.0, required a whole number"});
  expect_refused_change("demo", "kind = \"pi\"", "", {"e.toml:12:1: [controller] has no key 'kind'"});
  expect_refused_change("demo", "kind = \"pi\"", "kind = \"none\"",
                        {"e.toml:14:1: unknown key 'controller.gain' with kind = 'none'"});
  expect_refused_change("v_tooth_multisine", "lines_hz = \"20:120:5\"", "lines_hz = [20, \"a\"]",
                        {"excitation.lines_hz: found 'a', required a list of numbers"});
  expect_refused_change("demo", "radius_m = 0.05", "radius_m = 0.05\nradius_m = 0.05",
                        {"e.toml:11:12: is not TOML", "cannot redefine", "'radius_m'"});
  expect_refused_change("demo", "[run]", "[drive]", {"e.toml:32:1: is not TOML", "'drive'"});
  expect_refused_file("drive = 5\n", {"e.toml:1:9: drive: found 5, required a table"});
  expect_refused_file("[[drive]]\n", {"e.toml:1:1: drive: found array, required a table"});
}

TEST_F(ExperimentFiles, WhatIsNoExperimentIsRefused) {
  expect_refused_file("", {"e.toml:1:1: has no table [drive]; its driven_inertia must be > 0"});
  expect_refused_file("# nothing\n", {"e.toml:1:1: has no table [drive]"});
  expect_refused_file(std::string("\x7f"
                                  "ELF\x02\x01\0\0\x80",
                                  9),
                      {"e.toml: is not TOML: it holds binary data"});
  expect_refused_file("a = \"\xff\xfe\"\n", {"e.toml:1:5: is not TOML", "utf-8"});
  expect_refused_file(std::string(5000, '['), {"e.toml:1:", "is not TOML"});
  expect_refused_file(std::string(5000, 'k') + " = 1\n", {"e.toml:1:1: unknown table 'kkk", "...'"});
  expect_one_line("simulate .", {".: is a folder, required a TOML file"});
  expect_one_line("simulate no/such.toml", {"no/such.toml: cannot be opened: no such file"});
}

TEST_F(ExperimentFiles, ValuesAreRefusedWithTheirPlace) {
  expect_refused_change("demo", "driven_inertia = 0.032", "driven_inertia = -0.032",
                        {"e.toml:6:18: drive.driven_inertia: found -0.032, must be > 0"});
  expect_refused_change("i_prbs", "noise_rms = 0.1", "encoder_counts = -5",
                        {"measurement.encoder_counts: found -5, must be >= 0"});
  expect_refused_change("load_steps", "load_step = [-2.0, 3.0]", "load_step = [-2.0]",
                        {"disturbance.load_step_at_s: must hold as many times as load_step holds steps"});
  expect_refused_change("load_steps", "load_step_at_s", "#", {"[disturbance] has no key 'load_step_at_s'"});
  expect_refused_change("chain_four_masses", "stiffnesses = [900.0, 600.0, 700.0]", "stiffnesses = [900.0]",
                        {"drive.stiffnesses: must hold one value less than inertias"});
  expect_refused_change("chain_four_masses", "[0.012,", "[-0.012,",
                        {"drive.inertias: found -0.012, must be > 0"});
  expect_refused_change("stiffness_drifts", "= -0.01", "= -0.06",
                        {"disturbance.stiffness_drift_per_s: found -0.06", "above 0 over the whole run"});
  const std::string rst =
      "[drive]\nstructure = 'rigid'\ndriven_inertia = 0.1\n[run]\nsample_rate_hz = 100\nduration_s = 1\n"
      "[controller]\nkind = 'rst'\n";
  expect_refused_file(rst + "r = [0, 1]\ns = [1]\nt = [1]\n",
                      {"e.toml:9:5: controller.r: found 0, must not begin"});
  expect_refused_file(rst + "r = [1, -2]\ns = [1]\nt = [1]\n",
                      {"e.toml:9:5: controller.r: must not have a root"});
  expect_refused_file(rst + "r = [1]\ns = []\nt = [1]\n", {"e.toml:10:5: controller.s: must hold 1 ... 17"});
  expect_refused_file(rst + "r = [1]\ns = [1]\n", {"e.toml:7:1: [controller] has no key 't'"});
}

TEST_F(ExperimentFiles, ExperimentsThatCannotBeDoneAreRefused) {
  expect_refused_change("i_prbs", "sample_rate_hz = 500.0", "sample_rate_hz = 30.0",
                        {"run.sample_rate_hz: found 30, must be more than 30.17", "resonates at 15.09 Hz"});
  expect_refused_change(
      "demo", "gain = 1.036", "gain = 100.0",
      {"e.toml:14:8: controller.gain: found 100, must leave the closed loop stable", "an oscillation at"});
  expect_refused_change("v_tooth_multisine", "to = 1.63", "to = 1.9",
                        {"motion.to: must keep the cart in its stroke, 0.38 ... 1.65 m"});
  expect_refused_change("v_tooth_multisine", "from = 0.4", "from = 0.2", {"motion.from: must keep the cart"});
  // Only the run shows it: the excitation drives the cart out.
  expect_refused_change("v_tooth_multisine", "amplitude = 0.3", "amplitude = 30.0",
                        {"drive.stroke_from_m: must hold the cart: it leaves its stroke", "after"});
  expect_refused_change("ii_tooth_open_loop_prbs", "kind = \"standstill\"",
                        "kind = \"trapezoidal\"\nvelocity = 0.1\nacceleration = 1.0\nto = 1.2",
                        {"motion.kind: must be standstill or constant without a controller"});
}

TEST_F(ExperimentFiles, ARigidMachineHasNoStiffnessThatCouldChange) {
  for (const char* key : {"eccentricity", "stiffness_drift_per_s", "loosening"})
    expect_refused_change("rigid", "[friction]", std::string("[disturbance]\n") + key + " = 0.1\n[friction]",
                          {"e.toml:11:", key, "found 0.1, needs a coupling: this machine is rigid"});
}

TEST_F(ExperimentFiles, TheRunCanBeMadeShorterOrLonger) {
  ASSERT_EQ(run("simulate demo --duration 0.1 --out a.csv").exit_code, 0);
  ASSERT_EQ(run("simulate demo --duration 34 --out b.csv").exit_code, 0);
  EXPECT_EQ(io::read_csv(path("a.csv"))->columns[0].size(), 50U);
  EXPECT_EQ(io::read_csv(path("b.csv"))->columns[0].size(), 17000U);
  EXPECT_EQ(text("b.csv").compare(0, text("a.csv").size(), text("a.csv")), 0) << "the same beginning";
  expect_refused("simulate demo --duration 0", {"--duration: found 0 s, required > 0"});
  expect_refused("simulate demo --duration 1e9", {"with a duration of 1e+09 s: must be at most 1e8 samples"});
}

}  // namespace
}  // namespace resonid
