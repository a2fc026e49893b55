// SPDX-License-Identifier: MIT
#include "response/spectra/local_spectra.hpp"

#include <algorithm>
#include <cmath>
#include <resonid/response/detail/excitation_lines.hpp>

#include "response/spectra/fft.hpp"

namespace resonid::response {

expected<LocalSpectra, Error> local_spectra(const data::Record& record, const Signals& signals,
                                            Approach approach) {
  const std::size_t length = fast_length(signals.samples);
  if (length < 64) return refuse("record", "must hold at least 64 samples", static_cast<double>(length));
  LocalSpectra result;
  result.reference = static_cast<Eigen::Index>(signals.reference);
  result.spacing_hz = record.sample_rate_hz / static_cast<double>(length);
  result.spectra = Eigen::MatrixX3cd::Zero(static_cast<Eigen::Index>(length / 2 + 1), 3);
  for (std::size_t i = 0; i < 3; ++i) {
    // Direct: the excitation plays no part, and would make its own ratio look exact.
    if (!signals.has(i) || (i == 0 && approach == Approach::direct)) continue;
    const auto bins = half_spectrum(detrended(signals.signal[i].first(length), trend_degree(record, i)));
    for (std::size_t b = 0; b < bins.size(); ++b)
      result.spectra(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(i)) =
          bins[b] / std::sqrt(static_cast<double>(length));
  }
  const auto band = excited_band_hz(record, approach);
  if (!band) return refuse("excitation", "has no power");
  result.band_hz = *band;
  const auto core =
      excited_band_hz(record, approach, 0.25).value_or(*band);  // a chirp is at -6 dB where it ends
  result.first_excited = core.first / result.spacing_hz;
  result.last_excited = core.second / result.spacing_hz;
  return result;
}

std::pair<Eigen::Index, Eigen::Index> local_window(const LocalSpectra& spectra, double centre,
                                                   double half_width) {
  double low = centre - half_width;
  double high = centre + half_width;
  if (centre >= spectra.first_excited && centre <= spectra.last_excited) {
    const double lacking_below = std::max(spectra.first_excited - low, 0.0);
    low -= std::max(high - spectra.last_excited, 0.0);
    high += lacking_below;
  }
  const auto last = static_cast<double>(spectra.spectra.rows() - 1);
  return {static_cast<Eigen::Index>(std::ceil(std::max(low, 1.0))),
          static_cast<Eigen::Index>(std::floor(std::min(high, last)))};
}

expected<std::vector<double>, Error> local_grid(const data::Record& record, const LocalSpectra& spectra,
                                                const LocalGrid& wanted) {
  const double nyquist = 0.5 * record.sample_rate_hz;
  for (const double f : wanted.frequencies_hz)
    if (!(f > 0.0) || f >= nyquist)
      return refuse("frequencies_hz", "must lie between 0 and half the sample rate", f);
  if (!wanted.frequencies_hz.empty()) {
    auto frequencies = wanted.frequencies_hz;
    std::sort(frequencies.begin(), frequencies.end());
    return frequencies;
  }
  const auto upper = upper_band_edge(record, wanted.band_low_hz, wanted.band_high_hz);
  if (!upper) return unexpected(upper.error());
  const bool whole = wanted.band_low_hz == 0.0 && wanted.band_high_hz == 0.0;
  const double low_hz = whole ? spectra.band_hz.first : wanted.band_low_hz;
  const double high_hz = whole ? spectra.band_hz.second : *upper;
  const double first = std::max(1.0, std::ceil(low_hz / spectra.spacing_hz - 1e-9));
  const double last = std::min(std::floor(high_hz / spectra.spacing_hz + 1e-9),
                               std::ceil(nyquist / spectra.spacing_hz) - 1.0);
  const double step = std::max(1.0, std::ceil((last - first) / 400.0));
  std::vector<double> frequencies;
  for (double bin = first; bin <= last; bin += step) frequencies.push_back(bin * spectra.spacing_hz);
  return frequencies;
}

}  // namespace resonid::response
