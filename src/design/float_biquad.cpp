// SPDX-License-Identifier: MIT
#include "design/float_biquad.hpp"

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>

namespace resonid::design {

FloatBiquad float_biquad(const Biquad& biquad, double sample_time_s) {
  const auto exact = biquad.coefficients(sample_time_s);
  auto rounded = exact;
  for (auto* row : {&rounded.b, &rounded.a})
    for (double& c : *row) c = static_cast<double>(static_cast<float>(c));
  const auto error = [&](double phase) {
    const auto inverse_z = std::polar(1.0, -phase);
    return std::abs(rounded.at(inverse_z) / exact.at(inverse_z) - 1.0);
  };
  FloatBiquad found;
  found.dc_gain_error = error(0.0);
  found.largest_error = found.dc_gain_error;
  // A hundredth of the frequency upwards; below, it is the gain at standstill.
  constexpr int kLines = 4000;
  const double from = 0.01 * kTwoPi * biquad.frequency_hz * sample_time_s;
  for (int i = 0; i < kLines; ++i)
    found.largest_error =
        std::max(found.largest_error, error(from * std::pow(kPi / from, i / (kLines - 1.0))));
  const auto& a = rounded.a;
  found.stable = std::abs(a[2]) < 1.0 && std::abs(a[1]) < 1.0 + a[2];
  return found;
}

}  // namespace resonid::design
