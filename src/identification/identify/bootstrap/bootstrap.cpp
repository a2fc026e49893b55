// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/bootstrap/bootstrap.hpp>
#include <identification/identify/bootstrap/record_replicas.hpp>
#include <identification/identify/judge/modes.hpp>
#include <identification/identify/select/record_fit.hpp>
#include <identification/identify/select/select_black_box.hpp>
#include <mutex>
#include <numbers>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/response_fit.hpp>
#include <resonid/identification/detail/figures.hpp>
#include <resonid/online/excitation/detail/splitmix64.hpp>
#include <resonid/plant/detail/white_noise.hpp>

#include "linalg/parallel.hpp"

namespace resonid::identification::detail {
namespace {

std::uint64_t seed_of(std::uint64_t seed, std::size_t replica) {
  online::SplitMix64 mix(seed);
  const std::uint64_t own = mix.next();
  online::SplitMix64 far(own + 0x9e3779b97f4a7c15ULL * (replica + 1));
  return far.next();
}

/// Repeats the measured lines of a model that was fitted to the response.
class LineReplicas {
 public:
  LineReplicas(const data::Record& record, const Options& options, const Result& result)
      : lines_(result.response) {
    const auto& drive = result.model->drive;
    lines_.value = drive.values(lines_.frequency_hz, true);
    const double error = result.model->model_error;
    for (std::size_t i = 0; i < lines_.lines(); ++i)
      spread_.push_back(std::hypot(lines_.std[i], error * std::abs(lines_.value[i])));
    config_.structure = drive.structure;
    config_.sample_time_s = record.sample_time_s();
    config_.known_delay_s = options.delay_s;
    config_.viscous_friction = drive.estimated[fit::kViscousFriction];
    config_.delay = drive.estimated[fit::kDelay];
    config_.further = drive.further();
    config_.initial = drive;
  }

  [[nodiscard]] std::optional<Result> fitted(std::uint64_t seed) const {
    auto lines = lines_;
    plant::WhiteNoise white(seed, 1.0 / std::numbers::sqrt2);  // of real and imaginary part
    for (std::size_t i = 0; i < lines.lines(); ++i) {
      const double real = white.step();
      lines.value[i] += spread_[i] * std::complex<double>(real, white.step());
    }
    auto fit = fit::fit_response(lines, config_);
    if (!fit || !fit->converged) return std::nullopt;
    Result replica;
    replica.model = ModelResult{fit->model, false, 0.0, std::nullopt, std::nullopt};
    return replica;
  }

 private:
  data::FrequencyResponse lines_;
  std::vector<double> spread_;
  fit::ResponseFitConfig config_;
};

/// All figures of one repetition; none when its fit did not come out.
std::vector<Figure> figures_of(std::optional<Result> replica, const Units& units,
                               const LoopOfModel& loop_of_model, std::pair<double, double> modes_hz) {
  if (!replica) return {};
  replica->units = units;
  // Its margins need no error bars of their own.
  if (replica->model) {
    replica->modes = replica->model->drive.modes();
    auto drive = replica->model->drive;
    drive.covariance.setZero();
    drive.estimated.fill(false);
    replica->loop = loop_of_model(drive);
  } else {
    auto model = replica->black_box->model;
    replica->modes = modes_of(model, modes_hz.first, modes_hz.second);
    model.realisation.covariance.resize(0, 0);
    replica->loop = loop_of_model(model);
  }
  return figures(*replica);
}

Bootstrap summary(const std::vector<Figure>& told, const std::vector<std::vector<Figure>>& replicas,
                  double confidence) {
  Bootstrap bootstrap;
  for (const auto& r : replicas) ++(r.empty() ? bootstrap.failed : bootstrap.replicas);
  for (const auto& figure : told) {
    std::vector<double> values;
    for (const auto& r : replicas)
      if (const auto* same = find(r, figure.name)) values.push_back(same->value);
    // A figure that most replicas lack (a crossover that noise takes away) has no interval.
    if (values.size() < 2 || 2 * values.size() < bootstrap.replicas) continue;
    std::sort(values.begin(), values.end());
    const double tail = 0.5 * (1.0 - confidence);
    bootstrap.intervals.push_back(
        {figure.name,
         figure.unit,
         ordered_quantile(values, tail),
         ordered_quantile(values, 1.0 - tail),
         std::sqrt(squares_about_mean(values) / static_cast<double>(values.size() - 1)),
         {}});
  }
  for (const auto& r : replicas) {
    const bool complete = std::all_of(bootstrap.intervals.begin(), bootstrap.intervals.end(),
                                      [&](const BootstrapInterval& i) { return find(r, i.name) != nullptr; });
    if (!complete) continue;
    for (auto& i : bootstrap.intervals) i.values.push_back(find(r, i.name)->value);
  }
  return bootstrap;
}

}  // namespace

Bootstrap bootstrap(const Repetition& repetition, const Options& options, const Result& result,
                    const LoopOfModel& loop_of_model, std::pair<double, double> modes_hz) {
  std::vector<std::vector<Figure>> replicas(options.bootstrap);
  std::mutex telling;
  std::size_t done = 0;
  linalg::for_each_index(options.bootstrap, options.jobs, [&](std::size_t i) {
    replicas[i] = figures_of(repetition(seed_of(options.seed, i)), result.units, loop_of_model, modes_hz);
    const std::lock_guard lock(telling);
    ++done;
    constexpr std::size_t kSteps = 10;  // tenths are told
    if (options.progress && done * kSteps / options.bootstrap != (done - 1) * kSteps / options.bootstrap)
      options.progress(fmt::format("bootstrap, {} of {} done", done, options.bootstrap));
  });
  return summary(figures(result), replicas, options.confidence);
}

std::optional<diagnostics::Finding> inspect_bootstrap(const Bootstrap& bootstrap, const Result& result) {
  if (!result.model || result.model->from_record) return std::nullopt;
  std::vector<double> ratios;
  const auto told = figures(result);
  for (const auto& i : bootstrap.intervals)
    if (const auto* figure = find(told, i.name); figure != nullptr && figure->std)
      ratios.push_back(i.std / *figure->std);
  const double typical = ratios.empty() ? 1.0 : median(std::move(ratios));
  if (typical >= kCriteria.bootstrap_scatter) return std::nullopt;
  return diagnostics::Finding{
      "no-bootstrap", diagnostics::Severity::warning, typical, kCriteria.bootstrap_scatter,
      fmt::format(
          "No bootstrap intervals: the standard deviation of the replicas is only {:.2g} of the error bars. "
          "The model was "
          "fitted to the response and misses its lines systematically, or neighbouring lines are correlated. "
          "Replicas with independent noise on the lines do not show that; the covariance includes it: use "
          "its intervals.",
          typical)};
}

Repetition repetition_of(const data::Record& record, const Plan& plan, const Options& options,
                         const Result& result) {
  if (result.black_box || (result.model->from_record && !result.residual.empty()))
    return [replicas = RecordReplicas(record, plan, options, result)](std::uint64_t seed) {
      return replicas.fitted(seed);
    };
  return [replicas = LineReplicas(record, options, result)](std::uint64_t seed) {
    return replicas.fitted(seed);
  };
}

Repetition repetition_of(std::span<const data::Record> records, const Plan& plan, const Options& options,
                         const ModelResult& model) {
  auto simulation = config_of(model, records, options, plan.loop_controller);
  simulation.fixed_model = true;
  simulation.noise_model = false;
  auto fits = fit_records(records, simulation);
  if (!fits) return {};
  std::vector<RecordReplicas> replicas;
  for (std::size_t r = 0; r < records.size(); ++r) {
    Result one;
    one.model = model;
    one.residual = std::move(fits->records[r].residual);
    one.residual_start = fits->records[r].first_sample;
    replicas.emplace_back(records[r], plan, options, one);
  }
  return [replicas = std::move(replicas), config = config_of(model, records, options, plan.loop_controller)](
             std::uint64_t seed) -> std::optional<Result> {
    std::vector<data::Record> repeated;
    for (std::size_t r = 0; r < replicas.size(); ++r)
      repeated.push_back(replicas[r].repeated(seed_of(seed, r)));
    const auto fit = fit_records(repeated, config);
    if (!fit || !fit->converged) return std::nullopt;
    Result replica;
    replica.model =
        ModelResult{fit->model, true, 0.0, fit->coulomb_friction, std::nullopt, fit->further_friction};
    return replica;
  };
}

void put_bootstrap(const Experiment& experiment, const Measurement& m, const Options& options,
                   Result& result) {
  const LoopOfModel loop_of_model = [&, real = with_real_controller(m, options)](const PlantModel& model) {
    return loop_of(m.plan, real, m.lines, result.response, model);
  };
  auto found = bootstrap(repetition_of(experiment.record, m.plan, options, result), options, result,
                         loop_of_model, visible_modes_hz(m.plan));
  if (auto finding = inspect_bootstrap(found, result))
    result.findings.push_back(std::move(*finding));
  else
    result.bootstrap = std::move(found);
}

}  // namespace resonid::identification::detail
