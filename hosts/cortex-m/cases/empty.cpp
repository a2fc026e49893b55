// SPDX-License-Identifier: MIT
#include "cases.hpp"

/// What images consist of without an estimator: start-up, record and output.
const Case empty = {"empty",
                    Injection::multisine,
                    0,
                    [] { return true; },
                    [](const Sample&) {
                      asm volatile("" ::: "memory");
                    },
                    [](Output&) {}};
