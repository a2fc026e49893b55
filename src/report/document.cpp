// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>
#include <resonid/report/document.hpp>

namespace resonid::report {}  // namespace resonid::report
