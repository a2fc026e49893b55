// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/web/metrics.hpp"
#include "monitor/web/sockets.hpp"

namespace resonid::monitor::web {

/// Who may ask for what.
struct ApiRules {
  bool loopback = true;  ///< Listens for this machine alone: writes need no token where none is configured.
  bool tls = false;
  std::vector<std::string> host_names;  ///< Of the Host header, besides localhost and plain addresses.
  std::string write_token;              ///< For writes and reads; empty: none.
  std::string read_token;               ///< For reads; empty: these need none.
};

/// How many files of samples, which are long, are made and sent at once.
class Downloads {
 public:
  explicit Downloads(std::uint32_t most) : most_(most) {}
  /// Room for one until what it returns is gone; nothing: there is none.
  [[nodiscard]] std::shared_ptr<const void> begin() const;

 private:
  std::uint32_t most_;
  std::shared_ptr<std::atomic<std::uint32_t>> count_ = std::make_shared<std::atomic<std::uint32_t>>(0);
};

/// What answers are made of.
struct ApiParts {
  Backend& backend;
  ApiRules rules;
  std::function<WebCounts()> counts;
  std::function<double()> now_s;  ///< UNIX
  Downloads downloads;            ///< Copies count together.
};

/// Answers whole requests. Never throws, whatever comes in.
[[nodiscard]] Answerer make_answerer(const ApiParts&);

/// What is served besides the files of the page: names in braces stand for any one part.
struct RouteName {
  std::string_view method, path;
};
[[nodiscard]] std::span<const RouteName> routes() noexcept;

}  // namespace resonid::monitor::web
