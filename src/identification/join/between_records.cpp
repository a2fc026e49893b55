// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/identify/judge/constancy.hpp>
#include <identification/join/between_records.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <vector>

namespace resonid::identification::detail {
namespace {

/// One parameter in all records.
struct Values {
  double weight = 0.0, sum = 0.0, squares = 0.0, weights_squared = 0.0;
  std::size_t count = 0;

  void add(const data::Estimate& e) {
    if (!(e.std > 0.0) || !std::isfinite(e.std)) return;
    const double w = 1.0 / (e.std * e.std);
    weight += w;
    sum += w * e.value;
    squares += w * e.value * e.value;
    weights_squared += w * w;
    ++count;
  }
  /// Squared distances to the weighted mean.
  [[nodiscard]] double chi_square() const { return std::max(0.0, squares - sum * sum / weight); }
  [[nodiscard]] fit::Constancy constancy(int parameter) const {
    fit::Constancy c;
    c.parameter = parameter;
    const auto degrees = count - 1;
    c.probability = chi_square_tail(chi_square(), degrees);
    c.scatter = std::sqrt(
        std::max(0.0, (chi_square() - static_cast<double>(degrees)) / (weight - weights_squared / weight)));
    return c;
  }
};

}  // namespace

std::optional<diagnostics::Finding> include_scatter(std::span<const fit::DriveModel* const> own,
                                                    fit::DriveModel& joint) {
  if (own.size() < 2) return std::nullopt;
  std::vector<fit::Constancy> all;
  for (int i = 0; i < fit::kParameterCount; ++i) {
    if (!joint.estimated[static_cast<std::size_t>(i)]) continue;
    Values values;
    for (const auto* model : own) values.add(model->estimate(static_cast<fit::Parameter>(i)));
    if (values.count < 2) continue;
    all.push_back(values.constancy(i));
  }
  const auto scattered = inconstant(std::move(all));
  widen(scattered, joint);
  auto finding = inspect_constancy(scattered, joint, false);
  if (!finding) return finding;
  const bool moves = finding->severity == diagnostics::Severity::error;
  const double scatter = finding->value.value_or(0.0);
  finding->id = "differs-between-records";
  finding->meaning = fmt::format(
      "The recordings' own estimates differ beyond their error bars{}. {}",
      scatter > 0.0 ? fmt::format(" (standard deviation {:.2g} %)", 100.0 * scatter) : std::string(),
      moves ? "One value does not describe the machine: it changed between the "
              "recordings, or stood, moved or was loaded "
              "otherwise; compare tells what differs."
            : "The joint error bars include it.");
  return finding;
}

}  // namespace resonid::identification::detail
