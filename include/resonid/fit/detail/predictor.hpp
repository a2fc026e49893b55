// SPDX-License-Identifier: MIT
#pragma once

namespace resonid::fit {

/// How the record's input reaches the model.
enum class Predictor {
  open_loop,    ///< The recorded input drives the simulation; with the noise modelled also right in closed
                ///< loop.
  closed_loop,  ///< Excitation and reference drive the simulated loop with the known controller.
  joint,  ///< The loop as in closed_loop, its controller taken from the record (estimate_controller); where
          ///< it shows none, what of the input the excitation explains drives the simulation: not for heavy
          ///< noise.
};

}  // namespace resonid::fit
