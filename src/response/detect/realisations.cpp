// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
#include <resonid/response/detail/realisations.hpp>

#include "response/spectra/autocorrelation.hpp"
#include "response/spectra/fft.hpp"

namespace resonid::response {
namespace {

using Spectrum = std::vector<std::complex<double>>;

/// Of the mean period, without its constant.
Spectrum mean_spectrum(const std::vector<double>& x, std::size_t period) {
  const std::size_t count = x.size() / period;
  std::vector<double> mean(period, 0.0);
  for (std::size_t k = 0; k < count * period; ++k) mean[k % period] += x[k] / static_cast<double>(count);
  auto spectrum = half_spectrum(mean);
  spectrum[0] = 0.0;
  return spectrum;
}

std::size_t excited_lines(const Spectrum& s) {
  std::vector<double> powers;
  for (std::size_t b = 1; b < s.size(); ++b) powers.push_back(std::norm(s[b]));
  const double threshold = excited_power_threshold(powers);
  return static_cast<std::size_t>(
      std::count_if(powers.begin(), powers.end(), [&](double p) { return p > 0.0 && p >= threshold; }));
}

/// Cosine of the angle between two amplitude spectra.
double likeness(const Spectrum& a, const Spectrum& b) {
  double both = 0.0, one = 0.0, other = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    both += std::abs(a[i]) * std::abs(b[i]);
    one += std::norm(a[i]);
    other += std::norm(b[i]);
  }
  return one > 0.0 && other > 0.0 ? both / std::sqrt(one * other) : 0.0;
}

/// Largest circular correlation of the two periods over all shifts.
double best_correlation(const Spectrum& a, const Spectrum& b, std::size_t period) {
  Spectrum product(a.size());
  double one = 0.0, other = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    product[i] = a[i] * std::conj(b[i]);
    const double weight = 2 * i == period ? 1.0 : 2.0;
    one += weight * std::norm(a[i]);
    other += weight * std::norm(b[i]);
  }
  const auto correlation = from_half_spectrum(product, period);
  return static_cast<double>(period) * *std::max_element(correlation.begin(), correlation.end()) /
         std::sqrt(one * other);
}

}  // namespace

std::vector<data::Record> realisations_of(const data::Record& record, std::size_t period_samples) {
  std::vector<data::Record> parts;
  const auto& x = data::exciting(record);
  if (period_samples < 4) return parts;
  const std::size_t periods = x.size() / period_samples;
  const double centre = mean(x);
  std::vector<double> power(periods, 0.0), change(periods, 0.0);
  for (std::size_t p = 0; p < periods; ++p)
    for (std::size_t n = 0; n < period_samples; ++n) {
      const double now = x[p * period_samples + n];
      power[p] += (now - centre) * (now - centre);
      if (p > 0) change[p] += std::pow(now - x[(p - 1) * period_samples + n], 2);
    }
  constexpr double kOther = 0.25;   // of the power
  constexpr double kSilent = 0.01;  // of the strongest period's power
  const double strongest = periods > 0 ? *std::max_element(power.begin(), power.end()) : 0.0;
  std::size_t begin = 0;
  for (std::size_t p = 1; p <= periods; ++p) {
    if (p < periods && change[p] <= kOther * power[p]) continue;
    if (p - begin >= 3 && power[begin + 1] > kSilent * strongest)  // a transient and two more
      parts.push_back(data::part_of(record, (begin + 1) * period_samples, (p - begin - 1) * period_samples));
    begin = p;
  }
  return parts;
}

std::optional<std::pair<std::size_t, std::size_t>> no_realisations(std::span<const data::Record> records,
                                                                   std::size_t period_samples) {
  constexpr double kAlike = 0.9, kSame = 0.95;
  constexpr std::size_t kFewestLines = 4;
  std::vector<Spectrum> spectra;
  for (const auto& record : records) spectra.push_back(mean_spectrum(data::exciting(record), period_samples));
  for (std::size_t b = 1; b < spectra.size(); ++b) {
    if (excited_lines(spectra[b]) < kFewestLines) return std::pair{b - 1, b};
    for (std::size_t a = 0; a < b; ++a)
      if (likeness(spectra[a], spectra[b]) < kAlike ||
          best_correlation(spectra[a], spectra[b], period_samples) > kSame)
        return std::pair{a, b};
  }
  return std::nullopt;
}

std::optional<std::size_t> detect_realisation_period(const data::Record& record) {
  constexpr std::size_t kShortest = 64, kLongest = std::size_t{1} << 18;  // bounds the cost
  const auto& x = data::exciting(record);
  std::size_t refused = 0;
  for (std::size_t length = std::min(x.size(), kLongest); length >= kShortest; length = 2 * length / 3)
    for (const std::size_t start : {std::size_t{0}, (x.size() - length) / 2}) {
      const auto period = repetition_of(std::span(x).subspan(start, length));
      if (!period || period->lag == refused) continue;
      const auto parts = realisations_of(record, period->lag);
      if (parts.size() > 1 && !no_realisations(parts, period->lag)) return period->lag;
      refused = period->lag;
    }
  return std::nullopt;
}

}  // namespace resonid::response
