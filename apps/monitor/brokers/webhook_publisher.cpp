// SPDX-License-Identifier: MIT
#include <fmt/core.h>
#include <httplib.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "monitor/brokers/publisher.hpp"
#include "monitor/samples/faults.hpp"

namespace resonid::monitor {
namespace {

constexpr int kSeconds_us = 1'000'000;
constexpr time_t kLongestConnect_s = 3;  // which cannot be interrupted

/// As a header may have it.
bool is_header_text(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c < '\x7F'; });
}

class WebhookPublisher final : public Publisher {
 public:
  /// @param origin scheme, host and port of the URL, `path` the rest of it
  WebhookPublisher(WebhookSettings settings, const std::string& origin, std::string path)
      : settings_(std::move(settings)), path_(std::move(path)), client_(client_of(settings_, origin)) {
    const auto seconds = static_cast<time_t>(settings_.timeout_s);
    const auto rest_us = static_cast<time_t>(std::fmod(settings_.timeout_s, 1.0) * kSeconds_us);
    if (settings_.timeout_s < kLongestConnect_s)
      client_.set_connection_timeout(seconds, rest_us);
    else
      client_.set_connection_timeout(kLongestConnect_s);
    client_.set_read_timeout(seconds, rest_us);
    client_.set_write_timeout(seconds, rest_us);
    if (settings_.tls && !settings_.tls->authorities.empty())
      client_.set_ca_cert_path(settings_.tls->authorities.string());
  }

  [[nodiscard]] bool valid() const { return client_.is_valid(); }

  [[nodiscard]] expected<void, Error> publish(std::string_view key, std::string_view topic,
                                              std::string_view body) override {
    const auto text = with_key(body, key);
    if (!text) return unexpected(text.error());
    if (!is_header_text(topic))
      return refuse("topic", fmt::format("'{}': printable ASCII is required", printable(topic)));
    httplib::Headers headers = {{"Idempotency-Key", std::string(key)}, {"Resonid-Topic", std::string(topic)}};
    if (!settings_.bearer.empty()) headers.emplace("Authorization", "Bearer " + settings_.bearer);
    if (interrupted_) return failed("interrupted");
    const httplib::Result answer = client_.Post(path_, headers, *text, "application/json");
    if (!answer) return failed(httplib::to_string(answer.error()));
    if (answer->status >= 200 && answer->status <= 299) return {};
    auto fault =
        failed(fmt::format("answer {} ('{}'); 2xx is required", answer->status, printable(answer->body)));
    if (answer->status == 400 || answer->status == 413 || answer->status == 422)
      fault.value().field = "message";
    return fault;
  }
  void interrupt() override {
    interrupted_ = true;
    client_.stop();
  }

 private:
  static httplib::Client client_of(const WebhookSettings& settings, const std::string& origin) {
    return settings.tls && !settings.tls->certificate.empty()
               ? httplib::Client(origin, settings.tls->certificate.string(), settings.tls->key.string())
               : httplib::Client(origin);
  }
  [[nodiscard]] unexpected<Error> failed(std::string why) const {
    return unexpected<Error>(Error{"publisher", std::move(why), std::nan(""), settings_.url});
  }

  WebhookSettings settings_;
  std::string path_;
  std::atomic<bool> interrupted_{false};
  httplib::Client client_;
};

}  // namespace

expected<std::unique_ptr<Publisher>, Error> make_webhook_publisher(WebhookSettings settings) {
  const std::string& url = settings.url;
  const std::size_t scheme = url.rfind("https://", 0) == 0 ? 8 : url.rfind("http://", 0) == 0 ? 7 : 0;
  const std::size_t end = std::min(url.find_first_of("/?", scheme), url.size());
  if (scheme == 0 || end == scheme || !is_header_text(url) || url.find(' ') != std::string::npos)
    return refuse(
        "url", fmt::format("'{}' is none; http://HOST[:PORT]/PATH or https:// is required", printable(url)));
  if (!(settings.timeout_s >= 0.1 && settings.timeout_s <= 60.0))
    return refuse("timeout_s", "0.1 ... 60 s are required", settings.timeout_s);
  if (!is_header_text(settings.bearer)) return refuse("bearer", "printable ASCII is required");
  std::string path = url.substr(end);
  if (path.empty() || path.front() != '/') path.insert(0, "/");
  const std::string origin = url.substr(0, end);
  auto publisher = std::make_unique<WebhookPublisher>(std::move(settings), origin, std::move(path));
  if (!publisher->valid())
    return refuse("url",
                  fmt::format("'{}': the port, or the files of TLS, cannot be used", printable(origin)));
  return publisher;
}

}  // namespace resonid::monitor
