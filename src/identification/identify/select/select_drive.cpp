// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/constancy.hpp>
#include <identification/identify/judge/slipped_samples.hpp>
#include <identification/identify/select/drive_candidate.hpp>
#include <identification/identify/select/select_drive.hpp>
#include <identification/identify/select/stretches.hpp>
#include <identification/progress.hpp>
#include <limits>
#include <resonid/diagnostics/residuals.hpp>

namespace resonid::identification::detail {
namespace {

using fit::Structure;
using Candidate = DriveCandidate;

std::vector<Structure> structures(ModelChoice choice) {
  switch (choice) {
    case ModelChoice::rigid:
      return {Structure::rigid};
    case ModelChoice::two_mass:
      return {Structure::two_mass};
    case ModelChoice::three_mass:
      return {Structure::three_mass};
    default:
      return {Structure::rigid, Structure::two_mass, Structure::three_mass};
  }
}

class Selector {
 public:
  /// `whole`: the one that the records are stretches of, if so; the chosen model is fitted to it.
  Selector(std::span<const data::Record> records, const Plan& plan, const Options& options,
           const data::FrequencyResponse& response, std::span<const fit::DriveModel> starts, bool to_records,
           const data::Record* whole = nullptr)
      : records_(records),
        whole_(whole),
        plan_(plan),
        options_(options),
        starts_(starts),
        fits_(records, plan, options, response, starts, to_records) {}

  std::optional<Selection> run() {
    std::vector<Candidate> candidates;
    for (const Structure structure : structures(options_.model)) {
      tell(options_, fmt::format("fitting a {} model to the response", fit::name_of(structure)));
      const bool after_two = structure == Structure::three_mass && !candidates.empty();
      if (after_two && !misfit_is_significant(candidates.back())) continue;
      auto candidate =
          fits_.fit_to_response(structure, after_two ? &candidates.back().variants.front().first : nullptr);
      if (candidate.variants.empty()) continue;
      candidates.push_back(std::move(candidate));
      if (structure == Structure::rigid && options_.model == ModelChoice::automatic) continue;
      if (candidates.size() > 1) discard_unidentifiable(candidates);
      std::vector<std::size_t> fitted;  // the largest first
      for (std::size_t i = candidates.size(); i-- > 0;)
        if (candidates[i].remark.empty() && !candidates[i].record_fit && !candidates[i].tried_on_record) {
          tell_record_fit(candidates[i]);
          fits_.fit_to_record(candidates[i], i + 1 < candidates.size() ? &candidates[i + 1] : nullptr);
          fitted.push_back(i);
        }
      for (const std::size_t i : fitted) {
        const bool larger = i > 0;
        const Candidate* rival = candidates.size() == 1 ? nullptr : &candidates[larger ? i - 1 : i + 1];
        tell_further(candidates[i]);
        fits_.extend_fit_to_record(candidates[i], rival);
      }
      if (candidates.back().remark.empty()) fits_.contest_ground(candidates.back());
      if (candidates.size() > 1) discard_unobserved(candidates);
      if (structure == Structure::two_mass && candidates.size() == 2 &&
          !(candidates[0].record_fit && !misfit_is_significant(*candidates[0].record_fit)))
        fits_.fit_to_record_alone(candidates[0], candidates[1]);
    }
    if (candidates.empty()) return std::nullopt;
    if (candidates.size() == 1 && !candidates[0].tried_on_record) {
      tell_record_fit(candidates[0]);
      fits_.fit_to_record(candidates[0], nullptr);
      tell_further(candidates[0]);
      fits_.extend_fit_to_record(candidates[0], nullptr);
    }
    tell(options_, "comparing the models on hold-out data");
    for (std::size_t i = 0; i < candidates.size(); ++i)
      if (candidates[i].record_fit && (i == 0 || !is_astray(candidates[i], candidates[i - 1])))
        fits_.validate(candidates[i]);
    std::size_t chosen = candidates.size();
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (!candidates[i].remark.empty()) continue;
      if (chosen == candidates.size() || better_by_holdout_or_bic(candidates[i], candidates[chosen]))
        chosen = i;
    }
    // The rigid machine costs little and shows what the mode is worth.
    constexpr std::size_t kQuick = 50'000;
    for (auto& candidate : candidates)
      if (candidate.structure == Structure::rigid && !candidate.record_fit && candidates[chosen].record_fit &&
          whole_ == nullptr && records_.front().samples() <= kQuick)
        fits_.for_comparison(candidate, candidates[chosen]);
    return finish(candidates, chosen);
  }

 private:
  void tell_record_fit(const Candidate& c) const {
    tell(options_, fmt::format("fitting a {} model to the recording", fit::name_of(c.structure)));
  }
  void tell_further(const Candidate& c) const {
    tell(options_, fmt::format("{} model: friction, delay and lags", fit::name_of(c.structure)));
  }

  /// Whether a third mass is worth a try: two are seen and leave something unexplained, of the record if a
  /// model could be fitted to it, else of the response.
  [[nodiscard]] bool misfit_is_significant(const Candidate& two) const {
    if (two.structure != Structure::two_mass || !two.remark.empty()) return false;
    if (!two.record_fit) {
      return two.response_fit().model_error > kCriteria.explained_response;
    }
    return misfit_is_significant(*two.record_fit);
  }

  /// Whether the residual of any record follows what the model simulates.
  [[nodiscard]] bool misfit_is_significant(const RecordFit& of_records) const {
    if (of_records.fit_percent > kCriteria.explained_record) return false;
    constexpr std::size_t kLags = 40;
    for (std::size_t i = 0; i < records_.size(); ++i) {
      const auto& fit = of_records.records[i];
      const auto simulated = diagnostics::simulated_of(records_[i].output.samples, fit.residual);
      const auto test = diagnostics::test_residual({fit.residual, simulated, {}, {}}, kLags, kLags);
      if (test.with_simulated.largest > kCriteria.residual_beyond_chance * test.limit) return true;
    }
    return false;
  }

  /// Whether the candidate of more masses is better: on the hold-out samples where both could be judged by
  /// them, else by the BIC of the record, else by that of the lines.
  bool better_by_holdout_or_bic(const Candidate& larger, const Candidate& smaller) const {
    if (smaller.validated && larger.validated) {
      const double gain = smaller.validated->score - larger.validated->score;
      const double of_all = smaller.record_fit->bic - larger.record_fit->bic;
      // A small loss there against a large gain over the whole record is chance.
      const bool contradicted =
          gain > 0.0 ? of_all < -kCriteria.contradicted * gain : of_all > -kCriteria.contradicted * gain;
      if (std::abs(gain) > kCriteria.holdout_clear && !contradicted) return gain > 0.0;
    }
    if (smaller.validated && !larger.validated) return false;
    if (smaller.record_fit && larger.record_fit) return larger.record_fit->bic < smaller.record_fit->bic;
    // Lines tell the same thing more than once, and a third mass finds something to explain in any bias.
    const double least = larger.structure == Structure::three_mass ? kCriteria.biased_lines : 0.0;
    const double repeated = larger.response_fit().repetition;
    return larger.response_fit().bic_for(repeated) + least < smaller.response_fit().bic_for(repeated);
  }

  /// Discards fits to the record that have moved a mode to where the band does not show it.
  void discard_unobserved(std::vector<Candidate>& candidates) const {
    const auto open = [](const Candidate& c) { return c.remark.empty(); };
    for (auto& c : candidates)
      if (c.structure != Structure::rigid && open(c) && c.record_fit &&
          std::count_if(candidates.begin(), candidates.end(), open) > 1 &&
          !modes_are_seen(c.record_fit->model, plan_)) {
        c.record_fit.reset();
        c.remark = "has a resonance that the measured band does not show";
      }
  }

  /// Discards structures with a mode that the band does not show, or that the response's BIC rules out: no
  /// fits to the record are spent on them.
  void discard_unidentifiable(std::vector<Candidate>& candidates) const {
    for (auto& candidate : candidates)
      if (candidate.remark.empty() && candidate.structure != Structure::rigid &&
          !modes_are_seen(candidate.response_fit().model, plan_))
        candidate.remark = "has a resonance that the measured band does not show";
    double least = std::numeric_limits<double>::infinity();
    for (const auto& candidate : candidates)
      if (candidate.remark.empty()) least = std::min(least, candidate.response_fit().bic);
    for (auto& candidate : candidates)
      if (candidate.remark.empty() && !candidate.record_fit &&
          candidate.response_fit().bic > least + kCriteria.ruled_out)
        candidate.remark = "the measured response rules it out";
  }

  std::vector<StructureTrial> trials_of(const std::vector<Candidate>& candidates, std::size_t chosen) const {
    std::vector<StructureTrial> trials;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const auto& c = candidates[i];
      const auto& mask = c.model().estimated;
      StructureTrial trial;
      trial.name = name_of(c.variant());
      trial.parameters = static_cast<std::size_t>(std::count(mask.begin(), mask.end(), true));
      // Those of record and response are no match for one another.
      const bool same = c.record_fit.has_value() == candidates[chosen].record_fit.has_value();
      trial.bic = !same          ? std::numeric_limits<double>::quiet_NaN()
                  : c.record_fit ? c.record_fit->bic
                                 : c.response_fit().bic;
      if (c.validated) {
        trial.holdout_fit_percent = c.validated->fit_percent;
        trial.holdout_score = c.validated->score;
      }
      trial.chosen = i == chosen;
      trial.remark = c.remark;
      if (!trial.chosen && c.remark.empty())
        trial.remark = c.validated    ? "predicts the hold-out samples less well"
                       : c.record_fit ? "has a larger BIC over the recording"
                                      : "has a larger BIC over the lines";
      trials.push_back(std::move(trial));
    }
    return trials;
  }

  [[nodiscard]] Choice reason(const std::vector<Candidate>& candidates, std::size_t chosen) const {
    const auto& c = candidates[chosen];
    Choice choice{"structure", name_of(c.variant()), ""};
    const std::string whole = whole_ != nullptr
                                  ? fmt::format("{} stretches of the recording", records_.size())
                              : records_.size() == 1 ? "the recording"
                                                     : "the recordings";
    if (options_.model != ModelChoice::automatic)
      choice.because = "as specified";
    else if (c.validated)
      choice.because = fmt::format("predicts the hold-out samples best, 30 % of {}", whole);
    else if (std::count_if(candidates.begin(), candidates.end(),
                           [](const Candidate& x) { return x.remark.empty(); }) == 1)
      choice.because = "the measured response rules out all others";
    else
      choice.because = fmt::format("least BIC of {}", c.record_fit ? whole : "the lines");
    return choice;
  }

  std::optional<Selection> finish(std::vector<Candidate>& candidates, std::size_t chosen) const {
    Selection s;
    s.structures = trials_of(candidates, chosen);
    s.choice = reason(candidates, chosen);
    auto& candidate = candidates[chosen];
    if (whole_ != nullptr && candidate.record_fit) {
      tell(options_,
           fmt::format("fitting the {} model to the whole recording", fit::name_of(candidate.structure)));
      const CandidateFits fits({whole_, 1}, plan_, options_, fits_.response(), starts_, true);
      if (!fits.fit_chosen(candidate)) return std::nullopt;
    }
    const data::Record& record = whole_ != nullptr ? *whole_ : records_.front();
    if (candidate.structure == Structure::three_mass && candidate.record_fit)
      for (const auto& c : candidates)
        if (c.structure == Structure::two_mass && c.record_fit)
          s.simpler = ModelResult{c.model(),    true,
                                  0.0,          c.record_fit->coulomb_friction,
                                  std::nullopt, c.record_fit->further_friction};
    s.other_ground = candidate.other_side;
    s.result.drive = candidate.model();
    s.result.from_record = candidate.record_fit.has_value();
    s.result.model_error = difference(candidate.model(), fits_.response()).unexplained;
    if (candidate.record_fit) {
      auto& fit = *candidate.record_fit;
      s.fit_percent = fit.fit_percent;
      s.result.coulomb_friction = fit.coulomb_friction;
      s.result.further_friction = fit.further_friction;
      s.against_others = fit.against_others;
      s.residual_rms = fit.residual_rms;
      for (const auto& own : fit.records) s.fit_percents.push_back(own.fit_percent);
      if (fit.records.size() == 1) {
        s.inconstant = inconstant(fit.records[0].constancy);
        // A model that is wrong in one respect is so in others, which chance alone does not show.
        if (!s.inconstant.empty()) widen(fit.records[0].constancy, s.result.drive);
        s.outliers = inspect_slips(record.output.samples, fit.records[0]);
        if (!s.outliers) s.outliers = inspect_outliers(fit.records[0], record.sample_time_s(), plan_.hold);
        s.residual = std::move(fit.records[0].residual);
        s.residual_start = fit.records[0].first_sample;
        s.result.offset = fit.records[0].offset;
      }
    }
    return s;
  }

  std::span<const data::Record> records_;
  const data::Record* whole_;
  const Plan& plan_;
  const Options& options_;
  std::span<const fit::DriveModel> starts_;
  const CandidateFits fits_;
};

}  // namespace

double unexplained_difference(const fit::DriveModel& model, const data::FrequencyResponse& response) {
  return difference(model, thinned(response)).unexplained;
}

std::optional<Selection> select_model(std::span<const data::Record> records, const Plan& plan,
                                      const Options& options, const data::FrequencyResponse& response,
                                      std::span<const fit::DriveModel> starts, bool to_records) {
  if (response.std.size() != response.lines()) return std::nullopt;
  if (to_records && records.size() == 1 && records.front().samples() > kChosenOnStretches) {
    const auto parts = stretches_of(records.front(), plan.low_hz, plan.sweep.has_value());
    auto selection = Selector(parts, plan, options, response, starts, to_records, &records.front()).run();
    if (selection && selection->result.from_record) return selection;
  }
  return Selector(records, plan, options, response, starts, to_records).run();
}

}  // namespace resonid::identification::detail
