// SPDX-License-Identifier: MIT
#include <algorithm>
#include <optional>
#include <resonid/io/detail/profile.hpp>
#include <resonid/io/experiment.hpp>

#include "io/toml_text.hpp"
#include "io/toml_visitor.hpp"

namespace resonid::io {
namespace {

/// A text or a number as an option would have it.
std::optional<std::string> plain_value(const toml::node& node) {
  if (const auto* text = node.as_string(); text != nullptr && !text->get().empty()) return text->get();
  if (const auto* whole = node.as_integer()) return fmt::format("{}", whole->get());
  if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
  return std::nullopt;
}

class ProfileReader {
 public:
  explicit ProfileReader(std::string file) : file_(std::move(file)) {}

  void read(const toml::table& table, const std::string& path) {
    for (const auto& [key, node] : table) {
      if (error_) return;
      const std::string name(key.str());
      if (const auto* inner = node.as_table()) {
        const std::string full = path.empty() ? name : path + "." + name;
        entries_.push_back({full, {}, {}, false, false, position(file_, key.source())});
        places_.push_back(key.source().begin);
        read(*inner, full);
      } else {
        add({path, name, {}, false, false, position(file_, key.source())}, key.source().begin, node);
      }
    }
  }

  [[nodiscard]] expected<std::vector<ProfileEntry>> finish() {
    if (error_) return unexpected(std::move(*error_));
    std::vector<std::size_t> order(entries_.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(),
              [this](std::size_t a, std::size_t b) { return places_[a] < places_[b]; });
    std::vector<ProfileEntry> sorted;
    for (const auto i : order) sorted.push_back(std::move(entries_[i]));
    return sorted;
  }

 private:
  void add(ProfileEntry entry, toml::source_position place, const toml::node& node) {
    if (const auto* choice = node.as_boolean()) {
      entry.is_boolean = true;
      entry.values = {choice->get() ? "true" : "false"};
    } else if (const auto* list = node.as_array()) {
      entry.is_list = true;
      for (const auto& element : *list) {
        const auto value = plain_value(element);
        if (!value) return refuse(entry, element);
        entry.values.push_back(*value);
      }
      if (entry.values.empty()) return refuse(entry, node);
    } else if (const auto value = plain_value(node)) {
      entry.values = {*value};
    } else {
      return refuse(entry, node);
    }
    entries_.push_back(std::move(entry));
    places_.push_back(place);
  }
  void refuse(const ProfileEntry& entry, const toml::node& node) {
    error_ = Error{
        {},
        fmt::format("'{}' requires a text, a number, true, false, or a list of texts or numbers", entry.key),
        std::nan(""),
        position(file_, node.source())};
  }

  std::string file_;
  std::vector<ProfileEntry> entries_;
  std::vector<toml::source_position> places_;  // [entry]
  std::optional<Error> error_;
};

}  // namespace

expected<std::vector<ProfileEntry>> read_profile(const std::filesystem::path& path) {
  const auto text = read_experiment_text(path);
  if (!text) return unexpected(text.error());
  const auto table = parse_toml(*text, path.string());
  if (!table) return unexpected(table.error());
  ProfileReader reader(path.string());
  reader.read(*table, "");
  return reader.finish();
}

std::string toml_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    else
      out += c;
  }
  return out + "\"";
}

}  // namespace resonid::io
