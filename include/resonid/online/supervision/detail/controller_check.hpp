// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/base/expected.hpp>
#include <span>
#include <type_traits>

namespace resonid::online {

struct ControllerCheckConfig {
  double sample_rate_hz = 0.0;  ///< Rate at which step() is called, > 0.
  /// C that was told, u = C (r - y) + ru, in powers of z^-1; up to order 6.
  std::span<const double> numerator{}, denominator{};
  /// Where it matters: about from half the crossover to beyond the resonance; 0 < low < high < half the rate.
  double low_hz = 0.0, high_hz = 0.0;
};

/// Whether the controller that was told is the one that runs, from ru, u and y alone.
///
/// With C = N/D told and C* running, u - ru = C* (r - y). Multiplied out nothing integrates, and at a line
///
///   a = D (u - ru)     b = -N y     C*/C = sum A conj(Ru) / sum B conj(Ru)
///
/// with the phasors of Hann-windowed blocks of six periods, old blocks fading. Output noise is in a and b
/// alike, and what drives the loop beside ru (a reference, a load) does not correlate with it: the ratio is
/// consistent, and exact where the record obeys the controller. The residuals A - ratio B give its standard
/// deviation.
///
/// It differs when two lines of those that are known say so, by more than 5 % and four standard deviations.
/// Limits: needs an excitation that is measured; a line without excitation says nothing; a controller that
/// limits its output differs while it does. Source: the test is this project's.
template <class Real>
class ControllerCheck {
 public:
  using Scalar = Real;
  using Complex = std::complex<Real>;
  static constexpr std::size_t kLines = 8;
  static constexpr std::size_t kMaxOrder = 6;
  /// Difference over the controller's response that a margin shows.
  static constexpr double kRelevant = 0.05;
  static constexpr double kDeviations = 4.0;    ///< With eight lines looked at again and again.
  static constexpr std::size_t kWitnesses = 2;  ///< Lines.

  static expected<ControllerCheck, Error> create(const ControllerCheckConfig& c) {
    if (!(c.sample_rate_hz > 0.0) || !std::isfinite(c.sample_rate_hz))
      return refuse("sample_rate_hz", "must be > 0", c.sample_rate_hz);
    for (const auto& [x, name] : {std::pair(c.numerator, "numerator"), {c.denominator, "denominator"}}) {
      if (x.empty() || x.size() > kMaxOrder + 1)
        return refuse(name, "needs 1 ... 7 coefficients", static_cast<double>(x.size()));
      for (const double v : x)
        if (!std::isfinite(v)) return refuse(name, "must be finite", v);
    }
    if (c.denominator[0] == 0.0) return refuse("denominator", "must not begin with 0", 0.0);
    if (!(c.low_hz > 0.0)) return refuse("low_hz", "must be > 0", c.low_hz);
    if (!(c.high_hz > c.low_hz && c.high_hz < 0.5 * c.sample_rate_hz))
      return refuse("high_hz", "must lie between low_hz and half the sample rate", c.high_hz);
    return ControllerCheck(c);
  }

  void step(Real ru, Real u, Real y) noexcept {
    ++samples_;
    if (!std::isfinite(ru + u + y)) {
      ++skipped_;
      start_again();
      return;
    }
    const Real a = push(by_controller_, denominator_, u - ru);
    const Real b = -push(output_, numerator_, y);
    if (filled_ < kMaxOrder) {  // the products still hold what was not measured
      ++filled_;
      return;
    }
    for (Line& line : lines_) line.step(a, b, ru);
  }
  void miss(std::uint64_t count) noexcept {
    if (count == 0) return;
    samples_ += count;
    skipped_ += count;
    start_again();
  }
  void reset() noexcept {
    for (Line& line : lines_) line = line.anew();
    start_again();
    samples_ = skipped_ = 0;
  }

  /// Whether the told controller is not the one that runs.
  [[nodiscard]] bool differs() const noexcept {
    return static_cast<std::size_t>(std::count_if(lines_.begin(), lines_.end(),
                                                  [](const Line& l) { return l.differs(); })) >= kWitnesses;
  }
  /// Whether enough lines are known to say that it does, or that it does not.
  [[nodiscard]] bool ready() const noexcept {
    return static_cast<std::size_t>(std::count_if(lines_.begin(), lines_.end(),
                                                  [](const Line& l) { return l.known(); })) >= kWitnesses;
  }
  /// The largest difference of those lines that differ, over the told controller; 0 without any.
  [[nodiscard]] Real difference() const noexcept {
    Real largest = Real(0);
    for (const Line& l : lines_)
      if (l.differs()) largest = std::max(largest, std::abs(l.ratio() - Complex(1)));
    return largest;
  }
  [[nodiscard]] double frequency_hz(std::size_t line) const noexcept { return lines_[line].frequency_hz; }
  /// C*/C at a line; not a number before it has been seen.
  [[nodiscard]] Complex ratio(std::size_t line) const noexcept { return lines_[line].ratio(); }
  [[nodiscard]] Real standard_deviation(std::size_t line) const noexcept { return lines_[line].deviation(); }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return filled_ <= kMaxOrder; }

 private:
  static constexpr double kPeriods = 6.0;  // of a block
  static constexpr double kFewestSamples = 4.0;
  static constexpr Real kKeep = Real(0.97);   // of the older blocks
  static constexpr Real kFewest = Real(4.0);  // blocks
  using Polynomial = std::array<Real, kMaxOrder + 1>;

  struct Line {
    Line() = default;
    Line(double hz, double sample_rate_hz) noexcept
        : frequency_hz(hz),
          block(static_cast<std::uint32_t>(
              std::clamp(std::ceil(kPeriods * sample_rate_hz / hz), kFewestSamples, 1e9))),
          turn(turned(-kTwoPi * hz / sample_rate_hz)),
          window_turn(turned(kTwoPi / block)) {
      begin_block();
    }
    [[nodiscard]] Line anew() const noexcept {
      Line line;
      line.frequency_hz = frequency_hz;
      line.block = block;
      line.turn = turn;
      line.window_turn = window_turn;
      return line;
    }
    static Complex turned(double radians) noexcept {
      return {static_cast<Real>(std::cos(radians)), static_cast<Real>(std::sin(radians))};
    }

    void begin_block() noexcept {
      n = 0;
      phasor = Complex(1);
      window = turned(kPi / block);
      a = b = r = Complex(0);
    }
    void step(Real av, Real bv, Real rv) noexcept {
      const Complex w = (Real(1) - window.real()) * phasor;  // twice Hann's
      a += av * w;
      b += bv * w;
      r += rv * w;
      phasor *= turn;
      window *= window_turn;
      if (++n == block) end_block();
    }
    void end_block() noexcept {
      if (std::isfinite(std::norm(a) + std::norm(b) + std::norm(r))) {
        blocks = kKeep * blocks + Real(1);
        ar = kKeep * ar + a * std::conj(r);
        br = kKeep * br + b * std::conj(r);
        ab = kKeep * ab + a * std::conj(b);
        aa = kKeep * aa + std::norm(a);
        bb = kKeep * bb + std::norm(b);
        rr = kKeep * rr + std::norm(r);
      }
      begin_block();
    }
    [[nodiscard]] Complex ratio() const noexcept {
      return std::norm(br) > Real(0) ? ar / br : Complex(std::numeric_limits<Real>::quiet_NaN());
    }
    /// sqrt(E|error|^2); infinite for fewer blocks than tell.
    [[nodiscard]] Real deviation() const noexcept {
      if (!(blocks >= kFewest) || !(std::norm(br) > Real(0))) return std::numeric_limits<Real>::infinity();
      const Complex t = ratio();
      const Real left = std::max(Real(0), aa - Real(2) * (std::conj(t) * ab).real() + std::norm(t) * bb);
      return std::sqrt(left / (blocks - Real(1)) * rr / std::norm(br));
    }
    [[nodiscard]] bool known() const noexcept {
      return deviation() * static_cast<Real>(kDeviations) < static_cast<Real>(kRelevant);
    }
    [[nodiscard]] bool differs() const noexcept {
      const Real off = std::abs(ratio() - Complex(1));
      return off > static_cast<Real>(kRelevant) && off > static_cast<Real>(kDeviations) * deviation();
    }

    double frequency_hz = 0.0;
    std::uint32_t block = 1, n = 0;
    Complex turn{1}, window_turn{1}, phasor{1}, window{1}, a{}, b{}, r{};  // of the running block
    Complex ar{}, br{}, ab{};                                              // sums over blocks
    Real aa{}, bb{}, rr{}, blocks{};
  };

  explicit ControllerCheck(const ControllerCheckConfig& c) noexcept {
    for (std::size_t i = 0; i < c.numerator.size(); ++i)
      numerator_[i] = static_cast<Real>(c.numerator[i] / c.denominator[0]);
    for (std::size_t i = 0; i < c.denominator.size(); ++i)
      denominator_[i] = static_cast<Real>(c.denominator[i] / c.denominator[0]);
    for (std::size_t i = 0; i < kLines; ++i) {
      const double part = static_cast<double>(i) / static_cast<double>(kLines - 1);
      const double hz = c.low_hz * std::pow(c.high_hz / c.low_hz, part);
      lines_[i] = Line(hz, c.sample_rate_hz);
    }
  }

  static Real push(Polynomial& past, const Polynomial& by, Real newest) noexcept {
    for (std::size_t i = kMaxOrder; i > 0; --i) past[i] = past[i - 1];
    past[0] = newest;
    Real sum = Real(0);
    for (std::size_t i = 0; i <= kMaxOrder; ++i) sum += by[i] * past[i];
    return sum;
  }
  void start_again() noexcept {
    filled_ = 0;
    for (Line& line : lines_) line.begin_block();
  }

  std::array<Line, kLines> lines_{};
  Polynomial numerator_{}, denominator_{}, by_controller_{}, output_{};
  std::size_t filled_ = 0;
  std::uint64_t samples_ = 0, skipped_ = 0;
};

static_assert(std::is_trivially_copyable_v<ControllerCheck<double>>);
static_assert(std::is_trivially_copyable_v<ControllerCheck<float>>);

}  // namespace resonid::online
