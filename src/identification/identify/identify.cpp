// SPDX-License-Identifier: MIT
#include <identification/identify/bootstrap/bootstrap.hpp>
#include <identification/identify/judge/judge.hpp>
#include <identification/identify/judge/root_cause.hpp>
#include <identification/progress.hpp>
#include <resonid/identification/identify.hpp>

namespace resonid::identification {

expected<Result, Error> identify(const data::Record& record, const Options& given) {
  if (given.bootstrap > 0 && record.second_output.present())
    return tl::unexpected(
        Error{"bootstrap", "repeats the experiment with one output; leave .second_output out for it"});
  Options options = detail::sampled(given, record);

  const auto experiment = detail::plan_experiment(record, options);
  if (!experiment) return tl::unexpected(experiment.error());

  detail::tell(options, "measuring the response");
  const auto measurement = detail::measure(*experiment, options);
  if (!measurement) return tl::unexpected(measurement.error());

  if (options.model == ModelChoice::automatic && detail::is_misnamed(measurement->findings))
    options.model = ModelChoice::none;
  auto fitted = detail::select(*experiment, *measurement, options);
  if (!fitted) return tl::unexpected(std::move(fitted.error()));

  detail::tell(options, "margins of the loop");
  Result result = detail::judge(*experiment, *measurement, std::move(*fitted), options);

  if (options.bootstrap > 0 && (result.model || result.black_box)) {
    detail::tell(options, "bootstrap");
    detail::put_bootstrap(*experiment, *measurement, options, result);
  }
  detail::conclude(given, result);
  return result;
}

}  // namespace resonid::identification
