// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string_view>

namespace resonid::monitor::web {

/// A file of the page, in the program; made at build time by embed_assets.cpp.
struct Asset {
  std::string_view path;  ///< "index.html"
  std::string_view content_type;
  std::string_view etag;   ///< With its quotes.
  std::string_view bytes;  ///< As it is.
  std::string_view gzip;   ///< Compressed; empty where that does not pay.
};
[[nodiscard]] std::span<const Asset> assets() noexcept;

/// The asset of that path, or nullptr. Nothing is read from a disk, so no path leads anywhere else.
[[nodiscard]] inline const Asset* asset(std::string_view path) noexcept {
  for (const auto& known : assets())
    if (known.path == path) return &known;
  return nullptr;
}

}  // namespace resonid::monitor::web
