// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/sized_cost_function.h>

#include <algorithm>
#include <cmath>
#include <fit/drive/measured_response.hpp>
#include <fit/drive/response_lines.hpp>
#include <utility>

namespace resonid::fit::detail {

/// Weighted differences, real and imaginary part per line.
template <int Masses>
class ResponseCost : public ceres::SizedCostFunction<ceres::DYNAMIC, Sizes<Masses>::kParameters> {
 public:
  using Complex = std::complex<double>;
  static constexpr int kParameters = Sizes<Masses>::kParameters;
  const data::FrequencyResponse* response;
  std::vector<double> weight;
  std::vector<Points> points;
  Coordinates coordinates;
  SearchRange range;
  ResponseSetting setting;
  std::vector<int> active;

  ResponseCost(const data::FrequencyResponse& lines, std::vector<double> weights, std::vector<Points> where,
               const Coordinates& in, const SearchRange& allowed, const ResponseSetting& with,
               std::vector<int> by)
      : response(&lines),
        weight(std::move(weights)),
        points(std::move(where)),
        coordinates(in),
        range(allowed),
        setting(with),
        active(std::move(by)) {
    this->set_num_residuals(static_cast<int>(2 * lines.lines()));
  }

  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override {
    const double* x = blocks[0];
    if (!range.contains(x, kParameters)) return false;
    double* const slopes = jacobians == nullptr ? nullptr : jacobians[0];
    const auto measured = slopes == nullptr ? MeasuredResponse<Masses>(coordinates, x, setting, {})
                                            : MeasuredResponse<Masses>(coordinates, x, setting, active);
    std::vector<Complex> by(slopes == nullptr ? 0 : active.size());
    if (slopes != nullptr) std::fill(slopes, slopes + 2 * response->lines() * kParameters, 0.0);
    for (std::size_t i = 0; i < response->lines(); ++i) {
      Complex difference = -response->value[i];
      for (const Point& point : points[i]) {
        if (point.share == 0.0) continue;
        difference += point.share * measured.evaluate(point.frequency_hz, by);
        for (std::size_t p = 0; p < by.size(); ++p) {
          const Complex slope = weight[i] * point.share * by[p];
          const std::size_t at = 2 * i * kParameters + static_cast<std::size_t>(active[p]);
          slopes[at] += slope.real();
          slopes[at + kParameters] += slope.imag();
          if (!std::isfinite(slopes[at]) || !std::isfinite(slopes[at + kParameters])) return false;
        }
      }
      residual[2 * i] = weight[i] * difference.real();
      residual[2 * i + 1] = weight[i] * difference.imag();
      if (!std::isfinite(residual[2 * i]) || !std::isfinite(residual[2 * i + 1])) return false;
    }
    return true;
  }
};

}  // namespace resonid::fit::detail
