// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <resonid/base/enum_names.hpp>
#include <span>

namespace resonid::monitor {

enum class MqttVersion : std::uint8_t { v3_1_1, v5 };
inline constexpr EnumName<MqttVersion> kMqttVersionNames[] = {{MqttVersion::v3_1_1, "3.1.1"},
                                                              {MqttVersion::v5, "5"}};
[[nodiscard]] constexpr std::span<const EnumName<MqttVersion>> enum_names(MqttVersion) noexcept {
  return kMqttVersionNames;
}

}  // namespace resonid::monitor
