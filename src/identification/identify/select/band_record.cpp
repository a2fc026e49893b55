// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/identify/select/band_record.hpp>
#include <resonid/base/constants.hpp>

namespace resonid::identification::detail {
namespace {

constexpr double kRateOverBand = 5.0;

/// Windowed sinc (Blackman) with its cut-off at 0.8 of the new half rate; sums to 1.
std::vector<double> low_pass(std::size_t every) {
  constexpr double kCutOff = 0.4;  // of the new rate
  const auto half = static_cast<std::ptrdiff_t>(8 * every);
  std::vector<double> taps;
  double sum = 0.0;
  for (std::ptrdiff_t k = -half; k <= half; ++k) {
    const double x = kTwoPi * kCutOff * static_cast<double>(k) / static_cast<double>(every);
    const double phase = kPi * static_cast<double>(k) / static_cast<double>(half + 1);
    const double window = 0.42 + 0.5 * std::cos(phase) + 0.08 * std::cos(2.0 * phase);
    taps.push_back(window * (k == 0 ? 1.0 : std::sin(x) / x));
    sum += taps.back();
  }
  for (double& t : taps) t /= sum;
  return taps;
}

std::vector<double> decimated(const std::vector<double>& x, const std::vector<double>& taps,
                              std::size_t every) {
  std::vector<double> y;
  for (std::size_t from = 0; from + taps.size() <= x.size(); from += every) {
    double sum = 0.0;
    for (std::size_t i = 0; i < taps.size(); ++i) sum += taps[i] * x[from + i];
    y.push_back(sum);
  }
  return y;
}

}  // namespace

// s^2/(s^2 + sqrt 2 w s + w^2) by the bilinear transformation.
std::vector<double> high_passed(std::span<const double> x, double hz, double sample_rate_hz) {
  const double w = std::tan(kPi * hz / sample_rate_hz), a0 = 1.0 + std::sqrt(2.0) * w + w * w;
  const double a1 = 2.0 * (w * w - 1.0) / a0, a2 = (1.0 - std::sqrt(2.0) * w + w * w) / a0;
  std::vector<double> y;
  double x1 = 0.0, x2 = 0.0, y1 = 0.0, y2 = 0.0;
  for (const double sample : x) {
    const double now = sample - x.front();
    const double out = (now - 2.0 * x1 + x2) / a0 - a1 * y1 - a2 * y2;
    x2 = x1, x1 = now, y2 = y1, y1 = out;
    y.push_back(out);
  }
  return y;
}

// w^2/(s^2 + sqrt 2 w s + w^2), likewise.
std::vector<double> low_passed(std::vector<double> x, double hz, double sample_rate_hz) {
  const double w = std::tan(kPi * hz / sample_rate_hz), a0 = 1.0 + std::sqrt(2.0) * w + w * w;
  const double a1 = 2.0 * (w * w - 1.0) / a0, a2 = (1.0 - std::sqrt(2.0) * w + w * w) / a0, b = w * w / a0;
  const double start = x.empty() ? 0.0 : x.front();
  double x1 = 0.0, x2 = 0.0, y1 = 0.0, y2 = 0.0;
  for (double& sample : x) {
    const double now = sample - start;
    const double out = b * (now + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
    x2 = x1, x1 = now, y2 = y1, y1 = out;
    sample = start + out;
  }
  return x;
}

BandRecord record_in_band(const data::Record& record, std::pair<double, double> band_hz, bool high_pass) {
  BandRecord result{record, 1, 0};
  auto& own = result.record;
  own.position = own.second_output = {};
  own.sampling.filled.clear();  // a filter spreads them
  const double ratio = record.sample_rate_hz / (kRateOverBand * std::max(band_hz.second, 1e-9));
  if (ratio >= 2.0 && static_cast<double>(record.samples()) > 100.0 * ratio) {
    result.every = static_cast<std::size_t>(ratio);
    const auto taps = low_pass(result.every);
    for (auto* c : {&own.input, &own.output, &own.excitation, &own.reference})
      if (c->present()) c->samples = decimated(c->samples, taps, result.every);
    result.first_sample = taps.size() / 2;
    own.sample_rate_hz /= static_cast<double>(result.every);
  }
  const double low = band_hz.first / std::sqrt(2.0);
  if (!high_pass || !(low > 4.0 / own.duration_s())) return result;
  const auto settled = static_cast<std::ptrdiff_t>(own.sample_rate_hz / low);
  for (auto* c : {&own.input, &own.output, &own.excitation, &own.reference}) {
    if (!c->present()) continue;
    c->samples = high_passed(c->samples, low, own.sample_rate_hz);
    c->samples.erase(c->samples.begin(), c->samples.begin() + settled);
  }
  result.first_sample += static_cast<std::size_t>(settled) * result.every;
  return result;
}

}  // namespace resonid::identification::detail
