// SPDX-License-Identifier: MIT
#include "monitor/web/framing.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <system_error>
#include <utility>

#include "monitor/web/api_json.hpp"

namespace resonid::monitor::web {
namespace {

std::string_view reason_of(int status) {
  switch (status) {
    case 400:
      return "Bad Request";
    case 408:
      return "Request Timeout";
    case 411:
      return "Length Required";
    case 413:
      return "Payload Too Large";
    case 429:
      return "Too Many Requests";
    case 431:
      return "Request Header Fields Too Large";
    default:
      return "Service Unavailable";
  }
}

bool same_word(std::string_view a, std::string_view lower) {
  return std::equal(a.begin(), a.end(), lower.begin(), lower.end(), [](char x, char y) {
    return (x >= 'A' && x <= 'Z' ? static_cast<char>(x - 'A' + 'a') : x) == y;
  });
}

}  // namespace

Reply refusal(int status, std::string_view field, std::string_view message) {
  const auto body = error_json(field, message);
  const std::string_view later = status == 429 || status == 503 ? "Retry-After: 2\r\n" : "";
  Reply reply;
  reply.status = status;
  reply.close = true;
  reply.text = fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n"
      "Connection: close\r\nX-Content-Type-Options: nosniff\r\n{}\r\n{}",
      status, reason_of(status), body.size(), later, body);
  return reply;
}

RequestSize request_size(std::string_view received, const WebLimits& limits) {
  const auto refused = [](int status, std::string message) {
    return RequestSize{0, 0, status, std::move(message)};
  };
  const auto end = received.find("\r\n\r\n");
  if (std::min(end, received.size()) > limits.head_bytes)
    return refused(431, fmt::format("request line and headers exceed {} bytes", limits.head_bytes));
  if (end == std::string_view::npos) return {};
  const auto head = received.substr(0, end + 2);
  if (head.find('\0') != std::string_view::npos) return refused(400, "a header has a zero byte");
  RequestSize size{end + 4, 0, 0, {}};
  bool has_length = false;
  auto rest = head.substr(head.find("\r\n") + 2);
  while (!rest.empty()) {
    const auto line = rest.substr(0, rest.find("\r\n"));
    rest.remove_prefix(line.size() + 2);
    const auto colon = line.find(':');
    const auto name = line.substr(0, colon);
    if (colon == std::string_view::npos || name.empty() ||
        name.find_first_of(" \t\r\n") != std::string_view::npos)
      return refused(400, "a header is not of the form name: value");
    if (same_word(name, "transfer-encoding")) return refused(411, "a body needs a Content-Length");
    if (!same_word(name, "content-length")) continue;
    auto value = line.substr(colon + 1);
    while (!value.empty() && (value.front() == ' ' || value.front() == '\t')) value.remove_prefix(1);
    while (!value.empty() && (value.back() == ' ' || value.back() == '\t')) value.remove_suffix(1);
    const auto [stop, code] = std::from_chars(value.data(), value.data() + value.size(), size.body);
    if (code == std::errc::result_out_of_range || (code == std::errc{} && size.body > limits.body_bytes))
      return refused(413, fmt::format("the body exceeds {} bytes", limits.body_bytes));
    if (code != std::errc{} || stop != value.data() + value.size() || has_length)
      return refused(400, "one Content-Length in digits is required");
    has_length = true;
  }
  return size;
}

}  // namespace resonid::monitor::web
