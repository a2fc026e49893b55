// SPDX-License-Identifier: MIT
#include "response/spectra/side_noise.hpp"

#include <algorithm>
#include <complex>
#include <resonid/base/constants.hpp>

namespace resonid::response {
namespace {

using Complex = std::complex<double>;

/// The residual turned back by the line's phase, `block` samples summed to one: [block, signal].
Eigen::MatrixX3cd demodulated(const Carrier& line, const Eigen::MatrixX3d& residual,
                              const Eigen::VectorXd& weights, Eigen::Index block) {
  const Eigen::Index samples = weights.size();
  Eigen::MatrixX3cd sums((samples + block - 1) / block, 3);
  const Eigen::Map<const Eigen::ArrayXd> cosine(line.cosine.data(), samples), sine(line.sine.data(), samples);
  for (Eigen::Index i = 0; i < sums.rows(); ++i) {
    const Eigen::Index first = i * block, count = std::min(block, samples - first);
    const auto part = residual.middleRows(first, count);
    const Eigen::VectorXd weight = weights.segment(first, count);
    const Eigen::VectorXd in_phase = weight.array() * cosine.segment(first, count);
    const Eigen::VectorXd beside = weight.array() * sine.segment(first, count);
    for (Eigen::Index x = 0; x < 3; ++x) sums(i, x) = {in_phase.dot(part.col(x)), -beside.dot(part.col(x))};
  }
  return sums;
}

}  // namespace

SideNoise noise_beside(const Carrier& line, double sample_time_s, double frequency_hz,
                       const Eigen::MatrixX3d& residual, const Eigen::VectorXd& weights, double nearest_hz,
                       double farthest_hz) {
  constexpr int kOffsets = 4;
  constexpr double kStill = 0.02;  // rad within a block: takes 2e-5 off an amplitude
  SideNoise noise;
  const double nyquist_hz = 0.5 / sample_time_s;
  const auto block =
      std::max<Eigen::Index>(1, static_cast<Eigen::Index>(kStill / (kTwoPi * farthest_hz * sample_time_s)));
  const Eigen::MatrixX3cd sums = demodulated(line, residual, weights, block);
  for (int side = -1; side <= 1; side += 2)
    for (int i = 0; i < kOffsets; ++i) {
      const double offset_hz = side * (nearest_hz + (farthest_hz - nearest_hz) * i / (kOffsets - 1.0));
      // As far from 0 and from the image beyond half the sample rate as from the line itself.
      if (frequency_hz + offset_hz < nearest_hz || frequency_hz + offset_hz > nyquist_hz - nearest_hz)
        continue;
      // In real numbers: every product of complex ones is tested for NaN.
      const Complex turn = std::polar(1.0, -kTwoPi * offset_hz * sample_time_s * static_cast<double>(block));
      double cosine = 1.0, sine = 0.0;
      Eigen::Array3d in_phase = Eigen::Array3d::Zero(), beside = in_phase;
      for (Eigen::Index n = 0; n < sums.rows(); ++n) {
        const Eigen::Array3d real = sums.row(n).real().transpose().array();
        const Eigen::Array3d imaginary = sums.row(n).imag().transpose().array();
        in_phase += cosine * real - sine * imaginary;
        beside += sine * real + cosine * imaginary;
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
