// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/report/detail/document.hpp>

namespace resonid::reproduction::v {

/// The source's benchmark of Publication V: Welch's averaged spectra of a PRBS while the cart rests, and the
/// two-mass model of eq. (28) of Publication VI fitted to them.
[[nodiscard]] report::Section offline(std::size_t seeds);

}  // namespace resonid::reproduction::v
