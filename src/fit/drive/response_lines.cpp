// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/drive/response_lines.hpp>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/fit/detail/second_output.hpp>

namespace resonid::fit::detail {
namespace {

using Complex = std::complex<double>;

Points points_of_line(const data::FrequencyResponse& g, std::size_t line, double known_delay_s) {
  const double f = g.frequency_hz[line];
  const double distance = g.smoothing.width_hz;
  if (!(distance > 0.0) || distance >= f) return {Point{f, 1.0}, Point{f, 0.0}};
  const Complex slope = g.smoothing.slope.empty() ? 0.0 : g.smoothing.slope[line];
  const Complex delay(0.0, -kTwoPi * known_delay_s);
  const Complex whole = 2.0 * std::cosh(distance * slope);
  return {Point{f + distance, std::exp(distance * (slope + delay)) / whole},
          Point{f - distance, std::exp(-distance * (slope + delay)) / whole}};
}

}  // namespace

std::vector<Points> points_of(const data::FrequencyResponse& g, double known_delay_s) {
  std::vector<Points> all;
  for (std::size_t i = 0; i < g.lines(); ++i) all.push_back(points_of_line(g, i, known_delay_s));
  return all;
}

std::vector<Complex> as_measured(const data::FrequencyResponse& g, const DriveModel& model,
                                 data::SecondOutput output) {
  const auto points = points_of(g, model.known_delay_s);
  const auto values = [&](std::size_t which) {
    std::vector<double> at;
    for (const auto& p : points) at.push_back(p[which].frequency_hz);
    return output == data::SecondOutput::none ? model.values(at, true) : load_values(model, output, at);
  };
  auto result = values(0);
  if (!(g.smoothing.width_hz > 0.0)) return result;
  const auto other = values(1);
  for (std::size_t i = 0; i < g.lines(); ++i)
    result[i] = points[i][0].share * result[i] + points[i][1].share * other[i];
  return result;
}

double explaining_error(const data::FrequencyResponse& g, const std::vector<Complex>& fitted, double wanted,
                        double independent) {
  const auto mean = [&](double e) {
    double sum = 0.0;
    for (std::size_t i = 0; i < g.lines(); ++i) {
      const double bound = e * std::abs(g.value[i]);
      const double variance = g.std[i] * g.std[i] + bound * bound;
      sum += std::norm(g.value[i] - fitted[i]) / std::max(variance, 1e-300);
    }
    return sum / static_cast<double>(g.lines());
  };
  if (mean(0.0) <= wanted * (1.0 + 2.0 / std::sqrt(independent))) return 0.0;
  double low = 0.0;
  double high = 1e-6;
  while (mean(high) > wanted && high < 1e3) high *= 4.0;
  for (int k = 0; k < 60; ++k) (mean(0.5 * (low + high)) > wanted ? low : high) = 0.5 * (low + high);
  return high;
}

std::vector<double> weights(const data::FrequencyResponse& g, Weighting weighting, double error) {
  std::vector<double> w(g.lines(), 1.0);
  if (weighting == Weighting::none) return w;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < g.lines(); ++i)
    if (g.std[i] > 0.0) smallest = std::min(smallest, g.std[i]);
  if (!std::isfinite(smallest)) smallest = 1e-12 * std::abs(g.value[0]) + 1e-300;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const double bound = error * std::abs(g.value[i]);
    const double sd = std::hypot(std::max(g.std[i], 1e-3 * smallest), bound);
    w[i] = std::sqrt(2.0) / sd;  // each of the two parts has half the variance
  }
  return w;
}

double known_repetition(const data::FrequencyResponse& g) {
  if (g.correlation.value.empty() || g.lines() == 0) return 1.0;
  const double reach = g.correlation.distance_hz.back();
  double sum = 0.0;
  for (std::size_t i = 0; i < g.lines(); ++i)
    for (std::size_t k = i + 1; k < g.lines() && g.frequency_hz[k] - g.frequency_hz[i] < reach; ++k)
      sum += 2.0 * g.correlation.at(g.frequency_hz[k] - g.frequency_hz[i]);
  return std::max(1.0, 1.0 + sum / static_cast<double>(g.lines()));
}

double repetition(const data::FrequencyResponse& g, double model_error, const std::vector<Complex>& fitted) {
  std::vector<Complex> e;
  double power = 0.0;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const double sd = std::hypot(g.std[i], model_error * std::abs(g.value[i]));
    e.push_back((g.value[i] - fitted[i]) / std::max(sd, 1e-300));
    power += std::norm(e.back());
  }
  double sum = 1.0;
  for (std::size_t lag = 1; power > 0.0 && lag < e.size() / 4; ++lag) {
    double correlation = 0.0;
    for (std::size_t i = lag; i < e.size(); ++i) correlation += (e[i] * std::conj(e[i - lag])).real();
    correlation /= power;
    constexpr double kDiedOut = 0.15;
    if (correlation < kDiedOut) break;
    sum += 2.0 * correlation;
  }
  return sum;
}

}  // namespace resonid::fit::detail
