// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/enum_names.hpp>

namespace resonid {

/// How the plant's response is formed from the phasors of excitation, input and output (Ljung 1999, ch. 13).
enum class Approach {
  direct,    ///< Gd = Y/U. With spectra, biased under feedback when the noise is not small.
  indirect,  ///< Gcl = Y/Ru, Gd = Gcl/(1 - C Gcl). Needs the controller.
  joint,     ///< Gd = (Y/Ru)/(U/Ru). Needs the excitation, not the controller.
};

inline constexpr EnumName<Approach> kApproachNames[] = {
    {Approach::direct, "direct"}, {Approach::indirect, "indirect"}, {Approach::joint, "joint"}};
[[nodiscard]] constexpr std::span<const EnumName<Approach>> enum_names(Approach) noexcept {
  return kApproachNames;
}

}  // namespace resonid
