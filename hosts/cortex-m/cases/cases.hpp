// SPDX-License-Identifier: MIT
#pragma once

#include "../case.hpp"

// CMakeLists.txt lists the same names.
extern const Case empty;
extern const Case line_bank_8, line_bank_21, kalman_bank_8, response_tracker_8, chirp_tracker_3,
    sliding_dft_21;
extern const Case rls_6, arx_3, output_error_3, cloe_3, instrumental_variables_3, physical_tracker;
extern const Case response_fit_3_21, recursive_response_fit_3_21;
extern const Case prbs_10, multisine_21, chirp, stepped_sine_21;
extern const Case change_detector;
extern const Case axis_lines_8;
extern const Case drive_control;
extern const Case drive_cascade;
