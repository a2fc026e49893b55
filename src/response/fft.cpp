// SPDX-License-Identifier: MIT
#include "response/fft.hpp"

#include <unsupported/Eigen/FFT>

namespace resonid::response {
namespace {

Eigen::FFT<double>& engine() {
  thread_local Eigen::FFT<double> fft(Eigen::default_fft_impl<double>(), Eigen::FFT<double>::HalfSpectrum);
  return fft;  // keeps its twiddle tables between calls
}

}  // namespace

std::vector<std::complex<double>> half_spectrum(std::span<const double> samples) {
  std::vector<std::complex<double>> bins(samples.size() / 2 + 1);
  if (samples.size() < 2) return bins;
  engine().fwd(bins.data(), samples.data(), static_cast<Eigen::Index>(samples.size()));
  return bins;
}

std::vector<double> from_half_spectrum(const std::vector<std::complex<double>>& spectrum,
                                       std::size_t samples) {
  std::vector<double> values(samples);
  engine().inv(values.data(), spectrum.data(), static_cast<Eigen::Index>(samples));
  return values;
}

std::size_t fast_length(std::size_t samples) {
  for (std::size_t length = samples; length > 1; --length) {
    std::size_t rest = length;
    for (std::size_t factor = 2; factor <= 31; ++factor)
      while (rest % factor == 0) rest /= factor;
    if (rest == 1) return length;
  }
  return samples;
}

}  // namespace resonid::response
