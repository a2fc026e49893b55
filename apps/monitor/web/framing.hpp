// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "monitor/web/sockets.hpp"

namespace resonid::monitor::web {

/// How long a request is, by its head.
struct RequestSize {
  std::size_t head = 0, body = 0;  ///< bytes; head 0: not all of it is there yet
  int refusal = 0;                 ///< Status to refuse it with, or 0.
  std::string message;
};
[[nodiscard]] RequestSize request_size(std::string_view received, const WebLimits&);

/// An answer of the sockets themselves, after which the connection ends.
[[nodiscard]] Reply refusal(int status, std::string_view field, std::string_view message);

}  // namespace resonid::monitor::web
