// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <monitor/service/baseline_curve.hpp>
#include <monitor/service/service.hpp>
#include <monitor/store/reader.hpp>
#include <resonid/base/error_text.hpp>
#include <thread>

#include "drive.hpp"
#include "folder.hpp"

namespace resonid::monitor {
namespace {

using namespace std::chrono_literals;
constexpr double kBegin_s = 1.7e9;  // of the drive's samples

template <class Condition>
bool comes_true(Condition condition) {
  for (int i = 0; i < 1500 && !condition(); ++i) std::this_thread::sleep_for(20ms);
  return condition();
}

web::Action action_of(web::ActionKind kind) {
  web::Action action;
  action.kind = kind;
  action.axis = "axis0";
  action.who = "tester";
  return action;
}

TEST(BaselineCurve, ComesBackFromItsBytesAndFromNoOthers) {
  monitoring::ResponseCurve curve;
  curve.frequency_hz = {1.0, 2.5, 9.0};
  curve.plant = {{1.0, -2.0}, {0.25, -0.5}, {-0.1, 1e-9}};
  curve.std = {0.1, 0.01, 0.001};
  curve.loop = curve.plant;
  const auto bytes = curve_bytes(curve);
  const auto back = curve_of(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->frequency_hz, curve.frequency_hz);
  EXPECT_EQ(back->plant, curve.plant);
  EXPECT_EQ(back->std, curve.std);
  EXPECT_TRUE(back->loop.empty());
  curve.std.clear();
  EXPECT_TRUE(curve_of(curve_bytes(curve))->std.empty());
  EXPECT_TRUE(curve_bytes({}).empty());

  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(curve_of(std::span(bytes).first(size))) << size;
  auto other = bytes;
  other.push_back(std::byte{0});
  EXPECT_FALSE(curve_of(other));
  other = bytes;
  other[0] = std::byte{2};  // of a later format
  EXPECT_FALSE(curve_of(other));
  curve.plant.pop_back();
  EXPECT_FALSE(curve_of(curve_bytes(curve)));
}

TEST(Service, KeepsABaselinesCurveAndAMaintenanceOverARestart) {
  const Folder folder;
  const auto whole = drive_samples(60.0, 1e6, 1);
  std::vector<std::vector<double>> values{whole};
  values[0].resize(static_cast<std::size_t>(50.0 * kRate) * 3);  // the rest comes after the restart
  std::vector<double> before;
  {
    auto service = Service::start(installation(folder.path(), values, 0.0));
    ASSERT_TRUE(service) << message_of(service.error());
    auto& backend = (*service)->backend();
    const auto early = backend.act(action_of(web::ActionKind::baseline));
    ASSERT_FALSE(early) << "nothing is trusted yet";
    EXPECT_EQ(early.error().kind, web::Problem::Kind::conflict);
    EXPECT_NE(early.error().message.find("trusted"), std::string::npos) << early.error().message;
    ASSERT_TRUE(comes_true([&] {
      const auto response = backend.response("axis0");
      return response && response->time_s > kBegin_s + 49.0;
    }));
    EXPECT_FALSE(backend.response("axis0")->baseline) << "none is configured, and none was set";
    ASSERT_TRUE(backend.act(action_of(web::ActionKind::baseline)));
    ASSERT_TRUE(comes_true([&] { return backend.response("axis0")->baseline.has_value(); }));
    const auto response = backend.response("axis0").value();
    ASSERT_EQ(response.baseline->frequency_hz, response.plant.frequency_hz);
    EXPECT_EQ(response.baseline->std.size(), response.plant.std.size());
    for (std::size_t i = 0; i < response.plant.real.size(); ++i)
      EXPECT_NEAR(response.baseline->real[i], response.plant.real[i],
                  0.05 * std::hypot(response.plant.real[i], response.plant.imag[i]));
    before = response.baseline->real;

    EXPECT_TRUE(std::isnan(backend.axis("axis0")->status.maintenance_until_time_s));
    auto maintenance = action_of(web::ActionKind::maintenance);
    const double end_s = static_cast<double>(now_ns()) * 1e-9 + 3600.0;
    maintenance.until_time_s = end_s;
    ASSERT_TRUE(backend.act(maintenance));
    ASSERT_TRUE(
        comes_true([&] { return std::isfinite(backend.axis("axis0")->status.maintenance_until_time_s); }));
    EXPECT_NEAR(backend.axis("axis0")->status.maintenance_until_time_s, end_s, 1.0);
    (*service)->stop();
  }
  values[0] = whole;
  auto service = Service::start(installation(folder.path(), values, 0.0));
  ASSERT_TRUE(service) << message_of(service.error());
  auto& backend = (*service)->backend();
  EXPECT_TRUE(
      comes_true([&] { return std::isfinite(backend.axis("axis0")->status.maintenance_until_time_s); }));
  ASSERT_TRUE(comes_true([&] { return backend.response("axis0").has_value(); }));
  ASSERT_TRUE(backend.response("axis0")->baseline);
  EXPECT_EQ(backend.response("axis0")->baseline->real, before);

  ASSERT_TRUE(backend.act(action_of(web::ActionKind::end_maintenance)));
  EXPECT_TRUE(comes_true([&] { return std::isnan(backend.axis("axis0")->status.maintenance_until_time_s); }));
  EXPECT_TRUE(comes_true([&] { return backend.audit(10).value().front().action == "end-maintenance"; }));
  const auto again = backend.act(action_of(web::ActionKind::end_maintenance));
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().message, "the axis is not in maintenance");
  const auto audit = backend.audit(10).value();
  ASSERT_EQ(audit.size(), 3U);
  EXPECT_EQ(audit[1].action, "maintenance");
  EXPECT_EQ(audit[2].action, "baseline");
  (*service)->stop();
}

TEST(Service, ForgetsABaselineThatWasSetBeforeItLearnedOrBeganAnew) {
  const Folder folder;
  const auto whole = drive_samples(130.0, 1e6, 1);
  std::vector<std::vector<double>> values{whole};
  values[0].resize(static_cast<std::size_t>(50.0 * kRate) * 3);
  const auto is_used = [](const web::Backend& backend) {
    const auto baselines = backend.axis("axis0")->baselines;
    return !baselines.empty() && baselines.front().active;
  };
  const auto set_baseline = [&](web::Backend& backend) {
    return comes_true([&] { return backend.act(action_of(web::ActionKind::baseline)).has_value(); }) &&
           comes_true([&] { return is_used(backend); });
  };
  const auto start = [&](const char* configuration) {
    auto all = installation(folder.path(), values, 0.0);
    all.axes[0].configuration = configuration;
    auto service = Service::start(std::move(all));
    EXPECT_TRUE(service) << message_of(service.error());
    return std::move(*service);
  };
  {
    const auto service = start("test");
    auto& backend = service->backend();
    ASSERT_TRUE(set_baseline(backend));
    ASSERT_TRUE(backend.act(action_of(web::ActionKind::relearn)));
    EXPECT_TRUE(comes_true([&] { return !is_used(backend); }));
    service->stop();
  }
  values[0] = whole;
  {
    const auto service = start("test");
    auto& backend = service->backend();
    EXPECT_FALSE(is_used(backend));
    ASSERT_TRUE(comes_true([&] { return backend.response("axis0").has_value(); }));
    EXPECT_FALSE(backend.response("axis0")->baseline) << "it was set before the axis was learned anew";
    ASSERT_TRUE(set_baseline(backend));
    EXPECT_TRUE(backend.response("axis0")->baseline);
    service->stop();
  }
  for (int i = 0; i < 2; ++i) {  // the second time it goes on
    const auto service = start("other");
    auto& backend = service->backend();
    EXPECT_FALSE(is_used(backend)) << i;
    if (i == 0) {  // afterwards no samples come that a response would be of
      ASSERT_TRUE(comes_true([&] { return backend.response("axis0").has_value(); }));
      EXPECT_FALSE(backend.response("axis0")->baseline);
    }
    service->stop();
    const auto audit = backend.audit(10).value();
    EXPECT_EQ(std::count_if(audit.begin(), audit.end(),
                            [](const auto& e) { return e.action == "relearn" && e.who == "service"; }),
              1)
        << i;
    EXPECT_EQ(audit.front().action, "relearn");
    EXPECT_EQ(audit.front().who, "service");
    EXPECT_EQ(audit.front().reason, "the axis begins anew: its configuration has changed");
  }
}

TEST(Service, KeepsWhatTheStatisticsOfFormerRowsNeedOverARestart) {
  const Folder folder;
  const std::vector<std::vector<double>> values{drive_samples(40.0, 1e6, 1)};
  const auto memory_s = [&] {
    return Reader::open((folder.path() / "monitor.sqlite").string()).value().axes().value().at(0).memory_s;
  };
  {
    auto service = Service::start(installation(folder.path(), values, 0.0));
    ASSERT_TRUE(service) << message_of(service.error());
    ASSERT_TRUE(comes_true([&] { return (*service)->backend().axis("axis0")->estimator.memory_s > 0.0; }));
    (*service)->stop();
  }
  const double before = memory_s();
  EXPECT_GT(before, 0.0);
  auto silent = installation(folder.path(), values, 0.0);
  silent.sources.clear();
  auto service = Service::start(std::move(silent));
  ASSERT_TRUE(service) << message_of(service.error());
  (*service)->stop();
  EXPECT_EQ(memory_s(), before);
}

}  // namespace
}  // namespace resonid::monitor
