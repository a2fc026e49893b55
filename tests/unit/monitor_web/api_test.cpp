// SPDX-License-Identifier: MIT
// Every path over a real socket, with good and bad input; every answer is compared with openapi.json.
#include "monitor/web/api.hpp"

#include <cmath>
#include <cstring>
#include <set>

#include "fake_backend.hpp"
#include "monitor/web/assets.hpp"
#include "monitor/web/server.hpp"
#include "openapi.hpp"
#include "web_client.hpp"

namespace resonid::monitor::web {
namespace {

using nlohmann::json;
using test::an_axis;
using test::HttpReply;
using test::RequestHeaders;

const std::string kWriteToken = "write-0123456789abcdef", kReadToken = "read-0123456789abcdef";
const std::string kWho = R"({"who":"Ann","reason":"seen"})";
const std::string kTimed = R"({"who":"Ann","reason":"spare part","seconds":3600})";

class WebApi : public testing::Test {
 protected:
  void start(WebOptions options = {}) {
    options.limits.requests_per_second = 1e6;
    options.limits.burst = 1e6;
    auto started = WebServer::start(backend, options);
    ASSERT_TRUE(started) << started.error().requirement;
    server = std::move(*started);
  }
  void start_with_tokens(std::string address = "127.0.0.1") {
    WebOptions options;
    options.listening.address = std::move(address);
    options.write_token = kWriteToken;
    options.read_token = kReadToken;
    options.host_names = {"monitor.example"};
    start(options);
  }

  /// An answer; those of described paths must be as described.
  HttpReply ask(const std::string& method, const std::string& target, const std::string& body = {},
                RequestHeaders headers = {}) {
    if (!server) start();
    const auto reply = test::ask(server->port(), method, target, body, std::move(headers));
    const auto path = target.substr(0, target.find('?'));
    std::string lower = method;
    for (auto& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (reply.status != 405 && (method == "GET" || method == "POST") && described(path)) {
      const auto type = reply.headers.contains("content-type") ? reply.headers.at("content-type") : "";
      EXPECT_EQ(api.faults(lower, path, reply.status, type, reply.body), "") << method << " " << target;
    }
    if (reply.status != 0) {
      EXPECT_EQ(reply.headers.count("access-control-allow-origin"), 0U);
      EXPECT_EQ(reply.headers.at("x-content-type-options"), "nosniff") << target;
    }
    return reply;
  }
  json get(const std::string& target) {
    const auto reply = ask("GET", target);
    EXPECT_EQ(reply.status, 200) << target << ": " << reply.body;
    return json::parse(reply.body, nullptr, false);
  }
  int status(const std::string& method, const std::string& target, const std::string& body = {},
             RequestHeaders headers = {}) {
    return ask(method, target, body, std::move(headers)).status;
  }
  /// Field that a refusal names.
  std::string field(const std::string& target, int wanted = 400) {
    const auto reply = ask("GET", target);
    EXPECT_EQ(reply.status, wanted) << target;
    return json::parse(reply.body, nullptr, false).value("/error/field"_json_pointer, "none");
  }

  test::FakeBackend backend;
  test::OpenApi api;
  std::unique_ptr<WebServer> server;

 private:
  static bool described(const std::string& path) {
    return path.starts_with("/api/v1/") || path == "/metrics" || path == "/healthz" || path == "/readyz";
  }
};
using nlohmann::operator""_json_pointer;

TEST_F(WebApi, EveryPathIsDescribedAndEveryDescribedOneServed) {
  std::set<std::string> served, described;
  for (const auto& [method, path] : routes()) served.insert(fmt::format("{} {}", method, path));
  for (const auto& [path, operations] : api.document.at("paths").items())
    for (const auto& [method, operation] : operations.items()) {
      EXPECT_TRUE(operation.at("responses").contains("405")) << path;
      described.insert(fmt::format("{} {}", method == "get" ? "GET" : "POST", path));
    }
  EXPECT_EQ(served, described);
  // A described path answers, and with something else than "there is nothing of that name".
  for (const auto& [method, pattern] : routes()) {
    std::string path(pattern);
    for (const auto& [name, value] : {std::pair("{axis}", "x"), std::pair("{id}", "1")})
      if (const auto at = path.find(name); at != std::string::npos)
        path.replace(at, std::strlen(name), value);
    if (path == "/api/v1/stream") continue;
    if (path.ends_with("/raw")) path += "?from=1&to=2";
    if (path.ends_with("/compare")) path += "?a=1&b=2";
    const bool timed = path.ends_with("/shelve") || path.ends_with("/maintenance");
    const int wanted = path.ends_with("/reset")     ? 409
                       : path.ends_with("/relearn") ? 503
                       : method == "POST"           ? 202
                                                    : 200;
    EXPECT_EQ(status(std::string(method), path, timed ? kTimed : kWho), wanted) << path;
  }
}

TEST_F(WebApi, TheComparisonWithTheDescriptionFindsFaults) {
  const std::string good = ask("GET", "/api/v1/axes").body;
  const auto faults = [&](const std::string& from, const std::string& to) {
    auto body = good;
    const auto at = body.find(from);
    if (at == std::string::npos) return std::string();
    body.replace(at, from.size(), to);
    return api.faults("get", "/api/v1/axes", 200, "application/json", body);
  };
  EXPECT_EQ(faults("\"trusted\":true", "\"trusted\":true"), "");
  EXPECT_NE(faults("\"trusted\":true", "\"trusted\":1"), "");
  EXPECT_NE(faults("\"trusted\":true", "\"trusty\":true"), "");
  EXPECT_NE(faults("\"following\"", "\"dreaming\""), "");
  EXPECT_NE(faults("\"sample\":123456", "\"sample\":-1"), "");
  EXPECT_NE(faults("\"time_s\"", "\"time\""), "");
  EXPECT_NE(api.faults("get", "/api/v1/axes", 418, "application/json", good), "");
  EXPECT_NE(api.faults("get", "/api/v1/axes", 200, "text/html", good), "");
  EXPECT_NE(api.faults("get", "/api/v1/nothing", 200, "application/json", good), "");
}

TEST_F(WebApi, AxesComeWorstFirstAndUnknownIsAbsent) {
  auto ill = an_axis("ill"), warned = an_axis("warned"), stale = an_axis("stale");
  ill.worst_alarm = AxisStatus::Worst{Severity::high, "stiffness fell"};
  warned.worst_alarm = AxisStatus::Worst{Severity::medium, "friction rose"};
  stale.state = AxisState::stale;
  backend.set({warned, stale, ill});
  const auto axes = get("/api/v1/axes").at("axes");
  std::vector<std::string> names;
  for (const auto& axis : axes) names.push_back(axis.at("name"));
  EXPECT_EQ(names, (std::vector<std::string>{"ill", "warned", "stale", "y", "x"}));
  const auto &known = axes.back(), &unknown = axes[3];
  EXPECT_EQ(known.at("figures").at("stiffness"), json({{"value", 3.0},
                                                       {"std", 0.03},
                                                       {"baseline", 3.0300000000000002},
                                                       {"change", -0.03},
                                                       {"change_std", 0.006},
                                                       {"low", 1.5}}));  // no high one
  EXPECT_EQ(known.at("figures").size(), 11U);
  EXPECT_TRUE(unknown.at("figures").empty());
  EXPECT_FALSE(unknown.contains("age_s"));
  EXPECT_EQ(unknown.at("verdict"), "not-measured");
}

TEST_F(WebApi, TellsTheEndOfAMaintenance) {
  auto axis = an_axis("x");
  axis.maintenance_until_time_s = test::kTime + 3600.0;
  backend.set({axis});
  for (const auto* path : {"/api/v1/axes", "/api/v1/axes/x"}) {
    const auto told = get(path);
    const auto& one = told.contains("axes") ? told.at("axes").back() : told;
    EXPECT_EQ(one.at("name"), "x");
    EXPECT_EQ(one.at("maintenance_until_time_s"), test::kTime + 3600.0);
  }
  EXPECT_FALSE(get("/api/v1/axes/y").contains("maintenance_until_time_s"));
}

TEST_F(WebApi, ForeignBytesBecomeText) {
  const auto fault = get("/api/v1/axes/x").at("faults").at(0);
  EXPECT_EQ(fault.at("text"), "1700000000 after \"1700000001\"\n\xef\xbf\xbd");
}

TEST_F(WebApi, AnswersOneAxis) {
  const auto axis = get("/api/v1/axes/x");
  EXPECT_EQ(axis.at("estimator").at("gates").size(), 7U);
  EXPECT_EQ(axis.at("loop").at("delay_s"), 5e-4);
  EXPECT_EQ(axis.at("baselines").at(0).at("figures"),
            json({{"resonance_hz", {{"value", 60.0}, {"std", 0.1}}}}));
  EXPECT_EQ(axis.at("longest_shelving_s"), 604800.0);
  EXPECT_EQ(axis.at("raw_from_time_s"), test::kTime - 120.0);
  EXPECT_FALSE(get("/api/v1/axes/y").contains("raw_from_time_s"));  // none is kept
  const auto response = get("/api/v1/axes/x/response");
  EXPECT_EQ(response.at("real"), json({0.5, nullptr}));
  EXPECT_EQ(response.at("coherence"), json({0.9, nullptr}));
  EXPECT_EQ(response.at("coherence_std"), json({0.02, nullptr}));
  EXPECT_FALSE(response.at("loop").contains("coherence") || response.at("baseline").contains("coherence"));
  EXPECT_TRUE(response.at("loop").contains("imag") && !response.at("loop").contains("frequency_hz"));
  EXPECT_TRUE(response.at("baseline").contains("frequency_hz"));
  EXPECT_EQ(field("/api/v1/axes/z", 404), "axis");
  EXPECT_EQ(field("/api/v1/axes/z/response", 404), "axis");
  EXPECT_EQ(field("/api/v1/axes/a%20b"), "axis");
  EXPECT_EQ(field("/api/v1/axes/%2e%2e/raw?from=1&to=2"), "axis");
  EXPECT_EQ(field("/api/v1/axes/" + std::string(65, 'a')), "axis");
  EXPECT_EQ(test::ask(server->port(), "GET", "/api/v1/axes/").status, 400);
  EXPECT_EQ(status("GET", "/api/v1/axes/throws"), 500);
}

TEST_F(WebApi, AnswersHistory) {
  const auto history = get("/api/v1/axes/x/history?figure=stiffness,gap,gap&from=10&to=20.5&points=7");
  EXPECT_EQ(history.at("time_s"), json({10.0, 20.5}));
  EXPECT_EQ(history.at("figures").size(), 2U);
  EXPECT_EQ(history.at("figures").at("gap").at("value"), json({1.0, nullptr}));
  EXPECT_EQ(get("/api/v1/axes/x/history").at("figures").size(), 11U);
  for (const auto* bad :
       {"figure=", "figure=mass", "figure=gap,", "from=20&to=10", "from=nan", "to=inf", "points=0",
        "points=-1", "points=1e3", "points=20001", "from=1&from=2", "from=1e400", "to=%00", "x=1"})
    EXPECT_NE(field(fmt::format("/api/v1/axes/x/history?{}", bad)), "none") << bad;
}

TEST_F(WebApi, HandsOutSamples) {
  const auto raw = ask("GET", "/api/v1/axes/x/raw?from=100&to=101.5");
  EXPECT_EQ(raw.body, "sample,ru,u,y\n0,100,101.5,0\n");
  EXPECT_EQ(raw.headers.at("content-disposition"), "attachment; filename=\"x.csv\"");
  EXPECT_EQ(ask("GET", "/api/v1/axes/long/raw?from=1&to=2").body.size(), 8'000'000U);
  EXPECT_EQ(field("/api/v1/axes/x/raw"), "from");
  EXPECT_EQ(field("/api/v1/axes/x/raw?from=0&to=3601"), "to");
  EXPECT_EQ(field("/api/v1/axes/x/raw?from=2&to=1"), "to");
  EXPECT_EQ(ask("GET", "/api/v1/alarms/1/evidence.csv").body, "sample,ru,u,y\n");
  EXPECT_EQ(field("/api/v1/alarms/7/evidence.csv", 404), "id");
}

TEST_F(WebApi, ComparesTwoTimes) {
  const auto comparison = get("/api/v1/axes/x/compare?a=100&b=200");
  EXPECT_EQ(comparison.at("figures").at("stiffness").at("difference"), -51.0);
  EXPECT_EQ(comparison.at("a_time_s"), 100.0);
  EXPECT_EQ(field("/api/v1/axes/x/compare?a=100"), "b");
}

TEST_F(WebApi, AnswersAlarmsAndWhatWasDone) {
  const auto alarms = get("/api/v1/alarms").at("alarms");
  ASSERT_EQ(alarms.size(), 3U);
  EXPECT_FALSE(alarms[0].contains("axis") || alarms[0].contains("change"));
  EXPECT_EQ(alarms[1].at("shelved").at("who"), "Ann");
  EXPECT_EQ(alarms[2].at("change").at("sigma"), 12.75);
  EXPECT_EQ(get("/api/v1/alarms?state=active&axis=x&limit=5").at("alarms").size(), 1U);
  EXPECT_EQ(get("/api/v1/alarms?limit=2").at("alarms").size(), 2U);
  EXPECT_EQ(get("/api/v1/alarms?state=open&limit=2").at("alarms").size(), 1U);
  EXPECT_EQ(field("/api/v1/alarms?state=asleep"), "state");
  EXPECT_EQ(field("/api/v1/alarms?axis=../x"), "axis");
  EXPECT_EQ(field("/api/v1/alarms?axis=z", 404), "axis");
  EXPECT_EQ(field("/api/v1/alarms?limit=1001"), "limit");
  EXPECT_EQ(get("/api/v1/alarms?from=1&to=1e9").at("alarms").size(),
            1U);  // when the disk's came is not known
  EXPECT_EQ(field("/api/v1/alarms?from=2&to=1"), "from");
  EXPECT_EQ(field("/api/v1/alarms?before=1"), "before");
  const auto alarm = get("/api/v1/alarms/1");
  EXPECT_EQ(alarm.at("text"), "stiffness fell by 5.1 %");
  EXPECT_EQ(alarm.at("longest_shelving_s"), 3600.0);
  EXPECT_EQ(field("/api/v1/alarms/7", 404), "id");
  EXPECT_EQ(field("/api/v1/alarms/one"), "id");
  EXPECT_EQ(get("/api/v1/alarms/1/events").at("events").size(), 2U);
  EXPECT_EQ(field("/api/v1/alarms/one/events"), "id");
  EXPECT_EQ(field("/api/v1/alarms/-1/events"), "id");
  EXPECT_EQ(field("/api/v1/alarms/99999999999999999999/events"), "id");
  EXPECT_EQ(get("/api/v1/audit?limit=1").at("audit").size(), 1U);
  EXPECT_TRUE(get("/api/v1/audit?to=1e9").at("audit").empty());
  EXPECT_EQ(field("/api/v1/audit?from=2&to=1"), "from");
  EXPECT_EQ(get("/api/v1/status").at("sources").at(0).at("kind"), "mqtt");
  EXPECT_EQ(get("/api/v1/status").at("threshold").at("present_interval_s"), 1.8e6);
}

TEST_F(WebApi, AReportReachesNothing) {
  const auto report = ask("GET", "/api/v1/alarms/1/report.html");
  EXPECT_EQ(report.status, 200);
  EXPECT_EQ(report.headers.at("content-security-policy").find("sandbox allow-scripts;"), 0U);
}

TEST_F(WebApi, AReportThatCanNeverBeIsNotAskedForAgain) {
  const auto report = ask("GET", "/api/v1/alarms/8/report.html");
  EXPECT_EQ(report.status, 409);
  EXPECT_EQ(report.headers.count("retry-after"), 0U);
}

TEST_F(WebApi, AHistoryWithoutAnEndHasRowsThatAreAheadOfTheClock) {
  auto ahead = an_axis("x");
  ahead.newest_time_s = 8e9;
  backend.set({ahead});
  EXPECT_EQ(get("/api/v1/axes/x/history?points=3").at("time_s"), json({8e9 - 3600.0, 8e9}));
  EXPECT_EQ(get("/api/v1/axes/x/history?from=1&to=2").at("time_s"), json({1.0, 2.0}));
}

TEST_F(WebApi, TakesActions) {
  EXPECT_EQ(status("POST", "/api/v1/alarms/5/acknowledge", kWho), 202);
  EXPECT_EQ(status("POST", "/api/v1/alarms/5/shelve", kTimed), 202);
  EXPECT_EQ(status("POST", "/api/v1/alarms/5/unshelve", R"({"who":"J\u00f6rg"})"), 202);
  EXPECT_EQ(status("POST", "/api/v1/axes/x/baseline", kWho), 202);
  EXPECT_EQ(status("POST", "/api/v1/axes/x/maintenance", kTimed), 202);
  EXPECT_EQ(status("POST", "/api/v1/axes/x/end-maintenance", R"({"who":"Ann"})"), 202);
  const auto actions = backend.actions();
  ASSERT_EQ(actions.size(), 6U);
  EXPECT_EQ(actions[0].kind, ActionKind::acknowledge);
  EXPECT_EQ(actions[0].alarm, 5U);
  EXPECT_EQ(actions[0].reason, "seen");
  const double now =
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  EXPECT_NEAR(actions[1].until_time_s, now + 3600.0, 60.0);
  EXPECT_EQ(actions[2].who, "J\xc3\xb6rg");
  EXPECT_EQ(actions[3].kind, ActionKind::baseline);
  EXPECT_EQ(actions[3].axis, "x");
  EXPECT_EQ(actions[4].kind, ActionKind::maintenance);
  EXPECT_EQ(actions[5].kind, ActionKind::end_maintenance);
  EXPECT_EQ(actions[5].axis, "x");
  EXPECT_TRUE(std::isnan(actions[5].until_time_s));
  EXPECT_EQ(status("POST", "/api/v1/alarms/99/acknowledge", kWho), 404);
  EXPECT_EQ(status("POST", "/api/v1/axes/nowhere/baseline", kWho), 404);
}

TEST_F(WebApi, RefusesActionsThatAreNotRight) {
  const std::string long_text(201, 'a');
  for (const std::string& body :
       {std::string(), std::string("{"), std::string("[]"), std::string("{}"), std::string(R"({"who":""})"),
        std::string(R"({"who":1})"), std::string(R"({"who":"a\nb"})"),
        std::string(R"({"who":"a","what":"b"})"), std::string("{\"who\":\"\xff\"}"),
        R"({"who":")" + long_text + R"("})", std::string(30'000, '[')})
    EXPECT_EQ(status("POST", "/api/v1/alarms/5/acknowledge", body), 400) << body;
  for (const auto* body :
       {R"({"who":"a","seconds":1})", R"({"who":"a","reason":"b"})",
        R"({"who":"a","reason":"b","seconds":0})", R"({"who":"a","reason":"b","seconds":1e9})",
        R"({"who":"a","reason":"b","seconds":"1"})", R"({"who":"a","reason":"b","until_time_s":1})",
        R"({"who":"a","reason":"b","seconds":1,"until_time_s":2})"})
    EXPECT_EQ(status("POST", "/api/v1/alarms/5/shelve", body), 400) << body;
  EXPECT_EQ(status("POST", "/api/v1/alarms/5/acknowledge", kWho, {{"Content-Type", "text/plain"}}), 415);
  EXPECT_EQ(status("POST", "/api/v1/alarms/5/acknowledge", kWho, {{"Content-Type", ""}}), 415);
  EXPECT_TRUE(backend.actions().empty());
}

TEST_F(WebApi, WrongMethodsAndPaths) {
  const auto posted = ask("POST", "/api/v1/axes", kWho);
  EXPECT_EQ(posted.status, 405);
  EXPECT_EQ(posted.headers.at("allow"), "GET");
  EXPECT_EQ(api.faults("get", "/api/v1/axes", 405, "application/json", posted.body), "");
  for (const auto* method : {"PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"})
    EXPECT_EQ(status(method, "/api/v1/axes"), 405) << method;
  EXPECT_EQ(status("GET", "/api/v1/alarms/1/acknowledge"), 405);
  EXPECT_EQ(status("POST", "/", kWho), 405);
  EXPECT_EQ(status("BREW", "/api/v1/axes"), 400);
  EXPECT_EQ(status("HEAD", "/api/v1/axes"), 200);
  EXPECT_EQ(status("HEAD", "/api/v1/stream"), 200);
  for (const auto* path :
       {"/api/v1", "/api/v2/axes", "/api/v1/axes/x/response/", "/nothing", "//", "/api/v1/axes/x/y"})
    EXPECT_EQ(test::ask(server->port(), "GET", path).status, 404) << path;
}

TEST_F(WebApi, NoPathLeadsToAFile) {
  start();
  for (const auto* path : {"/../../../../etc/passwd", "/..%2f..%2f..%2fetc/passwd",
                           "/%2e%2e/%2e%2e/etc/passwd", "/etc/passwd", "//etc/passwd", "/./index.html",
                           "/index.html%00.js", "/..\\..\\etc\\passwd", "/api/v1/../../etc/passwd",
                           "/....//....//etc/passwd", "/%c0%ae%c0%ae/etc/passwd", "file:///etc/passwd"}) {
    const auto reply = test::ask(server->port(), "GET", path);
    EXPECT_TRUE(reply.status == 404 || reply.status == 400) << path << reply.status;
    EXPECT_EQ(reply.body.find("root:"), std::string::npos);
  }
}

TEST_F(WebApi, ServesThePage) {
  const auto page = ask("GET", "/");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.headers.at("content-type"), "text/html; charset=utf-8");
  EXPECT_EQ(page.body, asset("index.html")->bytes);
  const auto policy = page.headers.at("content-security-policy");
  EXPECT_EQ(policy.find("default-src 'none'"), 0U);
  EXPECT_EQ(policy.find("unsafe-inline"), std::string::npos);
  EXPECT_NE(policy.find("frame-ancestors 'none'"), std::string::npos);
  EXPECT_EQ(page.headers.at("referrer-policy"), "no-referrer");

  const auto script = ask("GET", "/uplot.js"),
             packed = ask("GET", "/uplot.js", "", {{"Accept-Encoding", "br, gzip"}});
  EXPECT_EQ(script.headers.count("content-encoding"), 0U);
  EXPECT_EQ(packed.headers.at("content-encoding"), "gzip");
  EXPECT_LT(2 * packed.body.size(), script.body.size());
  const auto tag = script.headers.at("etag");
  const auto again = ask("GET", "/uplot.js", "", {{"If-None-Match", tag}});
  EXPECT_EQ(again.status, 304);
  EXPECT_TRUE(again.body.empty());
  EXPECT_EQ(ask("GET", "/uplot.js", "", {{"Range", "bytes=0-9"}}).body.size(), script.body.size());
  EXPECT_EQ(json::parse(ask("GET", "/openapi.json").body), api.document);
}

TEST_F(WebApi, TheMetricsCountMoreAlarmsThanOneAnswerHas) {
  EXPECT_NE(ask("GET", "/metrics").body.find("\nresonid_alarms_active{severity=\"medium\"} 2500\n"),
            std::string::npos);
}

TEST_F(WebApi, SaysWhetherItIsReady) {
  EXPECT_EQ(get("/healthz").at("healthy"), true);
  EXPECT_EQ(get("/readyz").at("ready"), true);
  server->stop();
  server = nullptr;
  backend.ready = {true, false, true, "the disk is full"};
  EXPECT_EQ(ask("GET", "/healthz").status, 200);
  const auto reply = ask("GET", "/readyz");
  EXPECT_EQ(reply.status, 503);
  EXPECT_EQ(json::parse(reply.body).at("text"), "the disk is full");
  backend.ready.engine = false;
  const auto hangs = ask("GET", "/healthz");
  EXPECT_EQ(hangs.status, 503);
  EXPECT_EQ(json::parse(hangs.body).at("healthy"), false);
}

TEST_F(WebApi, TokensDecideWhoReadsAndWrites) {
  start_with_tokens();
  const auto bearer = [](const std::string& token) {
    return RequestHeaders{{"Authorization", "Bearer " + token}};
  };
  EXPECT_EQ(status("GET", "/api/v1/axes"), 401);
  EXPECT_EQ(ask("GET", "/api/v1/axes").headers.at("www-authenticate"), "Bearer");
  EXPECT_EQ(status("GET", "/metrics"), 401);
  EXPECT_EQ(status("GET", "/api/v1/axes", "", bearer(kReadToken)), 200);
  EXPECT_EQ(status("GET", "/api/v1/axes", "", bearer(kWriteToken)), 200);
  EXPECT_EQ(status("GET", "/api/v1/axes", "", bearer(kReadToken + "x")), 401);
  EXPECT_EQ(status("GET", "/api/v1/axes", "", bearer(kReadToken.substr(1))), 401);
  EXPECT_EQ(status("GET", "/api/v1/axes", "", bearer("")), 401);
  EXPECT_EQ(status("GET", "/api/v1/axes", "", {{"Authorization", "Basic " + kReadToken}}), 401);
  EXPECT_EQ(status("GET", "/api/v1/axes?token=" + kReadToken), 401);
  EXPECT_EQ(status("GET", "/healthz"), 200);
  EXPECT_EQ(status("GET", "/"), 200);
  EXPECT_EQ(status("GET", "/api/v1/stream"), 401);
  EXPECT_EQ(status("GET", "/api/v1/stream?token=wrong"), 401);
  const auto stream = test::open_stream(server->port(), "?token=" + kReadToken);
  for (const std::string file :
       {"axes/x/raw?from=0&to=1&", "alarms/1/evidence.csv?", "alarms/1/report.html?"}) {
    EXPECT_EQ(status("GET", "/api/v1/" + file + "token=wrong"), 401) << file;
    EXPECT_EQ(status("GET", "/api/v1/" + file + "token=" + kReadToken), 200) << file;
  }

  EXPECT_EQ(status("POST", "/api/v1/alarms/1/acknowledge", kWho), 401);
  EXPECT_EQ(status("POST", "/api/v1/alarms/1/acknowledge", kWho, bearer("wrong")), 401);
  EXPECT_EQ(status("POST", "/api/v1/alarms/1/acknowledge", kWho, bearer(kReadToken)), 403);
  EXPECT_EQ(status("POST", "/api/v1/alarms/1/acknowledge?token=" + kWriteToken, kWho), 401);
  const auto why = [&](const std::string& method, const std::string& target, RequestHeaders headers) {
    return json::parse(ask(method, target, kWho, std::move(headers)).body).at("error").at("message");
  };
  EXPECT_EQ(why("POST", "/api/v1/alarms/1/acknowledge", {}), "a token is required to write");
  EXPECT_EQ(why("POST", "/api/v1/alarms/1/acknowledge", bearer("wrong")),
            "the token is wrong, another one is required to write");
  EXPECT_EQ(why("GET", "/api/v1/axes", bearer("wrong")),
            "the token is wrong, another one is required to read");
  EXPECT_EQ(status("GET", "/openapi.json"), 200);
  EXPECT_TRUE(backend.actions().empty());
  EXPECT_EQ(status("POST", "/api/v1/alarms/1/acknowledge", kWho, bearer(kWriteToken)), 202);
}

TEST_F(WebApi, WithoutATokenWritesAreForThisMachineOnly) {
  WebOptions options;
  options.listening.address = "0.0.0.0";
  start(options);
  EXPECT_EQ(status("GET", "/api/v1/axes"), 200);
  const auto refused = ask("POST", "/api/v1/alarms/1/acknowledge", kWho);
  EXPECT_EQ(refused.status, 403);
  // Whoever is told "authorization" may try another token.
  EXPECT_EQ(json::parse(refused.body).at("error").at("field"), "write_token");
  EXPECT_TRUE(backend.actions().empty());
}

TEST_F(WebApi, OnlyItsOwnPageWrites) {
  const auto acknowledge = [&](RequestHeaders headers) {
    return status("POST", "/api/v1/alarms/1/acknowledge", kWho, std::move(headers));
  };
  EXPECT_EQ(acknowledge({{"Origin", "http://evil.example"}}), 403);
  EXPECT_EQ(acknowledge({{"Origin", "null"}}), 403);
  EXPECT_EQ(acknowledge({{"Origin", "http://localhost:1"}}), 403);
  EXPECT_EQ(acknowledge({{"Sec-Fetch-Site", "cross-site"}}), 403);
  EXPECT_EQ(acknowledge({{"Sec-Fetch-Site", "same-site"}}), 403);
  EXPECT_TRUE(backend.actions().empty());
  EXPECT_EQ(acknowledge({{"Origin", "http://localhost"}, {"Sec-Fetch-Site", "same-origin"}}), 202);
}

TEST_F(WebApi, AnswersToItsOwnNamesOnly) {
  start_with_tokens();
  const auto named = [&](const std::string& host) {
    return test::ask(server->port(), "GET", "/healthz", {}, {{"Host", host}}).status;
  };
  for (const auto* host : {"localhost", "LOCALHOST:8080", "127.0.0.1:80", "192.168.1.7", "[::1]:8080",
                           "monitor.example", "Monitor.Example:443"})
    EXPECT_EQ(named(host), 200) << host;
  for (const auto* host : {"evil.example", "localhost.evil.example", "monitor.example.evil",
                           "127.0.0.1.evil.example", "localhost:80:90", "[::1", "localhost:x", ""})
    EXPECT_EQ(named(host), 403) << host;
  test::WebClient twice(server->port());
  twice.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n");
  EXPECT_EQ(twice.reply().status, 403);
}

TEST_F(WebApi, RefusesOptionsThatAreNotRight) {
  const auto refused = [&](auto change) {
    WebOptions options;
    change(options);
    const auto started = WebServer::start(backend, options);
    return started ? std::string() : started.error().field.str();
  };
  EXPECT_EQ(refused([](auto& o) { o.write_token = "short"; }), "write_token");
  EXPECT_EQ(refused([](auto& o) { o.read_token = "with a space in it, 16 and more"; }), "read_token");
  EXPECT_EQ(refused([](auto& o) { o.read_token = o.write_token = kReadToken; }), "read_token");
  EXPECT_EQ(refused([](auto& o) { o.frames_per_second = 0.0; }), "frames_per_second");
  EXPECT_EQ(refused([](auto& o) { o.limits.workers = 0; }), "workers");
  EXPECT_EQ(refused([](auto& o) { o.limits.streams = 1000; }), "streams");
  EXPECT_EQ(refused([](auto& o) { o.limits.burst = 0.0; }), "burst");
  EXPECT_EQ(refused([](auto& o) { o.limits.downloads = 0; }), "downloads");
  EXPECT_EQ(refused([](auto& o) { o.limits.answer_bytes_per_second = 0.0; }), "answer_bytes_per_second");
  EXPECT_EQ(refused([](auto& o) { o.listening.address = "no.such.host.invalid"; }), "listen");
  EXPECT_EQ(refused([](auto& o) { o.listening.address = "192.0.2.1"; }), "listen");
  EXPECT_EQ(refused([](auto& o) { o.listening.certificate_file = "/nowhere.pem"; }), "key_file");
  start();
  EXPECT_EQ(refused([&](auto& o) { o.listening.port = server->port(); }), "listen");
  EXPECT_EQ(server->url(), fmt::format("http://127.0.0.1:{}/", server->port()));
}

}  // namespace
}  // namespace resonid::monitor::web
