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
      // In real numbers: every product of complex ones is tested for NaN.
      const Complex turn = std::polar(1.0, -kTwoPi * offset_hz * sample_time_s);
      double cosine = 1.0, sine = 0.0;
      Eigen::Array3d in_phase = Eigen::Array3d::Zero(), beside = in_phase;
      for (Eigen::Index n = 0; n < weights.size(); ++n) {
        const Complex& c = carrier[static_cast<std::size_t>(n)];
        in_phase += (c.real() * cosine - c.imag() * sine) * residual.row(n).transpose().array();
        beside += (c.real() * sine + c.imag() * cosine) * residual.row(n).transpose().array();
        const double turned = cosine * turn.real() - sine * turn.imag();
        sine = cosine * turn.imag() + sine * turn.real();
        cosine = turned;
      }
      const Eigen::Vector3cd bin = in_phase + Complex(0.0, 1.0) * beside;
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
