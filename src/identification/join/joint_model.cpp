// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <identification/identify/select/record_fit.hpp>
#include <identification/identify/select/select_drive.hpp>
#include <identification/join/between_records.hpp>
#include <identification/join/estimate_combination.hpp>
#include <identification/join/joint_model.hpp>

namespace resonid::identification::detail {
namespace {

using fit::DriveModel;

bool alike(const DriveModel& a, const DriveModel& b) {
  return a.structure == b.structure && a.estimated == b.estimated;
}

/// The model that most records show: structure, friction and delay alike.
struct Kind {
  const Result* example = nullptr;
  std::size_t count = 0;
  bool of_responses = false;  ///< Most of these models were fitted to a response: the likelihood is ruled by
                              ///< something else.

  [[nodiscard]] const ModelResult& model() const { return *example->model; }
};

/// The more richly parametrised one of two that are equally frequent.
std::optional<Kind> typical(std::span<const Result> results) {
  std::optional<Kind> best;
  const auto size = [](const Result& r) {
    return std::count(r.model->drive.estimated.begin(), r.model->drive.estimated.end(), true);
  };
  for (const auto& result : results) {
    if (!result.model) continue;
    Kind kind{&result, 0, false};
    std::size_t responses = 0;
    for (const auto& other : results) {
      if (!other.model || !alike(other.model->drive, result.model->drive)) continue;
      ++kind.count;
      if (!other.model->from_record) ++responses;
    }
    kind.of_responses = 2 * responses > kind.count;
    if (!best || kind.count > best->count ||
        (kind.count == best->count && size(result) > size(*best->example)))
      best = kind;
  }
  return best;
}

class Joiner {
 public:
  Joiner(std::span<const data::Record> records, std::span<const Result> results, const Plan& plan,
         const Options& options, const data::FrequencyResponse& response, std::vector<JoinedRecord>& told)
      : records_(records),
        results_(results),
        plan_(plan),
        options_(options),
        response_(response),
        told_(told) {}

  std::optional<JointModel> run() {
    const auto kind = typical(results_);
    // Records too weak to show more than a rigid machine may do so together.
    const bool open = !kind || (options_.model == ModelChoice::automatic &&
                                kind->model().drive.structure == fit::Structure::rigid);
    const bool of_responses = kind && kind->of_responses;
    bool fitted = !of_responses && open && select();
    if (!fitted && !of_responses && kind) fitted = fit(*kind);
    if (!fitted && !kind) return std::nullopt;
    if (!fitted) joint_.model = kind->model();
    if (!fitted) {
      test_own_estimates();
      if (!combine(*kind)) return std::nullopt;
    }
    joint_.model.offset.reset();  // each record has its own
    std::vector<const DriveModel*> own;
    for (const auto& r : results_)
      if (r.model && alike(r.model->drive, joint_.model.drive)) own.push_back(&r.model->drive);
    if (auto differs = include_scatter(own, joint_.model.drive))
      joint_.findings.push_back(std::move(*differs));
    return std::move(joint_);
  }

 private:
  [[nodiscard]] fit::OutputErrorConfig config_of(const ModelResult& model) const {
    return detail::config_of(model, records_, options_, plan_.loop_controller);
  }

  /// What the records' own models of one kind say together, in the best of them.
  [[nodiscard]] DriveModel start_of(const DriveModel& kind, std::size_t& count) const {
    const DriveModel* best = &kind;
    std::vector<ParameterEstimate> all;
    std::size_t most = 0;
    for (const auto& r : results_) {
      if (!r.model || !alike(r.model->drive, kind)) continue;
      auto estimate = estimate_of(r.model->drive);
      if (estimate.known.empty()) continue;
      if (estimate.known.size() > most) best = &r.model->drive;
      most = std::max(most, estimate.known.size());
      all.push_back(std::move(estimate));
    }
    count = all.size();
    DriveModel start = *best;
    if (!all.empty()) store(combined(all, all.size()), start);
    return start;
  }

  /// Structure and model as identify chooses them for one record.
  bool select() {
    std::vector<DriveModel> starts;
    for (const auto& r : results_) {
      if (!r.model || std::any_of(starts.begin(), starts.end(),
                                  [&](const DriveModel& s) { return alike(s, r.model->drive); }))
        continue;
      std::size_t count = 0;
      starts.push_back(start_of(r.model->drive, count));
    }
    auto chosen = select_model(records_, plan_, options_, response_, starts);
    if (!chosen || !chosen->result.from_record) return false;
    joint_.model = chosen->result;
    joint_.fit_percent = chosen->fit_percent;
    joint_.residual_rms = chosen->residual_rms;
    for (std::size_t i = 0; i < records_.size(); ++i) told_[i].fit_percent = chosen->fit_percents[i];
    judge(chosen->against_others);
    joint_.structures = std::move(chosen->structures);
    joint_.choices.push_back(std::move(chosen->choice));
    tell_likelihood(
        "structure and model are chosen from all recordings together: by themselves, most show at most a "
        "rigid "
        "machine");
    return true;
  }

  bool fit(const Kind& kind) {
    tell_structure(kind);
    ModelResult model = kind.model();
    std::size_t count = 0;
    model.drive = start_of(kind.model().drive, count);
    const auto fit = fit_records(records_, config_of(model));
    if (!fit || !fit->converged) {
      joint_.findings.push_back(
          {"joint-fit-failed",
           diagnostics::Severity::warning,
           {},
           {},
           "The fit to all recordings together did not converge: the recordings' own "
           "estimates are combined instead. Check that all are repetitions of one experiment."});
      return false;
    }
    model.drive = fit->model;
    model.coulomb_friction = fit->coulomb_friction;
    model.further_friction = fit->further_friction;
    model.from_record = true;
    model.model_error = unexplained_difference(model.drive, response_);
    joint_.model = model;
    take_fits(*fit);
    judge(fit->against_others);
    tell_likelihood(count < 2 ? std::string("started from the one recording that shows such a model")
                              : fmt::format("started from the mean of {} recordings' own estimates", count));
    return true;
  }

  void take_fits(const RecordFit& fit) {
    joint_.fit_percent = fit.fit_percent;
    joint_.residual_rms = fit.residual_rms;
    for (std::size_t i = 0; i < records_.size(); ++i) told_[i].fit_percent = fit.records[i].fit_percent;
  }

  void tell_structure(const Kind& kind) {
    for (const auto& choice : kind.example->choices)
      if (choice.what == "structure")
        joint_.choices.push_back({choice.what, choice.chosen,
                                  fmt::format("{} of {} recordings show it", kind.count, records_.size())});
  }

  void tell_likelihood(std::string because) {
    joint_.one_likelihood = true;
    joint_.choices.push_back(
        {"estimate", fmt::format("one likelihood over {} recordings", records_.size()), std::move(because)});
  }

  /// The record's own model when it is of the common kind, else a fit of that kind from the common one.
  [[nodiscard]] ParameterEstimate own_estimate(std::size_t i) const {
    const auto& own = results_[i].model;
    if (own && alike(own->drive, joint_.model.drive)) return estimate_of(own->drive);
    const auto fit = fit_records(records_.subspan(i, 1), config_of(joint_.model));
    return fit && fit->converged ? estimate_of(fit->model) : ParameterEstimate{};
  }

  void test_own_estimates() {
    std::vector<std::size_t> record;
    for (std::size_t i = 0; i < records_.size(); ++i) {
      auto estimate = own_estimate(i);
      told_[i].own_estimate = !estimate.known.empty();
      if (!told_[i].own_estimate) continue;
      own_.push_back(std::move(estimate));
      record.push_back(i);
    }
    if (own_.size() < 2) return;
    std::vector<fit::Consistency> list(records_.size());
    for (std::size_t i = 0; i < own_.size(); ++i) list[record[i]] = distance(own_[i], combined(own_, i));
    judge(list);
  }

  /// Bonferroni over the records that say something.
  void judge(const std::vector<fit::Consistency>& against_others) {
    const auto judged = std::count_if(against_others.begin(), against_others.end(),
                                      [](const fit::Consistency& c) { return c.degrees > 0; });
    for (std::size_t i = 0; i < against_others.size(); ++i) {
      const auto& c = against_others[i];
      if (c.degrees == 0) continue;
      auto& r = told_[i];
      r.own_estimate = true;
      r.degrees = static_cast<std::size_t>(c.degrees);
      r.chi_square = c.chi_square;
      r.probability = c.probability;
      r.agrees = c.probability > (1.0 - options_.confidence) / static_cast<double>(judged);
    }
  }

  /// Inverse covariances weigh the records' own estimates.
  bool combine(const Kind& kind) {
    if (own_.size() < 2) return false;
    const auto all = combined(own_, own_.size());
    if (all.known.size() < all.parameters.size()) return false;
    store(all, joint_.model.drive);
    joint_.model.model_error = unexplained_difference(joint_.model.drive, response_);
    if (joint_.choices.empty()) tell_structure(kind);
    joint_.choices.push_back(
        {"estimate", fmt::format("mean of {} recordings' own estimates", own_.size()),
         kind.of_responses
             ? "their models were fitted to responses: something else would dominate a fit to the recordings"
             : "the fit to all recordings together did not converge"});
    if (!joint_.model.from_record) return true;
    auto config = config_of(joint_.model);
    config.fixed_model = true;
    config.noise_model = false;
    if (const auto simulation = fit_records(records_, config)) take_fits(*simulation);
    return true;
  }

  std::span<const data::Record> records_;
  std::span<const Result> results_;
  const Plan& plan_;
  const Options& options_;
  const data::FrequencyResponse& response_;
  std::vector<JoinedRecord>& told_;
  std::vector<ParameterEstimate> own_;
  JointModel joint_;
};

}  // namespace

std::optional<JointModel> joint_model(std::span<const data::Record> records, std::span<const Result> results,
                                      const Plan& plan, const Options& options,
                                      const data::FrequencyResponse& response,
                                      std::vector<JoinedRecord>& told) {
  return Joiner(records, results, plan, options, response, told).run();
}

}  // namespace resonid::identification::detail
