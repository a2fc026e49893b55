// SPDX-License-Identifier: MIT
// What the images must print: the same cases, compiled for the host. Usage: cortex_reference CASE
#include <cstdio>
#include <string_view>

#include "cases/cases.hpp"

int main(int count, char** arguments) {
  for (const Case* c : {&empty,
                        &line_bank_8,
                        &line_bank_21,
                        &kalman_bank_8,
                        &response_tracker_8,
                        &chirp_tracker_3,
                        &sliding_dft_21,
                        &rls_6,
                        &arx_3,
                        &output_error_3,
                        &cloe_3,
                        &instrumental_variables_3,
                        &physical_tracker,
                        &response_fit_3_21,
                        &recursive_response_fit_3_21,
                        &prbs_10,
                        &multisine_21,
                        &chirp,
                        &stepped_sine_21,
                        &change_detector,
                        &axis_lines_8,
                        &drive_control,
                        &drive_cascade})
    if (count == 2 && std::string_view(arguments[1]) == c->name) return run(*c);
  std::fputs("usage: cortex_reference CASE\n", stderr);
  return 2;
}
