// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <resonid/base/detail/polynomial.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <type_traits>
#include <utility>

namespace resonid::online {

/// An oscillation of a model, or of its inverse: undamped frequency |s|/2 pi and damping ratio -Re s/|s| of
/// the continuous pole or zero s.
struct DiscreteMode {
  double frequency_hz = 0.0;
  double damping_ratio = 0.0;
  double std_hz = std::numeric_limits<double>::infinity();  ///< Infinite without a covariance.
};

/// In ascending order of frequency; empty where a model does not oscillate.
template <std::size_t Max>
struct DiscreteModes {
  std::array<DiscreteMode, std::max<std::size_t>(Max, 1)> mode{};
  std::size_t count = 0;

  [[nodiscard]] bool empty() const noexcept { return count == 0; }
  [[nodiscard]] const DiscreteMode& operator[](std::size_t i) const noexcept { return mode[i]; }
};

/// Poles and zeros of a sampled drive as the continuous machine has them.
///
///   G(z) = sum rho_i/(z - z_i) is the zero-order-hold equivalent of
///   G(s) = sum R_i/(s - p_i)  with  p_i = ln(z_i)/Ts,  R_i = rho_i p_i/(z_i - 1)
///
/// so that resonances are the p_i, and anti-resonances the s with G(s) = 0: exact, unlike the logarithm of
/// the sampled zeros, which misses a resonance at a quarter of the sample rate by several per cent. Standard
/// deviations by the delta method with exact derivatives. Limit: distinct poles, none on the negative real
/// axis, for which there is no continuous machine; there the logarithm of the sampled zero is taken.
template <std::size_t Order>
class SampledModes {
 public:
  static constexpr std::size_t kPairs = Order / 2;
  using Complex = std::complex<double>;
  using Gradient = std::array<Complex, 2 * Order>;  ///< By b_1 ... b_n, a_1 ... a_n.

  template <class Real>
  SampledModes(const DiscreteModel<Real, Order>& model, double sample_rate_hz) noexcept
      : sample_rate_hz_(sample_rate_hz) {
    for (std::size_t i = 0; i < Order; ++i) {
      b_[i] = static_cast<double>(model.b[i]);
      a_[i] = static_cast<double>(model.a[i]);
    }
    finite_ = true;
    for (std::size_t i = 0; i < Order; ++i) finite_ = finite_ && std::isfinite(a_[i]) && std::isfinite(b_[i]);
    if (finite_) pole_ = roots<Order>(a_);
  }

  /// Poles in the z plane.
  [[nodiscard]] const Roots<Order>& poles() const noexcept { return pole_; }

  [[nodiscard]] DiscreteModes<kPairs> resonances() const noexcept { return resonances(nullptr); }
  template <class Real>
  [[nodiscard]] DiscreteModes<kPairs> resonances(
      const ModelCovariance<Real, Order>& covariance) const noexcept {
    if constexpr (std::is_same_v<Real, double>) {
      return resonances(&covariance);
    } else {
      const Square c = covariance.template cast<double>();
      return resonances(&c);
    }
  }
  [[nodiscard]] DiscreteModes<kPairs> antiresonances() const noexcept { return antiresonances(nullptr); }
  template <class Real>
  [[nodiscard]] DiscreteModes<kPairs> antiresonances(
      const ModelCovariance<Real, Order>& covariance) const noexcept {
    if constexpr (std::is_same_v<Real, double>) {
      return antiresonances(&covariance);
    } else {
      const Square c = covariance.template cast<double>();
      return antiresonances(&c);
    }
  }

  /// The model of the machine whose first resonance lies higher by `factor`, with the same damping ratio and
  /// the same masses: what a stiffness does that changes. Itself where nothing oscillates.
  [[nodiscard]] DiscreteModel<double, Order> with_first_resonance_scaled(double factor) const noexcept {
    DiscreteModel<double, Order> m{b_, a_};
    std::size_t first = Order;
    for (std::size_t i = 0; finite_ && i < Order; ++i)
      if (pole_[i].imag() > 0.0 &&
          (first == Order || std::abs(std::log(pole_[i])) < std::abs(std::log(pole_[first]))))
        first = i;
    const Expansion e = expand();
    if (first == Order || !e.continuous) return m;
    Roots<Order> moved = pole_;
    for (const std::size_t i : {first, first + 1}) moved[i] = std::exp(std::log(pole_[i]) * factor);
    m.a = from_roots<Order>(moved);
    std::array<Complex, Order> b{};
    for (std::size_t i = 0; i < Order; ++i) {
      const auto product = without(moved, i);
      for (std::size_t l = 0; l < Order; ++l) b[l] += e.residue[i] / zoh_factor(moved[i]) * product[l];
    }
    for (std::size_t l = 0; l < Order; ++l) m.b[l] = b[l].real();
    return m;
  }

  /// Gradient of the undamped frequency of the first resonance, in Hz; all 0 where there is none.
  [[nodiscard]] std::array<double, 2 * Order> resonance_gradient() const noexcept {
    std::array<double, 2 * Order> gradient{};
    double lowest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; finite_ && i < Order; ++i) {
      if (!(pole_[i].imag() > 0.0)) continue;
      const Complex s = std::log(pole_[i]) * sample_rate_hz_;
      if (!(std::abs(s) < lowest)) continue;
      lowest = std::abs(s);
      gradient = frequency_gradient(s, continuous(pole_gradient(i), pole_[i]));
    }
    return gradient;
  }

 private:
  using Square = ModelCovariance<double, Order>;

  [[nodiscard]] DiscreteModes<kPairs> resonances(const Square* covariance) const noexcept {
    DiscreteModes<kPairs> modes;
    for (std::size_t i = 0; finite_ && i < Order; ++i)
      if (pole_[i].imag() > 0.0)
        insert(modes, std::log(pole_[i]) * sample_rate_hz_, continuous(pole_gradient(i), pole_[i]),
               covariance);
    return modes;
  }

  [[nodiscard]] DiscreteModes<kPairs> antiresonances(const Square* covariance) const noexcept {
    DiscreteModes<kPairs> modes;
    if constexpr (Order >= 2) {
      if (!finite_ || !(std::abs(b_[0]) > 0.0)) return modes;
      const Expansion e = expand();
      const Roots<Order - 1> zero = e.continuous ? continuous_zeros(e) : sampled_zeros();
      for (const Complex& s : zero)
        if (s.imag() > 0.0 && std::isfinite(std::abs(s)))
          insert(modes, s, e.continuous ? zero_gradient(e, s) : sampled_zero_gradient(s), covariance);
    }
    return modes;
  }

  /// dz_i by the parameters: A(z_i) = 0.
  [[nodiscard]] Gradient pole_gradient(std::size_t i) const noexcept {
    Gradient gradient{};
    const Complex z = pole_[i], slope = monic_slope<Order>(a_, z);
    Complex power = 1.0;
    for (std::size_t j = Order; j-- > 0; power *= z) gradient[Order + j] = -power / slope;
    return gradient;
  }
  /// From z to s = ln(z) fs.
  [[nodiscard]] Gradient continuous(Gradient gradient, Complex z) const noexcept {
    for (Complex& g : gradient) g *= sample_rate_hz_ / z;
    return gradient;
  }

  /// Partial fractions of both responses; R carries the factor fs, which no zero depends on.
  struct Expansion {
    std::array<Complex, Order> p{}, residue{};  // of the continuous machine
    std::array<Gradient, Order> dp{}, dresidue{};
    bool continuous = true;
  };
  [[nodiscard]] Expansion expand() const noexcept {
    Expansion e;
    for (std::size_t i = 0; i < Order; ++i) {
      const Complex z = pole_[i];
      if (z.imag() == 0.0 && !(z.real() > 0.0)) e.continuous = false;
      if (!e.continuous) return e;
      const auto [zero, slope, bend] = with_derivatives<2, Order>(1.0, a_, z);
      const auto [value, tilt] = with_derivatives<1, Order>(0.0, b_, z);
      const Complex rho = value / slope;
      const Complex zoh = zoh_factor(z), zoh_slope = (1.0 / z - zoh) / off_one(z);
      e.p[i] = std::log(z) * sample_rate_hz_;
      e.residue[i] = rho * zoh;
      const Gradient dz = pole_gradient(i);
      Complex power = 1.0, power_slope = 0.0;  // z^(n-j) and its derivative
      for (std::size_t j = Order; j-- > 0;) {
        const Complex db = (power + tilt * dz[j]) / slope;  // dz by b is 0
        e.dresidue[i][j] = zoh * db;
        const Complex da = (tilt * dz[Order + j] - rho * (power_slope + bend * dz[Order + j])) / slope;
        e.dresidue[i][Order + j] = zoh * da + rho * (near_one(z) ? Complex(-0.5) : zoh_slope) * dz[Order + j];
        power_slope = power_slope * z + power;
        power *= z;
      }
      e.dp[i] = continuous(dz, z);
    }
    return e;
  }
  static bool near_one(Complex z) noexcept { return std::abs(z - 1.0) < 1e-5; }
  static Complex off_one(Complex z) noexcept { return near_one(z) ? Complex(1.0) : z - 1.0; }
  /// ln(z)/(z - 1), which is 1 for an integrator.
  static Complex zoh_factor(Complex z) noexcept {
    const Complex x = z - 1.0;
    return near_one(z) ? 1.0 - 0.5 * x : std::log(z) / x;
  }

  /// prod_{j != i} (x - x_j), highest power first.
  static std::array<Complex, Order> without(const std::array<Complex, Order>& x, std::size_t i) noexcept {
    std::array<Complex, Order> product{};
    product[0] = 1.0;
    for (std::size_t j = 0; j < Order; ++j) {
      if (j == i) continue;
      for (std::size_t l = Order - 1; l > 0; --l) product[l] -= x[j] * product[l - 1];
    }
    return product;
  }
  /// Roots of sum_i R_i prod_{j != i} (s - p_j).
  [[nodiscard]] Roots<Order - 1> continuous_zeros(const Expansion& e) const noexcept {
    std::array<Complex, Order> sum{};
    for (std::size_t i = 0; i < Order; ++i) {
      const auto product = without(e.p, i);
      for (std::size_t l = 0; l < Order; ++l) sum[l] += e.residue[i] * product[l];
    }
    // A two-mass drive's numerator is of second order in s, s^2 being the highest power for n = 3. In units
    // of the sample rate, so that the roots are of size 1.
    Monic<Order - 1> monic;
    double scale = 1.0;
    for (std::size_t l = 1; l < Order; ++l) {
      scale *= sample_rate_hz_;
      monic[l - 1] = (sum[l] / sum[0]).real() / scale;
    }
    auto zero = roots<Order - 1>(monic);
    for (Complex& s : zero) s *= sample_rate_hz_;
    return zero;
  }
  /// G(s) = 0 gives ds = -dG/G'(s).
  [[nodiscard]] Gradient zero_gradient(const Expansion& e, Complex s) const noexcept {
    Gradient gradient{};
    Complex slope = 0.0;
    for (std::size_t i = 0; i < Order; ++i) {
      const Complex x = 1.0 / (s - e.p[i]);
      slope -= e.residue[i] * x * x;
      for (std::size_t j = 0; j < 2 * Order; ++j)
        gradient[j] += x * (e.dresidue[i][j] + e.residue[i] * x * e.dp[i][j]);
    }
    for (Complex& g : gradient) g /= -slope;
    return gradient;
  }

  [[nodiscard]] Monic<Order - 1> numerator() const noexcept {
    Monic<Order - 1> monic;
    for (std::size_t i = 0; i + 1 < Order; ++i) monic[i] = b_[i + 1] / b_[0];
    return monic;
  }
  [[nodiscard]] Roots<Order - 1> sampled_zeros() const noexcept {
    auto zero = roots<Order - 1>(numerator());
    for (Complex& z : zero) z = z != 0.0 ? std::log(z) * sample_rate_hz_ : Complex();
    return zero;
  }
  [[nodiscard]] Gradient sampled_zero_gradient(Complex s) const noexcept {
    Gradient gradient{};
    const Complex z = std::exp(s / sample_rate_hz_);
    const Complex slope = b_[0] * monic_slope<Order - 1>(numerator(), z);
    Complex power = 1.0;
    for (std::size_t j = Order; j-- > 0; power *= z) gradient[j] = -power / slope;
    return continuous(gradient, z);
  }

  [[nodiscard]] static std::array<double, 2 * Order> frequency_gradient(Complex s,
                                                                        const Gradient& ds) noexcept {
    std::array<double, 2 * Order> gradient;
    for (std::size_t j = 0; j < 2 * Order; ++j)
      gradient[j] = (std::conj(s) * ds[j]).real() / (std::abs(s) * kTwoPi);
    return gradient;
  }

  static void insert(DiscreteModes<kPairs>& modes, Complex s, const Gradient& ds,
                     const Square* covariance) noexcept {
    if (modes.count >= kPairs) return;
    DiscreteMode m;
    m.frequency_hz = std::abs(s) / kTwoPi;
    m.damping_ratio = -s.real() / std::abs(s);
    if (covariance != nullptr) {
      const auto gradient = frequency_gradient(s, ds);
      const Eigen::Map<const Eigen::Matrix<double, static_cast<int>(2 * Order), 1>> g(gradient.data());
      const double variance = g.dot(*covariance * g);
      if (std::isfinite(variance)) m.std_hz = std::sqrt(std::max(0.0, variance));
    }
    modes.mode[modes.count++] = m;
    for (std::size_t i = kPairs - 1; i > 0; --i)
      if (i < modes.count && modes.mode[i - 1].frequency_hz > modes.mode[i].frequency_hz)
        std::swap(modes.mode[i - 1], modes.mode[i]);
  }

  std::array<double, Order> b_{}, a_{};
  Roots<Order> pole_{};
  double sample_rate_hz_;
  bool finite_ = false;
};

}  // namespace resonid::online
