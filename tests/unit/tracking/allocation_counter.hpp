// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace resonid::test {

/// Calls of operator new so far in this executable.
std::size_t allocations() noexcept;

}  // namespace resonid::test
