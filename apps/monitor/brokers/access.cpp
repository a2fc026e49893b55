// SPDX-License-Identifier: MIT
#include "monitor/brokers/access.hpp"

#include <fstream>

namespace resonid::monitor {

expected<Credentials, Error> read_credentials(const std::filesystem::path& path) {
  std::ifstream file(path);
  Credentials credentials;
  if (!std::getline(file, credentials.user))
    return unexpected<Error>(
        Error{"credentials", "a file with the user in its first line is required", {}, path.string()});
  std::getline(file, credentials.password);
  for (std::string* text : {&credentials.user, &credentials.password})
    if (!text->empty() && text->back() == '\r') text->pop_back();
  if (credentials.user.empty())
    return unexpected<Error>(
        Error{"credentials", "the first line is empty, the user is required there", {}, path.string()});
  return credentials;
}

}  // namespace resonid::monitor
