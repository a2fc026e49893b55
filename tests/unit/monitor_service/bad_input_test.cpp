// SPDX-License-Identifier: MIT
// A service whose sources and page are given everything that is wrong, while one axis is followed.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <monitor/service/service.hpp>
#include <monitor/sources/command_source.hpp>
#include <monitor/sources/file_source.hpp>
#include <monitor/sources/stream_source.hpp>
#include <monitor/sources/tcp_source.hpp>
#include <monitor/sources/udp_source.hpp>
#include <nlohmann/json.hpp>
#include <random>
#include <resonid/base/error_text.hpp>

#include "../monitor_sources/client.hpp"
#include "../monitor_web/web_client.hpp"
#include "drive.hpp"
#include "folder.hpp"

namespace resonid::monitor {
namespace {

using namespace std::chrono_literals;
using Steady = std::chrono::steady_clock;
using web::test::ask;
using web::test::request_text;
using web::test::WebClient;

constexpr double kSpeed = 12.0;  // of the good sender, times real time
constexpr std::int64_t kStart_ns = 1'790'000'000'000'000'000;
constexpr std::int64_t kInterval_ns = 4'000'000;
constexpr std::string_view kColumns[] = {"ru", "u", "y"};

constexpr double kPatience_s = 30.0;  // on a machine that does much else

bool within(double seconds, const std::function<bool()>& condition) {
  const auto end = Steady::now() + std::chrono::duration<double>(seconds);
  while (!condition()) {
    if (Steady::now() > end) return false;
    std::this_thread::sleep_for(2ms);
  }
  return true;
}

/// A frame of `count` samples, right unless something of it is changed.
struct FrameSpec {
  std::string_view axis;
  std::uint64_t first = 0;
  std::size_t count = 25;
  double rate_hz = kRate;
  std::int64_t ahead_ns = 0;
  double value = 1.0;
};
std::string frame(const FrameSpec& f, std::span<const double> values = {}) {
  const std::vector<double> same(3 * f.count, f.value);
  Arrival arrival;
  arrival.axis = f.axis;
  arrival.first_sample = f.first;
  arrival.time_ns = kStart_ns + static_cast<std::int64_t>(f.first) * kInterval_ns + f.ahead_ns;
  arrival.sample_rate_hz = f.rate_hz;
  arrival.columns = kColumns;
  arrival.values = values.empty() ? std::span<const double>(same) : values;
  return encoded(arrival, ValueType::float64).value();
}

/// A line of sample, time, ru, u and y; its clock goes by other intervals, or `u` is what is told.
std::string numbered_line(std::uint64_t sample, double intervals = 1.0, std::string_view u = "1") {
  const double passed_ns = intervals * static_cast<double>(kInterval_ns) * static_cast<double>(sample);
  return fmt::format("{},{},1,{},1\n", sample, kStart_ns + std::llround(passed_ns), u);
}

std::string garbage(std::size_t bytes, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::string text(bytes, '\0');
  for (char& c : text) c = static_cast<char>(generator());
  return text;
}

std::size_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t pages = 0, resident = 0;
  file >> pages >> resident;
  return resident * 4096;
}

/// As many as this machine lets a process have.
std::size_t open_all_descriptors() {
  ::rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  getrlimit(RLIMIT_NOFILE, &limit);
  return static_cast<std::size_t>(limit.rlim_cur);
}

/// A service with an axis that is followed and one per source that is given what is wrong.
class BadInput : public testing::Test {
 protected:
  BadInput() : values_(drive_samples(300.0, 1e9, 3)) {
    EXPECT_EQ(::pipe(pipe_), 0);
    std::ofstream(folder_.path() / "lines.csv") << "ru,u,y\n";
    std::ofstream(folder_.path() / "garbage", std::ios::binary) << garbage(100'000, 4);
    Installation all;
    all.data = folder_.path() / "data";
    all.version = "test";
    all.engine.workers = 2;
    for (const auto& [name, source] :
         {std::pair{"good", "tcp"}, std::pair{"tcp", "tcp"}, std::pair{"udp", "udp"},
          std::pair{"file", "file"}, std::pair{"pipe", "pipe"}, std::pair{"command", "command"}}) {
      InstalledAxis axis;
      axis.spec.name = name;
      axis.spec.sample_rate_hz = kRate;
      axis.spec.track.method = identification::TrackMethod::physical;
      axis.columns = {"ru", "u", "y", ""};
      axis.source = source;
      axis.configuration = "test";
      all.axes.push_back(std::move(axis));
    }
    using Made = expected<std::unique_ptr<Source>, Error>;
    const auto kept = [](expected<std::unique_ptr<NetworkSource>, Error> made, NetworkSource*& at) -> Made {
      at = made.value().get();
      return std::unique_ptr<Source>(std::move(*made));
    };
    TcpSettings tcp;
    tcp.address = "127.0.0.1:0";
    tcp.most_connections = 64;
    all.sources.push_back(
        {"tcp", "tcp", [=, this](Axes& axes) { return kept(make_tcp_source(tcp, axes), tcp_); }});
    all.sources.push_back(
        {"udp", "udp", [=, this](Axes& axes) {
           return kept(make_udp_source({"127.0.0.1:0", Format{SampleFormat::frame}, 1'000'000}, axes), udp_);
         }});
    all.sources.push_back({"file", "file", [this](Axes& axes) -> Made {
                             return make_file_source({folder_.path() / "lines.csv", Format{}}, axes);
                           }});
    Format lines;
    lines.columns = {"ru", "u", "y"};
    all.sources.push_back({"pipe", "stdin", [=, this](Axes& axes) -> Made {
                             return make_stream_source({lines, pipe_[0]}, axes);
                           }});
    Format numbered;
    numbered.columns = {"sample", "time", "ru", "u", "y"};
    all.sources.push_back({"command", "command", [=, this](Axes& axes) -> Made {
                             const std::string path = (folder_.path() / "garbage").string();
                             return make_command_source({{"tail", "-c", "+1", "-f", path}, numbered}, axes);
                           }});
    auto started = Service::start(std::move(all));
    EXPECT_TRUE(started) << message_of(started.error());
    service_ = std::move(*started);
    const std::string url = service_->url();
    web_ = static_cast<std::uint16_t>(std::stoi(url.substr(url.rfind(':') + 1)));
    EXPECT_TRUE(within(kPatience_s, [this] { return tcp_->bound_port() != 0 && udp_->bound_port() != 0; }));
    sender_ = std::thread([this] { send_good(); });
    EXPECT_TRUE(within(60.0, [this] { return row() > 0; })) << service_->backend().axis("good")->status.why;
  }
  ~BadInput() override {
    ends_.store(true);
    sender_.join();
    ::close(pipe_[1]);
    service_->stop();
    ::close(pipe_[0]);
  }

  /// Real samples in real order, at their pace.
  void send_good() {
    const Client client(tcp_->bound_port());
    const auto begin = Steady::now();
    for (std::uint64_t first = 0; !ends_.load(); first += 25) {
      const double due_s = static_cast<double>(first) / (kSpeed * kRate);
      std::this_thread::sleep_until(
          begin + std::chrono::duration_cast<Steady::duration>(std::chrono::duration<double>(due_s)));
      if (!client.send(frame({"good", first}, std::span(values_).subspan(3 * first % values_.size(), 75))) ||
          client.next_sample("good") != first + 25) {
        broken_.store(true);
        return;
      }
    }
  }
  [[nodiscard]] std::uint64_t row() const { return service_->backend().axis("good")->status.sample; }
  /// While this is so, ten rows come on the axis that is followed.
  void expect_rows(const char* what) {
    const auto before = row();
    EXPECT_TRUE(within(kPatience_s, [&] { return row() >= before + 250; })) << what;
    EXPECT_FALSE(broken_.load()) << what;
  }
  [[nodiscard]] std::uint64_t fault(const std::string& axis, const std::string& kind) const {
    const auto detail = service_->backend().axis(axis);
    for (const auto& f : detail->status.faults)
      if (f.kind == kind) return f.count;
    return 0;
  }
  void expect_fault(const std::string& axis, const std::string& kind) {
    EXPECT_TRUE(within(kPatience_s, [&] { return fault(axis, kind) > 0; })) << axis << ' ' << kind;
    const auto json = nlohmann::json::parse(ask(web_, "GET", "/api/v1/axes/" + axis).body);
    EXPECT_NE(json.dump().find('"' + kind + '"'), std::string::npos) << json.dump();
    const std::string line = "resonid_faults_total{axis=\"" + axis + "\",kind=\"" + kind + "\"}";
    EXPECT_NE(metrics().find(line), std::string::npos) << line;
  }
  [[nodiscard]] std::string metrics() const { return ask(web_, "GET", "/metrics").body; }

  Folder folder_;
  std::vector<double> values_;
  int pipe_[2] = {-1, -1};
  NetworkSource *tcp_ = nullptr, *udp_ = nullptr;
  std::unique_ptr<Service> service_;
  std::uint16_t web_ = 0;
  std::thread sender_;
  std::atomic<bool> ends_{false}, broken_{false};
};

TEST_F(BadInput, OfOneAxisLeavesTheOthersAloneAndIsNamed) {
  const Client tcp(tcp_->bound_port()), udp(udp_->bound_port(), SOCK_DGRAM);
  std::ofstream file(folder_.path() / "lines.csv", std::ios::app | std::ios::binary);
  const auto pipe = [this](std::string_view text) {
    EXPECT_EQ(::write(pipe_[1], text.data(), text.size()), static_cast<::ssize_t>(text.size()));
  };

  // Garbage.
  tcp.send(garbage(300'000, 1));
  for (std::uint64_t k = 0; k < 50; ++k) udp.send(garbage(1400, k));
  file << garbage(100'000, 2) << std::flush;
  pipe(garbage(30'000, 3));
  expect_rows("garbage");
  for (const char* axis : {"udp", "file", "pipe", "command"}) expect_fault(axis, "format");
  const std::string line = "resonid_source_faults_total{source=\"tcp\",kind=\"tcp\",fault=\"format\"}";
  EXPECT_NE(metrics().find(line), std::string::npos);  // nobody knows which axis it was for
  const auto status = nlohmann::json::parse(ask(web_, "GET", "/api/v1/status").body);
  EXPECT_NE(status["sources"][0]["text"].get<std::string>().find("format ("), std::string::npos) << status;

  // Wrong rates, clocks that jump, values that are none, frames and lines reversed and doubled.
  const Client other(tcp_->bound_port());
  const auto send_both = [&](const FrameSpec& spec) {
    FrameSpec one = spec;
    one.axis = "tcp";
    EXPECT_TRUE(other.send(frame(one)));
    one.axis = "udp";
    EXPECT_TRUE(udp.send(frame(one)));
  };
  send_both({"", 0});
  send_both({"", 25, 25, 2.0 * kRate});
  send_both({"", 25, 25, kRate, 3'600'000'000'000});
  send_both({"", 50, 25, kRate, -3'600'000'000'000});
  send_both({"", 75, 25, kRate, 0, std::numeric_limits<double>::quiet_NaN()});
  send_both({"", 150});
  send_both({"", 125});
  send_both({"", 150});
  send_both({"", 150});
  file << "\nnan,inf,1\n1e999,2,3\n" << std::flush;
  pipe("\nnan,-inf,1\n1,2\n1,2,3,4\n");
  std::ofstream command(folder_.path() / "garbage", std::ios::app | std::ios::binary);
  command << '\n';
  for (std::uint64_t k = 0; k < 50; ++k) command << numbered_line(k % 25);
  command << numbered_line(25, 1.0, "nan");
  for (std::uint64_t k = 50; k > 30; --k) command << numbered_line(k);
  // One sample of each second tells the rate, too, in more than a minute of them.
  for (std::uint64_t k = 250; k <= 20'000; k += 250) command << numbered_line(k, 1.02);
  command << std::flush;
  expect_rows("wrong samples");
  for (const char* axis : {"tcp", "udp"})
    for (const char* kind : {"rate", "clock", "value", "order"}) expect_fault(axis, kind);
  expect_fault("file", "value");
  expect_fault("pipe", "value");
  for (const char* kind : {"value", "order", "rate"}) expect_fault("command", kind);
  for (const char* axis : {"tcp", "command"})
    EXPECT_GT(service_->backend().axis(axis)->status.samples.duplicate, 0U) << axis;

  // One byte after the other: late, and whole.
  const Client slow(tcp_->bound_port());
  const auto received = service_->backend().axis("tcp")->status.samples.received;
  for (const char c : frame({"tcp", 175, 10})) {
    EXPECT_TRUE(slow.send({&c, 1}));
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_TRUE(slow.next_sample("tcp"));
  EXPECT_EQ(service_->backend().axis("tcp")->status.samples.received, received + 10);
  expect_rows("a slow client");
}

TEST_F(BadInput, ClientsThatNeverReadAreNotServedForEver) {
  const std::size_t before = resident_bytes();
  // Asks on and on and takes no answer: it is not read from any more.
  const Client deaf(tcp_->bound_port());
  deaf.set_timeout_ms(300);
  std::string questions;
  while (questions.size() < 1'000'000) questions += encoded(Question{"tcp"});
  std::size_t blocks = 0;
  while (blocks < 200 && deaf.send(questions)) ++blocks;
  EXPECT_LT(blocks, 200U);
  // Streams and requests whose answers nobody takes.
  std::vector<WebClient> readers;
  for (int k = 0; k < 40; ++k) {
    readers.emplace_back(web_);
    readers.back().send(request_text("GET", k % 2 == 0 ? "/api/v1/stream?axis=good" : "/metrics"));
  }
  expect_rows("clients that never read");
  EXPECT_EQ(ask(web_, "GET", "/healthz").status, 200);
  EXPECT_LT(resident_bytes(), before + 100'000'000);
}

TEST_F(BadInput, TenThousandConnectionsLeaveRowsAndPageAlone) {
  const std::size_t most = open_all_descriptors();
  const std::size_t wanted = std::min<std::size_t>(10'000, most > 3000 ? most - 2000 : most / 2);
  RecordProperty("connections", static_cast<int>(wanted));
  const std::size_t before = resident_bytes();
  for (const std::uint16_t port : {tcp_->bound_port(), web_}) {
    const auto begin = row();
    std::vector<WebClient> clients;
    clients.reserve(wanted);
    for (std::size_t k = 0; k < wanted; ++k) {
      clients.emplace_back(port);
      ASSERT_GE(clients.back().fd(), 0) << k << ": " << std::strerror(errno);
      if (k % 3 == 0) clients.back().send(k % 2 == 0 ? "GET / HT" : "RSF");
    }
    EXPECT_GT(row(), begin) << "while they came";
    expect_rows("ten thousand connections");
    // The page makes room for who has something to ask.
    int answer = 0;
    EXPECT_TRUE(within(kPatience_s, [&] {
      answer = ask(web_, "GET", "/healthz").status;
      return answer == 200;
    })) << answer;
    if (port == web_) {
      const auto text = metrics();
      const auto at = text.find("\nresonid_http_refused_total ");
      ASSERT_NE(at, std::string::npos);
      EXPECT_GT(std::stod(text.substr(at + 28)), 0.0);
    } else {
      EXPECT_TRUE(within(kPatience_s, [&] {
        return service_->backend().status().sources[0].text.find(" turned away") != std::string::npos;
      })) << service_->backend().status().sources[0].text;
    }
  }
  EXPECT_LT(resident_bytes(), before + 150'000'000);
  EXPECT_TRUE(within(kPatience_s, [&] { return service_->backend().axis("good")->status.trusted; }))
      << service_->backend().axis("good")->status.why;
}

}  // namespace
}  // namespace resonid::monitor
