// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

#include "monitor/service/configuration.hpp"
#include "monitor/service/installation.hpp"

namespace resonid::monitor {

/// What a configuration without errors installs. Errors: files that are no longer there.
[[nodiscard]] expected<Installation, Error> installation_of(const Configuration& configuration,
                                                            std::string version);

/// Where [publish] tells alarms.
[[nodiscard]] std::vector<InstalledTarget> targets_of(
    const std::shared_ptr<const Configuration>& configuration);

/// Simulated drives (demo_machines()) as axes of an installation with this data folder, for
/// `resonid monitor --demo`. `speed`: simulated seconds per second.
[[nodiscard]] Installation demo_installation(const std::filesystem::path& data, double speed,
                                             std::string version);

}  // namespace resonid::monitor
