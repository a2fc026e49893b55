// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <identification/identify/measure/methods.hpp>
#include <identification/identify/measure/thinned.hpp>
#include <identification/identify/select/record_fit.hpp>
#include <identification/identify/select/variant.hpp>
#include <optional>
#include <resonid/fit/output_error.hpp>
#include <resonid/fit/response_fit.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace resonid::identification::detail {

/// What a variant may have beside its structure.
inline constexpr std::array kExtras = {fit::kViscousFriction,     fit::kDelay,
                                       fit::kLoadViscousFriction, fit::kTorqueLag,
                                       fit::kOutputFilter,        fit::kMotorGroundStiffness,
                                       fit::kLoadGroundStiffness};

/// One structure: what the response says of its variants, and the best fit to the records if there is one.
struct DriveCandidate {
  fit::Structure structure = fit::Structure::two_mass;
  std::vector<std::pair<Variant, fit::ResponseFit>> variants;  ///< Best first.
  std::optional<RecordFit> record_fit;
  Variant record_variant;
  bool tried_on_record = false;
  std::optional<fit::HoldoutFit> validated;  ///< The same variant, fitted to the rest of the record.
  std::string remark;                        ///< Why it went no further.
  /// The model with the spring to the ground on the other side, where that one is as likely.
  std::optional<fit::DriveModel> other_side;

  [[nodiscard]] const fit::ResponseFit& response_fit() const { return variants.front().second; }
  [[nodiscard]] const Variant& variant() const {
    return record_fit ? record_variant : variants.front().first;
  }
  [[nodiscard]] const fit::DriveModel& model() const {
    return record_fit ? record_fit->model : response_fit().model;
  }
};

/// How far a model (its fitted delay included) is from the measured response, relative, over the lines that
/// are measured better than 50 %: whole, and beyond what noise explains with a probability of 0.1 %. Both
/// from the median of the squares (for Gaussian errors ln 2 of their mean), since a few lines in the
/// anti-resonance would rule a mean.
struct Difference {
  double whole = 0.0;
  double unexplained = 0.0;
};
[[nodiscard]] Difference difference(const fit::DriveModel& model, const data::FrequencyResponse& response);
/// The same of a model's values at the lines.
[[nodiscard]] Difference difference(const std::vector<std::complex<double>>& fitted,
                                    const data::FrequencyResponse& response);

/// Whether the fit to the record is so much worse than a rival's that no more time is spent on it.
[[nodiscard]] bool is_astray(const DriveCandidate& candidate, const DriveCandidate& rival);

/// Whether the band shows every mode: one that nothing in it shows is idle parameters of a simpler machine.
[[nodiscard]] bool modes_are_seen(const fit::DriveModel& model, const Plan& plan);

/// Fits the variants of one structure, to the response and from there to the record, or to several records in
/// one likelihood. Beside the response's fits, `starts` of the same structure begin those to the records.
class CandidateFits {
 public:
  CandidateFits(std::span<const data::Record> records, const Plan& plan, const Options& options,
                const data::FrequencyResponse& response, std::span<const fit::DriveModel> starts,
                bool to_records);

  [[nodiscard]] const data::FrequencyResponse& response() const { return response_; }

  /// Fits to the response with and without friction and a further delay, best first. Only the variant `like`
  /// when that is given: a structure of more masses is tried as the simpler one came out.
  [[nodiscard]] DriveCandidate fit_to_response(fit::Structure structure, const Variant* like = nullptr) const;

  /// From the response's fits to the record's. A fit is kept unless it contradicts the
  /// measured response: then the drive is not what the likelihood assumes (non-linear friction, a disturbance
  /// that looks like a response). One that simulates the record clearly better than the response's own model
  /// does not contradict, it corrects. Beside a `larger` one far ahead a rigid drive has its first variant
  /// only.
  void fit_to_record(DriveCandidate& candidate, const DriveCandidate* larger) const;

  /// Tries dry friction and further parameters, unless a rival of other structure is far better.
  void extend_fit_to_record(DriveCandidate& candidate, const DriveCandidate* rival) const;

  /// Fits two masses to the record without a start from the response, which may not show the resonance of a
  /// short or noisy record.
  void fit_to_record_alone(const DriveCandidate& rigid, DriveCandidate& two_mass) const;

  /// Two masses on a spring to the ground move the driven side nearly alike whichever side it holds: only
  /// damping and friction differ. Fits the other side too, takes it where it is the better, and tells it
  /// where neither is clearly so.
  void contest_ground(DriveCandidate& candidate) const;

  /// The candidate's own variant fitted without the hold-out samples, and judged by them. Dry friction acts
  /// as the whole record showed it: one or two numbers of thousands of samples.
  void validate(DriveCandidate& candidate) const;

  /// A structure that is out of the question, as the chosen one was fitted: for the comparison side by side.
  /// Dry friction acts as it was found with the chosen one.
  void for_comparison(DriveCandidate& candidate, const DriveCandidate& chosen) const;

  /// A candidate that was chosen on stretches of the record fitted to all of it, and what more its score
  /// tests ask for. Says whether that came out.
  [[nodiscard]] bool fit_chosen(DriveCandidate& candidate) const;

 private:
  /// What a fit to the record must hold against the measured response.
  struct Acceptance {
    bool by_the_lines = true;  ///< False: the lines have already said that the drive is not linear.
    double difference = 0.0;   ///< Largest one.
    double fit_percent = 0.0;  ///< That of the simulation with which a larger one is a correction.
  };
  [[nodiscard]] bool allowed(bool viscous_friction) const;
  [[nodiscard]] bool friction_is_free() const { return options_.friction == Friction::automatic; }
  /// What every model of the structure has, since the user says so.
  [[nodiscard]] std::vector<fit::Parameter> demanded(fit::Structure structure) const;
  /// Whether the search may add the parameter to the variant.
  [[nodiscard]] bool offered(const Variant& variant, fit::Parameter parameter) const;
  [[nodiscard]] std::vector<Variant> instead_of_delay(const Variant& variant, bool combined) const;
  /// What a variant does not estimate, it must not inherit either.
  [[nodiscard]] fit::DriveModel start_of(const Variant& variant, fit::DriveModel model) const;
  /// Fits to the response with and without friction and delay.
  void add_variants(DriveCandidate& candidate, const std::vector<fit::Parameter>& further,
                    const Variant* like) const;
  void add_likely_variants(DriveCandidate& candidate) const;
  /// Adds, one after the other, the parameters that pay: to the response's best fit, to the record's.
  void extend_by_response(DriveCandidate& candidate) const;
  /// Adds the variant with a filter of the measured velocity where none without it holds.
  void add_filtered(DriveCandidate& candidate) const;
  void extend_by_record(DriveCandidate& candidate, bool instead_of_others = true) const;
  /// Variants that the response rules out beside the one that was found.
  void drop_ruled_out(std::vector<Variant>& variants, const Variant& own, const fit::DriveModel& found) const;
  /// A fit along which dry friction acts as it was found, beginning with the noise of that fit.
  [[nodiscard]] fit::OutputErrorConfig as_it_slides(const Variant& variant, const fit::DriveModel& start,
                                                    const RecordFit& found) const;
  /// The fits that are compared to choose an extension.
  [[nodiscard]] std::optional<RecordFit> fit_to_records_as_it_slides(const Variant& variant,
                                                                     const fit::DriveModel& start,
                                                                     const RecordFit& found) const;
  /// `near`: the start is the fit of a variant with little less.
  [[nodiscard]] std::optional<fit::ResponseFit> response_fit(const Variant& variant,
                                                             const std::optional<fit::DriveModel>& start,
                                                             bool near = false) const;
  /// Dry friction of a start that is near; a variant takes from it what it has.
  struct FrictionStart {
    double coulomb = 0.0;
    fit::FurtherFriction further;
  };
  [[nodiscard]] static std::optional<FrictionStart> friction_of(const RecordFit& fit);
  [[nodiscard]] fit::OutputErrorConfig config_of(
      const Variant& variant, const fit::DriveModel& start,
      const std::optional<FrictionStart>& dry = std::nullopt) const;
  /// `near`: a fit whose noise is nearly that of this one.
  [[nodiscard]] std::optional<RecordFit> fit_to_records(
      const Variant& variant, const fit::DriveModel& start,
      const std::optional<FrictionStart>& dry = std::nullopt, const RecordFit* near = nullptr) const;
  void judge_by_holdout(DriveCandidate& candidate, fit::OutputErrorConfig config) const;
  [[nodiscard]] Acceptance acceptance(const DriveCandidate& candidate) const;
  void fit_variants(DriveCandidate& candidate, const Acceptance& acceptable,
                    const DriveCandidate* larger) const;
  [[nodiscard]] bool dry_friction_is_likely(const DriveCandidate& candidate) const;
  [[nodiscard]] std::optional<RecordFit> with_dry_friction(Variant& variant,
                                                           const fit::DriveModel& start) const;
  /// The same of the load alone, where a fit that found none on the driven side says so.
  [[nodiscard]] std::optional<RecordFit> with_load_friction(Variant& variant, const RecordFit& told) const;
  void try_dry_friction(DriveCandidate& candidate) const;
  /// Adds dry friction on the load, or that falls with the speed, as score tests say that it pays.
  void extend_dry_friction(Variant& variant, RecordFit& fit) const;
  /// Leaves out what stood for the dry friction that was added.
  void drop_imitations(Variant& variant, RecordFit& fit) const;
  [[nodiscard]] const data::Record& record_of_most_output_energy() const;

  std::span<const data::Record> records_;
  const Plan& plan_;
  const Options& options_;
  const data::FrequencyResponse response_;
  std::span<const fit::DriveModel> starts_;
  const bool to_records_;
};

}  // namespace resonid::identification::detail
