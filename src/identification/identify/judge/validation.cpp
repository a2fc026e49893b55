// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/identify/judge/validation.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/diagnostics/residuals.hpp>

namespace resonid::identification::detail {
namespace {

void of_record(const data::Record& record, double fit_percent, std::vector<double> residual,
               std::size_t residual_start, std::size_t order, Result& result) {
  const auto simulated = diagnostics::simulated_of(record.output.samples, residual);
  const double further = result.black_box && result.black_box->further_delay
                             ? std::max(0.0, result.black_box->further_delay->value)
                             : 0.0;
  const auto delay =
      static_cast<std::size_t>(std::lround((result.known_delay_s + further) * record.sample_rate_hz));
  const auto test = diagnostics::test_residual({residual, simulated, {}, {}}, 40 + delay, order + delay);
  result.validation =
      Validation{fit_percent, true, test.with_simulated.largest, test.limit, std::hypot(test.mean, test.rms)};
  result.residual = std::move(residual);
  result.residual_start = residual_start;
}

void of_lines(const response::LineEstimates& lines, Result& result) {
  const auto fitted = result.model->drive.values(result.response.frequency_hz, true);
  double residual = 0.0, total = 0.0;
  for (std::size_t i = 0; i < fitted.size() && i < lines.lines.size(); ++i) {
    const double power = std::norm(lines.lines[i].input);
    residual += power * std::norm(result.response.value[i] - fitted[i]);
    total += power * std::norm(result.response.value[i]);
  }
  if (total > 0.0)
    result.validation =
        Validation{fit_percent_of(residual, total), false, std::nullopt, std::nullopt, std::nullopt};
}

}  // namespace

void put_validation(const data::Record& record, const response::LineEstimates& lines, Fitted fitted,
                    Result& result) {
  if (auto& box = fitted.black_box; box && box->residual.empty())
    result.validation = Validation{box->result.fit_percent, true, std::nullopt, std::nullopt, std::nullopt};
  else if (box)
    of_record(record, box->result.fit_percent, std::move(box->residual), box->residual_start,
              box->result.model.transfer_function.denominator.size() - 1, result);
  else if (auto& drive = fitted.drive; drive && !drive->residual.empty())
    of_record(record, drive->fit_percent, std::move(drive->residual), drive->residual_start,
              static_cast<std::size_t>(fit::order_of(drive->result.drive.structure)), result);
  else if (drive && !drive->in_motion && result.response.lines() == lines.lines.size())
    of_lines(lines, result);
}

}  // namespace resonid::identification::detail
