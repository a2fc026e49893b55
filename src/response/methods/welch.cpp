// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/response/detail/excitation_lines.hpp>
#include <resonid/response/welch.hpp>

#include "response/signals.hpp"
#include "response/spectra/fft.hpp"

namespace resonid::response {
namespace {

using Complex = std::complex<double>;

struct Segments {
  std::vector<double> window;
  std::size_t hop = 0;
  std::size_t count = 0;
  bool periodic = false;
};

expected<Segments, Error> segments_of(const WelchConfig& config, std::size_t samples, double rate_hz) {
  if (!(config.overlap >= 0.0) || config.overlap >= 1.0)
    return refuse("overlap", "must lie in 0 <= overlap < 1", config.overlap);
  Segments segments;
  std::size_t length = config.period_samples;
  segments.periodic = length > 0;
  if (segments.periodic) {
    segments.window.assign(length, 1.0);
    segments.hop = length;
  } else {
    length = config.segment_samples > 0 ? config.segment_samples : default_segment(samples, rate_hz);
    for (std::size_t n = 0; n < length; ++n)
      segments.window.push_back(
          0.5 - 0.5 * std::cos(kTwoPi * static_cast<double>(n) / static_cast<double>(length)));
    segments.hop = std::max<std::size_t>(
        1, length - static_cast<std::size_t>(std::lround(config.overlap * static_cast<double>(length))));
  }
  if (length < 16) return refuse("segment_samples", "must be at least 16", static_cast<double>(length));
  segments.count = samples < length ? 0 : 1 + (samples - length) / segments.hop;
  if (segments.count < 2)
    return refuse("segment_samples", "the recording must hold at least two segments",
                  static_cast<double>(length));
  return segments;
}

/// Sum of X Y* over the segments, per bin, in real arithmetic: complex products that look after infinities
/// would take most of the time.
class CrossPower {
 public:
  explicit CrossPower(std::size_t bins) : re_(bins, 0.0), im_(bins, 0.0) {}

  void add(const std::vector<Complex>& x) {
    for (std::size_t b = 0; b < re_.size(); ++b)
      re_[b] += x[b].real() * x[b].real() + x[b].imag() * x[b].imag();
  }
  void add(const std::vector<Complex>& x, const std::vector<Complex>& y) {
    for (std::size_t b = 0; b < re_.size(); ++b) {
      re_[b] += x[b].real() * y[b].real() + x[b].imag() * y[b].imag();
      im_[b] += x[b].imag() * y[b].real() - x[b].real() * y[b].imag();
    }
  }
  [[nodiscard]] Complex at(std::size_t bin) const { return {re_[bin], im_[bin]}; }

 private:
  std::vector<double> re_, im_;
};

/// Averaged spectral matrices E{X X^H} of (excitation, input, output), per bin.
std::vector<Eigen::Matrix3cd> spectral_matrices(const data::Record& record, const Signals& signals,
                                                const Segments& segments) {
  const std::size_t length = segments.window.size();
  const std::size_t bins = length / 2 + 1;
  std::array<std::vector<double>, 3> periodic;
  for (std::size_t i = 0; i < 3 && segments.periodic; ++i)
    if (signals.has(i)) periodic[i] = without_drift(signals.signal[i], length);
  std::vector<std::size_t> present;
  for (std::size_t i = 0; i < 3; ++i)
    if (signals.has(i)) present.push_back(i);
  std::vector<CrossPower> sums(9, CrossPower(bins));  // [3 i + j], j >= i
  std::array<std::vector<Complex>, 3> spectrum;
  for (std::size_t s = 0; s < segments.count; ++s) {
    const std::size_t first = s * segments.hop;
    const auto windowed = [&](std::size_t i) {
      std::vector<double> part =
          segments.periodic ? std::vector<double>(&periodic[i][first], &periodic[i][first] + length)
                            : detrended(signals.signal[i].subspan(first, length), trend_degree(record, i));
      for (std::size_t n = 0; n < length; ++n) part[n] *= segments.window[n];
      return part;
    };
    for (std::size_t p = 0; p + 1 < present.size(); p += 2) {
      auto both = half_spectra(windowed(present[p]), windowed(present[p + 1]));
      spectrum[present[p]] = std::move(both[0]);
      spectrum[present[p + 1]] = std::move(both[1]);
    }
    if (present.size() % 2 == 1) spectrum[present.back()] = half_spectrum(windowed(present.back()));
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = i; j < 3; ++j)
        if (signals.has(i) && i == j)
          sums[3 * i + j].add(spectrum[i]);
        else if (signals.has(i) && signals.has(j))
          sums[3 * i + j].add(spectrum[i], spectrum[j]);
  }
  std::vector<Eigen::Matrix3cd> matrices(bins, Eigen::Matrix3cd::Zero());
  const auto count = static_cast<double>(segments.count);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j) {
      if (!signals.has(i) || !signals.has(j)) continue;
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
      for (std::size_t b = 0; b < bins; ++b) {
        matrices[b](row, column) = sums[3 * i + j].at(b) / count;
        matrices[b](column, row) = std::conj(matrices[b](row, column));
      }
    }
  return matrices;
}

/// Correlation of the errors of responses d bins apart for an input that is white around them: both input and
/// noise have correlated bins, c(m, d) between segments m hops apart, and the errors are products of the two:
///   rho(d) = sum_m (1 - |m|/K) |c(m, d)|^2 / sum_m (1 - |m|/K) |c(m, 0)|^2
data::LineCorrelation correlation_of(const Segments& segments, double spacing_hz) {
  const auto& w = segments.window;
  const std::size_t length = w.size();
  const auto share = [&](std::size_t bins) {
    double sum = 0.0;
    for (std::size_t m = 0; m < segments.count && m * segments.hop < length; ++m) {
      Complex c = 0.0;
      for (std::size_t n = 0; n + m * segments.hop < length; ++n)
        c += w[n] * w[n + m * segments.hop] *
             std::polar(1.0, kTwoPi * static_cast<double>(bins * n % length) / static_cast<double>(length));
      const double pairs = 1.0 - static_cast<double>(m) / static_cast<double>(segments.count);
      sum += (m == 0 ? 1.0 : 2.0) * pairs * std::norm(c);
    }
    return sum;
  };
  constexpr std::size_t kReach = 4;
  data::LineCorrelation correlation;
  const double whole = share(0);
  for (std::size_t bins = 0; bins <= kReach; ++bins) {
    correlation.distance_hz.push_back(static_cast<double>(bins) * spacing_hz);
    correlation.value.push_back(bins == kReach ? 0.0 : share(bins) / whole);
  }
  return correlation;
}

LineEstimate refer(const Eigen::Matrix3cd& spectra, Eigen::Index reference, double averages) {
  const double power = spectra(reference, reference).real();
  const Eigen::Vector3cd cross = spectra.col(reference);
  LineEstimate line;
  const Eigen::Vector3cd phasors = cross / std::sqrt(power);
  line.excitation = phasors(0);
  line.input = phasors(1);
  line.output = phasors(2);
  line.covariance = (spectra - cross * cross.adjoint() / power) / (averages - 1.0);
  line.degrees_of_freedom = averages - 1.0;
  line.coherence = std::norm(cross(2)) / (power * spectra(2, 2).real());
  return line;
}

}  // namespace

std::size_t default_segment(std::size_t samples, double sample_rate_hz) {
  const std::size_t finest = std::bit_ceil(static_cast<std::size_t>(std::ceil(10.0 * sample_rate_hz)));
  const double eighth = std::max(static_cast<double>(samples) / 8.0, 1.0);
  return std::clamp<std::size_t>(std::size_t{1} << std::lround(std::log2(eighth)), 64,
                                 std::max<std::size_t>(finest, 64));
}

double equivalent_averages(const std::vector<double>& window, std::size_t hop, std::size_t segments) {
  const auto product = [&](std::size_t shift) {
    double sum = 0.0;
    for (std::size_t n = 0; n + shift < window.size(); ++n) sum += window[n] * window[n + shift];
    return sum;
  };
  const auto count = static_cast<double>(segments);
  const double energy = product(0);
  double factor = 1.0;
  for (std::size_t j = 1; j < segments && j * hop < window.size(); ++j) {
    const double correlation = product(j * hop) / energy;
    factor += 2.0 * (1.0 - static_cast<double>(j) / count) * correlation * correlation;
  }
  return count / factor;
}

expected<LineEstimates, Error> welch_lines(const data::Record& record, const WelchConfig& config,
                                           Approach approach) {
  if (const auto difference = config.period_samples > 0 ? std::nullopt : differenced(record))
    return welch_lines(*difference, config, approach).map(integrated);
  const auto signals = signals_of(record, approach);
  if (!signals) return unexpected(signals.error());
  const auto high_hz = upper_band_edge(record, config.band_low_hz, config.band_high_hz);
  if (!high_hz) return unexpected(high_hz.error());
  const auto segments = segments_of(config, signals->samples, record.sample_rate_hz);
  if (!segments) return unexpected(segments.error());

  const double averages = equivalent_averages(segments->window, segments->hop, segments->count);
  if (!(averages > 1.1)) return refuse("overlap", "leaves too few independent segments", config.overlap);
  const auto matrices = spectral_matrices(record, *signals, *segments);
  const auto reference = static_cast<Eigen::Index>(signals->reference);
  std::vector<double> powers;
  for (std::size_t b = 1; b < matrices.size(); ++b)
    powers.push_back(matrices[b](reference, reference).real());
  const double threshold = config.period_samples > 0 ? excited_power_threshold(powers) : 0.0;

  LineEstimates estimates = empty_estimates(record, *signals);
  estimates.has_excitation = estimates.has_excitation && approach != Approach::direct;  // not referred to it
  const double spacing_hz = record.sample_rate_hz / static_cast<double>(segments->window.size());
  if (!segments->periodic) {
    estimates.correlation = correlation_of(*segments, spacing_hz);
    estimates.smoothing_hz = spacing_hz / std::sqrt(3.0);  // Hann: mean of (w'/2pi)^2 over that of w^2
  }
  for (std::size_t b = 1; b < matrices.size(); ++b) {
    const double f = static_cast<double>(b) * spacing_hz;
    if (f < config.band_low_hz || f > *high_hz) continue;
    const double power = matrices[b](reference, reference).real();
    if (!(power > threshold)) continue;
    estimates.lines.push_back(refer(matrices[b], reference, averages));
    estimates.lines.back().frequency_hz = f;
  }
  return estimates;
}

expected<data::FrequencyResponse, Error> welch(const data::Record& record, const WelchConfig& config,
                                               const ResponseOptions& options) {
  return welch_lines(record, config, options.approach).and_then([&](const LineEstimates& lines) {
    return plant_response(lines, options);
  });
}

}  // namespace resonid::response
