// SPDX-License-Identifier: MIT
// Images of many estimators, each at one typical size: for their size. RESONID_WHOLE: all of them; else those
// that a drive needs to excite, track, and identify sample by sample.
#include "cases.hpp"

int program();
int program() {
  int failed = 0;
  for (const Case* c : {
#ifdef RESONID_WHOLE
           &response_tracker_8, &arx_3, &output_error_3, &instrumental_variables_3, &response_fit_3_21,
           &recursive_response_fit_3_21,
#endif
           &line_bank_21, &chirp_tracker_3, &sliding_dft_21, &rls_6, &cloe_3, &physical_tracker, &prbs_10,
           &multisine_21, &chirp, &stepped_sine_21})
    failed += run(*c);
  return failed;
}
