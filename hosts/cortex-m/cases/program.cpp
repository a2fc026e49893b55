// SPDX-License-Identifier: MIT
// The image of one case, RESONID_CASE.
#include "cases.hpp"

int program();
int program() { return run(RESONID_CASE); }
