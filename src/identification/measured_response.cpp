// SPDX-License-Identifier: MIT
#include <cmath>
#include <identification/measured_response.hpp>

namespace resonid::identification::detail {
namespace {

expected<MeasuredResponse, Error> by_the_plan(const data::Record& record, const Plan& plan,
                                              const Options& options) {
  auto measured = measure(record, plan, options);
  if (!measured) return tl::unexpected(measured.error());
  auto response =
      response::plant_response(measured->lines, {plan.approach, options.controller, options.delay_s});
  if (!response) return tl::unexpected(Error{"approach", std::string(response.error().requirement)});
  return MeasuredResponse{std::move(*measured), std::move(*response)};
}

/// Share of the lines that are known better than by half.
double usable(const data::FrequencyResponse& g) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < g.lines(); ++i)
    count += g.standard_deviation[i] < 0.5 * std::abs(g.value[i]) ? 1 : 0;
  return static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(1, g.lines()));
}

}  // namespace

expected<MeasuredResponse, Error> measure_response(const data::Record& record, Plan& plan,
                                                   const Options& options, std::vector<Choice>& choices) {
  auto first = by_the_plan(record, plan, options);
  constexpr double kNextToNothing = 0.05, kClearlyMore = 2.0;
  const bool averages = plan.method == Method::periodic || plan.method == Method::welch;
  if (!first || !averages || options.method != Method::automatic) return first;
  const double before = usable(first->response);
  if (before > kNextToNothing) return first;
  auto other = plan;
  other.method = Method::local_polynomial;
  auto second = by_the_plan(record, other, options);
  if (!second || usable(second->response) < kClearlyMore * before) return first;
  plan = std::move(other);
  for (auto& choice : choices)
    if (choice.what == "method")
      choice = {"method", name_of(plan.method),
                "averages leave hardly a line: the machine moves in a rhythm of its own; local polynomials "
                "take that "
                "out"};
  return second;
}

}  // namespace resonid::identification::detail
