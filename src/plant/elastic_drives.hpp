// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "plant/machine.hpp"

namespace resonid::plant {

/// ElasticDrive for as many masses as the machine has.
[[nodiscard]] std::unique_ptr<Drive> elastic_drive(Machine machine, double sample_time_s,
                                                   double early_fraction);

/// The same for any number but two: most machines have two masses, whose steps are compiled for speed.
[[nodiscard]] std::unique_ptr<Drive> other_elastic_drive(Machine machine, double sample_time_s,
                                                         double early_fraction);

/// BentDrive: two masses whose coupling has play or stiffens.
[[nodiscard]] std::unique_ptr<Drive> bent_drive(Machine machine, double sample_time_s, double early_fraction);

}  // namespace resonid::plant
