// SPDX-License-Identifier: MIT
#include <sys/stat.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>

#include "background_program.hpp"
#include "program.hpp"

namespace resonid {
namespace {

/// A port at which somebody else listens.
class TakenPort {
 public:
  TakenPort() : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    ::sockaddr_in name{};
    name.sin_family = AF_INET;
    name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ::socklen_t length = sizeof name;
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const ::sockaddr*>(&name), length), 0);
    EXPECT_EQ(::listen(socket_, 1), 0);
    EXPECT_EQ(::getsockname(socket_, reinterpret_cast<::sockaddr*>(&name), &length), 0);
    address_ = "127.0.0.1:" + std::to_string(ntohs(name.sin_port));
  }
  TakenPort(const TakenPort&) = delete;
  TakenPort& operator=(const TakenPort&) = delete;
  ~TakenPort() { ::close(socket_); }
  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  int socket_;
  std::string address_;
};

class Monitor : public test::ProgramTest {
 protected:
  static constexpr const char* kConfiguration = R"([monitor]
data = "data"
listen = "127.0.0.1:0"
[source.line]
kind = "demo"
experiments = ["demo"]
speed = 50
[axis.demo]
source = "line"
sample_rate_hz = 500
input = "u"
output = "y"
excitation = "ru"
)";
  void configure(const std::string& more = "", const std::string& old_text = "",
                 const std::string& new_text = "") const {
    std::string text = kConfiguration + more;
    if (!old_text.empty()) text.replace(text.find(old_text), old_text.size(), new_text);
    write("m.toml", text);
  }
  /// The port of the newest address that was told.
  static int port_in(const std::string& text) {
    const std::string begin = "http://127.0.0.1:";
    const auto at = text.rfind(begin);
    return at == text.npos ? 0 : std::stoi(text.substr(at + begin.size()));
  }
  static bool has(const std::string& text, const std::string& words) { return text.find(words) != text.npos; }
};

/// The life of a service: it tells systemd what it does, takes over what has changed, and ends soon.
TEST_F(Monitor, RunsReloadsAndEnds) {
  configure();
  test::NotifySocket systemd(path("notify"));
  ASSERT_TRUE(systemd.ok());
  test::BackgroundProgram program(path(""), {"monitor", "m.toml"},
                                  {"NOTIFY_SOCKET=" + path("notify").string(), "WATCHDOG_USEC=100000"});
  ASSERT_TRUE(test::comes_true([&] { return systemd.told().size() == 1 || program.ended(); }))
      << program.error();
  ASSERT_EQ(systemd.told(), std::vector<std::string>{"READY=1"}) << program.error();
  int port = port_in(program.out());
  EXPECT_TRUE(has(test::get(port, "/healthz"), " 200 ")) << program.out();
  const auto status = test::get(port, "/api/v1/status");
  EXPECT_TRUE(nlohmann::json::accept(status.substr(status.find("\r\n\r\n") + 4))) << status;
  const int beats = systemd.beats();
  EXPECT_TRUE(test::comes_true([&] { return systemd.beats() > beats + 1; }));

  /// What standard error tells of a SIGHUP, once it is done.
  std::size_t reloads = 0;
  const auto reload = [&] {
    const std::size_t before = program.error().size();
    program.signal(SIGHUP);
    ++reloads;
    EXPECT_TRUE(
        test::comes_true([&] { return systemd.told().size() == 1 + 2 * reloads || program.ended(); }));
    EXPECT_TRUE(systemd.told()[2 * reloads - 1].starts_with("RELOADING=1\nMONOTONIC_USEC="));
    EXPECT_EQ(systemd.told().back(), "READY=1");
    return program.error().substr(before);
  };
  EXPECT_TRUE(reload().ends_with(" info the configuration has not changed\n"));

  configure("", "source = \"line\"", "source = \"lime\"");
  auto said = reload();
  EXPECT_TRUE(has(said, "m.toml:9:") && has(said, "found 'lime' (did you mean 'line'?)")) << said;
  EXPECT_TRUE(has(said, "the service goes on as it was")) << said;
  EXPECT_TRUE(has(test::get(port, "/healthz"), " 200 "));

  // Alarms may change without anything being forgotten.
  EXPECT_TRUE(test::comes_true([&] { return has(test::get(port, "/api/v1/axes"), "\"following\""); }));
  configure("[alarms.stiffness]\nlow = 5\n");
  said = reload();
  EXPECT_TRUE(has(said, "axis.demo.alarms.stiffness.low: 5, was -inf\n")) << said;
  EXPECT_TRUE(has(said, "the configuration is taken over: http://")) << said;
  EXPECT_FALSE(has(said, "begins anew")) << said;
  port = port_in(said);
  EXPECT_TRUE(has(test::get(port, "/healthz"), " 200 "));
  EXPECT_TRUE(test::comes_true([&] { return has(test::get(port, "/api/v1/axes"), "\"following\""); }));

  // Another length of the ring makes the axis begin anew.
  configure("ring_s = 60\n");
  said = reload();
  EXPECT_TRUE(has(said, "axis.demo.ring_s: 60, was 120 (begins anew)\n")) << said;
  EXPECT_TRUE(has(said, "axis demo begins anew: its configuration has changed")) << said;
  EXPECT_TRUE(has(said, "its ring of raw samples is made anew")) << said;

  // What cannot run is taken back: the port of somebody else.
  auto taken = std::make_optional<TakenPort>();
  configure("ring_s = 60\n", "127.0.0.1:0", taken->address());
  said = reload();
  EXPECT_TRUE(has(said, "the service goes on with the configuration that it had")) << said;
  taken.reset();
  said = reload();  // which is there still, and can run now
  EXPECT_TRUE(has(said, "the configuration is taken over")) << said;
  EXPECT_TRUE(has(test::get(port_in(said), "/healthz"), " 200 "));

  const auto begin = std::chrono::steady_clock::now();
  program.signal(SIGTERM);
  EXPECT_EQ(program.exit_code(), 0) << program.error();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
  EXPECT_EQ(systemd.told().back(), "STOPPING=1");
}

TEST_F(Monitor, RefusesABrokenConfiguration) {
  configure("delay_s = -1\n[source.more]\nkind = \"pigeon\"\n");
  expect_refused("monitor m.toml", {"m.toml:16:", "pigeon"});
  configure("delay_s = -1\n");
  expect_refused("monitor m.toml", {"m.toml:14:", "axis.demo.delay_s", "found -1"});
  expect_refused("monitor m.toml --check", {"axis.demo.delay_s"});
  configure("", "data = \"data\"", "data = \"m.toml/x\"");
  expect_refused("monitor m.toml --check", {"monitor.data"});
  EXPECT_EQ(run("monitor m.toml --check --data here").exit_code, 0) << "the other one is not used";
  expect_refused("monitor none.toml", {"none.toml"});
  configure("delay_s = -1\nspring = 1\nring_s = \"long\"\n");
  expect_refused("monitor m.toml --check", {"m.toml:14:11:", "m.toml:15:1:", "m.toml:16:10:"});
}

TEST_F(Monitor, NamesTheOptionThatIsWrong) {
  configure();
  expect_refused("monitor m.toml --check --listen foo",
                 {"resonid: --listen: found 'foo', required HOST:PORT"});
  expect_refused("monitor m.toml --listen 0.0.0.0:80", {"resonid: --listen: is 0.0.0.0:80"});
  expect_refused("monitor m.toml --check --data m.toml/x",
                 {"resonid: --data: found '", "required a folder that can be written"});
  // What shows only when it starts.
  const TakenPort taken;
  const std::string there = " --listen " + taken.address();
  for (const char* what : {"monitor m.toml", "monitor --demo"})
    expect_refused(what + there, {"resonid: --listen: cannot listen on 127.0.0.1 port"});
  expect_refused("monitor --demo --data m.toml/x", {"resonid: --data: the folder '"});
}

/// Under systemd every line has its level, also those before the service runs; for people none has.
TEST_F(Monitor, TellsTheJournalTheLevelOfEveryLine) {
  const auto told = [&](const std::string& more, int exit_code) {
    configure(more);
    write("out.txt", "");  // nothing of a run before
    write("err.txt", "");  // the same file when the program has it
    struct ::stat file {};
    EXPECT_EQ(::stat(path("err.txt").c_str(), &file), 0);
    test::BackgroundProgram program(
        path(""), {"monitor", "m.toml"},
        {"JOURNAL_STREAM=" + std::to_string(file.st_dev) + ":" + std::to_string(file.st_ino)});
    EXPECT_TRUE(test::comes_true([&] { return port_in(program.out()) != 0 || program.ended(); }));
    program.signal(SIGTERM);
    EXPECT_EQ(program.exit_code(), exit_code) << program.error();
    std::istringstream lines(program.error());
    for (std::string line; std::getline(lines, line);)
      EXPECT_TRUE(line.size() > 3 && line[0] == '<' && line[2] == '>') << line;
    return program.error();
  };
  const std::string unread = "[source.more]\nkind = \"demo\"\n";
  const auto warned = told(unread, 0);
  EXPECT_TRUE(has(warned, "<4>m.toml:14:1: source.more: is read by no axis\n")) << warned;
  const auto refused = told("delay_s = -1\nring_s = 1\n" + unread, 2);
  EXPECT_TRUE(has(refused, "<3>m.toml:14:11: axis.demo.delay_s")) << refused;
  EXPECT_TRUE(has(refused, "<3>m.toml:15:10: axis.demo.ring_s")) << refused;
  const auto checked = run("monitor m.toml --check");
  EXPECT_TRUE(has(checked.error, "warning: m.toml:16:1: source.more: is read by no axis\n")) << checked.error;
}

TEST_F(Monitor, RefusesOptionsThatContradict) {
  configure();
  expect_refused("monitor", {"configuration", "--demo"});
  expect_refused("monitor m.toml --demo", {"--demo", "m.toml"});
  expect_refused("monitor m.toml --speed 2", {"--speed"});
  expect_refused("monitor m.toml --seconds 2", {"--seconds", "--discover"});
  expect_refused("monitor m.toml --discover x.csv", {"--discover", "CONFIG"});
  expect_refused("monitor --discover x.csv --check", {"--check"});
  expect_refused("monitor --discover x.csv --seconds 0", {"--seconds", "found 0", "0.1 ... 86400"});
  expect_refused("monitor --discover x.csv --password-file p", {"--password-file", "mqtt://"});
  expect_refused("monitor --discover mqtt://a --ca-file p", {"--ca-file", "mqtts://", "tls://"});
  expect_refused("monitor --discover nats://a --ca-file p", {"--ca-file", "mqtts://", "tls://"});
  expect_refused("monitor --discover hal:", {"[source.hal]", "kind = \"hal\"", "columns", "sampler.N.pin.0"});
  expect_refused("monitor --discover http://a", {"--discover", "http://a", "mqtt://"});
  expect_refused("monitor --discover tcp://127.0.0.1", {"HOST:PORT"});
  expect_refused("monitor --discover udp://127.0.0.1:9/x", {"HOST:PORT"});
  expect_refused("monitor --discover mqtt://me:secret@a", {"--password-file"});
}

/// A recording that is shorter than its baseline has no alarm, which is no proof that nothing changed.
TEST_F(Monitor, SaysFromWhenOnAReplayTellsChanges) {
  const std::string replay =
      "monitor --controller pi:1.036,0.147 --delay 0.004 --rows rows.csv --replay belt.csv";
  ASSERT_EQ(run("simulate belt_loosens --duration 8 --out belt.csv").exit_code, 0);
  const auto brief = run(replay);
  ASSERT_EQ(brief.exit_code, 0) << brief.error;
  EXPECT_TRUE(
      has(brief.out, " rows written to rows.csv\n0 alarms; no change could be told: the baseline takes "))
      << brief.out;
  EXPECT_TRUE(has(brief.out, " s on, and the recording ends at 8.0 s\n")) << brief.out;
  ASSERT_EQ(run("simulate belt_loosens --duration 60 --out belt.csv").exit_code, 0);
  const auto whole = run(replay);
  EXPECT_TRUE(has(whole.out, "; changes are told from ")) << whole.out;
  EXPECT_TRUE(has(whole.out, " s on: what comes before is the baseline\n")) << whole.out;
}

/// What is printed is a configuration as it is.
TEST_F(Monitor, DiscoversWhatAFileHolds) {
  ASSERT_EQ(run("simulate demo --out line.csv").exit_code, 0);
  const auto found = run("monitor --discover line.csv");
  ASSERT_EQ(found.exit_code, 0) << found.error;
  EXPECT_TRUE(has(found.out, "#  format  columns")) << found.out;
  EXPECT_TRUE(has(found.out, "time_s, ru, u, y")) << found.out;
  EXPECT_TRUE(has(found.out, "\n[source.file]\nkind = \"file\"\nformat = \"csv\"\n")) << found.out;
  EXPECT_TRUE(has(found.out, "\nsample_rate_hz = 500\ninput = \"u\"\noutput = \"y\"\nexcitation = \"ru\"\n"))
      << found.out;
  EXPECT_TRUE(has(found.out, "# a positive torque accelerates the output: signs agree\n")) << found.out;
  write("m.toml", found.out);
  const auto checked = run("monitor m.toml --check");
  EXPECT_EQ(checked.exit_code, 0) << checked.error;
  EXPECT_EQ(checked.out, "m.toml: 1 axes, 1 sources: nothing to object\n");
}

/// However fast the samples come: a column of times tells their rate.
TEST_F(Monitor, DiscoversTheRateOfAColumnOfTimesInAPipe) {
  ASSERT_EQ(run("simulate demo --duration 2 --out line.csv").exit_code, 0);
  const auto found =
      shell("(head -401 line.csv; sleep 1; sed -n 402,801p line.csv; sleep 2) | '" RESONID_PROGRAM
            "' monitor --discover - --seconds 2");
  EXPECT_TRUE(has(found.out, "\nsample_rate_hz = 500\n")) << found.out << found.error;
}

/// Axes of which too little is known are left to people, as comments.
TEST_F(Monitor, DiscoversWhatComesByAPipe) {
  const std::string numbers = "[1,2,3,4,5,6,7,8,9,8,7,6,5,4,3,2,1,2,3,4]";
  const auto line = [&](const std::string& axis, const std::string& u, const std::string& y) {
    return R"({"axis":")" + axis + R"(","rate":500,")" + u + "\":" + numbers + ",\"" + y + "\":" + numbers +
           "}\n";
  };
  write("lines.json", line("x", "u", "y") + line("z", "a", "b"));
  const auto result = run("monitor --discover - < lines.json");
  ASSERT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(has(result.out, "kind = \"stdin\"\nformat = \"json\"\n")) << result.out;
  EXPECT_TRUE(has(result.out, "\n[axis.x]\nsource = \"stdin\"\nsample_rate_hz = 500\ninput = \"u\"\n"))
      << result.out;
  EXPECT_TRUE(has(result.out, "\n#[axis.z]\n#source = \"stdin\"\n#sample_rate_hz = 500\n#input = \"\"\n"))
      << result.out;
  expect_refused("monitor --discover - < /dev/null", {"nothing came"});
  write("words.txt", "the door is open\n");
  expect_refused("monitor --discover words.txt", {"words.txt", "holds no samples"});
  expect_refused("monitor --discover none.csv", {"none.csv", "none of that name"});
  expect_refused("monitor --discover mqtt://127.0.0.1:1", {"127.0.0.1:1", "refused"});
  expect_refused("monitor --discover nats://127.0.0.1:1",
                 {"nats://127.0.0.1:1: nats: No server available for connection\n"});
  expect_refused("monitor --discover udp://127.0.0.1:0 --seconds 0.1", {"127.0.0.1:0"});
}

/// The time of the samples is no column; from what begins elsewhere no rate can be told.
TEST_F(Monitor, DiscoversTimes) {
  std::string since_1970, since_the_start = "time,u,y\n";
  for (int k = 0; k < 300; ++k) {
    const std::string u = std::to_string(k % 7), y = std::to_string(k % 5);
    const std::string ms = std::to_string(1000 + 2 * k);
    since_1970 += "{\"timestamp\":170000000" + ms + ",\"u\":" + u + ",\"y\":" + y + "}\n";
    since_the_start += std::to_string(0.002 * k) + "," + u + "," + y + "\n";
  }
  write("line.json", since_1970);
  const auto timed = run("monitor --discover line.json");
  EXPECT_EQ(timed.exit_code, 0) << timed.error;
  EXPECT_TRUE(has(timed.out, "\n# samples come with their time, which is followed")) << timed.out;
  EXPECT_TRUE(has(timed.out, "\n[axis.file]\nsource = \"file\"\nsample_rate_hz = 500\n")) << timed.out;
  write("line.csv", since_the_start);
  const auto untimed = run("monitor --discover line.csv");
  EXPECT_EQ(untimed.exit_code, 0) << untimed.error;
  EXPECT_FALSE(has(untimed.out, "come with their time")) << untimed.out;
  EXPECT_TRUE(has(untimed.out, "and is passed over, no column, where it counts from the start\n"))
      << untimed.out;
}

/// The unit that is installed is one, and leaves the service little to do harm with.
TEST_F(Monitor, HasAUnitThatSystemdTakes) {
  if (!ProgramTest::has("systemd-analyze"))
    GTEST_SKIP() << "systemd-analyze is not here: the unit is not verified";
  std::string unit = test::text_of(RESONID_UNIT);
  const std::string program = "ExecStart=resonid ";
  const auto at = unit.find(program);
  ASSERT_NE(at, unit.npos);
  unit.replace(at, program.size(), "ExecStart=" RESONID_PROGRAM " ");
  write("resonid-monitor.service", unit);
  const auto verified = shell("systemd-analyze verify --man=no ./resonid-monitor.service 2>&1");
  EXPECT_EQ(verified.exit_code, 0) << verified.out;
  EXPECT_EQ(verified.out, "");
  const auto exposed =
      shell("systemd-analyze security --offline=yes --threshold=20 ./resonid-monitor.service");
  EXPECT_EQ(exposed.exit_code, 0) << exposed.out;
}

}  // namespace
}  // namespace resonid
