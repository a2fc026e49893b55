// SPDX-License-Identifier: MIT
#include "identification/tune/usable.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "linalg/decompositions.hpp"

namespace resonid::identification {
namespace {

std::string whose(const Result& result) {
  return result.record.file.empty() ? "the result" : "the result of " + result.record.file;
}

/// "uncertain-resonance (The resonance at 71.6 Hz is known to 22 % only)", of every error.
std::string error_findings(const Result& result) {
  std::string text;
  for (const auto& finding : result.findings) {
    if (finding.severity != diagnostics::Severity::error) continue;
    std::string meaning = finding.meaning;
    if (meaning.ends_with('.')) meaning.pop_back();
    text += (text.empty() ? "" : "; ") + finding.id + (meaning.empty() ? "" : " (" + meaning + ")");
  }
  return text;
}

expected<void, Error> check_trust(const Result& result, const TuneOptions& options) {
  if (result.trusted || options.force) return {};
  const std::string why = error_findings(result);
  return refuse("results", fmt::format("{} is not trusted{}; cure that, or give .force, which marks every "
                                       "output",
                                       whose(result), why.empty() ? "" : ": " + why));
}

/// What is estimated, in the order that a result file has.
std::vector<int> spread_parameters(const fit::DriveModel& model) {
  std::vector<int> list;
  for (int i = 0; i < fit::kParameterCount; ++i)
    if (model.estimated[static_cast<std::size_t>(i)]) list.push_back(i);
  return list;
}

std::string_view parameter_name(int i) { return fit::kParameterNames[static_cast<std::size_t>(i)]; }

/// Only a file that was changed by hand or by another program has such a one. What is not known, or not
/// finite, is judged by others.
expected<void, Error> check_covariance(const Result& result) {
  constexpr double kRounding = 1e-6;  // of a correlation
  const auto& model = result.model->drive;
  const auto& c = model.covariance;
  const auto all = spread_parameters(model);
  for (const int i : all)
    if (c(i, i) < 0.0)
      return refuse("results", fmt::format("{} has a negative variance of {} in the covariance of its model, "
                                           "{:.3g}: required 0 or more; identify it anew",
                                           whose(result), parameter_name(i), c(i, i)));
  for (const int i : all)
    for (const int j : all)
      if (j > i && std::abs(c(i, j) - c(j, i)) > kRounding * std::sqrt(c(i, i) * c(j, j)))
        return refuse("results",
                      fmt::format("{} has a covariance of its model that is not symmetric: of {} with {} it "
                                  "is {:.3g}, of {} with {} {:.3g}; identify it anew",
                                  whose(result), parameter_name(i), parameter_name(j), c(i, j),
                                  parameter_name(j), parameter_name(i), c(j, i)));
  std::vector<int> known;
  for (const int i : all)
    if (c(i, i) > 0.0 && c.row(i).allFinite() && c.col(i).allFinite()) known.push_back(i);
  if (known.empty()) return {};
  const auto count = static_cast<Eigen::Index>(known.size());
  Eigen::MatrixXd correlation(count, count);
  for (Eigen::Index k = 0; k < count; ++k)
    for (Eigen::Index l = 0; l < count; ++l) {
      const int i = known[static_cast<std::size_t>(k)], j = known[static_cast<std::size_t>(l)];
      correlation(k, l) = 0.5 * (c(i, j) + c(j, i)) / std::sqrt(c(i, i) * c(j, j));
      if (std::abs(correlation(k, l)) > 1.0 + kRounding)
        return refuse("results", fmt::format("{} has a covariance of {} with {}, {:.3g}, that is larger than "
                                             "their variances, {:.3g} and {:.3g}, allow; identify it anew",
                                             whose(result), parameter_name(i), parameter_name(j), c(i, j),
                                             c(i, i), c(j, j)));
    }
  const auto axes = linalg::symmetric_eigenpairs(correlation);
  Eigen::Index least = 0;
  if (axes.values.minCoeff(&least) >= -kRounding) return {};
  Eigen::Index most = 0;
  axes.vectors.col(least).cwiseAbs().maxCoeff(&most);
  return refuse(
      "results",
      fmt::format("{} has a covariance of its model that is not positive semi-definite, near {}: no "
                  "machines are spread like that; identify it anew",
                  whose(result), parameter_name(known[static_cast<std::size_t>(most)])));
}

/// A loop acts by what it commands: what answers earlier was measured behind it.
expected<void, Error> check_ahead(const Result& result) {
  const auto& model = result.model->drive;
  const double delay_s = model.known_delay_s + model.delay_s;
  if (delay_s >= -0.01 * model.sample_time_s) return {};
  if (model.known_delay_s > 0.0)
    return refuse("results",
                  fmt::format("{} has a delay of {:.4g} ms, required 0 or more: it shows {:.4g} ms "
                              "less than the {:.4g} ms that were given; identify it with the "
                              "delay that it has, or without .delay_s",
                              whose(result), 1e3 * delay_s, -1e3 * model.delay_s, 1e3 * model.known_delay_s));
  return refuse("results",
                fmt::format("{} has a delay of {:.4g} ms, required 0 or more: its output comes earlier than "
                            "its input, which was measured and not commanded (input-ahead). What passes from "
                            "command to torque is missing in it, and a loop has that; identify it with the "
                            "commanded torque as .input",
                            whose(result), 1e3 * delay_s));
}

expected<void, Error> check_ascending(const std::vector<double>& positions) {
  for (std::size_t i = 1; i < positions.size(); ++i)
    if (!(positions[i] > positions[i - 1]))
      return refuse("positions",
                    fmt::format("must ascend: {:g} comes behind {:g}", positions[i], positions[i - 1]));
  return {};
}

}  // namespace

expected<void, Error> check_usable(std::span<const Result> results, const TuneOptions& options) {
  if (auto checked = check_ascending(options.positions); !checked) return checked;
  for (const Result& result : results) {
    if (auto checked = check_trust(result, options); !checked) return checked;
    if (!result.model) continue;
    if (auto checked = check_covariance(result); !checked) return checked;
    if (auto checked = check_ahead(result); !checked) return checked;
  }
  return {};
}

}  // namespace resonid::identification
