// SPDX-License-Identifier: MIT
// Results as JSON, of every kind: what is read can be written.
#include <nlohmann/json.hpp>
#include <resonid/identification/compare.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/identification/tune.hpp>
#include <resonid/identification/validate.hpp>
#include <resonid/planning/plan.hpp>
#include <resonid/report/detail/batch.hpp>
#include <resonid/report/detail/truth.hpp>
#include <resonid/report/json.hpp>
#include <string>

#include "input_file.hpp"

namespace {

using namespace resonid;

template <class T>
void read_and_write(const nlohmann::json& json) {
  if (const auto result = report::from_json<T>(json)) static_cast<void>(report::to_json(*result));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto json = nlohmann::json::parse(data, data + size, nullptr, false);
  if (json.is_discarded()) return 0;
  read_and_write<identification::Result>(json);
  read_and_write<report::BatchResult>(json);
  read_and_write<identification::Track>(json);
  read_and_write<identification::ModelValidation>(json);
  read_and_write<identification::Changes>(json);
  read_and_write<planning::Plan>(json);
  read_and_write<identification::Tuning>(json);
  read_and_write<report::SimulatedTruth>(json);
  static_cast<void>(report::from_json<identification::CandidateModel>(json));
  return 0;
}
