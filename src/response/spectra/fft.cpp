// SPDX-License-Identifier: MIT
#include "response/spectra/fft.hpp"

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
/// Source: Bluestein 1970.
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

/// Two numbers in the lanes of a vector register, for the transform of two signals at once: all that the
/// library asks of a scalar.
struct Lanes {
  using Vector = double __attribute__((vector_size(16)));

  Lanes() = default;
  Lanes(double x) : v{x, x} {}  // NOLINT: twiddle factors are the same in both
  Lanes(double first, double second) : v{first, second} {}
  explicit Lanes(Vector both) : v(both) {}

  Lanes& operator+=(Lanes x) { return *this = *this + x; }
  Lanes& operator-=(Lanes x) { return *this = *this - x; }
  Lanes& operator*=(Lanes x) { return *this = *this * x; }
  friend Lanes operator+(Lanes a, Lanes b) { return Lanes(a.v + b.v); }
  friend Lanes operator-(Lanes a, Lanes b) { return Lanes(a.v - b.v); }
  friend Lanes operator*(Lanes a, Lanes b) { return Lanes(a.v * b.v); }
  friend Lanes operator-(Lanes a) { return Lanes(-a.v); }

  Vector v;
};

/// Two real signals of N samples by a transform of N/2 of z(n) = x(2n) + j x(2n + 1):
///   X(k) = (Z(k) + Z*(N/2 - k))/2 - j W^k (Z(k) - Z*(N/2 - k))/2,   W = exp(-j 2 pi/N)
class PairTransform {
 public:
  std::array<std::vector<Complex>, 2> operator()(std::span<const double> first,
                                                 std::span<const double> second) {
    const std::size_t n = first.size(), half = n / 2;
    prepare(n);
    for (std::size_t k = 0; k < half; ++k)
      pairs_[k] = {Lanes(first[2 * k], second[2 * k]), Lanes(first[2 * k + 1], second[2 * k + 1])};
    fft_.fwd(bins_.data(), pairs_.data(), static_cast<Eigen::Index>(half));
    std::array<std::vector<Complex>, 2> result{std::vector<Complex>(half + 1),
                                               std::vector<Complex>(half + 1)};
    for (std::size_t k = 0; k <= half; ++k) {
      const auto &forward = bins_[k == half ? 0 : k], &backward = bins_[k == 0 ? 0 : half - k];
      const Lanes sum_re = forward.real() + backward.real(), sum_im = forward.imag() - backward.imag();
      const Lanes apart_re = forward.real() - backward.real(), apart_im = forward.imag() + backward.imag();
      const Lanes c = turns_[k].real(), s = turns_[k].imag();  // of -j W^k
      const Lanes re = 0.5 * (sum_re + c * apart_re - s * apart_im);
      const Lanes im = 0.5 * (sum_im + c * apart_im + s * apart_re);
      for (std::size_t i = 0; i < 2; ++i) result[i][k] = {re.v[i], im.v[i]};
    }
    return result;
  }

 private:
  void prepare(std::size_t n) {
    if (pairs_.size() == n / 2) return;
    pairs_.resize(n / 2);
    bins_.resize(n / 2);
    turns_.resize(n / 2 + 1);
    for (std::size_t k = 0; k < turns_.size(); ++k)
      turns_[k] =
          Complex(0.0, -1.0) * std::polar(1.0, -kTwoPi * static_cast<double>(k) / static_cast<double>(n));
  }

  Eigen::FFT<Lanes> fft_;
  std::vector<std::complex<Lanes>> pairs_, bins_;
  std::vector<Complex> turns_;
};

}  // namespace

std::array<std::vector<Complex>, 2> half_spectra(std::span<const double> first,
                                                 std::span<const double> second) {
  const std::size_t n = first.size();
  if (n < 4 || n % 2 != 0 || !smooth(n)) return {half_spectrum(first), half_spectrum(second)};
  thread_local PairTransform transform;  // keeps its tables between calls
  return transform(first, second);
}

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
