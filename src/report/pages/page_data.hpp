// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace resonid::report {

/// The data that the page carries, as script_json() within `budget_bytes` as far as thinning can reach that.
[[nodiscard]] std::string page_data(const nlohmann::json& data, std::size_t budget_bytes);

}  // namespace resonid::report
