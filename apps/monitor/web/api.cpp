// SPDX-License-Identifier: MIT
#include "monitor/web/api.hpp"

#include <arpa/inet.h>
#include <fmt/core.h>
#include <httplib.h>
#include <openssl/crypto.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <exception>
#include <memory>
#include <optional>
#include <utility>

#include "monitor/web/api_json.hpp"
#include "monitor/web/assets.hpp"
#include "monitor/web/questions.hpp"

namespace resonid::monitor::web {
namespace {

constexpr std::string_view kJson = "application/json";
constexpr std::string_view kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "font-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
/// A report has its scripts within itself; in a sandbox it is of no origin and reaches nothing of ours.
constexpr std::string_view kReportPolicy =
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What goes back.
struct ApiReply {
  int status = 200;
  std::string body;
  std::string_view type = kJson;
  std::string_view policy = kPolicy;
  std::vector<std::pair<std::string, std::string>> headers;
  bool stream = false;
  std::string axis;  ///< Of the stream.
  std::shared_ptr<const void> download;
};

/// What a route is asked.
struct Call {
  const ApiParts& parts;
  const httplib::Request& request;
  std::string_view body;
  std::vector<std::string> names;  ///< What stood in the place of {...}.
};

ApiReply refused(int status, std::string_view field, std::string_view message) {
  ApiReply reply;
  reply.status = status;
  reply.body = error_json(field, message);
  return reply;
}

ApiReply refused(const Problem& problem) {
  switch (problem.kind) {
    case Problem::Kind::not_found:
      return refused(404, problem.field, problem.message);
    case Problem::Kind::invalid:
      return refused(400, problem.field, problem.message);
    case Problem::Kind::conflict:
      return refused(409, problem.field, problem.message);
    case Problem::Kind::unavailable:
      break;
  }
  auto reply = refused(503, problem.field, problem.message);
  reply.headers.emplace_back("Retry-After", "2");
  return reply;
}

ApiReply json(std::string body, int status = 200) {
  ApiReply reply;
  reply.status = status;
  reply.body = std::move(body);
  return reply;
}

/// The text of an answer, or the refusal.
template <class T, class ToText>
ApiReply json(const Answer<T>& answer, ToText to_text) {
  return answer ? json(to_text(*answer)) : refused(answer.error());
}

/// A file of samples, made where there is room for one more.
template <class Make>
ApiReply csv(const Call& call, Make make, const std::string& file_name) {
  auto room = call.parts.downloads.begin();
  if (!room)
    return refused({Problem::Kind::unavailable, "downloads", "enough samples are being handed out already"});
  Answer<std::string> answer = make();
  if (!answer) return refused(answer.error());
  ApiReply reply;
  reply.body = std::move(*answer);
  reply.download = std::move(room);
  reply.type = "text/csv; charset=utf-8";
  reply.headers.emplace_back("Content-Disposition", fmt::format("attachment; filename=\"{}\"", file_name));
  return reply;
}

/// The alarm of the path.
template <class Then>
ApiReply of_alarm(const Call& call, Then then) {
  const auto id = alarm_id(call.names.front());
  return id ? then(*id) : refused(id.error());
}

template <ActionKind Kind>
ApiReply act_on_alarm(const Call& call) {
  return of_alarm(call, [&](std::uint64_t id) {
    auto action = action_of(Kind, call.body, call.parts.now_s());
    if (!action) return refused(action.error());
    action->alarm = id;
    const auto done = call.parts.backend.act(*action);
    return done ? json(R"({"accepted":true})", 202) : refused(done.error());
  });
}

template <ActionKind Kind>
ApiReply act_on_axis(const Call& call) {
  auto action = action_of(Kind, call.body, call.parts.now_s());
  if (!action) return refused(action.error());
  action->axis = call.names.front();
  const auto done = call.parts.backend.act(*action);
  return done ? json(R"({"accepted":true})", 202) : refused(done.error());
}

ApiReply get_axes(const Call& call) {
  return json(axes_json(call.parts.now_s(), call.parts.backend.axes(0).axes));
}
ApiReply get_axis(const Call& call) { return json(call.parts.backend.axis(call.names.front()), axis_json); }
ApiReply get_response(const Call& call) {
  return json(call.parts.backend.response(call.names.front()),
              [](const AxisResponse& response) { return response_json(response); });
}
ApiReply get_history(const Call& call) {
  const std::string& axis = call.names.front();
  double now_s = call.parts.now_s();
  // Samples may be ahead of our clock: their sender's differs, or they come faster than in real time.
  if (!call.request.has_param("to"))
    if (const auto asked = call.parts.backend.axis(axis))
      now_s = std::max({now_s, asked->status.newest_time_s, asked->status.time_s});
  const auto question = history_question(call.request.params, now_s);
  if (!question) return refused(question.error());
  return json(call.parts.backend.history(axis, *question), history_json);
}
ApiReply get_raw(const Call& call) {
  const auto asked = raw_interval(call.request.params);
  if (!asked) return refused(asked.error());
  const auto& axis = call.names.front();
  return csv(
      call, [&] { return call.parts.backend.raw(axis, asked->from_s, asked->to_s); }, axis + ".csv");
}
ApiReply get_comparison(const Call& call) {
  const auto asked = compared_times(call.request.params);
  if (!asked) return refused(asked.error());
  return json(call.parts.backend.compare(call.names.front(), asked->from_s, asked->to_s), comparison_json);
}
ApiReply get_alarms(const Call& call) {
  const auto question = alarm_question(call.request.params);
  return question ? json(call.parts.backend.alarms(*question), alarms_json) : refused(question.error());
}
ApiReply get_alarm(const Call& call) {
  return of_alarm(call, [&](std::uint64_t id) { return json(call.parts.backend.alarm(id), alarm_json); });
}
ApiReply get_events(const Call& call) {
  return of_alarm(call, [&](std::uint64_t id) { return json(call.parts.backend.events(id), events_json); });
}
ApiReply get_evidence(const Call& call) {
  return of_alarm(call, [&](std::uint64_t id) {
    return csv(
        call, [&] { return call.parts.backend.evidence(id); }, fmt::format("alarm-{}.csv", id));
  });
}
ApiReply get_report(const Call& call) {
  return of_alarm(call, [&](std::uint64_t id) {
    auto report = call.parts.backend.report(id);
    if (!report) return refused(report.error());
    ApiReply reply;
    reply.body = std::move(*report);
    reply.type = "text/html; charset=utf-8";
    reply.policy = kReportPolicy;
    return reply;
  });
}
ApiReply get_audit(const Call& call) {
  const auto question = audit_question(call.request.params);
  return question ? json(call.parts.backend.audit(*question), audit_json) : refused(question.error());
}
ApiReply get_status(const Call& call) { return json(status_json(call.parts.backend.status())); }
ApiReply get_stream(const Call& call) {
  ApiReply reply;
  reply.axis = call.request.get_param_value("axis");
  if (call.request.has_param("axis") && !is_axis_name(reply.axis))
    return refused(400, "axis", "letters, digits, '_', '.' and '-' are required, 64 at most");
  if (!reply.axis.empty())
    if (const auto known = call.parts.backend.axis(reply.axis); !known) return refused(known.error());
  reply.type = "text/event-stream";
  reply.stream = true;
  return reply;
}
ApiReply get_metrics(const Call& call) {
  const auto& backend = call.parts.backend;
  ApiReply reply;
  reply.body =
      metrics_text(backend.axes(0).axes, backend.active_alarms(), backend.status(), call.parts.counts());
  reply.type = "text/plain; version=0.0.4; charset=utf-8";
  return reply;
}
ApiReply get_health(const Call& call) {
  return call.parts.backend.readiness().engine ? json(R"({"healthy":true})")
                                               : json(R"({"healthy":false})", 503);
}
ApiReply get_readiness(const Call& call) {
  const auto ready = call.parts.backend.readiness();
  return json(readiness_json(ready), ready.sources && ready.store && ready.engine ? 200 : 503);
}

enum class Access : std::uint8_t { open, read, read_or_query, write };
struct Route {
  RouteName name;
  Access access;
  ApiReply (*reply)(const Call&);
};

constexpr Route kRoutes[] = {
    {{"GET", "/api/v1/axes"}, Access::read, get_axes},
    {{"GET", "/api/v1/axes/{axis}"}, Access::read, get_axis},
    {{"GET", "/api/v1/axes/{axis}/response"}, Access::read, get_response},
    {{"GET", "/api/v1/axes/{axis}/history"}, Access::read, get_history},
    {{"GET", "/api/v1/axes/{axis}/raw"}, Access::read_or_query, get_raw},
    {{"GET", "/api/v1/axes/{axis}/compare"}, Access::read, get_comparison},
    {{"POST", "/api/v1/axes/{axis}/baseline"}, Access::write, act_on_axis<ActionKind::baseline>},
    {{"POST", "/api/v1/axes/{axis}/relearn"}, Access::write, act_on_axis<ActionKind::relearn>},
    {{"POST", "/api/v1/axes/{axis}/maintenance"}, Access::write, act_on_axis<ActionKind::maintenance>},
    {{"POST", "/api/v1/axes/{axis}/end-maintenance"},
     Access::write,
     act_on_axis<ActionKind::end_maintenance>},
    {{"GET", "/api/v1/alarms"}, Access::read, get_alarms},
    {{"GET", "/api/v1/alarms/{id}"}, Access::read, get_alarm},
    {{"GET", "/api/v1/alarms/{id}/events"}, Access::read, get_events},
    {{"GET", "/api/v1/alarms/{id}/evidence.csv"}, Access::read_or_query, get_evidence},
    {{"GET", "/api/v1/alarms/{id}/report.html"}, Access::read_or_query, get_report},
    {{"POST", "/api/v1/alarms/{id}/acknowledge"}, Access::write, act_on_alarm<ActionKind::acknowledge>},
    {{"POST", "/api/v1/alarms/{id}/shelve"}, Access::write, act_on_alarm<ActionKind::shelve>},
    {{"POST", "/api/v1/alarms/{id}/unshelve"}, Access::write, act_on_alarm<ActionKind::unshelve>},
    {{"POST", "/api/v1/alarms/{id}/reset"}, Access::write, act_on_alarm<ActionKind::reset>},
    {{"GET", "/api/v1/audit"}, Access::read, get_audit},
    {{"GET", "/api/v1/status"}, Access::read, get_status},
    {{"GET", "/api/v1/stream"}, Access::read_or_query, get_stream},
    {{"GET", "/metrics"}, Access::read, get_metrics},
    {{"GET", "/healthz"}, Access::open, get_health},
    {{"GET", "/readyz"}, Access::open, get_readiness},
};

/// What stands in the place of {...}, if the path is of that pattern.
std::optional<std::vector<std::string>> match(std::string_view pattern, std::string_view path) {
  std::vector<std::string> names;
  for (;;) {
    const auto wanted = pattern.substr(0, pattern.find('/')), found = path.substr(0, path.find('/'));
    if (wanted.starts_with('{'))
      names.emplace_back(found);
    else if (wanted != found)
      return std::nullopt;
    const bool ends = wanted.size() == pattern.size();
    if (ends != (found.size() == path.size())) return std::nullopt;
    if (ends) return names;
    pattern.remove_prefix(wanted.size() + 1);
    path.remove_prefix(found.size() + 1);
  }
}

bool is_address(const std::string& host) {
  std::array<unsigned char, sizeof(::in6_addr)> bytes;
  if (host.starts_with('[') && host.ends_with(']'))
    return ::inet_pton(AF_INET6, host.substr(1, host.size() - 2).c_str(), bytes.data()) == 1;
  return ::inet_pton(AF_INET, host.c_str(), bytes.data()) == 1;
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (auto& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

/// A page of another name that was bound to our address (DNS rebinding) names itself in Host. A plain address
/// cannot be bound to anything.
bool is_own_host(const std::string& header, const ApiRules& rules) {
  auto host = lower(header);
  const auto colon = host.find(':', host.starts_with('[') ? host.find(']') : 0);
  if (colon != std::string::npos) {
    if (host.find_first_not_of("0123456789", colon + 1) != std::string::npos) return false;
    host.resize(colon);
  }
  return host == "localhost" || is_address(host) ||
         std::any_of(rules.host_names.begin(), rules.host_names.end(),
                     [&](const std::string& known) { return lower(known) == host; });
}

/// In a time that does not depend on where they differ.
bool same_token(std::string_view given, std::string_view wanted) {
  return !wanted.empty() && given.size() == wanted.size() &&
         CRYPTO_memcmp(given.data(), wanted.data(), wanted.size()) == 0;
}

std::string token_of(const httplib::Request& request, Access access) {
  const auto header = request.get_header_value("Authorization");
  if (lower(header.substr(0, 7)) == "bearer ") return header.substr(7);
  // EventSource and links send no headers of one's own.
  return access == Access::read_or_query ? request.get_param_value("token") : std::string();
}

/// Why a request may not be answered.
std::optional<ApiReply> forbidden(const ApiRules& rules, const httplib::Request& request, Access access) {
  if (access == Access::open) return std::nullopt;
  const auto token = token_of(request, access);
  const bool may_write = same_token(token, rules.write_token);
  const auto unauthorized = [&](std::string_view what_for) {
    auto reply =
        refused(401, "authorization",
                token.empty() ? fmt::format("a token is required to {}", what_for)
                              : fmt::format("the token is wrong, another one is required to {}", what_for));
    reply.headers.emplace_back("WWW-Authenticate", "Bearer");
    return reply;
  };
  if (access != Access::write) {
    if (rules.read_token.empty() || may_write || same_token(token, rules.read_token)) return std::nullopt;
    return unauthorized("read");
  }
  // A page of another origin cannot leave these headers out.
  const auto origin = request.get_header_value("Origin");
  const auto site = request.get_header_value("Sec-Fetch-Site");
  const auto scheme = origin.find("://");
  if (!origin.empty() && (scheme == std::string::npos ||
                          lower(origin.substr(scheme + 3)) != lower(request.get_header_value("Host"))))
    return refused(403, "origin", "writes are taken from this server's own page only");
  if (!site.empty() && site != "same-origin" && site != "none")
    return refused(403, "origin", "writes are taken from this server's own page only");
  if (rules.write_token.empty() && !rules.loopback)
    return refused(403, "write_token",  // no token that a client has would help
                   "writes are off: the service listens for others and has no write token");
  if (!rules.write_token.empty() && !may_write) {
    if (same_token(token, rules.read_token))
      return refused(403, "authorization", "this token is for reading only");
    return unauthorized("write");
  }
  const auto type = lower(request.get_header_value("Content-Type"));
  if (type.substr(0, type.find(';')) != kJson)
    return refused(415, "content-type", "application/json is required");
  return std::nullopt;
}

ApiReply asset_reply(const Asset& found, const httplib::Request& request, bool takes_gzip) {
  ApiReply reply;
  reply.type = found.content_type;
  reply.headers.emplace_back("ETag", found.etag);
  reply.headers.emplace_back("Cache-Control", "no-cache");  // kept, but asked for whether it is still so
  reply.headers.emplace_back("Vary", "Accept-Encoding");
  if (request.get_header_value("If-None-Match").find(found.etag) != std::string::npos) {
    reply.status = 304;
  } else if (takes_gzip && !found.gzip.empty()) {
    reply.body = found.gzip;
    reply.headers.emplace_back("Content-Encoding", "gzip");
  } else {
    reply.body = found.bytes;
  }
  return reply;
}

ApiReply routed(const ApiParts& parts, const httplib::Request& request, std::string_view body,
                bool takes_gzip) {
  if (request.get_header_value_count("Host") > 1 ||
      !is_own_host(request.get_header_value("Host"), parts.rules))
    return refused(403, "host",
                   "the Host header names none of this server's names; add it to those of the configuration");
  const std::string_view method = request.method == "HEAD" ? "GET" : std::string_view(request.method);
  std::string allowed;
  for (const auto& route : kRoutes) {
    auto names = match(route.name.path, request.path);
    if (!names) continue;
    if (route.name.method != method) {
      allowed += fmt::format("{}{}", allowed.empty() ? "" : ", ", route.name.method);
      continue;
    }
    if (auto no = forbidden(parts.rules, request, route.access)) return *no;
    if (route.name.path.find("{axis}") != std::string_view::npos && !is_axis_name(names->front()))
      return refused(400, "axis", "letters, digits, '_', '.' and '-' are required, 64 at most");
    auto reply = route.reply(Call{parts, request, body, std::move(*names)});
    reply.headers.emplace_back("Cache-Control", "no-store");
    return reply;
  }
  const auto* const file =
      asset(request.path == "/" ? "index.html" : std::string_view(request.path).substr(1));
  if (file != nullptr && method == "GET") return asset_reply(*file, request, takes_gzip);
  if (file != nullptr) allowed = "GET";
  if (allowed.empty()) return refused(404, "path", "there is nothing of that name");
  auto reply = refused(405, "method", fmt::format("{} is required", allowed));
  reply.headers.emplace_back("Allow", allowed);
  return reply;
}

/// A request and its answer in memory, for the HTTP library.
class MemoryStream final : public httplib::Stream {
 public:
  MemoryStream(std::string_view in, const std::string& client) : in_(in), client_(client) {}
  [[nodiscard]] bool is_readable() const override { return true; }
  [[nodiscard]] bool is_writable() const override { return true; }
  ::ssize_t read(char* to, std::size_t size) override {
    const auto count = in_.copy(to, size);
    in_.remove_prefix(count);
    return static_cast<::ssize_t>(count);
  }
  ::ssize_t write(const char* from, std::size_t size) override {
    out.append(from, size);
    return static_cast<::ssize_t>(size);
  }
  void get_remote_ip_and_port(std::string& ip, int& port) const override {
    ip = client_;
    port = 0;
  }
  void get_local_ip_and_port(std::string& ip, int& port) const override {
    ip.clear();
    port = 0;
  }
  [[nodiscard]] ::socket_t socket() const override { return INVALID_SOCKET; }

  std::string out;

 private:
  std::string_view in_;
  const std::string& client_;
};

/// The HTTP library without its sockets: it reads the head, decodes the query and writes the answer.
class HttpAnswerer : private httplib::Server {
 public:
  explicit HttpAnswerer(const ApiParts& parts) : parts_(parts) {
    httplib::Headers headers = {{"X-Content-Type-Options", "nosniff"},
                                {"Referrer-Policy", "no-referrer"},
                                {"Cross-Origin-Opener-Policy", "same-origin"},
                                {"Cross-Origin-Resource-Policy", "same-origin"}};
    set_keep_alive_timeout(30);  // what it tells clients; sockets.cpp is who keeps it
    if (parts_.rules.tls) headers.emplace("Strict-Transport-Security", "max-age=31536000");
    set_default_headers(std::move(headers));
    set_pre_routing_handler([this](const auto& request, auto& response) {
      handle(request, response);
      return HandlerResponse::Handled;
    });
    set_error_handler([](const auto&, auto& response) {  // what the library refuses itself has no body
      if (response.body.empty())
        response.set_content(error_json("request", "is no HTTP request that this server reads"),
                             kJson.data());
    });
  }

  Reply answer(const std::string& request, std::size_t head, const std::string& client) {
    body_ = std::string_view(request).substr(head);
    reply_ = {};
    understood_ = false;
    MemoryStream stream(std::string_view(request).substr(0, head), client);
    bool closes = false;
    const bool written = process_request(stream, false, closes, [this](httplib::Request& asked) {
      takes_gzip_ = asked.get_header_value("Accept-Encoding").find("gzip") != std::string::npos;
      asked.headers.erase("Accept-Encoding");  // or it would compress anew each time
      asked.headers.erase("Expect");           // the body is here already
      asked.ranges.clear();
    });
    reply_.text = std::move(stream.out);  // HTTP/1.1 200 OK
    std::from_chars(reply_.text.data() + 9, reply_.text.data() + reply_.text.size(), reply_.status);
    reply_.close = closes || !written || !understood_;
    return std::move(reply_);
  }

 private:
  void handle(const httplib::Request& request, httplib::Response& response) {
    understood_ = true;
    auto made = make(request);
    response.status = made.status;
    for (auto& [name, value] : made.headers) response.set_header(name, value);
    response.set_header("Content-Security-Policy", std::string(made.policy));
    if (made.stream) {
      reply_.stream = request.method == "GET";
      reply_.axis = std::move(made.axis);
      reply_.last_event_id = request.get_header_value("Last-Event-ID");
      // No length: the events come until the connection ends.
      response.set_content_provider(std::string(made.type),
                                    [](std::size_t, httplib::DataSink&) { return false; });
    } else if (made.status != 304) {
      response.body = std::move(made.body);  // set_content() would copy it
      response.set_header("Content-Type", std::string(made.type));
      reply_.download = std::move(made.download);
    }
  }

  ApiReply make(const httplib::Request& request) {
    try {
      return routed(parts_, request, body_, takes_gzip_);
    } catch (const std::exception&) {  // of memory, or of the rest of the service
      return refused(500, "server", "this request could not be answered");
    }
  }

  ApiParts parts_;
  std::string_view body_;
  bool takes_gzip_ = false;
  bool understood_ = false;  ///< It was not the library that refused.
  Reply reply_;
};

}  // namespace

std::shared_ptr<const void> Downloads::begin() const {
  if (count_->fetch_add(1) >= most_) {
    --*count_;
    return nullptr;
  }
  return {count_.get(), [count = count_](const void*) { --*count; }};
}

Answerer make_answerer(const ApiParts& parts) {
  return [answerer = std::make_shared<HttpAnswerer>(parts)](const std::string& request, std::size_t head,
                                                            const std::string& client) {
    return answerer->answer(request, head, client);
  };
}

std::span<const RouteName> routes() noexcept {
  static const auto kNames = [] {
    std::array<RouteName, std::size(kRoutes)> names{};
    std::transform(std::begin(kRoutes), std::end(kRoutes), names.begin(),
                   [](const Route& r) { return r.name; });
    return names;
  }();
  return kNames;
}

}  // namespace resonid::monitor::web
