// SPDX-License-Identifier: MIT
#pragma once

namespace resonid::fit {

/// How the record's input reaches the model.
enum class Predictor {
  open_loop,    ///< The recorded input drives the simulation; with the noise modelled also right in closed
                ///< loop.
  closed_loop,  ///< Excitation and reference drive the simulated loop with the known controller.
  joint,        ///< What of the input the excitation explains drives it: no controller is needed.
};

}  // namespace resonid::fit
