// SPDX-License-Identifier: MIT
// The image of one case; the linker is told which one `selected_case` is.
#include "../case.hpp"

extern const Case selected_case;

int program();
int program() { return run(selected_case); }
