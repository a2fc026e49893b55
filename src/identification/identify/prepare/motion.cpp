// SPDX-License-Identifier: MIT
#include <identification/criteria.hpp>
#include <identification/identify/prepare/motion.hpp>
#include <resonid/response/detail/excitation_lines.hpp>

namespace resonid::identification::detail {

std::optional<fit::InverseDynamics> motion_in(const data::Record& record, ExcitationSource source,
                                              const Options& options) {
  const bool known = source == ExcitationSource::recorded || source == ExcitationSource::reconstructed;
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
  if (!dry_friction || !(dry_friction->value > kCriteria.dry_friction_found * dry_friction->std))
    return std::nullopt;
  if (response::two_level(record.input.samples, kCriteria.recorded_level) || response::detect_chirp(record))
    return std::nullopt;
  return std::move(*found);
}

}  // namespace resonid::identification::detail
