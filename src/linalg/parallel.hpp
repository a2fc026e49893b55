// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>

namespace resonid::linalg {

/// Calls work(i) for i = 0 ... count - 1, on up to `jobs` threads (0: one per core), each index once, and
/// returns when all are done. What work(i) gives may depend on i only. The first exception is passed on.
void for_each_index(std::size_t count, std::size_t jobs, const std::function<void(std::size_t)>& work);

}  // namespace resonid::linalg
