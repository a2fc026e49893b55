// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <limits>
#ifndef RESONID_EMBEDDED
#include <memory>
#endif
#include <string>
#include <string_view>
#include <utility>

namespace resonid {

/// A phrase of an error: a literal, which must outlive every copy, or text made for the occasion. Where
/// RESONID_EMBEDDED is defined a literal only: owners of text in an error are a kilobyte of firmware per
/// create().
class Phrase {
 public:
  constexpr Phrase() noexcept = default;
  constexpr Phrase(const char* literal) noexcept : view_(literal) {}       // NOLINT: implicit
  constexpr Phrase(std::string_view literal) noexcept : view_(literal) {}  // NOLINT: implicit
#ifndef RESONID_EMBEDDED
  Phrase(std::string text)  // NOLINT: implicit
      : owned_(std::make_shared<const std::string>(std::move(text))), view_(*owned_) {}
#endif

  [[nodiscard]] constexpr std::string_view view() const noexcept { return view_; }
  [[nodiscard]] constexpr operator std::string_view() const noexcept { return view_; }  // NOLINT: implicit
  [[nodiscard]] constexpr bool empty() const noexcept { return view_.empty(); }
  [[nodiscard]] std::string str() const { return std::string(view_); }
  template <std::convertible_to<std::string_view> Text>
  [[nodiscard]] friend constexpr bool operator==(const Phrase& a, const Text& b) noexcept {
    return a.view_ == std::string_view(b);
  }
  template <class Stream>
  requires requires(Stream& s, std::string_view v) { s << v; }
  friend Stream& operator<<(Stream& stream, const Phrase& phrase) {
    stream << phrase.view_;
    return stream;
  }

 private:
#ifndef RESONID_EMBEDDED
  std::shared_ptr<const std::string> owned_;
#endif
  std::string_view view_;
};

/// Why a call was refused: what is wrong, what is required of it, and what was found. The one error type of
/// the library; poor data are no error but a result with findings.
struct Error {
  Phrase field;        ///< Name of the offending field of the configuration or options: "from_hz".
  Phrase requirement;  ///< What is required of it, as a phrase: "must be > 0".
  double value = std::numeric_limits<double>::quiet_NaN();  ///< The value found, where it is a number.
  Phrase where = {};  ///< File, line, column or place in a document; empty: the call itself.
};

}  // namespace resonid
