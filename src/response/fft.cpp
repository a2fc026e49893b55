// SPDX-License-Identifier: MIT
#include "response/fft.hpp"

#include <resonid/base/constants.hpp>
#include <unsupported/Eigen/FFT>

namespace resonid::response {
namespace {

Eigen::FFT<double>& engine() {
  thread_local Eigen::FFT<double> fft(Eigen::default_fft_impl<double>(), Eigen::FFT<double>::HalfSpectrum);
  return fft;  // keeps its twiddle tables between calls
}

using Complex = std::complex<double>;

/// Whether the library's transform is fast: all prime factors at most 31. The period of a maximum-length PRBS
/// often is a prime itself (8191, 131071), and a plain transform of that length takes its square.
bool smooth(std::size_t length) {
  for (std::size_t factor = 2; factor <= 31; ++factor)
    while (length % factor == 0) length /= factor;
  return length == 1;
}

/// Bluestein's chirp transform: a transform of any length as a convolution of one that is a power of two,
///   X(k) = c(k) sum_n (x(n) c(n)) c*(k - n),   c(n) = exp(-j pi n^2/N)
/// Source: Bluestein 1970, IEEE Trans. Audio Electroacoustics 18(4).
std::vector<Complex> chirp_transform(std::span<const double> samples) {
  const std::size_t n = samples.size();
  std::size_t length = 1;
  while (length < 2 * n) length *= 2;
  std::vector<Complex> chirp(n), a(length), b(length), product(length);
  for (std::size_t i = 0; i < n; ++i)  // n^2 modulo 2N is exact, so the phase is
    chirp[i] = std::polar(1.0, -kPi * static_cast<double>(i * i % (2 * n)) / static_cast<double>(n));
  for (std::size_t i = 0; i < n; ++i) a[i] = samples[i] * chirp[i];
  b[0] = std::conj(chirp[0]);
  for (std::size_t i = 1; i < n; ++i) b[i] = b[length - i] = std::conj(chirp[i]);
  thread_local Eigen::FFT<double> fft;
  std::vector<Complex> spectrum(length);
  const auto size = static_cast<Eigen::Index>(length);
  fft.fwd(spectrum.data(), a.data(), size);
  fft.fwd(product.data(), b.data(), size);
  for (std::size_t i = 0; i < length; ++i) product[i] *= spectrum[i];
  fft.inv(a.data(), product.data(), size);
  std::vector<Complex> bins(n / 2 + 1);
  for (std::size_t k = 0; k < bins.size(); ++k) bins[k] = chirp[k] * a[k];
  return bins;
}

}  // namespace

std::vector<std::complex<double>> half_spectrum(std::span<const double> samples) {
  if (!smooth(samples.size()) && samples.size() > 64) return chirp_transform(samples);
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
  for (std::size_t length = samples; length > 1; --length)
    if (smooth(length)) return length;
  return samples;
}

}  // namespace resonid::response
