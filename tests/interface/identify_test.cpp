// SPDX-License-Identifier: MIT
#include <matio.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/io/detail/table.hpp>
#include <sstream>

#include "program.hpp"

namespace resonid {
namespace {

using nlohmann::json;

/// The published controller and the delay that the demo knows of.
constexpr const char* kDemo = "--chirp 35:1.5:17 --controller pi:1.036,0.147 --delay 0.004 ";
constexpr const char* kOutputs = " --json o.json --report o.html --response o.csv";

bool holds_null(const json& j) {
  if (j.is_null()) return true;
  if (!j.is_structured()) return false;
  for (const auto& part : j)
    if (holds_null(part)) return true;
  return false;
}

const json* finding(const json& result, const std::string& id) {
  for (const auto& f : result.at("findings"))
    if (f.at("id") == id) return &f;
  return nullptr;
}

class Identify : public test::ProgramTest {
 protected:
  static std::string drive_toml(bool rigid) {
    return rigid ? "drive = {structure = 'rigid', driven_inertia = 0.064, viscous_friction = 0.05}\n"
                 : "drive = {driven_inertia = 0.032, load_inertia = 0.032, stiffness = 143.75, "
                   "damping = 0.3}\n";
  }
  /// Simulates the published loop and writes `NAME.csv` and `NAME.json`, the truth.
  void simulate(const std::string& name, const std::string& excitation, double noise, double seconds,
                bool rigid = false) const {
    std::ostringstream toml;
    toml << drive_toml(rigid) << "controller = {kind = 'pi', gain = 1.036, integral_time_s = 0.147}\n"
         << "excitation = {" << excitation << "}\n"
         << "measurement = {delay_s = 0.004, noise_rms = " << noise << "}\n"
         << "run = {sample_rate_hz = 500, duration_s = " << seconds
         << "}\nmotion = {kind = 'constant', velocity = 10.0}\n";
    write(name + ".toml", toml.str());
    const auto done = run("simulate " + name + ".toml --out " + name + ".csv --truth " + name + ".json");
    ASSERT_EQ(done.exit_code, 0) << done.error;
  }
  void simulate_chirp() const {
    simulate("chirp", "kind = 'chirp', from_hz = 35.0, to_hz = 1.5, duration_s = 17.0", 0.1, 17.0);
  }
  void simulate_multisine() const {
    simulate("multisine", "kind = 'multisine', lines_hz = '1:40:1', amplitude = 0.2", 0.02, 16.0);
  }
  void simulate_prbs(bool rigid = false) const {
    simulate("prbs", "kind = 'prbs', register_length = 10", rigid ? 0.1 : 0.02, 10.23, rigid);
  }
  [[nodiscard]] json identified(const std::string& arguments) const {
    const auto done = run("identify " + arguments + " --json -");
    EXPECT_EQ(done.exit_code, 0) << arguments << "\n" << done.error;
    return json::parse(done.out, nullptr, false);
  }

  /// A small record, sound but for what a test does to it. Line 1 is the header.
  static std::vector<std::string> small_record() {
    std::vector<std::string> lines = {"time_s,u,y"};
    for (int k = 0; k < 200; ++k) {
      std::ostringstream row;
      row << 0.002 * k << "," << ((k * k) % 7 < 3 ? 1 : -1) << "," << 0.01 * (k % 13);
      lines.push_back(row.str());
    }
    return lines;
  }
  void write_lines(const std::string& name, const std::vector<std::string>& lines) const {
    std::string text;
    for (const auto& line : lines) text += line + "\n";
    write(name, text);
  }
  void write_mat(const std::string& name) const {
    mat_t* file = Mat_CreateVer(path(name).c_str(), nullptr, MAT_FT_MAT5);
    ASSERT_NE(file, nullptr);
    std::vector<double> values(200);
    for (std::size_t k = 0; k < values.size(); ++k) values[k] = 0.002 * static_cast<double>(k);
    const auto put = [&](const char* variable, std::size_t count) {
      std::array<std::size_t, 2> dims{count, 1};
      matvar_t* v = Mat_VarCreate(variable, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims.data(), values.data(), 0);
      Mat_VarWrite(file, v, MAT_COMPRESSION_NONE);
      Mat_VarFree(v);
    };
    put("t", 200);
    put("u", 200);
    put("velocity", 200);
    put("shorter", 150);
    Mat_Close(file);
  }

  /// Exit 2 with all of `words` in the message, and no output file, neither whole nor in part.
  void expect_identify_refused(const std::string& arguments, std::initializer_list<const char*> words) const {
    const std::string outputs = arguments.find("--json") == std::string::npos ? kOutputs : "";
    expect_refused("identify " + arguments + outputs, words);
    for (const auto& entry : std::filesystem::directory_iterator(path(".")))
      EXPECT_NE(entry.path().filename().string().rfind("o.", 0), 0U) << arguments << " left " << entry;
  }
};

void expect_frequency_response(const json& g, std::size_t lines) {
  for (const char* key : {"frequency_hz", "real", "imag", "std", "coherence"}) {
    ASSERT_EQ(g.at(key).size(), lines) << key;
    for (const auto& value : g.at(key)) ASSERT_TRUE(value.is_number()) << key;
  }
  for (const auto& value : g.at("std")) EXPECT_GT(value.get<double>(), 0.0);
  for (const auto& value : g.at("coherence")) {
    EXPECT_GE(value.get<double>(), 0.0);
    EXPECT_LE(value.get<double>(), 1.0);
  }
}

void expect_resonance(const json& r, const char* kind, double hz, double within, double damping_ratio) {
  EXPECT_EQ(r.at("kind"), kind);
  EXPECT_EQ(r.at("source"), "model");
  EXPECT_NEAR(r.at("frequency_hz").get<double>(), hz, within);
  EXPECT_GT(r.at("std_hz").get<double>(), 0.0);
  EXPECT_LT(r.at("std_hz").get<double>(), within);
  EXPECT_NEAR(r.at("damping_ratio").get<double>(), damping_ratio, 0.01);
}

void expect_parameter(const json& parameters, const char* name, const char* unit, double value,
                      double within) {
  const auto& p = parameters.at(name);
  EXPECT_EQ(p.at("unit"), unit) << name;
  EXPECT_NEAR(p.at("value").get<double>(), value, within) << name;
  EXPECT_GE(p.at("std").get<double>(), 0.0) << name;
}

void expect_record(const json& record) {
  EXPECT_EQ(record.at("file"), "r.csv");
  EXPECT_EQ(record.at("samples"), 8500);
  EXPECT_EQ(record.at("sample_rate_hz"), 500.0);
  EXPECT_EQ(
      record.at("signals"),
      (json{{"time", "time_s"}, {"input", "u"}, {"output", "y"}, {"excitation", "ru"}, {"reference", "r"}}));
}

TEST_F(Identify, DemoGivesWhatTheInterfacePromises) {
  write("e.toml", test::text_of(std::string(RESONID_EXPERIMENTS_DIR) + "/demo.toml"));
  ASSERT_EQ(run("simulate e.toml --out r.csv --truth t.json").exit_code, 0);
  const auto done = run("identify r.csv " + std::string(kDemo) + kOutputs);
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("two-mass"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("Trusted."), std::string::npos) << done.out;
  const auto result = json::parse(text("o.json"));
  const auto truth = json::parse(text("t.json"));
  EXPECT_FALSE(holds_null(result));
  EXPECT_EQ(result.at("schema"), "resonid.identification/1");
  expect_record(result.at("record"));
  EXPECT_EQ(result.at("method"), "local-cubic");
  EXPECT_EQ(result.at("approach"), "joint");
  expect_frequency_response(result.at("frequency_response"), 336);  // 1.5 ... 35 Hz in steps of 0.1 Hz

  ASSERT_EQ(result.at("resonances").size(), 2U);
  expect_resonance(result.at("resonances")[0], "antiresonance", 10.67, 0.15, 0.070);
  expect_resonance(result.at("resonances")[1], "resonance", 15.09, 0.1, 0.099);
  EXPECT_EQ(result.at("model").at("structure"), "two-mass");
  const auto& parameters = result.at("model").at("parameters");
  expect_parameter(parameters, "driven_inertia", "kgm2", 0.032, 0.001);
  expect_parameter(parameters, "load_inertia", "kgm2", 0.032, 0.001);
  expect_parameter(parameters, "stiffness", "Nm/rad", 143.75, 3.0);
  expect_parameter(parameters, "damping", "Nms/rad", 0.3, 0.02);
  expect_parameter(parameters, "delay", "s", 0.0, 1e-3);
  const auto& g = result.at("model").at("transfer_function");
  EXPECT_EQ(g.at("numerator").size(), 4U);
  EXPECT_EQ(g.at("denominator").size(), 4U);
  EXPECT_EQ(g.at("sample_time_s"), 0.002);

  const auto margin = [&](const char* key) { return result.at("loop").at(key).get<double>(); };
  const auto true_margin = [&](const char* key) { return truth.at("loop").at(key).get<double>(); };
  EXPECT_NEAR(margin("crossover_hz"), true_margin("crossover_hz"), 0.05);
  EXPECT_NEAR(margin("phase_margin_deg"), true_margin("phase_margin_deg"), 1.0);
  EXPECT_NEAR(margin("modulus_margin"), true_margin("modulus_margin"), 0.02);
  EXPECT_NEAR(margin("gain_margin_db"), true_margin("gain_margin_db"), 0.5);
  const auto& validation = result.at("validation");
  EXPECT_GT(validation.at("fit_percent").get<double>(), 50.0);  // noise 0.1 rad/s, signal 0.3 rad/s
  EXPECT_LT(validation.at("cross_correlation_max").get<double>(), validation.at("limit").get<double>());
  EXPECT_TRUE(result.at("trusted").get<bool>());
  for (const auto& f : result.at("findings")) {
    EXPECT_TRUE(f.at("id").is_string());
    EXPECT_GT(f.at("meaning").get<std::string>().size(), 20U);
  }
}

TEST_F(Identify, ReportAndResponseOfTheDemo) {
  simulate_chirp();
  ASSERT_EQ(run("identify chirp.csv " + std::string(kDemo) + kOutputs).exit_code, 0);
  const auto html = text("o.html");
  EXPECT_EQ(html.rfind("<!doctype html>", 0), 0U) << html.substr(0, 40);
  EXPECT_LT(html.size(), 3'000'000U);
  for (const char* load : {"http://", "https://", "@import", "<link", "<iframe"})
    EXPECT_EQ(html.find(load), std::string::npos) << load;
  EXPECT_NE(html.find("</html>"), std::string::npos);
  const auto csv = io::read_csv(path("o.csv"));
  ASSERT_TRUE(csv.has_value());
  EXPECT_EQ(csv->names, (std::vector<std::string>{"frequency_hz", "real", "imag", "std", "coherence"}));
  const auto g = json::parse(text("o.json")).at("frequency_response");
  for (std::size_t i = 0; i < csv->names.size(); ++i)
    EXPECT_EQ(csv->columns[i], g.at(csv->names[i]).get<std::vector<double>>()) << csv->names[i];
}

TEST_F(Identify, RadiusAndLinesAndBand) {
  simulate_chirp();
  const auto belt = identified("chirp.csv --radius 0.05 --lines 2:33:1 --band 5:30 " + std::string(kDemo));
  EXPECT_EQ(belt.at("frequency_response").at("frequency_hz").size(), 26U);
  const auto& parameters = belt.at("model").at("parameters");
  EXPECT_EQ(parameters.at("belt_stiffness").at("unit"), "N/m");
  EXPECT_NEAR(parameters.at("belt_stiffness").at("value").get<double>(),
              parameters.at("stiffness").at("value").get<double>() / 0.0025, 1e-6);
  EXPECT_NEAR(parameters.at("belt_damping").at("value").get<double>(), 120.0, 8.0);
}

/// C as a file is the same C as in pi:KP,TI.
TEST_F(Identify, ControllerFromAFile) {
  simulate_chirp();
  const double step = 1.036 * 0.002 / 0.147;
  write("c.json", json{{"numerator", {1.036 + step, -1.036}}, {"denominator", {1.0, -1.0}}}.dump());
  const auto spec = identified("chirp.csv " + std::string(kDemo));
  const auto file = identified("chirp.csv --chirp 35:1.5:17 --delay 0.004 --controller c.json");
  for (const char* key : {"crossover_hz", "phase_margin_deg", "modulus_margin"})
    EXPECT_NEAR(file.at("loop").at(key).get<double>(), spec.at("loop").at(key).get<double>(), 1e-9) << key;
}

/// Without a word about the excitation a chirp gives what it gives when it is told, and a stepped sine its
/// lines.
TEST_F(Identify, FindsChirpAndSteppedSineByItself) {
  simulate_chirp();
  auto told = identified("chirp.csv --chirp 35:1.5:17");
  auto found = identified("chirp.csv");
  EXPECT_EQ(found.at("method"), "local-cubic");
  EXPECT_EQ(found.at("frequency_response"), told.at("frequency_response"));

  simulate("stepped", "kind = 'stepped-sine', lines_hz = '4:32:2'", 0.05, 30.0);
  for (const char* type : {"", " --excitation-type stepped-sine", " --lines 4,16,20"}) {
    const auto stepped = identified(std::string("stepped.csv --delay 0.004") + type);
    EXPECT_EQ(stepped.at("method"), "least-squares");
    const auto& response = stepped.at("frequency_response");
    const bool some = std::string(type).find("lines") != std::string::npos;
    ASSERT_EQ(response.at("frequency_hz").size(), some ? 3U : 15U);
    EXPECT_NEAR(response.at("frequency_hz").at(1).get<double>(), some ? 16.0 : 6.0, 1e-9);
    if (!some) expect_resonance(stepped.at("resonances")[1], "resonance", 15.0857, 0.2, 0.099);
  }
  expect_identify_refused("stepped.csv --excitation-type stepped-sine --lines 4,9", {"lines", "9"});
}

TEST_F(Identify, EveryMethodOnARecordThatFits) {
  simulate_chirp();
  simulate_multisine();
  simulate_prbs();
  const std::vector<std::pair<std::string, std::vector<std::string>>> fitting = {
      {"chirp.csv --chirp 35:1.5:17 --delay 0.004",
       {"kalman", "local-cubic", "local-polynomial", "welch", "model"}},
      {"multisine.csv --delay 0.004", {"sliding-dft", "kalman", "periodic"}},
      {"prbs.csv --delay 0.004", {"welch", "periodic", "local-polynomial", "model"}}};
  for (const auto& [record, methods] : fitting)
    for (const auto& method : methods) {
      const auto result = identified(record + " --method " + method);
      SCOPED_TRACE(record + " " + method);
      EXPECT_EQ(result.at("method"), method);
      EXPECT_TRUE(result.at("trusted").get<bool>());
      EXPECT_FALSE(holds_null(result));
      expect_resonance(result.at("resonances")[1], "resonance", 15.0857, 0.1, 0.099);
    }
}

TEST_F(Identify, WithoutAModelTheResponseShowsTheResonances) {
  simulate_multisine();
  for (const char* approach : {"direct", "indirect", "joint"}) {
    const auto result = identified(
        "multisine.csv --delay 0.004 --model none --controller pi:1.036,0.147 "
        "--approach " +
        std::string(approach));
    EXPECT_EQ(result.at("approach"), approach);
    EXPECT_FALSE(result.contains("model"));
    EXPECT_FALSE(result.contains("validation"));
    ASSERT_EQ(result.at("resonances").size(), 2U) << approach;
    EXPECT_NEAR(result.at("resonances")[0].at("frequency_hz").get<double>(), 10.67, 0.5);
    EXPECT_NEAR(result.at("resonances")[1].at("frequency_hz").get<double>(), 15.09, 0.5);
    for (const auto& r : result.at("resonances")) EXPECT_EQ(r.at("source"), "response");
    EXPECT_EQ(result.at("loop").at("source"), "response");
    EXPECT_NEAR(result.at("loop").at("phase_margin_deg").get<double>(), 63.4, 2.0);
  }
}

TEST_F(Identify, ARigidDriveHasNoResonance) {
  simulate_prbs(true);
  const auto result = identified("prbs.csv --delay 0.004 --require-trusted");
  EXPECT_EQ(result.at("model").at("structure"), "rigid");
  EXPECT_EQ(result.at("resonances"), json::array());
  EXPECT_TRUE(result.at("trusted").get<bool>());
  const auto& parameters = result.at("model").at("parameters");
  expect_parameter(parameters, "driven_inertia", "kgm2", 0.064, 0.003);
  expect_parameter(parameters, "viscous_friction", "Nms/rad", 0.05, 0.03);
  EXPECT_FALSE(parameters.contains("stiffness"));
  EXPECT_FALSE(parameters.contains("load_inertia"));
}

TEST_F(Identify, NoiseIsNotTrusted) {
  std::uint64_t state = 3;  // Knuth's MMIX generator; uniform noise, independent in u and y
  const auto noise = [&] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state >> 40) / 16777216.0 - 0.5;
  };
  std::ostringstream csv;
  csv << "time_s,u,y\n";
  for (int k = 0; k < 4000; ++k) {
    const double u = noise();
    csv << 0.002 * k << "," << u << "," << noise() << "\n";
  }
  write("noise.csv", csv.str());
  const auto done = run("identify noise.csv --require-trusted --json o.json");
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_NE(done.out.find("NOT trusted"), std::string::npos) << done.out;
  EXPECT_NE(done.error.find("not reliable"), std::string::npos) << done.error;
  const auto result = json::parse(text("o.json"));
  EXPECT_FALSE(result.at("trusted").get<bool>());
  EXPECT_EQ(result.at("resonances"), json::array());
  const json* incoherent = finding(result, "incoherent");
  ASSERT_NE(incoherent, nullptr);
  EXPECT_EQ(incoherent->at("severity"), "error");
  EXPECT_EQ(run("identify noise.csv").exit_code, 0);  // said, but not asked to fail
}

/// A velocity loop without excitation: one message, no model, whichever was asked for.
TEST_F(Identify, ALoopThatAnswersNoiseIsToldOnce) {
  std::uint64_t state = 5;
  std::ostringstream csv;
  csv << "time_s,torque_Nm,velocity_rad_s\n";
  double velocity = 0.0, integral = 0.0;
  for (int k = 0; k < 4000; ++k) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    const double y = velocity + 0.05 * (static_cast<double>(state >> 40) / 16777216.0 - 0.5);
    integral += 0.002 / 0.15 * y;
    const double u = -1.2 * (y + integral);
    csv << 0.002 * k << "," << u << "," << y << "\n";
    velocity += 0.002 / 0.064 * u;
  }
  write("idle.csv", csv.str());
  for (const std::string model : {"auto", "none", "two-mass", "black-box"}) {
    const auto done = run("identify idle.csv --brief --require-trusted --json o.json --model " + model);
    EXPECT_EQ(done.exit_code, 3) << model;
    EXPECT_NE(done.out.find("Error weak-excitation"), std::string::npos) << done.out;
    EXPECT_NE(done.out.find("--excitation"), std::string::npos) << done.out;
    EXPECT_EQ(done.out.find("Warnings"), std::string::npos) << done.out;
    const auto result = json::parse(text("o.json"));
    EXPECT_FALSE(result.contains("model")) << model;
    EXPECT_EQ(result.at("resonances"), json::array()) << model;
  }
}

TEST_F(Identify, UnusableRecordsAreRefusedWithTheirPlace) {
  expect_identify_refused("missing.csv", {"missing.csv", "no such file"});
  expect_identify_refused("", {"RECORD", "required"});
  const auto sound = small_record();
  const auto refused = [&](const std::vector<std::string>& lines, std::initializer_list<const char*> words,
                           const std::string& options = "") {
    write_lines("r.csv", lines);
    expect_identify_refused("r.csv " + options, words);
  };
  const auto with_line = [&](std::size_t line, const std::string& contents) {
    auto lines = sound;
    lines[line - 1] = contents;
    return lines;
  };
  refused(sound, {"r.csv", "no column 'speed'", "--output", "time_s, u, y"}, "--output speed");
  refused(sound, {"no column 'tims_s'", "--time", "did you mean 'time_s'?"}, "--time tims_s");
  refused(with_line(50, "0.096,abc,1"), {"r.csv", "line 50", "column 'u'", "'abc'", "not a number"});
  refused(with_line(51, "0.098,1,nan"), {"r.csv", "line 51", "1 of", "missing"}, "--missing refuse");
  refused(with_line(52, "0.1,inf,1"), {"r.csv", "line 52", "column 'u'", "'inf'", "finite"});
  refused(with_line(53, "0.102,1"), {"r.csv", "line 53", "2 fields", "3 columns"});
  refused(with_line(54, "0.102,1,1,1"), {"r.csv", "line 54", "3 columns"});
  refused({sound[0], sound[1]}, {"r.csv", "only one row", "at least 2"});
  refused({sound[0]}, {"r.csv", "no samples"});
  refused({}, {"r.csv", "empty"});
  auto shuffled = sound;
  std::swap(shuffled[60], shuffled[61]);
  refused(shuffled, {"r.csv", "line 62", "column 'time_s'", "time must rise"});
}

TEST_F(Identify, UnusableMatFilesAreRefused) {
  write_mat("r.mat");
  expect_identify_refused("r.mat --output shorter",
                          {"r.mat", "'shorter' has 150 samples", "'u' has 200", "equally many"});
  expect_identify_refused("r.mat --output velocty", {"r.mat", "'velocty'", "did you mean 'velocity'?"});
  write("text.mat", "this is no MAT file, whatever its name says\n");
  expect_identify_refused("text.mat", {"text.mat", "not a MAT file"});
}

TEST_F(Identify, WrongOptionsNameFoundAndRequired) {
  write_lines("r.csv", small_record());
  const auto refused = [&](const std::string& options, std::initializer_list<const char*> words) {
    expect_identify_refused("r.csv " + options, words);
  };
  refused("--chirp 350:1.5:17", {"--chirp", "350 Hz", "Nyquist frequency 250 Hz"});
  refused("--chirp 35:1.5", {"--chirp", "'35:1.5'", "F0:F1:SECONDS"});
  refused("--chirp 35:35:17", {"--chirp", "two different"});
  refused("--delay -0.004", {"--delay", "-0.004", "0 s or more"});
  refused("--delay soon", {"--delay", "'soon'", "a number"});
  refused("--band 20:10", {"--band", "20:10", "empty", "LO < HI"});
  refused("--band 300:400", {"--band", "300 Hz", "Nyquist frequency 250 Hz"});
  refused("--band 40:60 --chirp 35:1.5:17", {"--band", "40:60", "chirp", "35 Hz"});
  refused("--lines 100:300:50", {"--lines", "300", "250 Hz"});
  refused("--approach joint", {"--approach", "excitation", "--excitation COL"});
  refused("--approach indirect", {"--approach", "--controller"});
  refused("--controller garbage", {"--controller", "'garbage'", "pi:KP,TI"});
  refused("--controller pi:1", {"--controller", "'pi:1'", "two numbers"});
  refused("--controller pi:1,0", {"--controller", "TI = 0", "TI > 0"});
  refused("--method periodic --chirp 35:1.5:17", {"--method", "periodic", "no period", "--period-samples"});
  refused("--method local-cubic", {"--method", "local-cubic", "--chirp"});
  refused("--method kalmann", {"--method", "'kalmann'", "did you mean 'kalman'?"});
  refused("--model four-mass", {"--model", "'four-mass'", "two-mass"});
  refused("--confidence 2", {"--confidence", "2", "between 0 and 1"});
  refused("--contoller pi:1,2", {"unknown option '--contoller'", "did you mean '--controller'"});
  refused("--input-scale 0", {"--input-scale", "0", "other than 0"});
  refused("--sample-rate -5", {"--sample-rate", "-5", "> 0"});
  refused("--sample-rate 400", {"--sample-rate", "400", "500 Hz"});
  refused("--from 30", {"--from 30", "0.398"});
  refused("--radius 0", {"--radius", "0 m", "> 0"});
  refused("--json - --response -", {"--json", "--response", "standard output"});
  refused("--drop-periods -1", {"--drop-periods", "'-1'", "whole number"});
  refused("--drop-periods 18446744073709551615 --period-samples 20",
          {"--drop-periods", "leaves less than one"});
  refused("--period-samples 2.5", {"--period-samples", "'2.5'", "whole number"});
}

TEST_F(Identify, HelpShowsExamplesAndEveryOption) {
  const auto help = run("identify --help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.out.find("Examples:\n  resonid identify"), std::string::npos) << help.out;
  for (const char* option : {"--time",           "--sample-rate",
                             "--input",          "--output",
                             "--excitation",     "--reference",
                             "--input-scale",    "--output-scale",
                             "--motion",         "--output-quantity",
                             "--from",           "--to",
                             "--drop-periods",   "--excitation-type",
                             "--chirp",          "--lines",
                             "--period-samples", "--method",
                             "--approach",       "--controller",
                             "--delay",          "--band",
                             "--model",          "--confidence",
                             "--report",         "--json",
                             "--response",       "--radius",
                             "--require-trusted"})
    EXPECT_NE(help.out.find(std::string("  ") + option + " "), std::string::npos) << option;
}

TEST_F(Identify, FitsASecondOutputAndRefusesWhatIsNone) {
  write("second.toml",
        drive_toml(false) +
            "controller = {kind = 'pi', gain = 1.036, integral_time_s = 0.147}\n"
            "excitation = {kind = 'multisine', lines_hz = '1:40:1', amplitude = 0.2}\n"
            "measurement = {delay_s = 0.004, noise_rms = 0.02, second_output = 'load-encoder', "
            "second_noise = 1e-4}\n"
            "run = {sample_rate_hz = 500, duration_s = 8}\n");
  ASSERT_EQ(run("simulate second.toml --out second.csv").exit_code, 0);
  const std::string second =
      "identify second.csv --delay 0.004 --model two-mass --second-output load_position ";
  const auto done = run(second + "--second-output-kind load-encoder" + kOutputs);
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("second output load_position"), std::string::npos);
  const auto result = json::parse(text("o.json"));
  EXPECT_EQ(result.at("second_output").at("kind"), "load-encoder");
  EXPECT_EQ(result.at("second_output").at("fitted"), true);
  EXPECT_EQ(result.at("second_output").at("frequency_response").at("frequency_hz"),
            result.at("frequency_response").at("frequency_hz"));
  EXPECT_NE(text("o.csv").find("load_real,load_imag,load_std,load_coherence"), std::string::npos);
  EXPECT_NE(text("o.html").find("load_curve"), std::string::npos);
  const std::pair<std::string, std::string> wrong[] = {
      {second, "--second-output-kind: is required with --second-output"},
      {second + "--second-output-kind encoder", "--second-output-kind: found 'encoder', required one of"},
      {second + "--second-output-kind load-encoder --bootstrap 20", "--bootstrap: repeats the experiment"},
      {second + "--second-output-kind load-encoder --join",
       "--second-output: is fitted recording by recording"},
      {"track second.csv --out t.csv --second-output load_position",
       "--second-output: track works on one output"},
      {"validate o.json second.csv --second-output load_position",
       "--second-output: validate works on one output"}};
  for (const auto& [command, message] : wrong) {
    const auto refused = run(command);
    EXPECT_EQ(refused.exit_code, 2) << command;
    EXPECT_NE(refused.error.find(message), std::string::npos) << refused.error;
  }
}

}  // namespace
}  // namespace resonid
