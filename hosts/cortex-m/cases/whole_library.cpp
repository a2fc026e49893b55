// SPDX-License-Identifier: MIT
// The image of all estimators and generators, each at one typical size: for its size.
#include "cases.hpp"

int program();
int program() {
  int failed = 0;
  for (const Case* c :
       {&line_bank_21, &response_tracker_8, &chirp_tracker_3, &sliding_dft_21, &rls_6, &arx_3,
        &output_error_3, &cloe_3, &instrumental_variables_3, &physical_tracker, &response_fit_3_21,
        &recursive_response_fit_3_21, &prbs_10, &multisine_21, &chirp, &stepped_sine_21})
    failed += run(*c);
  return failed;
}
