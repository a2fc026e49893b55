// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/expected.hpp>
#include <string>
#include <string_view>

namespace resonid::io {

/// How the characters of a text are written.
enum class Encoding { bytes, utf16_little, utf16_big };

/// UTF-16 by its byte order mark or, without one, by the zeros that stand beside plain characters; everything
/// else is bytes (ASCII, UTF-8, Windows-1252).
[[nodiscard]] Encoding encoding_of(std::string_view beginning) noexcept;

/// UTF-16 as UTF-8, without its byte order mark; what is no character becomes U+FFFD.
[[nodiscard]] std::string from_utf16(std::string_view bytes, Encoding encoding);

/// The text itself when it is UTF-8, else taken for Windows-1252, which Latin-1 is a part of.
[[nodiscard]] std::string as_utf8(std::string text);
[[nodiscard]] bool is_utf8(std::string_view text) noexcept;

/// A gzip file unpacked; `name` for the error of a damaged one.
[[nodiscard]] expected<std::string, Error> unpacked_gzip(const std::string& name, std::string_view bytes);
[[nodiscard]] bool is_gzip(std::string_view beginning) noexcept;

}  // namespace resonid::io
