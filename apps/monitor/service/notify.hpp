// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string_view>

namespace resonid::monitor {

/// Tells systemd of the service's state ("READY=1", "WATCHDOG=1", "STOPPING=1"), where it asked for that
/// (NOTIFY_SOCKET); nothing otherwise.
void notify(std::string_view state) noexcept;

/// After how long without WATCHDOG=1 the watchdog of systemd ends the process, s; nothing where there is none
/// (WATCHDOG_USEC).
[[nodiscard]] std::optional<double> watchdog_s() noexcept;

}  // namespace resonid::monitor
