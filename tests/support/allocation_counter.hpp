// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace resonid::test {

/// Times that this executable has asked for heap so far: operator new and, unless a sanitizer holds them,
/// malloc and its family, which Eigen uses.
std::size_t allocations() noexcept;

}  // namespace resonid::test
