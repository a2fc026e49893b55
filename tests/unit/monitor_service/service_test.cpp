// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <monitor/service/service.hpp>
#include <monitor/store/reader.hpp>
#include <random>
#include <resonid/base/error_text.hpp>

#include "children.hpp"
#include "drive.hpp"
#include "folder.hpp"
#include "pulsed.hpp"

namespace resonid::monitor {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

pid_t start_timed(const fs::path& folder, const char* speed, double* seconds = nullptr) {
  const auto begin = std::chrono::steady_clock::now();
  const pid_t child = start_child({folder.string(), speed});
  if (seconds != nullptr)
    *seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return child;
}

struct Stored {
  std::vector<std::vector<RowRecord>> rows;  // [axis]
  std::vector<std::vector<EventRecord>> events;
};
Stored stored(const fs::path& folder) {
  Stored all;
  auto reader = Reader::open((folder / "monitor.sqlite").string()).value();
  for (const char* axis : {"axis0", "axis1", "axis2"}) {
    all.rows.push_back(reader.rows(axis, 0, std::numeric_limits<std::int64_t>::max(), 1'000'000).value());
    all.events.emplace_back();
    const auto alarms = reader.alarms(AlarmFilter::all, std::string(axis), 10'000).value();
    for (const auto& alarm : alarms) {
      const auto events = reader.events(alarm.id, 10'000).value();
      all.events.back().insert(all.events.back().end(), events.begin(), events.end());
    }
  }
  return all;
}

void expect_same(const Stored& a, const Stored& b) {
  for (std::size_t axis = 0; axis < a.rows.size(); ++axis) {
    ASSERT_EQ(a.rows[axis].size(), b.rows[axis].size()) << axis;
    for (std::size_t i = 0; i < a.rows[axis].size(); ++i) {
      const auto &x = a.rows[axis][i], &y = b.rows[axis][i];
      ASSERT_EQ(x.row.sample, y.row.sample);
      ASSERT_EQ(x.time_ns, y.time_ns);
      ASSERT_EQ(std::memcmp(x.row.figures.data(), y.row.figures.data(), sizeof x.row.figures), 0)
          << axis << ' ' << x.row.sample;
      ASSERT_EQ(x.row.trusted, y.row.trusted);
    }
    ASSERT_EQ(a.events[axis].size(), b.events[axis].size()) << axis;
    for (std::size_t i = 0; i < a.events[axis].size(); ++i) {
      EXPECT_EQ(a.events[axis][i].sample, b.events[axis][i].sample);
      EXPECT_EQ(a.events[axis][i].alarm, b.events[axis][i].alarm);
      EXPECT_EQ(a.events[axis][i].transition, b.events[axis][i].transition);
      EXPECT_EQ(a.events[axis][i].text, b.events[axis][i].text);
    }
  }
}

TEST(Service, LosesNothingToKillsAtAnyInstant) {
  const Folder undisturbed, killed;
  int status = 0;
  waitpid(start_timed(undisturbed.path(), "100"), &status, 0);
  ASSERT_EQ(status, 0);
  const Stored truth = stored(undisturbed.path());
  ASSERT_GT(truth.rows[0].size(), 90U);
  ASSERT_FALSE(truth.events[0].empty());

  const char* more = std::getenv("RESONID_KILLS");
  const int kills = more != nullptr ? std::atoi(more) : 12;
  std::mt19937_64 generator(7);
  int done = 0;
  double slowest = 0.0;
  while (true) {
    double seconds = 0.0;
    const pid_t child = start_timed(killed.path(), "20", &seconds);
    slowest = std::max(slowest, seconds);
    if (done < kills) {
      std::this_thread::sleep_for(
          std::chrono::milliseconds(generator() % (6000 / static_cast<unsigned>(kills))));
      kill(child, SIGKILL);
      ++done;
    }
    waitpid(child, &status, 0);
    if (WIFEXITED(status)) break;
  }
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_GT(done, kills / 2);
  RecordProperty("kills", done);
  RecordProperty("slowest_start_ms", static_cast<int>(1e3 * slowest));
  expect_same(truth, stored(killed.path()));
}

TEST(Service, GivesRawSamplesByTheirSendersTimesOverAPause) {
  const Folder folder;
  Pulses pulses;
  auto service = Service::start(pulses.installation(folder.path(), {"x"}));
  ASSERT_TRUE(service) << message_of(service.error());
  const auto& backend = (*service)->backend();
  EXPECT_TRUE(std::isnan(backend.axis("x")->raw_from_time_s));
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t begin_s = now_ns() / kSecond - 52;
  for (int i = 0; i < 27; ++i) pulses.send(1000, (begin_s + i + (i < 15 ? 0 : 25)) * kSecond);
  const auto first_line = [&](int from_s, int to_s) {
    const auto text =
        backend.raw("x", static_cast<double>(begin_s + from_s), static_cast<double>(begin_s + to_s));
    return text ? text->substr(0, text->find(';')) : text.error().message;
  };
  EXPECT_NEAR(backend.axis("x")->raw_from_time_s, static_cast<double>(begin_s), 1e-5);
  EXPECT_EQ(first_line(7, 8), "# axis x, samples 7000 to 8000");
  EXPECT_EQ(first_line(45, 46), "# axis x, samples 20000 to 21000");
  EXPECT_EQ(first_line(14, 41), "# axis x, samples 14000 to 16000");
  EXPECT_NE(first_line(20, 21).find("no samples of this time"), std::string::npos) << first_line(20, 21);
  EXPECT_NE(first_line(52, 60).find("no samples of this time"), std::string::npos);
  (*service)->stop();
}

TEST(Service, GivesRawSamplesWithoutTimesByWhenTheyCame) {
  const Folder folder;
  Pulses pulses;
  auto service = Service::start(pulses.installation(folder.path(), {"x"}));
  ASSERT_TRUE(service) << message_of(service.error());
  const auto& backend = (*service)->backend();
  pulses.send(2000);
  bool given = false;
  for (int i = 0; i < 500 && !given; ++i) {
    std::this_thread::sleep_for(10ms);
    const double from_s = backend.axis("x")->raw_from_time_s;
    if (!std::isfinite(from_s)) continue;
    EXPECT_LT(from_s, 1e-9 * static_cast<double>(now_ns()) - 1.5);
    const auto raw = backend.raw("x", from_s - 1.0, from_s + 0.5);
    given = raw && std::abs(std::count(raw->begin(), raw->end(), '\n') - 502) <= 2;  // with two of the head
  }
  EXPECT_TRUE(given);
  (*service)->stop();
}

TEST(Service, CompletesEvidenceThatItsEndCutShort) {
  const Folder folder;
  Pulses pulses;
  std::uint64_t id = 0;
  const auto evidence = [&](const web::Backend& backend) {
    const auto text = backend.evidence(id);
    return text ? text->substr(0, text->find(';')) : text.error().message;
  };
  {
    auto all = pulses.installation(folder.path(), {"x"});
    all.engine.first_sample_s = 60.0;
    auto service = Service::start(std::move(all));
    ASSERT_TRUE(service) << message_of(service.error());
    const auto& backend = (*service)->backend();
    pulses.send(1000);
    const auto alarms = alarms_once(backend, web::AlarmFilter::active,
                                    [](const std::vector<web::Alarm>& found) { return !found.empty(); });
    ASSERT_FALSE(alarms.empty());
    id = alarms.front().id;
    (*service)->stop();
    EXPECT_EQ(evidence(backend), "# axis x, samples 0 to 1000");
  }
  const fs::path report = folder.path() / "evidence" / (std::to_string(id) + ".html");
  std::ofstream(report) << "of the first second";
  if (const auto idle = Service::start(pulses.installation(folder.path(), {"x"}))) (*idle)->stop();
  EXPECT_TRUE(fs::exists(report));  // nothing came since
  auto service = Service::start(pulses.installation(folder.path(), {"x"}));
  ASSERT_TRUE(service) << message_of(service.error());
  const auto& backend = (*service)->backend();
  pulses.send(7000);
  for (int i = 0; i < 500 && evidence(backend) != "# axis x, samples 0 to 6000"; ++i)
    std::this_thread::sleep_for(10ms);
  EXPECT_EQ(evidence(backend), "# axis x, samples 0 to 6000");
  (*service)->stop();
  EXPECT_FALSE(fs::exists(report));
}

TEST(Service, AnswersWhileItRunsAndTakesActions) {
  const Folder folder;
  const std::vector<std::vector<double>> values{drive_samples(110.0, 75.0, 1)};
  auto all = installation(folder.path(), values, 0.0);
  all.axes[0].spec.alarms[monitoring::Watched::stiffness].low = 10.0;
  auto service = Service::start(std::move(all));
  ASSERT_TRUE(service) << message_of(service.error());
  auto& backend = (*service)->backend();
  for (int i = 0; i < 500 && backend.alarms({web::AlarmFilter::active, "", 10}).value().empty(); ++i)
    std::this_thread::sleep_for(20ms);
  const auto alarms = backend.alarms({web::AlarmFilter::active, "", 10}).value();
  ASSERT_FALSE(alarms.empty());
  EXPECT_EQ(alarms.back().axis, "axis0");
  EXPECT_FALSE(alarms.back().text.empty());
  web::Action action;
  action.kind = web::ActionKind::acknowledge;
  action.alarm = alarms.back().id;
  action.who = "tester";
  action.reason = "seen";
  ASSERT_TRUE(backend.act(action));
  for (int i = 0; i < 200 && backend.audit(10).value().empty(); ++i) std::this_thread::sleep_for(20ms);
  ASSERT_FALSE(backend.audit(10).value().empty());
  EXPECT_EQ(backend.audit(10).value().front().who, "tester");
  const auto response = backend.response("axis0");
  ASSERT_TRUE(response);
  EXPECT_EQ(response->plant.frequency_hz.size(), response->plant.std.size());
  const auto& coherence = response->plant.coherence;
  ASSERT_EQ(coherence.size(), response->plant.frequency_hz.size());
  EXPECT_EQ(response->plant.coherence_std.size(), coherence.size());
  EXPECT_GT(*std::max_element(coherence.begin(), coherence.end()), 0.9);
  EXPECT_LT(*std::min_element(coherence.begin(), coherence.end()), 0.5) << "at half the sample rate is noise";
  EXPECT_FALSE(backend.axis("nobody"));
  const auto axis = backend.axis("axis0");
  ASSERT_TRUE(axis);
  const auto& stiffness = axis->status.figures[static_cast<std::size_t>(monitoring::Watched::stiffness)];
  EXPECT_LT(stiffness.change, 0.0);
  EXPECT_EQ(stiffness.low, 10.0);
  EXPECT_EQ(axis->longest_shelving_s, 604'800.0);
  const double now_s = static_cast<double>(now_ns()) * 1e-9, kept_s = axis->raw_from_time_s;
  EXPECT_LT(kept_s, now_s);
  const auto raw = backend.raw("axis0", kept_s + 5.0, kept_s + 6.0);
  ASSERT_TRUE(raw);
  EXPECT_GT(std::count(raw->begin(), raw->end(), '\n'), 240);
  const auto gone = backend.raw("axis0", kept_s - 100.0, kept_s - 50.0);
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().kind, web::Problem::Kind::not_found);
  std::this_thread::sleep_for(300ms);
  const auto evidence = backend.evidence(alarms.back().id);
  if (evidence) {
    EXPECT_NE(evidence->find("ru,u,y"), std::string::npos);
  }
  (*service)->stop();
  EXPECT_TRUE(backend.evidence(alarms.back().id));
  const auto stored = backend.alarms({web::AlarmFilter::all, "", 100}).value();
  for (const auto& alarm : stored) EXPECT_TRUE(alarm.evidence);
  EXPECT_TRUE(backend.report(alarms.back().id));
}

}  // namespace
}  // namespace resonid::monitor
