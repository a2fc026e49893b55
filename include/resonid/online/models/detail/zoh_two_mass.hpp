// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace resonid::online {

/// Two inertias joined by a spring and a damper, referred to the driven shaft (Nevaranta 2016, eqs. 2.1-2.3,
/// r1 = r2 = 1; linear machines: kg, N/m, Ns/m).
template <class Real>
struct TwoMassPoint {
  Real driven_inertia{};    ///< J1, kgm2
  Real load_inertia{};      ///< J2, kgm2
  Real stiffness{};         ///< K, Nm/rad
  Real damping{};           ///< D, Nms/rad
  Real viscous_friction{};  ///< B, Nms/rad, on the driven side
};

/// Exact zero-order hold of a two-mass drive over a time step, with its derivatives.
///
///   x' = Ac x + bc T,   x = [v1, v2, w0 (p1 - p2)],   x(t + h) = A x(t) + b T,   [A b; 0 1] = exp([Ac bc; 0
///   0] h)
///
/// w0 is a constant that only scales the twist. Derivatives by ln J1, ln J2, ln K, ln D and B are those of
/// the exponential's Taylor series and of its squarings (Frechet derivative).
template <class Real>
struct ZohTwoMass {
  static constexpr std::size_t kStates = 3;
  static constexpr std::size_t kDerivatives = 5;
  using Block = std::array<std::array<Real, kStates + 1>, kStates>;  // [row][column], column 3 is b

  Block ab{};                                ///< [A b]
  std::array<Block, kDerivatives> by_log{};  ///< d[A b] / d(ln J1, ln J2, ln K, ln D, B)

  /// `derivatives`: how many of them, in the order above; the others are 0.
  static ZohTwoMass over(const TwoMassPoint<Real>& p, Real twist_scale_rad_s, Real step_s,
                         std::size_t derivatives = kDerivatives) noexcept {
    std::array<Block, kDerivatives + 1> x{};  // continuous matrices times the step: value, derivatives
    const Real j1 = step_s / p.driven_inertia;
    const Real j2 = step_s / p.load_inertia;
    const Real spring = p.stiffness / twist_scale_rad_s;
    x[0] = {{{-(p.damping + p.viscous_friction) * j1, p.damping * j1, -spring * j1, j1},
             {p.damping * j2, -p.damping * j2, spring * j2, Real(0)},
             {twist_scale_rad_s * step_s, -twist_scale_rad_s * step_s, Real(0), Real(0)}}};
    for (std::size_t j = 0; j < 4; ++j) {
      x[1][0][j] = -x[0][0][j];
      x[2][1][j] = -x[0][1][j];
    }
    x[3][0][2] = x[0][0][2];
    x[3][1][2] = x[0][1][2];
    x[4][0] = {-p.damping * j1, p.damping * j1, Real(0), Real(0)};
    x[4][1] = {p.damping * j2, -p.damping * j2, Real(0), Real(0)};
    x[5][0][0] = -j1;

    int squarings = 0;
    for (Real norm = norm_of(x[0]); norm > Real(0.5) && squarings < 60; norm *= Real(0.5)) ++squarings;
    const Real scale = std::ldexp(Real(1), -squarings);
    for (auto& block : x)
      for (auto& row : block)
        for (Real& entry : row) entry *= scale;

    std::array<Block, kDerivatives + 1> e{};
    for (std::size_t i = 0; i < kStates; ++i) e[0][i][i] = Real(1);
    for (int k = kTerms; k >= 1; --k) {  // Horner: I + X/1 (I + X/2 (I + ...))
      const Real inverse = Real(1) / static_cast<Real>(k);
      multiply_from_left(x, e, derivatives);
      for (std::size_t d = 0; d <= derivatives; ++d)
        for (auto& row : e[d])
          for (Real& entry : row) entry *= inverse;
      for (std::size_t i = 0; i < kStates; ++i) e[0][i][i] += Real(1);
    }
    for (int s = 0; s < squarings; ++s) {
      const auto half = e;
      multiply_from_left(half, e, derivatives);
    }
    ZohTwoMass zoh;
    zoh.ab = e[0];
    std::copy_n(e.begin() + 1, kDerivatives, zoh.by_log.begin());
    return zoh;
  }

 private:
  static constexpr int kTerms = sizeof(Real) > 4 ? 10 : 7;  // left out: 0.5^11/11! = 1e-11, 0.5^8/8! = 1e-7

  /// Value and derivatives of the product l e, in place of e.
  static void multiply_from_left(const std::array<Block, kDerivatives + 1>& l,
                                 std::array<Block, kDerivatives + 1>& e, std::size_t derivatives) noexcept {
    for (std::size_t d = 1; d <= derivatives; ++d) e[d] = sum(product(l[d], e[0], l[d]), linear(l[0], e[d]));
    e[0] = product(l[0], e[0], l[0]);
  }
  /// Upper rows of [l; 0] [r; 0 1]: the last column of `l` passes through.
  static Block product(const Block& l, const Block& r, const Block& last) noexcept {
    Block p = linear(l, r);
    for (std::size_t i = 0; i < kStates; ++i) p[i][kStates] += last[i][kStates];
    return p;
  }
  static Block linear(const Block& l, const Block& r) noexcept {
    Block p;
    for (std::size_t i = 0; i < kStates; ++i)
      for (std::size_t j = 0; j < kStates + 1; ++j)
        p[i][j] = l[i][0] * r[0][j] + l[i][1] * r[1][j] + l[i][2] * r[2][j];
    return p;
  }
  static Block sum(Block a, const Block& b) noexcept {
    for (std::size_t i = 0; i < kStates; ++i)
      for (std::size_t j = 0; j < kStates + 1; ++j) a[i][j] += b[i][j];
    return a;
  }
  static Real norm_of(const Block& x) noexcept {
    Real norm(0);
    for (const auto& row : x) {
      Real total(0);
      for (const Real entry : row) total += std::abs(entry);
      norm = std::max(norm, total);
    }
    return norm;
  }
};

}  // namespace resonid::online
