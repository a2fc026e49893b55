// SPDX-License-Identifier: MIT
// What `resonid monitor` carries on this machine, generator included (docs/monitor.md, "What it costs"):
//   monitor_load RESONID AXES RATE_HZ SECONDS [PAGES]
// Drives in closed loop, simulated before, are sent by TCP as frames of 50 ms, each until it is acknowledged;
// PAGES readers of the event stream look at it: no browsers, so that nothing is drawn. Time stamps are those
// of the newest sample, so that what a page gets tells the time from a sample to its receipt. Ends with 1
// where samples are lost, frames are not taken, or pages (99 %) or /metrics (median) are too late.
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): kill
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <resonid/plant/experiment.hpp>
#include <string>
#include <thread>
#include <vector>

#include "monitor/samples/frame.hpp"

// Its system headers define words that Eigen uses: last.
#include <httplib.h>

namespace resonid::monitor {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::json;
constexpr double kFrame_s = 0.05;
constexpr double kCatchesUp_s = 5.0;       // with the samples that came while it learned
constexpr double kSlowestPage_s = 0.25;    // 99 % of what is told of axes that are followed
constexpr double kSlowestMetrics_s = 0.1;  // median
constexpr int kConnections = 4, kMachines = 4;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }
double unix_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

struct Load {
  std::string program;
  int axes = 100, pages = 30;
  double rate_hz = 2000.0, seconds = 600.0;
};

/// [sample][ru, u, y] of a belt drive with friction, load steps and noise, resonance at 0.03 of the rate.
std::vector<double> recording(const Load& load, std::uint64_t seed) {
  const double speed = load.rate_hz / 250.0;
  plant::ExperimentConfig e;
  e.drive.structure = plant::Structure::two_mass;
  e.drive.driven_inertia = e.drive.load_inertia = 0.032;
  e.drive.stiffness = 36.0 * speed * speed;
  e.drive.damping = 0.15 * speed;
  e.drive.viscous_friction = 0.02;
  e.friction.driven.coulomb = 0.15;
  e.friction.load.coulomb = 0.1;
  for (int k = 1; 30.0 * k < load.seconds; ++k) {
    e.disturbance.load_step_at_s.push_back(30.0 * k + static_cast<double>(seed));
    e.disturbance.load_step.push_back(k % 2 == 1 ? 0.4 : -0.4);
  }
  e.run = {load.rate_hz, load.seconds + 1.0, seed};
  e.controller.kind = plant::ControllerKind::pi;
  e.controller.gain = 0.25 * speed;
  e.controller.integral_time_s = 0.4 / speed;
  e.motion.kind = plant::MotionKind::constant;
  e.motion.velocity = 15.0;
  e.excitation.kind = online::Kind::prbs;
  e.excitation.amplitude = 0.3;
  e.excitation.register_length = 10;
  e.measurement.noise_rms = 0.02 / speed;
  const auto record = plant::simulate_closed_loop(e).value().record;
  std::vector<double> values;
  for (std::size_t k = 0; k < record.samples(); ++k)
    values.insert(values.end(),
                  {record.excitation.samples[k], record.input.samples[k], record.output.samples[k]});
  return values;
}

std::string axis_name(int axis) { return fmt::format("axis-{:04}", axis); }

std::uint16_t free_port() {
  const int s = ::socket(AF_INET, SOCK_STREAM, 0);
  ::sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ::socklen_t size = sizeof at;
  ::bind(s, reinterpret_cast<::sockaddr*>(&at), size);          // NOLINT
  ::getsockname(s, reinterpret_cast<::sockaddr*>(&at), &size);  // NOLINT
  ::close(s);
  return ntohs(at.sin_port);
}

struct Server {
  std::filesystem::path folder;
  std::uint16_t web = 0, samples = 0;
  ::pid_t pid = 0;

  explicit Server(const Load& load) : web(free_port()), samples(free_port()) {
    std::string made = (std::filesystem::temp_directory_path() / "monitor-load-XXXXXX").string();
    if (::mkdtemp(made.data()) == nullptr) throw std::runtime_error("no temporary folder");
    folder = made;
    std::ofstream file(folder / "load.toml");
    file << fmt::format(
        "[monitor]\ndata = \"data\"\nlisten = \"127.0.0.1:{}\"\n[source.line]\nkind = \"tcp\"\n"
        "address = \"127.0.0.1:{}\"\nformat = \"frame\"\n",
        web, samples);
    for (int axis = 0; axis < load.axes; ++axis)
      file << fmt::format(
          "[axis.{}]\nsource = \"line\"\nsample_rate_hz = {}\ninput = \"u\"\noutput = \"y\"\n"
          "excitation = \"ru\"\nmethod = \"physical\"\ncontroller = \"pi:{},{}\"\n",
          axis_name(axis), load.rate_hz, 0.25 * load.rate_hz / 250.0, 0.4 * 250.0 / load.rate_hz);
    file.close();
    const std::string configuration = folder / "load.toml";
    pid = ::fork();
    if (pid == 0) {
      ::execl(load.program.c_str(), load.program.c_str(), "monitor", configuration.c_str(), nullptr);
      ::_exit(127);
    }
  }
  ~Server() {
    ::kill(pid, SIGTERM);
    ::waitpid(pid, nullptr, 0);
    std::filesystem::remove_all(folder);
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] httplib::Client client() const {
    httplib::Client made("127.0.0.1", web);
    made.set_read_timeout(20);
    return made;
  }
  /// Processor seconds so far, and memory in bytes.
  [[nodiscard]] std::array<double, 2> taken() const {
    std::ifstream file(fmt::format("/proc/{}/stat", pid));
    std::string word;
    std::array<double, 2> all{};
    for (int k = 1; k <= 24 && file >> word; ++k) {
      if (k == 14 || k == 15) all[0] += std::atof(word.c_str()) / static_cast<double>(::sysconf(_SC_CLK_TCK));
      if (k == 24) all[1] = std::atof(word.c_str()) * static_cast<double>(::sysconf(_SC_PAGESIZE));
    }
    return all;
  }
};

/// Sends its share of the axes as time goes on, and counts what is acknowledged.
class Sender {
 public:
  Sender(const Load& load, const std::vector<std::vector<double>>& machines, std::uint16_t port, int share)
      : load_(load), machines_(machines), port_(port), share_(share) {}

  void run(Clock::time_point start) {
    const int s = ::socket(AF_INET, SOCK_STREAM, 0);
    ::sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(port_);
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int yes = 1;
    ::setsockopt(s, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    if (::connect(s, reinterpret_cast<::sockaddr*>(&at), sizeof at) != 0)  // NOLINT
      throw std::runtime_error("the server takes no samples");
    std::thread answers([this, s] { listen(s); });
    const auto per_frame = static_cast<std::uint64_t>(std::llround(kFrame_s * load_.rate_hz));
    const auto frames = static_cast<std::uint64_t>(load_.seconds / kFrame_s);
    static constexpr std::array<std::string_view, 3> kColumns = {"ru", "u", "y"};
    for (std::uint64_t frame = 0; frame < frames; ++frame) {
      const double due_s = static_cast<double>(frame + 1) * kFrame_s;
      std::this_thread::sleep_until(
          start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(due_s)));
      late_s = std::max(late_s.load(), since(start) - due_s);
      for (int axis = share_; axis < load_.axes; axis += kConnections) {
        Arrival arrival;
        const std::string name = axis_name(axis);
        arrival.axis = name;
        arrival.first_sample = frame * per_frame;
        arrival.sample_rate_hz = load_.rate_hz;
        arrival.time_ns =
            static_cast<std::int64_t>(1e9 * (unix_s() - static_cast<double>(per_frame - 1) / load_.rate_hz));
        arrival.columns = kColumns;
        const auto& machine = machines_[static_cast<std::size_t>(axis % kMachines)];
        arrival.values = std::span(machine).subspan(3 * frame * per_frame, 3 * per_frame);
        const auto bytes = encoded(arrival, ValueType::float32).value();
        for (std::size_t done = 0; done < bytes.size();) {
          const auto n = ::send(s, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
          if (n <= 0) throw std::runtime_error("the server closed the connection");
          done += static_cast<std::size_t>(n);
        }
        ++sent;
      }
    }
    for (int wait = 0; wait < 100 && answered < sent; ++wait)
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    ::shutdown(s, SHUT_RDWR);
    answers.join();
    ::close(s);
  }

  std::atomic<std::uint64_t> sent = 0, answered = 0, refused = 0;
  std::atomic<double> late_s = 0.0;

 private:
  void listen(int s) {
    FaultLog faults;
    FrameDecoder decoder(faults);
    std::array<char, 65536> buffer{};
    for (::ssize_t n = 0; (n = ::recv(s, buffer.data(), buffer.size(), 0)) > 0;)
      decoder.add({buffer.data(), static_cast<std::size_t>(n)}, [this](const Message& message) {
        const auto* a = std::get_if<Acknowledgement>(&message);
        if (a == nullptr) return;
        ++answered;
        refused += a->next_sample == Acknowledgement::kRefused;
      });
  }

  const Load& load_;
  const std::vector<std::vector<double>>& machines_;
  std::uint16_t port_;
  int share_;
};

/// One page: from the newest sample of every axis in each frame to its receipt, in seconds.
class Page {
 public:
  void run(const Server& server, int axis, const std::atomic<bool>& end) {
    auto client = server.client();
    std::string text;
    client.Get(fmt::format("/api/v1/stream?axis={}", axis_name(axis)), [&](const char* data, std::size_t n) {
      text.append(data, n);
      for (std::size_t stop = 0; (stop = text.find("\n\n")) != std::string::npos; text.erase(0, stop + 2))
        take(text.substr(0, stop));
      return !end;
    });
  }
  std::vector<double> latency_s, before_s;  ///< Axes that are followed, and those that learn and catch up.
  std::uint64_t frames = 0;

 private:
  void take(const std::string& event) {
    const double now = unix_s();
    if (event.find("event: frame") == std::string::npos) return;
    ++frames;
    if (frames % 10 != 0) return;  // reading all of them would be the load
    const auto json = Json::parse(event.substr(event.find("data: ") + 6), nullptr, false);
    if (!json.is_object()) return;
    const double passed = now - json["time_s"].get<double>();
    for (const auto& [name, axis] : json["axes"].items()) {
      const bool follows = axis["state"] == "following";
      auto& since_s = follows_since_s_[name];
      if (!follows) since_s = 0.0;
      if (follows && since_s == 0.0) since_s = now;
      if (!axis.contains("age_s") || !axis["age_s"].is_number()) continue;
      auto& list = follows && now - since_s >= kCatchesUp_s ? latency_s : before_s;
      list.push_back(passed + axis["age_s"].get<double>());
    }
  }
  std::map<std::string, double> follows_since_s_;
};

double part(std::vector<double>& sorted, double p) {
  if (sorted.empty()) return std::nan("");
  std::sort(sorted.begin(), sorted.end());
  return sorted[std::min(sorted.size() - 1,
                         static_cast<std::size_t>(p * static_cast<double>(sorted.size())))];
}

int run(const Load& load) {
  std::vector<std::vector<double>> machines;
  for (std::uint64_t seed = 1; seed <= kMachines; ++seed) machines.push_back(recording(load, seed));
  Server server(load);
  for (int wait = 0; wait < 300 && !server.client().Get("/healthz"); ++wait)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const auto start = Clock::now();
  std::vector<std::unique_ptr<Sender>> senders;
  std::vector<std::thread> threads;
  for (int share = 0; share < kConnections; ++share) {
    senders.push_back(std::make_unique<Sender>(load, machines, server.samples, share));
    threads.emplace_back([&, share] { senders[static_cast<std::size_t>(share)]->run(start); });
  }
  // Everything has been learned by then; what it costs until then is told apart.
  const double warm_s = std::min(0.4 * load.seconds, 300.0);
  std::this_thread::sleep_until(
      start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(warm_s)));
  const auto before = server.taken();
  const auto measured = Clock::now();
  std::atomic<bool> end = false;
  std::vector<Page> pages(static_cast<std::size_t>(load.pages));
  std::vector<std::thread> readers;
  for (int page = 0; page < load.pages; ++page)
    readers.emplace_back(
        [&, page] { pages[static_cast<std::size_t>(page)].run(server, page % load.axes, end); });
  std::vector<double> metrics_s;
  while (since(start) < load.seconds - 3.0) {
    const auto asked = Clock::now();
    if (server.client().Get("/metrics")) metrics_s.push_back(since(asked));
    std::this_thread::sleep_for(std::chrono::seconds(2));
  }
  const auto after = server.taken();
  const double share = (after[0] - before[0]) / since(measured);
  const double measured_s = since(measured);
  end = true;
  for (auto& thread : threads) thread.join();
  for (auto& reader : readers) reader.join();
  std::this_thread::sleep_for(std::chrono::seconds(3));
  const auto axes = Json::parse(server.client().Get("/api/v1/axes")->body);
  std::map<std::string, int> states;
  double received = 0.0, lost = 0.0, missing = 0.0;
  for (const auto& axis : axes["axes"]) {
    ++states[axis["state"].get<std::string>() + (axis["trusted"].get<bool>() ? ", trusted" : "")];
    received += axis["samples"]["received"].get<double>();
    lost += axis["samples"]["lost"].get<double>();
    missing += axis["samples"]["missing"].get<double>();
  }
  std::uint64_t sent = 0, answered = 0, refused = 0;
  double late_s = 0.0;
  for (const auto& sender : senders) {
    sent += sender->sent;
    answered += sender->answered;
    refused += sender->refused;
    late_s = std::max(late_s, sender->late_s.load());
  }
  std::vector<double> latency_s, before_s;
  std::uint64_t frames = 0;
  for (auto& page : pages) {
    latency_s.insert(latency_s.end(), page.latency_s.begin(), page.latency_s.end());
    before_s.insert(before_s.end(), page.before_s.begin(), page.before_s.end());
    frames += page.frames;
  }
  const double per_frame = std::round(kFrame_s * load.rate_hz);
  fmt::print("{} axes at {} Hz for {} s, {} pages\n", load.axes, load.rate_hz, load.seconds, load.pages);
  fmt::print(
      "samples: {:.0f} sent, {:.0f} received, {:.0f} lost, {:.0f} missing; {} of {} frames answered, {} "
      "refused; sent {:.3f} s late at most\n",
      static_cast<double>(sent) * per_frame, received, lost, missing, answered, sent, refused, late_s);
  for (const auto& [state, count] : states) fmt::print("axes {}: {}\n", state, count);
  fmt::print(
      "processor: {:.1f} s up to {:.0f} s, then {:.3f} of a core, {:.3f} ms per axis and second; memory "
      "{:.1f} MB, {:.0f} kB per axis\n",
      before[0], warm_s, share, 1e3 * share / load.axes, after[1] / 1e6, after[1] / 1e3 / load.axes);
  if (load.pages > 0) {
    for (auto* list : {&latency_s, &before_s}) {
      const double median = part(*list, 0.5), p99 = part(*list, 0.99), worst = part(*list, 1.0);
      fmt::print("sample to page, {}: median {:.3f} s, 99 % {:.3f} s, worst {:.3f} s, of {}\n",
                 list == &latency_s ? "axes that are followed" : "axes that learn or catch up", median, p99,
                 worst, list->size());
    }
    fmt::print("{:.1f} frames per second\n", static_cast<double>(frames) / load.pages / measured_s);
  }
  const double median = part(metrics_s, 0.5), worst = part(metrics_s, 1.0);
  fmt::print("/metrics: median {:.4f} s, worst {:.4f} s\n", median, worst);
  bool missed = false;
  const auto require = [&missed](bool met, const std::string& what) {
    if (!met) fmt::print("missed: {}\n", what);
    missed = missed || !met;
  };
  require(!(lost > 0.0), "no sample is lost");
  require(answered == sent && refused == 0, "every frame is answered, and none refused");
  require(load.pages == 0 || part(latency_s, 0.99) <= kSlowestPage_s,
          fmt::format("sample to page, axes that are followed: 99 % within {} s", kSlowestPage_s));
  require(median <= kSlowestMetrics_s, fmt::format("/metrics: median within {} s", kSlowestMetrics_s));
  return missed ? 1 : 0;
}

}  // namespace
}  // namespace resonid::monitor

int main(int argc, char** argv) {
  if (argc < 5 || argc > 6) {
    fmt::print(stderr, "monitor_load RESONID AXES RATE_HZ SECONDS [PAGES]\n");
    return 2;
  }
  resonid::monitor::Load load;
  load.program = argv[1];
  load.axes = std::atoi(argv[2]);
  load.rate_hz = std::atof(argv[3]);
  load.seconds = std::atof(argv[4]);
  if (argc > 5) load.pages = std::atoi(argv[5]);
  return resonid::monitor::run(load);
}
