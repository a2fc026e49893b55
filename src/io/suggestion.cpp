// SPDX-License-Identifier: MIT
#include <resonid/io/detail/suggestion.hpp>

#include "io/text.hpp"

namespace resonid::io {

std::string suggestion(std::string_view wanted, const std::vector<std::string>& names) {
  const std::string name = nearest(wanted, names);
  return name.empty() ? name : " (did you mean '" + name + "'?)";
}

}  // namespace resonid::io
