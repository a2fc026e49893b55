// SPDX-License-Identifier: MIT
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/prepare/motion.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/response/detail/excitation_lines.hpp>

namespace resonid::identification::detail {
namespace {

/// Whether the output goes where a reference of its kind leads it.
bool follows_reference(const data::Record& record) {
  if (!record.reference.present()) return false;
  const auto& r = record.reference.samples;
  const auto& y = record.output.samples;
  const double of_r = mean(r), of_y = mean(y);
  double together = 0.0;
  for (std::size_t k = 0; k < y.size(); ++k) together += (r[k] - of_r) * (y[k] - of_y);
  together /= static_cast<double>(y.size());
  return together > kCriteria.followed_reference * std::sqrt(variance(r) * variance(y));
}

}  // namespace

std::optional<fit::InverseDynamics> motion_in(const data::Record& record, ExcitationSource source,
                                              const Options& options) {
  // A reference that turns so often excites; what a controller's rounded signals leave over does not.
  const bool led = source != ExcitationSource::reference && follows_reference(record);
  const bool known =
      source == ExcitationSource::recorded || (source == ExcitationSource::reconstructed && !led);
  const bool named = options.chirp || options.period_samples != 0 || !options.lines_hz.empty() ||
                     (options.excitation_type != ExcitationType::automatic &&
                      options.excitation_type != ExcitationType::other);
  const bool dry = options.friction != Friction::none && options.friction != Friction::viscous;
  if (known || named || !dry || record.output_quantity == data::OutputQuantity::acceleration)
    return std::nullopt;
  fit::InverseDynamicsConfig config;
  config.known_delay_s = options.delay_s;
  config.viscous_friction = options.friction != Friction::dry;
  auto found = fit::fit_inverse_dynamics(record, config);
  if (!found || !(found->share > kCriteria.motion_share)) return std::nullopt;
  const auto& dry_friction = found->coulomb_friction;
  const bool found_dry =
      dry_friction && dry_friction->value > kCriteria.dry_friction_found * dry_friction->std;
  if (!found_dry && !led) return std::nullopt;
  if (response::two_level(record.input.samples, kCriteria.recorded_level) || response::detect_chirp(record))
    return std::nullopt;
  return std::move(*found);
}

}  // namespace resonid::identification::detail
