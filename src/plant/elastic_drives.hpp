// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "plant/machine.hpp"

namespace resonid::plant {

// ElasticDrive for as many masses as the machine has, up to the number in the name: one source each, since
// they are long to compile.
[[nodiscard]] std::unique_ptr<Drive> elastic_drive_of_two(Machine machine, double sample_time_s,
                                                          double early_fraction);
[[nodiscard]] std::unique_ptr<Drive> elastic_drive_of_four(Machine machine, double sample_time_s,
                                                           double early_fraction);
[[nodiscard]] std::unique_ptr<Drive> elastic_drive_of_six(Machine machine, double sample_time_s,
                                                          double early_fraction);

}  // namespace resonid::plant
