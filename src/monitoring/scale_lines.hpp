// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <span>

namespace resonid::monitoring {

/// What three signals of an axis have in common at lines from 1/2500 to 0.3 of the sample rate, in even
/// ratio, by Hann-windowed blocks of six periods whose older ones fade: what u, -y and ru are after the
/// polynomials of the controller C = N/D,
///
///   a = D u     b = -N y     e = D ru     so that     a = c b + g e
///
/// with c = g = 1 where all scales are right, whatever torque loads the machine: nothing integrates, and no
/// model of the machine is needed. A reference that moves is in a alone and does not correlate with e.
/// Without a controller D = -N = 1 - 1/z, which takes away what is constant. Its bytes are its snapshot.
class ScaleLines {
 public:
  using Complex = std::complex<double>;
  static constexpr std::size_t kLines = 14;
  static constexpr std::size_t kMaxOrder = 6;

  /// Sums over blocks, of each line.
  struct Line {
    Complex ae{}, be{}, ab{};  ///< a conj(e) ...
    double aa = 0.0, bb = 0.0, ee = 0.0;
    double blocks = 0.0;  ///< In the sums.
  };

  ScaleLines() = default;
  /// Orders at most kMaxOrder; empty: there is no controller.
  ScaleLines(double sample_rate_hz, std::span<const double> numerator, std::span<const double> denominator);

  /// One sample; finite.
  void step(double ru, double u, double y) noexcept;
  /// Samples are missing: blocks begin anew.
  void interrupt() noexcept;
  /// Forgets everything.
  void reset() noexcept;

  [[nodiscard]] const Line& operator[](std::size_t line) const noexcept { return sums_[line]; }
  [[nodiscard]] double frequency_hz(std::size_t line) const noexcept;
  /// N and D at a line.
  [[nodiscard]] Complex numerator(std::size_t line) const noexcept { return at(numerator_, line); }
  [[nodiscard]] Complex denominator(std::size_t line) const noexcept { return at(denominator_, line); }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return filled_ <= kMaxOrder; }

 private:
  using Polynomial = std::array<double, kMaxOrder + 1>;
  struct Block {
    std::uint32_t length = 1, n = 0;
    double keep = 0.0;  ///< Of the sums so far, when a block ends.
    Complex turn{1.0}, window_turn{1.0}, phasor{1.0}, window{1.0}, a{}, b{}, e{};
  };
  static void begin(Block& block) noexcept;
  static double push(Polynomial& past, const Polynomial& by, double newest) noexcept;
  [[nodiscard]] Complex at(const Polynomial& polynomial, std::size_t line) const noexcept;
  void end_block(std::size_t line) noexcept;

  double sample_rate_hz_ = 1.0;
  Polynomial numerator_{}, denominator_{}, torque_{}, excitation_{}, output_{};
  std::size_t filled_ = 0;
  std::array<Block, kLines> blocks_{};
  std::array<Line, kLines> sums_{};
};

}  // namespace resonid::monitoring
