// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/prepare/excitation_source.hpp>
#include <numeric>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/diagnostics/detail/feedback.hpp>
#include <resonid/response/detail/excitation_lines.hpp>

namespace resonid::identification::detail {
namespace {

/// A motion profile rises and falls a few times; what excites turns around all the time.
bool moves_often(const std::vector<double>& reference) {
  int turns = 0;
  double direction = 0.0;
  for (std::size_t k = 1; k < reference.size(); ++k) {
    const double step = reference[k] - reference[k - 1];
    if (step == 0.0) continue;
    if (step * direction < 0.0) ++turns;
    direction = step;
  }
  return turns >= kCriteria.excitation_turns;
}

/// What u lacks to be the controller's answer.
std::vector<double> reconstruct(const data::Record& record, const data::TransferFunction& controller) {
  std::vector<double> error(record.samples());
  for (std::size_t k = 0; k < error.size(); ++k)
    error[k] = (record.reference.present() ? record.reference.samples[k] : 0.0) - record.output.samples[k];
  auto excitation = controller.simulate(error);
  for (std::size_t k = 0; k < error.size(); ++k) excitation[k] = record.input.samples[k] - excitation[k];
  return excitation;
}

/// Without the constant and the ramp that the controller's state at the start and an unknown constant
/// reference leave. The excitation's own go with them: the rest is a little skew.
void detrend(std::vector<double>& x) {
  const double n = static_cast<double>(x.size());
  const double middle = 0.5 * (n - 1.0);
  double mean = 0.0, slope = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    mean += x[k] / n;
    slope += x[k] * (static_cast<double>(k) - middle);
  }
  slope /= n * (n * n - 1.0) / 12.0;
  for (std::size_t k = 0; k < x.size(); ++k) x[k] -= mean + slope * (static_cast<double>(k) - middle);
}

bool repeats(const data::Record& record) {
  const auto period = response::detect_period(record);
  if (!period) return false;
  const auto& x = record.excitation.samples;
  std::vector<double> change(x.size() - *period);
  for (std::size_t k = 0; k < change.size(); ++k) change[k] = x[k + *period] - x[k];
  return variance(change) < kCriteria.exact_repetition * variance(x);
}

/// Whether the input holds noise that is fed back and the reconstructed excitation holds none any more.
bool is_what_feedback_leaves(const data::Record& record, double delay_s) {
  if (!(variance(record.excitation.samples) > kCriteria.excitation_share * variance(record.input.samples)))
    return false;
  const auto before = diagnostics::find_feedback(record, delay_s);
  if (!before || !before->present()) return false;
  data::Record without = record;
  without.input = record.excitation;
  const auto after = diagnostics::find_feedback(without, delay_s);
  return after && after->probability > kCriteria.feedback_false_alarm;
}

}  // namespace

ExcitationSource complete_excitation(data::Record& record, const Options& options) {
  if (record.excitation.present() && variance(record.excitation.samples) == 0.0) record.excitation = {};
  if (record.excitation.present()) return ExcitationSource::recorded;
  if (!record.input.present() || options.approach == Approach::direct) return ExcitationSource::none;
  if (options.controller && record.output_quantity == data::OutputQuantity::velocity) {
    record.excitation = {"u - C (r - y)", record.input.unit, reconstruct(record, *options.controller)};
    for (const bool raw : {true, false}) {
      if (!raw) detrend(record.excitation.samples);
      if (response::two_level(record.excitation.samples, kCriteria.reconstructed_level) ||
          response::detect_chirp(record) || repeats(record))
        return ExcitationSource::reconstructed;
    }
    record.excitation = {"u - C (r - y)", record.input.unit, reconstruct(record, *options.controller)};
    if (is_what_feedback_leaves(record, options.delay_s)) return ExcitationSource::reconstructed;
    record.excitation = {};
  }
  const bool joint = options.approach.value_or(Approach::joint) == Approach::joint;  // indirect needs ru
  if (joint && record.reference.present() && moves_often(record.reference.samples)) {
    record.excitation = {record.reference.name, record.reference.unit, record.reference.samples};
    return ExcitationSource::reference;
  }
  return ExcitationSource::none;
}

}  // namespace resonid::identification::detail
