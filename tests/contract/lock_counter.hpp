// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace resonid::test {

/// Times that this executable has taken a lock so far: mutexes, and the guards of function-local statics.
/// Always 0 where a sanitizer holds them.
std::size_t locks() noexcept;

}  // namespace resonid::test
