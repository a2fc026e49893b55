// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "monitor/brokers/scout.hpp"
#include "monitor/service/discover.hpp"

namespace resonid::monitor {

/// Sources that bring what was found, and what is known of each axis.
struct DiscoveredSources {
  std::map<std::string, SourceConfig> sources;  ///< By name.
  std::vector<StreamFacts> streams;
};

/// Where axes come by topics or subjects that differ in one level alone, a source with a wildcard there, in
/// which that level names the axis; else a source for each topic. What a stream of JetStream keeps is read
/// from it. What has no format is left out.
/// @param where kind and address, of the broker or of what is not searched by topics
[[nodiscard]] DiscoveredSources sources_of(std::span<const Discovered> found, const SourceConfig& where);

}  // namespace resonid::monitor
