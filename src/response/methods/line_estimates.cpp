// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/response/line_estimates.hpp>

namespace resonid::response {
namespace {

using Complex = std::complex<double>;
using Gradient = Eigen::RowVector3cd;  // with respect to (excitation, input, output)

struct Value {
  Complex value;
  Gradient gradient;
};

/// Widening that keeps the 95 % circle at 95 % when the variance was estimated itself.
double few_averages_factor(double degrees) {
  constexpr double kTail = 0.05;
  if (!(degrees < 1e6)) return 1.0;
  return std::sqrt(degrees * (std::pow(kTail, -1.0 / degrees) - 1.0) / -std::log(kTail));
}

void append(data::FrequencyResponse& response, const LineEstimate& line, const Value& result) {
  const double variance = (result.gradient * line.covariance * result.gradient.adjoint()).value().real();
  const double deviation = std::sqrt(std::max(variance, 0.0)) * few_averages_factor(line.degrees_of_freedom);
  if (!std::isfinite(result.value.real()) || !std::isfinite(result.value.imag()) || !std::isfinite(deviation))
    return;
  const double relative = deviation / std::abs(result.value);
  response.frequency_hz.push_back(line.frequency_hz);
  response.value.push_back(result.value);
  response.std.push_back(deviation);
  response.coherence.push_back(std::isnan(line.coherence) ? 1.0 / (1.0 + relative * relative)
                                                          : line.coherence);
}

template <class Form>
data::FrequencyResponse collect(const LineEstimates& estimates, Form&& form) {
  data::FrequencyResponse response;
  for (const LineEstimate& line : estimates.lines) append(response, line, form(line));
  response.unsettled_hz = estimates.unsettled_hz;
  response.correlation = estimates.correlation;
  return response;
}

Value output_per_input(const LineEstimate& line) {
  const Complex ratio = line.output / line.input;
  return {ratio, Gradient(0.0, -ratio / line.input, 1.0 / line.input)};
}

/// G = Gcl/(1 - C Gcl), dG/dGcl = 1/(1 - C Gcl)^2; `velocity` turns the output's phasor into the velocity
/// that the controller sees.
Value indirect(const LineEstimate& line, Complex velocity, Complex controller) {
  const Complex closed = velocity * line.output / line.excitation;
  const Complex difference = 1.0 - controller * closed;
  const Complex slope = 1.0 / (difference * difference);
  return {closed / difference,
          Gradient(-slope * closed / line.excitation, 0.0, slope * velocity / line.excitation)};
}

/// w'/w at every line by a straight line through its neighbours.
std::vector<Complex> slopes(const std::vector<double>& frequency_hz, const std::vector<Complex>& weight) {
  constexpr std::size_t kReach = 3;
  std::vector<Complex> slope(weight.size(), 0.0);
  for (std::size_t i = 0; i < weight.size(); ++i) {
    const std::size_t reach = std::min({kReach, i, weight.size() - 1 - i});  // even-sided: no curvature in it
    Complex sum = 0.0, mean = 0.0;
    double square = 0.0;
    for (std::size_t k = i - reach; k <= i + reach; ++k) {
      const double distance = frequency_hz[k] - frequency_hz[i];
      sum += distance * weight[k];
      mean += weight[k] / static_cast<double>(2 * reach + 1);
      square += distance * distance;
    }
    if (square > 0.0 && std::abs(mean) > 0.0) slope[i] = sum / (square * mean);
  }
  return slope;
}

/// What weights the response of a smoothed line (docs of plant_response).
Complex smoothing_weight(const LineEstimate& line, const ResponseOptions& options, Complex velocity) {
  switch (options.approach) {
    case Approach::direct:
      return std::norm(line.input);
    case Approach::indirect:
      return 1.0 - options.controller->response(line.frequency_hz) * velocity * line.output / line.excitation;
    case Approach::joint:
      break;
  }
  return line.input / line.excitation;
}

data::Smoothing smoothing_of(const LineEstimates& estimates, const ResponseOptions& options,
                             const std::vector<double>& kept_hz) {
  data::Smoothing smoothing;
  smoothing.width_hz = estimates.smoothing_hz;
  if (!(smoothing.width_hz > 0.0)) return smoothing;
  std::vector<Complex> weight;
  for (const LineEstimate& line : estimates.lines) {
    if (weight.size() == kept_hz.size() || line.frequency_hz != kept_hz[weight.size()]) continue;
    const Complex velocity =
        velocity_factor(estimates.output_quantity, line.frequency_hz, estimates.sample_time_s);
    weight.push_back(smoothing_weight(line, options, velocity));
  }
  smoothing.slope = slopes(kept_hz, weight);
  return smoothing;
}

}  // namespace

Complex velocity_factor(data::OutputQuantity quantity, double frequency_hz, double sample_time_s) {
  const double angle = kTwoPi * frequency_hz * sample_time_s;
  switch (quantity) {
    case data::OutputQuantity::position:
      return {0.0, 2.0 / sample_time_s * std::tan(0.5 * angle)};
    case data::OutputQuantity::acceleration:
      return sample_time_s / (1.0 - std::polar(1.0, -angle));
    case data::OutputQuantity::velocity:
      break;
  }
  return 1.0;
}

data::FrequencyResponse to_velocity(data::FrequencyResponse response, data::OutputQuantity quantity,
                                    double sample_time_s) {
  for (std::size_t i = 0; i < response.lines(); ++i) {
    const Complex factor = velocity_factor(quantity, response.frequency_hz[i], sample_time_s);
    response.value[i] *= factor;
    if (!response.std.empty()) response.std[i] *= std::abs(factor);
  }
  return response;
}

expected<data::FrequencyResponse, Error> plant_response(const LineEstimates& estimates,
                                                        const ResponseOptions& options) {
  if (!(options.delay_s >= 0.0) || !std::isfinite(options.delay_s))
    return refuse("delay_s", "must be >= 0", options.delay_s);
  const bool is_indirect = options.approach == Approach::indirect;
  if (is_indirect && !options.controller) return refuse("controller", "is needed by the indirect approach");
  if (options.approach != Approach::direct && !estimates.has_excitation)
    return refuse("excitation", "is needed by the indirect and the joint approach");
  if (!is_indirect && !estimates.has_input)
    return refuse("input", "is needed by the direct and the joint approach");
  auto response = collect(estimates, [&](const LineEstimate& line) {
    const double f = line.frequency_hz;
    const Complex velocity = velocity_factor(estimates.output_quantity, f, estimates.sample_time_s);
    const Complex advance = std::polar(1.0, kTwoPi * f * options.delay_s);
    Value result =
        is_indirect ? indirect(line, velocity, options.controller->response(f)) : output_per_input(line);
    const Complex factor = is_indirect ? advance : velocity * advance;
    result.value *= factor;
    result.gradient *= factor;
    return result;
  });
  response.smoothing = smoothing_of(estimates, options, response.frequency_hz);
  return response;
}

expected<data::FrequencyResponse, Error> loop_response(const LineEstimates& estimates) {
  if (!estimates.has_excitation || !estimates.has_input)
    return refuse("excitation", "the loop's response needs excitation and input");
  return collect(estimates, [](const LineEstimate& line) {
    const Complex ratio = line.excitation / line.input;
    return Value{ratio - 1.0, Gradient(1.0 / line.input, -ratio / line.input, 0.0)};
  });
}

expected<data::FrequencyResponse, Error> controller_response(const LineEstimates& estimates) {
  if (!estimates.has_excitation || !estimates.has_input)
    return refuse("excitation", "the controller's response needs excitation and input");
  return collect(estimates, [](const LineEstimate& line) {
    const Complex value = (line.excitation - line.input) / line.output;
    return Value{value, Gradient(1.0, -1.0, -value) / line.output};
  });
}

}  // namespace resonid::response
