// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/prepare/prepare.hpp>
#include <identification/identify/select/band_record.hpp>
#include <identification/identify/select/record_fit.hpp>
#include <identification/linear_simulation.hpp>
#include <identification/validate/evidence.hpp>
#include <identification/validate/refit.hpp>
#include <identification/validate/verdict.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/diagnostics/detail/data_findings.hpp>
#include <resonid/fit/detail/noise_model.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/identification/validate.hpp>

namespace resonid::identification {
namespace {

using diagnostics::Severity;

tl::unexpected<Error> refused(std::string field, std::string message) {
  return tl::unexpected(Error{std::move(field), std::move(message)});
}

class Simulator {
 public:
  Simulator(const data::Record& record, const CandidateModel& candidate, const ValidateOptions& options)
      : record_(record), options_(options) {
    v_.candidate = candidate;
    v_.known_delay_s = options.common.delay_s;
  }

  /// `response`: of the record, says where it is excited.
  expected<ModelValidation, Error> run(const data::FrequencyResponse& response) {
    if (const auto done = simulate(); !done) return tl::unexpected(done.error());
    fit_percents();
    judge_above(response.frequency_hz.empty() ? 0.0 : response.frequency_hz.front());
    choose_band(detail::known_band(response));
    detail::put_spectra(record_, options_, v_);
    residual_tests();
    return std::move(v_);
  }

  /// The residual alone.
  expected<std::vector<double>, Error> residual() {
    if (const auto done = simulate(); !done) return tl::unexpected(done.error());
    return std::move(v_.residual);
  }

 private:
  expected<void, Error> simulate() {
    const bool indirect = options_.common.approach == Approach::indirect;
    v_.approach = indirect ? "indirect" : "direct";
    const auto done =
        indirect ? in_closed_loop() : (v_.candidate.model ? of_drive() : of_transfer_function());
    if (!done) return tl::unexpected(done.error());
    for (const double e : v_.residual)
      if (!std::isfinite(e)) return refused("model", "the simulated output is not finite");
    return {};
  }

  [[nodiscard]] std::size_t delay_samples(double seconds) {
    const double samples = seconds * record_.sample_rate_hz;
    const double whole = std::round(samples);
    if (std::abs(samples - whole) > 0.1)
      v_.findings.push_back(
          {"delay-rounded", Severity::info, samples, whole,
           fmt::format("A delay of {:.2f} samples is simulated as {:.0f}.", samples, whole)});
    return static_cast<std::size_t>(std::max(0.0, whole));
  }

  expected<void, Error> of_drive() {
    fit::OutputErrorConfig config;
    config.initial = v_.candidate.model->drive;
    config.fixed_model = true;
    config.noise_model = false;
    config.known_delay_s = options_.common.delay_s;
    config.viscous_friction = config.initial.estimated[fit::kViscousFriction];
    detail::use_friction(v_.candidate.model->coulomb_friction, v_.candidate.model->further_friction, config);
    auto simulation = fit::fit_output_error(record_, config);
    if (!simulation)
      return refused(
          simulation.error().field == "known_delay_s" ? "delay_s" : std::string(simulation.error().field),
          std::string(simulation.error().requirement));
    v_.offset = simulation->offset;
    v_.coulomb_friction = simulation->coulomb_friction;
    v_.first_sample = simulation->first_sample;
    v_.residual = std::move(simulation->residual);
    v_.simulated = diagnostics::simulated_of(record_.output.samples, v_.residual);
    return {};
  }

  /// From input to velocity, delay included.
  expected<data::TransferFunction, Error> plant() {
    const auto required = v_.candidate.model ? data::OutputQuantity::velocity : v_.candidate.output_quantity;
    if (record_.output_quantity != required)
      return refused(
          "output_quantity",
          fmt::format("found {}, required {}: {}", name_of(record_.output_quantity), name_of(required),
                      v_.candidate.model ? "closed loops are simulated from input to velocity"
                                         : "the transfer function's output"));
    if (v_.candidate.model) {
      auto drive = v_.candidate.model->drive;
      drive.sample_time_s = record_.sample_time_s();
      return detail::delayed(drive.transfer_function(),
                             delay_samples(options_.common.delay_s + drive.delay_s));
    }
    const auto& g = *v_.candidate.transfer_function;
    if (std::abs(g.sample_time_s - record_.sample_time_s()) > 0.01 * record_.sample_time_s())
      return refused(
          "candidate",
          fmt::format("the transfer function runs at {:g} s, the recording at {:g} s; required the "
                      "recording's sample time",
                      g.sample_time_s, record_.sample_time_s()));
    const std::size_t own = v_.candidate.delay_samples;
    return detail::delayed(g, own > 0 ? own : delay_samples(options_.common.delay_s));
  }

  void keep(detail::LinearSimulation simulation) {
    v_.simulated = std::move(simulation.output);
    v_.offset = simulation.offset;
    for (std::size_t k = 0; k < v_.simulated.size(); ++k)
      v_.residual.push_back(record_.output.samples[k] - v_.simulated[k]);
  }

  expected<void, Error> of_transfer_function() {
    const auto g = plant();
    if (!g) return tl::unexpected(g.error());
    if (!detail::can_be_simulated(*g, record_.samples()))
      return refused("candidate",
                     "the transfer function is unstable and cannot be simulated; required poles on or inside "
                     "the unit circle, or .approach indirect");
    keep(detail::simulate_nearest(*g, record_.input.samples, record_.output.samples, false));
    return {};
  }

  expected<void, Error> in_closed_loop() {
    const auto& controller = options_.common.controller;
    if (!controller) return refused("approach", "indirect needs .controller");
    if (!record_.excitation.present())
      return refused("approach", "indirect needs an excitation in the recording");
    const auto g = plant();
    if (!g) return tl::unexpected(g.error());
    if (v_.candidate.model && v_.candidate.model->has_dry_friction())
      v_.findings.push_back(
          {"friction-left-out",
           Severity::warning,
           {},
           {},
           "The closed loop is simulated without the model's dry friction: .approach direct "
           "simulates it."});
    const auto loop = detail::closed_loop(*g, *controller);
    if (!(detail::largest_pole(loop) < 1.0))
      return refused("approach",
                     "indirect: the loop of this model with this controller is unstable, so it cannot be "
                     "simulated; required a stable one, or .approach direct");
    auto input = record_.excitation.samples;
    if (record_.reference.present()) {
      auto reference = record_.reference.samples;
      for (double& r : reference) r -= record_.reference.samples.front();
      const auto through = controller->simulate(reference);
      for (std::size_t k = 0; k < input.size(); ++k) input[k] += through[k];
    }
    keep(detail::simulate_nearest(loop, input, record_.output.samples, true));
    return {};
  }

  void fit_percents() {
    const auto output = std::span(record_.output.samples).subspan(v_.first_sample);
    const double total = squares_about_mean(output);
    if (!(total > 0.0)) return;
    v_.simulation_fit_percent = fit_percent_of(sum_of_squares(v_.residual), total);
    const auto noise = fit::fit_noise_model(v_.residual, fit::kHighestNoiseOrder);
    const auto innovation = fit::whiten(v_.residual, noise);
    const auto foretold = output.subspan(output.size() - innovation.size());
    v_.prediction_fit_percent = fit_percent_of(sum_of_squares(innovation), squares_about_mean(foretold));
  }

  /// What drifts below the excited band says nothing of the model, and two slow signals always correlate.
  void judge_above(double lowest_hz) {
    const double hz = lowest_hz / std::sqrt(2.0), rate = record_.sample_rate_hz;
    const auto settled = hz > 0.0 ? static_cast<std::size_t>(rate / hz) : 0;
    if (settled == 0 || 4 * settled > v_.residual.size()) return;
    const auto output = std::span(record_.output.samples).subspan(v_.first_sample);
    const double all = squares_about_mean(v_.residual);
    const auto left = above(v_.residual, hz, settled);
    if (!(sum_of_squares(left) < detail::kCriteria.excited_residual * all)) return;
    const double total = sum_of_squares(above(output, hz, settled));
    if (!(total > 0.0)) return;
    v_.judged_from_hz = hz;
    v_.judged_fit_percent = fit_percent_of(sum_of_squares(left), total);
    settled_ = settled;
  }

  /// Where the model was identified and this record excites it; where they have next to nothing in common,
  /// where it was identified.
  void choose_band(const std::optional<std::pair<double, double>>& excited) {
    constexpr double kNarrowest = 1.2;  // ratio of the ends
    auto band = v_.candidate.band_hz ? v_.candidate.band_hz : excited;
    if (!band) return;
    bool of_model = v_.candidate.band_hz.has_value();
    if (v_.candidate.band_hz && excited) {
      const std::pair both(std::max(band->first, excited->first), std::min(band->second, excited->second));
      of_model = both.second > kNarrowest * both.first;
      band = of_model ? both : *excited;  // the model speaks beyond its own lines then
      if (!of_model)
        v_.findings.push_back(
            {"other-band", Severity::warning, excited->first, v_.candidate.band_hz->first,
             fmt::format(
                 "The recording excites {:.3g} ... {:.3g} Hz, and the model was identified in {:.3g} ... "
                 "{:.3g} Hz: it is judged where it was not measured. Excite the model's band, or "
                 "identify in both.",
                 excited->first, excited->second, v_.candidate.band_hz->first,
                 v_.candidate.band_hz->second)});
    }
    v_.judged = JudgedBand{band->first, std::min(band->second, 0.5 * record_.sample_rate_hz), of_model};
  }

  [[nodiscard]] std::vector<double> above(std::span<const double> samples, double hz,
                                          std::size_t settled) const {
    auto filtered = detail::high_passed(samples, hz, record_.sample_rate_hz);
    filtered.erase(filtered.begin(), filtered.begin() + static_cast<std::ptrdiff_t>(settled));
    return filtered;
  }

  void residual_tests() {
    double delay = options_.common.delay_s;
    std::size_t poles = 3;
    if (v_.candidate.model) {
      delay += v_.candidate.model->drive.delay_s;
      poles = static_cast<std::size_t>(fit::order_of(v_.candidate.model->drive.structure));
    } else {
      const auto& g = *v_.candidate.transfer_function;
      poles = std::max(g.denominator.size(), g.numerator.size()) - 1;
    }
    const auto judged =
        poles + static_cast<std::size_t>(std::max(0.0, std::round(delay * record_.sample_rate_hz)));
    const auto part = [&](const data::Channel& c) {
      return c.present() ? std::span(c.samples).subspan(v_.first_sample) : std::span<const double>();
    };
    const std::size_t lags = std::max(options_.max_lag, judged);
    v_.in_loop = detail::is_fed_back(record_);
    v_.residual_test = diagnostics::test_residual(
        {v_.residual, v_.simulated, part(record_.input), part(record_.excitation)}, lags, judged);
    if (!v_.judged && !v_.judged_from_hz) return;
    const auto judged_part = [&](std::span<const double> samples) {
      return samples.empty() ? std::vector<double>() : within(samples);
    };
    const auto residual = judged_part(v_.residual), simulated = judged_part(v_.simulated),
               input = judged_part(part(record_.input)), excitation = judged_part(part(record_.excitation));
    const double mean = v_.residual_test.mean, rms = v_.residual_test.rms, snr = v_.residual_test.snr_db;
    v_.residual_test = diagnostics::test_residual({residual, simulated, input, excitation}, lags, judged);
    v_.residual_test.mean = mean;
    v_.residual_test.rms = rms;
    if (!v_.judged_from_hz) v_.residual_test.snr_db = snr;
  }

  /// What lies in the judged band.
  [[nodiscard]] std::vector<double> within(std::span<const double> samples) const {
    const double rate = record_.sample_rate_hz;
    const double low = v_.judged_from_hz.value_or(v_.judged ? v_.judged->low_hz / std::sqrt(2.0) : 0.0);
    const auto settled = low > 0.0 ? static_cast<std::size_t>(rate / low) : 0;
    // A filter that takes long to settle costs more than what lies below the band disturbs.
    const std::size_t least = (v_.judged_from_hz ? 4 : 10) * settled;
    auto filtered = settled > 0 && least < samples.size() ? above(samples, low, settled)
                                                          : std::vector(samples.begin(), samples.end());
    const double high = v_.judged ? std::sqrt(2.0) * v_.judged->high_hz : rate;
    return high < 0.4 * rate ? detail::low_passed(std::move(filtered), high, rate) : filtered;
  }

  const data::Record& record_;
  const ValidateOptions& options_;
  ModelValidation v_;
  std::size_t settled_ = 0;  ///< Samples left out of what is judged above a frequency.
};

/// How the residual moves with each independent standard deviation of the model, [sample x direction].
Eigen::MatrixXd uncertainty_of(const data::Record& record, const CandidateModel& candidate,
                               const ValidateOptions& options, const std::vector<double>& residual) {
  constexpr double kStep = 0.01;  // standard deviations
  const auto n = static_cast<Eigen::Index>(residual.size());
  const auto models = detail::moved_by_deviations(candidate, kStep);
  Eigen::MatrixXd uncertainty(n, static_cast<Eigen::Index>(models.size()));
  Eigen::Index kept = 0;
  for (const auto& moved : models) {
    const auto other = Simulator(record, moved, options).residual();
    if (!other || other->size() != residual.size()) continue;
    uncertainty.col(kept++) = (Eigen::Map<const Eigen::VectorXd>(other->data(), n) -
                               Eigen::Map<const Eigen::VectorXd>(residual.data(), n)) /
                              kStep;
  }
  uncertainty.conservativeResize(n, kept);
  return uncertainty;
}

/// Whether the record is the one that the model was fitted to, all of it.
bool is_own_record(const ModelValidation& v, const std::optional<bool>& same_file) {
  const auto& c = v.candidate;
  const auto name = [](const std::string& file) { return file.substr(file.find_last_of("/\\") + 1); };
  if (c.record_samples != v.record.samples) return false;
  if (same_file) return *same_file;
  const double rms = std::hypot(v.residual_test.mean, v.residual_test.rms);
  return c.own && name(c.record_file) == name(v.record.file) && std::abs(c.own->rms - rms) < 1e-3 * rms;
}

/// A model without dry friction is not one of a motion profile alone.
bool moves_only(const data::Record& record, const CandidateModel& candidate, const Options& own) {
  if (!candidate.model || !candidate.model->has_dry_friction()) return false;
  const auto experiment = detail::plan_experiment(record, own);
  return experiment && experiment->motion;
}

}  // namespace

CandidateModel candidate_of(const Result& result) {
  CandidateModel candidate;
  candidate.source = candidate.record_file = result.record.file;
  candidate.record_samples = result.record.samples;
  candidate.units_response = result.units.response;
  candidate.trusted = result.trusted;
  candidate.known_delay_s = result.known_delay_s;
  candidate.output_quantity = result.record.output_quantity;
  if (result.model) {
    candidate.model = result.model;
  } else if (result.black_box) {
    candidate.transfer_function = result.black_box->model.transfer_function;
    candidate.covariance = result.black_box->model.covariance;
    candidate.delay_samples = result.black_box->model.delay_samples;
  }
  if (const auto& v = result.validation; v && v->residual_rms)
    candidate.own = OwnResidual{*v->residual_rms, v->fit_percent};
  candidate.band_hz = detail::known_band(result.response);
  return candidate;
}

expected<ModelValidation, Error> validate(const data::Record& record, const CandidateModel& candidate,
                                          const ValidateOptions& given) {
  ValidateOptions options = given;
  options.common = detail::sampled(options.common, record);
  if (!candidate.model && !candidate.transfer_function)
    return refused("candidate", "holds no model; required a result with one, or a transfer function");
  Options own = options.common;
  own.model = ModelChoice::none;
  if (own.approach == Approach::indirect) own.approach.reset();
  const auto result = identify(record, own);
  if (!result) return tl::unexpected(result.error());
  auto validation = Simulator(record, candidate, options).run(result->response);
  if (!validation) return validation;
  validation->record = result->record;
  validation->units = result->units;
  validation->fitted_here = is_own_record(*validation, options.own_record);
  validation->in_motion = moves_only(record, candidate, own);
  validation->findings.insert(validation->findings.begin(), result->findings.begin(), result->findings.end());
  std::optional<diagnostics::ModelUncertainty> known;
  const auto uncertainty = [&]() -> const diagnostics::ModelUncertainty& {
    if (!known)
      known = diagnostics::ModelUncertainty{uncertainty_of(record, candidate, options, validation->residual),
                                            validation->fitted_here};
    return *known;
  };
  if (detail::speaks_of_response_alone(*validation))
    validation->measured = result->response;
  else
    detail::compare_with_response(record, options.common, own, *result, uncertainty, *validation);
  detail::look_into_residual(record, uncertainty(), *validation);
  known.reset();
  if (!validation->judged_from_hz)
    if (auto differs = detail::inspect_refit(record, candidate, options.common))
      validation->findings.push_back(std::move(*differs));
  detail::judge(*validation);
  return validation;
}

expected<ModelValidation, Error> validate(const data::Record& record, const Result& result,
                                          const ValidateOptions& options) {
  return validate(record, candidate_of(result), options);
}

}  // namespace resonid::identification
