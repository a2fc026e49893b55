// SPDX-License-Identifier: MIT
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <atomic>
#include <cstring>
#include <fstream>
#include <memory>
#include <monitor/store/reader.hpp>
#include <nlohmann/json.hpp>
#include <random>
#include <tuple>

#include "../monitor_brokers/brokers.hpp"
#include "../monitor_sources/client.hpp"
#include "children.hpp"
#include "drive.hpp"
#include "folder.hpp"

namespace resonid::monitor {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr std::uint64_t kStops[] = {22'500, 25'000, 27'500};
constexpr std::size_t kAtOnce = 50;  // samples
/// Samples that those who number them and tell their times leave out: the drive stood still.
constexpr std::uint64_t kStandsFrom = 15'000, kStandsUntil = 18'750;
const char* const kAxes[] = {"axis0", "axis1"};

/// Brings each axis its samples by itself, as far as it is allowed to.
class Senders {
 public:
  virtual ~Senders() = default;
  void allow(std::uint64_t samples) { allowed_.store(samples); }
  /// What the child must know of them.
  [[nodiscard]] virtual std::vector<std::string> arguments() const = 0;

 protected:
  /// Runs `bring` until the end.
  template <class Bring>
  void begin(Bring bring) {
    threads_.emplace_back(bring);
  }
  void end() {
    ending_.store(true);
    for (auto& thread : threads_) thread.join();
  }
  [[nodiscard]] bool ending() const { return ending_.load(); }
  /// Samples of an axis from one on, as many as go at once and are allowed.
  [[nodiscard]] std::span<const double> samples(std::size_t axis, std::uint64_t from,
                                                std::uint64_t end = kStops[2]) const {
    end = std::min(end, allowed_.load());
    const std::size_t count = end > from ? std::min<std::size_t>(kAtOnce, end - from) : 0;
    return std::span(values_[axis]).subspan(3 * from, 3 * count);
  }
  struct Message {
    std::uint64_t first = 0, end = 0;
    std::string frame;
  };
  /// The frame from a sample on, with its time; none where nothing goes yet.
  [[nodiscard]] std::optional<Message> message(std::size_t axis, std::string_view name,
                                               std::uint64_t from) const {
    static constexpr std::string_view kColumns[] = {"ru", "u", "y"};
    if (from >= kStandsFrom) from = std::max(from, kStandsUntil);
    const auto values = samples(axis, from, from < kStandsFrom ? kStandsFrom : kStops[2]);
    if (values.empty()) return std::nullopt;
    const std::int64_t time_ns = begin_ns_ + static_cast<std::int64_t>(from) * std::llround(1e9 / kRate);
    return Message{
        from, from + values.size() / 3,
        encoded(Arrival{name, from, time_ns, kRate, kColumns, values, {}}, ValueType::float64).value()};
  }

 private:
  const std::int64_t begin_ns_ = now_ns() - 120'000'000'000;
  const std::vector<double> values_[2] = {drive_samples(110.0, 75.0, 1), drive_samples(110.0, 70.0, 1)};
  std::atomic<std::uint64_t> allowed_{0};
  std::atomic<bool> ending_{false};
  std::vector<std::thread> threads_;
};

/// A file that grows and a client that keeps what is not acknowledged.
class FileAndTcp : public Senders {
 public:
  explicit FileAndTcp(const fs::path& folder) {
    begin([this, folder] { write(folder / "samples.csv"); });
    begin([this, folder] { send((folder / "socket").string()); });
  }
  ~FileAndTcp() override { end(); }
  [[nodiscard]] std::vector<std::string> arguments() const override { return {"sources"}; }

 private:
  void write(const fs::path& path) {
    std::ofstream file(path);
    file << "ru,u,y\n";
    for (std::uint64_t next = 0; !ending(); std::this_thread::sleep_for(1ms)) {
      const auto v = samples(0, next);
      for (std::size_t i = 0; i < v.size(); i += 3)
        file << fmt::format("{},{},{}\n", v[i], v[i + 1], v[i + 2]);
      file << std::flush;
      next += v.size() / 3;
    }
  }
  void send(const std::string& socket) {
    for (; !ending(); std::this_thread::sleep_for(1ms)) {
      const Client client(socket);
      if (!client.connected() || !client.send(encoded(Question{"axis1"}))) continue;
      client.set_timeout_ms(1000);
      auto next = client.next_sample("axis1");
      while (next && !ending()) {
        std::this_thread::sleep_for(1ms);
        const auto due = message(1, "axis1", *next);
        if (!due) continue;
        if (!client.send(due->frame)) break;
        next = client.next_sample("axis1");
      }
    }
  }
};

/// Publishers at brokers that keep what is not confirmed: QoS 1 with a session that stays, and JetStream.
class Brokers : public Senders {
 public:
  Brokers() {
    {  // the session begins before anything is sent
      const test::TemporaryFolder folder;
      test::Rings rings(folder.path(), {"axis0"});
      const auto source = test::mqtt_source(mosquitto_.port(), rings);
      source->start();
      EXPECT_TRUE(test::until([&] { return source->status().state == SourceState::running; }));
    }
    nats_.make_stream("SAMPLES", "machines.>");
    begin([this] {
      test::MqttSender sender(mosquitto_.port());
      publish(0, [&](const std::string& frame) { sender.send("machines/axis0/samples", frame); });
    });
    begin([this] {
      publish(1, [&](const std::string& frame) { nats_.store("machines.axis1.samples", frame); });
    });
  }
  ~Brokers() override { end(); }
  [[nodiscard]] std::vector<std::string> arguments() const override {
    return {"brokers", std::to_string(mosquitto_.port()), server_.url()};
  }

 private:
  template <class Send>
  void publish(std::size_t axis, const Send& send) {
    for (std::uint64_t next = 0; !ending(); std::this_thread::sleep_for(1ms)) {
      const auto due = message(axis, {}, next);
      if (!due) continue;
      send(due->frame);
      next = due->end;
    }
  }

  const test::Mosquitto mosquitto_;
  const test::NatsServer server_;
  test::NatsSender nats_{server_.url()};
};

/// Runs the service over all samples, with a person's actions at each stop but the last, and kills it so
/// often on the way, and right after the actions.
void follow(const fs::path& folder, Senders& senders, int kills) {
  std::mt19937_64 generator(7);
  std::vector<std::string> arguments{folder.string()};
  for (auto& argument : senders.arguments()) arguments.push_back(std::move(argument));
  for (const auto stop : kStops) arguments.push_back(std::to_string(stop));
  pid_t child = start_child(arguments);
  const auto kill_it = [&] {
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  };
  std::uint64_t from = 0;
  int left = kills;
  for (const auto stop : kStops) {
    const int here = stop == kStops[0] ? left - left / 3 : left / 2;
    for (int k = 1; k <= here; ++k) {
      senders.allow(from +
                    (stop - from) * static_cast<std::uint64_t>(k) / static_cast<std::uint64_t>(here + 1));
      std::this_thread::sleep_for(std::chrono::microseconds(generator() % 100'000));
      kill_it();
      child = start_child(arguments);
    }
    left -= here;
    senders.allow(stop);
    from = stop;
    if (stop == kStops[std::size(kStops) - 1]) break;
    const fs::path acted = folder / ("acted-" + std::to_string(stop));
    for (int i = 0; i < 3000 && !fs::exists(acted); ++i) std::this_thread::sleep_for(20ms);
    const bool done = fs::exists(acted);
    if (done && kills == 0) continue;
    kill_it();
    ASSERT_TRUE(done) << "not at sample " << stop << " within a minute";
    child = start_child(arguments);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

/// What is the same whenever samples come.
struct Left {
  std::vector<RowRecord> rows;
  using Alarm = std::tuple<std::string, std::string, std::uint64_t, bool, bool, bool, bool>;
  std::vector<Alarm> alarms;
  using Event = std::tuple<std::string, std::uint64_t, std::string, std::string>;
  std::vector<Event> events;
  using Action = std::tuple<std::uint64_t, std::string, std::string, std::string>;
  std::vector<Action> actions;
  std::vector<std::uint64_t> baselines;
};
Left left_in(const fs::path& folder, const std::string& axis) {
  constexpr std::size_t kAll = 1'000'000;
  Left left;
  auto reader = Reader::open((folder / "monitor.sqlite").string()).value();
  left.rows = reader.rows(axis, 0, std::numeric_limits<std::int64_t>::max(), kAll).value();
  // Samples without times come faster than real time here: their times do not tell their order.
  std::sort(left.rows.begin(), left.rows.end(),
            [](const auto& a, const auto& b) { return a.row.sample < b.row.sample; });
  const auto alarms = reader.alarms(AlarmFilter::all, axis, kAll).value();
  for (const auto& a : alarms) {
    left.alarms.emplace_back(a.id, a.alarm, a.sample, a.active, a.acknowledged, a.latched, a.open);
    // What was told of it stays as it was told first.
    const auto events = reader.events(a.id, kAll).value();
    const auto since = [](const std::string& json) { return nlohmann::json::parse(json).at("since_ns"); };
    EXPECT_EQ(events.front().transition, "raised");
    EXPECT_EQ(since(a.json), since(events.front().json)) << a.alarm;
  }
  std::sort(left.alarms.begin(), left.alarms.end());
  const auto all_events = reader.events_from(axis, 0, kAll).value();
  for (const auto& e : all_events) left.events.emplace_back(e.alarm_id, e.sample, e.alarm, e.transition);
  const auto actions = reader.actions(axis, 0, kAll).value();
  for (const auto& a : actions) left.actions.emplace_back(a.sample, a.kind, a.who, a.arguments);
  const auto baselines = reader.baselines(axis, kAll).value();
  for (const auto& b : baselines) left.baselines.push_back(b.sample);
  return left;
}

/// The second run is killed, the first one not.
template <class Make>
void expect_the_same(const Make& make_senders) {
  const Folder undisturbed, killed;
  const char* more = std::getenv("RESONID_KILLS");
  follow(undisturbed.path(), *make_senders(undisturbed.path()), 0);
  follow(killed.path(), *make_senders(killed.path()), more != nullptr ? std::atoi(more) : 6);
  for (const std::string axis : kAxes) {
    const Left truth = left_in(undisturbed.path(), axis), found = left_in(killed.path(), axis);
    EXPECT_GT(truth.rows.size(), 90U) << axis;
    EXPECT_FALSE(truth.alarms.empty()) << axis;
    EXPECT_EQ(truth.baselines.size(), 2U) << axis;
    EXPECT_GT(truth.actions.size(), 2U) << axis;
    ASSERT_EQ(found.rows.size(), truth.rows.size()) << axis;
    for (std::size_t i = 0; i < truth.rows.size(); ++i) {
      const auto &a = found.rows[i].row, &b = truth.rows[i].row;
      ASSERT_EQ(a.sample, b.sample) << axis;
      ASSERT_EQ(std::memcmp(a.figures.data(), b.figures.data(), sizeof a.figures), 0)
          << axis << ' ' << a.sample;
      ASSERT_EQ(a.trusted, b.trusted) << axis << ' ' << a.sample;
      if (axis != kAxes[1]) continue;  // tells its times
      const auto since_first = [i](const Left& left) { return left.rows[i].time_ns - left.rows[0].time_ns; };
      ASSERT_NEAR(static_cast<double>(since_first(found)), static_cast<double>(since_first(truth)), 1e6)
          << a.sample;
    }
    EXPECT_EQ(found.alarms, truth.alarms) << axis;
    EXPECT_EQ(found.events, truth.events) << axis;
    EXPECT_EQ(found.actions, truth.actions) << axis;
    EXPECT_EQ(found.baselines, truth.baselines) << axis;
  }
}

TEST(Kill, NoRowAlarmOrActionOfAFileOrOfTcpDiffersFromAnUndisturbedRun) {
  expect_the_same([](const fs::path& folder) { return std::make_unique<FileAndTcp>(folder); });
}

TEST(Kill, NoRowAlarmOrActionOfMqttOrOfJetStreamDiffersFromAnUndisturbedRun) {
  RESONID_REQUIRE_PROGRAM("mosquitto");
  RESONID_REQUIRE_PROGRAM("nats-server");
  expect_the_same([](const fs::path&) { return std::make_unique<Brokers>(); });
}

}  // namespace
}  // namespace resonid::monitor
