// SPDX-License-Identifier: MIT
#pragma once

namespace resonid::online {

enum class DftWindow {
  rectangular,  ///< Exact for periodic excitation.
  hann,         ///< Less leakage from what is not periodic in the window; 1.5 times the noise power.
};

}  // namespace resonid::online
