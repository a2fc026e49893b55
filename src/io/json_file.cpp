// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <io/text.hpp>
#include <io/text_source.hpp>
#include <nlohmann/json.hpp>
#include <resonid/io/detail/json_file.hpp>

namespace resonid::io {
namespace {

/// "at line 3, column 7: ..." of the parser's message, without its own names.
std::string plain(const std::string& message) {
  const auto at = message.find("at line");
  std::string text = at == std::string::npos ? message : message.substr(at);
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  return text;
}

}  // namespace

expected<nlohmann::json, Error> read_json(const std::filesystem::path& path) {
  const auto source = TextSource::open(path);
  if (!source) return unexpected(source.error());
  std::string text(source->size(), '\0');
  const auto count = source->read(0, text.data(), text.size());
  if (!count) return unexpected(count.error());
  text.resize(*count);
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::exception& error) {
    return fail(source->name(), fmt::format("is not valid JSON, {}", plain(error.what())));
  }
}

}  // namespace resonid::io
