// SPDX-License-Identifier: MIT
#pragma once

#include <monitoring/row.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace resonid::monitor {

/// Bytes of a row without its sample, which is a key of its own: 8 bytes of flags and masks, then a double
/// for each value and each standard deviation that is there. Every bit of the row comes back.
[[nodiscard]] std::string encode_row(const monitoring::Row& row);

/// Reads encoded rows, field by field: a chart needs one figure of many rows.
class RowBytes {
 public:
  /// Nothing where the bytes are not those of a row.
  [[nodiscard]] static std::optional<RowBytes> of(std::string_view bytes) noexcept;
  [[nodiscard]] bool trusted() const noexcept;
  [[nodiscard]] online::Figure figure(monitoring::Watched watched) const noexcept;
  [[nodiscard]] monitoring::Row row(std::uint64_t sample) const noexcept;

 private:
  explicit RowBytes(std::string_view bytes) noexcept : bytes_(bytes) {}
  std::string_view bytes_;
};

}  // namespace resonid::monitor
