// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <limits>

#include "design/closed_loop.hpp"
#include "design/first_sign_change.hpp"
#include "design/rational_response.hpp"

// One line of a measured response, known to a disk, in a loop (docs/methods/tune.md 7.7).
namespace resonid::design {

/// What a line asks of the gains: C = (kp + ki q) F, 1 + L = 1 + (kp + ki q) m, m = F G.
struct DiskLine {
  double frequency_hz = 0.0;
  std::complex<double> filter, integrator, measured;
  double radius = 0.0;  ///< Of m: rho |F|.
  double load = 0.0;    ///< |N|
};

/// The values of 1 + L and C of a line whose response lies anywhere in its disk.
struct DiskLoop {
  std::complex<double> returned;  ///< 1 + L at the centre.
  double reach = 0.0;             ///< rho |C|
  double controller = 0.0;        ///< |C|
  double load = 0.0;

  DiskLoop(const DiskLine& line, double kp, double ki) : load(line.load) {
    const std::complex<double> pi = kp + ki * line.integrator;
    returned = 1.0 + plain_product(pi, line.measured);
    reach = std::abs(pi) * line.radius;
    controller = std::abs(plain_product(pi, line.filter));
  }

  /// The largest over the disk: 1/(1 + L) of a disk is a disk.
  [[nodiscard]] double size_of(Transfer transfer) const {
    const double distance = std::abs(returned), least = distance - reach;
    if (!(least > 0.0)) return std::numeric_limits<double>::infinity();
    const double square = least * (distance + reach);
    const std::complex<double> centre = std::conj(returned) / square;
    const double around = reach / square;
    switch (transfer) {
      case Transfer::sensitivity:
        return 1.0 / least;
      case Transfer::complementary:
        return std::abs(1.0 - centre) + around;
      case Transfer::load_transfer:
        return load * (std::abs(1.0 - centre) + around);
      case Transfer::controller_sensitivity:
        return controller / least;
      default:
        return std::abs(2.0 * centre - 1.0) + 2.0 * around;
    }
  }
};

/// Where |1 + L| - rho |C| falls below `least` at a line, by the quartic
/// (a^2 - e^2 - m^2)^2 = 4 e^2 m^2, a^2 = |x0 + x x1|^2, e^2 = |e0 + x e1|^2: over x, kp or ki.
inline double first_exceeding(const std::complex<double>& x0, const std::complex<double>& x1,
                              const std::complex<double>& e0, const std::complex<double>& e1, double least) {
  const double scale = std::abs(x1);  // x in units in which it moves L by 1
  if (!(scale > 0.0)) return std::numeric_limits<double>::infinity();
  const auto squares = [scale](const std::complex<double>& c0, const std::complex<double>& c1) {
    return std::array{square_of(c0), 2.0 * (std::conj(c0) * c1).real() / scale,
                      square_of(c1) / (scale * scale)};
  };
  const auto a = squares(x0, x1), e = squares(e0, e1);
  const double square = least * least;
  const std::array base = {a[0] - e[0] - square, a[1] - e[1], a[2] - e[2]};
  if (base[0] < 0.0 || base[0] < 2.0 * least * std::sqrt(e[0])) return 0.0;
  // Without an uncertainty worth the name the quartic is a square, which does not change its sign.
  constexpr double kExact = 1e-14;
  if (least == 0.0 || e[0] + e[2] < kExact) return first_sign_change(base) / scale;
  const std::array quartic = {base[0] * base[0] - 4.0 * square * e[0],
                              2.0 * base[0] * base[1] - 4.0 * square * e[1],
                              base[1] * base[1] + 2.0 * base[0] * base[2] - 4.0 * square * e[2],
                              2.0 * base[1] * base[2], base[2] * base[2]};
  return first_sign_change(quartic) / scale;
}

}  // namespace resonid::design
