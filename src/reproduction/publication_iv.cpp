// SPDX-License-Identifier: MIT
#include <resonid/reproduction/reproduction.hpp>

namespace resonid::reproduction {

report::Document publication_iv(const Options&) { return {}; }

}  // namespace resonid::reproduction
