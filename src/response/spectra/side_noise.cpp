// SPDX-License-Identifier: MIT
#include "response/spectra/side_noise.hpp"

#include <complex>
#include <resonid/base/constants.hpp>
#include <vector>

namespace resonid::response {
namespace {

using Complex = std::complex<double>;

}  // namespace

SideNoise noise_beside(std::span<const double> phase_rad, double sample_time_s, double frequency_hz,
                       const Eigen::MatrixX3d& residual, const Eigen::VectorXd& weights, double nearest_hz,
                       double farthest_hz) {
  constexpr int kOffsets = 4;
  SideNoise noise;
  const double nyquist_hz = 0.5 / sample_time_s;
  std::vector<Complex> carrier;  // what all offsets have in common: sines are what this costs
  for (Eigen::Index n = 0; n < weights.size(); ++n)
    carrier.push_back(std::polar(weights(n), -phase_rad[static_cast<std::size_t>(n)]));
  for (int side = -1; side <= 1; side += 2)
    for (int i = 0; i < kOffsets; ++i) {
      const double offset_hz = side * (nearest_hz + (farthest_hz - nearest_hz) * i / (kOffsets - 1.0));
      // As far from 0 and from the image beyond half the sample rate as from the line itself.
      if (frequency_hz + offset_hz < nearest_hz || frequency_hz + offset_hz > nyquist_hz - nearest_hz)
        continue;
      Eigen::Vector3cd bin = Eigen::Vector3cd::Zero();
      const Complex turn = std::polar(1.0, -kTwoPi * offset_hz * sample_time_s);
      Complex turned = 1.0;
      for (Eigen::Index n = 0; n < weights.size(); ++n, turned *= turn) {
        const Complex at = carrier[static_cast<std::size_t>(n)] * turned;
        for (Eigen::Index s = 0; s < 3; ++s) bin(s) += residual(n, s) * at;
      }
      noise.density += bin * bin.adjoint() / weights.squaredNorm();
      noise.averages += 1.0;
    }
  if (noise.averages > 0.0) {
    noise.density /= noise.averages;
    return noise;
  }
  const Eigen::Matrix3d white = residual.transpose() * residual / static_cast<double>(residual.rows());
  noise.density = white.cast<Complex>();
  noise.averages = 0.5 * static_cast<double>(residual.rows());
  return noise;
}

}  // namespace resonid::response
