// SPDX-License-Identifier: MIT
#include <resonid/io/detail/experiment_schema.hpp>
#include <resonid/plant/experiment.hpp>

#include "io/experiment_introduction.hpp"
#include "io/schema.hpp"

namespace resonid::io {
namespace {

struct ExperimentChecks {
  template <class Config>
  expected<void, Error> operator()(const Config& config) const {
    return check(config);
  }
  expected<void, Error> operator()(const online::ExcitationConfig& config) const {
    constexpr double kAnyRateHz = 1000.0;
    const auto made = online::Excitation::create(config, kAnyRateHz);
    if (!made) return unexpected<Error>(made.error());
    return {};
  }
};

}  // namespace

std::string experiment_schema() {
  return std::string(kExperimentIntroduction) +
         schema::chapters_of(plant::ExperimentConfig{}, ExperimentChecks{});
}

}  // namespace resonid::io
