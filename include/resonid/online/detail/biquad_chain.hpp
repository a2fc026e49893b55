// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <resonid/base/detail/intact.hpp>
#include <resonid/online/detail/control_config.hpp>
#include <span>

namespace resonid::online {

/// Biquads in series, in transposed direct form II, and their exchange for others while they run.
///
///   o = b0 x + s1,  s1 = b1 x - a1 o + s2,  s2 = b2 x - a2 o        (docs/methods/tune.md 16.1)
///
/// New biquads begin at rest under the newest input and run beside the old ones on the same input; after the
/// warm-up their share of the output goes from 0 to 1, linearly. No state is reset. Trivially copyable.
template <class Real, std::size_t Max>
class BiquadChain {
 public:
  /// At rest, with biquads that check_biquads() has found good.
  BiquadChain(std::span<const Biquad> biquads, double sample_rate_hz) noexcept {
    banks_[0].set(biquads, sample_rate_hz, Real(0));
  }

  Real step(Real x) noexcept {
    input_ = x;
    const Real old = active().step(x);
    if (remaining_ == 0) return old;
    const Real fresh = other().step(x);
    if (remaining_ > fade_) {
      --remaining_;
      return old;
    }
    if (--remaining_ > 0)
      return old + static_cast<Real>(fade_ - remaining_) / static_cast<Real>(fade_) * (fresh - old);
    second_ = !second_;
    return fresh;
  }
  /// Goes over to other biquads; not while exchanging(). `fade_samples` >= 1.
  void exchange(std::span<const Biquad> biquads, double sample_rate_hz, std::uint32_t warm_up_samples,
                std::uint32_t fade_samples) noexcept {
    other().set(biquads, sample_rate_hz, input_);
    fade_ = fade_samples;
    remaining_ = std::uint64_t{warm_up_samples} + fade_samples;
  }
  /// All states to 0; an exchange is over at once.
  void rest() noexcept {
    if (remaining_ > 0) second_ = !second_;
    remaining_ = 0;
    input_ = Real(0);
    for (Bank& bank : banks_)
      for (Section& s : bank.sections) s.s1 = s.s2 = Real(0);
  }

  [[nodiscard]] bool exchanging() const noexcept { return remaining_ > 0; }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return resonid::intact(second_) && fade_ > 0 && banks_[0].count <= Max && banks_[1].count <= Max;
  }

 private:
  struct Section {
    Real b0 = Real(1), b1 = Real(0), b2 = Real(0), a1 = Real(0), a2 = Real(0), s1 = Real(0), s2 = Real(0);
  };
  struct Bank {
    std::array<Section, Max> sections{};
    std::size_t count = 0;

    Real step(Real x) noexcept {
      for (std::size_t i = 0; i < count; ++i) {
        Section& s = sections[i];
        const Real o = s.b0 * x + s.s1;
        s.s1 = s.b1 * x - s.a1 * o + s.s2;
        s.s2 = s.b2 * x - s.a2 * o;
        x = o;
      }
      return x;
    }
    /// With the states of a constant input: each section then gives what it takes.
    void set(std::span<const Biquad> biquads, double sample_rate_hz, Real input) noexcept {
      count = biquads.size() < Max ? biquads.size() : Max;
      for (std::size_t i = 0; i < count; ++i) {
        const BiquadCoefficients c = coefficients_of(biquads[i], sample_rate_hz);
        Section& s = sections[i];
        s = {static_cast<Real>(c.b0), static_cast<Real>(c.b1), static_cast<Real>(c.b2),
             static_cast<Real>(c.a1), static_cast<Real>(c.a2)};
        s.s1 = (Real(1) - s.b0) * input;
        s.s2 = (s.b2 - s.a2) * input;
      }
    }
  };
  Bank& active() noexcept { return banks_[second_ ? 1 : 0]; }
  Bank& other() noexcept { return banks_[second_ ? 0 : 1]; }

  std::array<Bank, 2> banks_{};
  std::uint64_t remaining_ = 0;  // samples of the exchange, warm-up included
  std::uint32_t fade_ = 1;
  Real input_ = Real(0);
  bool second_ = false;
};

}  // namespace resonid::online
