// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <string>

namespace resonid::cli {

/// "resonid-excite-chirp": the name of a verb's page.
[[nodiscard]] std::string man_page_name(const CLI::App& verb);

/// The man page of the program or of one of its verbs, for section 1. It bears no date: made again it is the
/// same.
[[nodiscard]] std::string man_page(const CLI::App& verb);

}  // namespace resonid::cli
