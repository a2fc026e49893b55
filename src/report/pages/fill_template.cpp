// SPDX-License-Identifier: MIT
#include <algorithm>
#include <nlohmann/json.hpp>

#include "report/pages/page_template.hpp"

namespace resonid::report {

std::string fill(std::string_view page, std::initializer_list<Filling> fillings) {
  std::size_t size = page.size();
  for (const auto& filling : fillings) size += 2 * filling.second.size();
  std::string out;
  out.reserve(size);
  std::size_t from = 0;
  while (from < page.size()) {
    const std::size_t open = page.find("{{", from);
    const std::size_t close = open == page.npos ? page.npos : page.find("}}", open);
    if (close == page.npos) break;
    const std::string_view name = page.substr(open + 2, close - open - 2);
    const auto* filling =
        std::find_if(fillings.begin(), fillings.end(), [&](const Filling& f) { return f.first == name; });
    const bool known = filling != fillings.end();
    const std::size_t until = known ? open : open + 2;
    out.append(page.substr(from, until - from));
    if (known) out.append(filling->second);
    from = known ? close + 2 : until;
  }
  out.append(page.substr(from));
  return out;
}

std::string repaired(const std::string& text) {
  using nlohmann::json;
  // JSON's own rendering of a text repairs such bytes.
  return json::parse(json(text).dump(-1, ' ', true, json::error_handler_t::replace)).get<std::string>();
}

}  // namespace resonid::report
