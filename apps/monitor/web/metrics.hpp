// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "monitor/web/backend.hpp"

namespace resonid::monitor::web {

/// What the web server counts of itself.
struct WebCounts {
  std::uint64_t connections = 0, streams = 0;  ///< Now.
  std::uint64_t refused_connections = 0;       ///< Since the start: more than the limit, or a client's rate.
  std::map<int, std::uint64_t> responses;      ///< By status.
  std::uint64_t frames = 0, skipped_frames = 0;  ///< Made; left out for a slow client.
};

/// The text that Prometheus scrapes, version 0.0.4: base units, what is not known is absent.
[[nodiscard]] std::string metrics_text(const std::vector<AxisStatus>&, const Answer<AlarmCounts>& active,
                                       const ServiceStatus&, const WebCounts&);

}  // namespace resonid::monitor::web
