// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>

namespace resonid::monitor {

/// CRC-32C (Castagnoli; RFC 3720 appendix B.4) of all bytes; "123456789" has 0xE3069283.
[[nodiscard]] std::uint32_t crc32c(std::string_view bytes) noexcept;

}  // namespace resonid::monitor
