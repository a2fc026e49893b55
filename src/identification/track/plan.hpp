// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/prepare/plan.hpp>
#include <optional>
#include <resonid/fit/drive_model.hpp>
#include <resonid/identification/track.hpp>
#include <string>
#include <vector>

namespace resonid::identification::detail {

/// Whether a method follows the response at lines, without a model to begin with.
[[nodiscard]] constexpr bool is_lines(TrackMethod m) {
  return m == TrackMethod::kalman || m == TrackMethod::sliding_dft;
}

/// Whether a method may begin with a machine that does not oscillate.
[[nodiscard]] constexpr bool follows_rigid(TrackMethod m) {
  return m == TrackMethod::arx || m == TrackMethod::instrumental_variables;
}

/// Coulomb friction is asked for.
[[nodiscard]] inline bool estimates_dry_friction(const TrackOptions& o) {
  return o.common.friction == Friction::dry || o.common.friction == Friction::both;
}

/// Where estimators begin.
struct StartModel {
  fit::DriveModel drive;
  std::string source;   ///< In words.
  bool trusted = true;  ///< False: what was identified there is not to be trusted itself.
};

/// What will be done with a record, every choice made.
struct TrackPlan {
  std::size_t learned_samples = 0;             ///< Length of the stretch.
  TrackMethod method = TrackMethod::physical;  ///< Never automatic.
  Approach approach = Approach::direct;
  std::string reason;  ///< Why it was chosen.
  Plan measurement;    ///< Excitation, band, lines.
  std::optional<StartModel> start;
  double delay_s = 0.0;  ///< In the measured output: the known one, and what the start model found beyond it.
};

/// Why a method cannot follow such a record with these options; of the record only quantity and excitation
/// are looked at.
[[nodiscard]] std::optional<Error> contradiction(const data::Record& record, const TrackOptions& options,
                                                 TrackMethod method);

/// Length of the first learning stretch; those that follow are each twice as long.
[[nodiscard]] std::size_t first_stretch(const data::Record& head, const TrackOptions& options);

/// What a learning stretch decides; nothing when a longer one must tell. `final`: what it shows is taken as
/// it is, a model that is not certain or has no resonance too; there is none then only where nothing shows at
/// all.
[[nodiscard]] expected<std::optional<TrackPlan>, Error> make_track_plan(const data::Record& stretch,
                                                                        const TrackOptions& options,
                                                                        bool final);

/// From the options, else identified on the stretch: a two-mass model that is trusted, whose resonance was
/// seen eight times and is known to 1 %; if `final`, any.
[[nodiscard]] std::optional<StartModel> find_start(const data::Record& stretch, const TrackOptions& options,
                                                   const Plan& plan, bool final);

/// The law of a chirp in whose midst the stretch ends, to the edge of the band that sampling allows: found in
/// the stretch and, the same, in its first half.
[[nodiscard]] std::optional<online::SweepLaw> running_sweep(const data::Record& stretch,
                                                            const online::SweepLaw& found);

/// Lines of a periodic excitation, those of the band if one is given.
[[nodiscard]] std::vector<double> excited_lines_hz(const data::Record& stretch, const TrackPlan& plan,
                                                   const Options& options);

}  // namespace resonid::identification::detail
