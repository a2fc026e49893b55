// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/measure/measure.hpp>
#include <identification/identify/measure/methods.hpp>
#include <identification/identify/prepare/prepare.hpp>
#include <identification/linear_simulation.hpp>
#include <identification/validate/evidence.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/response/line_estimates.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::identification::detail {
namespace {

using Complex = std::complex<double>;

/// V sqrt(lambda) of a covariance, column by column; scaled first, as parameters differ by many decades.
Eigen::MatrixXd deviations_of(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd sd = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd inverse = (sd.array() > 0.0).select(sd.cwiseMax(1e-300).cwiseInverse(), 0.0);
  const auto axes = linalg::symmetric_eigenpairs(inverse.asDiagonal() * covariance * inverse.asDiagonal());
  return sd.asDiagonal() * axes.vectors * axes.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

/// The candidate's response as a measurement shows it, for velocity, with its standard deviation.
data::FrequencyResponse response_of(const ModelValidation& v, const std::vector<double>& frequency_hz,
                                    double sample_time_s) {
  const auto& c = v.candidate;
  if (c.model) {
    auto drive = c.model->drive;
    drive.sample_time_s = sample_time_s;
    drive.known_delay_s = v.known_delay_s;
    auto response = drive.response(frequency_hz);
    response.value = drive.values(frequency_hz, true);
    return response;
  }
  data::FrequencyResponse response;
  if (c.covariance.size() > 0) {
    response =
        fit::BlackBoxModel{*c.transfer_function, c.delay_samples, v.known_delay_s, c.covariance, {}}.response(
            frequency_hz);
  } else {
    response.frequency_hz = frequency_hz;
    for (const double f : frequency_hz) response.value.push_back(c.transfer_function->response(f));
    response.std.assign(frequency_hz.size(), 0.0);
  }
  return response::to_velocity(std::move(response), c.output_quantity, sample_time_s);
}

/// By the same method as the record itself: what is left may look like another excitation.
Options as_measured(Options options, const std::string& method) {
  if (const auto own = from_name<Method>(method)) options.method = *own;
  return options;
}

/// The response at the lines of the measured one: what is left chooses neither band nor resolution.
expected<data::FrequencyResponse, Error> response_at(const Experiment& experiment, const Options& own,
                                                     const std::vector<double>& hz) {
  const auto& left = experiment.record;
  Plan plan = experiment.plan;
  if (plan.method == Method::welch && plan.period_samples == 0 && hz.size() > 1) {
    const double spacing = hz[1] - hz[0];
    plan.segment_samples = static_cast<std::size_t>(std::lround(left.sample_rate_hz / spacing));
    plan.low_hz = hz.front() - 0.5 * spacing;
    plan.high_hz = std::min(hz.back() + 0.5 * spacing, 0.5 * left.sample_rate_hz);
  } else if (plan.method == Method::local_rational) {
    plan.grid_hz = hz;
  } else {
    auto result = identify(left, own);
    if (!result) return tl::unexpected(result.error());
    return std::move(result->response);
  }
  return measure_response(left, plan, own);
}

/// The record's experiment with the residual in the place of the output.
expected<Experiment, Error> experiment_of_residual(const data::Record& record, const Options& own,
                                                   const ModelValidation& v) {
  const auto put = [&](std::vector<double>& output) {
    std::fill(output.begin(), output.end(), 0.0);
    std::copy(v.residual.begin(), v.residual.end(),
              output.begin() + static_cast<std::ptrdiff_t>(v.first_sample));
  };
  auto experiment = plan_experiment(record, own);
  if (!experiment) return experiment;
  if (experiment->record.samples() == record.samples()) {
    put(experiment->record.output.samples);
    return experiment;
  }
  data::Record left = record;
  put(left.output.samples);
  return plan_experiment(left, own);
}

/// From input to residual; in closed-loop prediction that is S times the model's error.
std::optional<data::FrequencyResponse> error_response(const data::Record& record, const Options& options,
                                                      const Options& own, const ModelValidation& v,
                                                      const data::FrequencyResponse& model) {
  const auto experiment = experiment_of_residual(record, own, v);
  if (!experiment) return std::nullopt;
  auto measured = response_at(*experiment, own, model.frequency_hz);
  if (!measured || measured->frequency_hz != model.frequency_hz) return std::nullopt;
  auto& error = *measured;
  if (v.approach != "indirect" || !options.controller) return std::move(error);
  for (std::size_t i = 0; i < error.lines(); ++i) {
    const double f = error.frequency_hz[i];
    const Complex loop =
        options.controller->response(f) * model.value[i] * std::polar(1.0, -kTwoPi * f * options.delay_s);
    error.value[i] *= 1.0 + loop;
    if (!error.std.empty()) error.std[i] *= std::abs(1.0 + loop);
  }
  return std::move(error);
}

/// rms over the lines of |error|/|G| beyond the noise, and its lower limit: |error|^2 of a line scatters by
/// sigma^4 + 2 sigma^2 |error|^2, and neighbouring lines share some of it.
void put_error(const data::FrequencyResponse& model, const data::FrequencyResponse& error,
               ModelValidation& v) {
  constexpr double kShared = 3.0;  // lines per independent one
  constexpr double kLow = 1.645;
  double sum = 0.0, scatter = 0.0, lines = 0.0;
  for (std::size_t i = 0; i < model.lines(); ++i) {
    const double size = std::norm(model.value[i]);
    const double noise = std::pow(error.std.empty() ? 0.0 : error.std[i], 2) +
                         std::pow(model.std.empty() ? 0.0 : model.std[i], 2);
    if (!(size > 0.0) || noise > kCriteria.usable_error * size || !std::isfinite(size)) continue;
    const double beyond = (std::norm(error.value[i]) - noise) / size;
    sum += beyond;
    scatter += kShared * (std::pow(noise / size, 2) + 2.0 * noise / size * std::max(0.0, beyond));
    lines += 1.0;
  }
  if (lines == 0.0) return;
  v.response_error = std::sqrt(std::max(0.0, sum / lines));
  v.response_error_low = std::sqrt(std::max(0.0, (sum - kLow * std::sqrt(scatter)) / lines));
}

/// Probability that noise alone depends so strongly on what drives the machine around a line, at any of the
/// judged lines.
double dependence_around(const data::Record& record, double frequency_hz,
                         const data::FrequencyResponse& lines,
                         const diagnostics::ModelUncertainty& uncertainty, const ModelValidation& v) {
  const bool excited = record.excitation.present();
  const auto& drives = excited ? record.excitation : record.input;
  const double spacing = (lines.frequency_hz.back() - lines.frequency_hz.front()) /
                         static_cast<double>(std::max<std::size_t>(1, lines.lines() - 1));
  const double half = std::max({4.0 * spacing, 2.0 / record.duration_s(), 0.03 * frequency_hz});
  const double single =
      diagnostics::dependence_at(v.residual, std::span(drives.samples).subspan(v.first_sample),
                                 {frequency_hz, half, record.sample_rate_hz, !excited}, uncertainty);
  return -std::expm1(static_cast<double>(lines.lines()) * std::log1p(-std::min(single, 1.0 - 1e-16)));
}

void put_bands(double sample_rate_hz, ModelValidation& v) {
  const auto& y = v.output_spectrum;
  const auto& e = v.residual_spectrum;
  const double nyquist = 0.5 * sample_rate_hz;
  const double output = y.between(0.0, 2.0 * nyquist), residual = e.between(0.0, 2.0 * nyquist);
  if (y.frequency_hz.size() < 2 || !(output > 0.0) || !(residual > 0.0)) return;
  constexpr double kLinesPerBand = 4.0;
  double high = 1.01 * nyquist;  // the last line belongs to it
  while (high > 0.0) {
    double low = high > nyquist ? 0.5 * nyquist : 0.5 * high;
    if (low < kLinesPerBand * y.frequency_hz[1]) low = 0.0;
    const double py = y.between(low, high), pe = e.between(low, high);
    v.bands.push_back({low, std::min(high, nyquist), py / output, pe / residual, py > 0.0 ? pe / py : 0.0});
    high = low;
  }
  std::reverse(v.bands.begin(), v.bands.end());
}

void put_maps(const data::Record& record, ModelValidation& v) {
  const auto& c = v.candidate;
  if (v.approach == "indirect" || record.output_quantity != data::OutputQuantity::velocity) return;
  auto g = c.model ? c.model->drive.transfer_function() : *c.transfer_function;
  const double delay_s = v.known_delay_s + (c.model ? c.model->drive.delay_s : 0.0);
  const auto delay =
      c.delay_samples > 0
          ? c.delay_samples
          : static_cast<std::size_t>(std::max(0.0, std::round(delay_s * record.sample_rate_hz)));
  if (!can_be_simulated(g, v.residual.size()) || delay >= v.residual.size()) return;
  const auto input = std::span(record.input.samples).subspan(v.first_sample);
  // As measured: friction makes the simulated velocity wrong. What acts now is seen `delay` samples later,
  // and the answer begins a sample after that, so the noise of this sample is not in it.
  std::vector<double> velocity(
      record.output.samples.begin() + static_cast<std::ptrdiff_t>(v.first_sample + delay),
      record.output.samples.end());
  velocity.resize(v.simulated.size(), velocity.back());
  const auto answer = delayed(std::move(g), delay);
  constexpr std::size_t kBins = 12;
  // More would tell nothing that these do not.
  constexpr std::size_t kMost = std::size_t{1} << 19;
  const std::size_t n = std::min(v.residual.size(), kMost);
  const auto first_of = [n](std::span<const double> x) { return x.first(n); };
  const auto add = [&](const char* name, std::span<const double> over) {
    const auto bins = diagnostics::bins_of(over, kBins);
    std::vector<std::vector<double>> answers;
    std::vector<double> member(over.size());
    const std::size_t count = 1 + *std::max_element(bins.begin(), bins.end());
    for (std::size_t b = 0; b < count && count > 2; ++b) {
      for (std::size_t k = 0; k < member.size(); ++k) member[k] = bins[k] == b ? 1.0 : 0.0;
      answers.push_back(answer.simulate(member));
    }
    const auto lags = std::max(delay + 1, std::min<std::size_t>(25, n / 100));
    auto map = diagnostics::static_map(
        {first_of(v.residual), first_of(input), first_of(v.simulated), over, answers, delay + 1}, bins, lags);
    map.over = name;
    if (!map.level.empty()) v.maps.push_back(std::move(map));
  };
  add("velocity", first_of(velocity));
  add("input", first_of(input));
}

}  // namespace

std::optional<std::pair<double, double>> known_band(const data::FrequencyResponse& response) {
  std::optional<std::pair<double, double>> band;
  for (std::size_t i = 0; i < response.lines() && i < response.std.size(); ++i) {
    if (!(response.std[i] < kCriteria.usable_line * std::abs(response.value[i]))) continue;
    const double f = response.frequency_hz[i];
    if (!band) band.emplace(f, f);
    band->second = f;
  }
  if (band && !(band->second > band->first)) band.reset();
  return band;
}

std::vector<CandidateModel> moved_by_deviations(const CandidateModel& candidate, double step) {
  std::vector<CandidateModel> list;
  if (candidate.model) {
    const auto directions = deviations_of(candidate.model->drive.covariance);
    for (Eigen::Index j = 0; j < directions.cols(); ++j) {
      if (!(directions.col(j).norm() > 0.0) || !directions.col(j).allFinite()) continue;
      auto moved = candidate;
      auto& drive = moved.model->drive;
      for (int i = 0; i < fit::kParameterCount; ++i)
        if (directions(i, j) != 0.0) drive = drive.moved(i, step * directions(i, j));
      list.push_back(std::move(moved));
    }
    return list;
  }
  const auto& g = *candidate.transfer_function;
  const auto zeros = static_cast<Eigen::Index>(g.numerator.size());
  if (candidate.covariance.rows() != zeros + static_cast<Eigen::Index>(g.denominator.size()) - 1) return list;
  const auto directions = deviations_of(candidate.covariance);
  for (Eigen::Index j = 0; j < directions.cols(); ++j) {
    if (!(directions.col(j).norm() > 0.0) || !directions.col(j).allFinite()) continue;
    auto moved = candidate;
    auto& to = *moved.transfer_function;
    for (Eigen::Index i = 0; i < directions.rows(); ++i)
      (i < zeros ? to.numerator[static_cast<std::size_t>(i)]
                 : to.denominator[static_cast<std::size_t>(i - zeros + 1)]) += step * directions(i, j);
    list.push_back(std::move(moved));
  }
  return list;
}

void compare_with_response(const data::Record& record, const Options& options, const Options& own,
                           const Result& measured,
                           const std::function<const diagnostics::ModelUncertainty&()>& uncertainty,
                           ModelValidation& v) {
  auto model = response_of(v, measured.response.frequency_hz, record.sample_time_s());
  v.measured = measured.response;
  const auto error = error_response(record, options, as_measured(own, measured.method), v, model);
  if (error) {
    const auto [low, high] = v.judged ? std::pair(v.judged->low_hz, v.judged->high_hz)
                                      : std::pair(0.0, 0.5 * record.sample_rate_hz);
    const auto judged = model.band(low, high), differs = error->band(low, high);
    put_error(judged, differs, v);
    auto shown = *error;  // what the record says the drive is
    for (std::size_t i = 0; i < shown.lines(); ++i) shown.value[i] += model.value[i];
    v.gap = diagnostics::gap_curve(shown, model);
    const auto among = diagnostics::gap_curve(shown.band(low, high), judged);
    if (!among.noise.empty()) {
      const std::size_t worst = among.most_excessive();
      const double f = among.frequency_hz[worst];
      const double relative = std::abs(error->at(f)) / std::max(std::abs(model.at(f)), 1e-300);
      v.worst_line_hz = f;
      v.worst_line_error = relative * std::sqrt(std::max(0.0, 1.0 - std::pow(among.excess(worst), -2)));
      v.response_probability = among.chance();
      constexpr double kAskTwice = 0.05;
      if (*v.response_probability < kAskTwice)
        v.response_probability =
            std::max(*v.response_probability, dependence_around(record, f, judged, uncertainty(), v));
    }
  }
  v.modelled = std::move(model);
}

void put_spectra(const data::Record& record, const ValidateOptions& options, ModelValidation& v) {
  const auto output = std::span(record.output.samples).subspan(v.first_sample);
  v.output_spectrum = response::power_spectrum(output, record.sample_rate_hz);
  v.residual_spectrum = response::power_spectrum(v.residual, record.sample_rate_hz);
  put_bands(record.sample_rate_hz, v);
  if (options.fit_band_hz) {
    const auto [low, high] = *options.fit_band_hz;
    const double all = v.output_spectrum.between(low, high);
    v.fit_band_hz = options.fit_band_hz;
    if (all > 0.0) v.fit_in_band_percent = fit_percent_of(v.residual_spectrum.between(low, high), all);
  }
  if (!v.judged) return;
  const double all = v.output_spectrum.between(v.judged->low_hz, v.judged->high_hz);
  const double left = v.residual_spectrum.between(v.judged->low_hz, v.judged->high_hz);
  if (!(all > 0.0)) return v.judged.reset();
  v.judged->fit_percent = fit_percent_of(left, all);
  v.judged->residual_rms = std::sqrt(left);
}

void look_into_residual(const data::Record& record, const diagnostics::ModelUncertainty& uncertainty,
                        ModelValidation& v) {
  const auto part = [&](const data::Channel& c) { return std::span(c.samples).subspan(v.first_sample); };
  const auto output = part(record.output);
  const bool excited = record.excitation.present();
  const auto lags =
      std::max(v.residual_test.judged_lags, std::min(v.residual_test.max_lag, v.residual.size() / 20));
  v.dependence = diagnostics::residual_dependence(
      v.residual, part(excited ? record.excitation : record.input), lags, uncertainty);
  v.dependence.on = excited ? "excitation" : "input";
  if (v.candidate.own) {
    const double total = squares_about_mean(output), rms = v.candidate.own->rms;
    if (total > 0.0)
      v.expected_fit_percent = fit_percent_of(rms * rms * static_cast<double>(output.size()), total);
  }
  put_maps(record, v);
}

}  // namespace resonid::identification::detail
