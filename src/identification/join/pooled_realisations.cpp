// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <identification/identify/measure/distortion.hpp>
#include <identification/identify/measure/methods.hpp>
#include <identification/identify/prepare/excitation_source.hpp>
#include <identification/join/pooled_realisations.hpp>
#include <iterator>
#include <tuple>

namespace resonid::identification::detail {
namespace {

tl::unexpected<Error> refused(std::string message) {
  return tl::unexpected(Error{"records", "best-linear: " + std::move(message)});
}

struct Parts {
  std::vector<data::Record> records;
  std::size_t period_samples = 0;
};

expected<Parts, Error> parts_of(std::span<const data::Record> records, const Options& options) {
  Parts all;
  for (data::Record record : records) {
    (void)complete_excitation(record, options);
    const std::size_t period = period_of(record, options);
    if (all.period_samples == 0) all.period_samples = period;
    if (period == 0 || period != all.period_samples)
      return refused(fmt::format(
          "the excitation of {} {}; required the same period in all recordings", record.source,
          period == 0 ? std::string("shows no period")
                      : fmt::format("repeats after {} samples instead of {}", period, all.period_samples)));
    auto parts = response::realisations_of(record, period);
    if (parts.empty())
      return refused(fmt::format("{} holds fewer than three periods of {} samples", record.source, period));
    std::move(parts.begin(), parts.end(), std::back_inserter(all.records));
  }
  if (const auto pair = response::no_realisations(all.records, all.period_samples))
    return refused(
        fmt::format("{} and {} are no realisations of one excitation; required the same amplitudes "
                    "with other random phases",
                    all.records[pair->first].source, all.records[pair->second].source));
  return all;
}

}  // namespace

expected<PooledResponse, Error> pooled_response(std::span<const data::Record> records,
                                                const Options& options) {
  const auto parts = parts_of(records, options);
  if (!parts) return tl::unexpected(parts.error());
  response::BestLinearConfig config;
  config.period_samples = parts->period_samples;
  config.drop_periods = std::max<std::size_t>(options.drop_periods, 1) - 1;  // one is off already
  config.lines_hz = options.lines_hz;
  if (options.band_hz) std::tie(config.band_low_hz, config.band_high_hz) = *options.band_hz;
  const bool excited = parts->records.front().excitation.present();
  const response::ResponseOptions form{
      options.approach.value_or(excited ? Approach::joint : Approach::direct), options.controller,
      options.delay_s};
  const auto found = response::best_linear_approximation(parts->records, config, form.approach);
  if (!found)
    return refused(fmt::format("{} {}", found.error().field.view(), found.error().requirement.view()));
  auto response = response::plant_response(found->lines, form);
  if (!response || response->lines() == 0) return refused("the recordings share no line");
  std::optional<Distortion> distortion = distortion_of(*found, form, *response);
  add_detection_lines(parts->records, parts->period_samples, distortion);
  return PooledResponse{std::move(*response), std::move(*distortion)};
}

}  // namespace resonid::identification::detail
