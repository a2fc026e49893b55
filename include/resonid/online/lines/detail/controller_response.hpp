// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <complex>
#include <cstddef>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/detail/polynomial.hpp>
#include <resonid/base/expected.hpp>
#include <span>

namespace resonid::online {

inline constexpr std::size_t kMaxControllerCoefficients = 16;

/// Response of a known linear controller at the tracked lines, from a table or from coefficients in powers of
/// z^-1; NaN when neither is given. No heap.
template <std::size_t MaxLines>
class ControllerResponse {
 public:
  /// `at_line` must not be longer than MaxLines; when it holds something the coefficients must be empty.
  static expected<ControllerResponse, Error> create(std::span<const std::complex<double>> at_line,
                                                    std::span<const double> numerator,
                                                    std::span<const double> denominator) {
    ControllerResponse controller;
    if (!at_line.empty() && !numerator.empty())
      return refuse("controller_numerator", "must be empty when controller_at_line is given");
    if (at_line.size() > MaxLines)
      return refuse("controller_at_line", "has too many values", static_cast<double>(at_line.size()));
    if (numerator.empty() != denominator.empty())
      return refuse("controller_denominator",
                    "numerator and denominator must both be given or both be empty");
    if (std::max(numerator.size(), denominator.size()) > kMaxControllerCoefficients)
      return refuse("controller_numerator", "numerator and denominator may have 16 coefficients each");
    if (!denominator.empty() && denominator[0] == 0.0)
      return refuse("controller_denominator", "must not begin with 0", 0.0);
    std::copy(at_line.begin(), at_line.end(), controller.at_line_.begin());
    std::copy(numerator.begin(), numerator.end(), controller.numerator_.begin());
    std::copy(denominator.begin(), denominator.end(), controller.denominator_.begin());
    controller.tabulated_ = !at_line.empty();
    controller.known_ = controller.tabulated_ || !numerator.empty();
    return controller;
  }

  /// C at the line, whose frequency is `cycles_per_sample`.
  [[nodiscard]] std::complex<double> at(std::size_t line, double cycles_per_sample) const noexcept {
    if (!known_) return std::numeric_limits<double>::quiet_NaN();
    if (tabulated_) return at_line_[line];
    const auto delay = std::polar(1.0, -kTwoPi * cycles_per_sample);  // z^-1
    return polynomial(numerator_, delay) / polynomial(denominator_, delay);
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return intact_flags(tabulated_, known_); }

 private:
  std::array<std::complex<double>, MaxLines> at_line_{};  // [line]
  std::array<double, kMaxControllerCoefficients> numerator_{}, denominator_{};
  bool tabulated_ = false, known_ = false;
};

}  // namespace resonid::online
