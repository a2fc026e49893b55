// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/model_selection.hpp>
#include <limits>
#include <numbers>
#include <resonid/diagnostics/residuals.hpp>

namespace resonid::identification::detail {
namespace {

using fit::Structure;

struct Variant {
  Structure structure = Structure::two_mass;
  bool friction = false;
  bool delay = false;
  bool dry = false;  ///< Dry friction; told by the record only.
};

/// One structure: what the response says of its variants, and the best fit to the record if there is one.
struct Candidate {
  Structure structure = Structure::two_mass;
  std::vector<std::pair<Variant, fit::ResponseFit>> variants;  ///< Best first.
  std::optional<fit::OutputErrorFit> record_fit;
  Variant record_variant;
  std::optional<fit::HeldBackFit> validated;  ///< Of the same variant, fitted to the rest of the record.
  std::string remark;                         ///< Why it went no further.

  [[nodiscard]] const fit::ResponseFit& response_fit() const { return variants.front().second; }
  [[nodiscard]] const fit::DriveModel& model() const {
    return record_fit ? record_fit->model : response_fit().model;
  }
};

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// How far a model (its fitted delay included) is from the measured response, relative, over the lines that
/// are measured better than 50 %: whole and beyond the noise. Both from the median of the squares (for
/// Gaussian errors ln 2 of their mean), since a few lines in the anti-resonance would rule a mean.
struct Difference {
  double whole = 0.0;
  double unexplained = 0.0;
};

Difference difference(const fit::DriveModel& model, const data::FrequencyResponse& response) {
  const auto fitted = model.values(response.frequency_hz, true);
  std::vector<double> squares, noise;
  for (std::size_t i = 0; i < response.lines(); ++i) {
    const double size = std::abs(response.value[i]);
    if (!(response.standard_deviation[i] < 0.5 * size)) continue;
    squares.push_back(std::norm((fitted[i] - response.value[i]) / size));
    noise.push_back(std::pow(response.standard_deviation[i] / size, 2));
  }
  const double whole = median(squares) / std::numbers::ln2;
  return {std::sqrt(whole), std::sqrt(std::max(0.0, whole - median(noise)))};
}

/// At most kLines of the usable lines, evenly taken: the fits' cost must not grow with the 65 535 lines of a
/// long PRBS, most of them noise. What is left out comes back in the fit to the record.
data::FrequencyResponse thinned(const data::FrequencyResponse& g) {
  constexpr std::size_t kLines = 2000;
  if (g.lines() <= kLines) return g;
  std::vector<std::size_t> usable;
  for (std::size_t k = 0; k < g.lines(); ++k)
    if (g.standard_deviation[k] < 0.5 * std::abs(g.value[k])) usable.push_back(k);
  if (usable.size() < 10) return g;
  data::FrequencyResponse few;
  const std::size_t count = std::min(kLines, usable.size());
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t k = usable[i * usable.size() / count];
    few.frequency_hz.push_back(g.frequency_hz[k]);
    few.value.push_back(g.value[k]);
    few.standard_deviation.push_back(g.standard_deviation[k]);
  }
  return few;
}

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

const char* plain_name(Structure structure) {
  switch (structure) {
    case Structure::rigid:
      return "rigid";
    case Structure::two_mass:
      return "two-mass";
    case Structure::three_mass:
      break;
  }
  return "three-mass";
}

std::string name_of(const Variant& v) {
  std::vector<const char*> parts;
  if (v.friction) parts.push_back("viscous friction");
  if (v.dry) parts.push_back("dry friction");
  if (v.delay) parts.push_back("delay");
  std::string name = plain_name(v.structure);
  for (std::size_t i = 0; i < parts.size(); ++i)
    name += std::string(i == 0 ? " with " : i + 1 == parts.size() ? " and " : ", ") + parts[i];
  return name;
}

/// Whether the band shows every mode: one that nothing in it shows is idle parameters of a simpler machine.
bool modes_are_seen(const fit::DriveModel& model, const Plan& plan) {
  const auto modes = model.modes();
  for (std::size_t i = 0; i < modes.size(); ++i) {
    const auto& m = modes[i];
    const double f = m.frequency_hz.value;
    if (!std::isfinite(f) || !(m.damping_ratio.value < 1.0)) return false;
    // The first pair may lie a little beside the band, a further one must show in it.
    const bool first = i < 2;
    if (m.anti ? f < (first ? 0.3 : 1.0) * plan.low_hz : f > (first ? 1.5 : 1.0) * plan.high_hz) return false;
    if (!first && m.frequency_hz.standard_deviation > 0.1 * f) return false;
    if (!m.anti || i + 1 == modes.size()) continue;
    // A pair that cancels within its error bars is none.
    const auto gap = [i](const fit::DriveModel& d) {
      const auto moved = d.modes();
      return moved[i + 1].frequency_hz.value - moved[i].frequency_hz.value;
    };
    const double least = first ? 0.0 : 1e-3 * f;
    if (!(gap(model) > std::max(least, 3.0 * model.standard_deviation_of(gap)))) return false;
  }
  return true;
}

/// The last 30 % of each tenth of the record, so that a sweep too is seen over its whole band; nothing for
/// records that are too short to spare any.
std::vector<std::pair<std::size_t, std::size_t>> held_back_of(std::size_t samples) {
  constexpr std::size_t kParts = 10, kShortest = 1000;
  std::vector<std::pair<std::size_t, std::size_t>> parts;
  if (samples < kShortest) return parts;
  for (std::size_t i = 0; i < kParts; ++i)
    parts.emplace_back((10 * i + 7) * samples / (10 * kParts), (i + 1) * samples / kParts);
  return parts;
}

class Selector {
 public:
  Selector(const data::Record& record, const Plan& plan, const Options& options,
           const data::FrequencyResponse& response)
      : record_(record), plan_(plan), options_(options), response_(thinned(response)) {}

  std::optional<Selection> run() {
    std::vector<Candidate> candidates;
    for (const Structure structure : structures(options_.model)) {
      if (structure == Structure::three_mass && !candidates.empty() && !leaves_something(candidates.back()))
        continue;
      const bool richest = structure == Structure::three_mass && !candidates.empty();
      auto candidate =
          fit_structure(structure, richest ? &candidates.back().variants.front().first : nullptr);
      if (candidate.variants.empty()) continue;
      candidates.push_back(std::move(candidate));
      if (structure == Structure::rigid && options_.model == ModelChoice::automatic) continue;
      if (candidates.size() > 1) drop_the_hopeless(candidates);
      for (auto& c : candidates)
        if (c.remark.empty() && !c.record_fit) refine(c);
      if (structure == Structure::two_mass && candidates.size() == 2) rescue(candidates[0], candidates[1]);
    }
    if (candidates.empty()) return std::nullopt;
    if (candidates.size() == 1 && !candidates[0].record_fit) refine(candidates[0]);
    const auto still_open = std::count_if(candidates.begin(), candidates.end(),
                                          [](const Candidate& c) { return c.record_fit.has_value(); });
    for (auto& candidate : candidates)
      if (still_open > 1 && candidate.record_fit) validate(candidate);
    std::size_t chosen = candidates.size();
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (!candidates[i].remark.empty()) continue;
      if (chosen == candidates.size() || prefer_later(candidates[chosen], candidates[i])) chosen = i;
    }
    try_dry_friction(candidates[chosen]);
    return finish(candidates, chosen);
  }

 private:
  [[nodiscard]] std::optional<fit::ResponseFit> fitted(const Variant& variant,
                                                       const std::optional<fit::DriveModel>& start) const {
    fit::ResponseFitConfig config;
    config.structure = variant.structure;
    config.sample_time_s = record_.sample_time_s();
    config.known_delay_s = options_.delay_s;
    config.viscous_friction = variant.friction;
    config.delay = variant.delay;
    config.initial = start;
    auto fit = fit::fit_response(response_, config);
    if (!fit || !std::isfinite(fit->information) || pushes_itself(fit->model)) return std::nullopt;
    return std::move(*fit);
  }

  /// Negative friction: such a fit imitates noise.
  static bool pushes_itself(const fit::DriveModel& model) { return model.parameters.viscous_friction < 0.0; }

  /// With and without friction and a further delay, in the order in which the response prefers them.
  /// Only the variant `like` when that is given: a richer structure is tried as the simpler one came out.
  [[nodiscard]] Candidate fit_structure(Structure structure, const Variant* like = nullptr) const {
    Candidate candidate;
    candidate.structure = structure;
    for (const bool friction : {false, true}) {
      std::optional<fit::DriveModel> start;
      for (const bool delay : {false, true}) {
        if (like != nullptr && (friction != like->friction || delay != like->delay)) continue;
        const Variant variant{structure, friction, delay};
        auto fit = fitted(variant, start);
        if (delay && start) {  // a delay that was left out may have spoilt the start
          auto afresh = fitted(variant, std::nullopt);
          if (afresh && (!fit || afresh->information < fit->information)) fit = std::move(afresh);
        }
        if (!fit) continue;
        start = fit->model;
        candidate.variants.emplace_back(variant, std::move(*fit));
      }
    }
    // Lines that repeat one another, smoothed ones or those that a model misses in a smooth way, count as the
    // fewer that they are worth; by the variant that leaves least unexplained.
    double repeated = std::numeric_limits<double>::infinity();
    for (const auto& v : candidate.variants) repeated = std::min(repeated, v.second.repetition);
    constexpr double kCaution = 8.0;
    const auto price = [&](const std::pair<Variant, fit::ResponseFit>& v) {
      return v.second.information_for(repeated) + (v.first.friction ? kCaution : 0.0) +
             (v.first.delay ? kCaution : 0.0);
    };
    std::sort(candidate.variants.begin(), candidate.variants.end(),
              [&](const auto& a, const auto& b) { return price(a) < price(b); });
    return candidate;
  }

  [[nodiscard]] std::optional<fit::OutputErrorFit> fit_record(const Variant& variant,
                                                              const fit::DriveModel& start,
                                                              bool only_simulate = false) const {
    fit::OutputErrorConfig config;
    config.fixed_model = only_simulate;
    config.initial = start;
    config.viscous_friction = variant.friction;
    config.delay = variant.delay;
    config.coulomb_friction = variant.dry;
    config.known_delay_s = options_.delay_s;
    use_predictor(config);
    auto fit = fit::fit_output_error(record_, config);
    if (!fit || (!only_simulate && (!fit->converged || pushes_itself(fit->model)))) return std::nullopt;
    return std::move(*fit);
  }

  /// From the response's fits to the record's. A fit is kept unless it contradicts the measured response:
  /// then the drive is not what the likelihood assumes (non-linear friction, a disturbance that looks like a
  /// response). One that simulates the record clearly better than the response's own model does not
  /// contradict, it corrects.
  void refine(Candidate& candidate) const {
    // Unbiased lines that differ from the model far beyond their noise have already said that the drive is
    // another.
    constexpr double kTrueEnough = 0.05;
    constexpr double kBeyondNoise = 5.0;
    const auto& told = candidate.response_fit();
    const bool lines_are_unbiased = plan_.period_samples != 0 && plan_.method != Method::local_polynomial;
    if (lines_are_unbiased && told.model_error > kTrueEnough && told.misfit > kBeyondNoise) return;
    const double allowed = 1.5 * difference(candidate.response_fit().model, response_).whole + 0.02;
    constexpr double kClearlyBetter = 3.0;  // per cent of fit
    const auto simulated = fit_record(candidate.variants.front().first, candidate.response_fit().model, true);
    const double enough = simulated ? simulated->fit_percent + kClearlyBetter : 100.0;
    const bool ask_for_delay = candidate.variants.front().first.delay;
    auto variants = candidate.variants;
    std::stable_sort(variants.begin(), variants.end(),
                     [](const auto& a, const auto& b) { return a.first.delay < b.first.delay; });
    for (const auto& [variant, response_fit] : variants) {
      if (variant.delay && !ask_for_delay) continue;
      std::vector<fit::DriveModel> starts = {response_fit.model};
      if (candidate.record_fit) starts.push_back(candidate.record_fit->model);
      for (const auto& start : starts) {
        auto fit = fit_record(variant, start);
        if (!fit) continue;
        if (difference(fit->model, response_).whole > allowed && fit->fit_percent < enough) continue;
        if (candidate.record_fit && fit->information >= candidate.record_fit->information) continue;
        candidate.record_fit = std::move(*fit);
        candidate.record_variant = variant;
      }
    }
  }

  /// An approach that was asked for holds for the fit to the record too. By itself the recorded input drives
  /// the simulation: with the noise modelled that is right in closed loop too, and loses nothing.
  void use_predictor(fit::OutputErrorConfig& config) const {
    const bool velocity = record_.output_quantity == data::OutputQuantity::velocity;
    if (options_.approach == Approach::indirect && options_.controller && velocity) {
      config.predictor = fit::Predictor::closed_loop;
      config.controller = options_.controller;
    }
    if (options_.approach == Approach::joint && record_.excitation.present())
      config.predictor = fit::Predictor::joint;
    if (plan_.loop_controller) {
      config.predictor = fit::Predictor::closed_loop;
      config.controller = plan_.loop_controller;
    }
  }

  /// Dry friction, where the chosen model finds some in the record and the criterion is clearly the better
  /// for it.
  void try_dry_friction(Candidate& candidate) const {
    if (!candidate.record_fit || record_.output_quantity == data::OutputQuantity::acceleration) return;
    constexpr double kFound = 4.0;     // standard deviations
    constexpr double kClearly = 20.0;  // in the criterion
    const auto found = [](const std::optional<fit::OutputErrorFit>& fit) {
      const auto& c = fit->coulomb_friction;
      return c && c->value > kFound * c->standard_deviation;
    };
    Variant variant = candidate.record_variant;
    variant.dry = true;
    const auto& plain = *candidate.record_fit;
    if (const auto glance = fit_record(variant, plain.model, true); !glance || !found(glance)) return;
    auto fit = fit_record(variant, plain.model);
    if (!fit || !found(fit) || fit->information + kClearly > plain.information) return;
    candidate.record_fit = std::move(*fit);
    candidate.record_variant = variant;
  }

  /// The same variant fitted without the samples held back, and judged by them.
  void validate(Candidate& candidate) const {
    const auto parts = held_back_of(record_.samples());
    if (parts.empty()) return;
    fit::OutputErrorConfig config;
    config.initial = candidate.record_fit->model;
    config.viscous_friction = candidate.record_variant.friction;
    config.delay = candidate.record_variant.delay;
    config.known_delay_s = options_.delay_s;
    use_predictor(config);
    config.held_back = parts;
    if (const auto fit = fit::fit_output_error(record_, config); fit && fit->converged)
      candidate.validated = fit->held_back;
  }

  /// A short or noisy record may show its resonance to a fit of its own when its response does not.
  void rescue(const Candidate& rigid, Candidate& two) const {
    if (two.remark.empty() || !rigid.record_fit) return;
    constexpr double kClearly = 20.0;  // in the criterion
    constexpr double kKnown = 0.05;    // of the resonance
    Variant chosen;
    std::optional<fit::OutputErrorFit> best;
    for (const int further_delay : {0, 1, 2, 4, 8}) {  // in samples; the fit's valley is a few wide
      const Variant variant{Structure::two_mass, false, further_delay > 0, false};
      const double further_s = further_delay * record_.sample_time_s();
      for (auto start : fit::initial_models(record_, options_.delay_s + further_s)) {
        start.delay_s = further_s;
        auto fit = fit_record(variant, start);
        if (!fit || (best && fit->information >= best->information)) continue;
        best = std::move(fit);
        chosen = variant;
      }
    }
    if (!best || best->information + kClearly > rigid.record_fit->information) return;
    const auto resonance = best->model.resonance();
    if (resonance.standard_deviation > kKnown * resonance.value || !modes_are_seen(best->model, plan_))
      return;
    two.record_fit = std::move(best);
    two.record_variant = chosen;
    two.remark.clear();
  }

  /// Three masses are tried only where two are seen and leave something unexplained: of the record, if a
  /// model could be fitted to it, else of the response.
  [[nodiscard]] bool leaves_something(const Candidate& two) const {
    if (two.structure != Structure::two_mass || !two.remark.empty()) return false;
    if (!two.record_fit) {
      constexpr double kExplained = 0.005;
      return two.response_fit().model_error > kExplained;
    }
    constexpr double kAll = 99.999;  // per cent of fit: what is left is rounding
    if (two.record_fit->fit_percent > kAll) return false;
    constexpr std::size_t kLags = 40;
    constexpr double kBeyondChance = 1.5;  // 0.1 % for each lag instead of 3 %
    const auto& residual = two.record_fit->residual;
    std::vector<double> simulated(residual.size());
    for (std::size_t k = 0; k < simulated.size(); ++k)
      simulated[k] = record_.output.samples[two.record_fit->first_sample + k] - residual[k];
    const auto test = diagnostics::test_residual({residual, simulated, {}, {}}, kLags, kLags);
    return test.with_simulated.largest > kBeyondChance * test.limit;
  }

  /// On what was held back where both could be judged by it, else by the criterion of the record, else of the
  /// lines.
  bool prefer_later(const Candidate& simple, const Candidate& rich) const {
    constexpr double kClearly = 10.0;
    if (simple.validated && rich.validated)
      return rich.validated->information + kClearly < simple.validated->information;
    if (simple.record_fit && rich.record_fit)
      return rich.record_fit->information < simple.record_fit->information;
    const double repeated = rich.response_fit().repetition;
    return rich.response_fit().information_for(repeated) < simple.response_fit().information_for(repeated);
  }

  /// Spares the fits to the record of a structure that the response already rules out.
  void drop_the_hopeless(std::vector<Candidate>& candidates) const {
    constexpr double kDecisive = 300.0;  // in the criterion, for lines that may repeat one another
    for (auto& candidate : candidates)
      if (candidate.remark.empty() && candidate.structure != Structure::rigid &&
          !modes_are_seen(candidate.response_fit().model, plan_))
        candidate.remark = "a resonance of it does not show in the band";
    double least = std::numeric_limits<double>::infinity();
    for (const auto& candidate : candidates)
      if (candidate.remark.empty()) least = std::min(least, candidate.response_fit().information);
    for (auto& candidate : candidates)
      if (candidate.remark.empty() && candidate.response_fit().information > least + kDecisive)
        candidate.remark = "the measured response rules it out";
  }

  std::vector<StructureTrial> trials_of(const std::vector<Candidate>& candidates, std::size_t chosen) const {
    std::vector<StructureTrial> trials;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const auto& c = candidates[i];
      const auto& mask = c.model().estimated;
      StructureTrial trial;
      trial.name = name_of(c.record_fit ? c.record_variant : c.variants.front().first);
      trial.parameters = static_cast<std::size_t>(std::count(mask.begin(), mask.end(), true));
      // Those of record and response are no match for one another.
      const bool same = c.record_fit.has_value() == candidates[chosen].record_fit.has_value();
      trial.information = !same          ? std::numeric_limits<double>::quiet_NaN()
                          : c.record_fit ? c.record_fit->information
                                         : c.response_fit().information;
      if (c.validated) {
        trial.validation_fit_percent = c.validated->fit_percent;
        trial.validation_information = c.validated->information;
      }
      trial.chosen = i == chosen;
      trial.remark = c.remark;
      if (!trial.chosen && c.remark.empty())
        trial.remark = c.validated    ? "predicts the samples held back less well"
                       : c.record_fit ? "the record's criterion is larger"
                                      : "the lines' criterion is larger";
      trials.push_back(std::move(trial));
    }
    return trials;
  }

  [[nodiscard]] Choice reason(const std::vector<Candidate>& candidates, std::size_t chosen) const {
    const auto& c = candidates[chosen];
    Choice choice{"structure", name_of(c.record_fit ? c.record_variant : c.variants.front().first), ""};
    if (options_.model != ModelChoice::automatic)
      choice.because = "asked for";
    else if (c.validated)
      choice.because = "predicts the 30 % of the record best that no fit had seen";
    else if (std::count_if(candidates.begin(), candidates.end(),
                           [](const Candidate& x) { return x.remark.empty(); }) == 1)
      choice.because = "the measured response leaves no other";
    else
      choice.because = c.record_fit ? "least information criterion of the record"
                                    : "least information criterion of the lines";
    return choice;
  }

  Selection finish(std::vector<Candidate>& candidates, std::size_t chosen) const {
    Selection s;
    s.structures = trials_of(candidates, chosen);
    s.choice = reason(candidates, chosen);
    auto& candidate = candidates[chosen];
    s.result.drive = candidate.model();
    s.result.from_record = candidate.record_fit.has_value();
    s.result.model_error = difference(candidate.model(), response_).unexplained;
    if (candidate.record_fit) {
      s.residual = std::move(candidate.record_fit->residual);
      s.residual_start = candidate.record_fit->first_sample;
      s.fit_percent = candidate.record_fit->fit_percent;
      s.result.offset = candidate.record_fit->offset;
      s.result.coulomb_friction = candidate.record_fit->coulomb_friction;
    }
    return s;
  }

  const data::Record& record_;
  const Plan& plan_;
  const Options& options_;
  const data::FrequencyResponse response_;
};

}  // namespace

std::optional<Selection> select_model(const data::Record& record, const Plan& plan, const Options& options,
                                      const data::FrequencyResponse& response) {
  if (response.standard_deviation.size() != response.lines()) return std::nullopt;
  return Selector(record, plan, options, response).run();
}

}  // namespace resonid::identification::detail
