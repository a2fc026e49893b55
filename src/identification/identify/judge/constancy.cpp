// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/constancy.hpp>
#include <identification/parameter_words.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/detail/noise_model.hpp>
#include <string>

namespace resonid::identification::detail {
namespace {

using diagnostics::Severity;

}  // namespace

bool essential(int parameter) {
  using namespace fit;
  return parameter == kDrivenInertia || parameter == kLoadInertia || parameter == kMiddleInertia ||
         parameter == kStiffness || parameter == kStiffness2;
}

std::vector<fit::Constancy> inconstant(std::vector<fit::Constancy> all) {
  const double most = kCriteria.constancy_false_alarm / std::max(1.0, static_cast<double>(all.size()));
  std::erase_if(all,
                [most](const fit::Constancy& c) { return !(c.probability < most) || !(c.scatter > 0.0); });
  return all;
}

void widen(const std::vector<fit::Constancy>& all, fit::DriveModel& model) {
  for (const auto& c : all) {
    const double variance = model.covariance(c.parameter, c.parameter);
    if (!(variance > 0.0)) continue;
    const double factor = std::sqrt(1.0 + c.scatter * c.scatter / variance);
    model.covariance.row(c.parameter) *= factor;
    model.covariance.col(c.parameter) *= factor;
  }
}

std::optional<diagnostics::Finding> inspect_constancy(const std::vector<fit::Constancy>& inconstant,
                                                      const fit::DriveModel& model, bool over_frequency) {
  const fit::Constancy* worst = nullptr;
  double largest = 0.0;
  for (const auto& c : inconstant) {
    if (c.over_frequency != over_frequency) continue;
    const double value = std::abs(model.value(static_cast<fit::Parameter>(c.parameter)));
    const double relative = value > 0.0 && essential(c.parameter) ? c.scatter / value : 0.0;
    if (worst != nullptr && relative <= largest) continue;
    worst = &c;
    largest = relative;
  }
  if (worst == nullptr) return std::nullopt;
  const bool moves = largest > kCriteria.constant_parameter;
  auto text = over_frequency ? fmt::format("The {} comes out different in different bands of frequency",
                                           parameter_words(worst->parameter))
                             : fmt::format("The {} is not the same throughout the recording",
                                           parameter_words(worst->parameter));
  if (largest > 0.0) text += fmt::format(": standard deviation {:.2g} %, beyond noise", 100.0 * largest);
  if (!moves)
    text += ". The error bars include it.";
  else if (over_frequency)
    text +=
        ". The model lacks something that the machine or its measurement has, such as the lag of a torque "
        "loop, a "
        "filter, friction, or a further mass: the result is not reliable. Give them (.model, "
        ".friction), or a narrower .band_hz.";
  else
    text +=
        ". One value cannot describe the machine: follow it with track, or take a part (.from_s, .to_s) in "
        "which it "
        "stands, moves or is loaded alike.";
  return diagnostics::Finding{over_frequency ? "differs-over-frequency" : "changes-within-recording",
                              moves ? Severity::error : Severity::info, largest, kCriteria.constant_parameter,
                              std::move(text)};
}

std::optional<diagnostics::Finding> inspect_outliers(const fit::OutputErrorFit& fit, double sample_time_s,
                                                     const data::OutputHold& hold) {
  const auto white = fit::whiten(fit.residual, fit.noise);
  const std::size_t begin = fit.first_sample + fit.noise.order();
  constexpr double kRounding = 1e-4;  // per cent of the output that a fit leaves
  if (fit.fit_percent > 100.0 - kRounding) return std::nullopt;
  std::vector<double> sizes;
  for (std::size_t k = 0; k < white.size(); ++k)
    if (hold.is_new(begin + k)) sizes.push_back(std::abs(white[k]));
  constexpr double kGaussian = 0.6745;  // median of |e| over the standard deviation
  const double deviation = median(sizes) / kGaussian;
  std::size_t count = 0, first = 0;
  for (std::size_t k = 0; k < sizes.size(); ++k)
    if (sizes[k] > kCriteria.outlier * deviation && count++ == 0) first = k;
  const double share =
      static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(1, sizes.size()));
  if (!(deviation > 0.0) || count < kCriteria.fewest_outliers || share < kCriteria.outlier_share)
    return std::nullopt;
  return diagnostics::Finding{
      "disturbed-samples", Severity::error, share, kCriteria.outlier_share,
      fmt::format(
          "{} samples, the first after {:.4g} s, lie beyond {:g} standard deviations of the noise: samples "
          "are "
          "missing or doubled, impacts or load steps disturb the drive, or it does something that the model "
          "lacks. Take a part without them (.from_s, .to_s), or record without losses.",
          count, static_cast<double>(begin + first * hold.samples) * sample_time_s, kCriteria.outlier)};
}

}  // namespace resonid::identification::detail
