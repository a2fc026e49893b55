// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/response/detail/excitation_lines.hpp>
#include <resonid/response/periodic_averaging.hpp>
#include <set>

#include "response/signals.hpp"
#include "response/spectra/fft.hpp"

namespace resonid::response {
namespace {

/// Phasors of (excitation, input, output) at one bin, one column per period.
using Periods = Eigen::Matrix3Xcd;

std::vector<Periods> period_spectra(const Signals& signals, std::size_t period, std::size_t first) {
  const std::size_t count = (signals.samples - first) / period;
  std::vector<Periods> bins(period / 2 + 1, Periods::Zero(3, static_cast<Eigen::Index>(count)));
  const double scale = 2.0 / static_cast<double>(period);  // peak amplitudes
  for (std::size_t i = 0; i < 3; ++i) {
    if (!signals.has(i)) continue;
    const auto values = without_drift(signals.signal[i].subspan(first), period);
    for (std::size_t p = 0; p < count; ++p) {
      const auto spectrum = half_spectrum(std::span(values).subspan(p * period, period));
      for (std::size_t b = 0; b < bins.size(); ++b)
        bins[b](static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(p)) = scale * spectrum[b];
    }
  }
  return bins;
}

LineEstimate average(const Periods& periods, Eigen::Index reference) {
  const auto count = static_cast<double>(periods.cols());
  LineEstimate line;
  const Eigen::Vector3cd mean = periods.rowwise().mean();
  const Periods scatter = periods.colwise() - mean;
  line.excitation = mean(0);
  line.input = mean(1);
  line.output = mean(2);
  line.covariance = scatter * scatter.adjoint() / (count * (count - 1.0));
  line.degrees_of_freedom = count - 1.0;
  const double powers = periods.row(reference).squaredNorm() * periods.row(2).squaredNorm();
  line.coherence = std::norm(periods.row(2).dot(periods.row(reference))) / powers;
  return line;
}

/// Few periods tell little of one line's noise: its scatter is averaged with that of as many neighbours as
/// give some twelve degrees of freedom, four on either side at most. Signal power plays no part in a scatter,
/// so that lines without excitation count too.
void pool_noise(const std::vector<Periods>& spectra, std::size_t bin, LineEstimate& line) {
  const double own = line.degrees_of_freedom;
  const std::size_t reach = pooling_reach(own);
  if (reach == 0) return;
  const double count = own + 1.0;
  Eigen::Matrix3cd sum = Eigen::Matrix3cd::Zero();
  double bins = 0.0;
  for (std::size_t b = std::max<std::size_t>(1, bin > reach ? bin - reach : 1);
       b <= std::min(bin + reach, spectra.size() - 1); ++b) {
    const Eigen::Vector3cd mean = spectra[b].rowwise().mean();
    const Periods scatter = spectra[b].colwise() - mean;
    sum += scatter * scatter.adjoint() / (count * own);
    bins += 1.0;
  }
  line.covariance = sum / bins;
  line.degrees_of_freedom = own * bins;
}

/// Whether the mean stands out of its scatter: |mean|^2/variance exceeds the 0.1 % quantile of F(2, 2 nu).
bool significant(const LineEstimate& line, std::complex<double> mean, Eigen::Index reference) {
  const double degrees = line.degrees_of_freedom;
  const double quantile = degrees * (std::pow(0.001, -1.0 / degrees) - 1.0);
  return std::norm(mean) > quantile * line.covariance(reference, reference).real();
}

}  // namespace

expected<LineEstimates, Error> periodic_lines(const data::Record& record, const PeriodicConfig& config,
                                              Approach approach) {
  const auto signals = signals_of(record, approach);
  if (!signals) return unexpected(signals.error());
  const auto high_hz = upper_band_edge(record, config.band_low_hz, config.band_high_hz);
  if (!high_hz) return unexpected(high_hz.error());
  std::size_t period = config.period_samples;
  if (period == 0) period = detect_period(record).value_or(0);
  if (period == 0) return refuse("period_samples", "is needed: the excitation shows no period");
  if (period < 4) return refuse("period_samples", "must be at least 4", static_cast<double>(period));
  const std::size_t whole = signals->samples / period;
  if (whole < config.drop_periods + 2)
    return refuse("drop_periods", "must leave at least two whole periods",
                  static_cast<double>(config.drop_periods));

  const auto spectra = period_spectra(*signals, period, config.drop_periods * period);
  const double spacing_hz = record.sample_rate_hz / static_cast<double>(period);
  std::set<std::size_t> wanted;
  for (const double f : config.lines_hz) {
    const double bin = std::round(f / spacing_hz);
    if (!(bin >= 1.0) || bin > static_cast<double>(spectra.size() - 1))
      return refuse("lines_hz", "must lie between 0 and half the sample rate", f);
    wanted.insert(static_cast<std::size_t>(bin));
  }
  const auto reference = static_cast<Eigen::Index>(signals->reference);
  const auto inside = [&](std::size_t bin) {
    const double f = static_cast<double>(bin) * spacing_hz;
    return f >= config.band_low_hz - 1e-9 * spacing_hz && f <= *high_hz + 1e-9 * spacing_hz &&
           2 * bin < period;
  };
  std::vector<double> powers;
  for (std::size_t b = 1; b < spectra.size(); ++b)
    if (inside(b)) powers.push_back(std::norm(spectra[b].row(reference).mean()));
  const double threshold = excited_power_threshold(powers);

  LineEstimates estimates = empty_estimates(record, *signals);
  for (std::size_t b = 1; b < spectra.size(); ++b) {
    if (!inside(b) || (!wanted.empty() && wanted.count(b) == 0)) continue;
    LineEstimate line = average(spectra[b], reference);
    const auto mean = reference == 0 ? line.excitation : line.input;
    if (wanted.empty() && (std::norm(mean) < threshold || !significant(line, mean, reference))) continue;
    pool_noise(spectra, b, line);
    line.frequency_hz = static_cast<double>(b) * spacing_hz;
    estimates.lines.push_back(line);
  }
  return estimates;
}

expected<data::FrequencyResponse, Error> periodic_average(const data::Record& record,
                                                          const PeriodicConfig& config,
                                                          const ResponseOptions& options) {
  return periodic_lines(record, config, options.approach).and_then([&](const LineEstimates& lines) {
    return plant_response(lines, options);
  });
}

}  // namespace resonid::response
