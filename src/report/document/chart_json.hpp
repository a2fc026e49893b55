// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/report/detail/document.hpp>

namespace resonid::report {

/// A chart as document_json() and the pages' scripts have it.
[[nodiscard]] nlohmann::json chart_json(const Chart& chart);

}  // namespace resonid::report
