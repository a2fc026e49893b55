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

  ResponseCost(const data::FrequencyResponse& lines, std::vector<double> weights,
               const std::vector<Points>& points, const Coordinates& coordinates, const SearchRange& range,
               const ResponseSetting& setting, std::vector<int> active)
      : response_(lines),
        weight_(std::move(weights)),
        coordinates_(coordinates),
        range_(range),
        setting_(setting),
        active_(std::move(active)) {
    this->set_num_residuals(static_cast<int>(2 * lines.lines()));
    std::vector<double> frequencies_hz;
    for (std::size_t i = 0; i < points.size(); ++i)
      for (const Point& point : points[i]) {
        if (point.share == 0.0) continue;
        shares_.push_back({i, weight_[i] * point.share});
        frequencies_hz.push_back(point.frequency_hz);
      }
    abscissae_ = abscissae_of(frequencies_hz, setting.sample_time_s);
  }

  [[nodiscard]] double weight(std::size_t line) const { return weight_[line]; }

  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override {
    const double* x = blocks[0];
    if (!range_.contains(x, kParameters)) return false;
    double* const slopes = jacobians == nullptr ? nullptr : jacobians[0];
    const auto measured = slopes == nullptr ? MeasuredResponse<Masses>(coordinates_, x, setting_, {})
                                            : MeasuredResponse<Masses>(coordinates_, x, setting_, active_);
    std::vector<ComplexLanes> by(slopes == nullptr ? 0 : active_.size());
    const std::size_t lines = response_.lines();
    if (slopes != nullptr) std::fill(slopes, slopes + 2 * lines * kParameters, 0.0);
    for (std::size_t i = 0; i < lines; ++i) put(residual + 2 * i, -weight_[i] * response_.value[i]);
    for (std::size_t first = 0; first < shares_.size(); first += kLanes) {
      const ComplexLanes model = measured.evaluate(abscissae_[first / kLanes], by);
      for (std::size_t n = first; n < std::min(first + kLanes, shares_.size()); ++n) {
        const auto lane = static_cast<int>(n - first);
        const std::size_t i = shares_[n].line;
        const Complex& share = shares_[n].weighted;
        add(residual + 2 * i, share, model.at(lane), 1);
        for (std::size_t p = 0; p < by.size(); ++p)
          add(slopes + 2 * i * kParameters + active_[p], share, by[p].at(lane), kParameters);
      }
    }
    const auto finite = [](const double* from, std::size_t count) {
      return std::all_of(from, from + count, [](double v) { return std::isfinite(v); });
    };
    return finite(residual, 2 * lines) && (slopes == nullptr || finite(slopes, 2 * lines * kParameters));
  }

 private:
  /// A line's point: how much of the line it is, and how the line is weighted.
  struct Share {
    std::size_t line;
    Complex weighted;
  };

  static void put(double* at, const Complex& value) {
    at[0] = value.real();
    at[1] = value.imag();
  }
  /// The imaginary part stands `apart` further.
  static void add(double* at, const Complex& share, const Complex& value, int apart) {
    at[0] += share.real() * value.real() - share.imag() * value.imag();
    at[apart] += share.real() * value.imag() + share.imag() * value.real();
  }

  const data::FrequencyResponse& response_;
  std::vector<double> weight_;
  std::vector<Share> shares_;
  std::vector<Abscissa> abscissae_;
  Coordinates coordinates_;
  SearchRange range_;
  ResponseSetting setting_;
  std::vector<int> active_;
};

}  // namespace resonid::fit::detail
